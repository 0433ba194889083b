//! Estimates the spacing of particles from their positions.

use rayon::prelude::*;

use crate::geometry::DVec3;

/// Count of particles whose neighbours are searched: for an estimate, and for a rough one.
const SAMPLES: [usize; 2] = [256, 32];
/// In a cubic grid this many particles are one spacing away. In a liquid some are nearer and some farther, but their mean distance is about
/// the same (1.02 spacings in frames of two solvers' caches).
const NEIGHBOURS: usize = 6;

/// The spacing (m) of particles at positions (m): the median of the mean distance to the six nearest ones. None for fewer than seven
/// particles, or if too many lie at one position.
pub fn estimate(positions: &[DVec3]) -> Option<f64> {
    median(positions, SAMPLES[0])
}

/// As [`estimate`], to within a tenth or so, in an eighth of the time: to check whether a given spacing is plausible.
pub fn rough(positions: &[DVec3]) -> Option<f64> {
    median(positions, SAMPLES[1])
}

fn median(positions: &[DVec3], samples: usize) -> Option<f64> {
    // Sorted, so that the sampled particles do not depend on the input order.
    let mut order: Vec<usize> = (0..positions.len()).collect();
    let key = |at: &usize| positions[*at];
    order.par_sort_unstable_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
    });
    let step = order.len().div_ceil(samples).max(1);
    let mean = |at: &usize| {
        let mut nearest = [f64::INFINITY; NEIGHBOURS + 1];
        for position in positions {
            let square = (position - positions[*at]).norm_squared();
            if square < nearest[NEIGHBOURS] {
                let slot = nearest.partition_point(|other| *other <= square);
                nearest[slot..].rotate_right(1);
                nearest[slot] = square;
            }
        }
        // The nearest is the particle itself.
        nearest[1..].iter().map(|square| square.sqrt()).sum::<f64>() / NEIGHBOURS as f64
    };
    let samples: Vec<usize> = order.into_iter().step_by(step).collect();
    let mut distances: Vec<f64> = samples.par_iter().map(mean).collect();
    distances.sort_unstable_by(f64::total_cmp);
    let middle = *distances.get(distances.len() / 2)?;
    (middle > 0.0 && middle.is_finite()).then_some(middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spacing_of_a_grid_is_found_in_any_order() {
        let mut positions: Vec<DVec3> = (0..1000)
            .map(|n| DVec3::new(f64::from(n % 10), f64::from(n / 10 % 10), f64::from(n / 100)) * 0.3)
            .collect();
        let found = estimate(&positions).unwrap();
        assert!((found - 0.3).abs() < 0.1, "{found}");
        assert!((rough(&positions).unwrap() / found - 1.0).abs() < 0.2);
        positions.reverse();
        assert_eq!(estimate(&positions), Some(found));
        assert_eq!(estimate(&positions[..6]), None);
        assert_eq!(estimate(&[DVec3::zeros(); 20]), None);
    }
}
