//! The surface where a function at nodes is 0, as triangles: marching cubes (Lorensen and Cline 1987). A face of a cube on which
//! two corners across are inside keeps these apart (Montani, Scateni and Scopigno 1994), so that what two cubes make of it fits.
//!
//! The cases are made by code: on each face of a cube the surface runs from where one goes inside to where one leaves again;
//! these lines join to loops, which triangles fill.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::cells::Coord;
use super::implicit::{Implicit, NODES, SIDE};
use crate::base::{DVec3, TriMesh};

/// An edge of a cube: its lesser corner (bits x, y, z) and its axis.
type Edge = (usize, usize);

/// No vertex.
const NONE: u8 = u8::MAX;
/// Values along a line are smooth if their second differences are at most the lesser share of the first, and a kink from the greater
/// on; between them the surface goes over from the one to the other, or it would flicker.
const SMOOTH: [f32; 2] = [0.3, 0.5];
/// Steps to the zero of a cubic; each leaves less than half of the error.
const STEPS: usize = 6;

/// The surface's triangles.
#[derive(Debug, Default)]
pub struct Isosurface {
    /// For each evaluated patch, its first vertex; then the count of all.
    first: Vec<u32>,
    /// Places of vertices, in cells from the first node of the patch that has them.
    places: Vec<[f32; 3]>,
    /// The evaluated patch that has each vertex.
    owners: Vec<u32>,
    /// The patch of each run of triangles, and the end of the run.
    runs: Vec<(Coord, u32)>,
    triangles: Vec<[u32; 3]>,
}

/// The vertices on edges that begin at the nodes of a patch.
struct Crossings {
    /// Number of the vertex on the edge from a node along an axis, or [`NONE`].
    index: [[u8; NODES]; 3],
    places: Vec<[f32; 3]>,
}

impl Isosurface {
    /// Triangulates where the function is 0. Triangles are counter-clockwise seen from outside.
    pub fn new(phi: &Implicit) -> Self {
        let crossings: Vec<Crossings> =
            (0..phi.patches().len()).into_par_iter().with_min_len(16).map(|at| crossings(phi, at)).collect();
        let mut first = vec![0];
        let (mut places, mut owners) = (Vec::new(), Vec::new());
        for (crossings, owner) in crossings.iter().zip(0..) {
            places.extend_from_slice(&crossings.places);
            owners.resize(places.len(), owner);
            first.push(places.len() as u32);
        }
        let mut patches = with_lower(phi.patches());
        patches.par_sort_unstable();
        patches.dedup();
        let run = |patch: &Coord| triangles(phi, *patch, &crossings, &first);
        let parts: Vec<Vec<[u32; 3]>> = patches.par_iter().with_min_len(16).map(run).collect();
        let mut out = Self { first, places, owners, ..Self::default() };
        for (patch, part) in patches.into_iter().zip(parts) {
            if !part.is_empty() {
                out.triangles.extend(part);
                out.runs.push((patch, out.triangles.len() as u32));
            }
        }
        out
    }

    /// Count of triangles.
    pub fn count(&self) -> usize {
        self.triangles.len()
    }

    /// Count of vertices.
    pub fn vertices(&self) -> usize {
        self.places.len()
    }

    /// Each patch in which cubes with triangles begin, with these, ascending.
    pub fn runs(&self) -> impl Iterator<Item = (Coord, &[[u32; 3]])> {
        let starts = std::iter::once(0).chain(self.runs.iter().map(|(_, end)| *end));
        self.runs
            .iter()
            .zip(starts)
            .map(|((patch, end), start)| (*patch, &self.triangles[start as usize..*end as usize]))
    }

    /// The place of a vertex: cells from the first node of a patch, which it gives too.
    pub fn place(&self, phi: &Implicit, vertex: u32) -> (Coord, [f32; 3]) {
        let owner = self.owners[vertex as usize];
        (phi.patches()[owner as usize], self.places[vertex as usize])
    }

    /// The place of a vertex (cells).
    pub fn in_cells(&self, phi: &Implicit, vertex: u32) -> DVec3 {
        let (patch, at) = self.place(phi, vertex);
        DVec3::from(patch.map(|x| f64::from(x * SIDE))) + DVec3::from(at.map(f64::from))
    }

    /// As a mesh (m).
    pub fn mesh(&self, phi: &Implicit) -> TriMesh {
        let cell = phi.cell();
        let mut positions = Vec::with_capacity(self.places.len());
        for (patch, ends) in phi.patches().iter().zip(self.first.windows(2)) {
            let corner = DVec3::from(patch.map(|at| f64::from(at * SIDE)));
            let places = &self.places[ends[0] as usize..ends[1] as usize];
            positions
                .extend(places.iter().map(|at| ((corner + DVec3::from(at.map(f64::from))) * cell).cast()));
        }
        TriMesh { positions, triangles: self.triangles.clone() }
    }
}

/// Patches and those before them on each axis.
fn with_lower(patches: &[Coord]) -> Vec<Coord> {
    let before = |patch: &Coord, n: i32| [patch[0] - (n >> 2), patch[1] - (n >> 1 & 1), patch[2] - (n & 1)];
    patches.iter().flat_map(|patch| (0..8).map(move |n| before(patch, n))).collect()
}

