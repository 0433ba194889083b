//! Gates of repairs: meshes with many faults become the solids that they mean, and what marching cubes makes of neighbours fits.

use std::time::Instant;

use frazil::geometry::marching_cubes::cases as cube_cases;

use crate::common::bodies::models;
use crate::common::repaired::failures;
use crate::harness::Harness;

/// How many meshes are repaired; fewer where `FRAZIL_FUZZ` says so.
const MESHES: u64 = 10_000;

pub fn run(h: &mut Harness) {
    h.measure("surface.cubes_fit", fit);
    h.measure("surface.repair_fuzz", fuzz);
}

fn fuzz() -> (f64, String) {
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(MESHES);
    let (start, models) = (Instant::now(), models());
    let failed = failures(0..count, &models, |failure| println!("# {failure}"));
    let note = format!(
        "{count} meshes, {} models from outside, {:.0} s on all cores",
        models.len(),
        start.elapsed().as_secs_f64()
    );
    (failed.len() as f64, note)
}

/// All patterns of the 12 corners of two cubes with a common face, one behind the other on each axis.
fn fit() -> (bool, String) {
    let (mut gaps, mut lines) = (0, 0);
    for pattern in 0..1usize << 12 {
        for axis in 0..3 {
            let [first, second] = [0, 1].map(|cube| case(pattern, axis, cube));
            let (mut behind, mut before) = (rim(first, axis, 1), rim(second, axis, 0));
            let is_closed = behind.len() == lines_across(first, axis) && before.len() == behind.len();
            before.iter_mut().for_each(|line| line.reverse());
            behind.sort_unstable();
            before.sort_unstable();
            gaps += usize::from(!is_closed || behind != before);
            lines += behind.len();
        }
    }
    (gaps == 0, format!("{gaps} gaps in 3 x 4096 pairs, {lines} lines on their common faces"))
}

/// Which corners of a cube are inside: of the first or the second along an axis, whose 12 corners a pattern says plane by plane.
fn case(pattern: usize, axis: usize, cube: usize) -> usize {
    let bits = [4, 2, 1];
    let others = [bits[(axis + 1) % 3], bits[(axis + 2) % 3]];
    let is_inside = |corner: usize| {
        let plane = cube + usize::from(corner & bits[axis] != 0);
        let [u, v] = others.map(|bit| usize::from(corner & bit != 0));
        pattern >> (4 * plane + 2 * u + v) & 1
    };
    (0..8).fold(0, |case, corner| case | is_inside(corner) << corner)
}

/// An edge of a cube: its lesser corner (bits x, y, z) and its axis.
type Edge = (usize, usize);

/// The sides of a case's triangles on a cube's face at the end of an axis (0 or 1) that no other triangle has the other way round;
/// their ends as those of the face at end 0.
fn rim(case: usize, axis: usize, end: usize) -> Vec<[Edge; 2]> {
    let bit = 4 >> axis;
    let is_on_face = |(corner, along): &Edge| *along != axis && (corner & bit != 0) == (end == 1);
    let mut open: Vec<[Edge; 2]> = Vec::new();
    for &[a, b, c] in &cube_cases()[case] {
        for side in [[a, b], [b, c], [c, a]] {
            if !side.iter().all(is_on_face) {
                continue;
            }
            let [from, to] = side.map(|(corner, along)| (corner & !bit, along));
            match open.iter().position(|other| *other == [to, from]) {
                Some(at) => _ = open.swap_remove(at),
                None => open.push([from, to]),
            }
        }
    }
    open
}

/// How many lines the surface must have on a cube's far face on an axis: each joins two edges whose ends differ.
fn lines_across(case: usize, axis: usize) -> usize {
    let bit = 4 >> axis;
    let differs = |corner: usize, along: usize| (case >> corner ^ case >> (corner | 4 >> along)) & 1;
    let of_edges = |along: usize| {
        let lesser = move |corner: &usize| corner & bit != 0 && corner & (4 >> along) == 0;
        (0..8).filter(lesser).map(|corner| differs(corner, along)).sum::<usize>()
    };
    (0..3).filter(|along| *along != axis).map(of_edges).sum::<usize>() / 2
}
