//! How often a closed mesh surrounds positions: on a lattice by the crossings of its lines, and of particles by rays.

use frazil::geometry::check::topology::components;
use frazil::geometry::spatial::bvh::Bvh;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use rayon::prelude::*;

use crate::common::liquids::Random;
use crate::common::nearest::distances;
use crate::common::repaired::{height, turns};

/// Positions of the lattice along a cell.
const POSITIONS: f64 = 4.0;
/// Most lines of a lattice.
const MOST: usize = 1 << 22;
/// How far positions of the lattice lie from the middles of their boxes at most (steps).
const JITTER: f64 = 0.45;
/// Directions along which no edges of made meshes run. Rounding may let a ray pass by a thin triangle, but not in all of them.
const ASLANT: [DVec3; 3] = [
    DVec3::new(0.5773, 0.6533, 0.4896),
    DVec3::new(-0.3719, 0.8411, -0.3919),
    DVec3::new(0.7127, -0.2893, -0.6391),
];

/// A line of the lattice along z; in steps from the lattice's corner.
struct Line {
    /// Its x and y.
    at: [f64; 2],
    /// The height of its first position; the others are one step apart.
    first: f64,
    /// Heights at which the mesh passes it, and by how much more often it surrounds what is below.
    crossings: Vec<(f64, i32)>,
}

/// How deep the positions are that a closed mesh surrounds neither once nor never (cells, whose edge is `cell` m), and their share of its
/// volume: on a lattice of [`PLACES`] along a cell. Infinite where the mesh reaches too far for one.
pub fn depth_and_share(mesh: &TriMesh, cell: f64) -> [f64; 2] {
    let step = cell / POSITIONS;
    let Some(positions) = astray(mesh, step) else { return [f64::INFINITY; 2] };
    let depth = distances(mesh, &positions, step).into_iter().fold(0.0, f64::max);
    // What is turned inside out has no volume: then the share keeps no bound.
    [depth / cell, positions.len() as f64 * step.powi(3) / mesh.volume().max(0.0)]
}

/// Positions of a lattice (m), `step` (m) apart and out of line by chance, that a closed mesh surrounds neither once nor never. None where
/// it reaches too far for a lattice.
fn astray(mesh: &TriMesh, step: f64) -> Option<Vec<Vec3>> {
    let (low, high) = mesh.bounds()?;
    let corner = low.cast::<f64>() - DVec3::repeat(step);
    let size = (high.cast::<f64>() - corner) / step;
    let [wide, deep] = [size.x, size.y].map(|length| length.floor() as usize + 1);
    if wide.saturating_mul(deep) > MOST {
        return None;
    }
    let mut random = Random(7);
    let mut within = |at: usize| at as f64 + 0.5 + JITTER * random.next();
    let mut lines: Vec<Line> = (0..wide * deep)
        .map(|n| Line { at: [within(n / deep), within(n % deep)], first: within(0), crossings: Vec::new() })
        .collect();
    for triangle in 0..mesh.triangles.len() {
        let corners = mesh.corners(triangle).map(|position| (position - corner) / step);
        let [a, b, c] = corners;
        let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        let range = |axis: usize| {
            let [from, to] = [low[axis] as usize, high[axis] as usize];
            from..=to
        };
        for n in range(0).flat_map(|i| range(1).map(move |j| i * deep + j)) {
            let line = &mut lines[n];
            let turns = turns(&corners, line.at);
            if turns != 0 {
                line.crossings.push((height(&corners, line.at), turns));
            }
        }
    }
    let mut positions = Vec::new();
    for line in &mut lines {
        line.crossings.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let mut winding = 0;
        for pair in line.crossings.windows(2) {
            winding += pair[0].1;
            if (0..=1).contains(&winding) {
                continue;
            }
            let [above, below] = [pair[0].0, pair[1].0].map(|height| height - line.first);
            let [from, to] = [below.ceil() as i64, above.floor() as i64];
            for n in from..=to {
                let at = DVec3::new(line.at[0], line.at[1], line.first + n as f64);
                positions.push((corner + at * step).cast::<f32>());
            }
        }
    }
    Some(positions)
}

/// How many of some places (m) a closed mesh surrounds once.
pub fn inside(mesh: &TriMesh, positions: &[DVec3]) -> usize {
    let tree = Bvh::new(mesh);
    let is_inside = |position: &&DVec3| ASLANT.iter().any(|way| tree.winding_number(**position, *way) == 1);
    positions.par_iter().filter(is_inside).count()
}

/// How many parts of a closed mesh with a volume over 0 surround none of some places (m).
pub fn empty_parts(mesh: &TriMesh, positions: &[DVec3]) -> usize {
    let is_empty = |part: &&Vec<u32>| part_volume(mesh, part) > 0.0 && !surrounds(mesh, part, positions);
    components(&mesh.triangles).par_iter().filter(is_empty).count()
}

/// Whether a part of a mesh, with these triangles, surrounds any of some places (m).
fn surrounds(mesh: &TriMesh, part: &[u32], places: &[DVec3]) -> bool {
    let corners = |triangle: &u32| mesh.triangles[*triangle as usize];
    let positions = part.iter().flat_map(corners).map(|vertex| mesh.positions[vertex as usize]).collect();
    let triangles = (0..part.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let part = TriMesh { positions, triangles };
    let Some((low, high)) = part.bounds() else { return false };
    let tree = Bvh::new(&part);
    places.iter().any(|place| {
        let at: Vec3 = place.cast();
        (0..3).all(|axis| (low[axis]..=high[axis]).contains(&at[axis]))
            && ASLANT.iter().any(|way| tree.winding_number(*place, *way) > 0)
    })
}

/// What a part of a mesh, with these triangles, encloses (m3); negative: a cavity.
pub fn part_volume(mesh: &TriMesh, part: &[u32]) -> f64 {
    let Some(first) = part.first() else { return 0.0 };
    let origin = mesh.corners(*first as usize)[0];
    let six = |triangle: &u32| {
        let [a, b, c] = mesh.corners(*triangle as usize).map(|position| position - origin);
        a.dot(&b.cross(&c))
    };
    part.iter().map(six).sum::<f64>() / 6.0
}
