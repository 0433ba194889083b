//! Groups of a few particles apart from all others: spray too small for a surface.

use super::grid::Cells;
use crate::error::Result;
use crate::geometry::DVec3;

/// Which particles at positions (m), whose spacing is `spacing` (m), belong to groups of fewer than `least`. Two particles are in the same
/// group if the cells of one spacing that hold them touch.
///
/// # Errors
/// Particles too far apart.
pub fn specks(positions: &[DVec3], spacing: f64, least: usize) -> Result<Vec<bool>> {
    let cells = Cells::new(positions, spacing, i64::from)?;
    let runs: Vec<&[u32]> = cells.runs().collect();
    let mut parent: Vec<u32> = (0..runs.len() as u32).collect();
    for (cell, coord) in cells.coords().enumerate() {
        for n in 0..27 {
            let near = [coord[0] + n / 9 - 1, coord[1] + n / 3 % 3 - 1, coord[2] + n % 3 - 1];
            // Each pair of cells is found once, from its lower cell.
            if near > coord
                && let Some(other) = cells.find(near)
            {
                let [a, b] = [cell as u32, other as u32].map(|at| root(&mut parent, at));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let roots: Vec<u32> = (0..runs.len() as u32).map(|cell| root(&mut parent, cell)).collect();
    let mut counts = vec![0; runs.len()];
    roots.iter().zip(&runs).for_each(|(root, run)| counts[*root as usize] += run.len());
    let mut out = vec![false; positions.len()];
    for (root, run) in roots.iter().zip(&runs) {
        if counts[*root as usize] < least {
            run.iter().for_each(|particle| out[*particle as usize] = true);
        }
    }
    Ok(out)
}

/// The root of a group in a forest of parents.
pub fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
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
