//! Small isolated groups of particles: spray that gets no surface.

use super::grid::Cells;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::geometry::check::topology::Sets;
use crate::geometry::coords::around;

/// Whether each particle, at positions (m) whose spacing is `spacing` (m), belongs to a group of fewer than `min_count`. Two particles are
/// in the same group if they lie in the same cell of one spacing, or in cells that touch.
///
/// # Errors
/// Particles too far apart.
pub fn specks(positions: &[DVec3], spacing: f64, min_count: usize) -> Result<Vec<bool>> {
    let cells = Cells::new(positions, spacing, i64::from)?;
    let runs: Vec<&[u32]> = cells.runs().collect();
    let mut sets = Sets::new(runs.len());
    for (cell, coord) in cells.coords().enumerate() {
        for near in around(coord) {
            // Each pair of cells is found once, from its lower cell.
            if near > coord
                && let Some(other) = cells.find(near)
            {
                sets.join(cell as u32, other as u32);
            }
        }
    }
    let (groups, count) = sets.numbered();
    let mut counts = vec![0; count];
    groups.iter().zip(&runs).for_each(|(group, run)| counts[*group as usize] += run.len());
    let mut out = vec![false; positions.len()];
    for (group, run) in groups.iter().zip(&runs) {
        if counts[*group as usize] < min_count {
            run.iter().for_each(|particle| out[*particle as usize] = true);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_groups_are_found_whatever_their_order() {
        let line = |x: f64, count: i32| (0..count).map(move |n| DVec3::new(x, 0.1 * f64::from(n), 0.0));
        let positions: Vec<DVec3> = line(0.05, 12).chain(line(5.05, 3)).chain(line(-9.0, 4)).collect();
        let found = specks(&positions, 0.1, 4).unwrap();
        assert_eq!(found.iter().filter(|is| **is).count(), 3);
        assert!(found[12..15].iter().all(|is| *is));
        assert_eq!(specks(&positions, 0.1, 1).unwrap(), [false; 19]);
        assert!(specks(&positions, 0.1, 13).unwrap().iter().all(|is| *is));
    }
}
