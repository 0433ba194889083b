//! Where a mesh passes through the edges of the grid, and its winding number at the nodes.

use rayon::prelude::*;

use super::exact::{GridEdge, cell_of};
use crate::distance::Face;
use crate::distance::lattice::Fixed;
use crate::distance::winding::{Axis, each_crossing};
use crate::geometry::Coord;
use crate::geometry::lists::Lists;

/// Triangles per task.
const GRAIN: usize = 2048;
/// Bits per coordinate in a key.
const BITS: u32 = 20;
/// Farthest node that a key can hold.
const FAR: i32 = 1 << (BITS - 2);

/// A passage of a triangle through an edge of the grid.
#[derive(Debug, Clone, Copy)]
pub struct Pierce {
    /// Position along the edge, from its lower node (0..=1).
    pub share: f64,
    /// The change of the winding number in the direction of the axis.
    pub change: i32,
    /// The triangle.
    pub triangle: u32,
}

/// All passages of a closed mesh through edges of the grid.
pub struct Pierces {
    /// Keys of edges, ascending; within an edge in order of position.
    keys: Vec<u64>,
    items: Vec<Pierce>,
    /// The edges that each triangle passes through, ascending.
    edges: Lists<GridEdge>,
    /// The winding number behind each pierce along z, on its line; these pierces are the last in `items`.
    behind: Vec<i32>,
}

fn key((axis, node): GridEdge) -> u64 {
    node.iter().fold(axis as u64, |key, at| key << BITS | (at + FAR).clamp(0, 2 * FAR) as u64)
}

impl Pierces {
    /// Finds all passages.
    pub fn of(fixed: &[Fixed], triangles: &[[u32; 3]]) -> Self {
        let faces: Vec<Face> = triangles
            .iter()
            .map(|vertices| Face { v: vertices.map(|vertex| fixed[vertex as usize]), coef: 1 })
            .collect();
        let parts: Vec<Vec<(u32, GridEdge, Pierce)>> = faces
            .par_chunks(GRAIN)
            .enumerate()
            .map(|(chunk, faces)| {
                let mut out = Vec::new();
                for (face, triangle) in faces.iter().zip((chunk * GRAIN) as u32..) {
                    of_face(face, |edge, share, change| {
                        out.push((triangle, edge, Pierce { share, change, triangle }))
                    });
                }
                out
            })
            .collect();
        let by_triangle = parts.iter().flatten().map(|(triangle, edge, _)| (*triangle, *edge));
        let mut edges = Lists::new(triangles.len(), by_triangle);
        edges.each_mut(|edges| edges.sort_unstable());
        let mut items: Vec<(u64, Pierce)> =
            parts.into_iter().flatten().map(|(_, edge, pierce)| (key(edge), pierce)).collect();
        items.par_sort_unstable_by(|(k, a), (l, b)| {
            k.cmp(l).then(a.share.total_cmp(&b.share)).then(a.triangle.cmp(&b.triangle))
        });
        let (keys, items): (Vec<u64>, Vec<Pierce>) = items.into_iter().unzip();
        let first = keys.partition_point(|key| key >> (3 * BITS) < 2);
        let (mut line, mut winding) = (u64::MAX, 0);
        let behind = keys[first..].iter().zip(&items[first..]).map(|(key, pierce)| {
            if key >> BITS != line {
                (line, winding) = (key >> BITS, 0);
            }
            winding += pierce.change;
            winding
        });
        let behind = behind.collect();
        Self { keys, items, edges, behind }
    }

    /// The passages through an edge of the grid.
    pub fn on(&self, edge: GridEdge) -> &[Pierce] {
        let key = key(edge);
        let first = self.keys.partition_point(|other| *other < key);
        let count = self.keys[first..].iter().take_while(|other| **other == key).count();
        &self.items[first..first + count]
    }

    /// The edges of the grid that a triangle passes through, ascending.
    pub fn of_triangle(&self, triangle: u32) -> &[GridEdge] {
        self.edges.get(triangle as usize)
    }

    /// Winding number at a node.
    pub fn winding(&self, node: Coord) -> i32 {
        // The last of the pierces before it on the line along z.
        let key = key((2, node));
        let first = self.keys.len() - self.behind.len();
        let before = self.keys[first..].partition_point(|other| *other < key);
        match before.checked_sub(1) {
            Some(last) if self.keys[first + last] >> BITS == key >> BITS => self.behind[last],
            _ => 0,
        }
    }

    /// All edges of the grid that the mesh passes through, by triangle.
    pub fn edges(&self) -> &[GridEdge] {
        self.edges.items()
    }
}

/// Calls `see` with each edge of the grid that a face passes through, the position on it, and the change of the winding number.
fn of_face(face: &Face, mut see: impl FnMut(GridEdge, f64, i32)) {
    let cells = face.v.map(cell_of);
    let same = [0, 1, 2].map(|axis| cells[0][axis] == cells[1][axis] && cells[1][axis] == cells[2][axis]);
    for axis in Axis::ALL {
        // A face meets a line of the grid only if it meets the two planes that the line lies in.
        let [b, c] = [(axis.index() + 1) % 3, (axis.index() + 2) % 3];
        if same[b] || same[c] {
            continue;
        }
        let far = i64::from(FAR);
        each_crossing(face, axis, [[-far, far]; 2], |line, at, change| {
            let floor = at.floor();
            see((axis.index(), axis.voxel(line, floor as i32)), at - floor, change);
        });
    }
}
