//! The surface where a function at nodes is 0, as triangles, by marching cubes.

use rayon::prelude::*;

use super::implicit::{Implicit, NODES, SIDE};
use crate::geometry::coords::{cells_at, nodes_of};
use crate::geometry::marching_cubes::cases;
use crate::geometry::{Coord, DVec3, TriMesh};

/// Sentinel: no vertex.
const NONE: u8 = u8::MAX;
/// Ratios of the second differences to the first difference along a line. Up to the smaller ratio the values count as smooth, and a cubic
/// interpolates them; from the larger one on they count as a kink, and a straight line does. In between the two results are blended, so
/// that the surface does not flicker.
const SMOOTH: [f32; 2] = [0.3, 0.5];
/// Iterations to the zero of a cubic; each leaves less than half of the error.
const STEPS: usize = 6;

/// The surface's triangles.
#[derive(Debug, Default)]
pub struct Isosurface {
    /// For each evaluated patch, the index of its first vertex; then the count of all vertices.
    first: Vec<u32>,
    /// Positions of vertices, in cells from the first node of their patch.
    positions: Vec<[f32; 3]>,
    /// The evaluated patch of each vertex.
    owners: Vec<u32>,
    /// The patch of each run of triangles, and the end of the run.
    runs: Vec<(Coord, u32)>,
    triangles: Vec<[u32; 3]>,
}

/// The vertices on edges that begin at the nodes of a patch.
struct Crossings {
    /// Number of the vertex on the edge from a node along an axis, or [`NONE`].
    index: [[u8; NODES]; 3],
    positions: Vec<[f32; 3]>,
}

impl Isosurface {
    /// Triangulates where the function is 0. Triangles are counter-clockwise seen from outside.
    pub fn new(phi: &Implicit) -> Self {
        let crossings: Vec<Crossings> =
            (0..phi.patches().len()).into_par_iter().with_min_len(16).map(|at| crossings(phi, at)).collect();
        let mut first = vec![0];
        let (mut positions, mut owners) = (Vec::new(), Vec::new());
        for (crossings, owner) in crossings.iter().zip(0..) {
            positions.extend_from_slice(&crossings.positions);
            owners.resize(positions.len(), owner);
            first.push(positions.len() as u32);
        }
        // Patches and those before them on each axis.
        let mut patches: Vec<Coord> = phi.patches().iter().flat_map(|patch| cells_at(*patch)).collect();
        patches.par_sort_unstable();
        patches.dedup();
        let run = |patch: &Coord| triangles(phi, *patch, &crossings, &first);
        let parts: Vec<Vec<[u32; 3]>> = patches.par_iter().with_min_len(16).map(run).collect();
        let mut out = Self { first, positions, owners, ..Self::default() };
        for (patch, part) in patches.into_iter().zip(parts) {
            if !part.is_empty() {
                out.triangles.extend(part);
                out.runs.push((patch, out.triangles.len() as u32));
            }
        }
        out
    }

    /// Count of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Count of vertices.
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Each patch with cubes that have triangles, and these triangles, ascending.
    pub fn runs(&self) -> impl Iterator<Item = (Coord, &[[u32; 3]])> {
        let starts = std::iter::once(0).chain(self.runs.iter().map(|(_, end)| *end));
        self.runs
            .iter()
            .zip(starts)
            .map(|((patch, end), start)| (*patch, &self.triangles[start as usize..*end as usize]))
    }

    /// The position of a vertex: a patch, and cells from its first node.
    pub fn position(&self, phi: &Implicit, vertex: u32) -> (Coord, [f32; 3]) {
        let owner = self.owners[vertex as usize];
        (phi.patches()[owner as usize], self.positions[vertex as usize])
    }

    /// The position of a vertex (cells).
    pub fn in_cells(&self, phi: &Implicit, vertex: u32) -> DVec3 {
        let (patch, at) = self.position(phi, vertex);
        DVec3::from(patch.map(|x| f64::from(x * SIDE))) + DVec3::from(at.map(f64::from))
    }

    /// As a mesh (m).
    pub fn mesh(&self, phi: &Implicit) -> TriMesh {
        let cell = phi.cell();
        let mut positions = Vec::with_capacity(self.positions.len());
        for (patch, ends) in phi.patches().iter().zip(self.first.windows(2)) {
            let corner = DVec3::from(patch.map(|at| f64::from(at * SIDE)));
            let offsets = &self.positions[ends[0] as usize..ends[1] as usize];
            positions
                .extend(offsets.iter().map(|at| ((corner + DVec3::from(at.map(f64::from))) * cell).cast()));
        }
        TriMesh { positions, triangles: self.triangles.clone() }
    }
}