fn crossings(phi: &Implicit, patch: usize) -> Crossings {
    let values = phi.values(patch);
    let mut out = Crossings { index: [[NONE; NODES]; 3], places: Vec::new() };
    for axis in 0..3 {
        let [before, next] = [-1, 1].map(|by| {
            let mut beside = phi.patches()[patch];
            beside[axis] += by;
            phi.find(beside).map(|at| phi.values(at))
        });
        let step = 16 >> (2 * axis);
        for node in 0..NODES {
            let at = node >> (4 - 2 * axis) & 3;
            // The value so many nodes farther on the line.
            let value = |by: usize| match at + by {
                to @ 0..4 => Some(values[node + to * step - at * step]),
                to => next.map(|next| next[node + (to - 4) * step - at * step]),
            };
            let here = values[node];
            // The surface does not cross to a patch that was not evaluated.
            let Some(there) = value(1) else { continue };
            if (here < 0.0) == (there < 0.0) {
                continue;
            }
            let last = match at {
                0 => before.map(|before| before[node + 3 * step]),
                _ => Some(values[node - step]),
            };
            let mut place = [node >> 4, node >> 2 & 3, node & 3].map(|x| x as f32);
            place[axis] += zero([last, value(2)], here, there);
            out.index[axis][node] = out.places.len() as u8;
            out.places.push(place);
        }
    }
    out
}

/// Where values on a line are 0 between two that differ in sign (0..=1): the cubic through them and those outside of them decides if
/// the values are smooth, else the straight line.
fn zero(outside: [Option<f32>; 2], here: f32, there: f32) -> f32 {
    let fall = here - there;
    let straight = here / fall;
    let [Some(last), Some(next)] = outside else { return straight };
    // Second differences at both ends.
    let (first, second) = (last - here - fall, fall - there + next);
    let share = |bend: f32| (SMOOTH[1] - (bend / fall).abs()) / (SMOOTH[1] - SMOOTH[0]);
    let shares = [share(first), share(second), 1.0];
    // What is not a number is a kink too.
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
    let near: [Option<usize>; 8] = std::array::from_fn(|n| {
        phi.find([patch[0] + (n >> 2) as i32, patch[1] + (n >> 1 & 1) as i32, patch[2] + (n & 1) as i32])
    });
    let inside: [bool; 8] = std::array::from_fn(|n| {
        let at = [patch[0] + (n >> 2) as i32, patch[1] + (n >> 1 & 1) as i32, patch[2] + (n & 1) as i32];
        near[n].is_none() && phi.is_inside(at)
    });
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

/// The triangles of each case; bit n of a case is set if corner n is inside.
fn cases() -> &'static [Vec<[Edge; 3]>; 256] {
    static CASES: OnceLock<[Vec<[Edge; 3]>; 256]> = OnceLock::new();
    CASES.get_or_init(|| {
        std::array::from_fn(|case| loops(case).iter().flat_map(|ring| filled(ring)).collect())
    })
}

/// Corners of the six faces, counter-clockwise seen from outside the cube.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];

fn edge_between(a: usize, b: usize) -> Edge {
    let axis = match a ^ b {
        4 => 0,
        2 => 1,
        _ => 2,
    };
    (a.min(b), axis)
}

/// The closed lines in which the surface meets the faces of a cube.
fn loops(case: usize) -> Vec<Vec<Edge>> {
    let is_inside = |corner: usize| case >> corner & 1 == 1;
    // From where one goes inside on a face to where one comes out again.
    let mut lines: Vec<[Edge; 2]> = Vec::new();
    for face in FACES {
        for start in 0..4 {
            let [before, here] = [face[(start + 3) % 4], face[start]];
            if is_inside(before) || !is_inside(here) {
                continue;
            }
            let run = (1..4).find(|step| !is_inside(face[(start + step) % 4])).expect("one is outside");
            let [last, after] = [face[(start + run - 1) % 4], face[(start + run) % 4]];
            lines.push([edge_between(before, here), edge_between(last, after)]);
        }
    }
    let mut rings = Vec::new();
    while let Some([begin, mut end]) = lines.pop() {
        let mut ring = vec![begin];
        while end != begin {
            ring.push(end);
            let next = lines.iter().position(|line| line[0] == end).expect("lines join");
            end = lines.swap_remove(next)[1];
        }
        rings.push(ring);
    }
    rings
}

/// Whether two edges of a cube lie on one of its faces.
fn share_face(a: Edge, b: Edge) -> bool {
    let ends = |(corner, axis): Edge| [corner, corner | 4 >> axis];
    FACES.iter().any(|face| [ends(a), ends(b)].as_flattened().iter().all(|corner| face.contains(corner)))
}

/// Triangles that fill a ring. No diagonal lies on a face of the cube, where the next cube may have one too.
fn filled(ring: &[Edge]) -> Vec<[Edge; 3]> {
    fn fill(ring: &[Edge]) -> Option<Vec<[Edge; 3]>> {
        let count = ring.len();
        if count == 3 {
            return Some(vec![[ring[0], ring[1], ring[2]]]);
        }
        // Cut off an ear.
        (0..count).find_map(|ear| {
            let [before, after] = [ring[(ear + count - 1) % count], ring[(ear + 1) % count]];
            if share_face(before, after) {
                return None;
            }
            let mut rest = ring.to_vec();
            rest.remove(ear);
            let mut triangles = fill(&rest)?;
            triangles.push([before, ring[ear], after]);
            Some(triangles)
        })
    }
    fill(ring).expect("each ring of a cube can be filled so")
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
        // From the cubic to the straight line without a jump.
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

    #[test]
    fn every_case_is_filled_without_diagonals_on_faces() {
        for (case, triangles) in cases().iter().enumerate() {
            let crossed =
                (0..8).flat_map(|corner| [0, 1, 2].map(|axis| (corner, axis))).filter(|(corner, axis)| {
                    let other = corner | 4 >> axis;
                    other != *corner && (case >> corner & 1) != (case >> other & 1)
                });
            let count = crossed.count();
            let rings = loops(case);
            assert_eq!(rings.iter().map(Vec::len).sum::<usize>(), count, "case {case}");
            assert_eq!(triangles.len() + 2 * rings.len(), count, "case {case}");
        }
    }
}