fn crossings(phi: &Implicit, patch: usize) -> Crossings {
    let values = phi.values(patch);
    let mut out = Crossings { index: [[NONE; NODES]; 3], positions: Vec::new() };
    for axis in 0..3 {
        let [before, next] = [-1, 1].map(|by| {
            let mut beside = phi.patches()[patch];
            beside[axis] += by;
            phi.find(beside).map(|at| phi.values(at))
        });
        let step = 16 >> (2 * axis);
        for node in 0..NODES {
            let at = node >> (4 - 2 * axis) & 3;
            // The value this many nodes farther on the line.
            let value = |by: usize| match at + by {
                to @ 0..4 => Some(values[node + to * step - at * step]),
                to => next.map(|next| next[node + (to - 4) * step - at * step]),
            };
            let here = values[node];
            // The surface has no crossing between an evaluated patch and one that is not.
            let Some(there) = value(1) else { continue };
            if (here < 0.0) == (there < 0.0) {
                continue;
            }
            let last = match at {
                0 => before.map(|before| before[node + 3 * step]),
                _ => Some(values[node - step]),
            };
            let mut position = [node >> 4, node >> 2 & 3, node & 3].map(|x| x as f32);
            position[axis] += zero([last, value(2)], here, there);
            out.index[axis][node] = out.positions.len() as u8;
            out.positions.push(position);
        }
    }
    out
}

/// Where values on a line are 0 between two that differ in sign (0..=1): by the cubic through these two and those beyond them if the values
/// are smooth, else by the straight line.
fn zero(outside: [Option<f32>; 2], here: f32, there: f32) -> f32 {
    let fall = here - there;
    let straight = here / fall;
    let [Some(last), Some(next)] = outside else { return straight };
    // Second differences at both ends.
    let (first, second) = (last - here - fall, fall - there + next);
    let share = |bend: f32| (SMOOTH[1] - (bend / fall).abs()) / (SMOOTH[1] - SMOOTH[0]);
    let shares = [share(first), share(second), 1.0];
    // NaN counts as a kink too.
    if !shares.iter().all(|share| *share > 0.0) {
        return straight;
    }
    let share = shares.into_iter().fold(1.0, f32::min);
    let mut at = straight;
    for _ in 0..STEPS {
        let bend = 0.5 * at * (at - 1.0) * (first + (at + 1.0) / 3.0 * (second - first));
        at = ((here + bend) / fall).clamp(0.0, 1.0);
    }
    straight + share * (at - straight)
}

/// The triangles in the cubes that begin at the nodes of a patch.
fn triangles(phi: &Implicit, patch: Coord, crossings: &[Crossings], first: &[u32]) -> Vec<[u32; 3]> {
    // Nodes 0..=4 on each axis lie in this patch and the seven behind it.
    let patches = nodes_of(patch);
    let near = patches.map(|at| phi.find(at));
    let inside: [bool; 8] = std::array::from_fn(|n| near[n].is_none() && phi.is_inside(patches[n]));
    let part = |node: [usize; 3]| (node[0] >> 2) << 2 | (node[1] >> 2) << 1 | node[2] >> 2;
    let local = |node: [usize; 3]| (node[0] & 3) << 4 | (node[1] & 3) << 2 | node[2] & 3;
    let mut signs = [[[false; 5]; 5]; 5];
    let mut count = 0;
    for (x, plane) in signs.iter_mut().enumerate() {
        for (y, row) in plane.iter_mut().enumerate() {
            for (z, sign) in row.iter_mut().enumerate() {
                let n = part([x, y, z]);
                *sign = near[n].map_or(inside[n], |at| phi.values(at)[local([x, y, z])] < 0.0);
                count += usize::from(*sign);
            }
        }
    }
    let mut out = Vec::new();
    if count == 0 || count == 125 {
        return out;
    }
    let cases = cases();
    for cube in 0..NODES {
        let at = [cube >> 4, cube >> 2 & 3, cube & 3];
        let node = |corner: usize| [at[0] + (corner >> 2), at[1] + (corner >> 1 & 1), at[2] + (corner & 1)];
        let case = (0..8).fold(0, |case, corner| {
            let [x, y, z] = node(corner);
            case | usize::from(signs[x][y][z]) << corner
        });
        for triangle in &cases[case] {
            out.push(triangle.map(|(corner, axis)| {
                let node = node(corner);
                let owner = near[part(node)].expect("an edge with a crossing begins in an evaluated patch");
                first[owner] + u32::from(crossings[owner].index[axis][local(node)])
            }));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_of_cubics_are_exact_and_kinks_are_straight() {
        for root in [0.05, 0.4, 0.93] {
            let value = |t: f32| (t - root) * (1.0 + 0.08 * t + 0.01 * t * t);
            let at = zero([Some(value(-1.0)), Some(value(2.0))], value(0.0), value(1.0));
            assert!((at - root).abs() < 1e-4, "{at} for {root}");
            let at = zero([Some(-value(-1.0)), Some(-value(2.0))], -value(0.0), -value(1.0));
            assert!((at - root).abs() < 1e-4, "{at} for {root}");
        }
        // The transition from the cubic to the straight line is continuous.
        let root = |bend: f32| zero([Some(bend - 1.4), Some(bend + 1.6)], -0.4, 0.6);
        let roots: Vec<f32> = (0..=600).map(|n| root(n as f32 * 1e-3)).collect();
        assert!(roots.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 1e-3), "{roots:?}");
        assert!((roots[290] - 0.43565).abs() < 1e-3 && (0.4..0.43).contains(&roots[450]), "{roots:?}");
        assert!((roots[0] - 0.4).abs() < 1e-6 && (roots[600] - 0.4).abs() < 1e-6);
        for outside in
            [[Some(9.0), Some(0.2)], [None, Some(0.2)], [Some(f32::INFINITY), Some(0.2)], [Some(f32::NAN); 2]]
        {
            assert_eq!(zero(outside, -0.25, 0.75), 0.25);
        }
    }
}
