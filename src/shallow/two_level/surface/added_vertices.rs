//! Vertices of the strip between fine and coarse cells that are in neither mesh: of columns whose surface continues only across the edge,
//! and of dry columns beside liquid that ends there.

use super::stitches::Stitches;
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::Columns;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::buffers::frame::{Frame, Vertex};
use crate::shallow::surface::buffers::normals::upright;
use crate::shallow::surface::heights::shown::height_of;
use crate::shallow::surface::{Depths, Layout, Target};
use crate::shallow::two_level::Detail;

/// Scratch buffers for these vertices.
#[derive(Debug, Default)]
pub(super) struct AddedVertices {
    /// Pairs of a vertex and a wet column that share a triangle.
    partners: Vec<[u32; 2]>,
    /// For each vertex, the height at which it is shown (units).
    heights: Vec<f64>,
    /// For each vertex, the sum of its triangles' normals.
    normals: Vec<[f64; 3]>,
}

/// Both liquids; a column id is an index of the fine columns or, after these, of the coarse ones.
#[derive(Clone, Copy)]
struct BothLiquids<'a> {
    detail: &'a Detail,
    depths: [&'a Depths<'a>; 2],
    layout: &'a Layout,
}

impl<'a> BothLiquids<'a> {
    /// Columns and depths of the liquid of a column, and its index there.
    fn of(self, id: u32) -> (&'a Columns, &'a Depths<'a>, usize) {
        let first = self.detail.fine.columns.len();
        match (id as usize).checked_sub(first) {
            Some(index) => (&self.detail.coarse.columns, self.depths[1], index),
            None => (&self.detail.fine.columns, self.depths[0], id as usize),
        }
    }

    fn depth(self, id: u32) -> i32 {
        let (_, depths, index) = self.of(id);
        depths.depth[index].max(0)
    }

    /// The height at which a column is shown (units).
    fn height(self, id: u32) -> i32 {
        let (columns, depths, index) = self.of(id);
        height_of(columns, depths, self.layout, index)
    }

    /// The middle of a column (fine cells).
    fn middle(self, id: u32) -> [f64; 2] {
        let (columns, _, index) = self.of(id);
        let cells = columns.grid.cell / self.detail.fine.columns.grid.cell;
        columns.cell(index).map(|at| (at as f64 + 0.5) * cells)
    }

    fn velocity(self, id: u32) -> [f32; 2] {
        let (_, depths, index) = self.of(id);
        depths.velocity.get(index).copied().unwrap_or_default()
    }

    fn carried(self, id: u32) -> [f32; MAX_SCALARS] {
        let (_, depths, index) = self.of(id);
        depths.carried.map(|numbers| numbers.get(index).copied().unwrap_or_default())
    }
}

impl AddedVertices {
    /// Reserves memory for this many vertices and triangles.
    pub fn reserve(&mut self, vertices: usize, triangles: usize) {
        self.partners.clear();
        self.heights.clear();
        self.normals.clear();
        self.partners.reserve(6 * triangles);
        self.heights.reserve(vertices);
        self.normals.reserve(vertices);
    }

    /// Writes the vertices of a strip, from the start of a target.
    pub fn write(
        &mut self,
        detail: &Detail,
        depths: [&Depths<'_>; 2],
        layout: &Layout,
        stitches: &Stitches,
        target: &mut Target<'_>,
    ) {
        if stitches.added.is_empty() {
            return;
        }
        let liquids = BothLiquids { detail, depths, layout };
        self.find_partners(liquids, stitches);
        self.find_heights(liquids, &stitches.added);
        self.find_normals(liquids, stitches);
        let frames = [&detail.fine.columns, &detail.coarse.columns].map(|columns| Frame::of(columns, layout));
        for (at, &id) in stitches.added.iter().enumerate() {
            let is_coarse = id as usize >= detail.fine.columns.len();
            self.put(liquids, &frames[usize::from(is_coarse)], at, id, target);
        }
    }

    /// Finds the wet columns around each vertex, each only once.
    fn find_partners(&mut self, liquids: BothLiquids<'_>, stitches: &Stitches) {
        self.partners.clear();
        for triangle in &stitches.triangles {
            for id in triangle {
                let Ok(at) = stitches.added.binary_search(id) else { continue };
                let wet = triangle.iter().filter(|other| *other != id && liquids.depth(**other) > 0);
                self.partners.extend(wet.map(|other| [at as u32, *other]));
            }
        }
        self.partners.sort_unstable();
        self.partners.dedup();
    }

    fn partners(&self, at: usize) -> impl ExactSizeIterator<Item = u32> + '_ {
        let first = self.partners.partition_point(|[vertex, _]| (*vertex as usize) < at);
        let end = self.partners.partition_point(|[vertex, _]| (*vertex as usize) <= at);
        self.partners[first..end].iter().map(|[_, id]| *id)
    }

    /// A wet column is shown at its own height, a dry one at the mean of the wet ones around it, but not above its own ground.
    fn find_heights(&mut self, liquids: BothLiquids<'_>, added: &[u32]) {
        let mut heights = std::mem::take(&mut self.heights);
        refill(
            &mut heights,
            added.iter().enumerate().map(|(at, &id)| {
                let (own, partners) = (f64::from(liquids.height(id)), self.partners(at));
                if liquids.depth(id) > 0 || partners.len() == 0 {
                    return own;
                }
                let count = partners.len() as f64;
                own.min(partners.map(|id| i64::from(liquids.height(id))).sum::<i64>() as f64 / count)
            }),
        );
        self.heights = heights;
    }

    /// Sums the normals of triangles, weighted by area, at each vertex.
    fn find_normals(&mut self, liquids: BothLiquids<'_>, stitches: &Stitches) {
        reset(&mut self.normals, stitches.added.len(), [0.0; 3]);
        let fine = &liquids.detail.fine.columns;
        let unit = fine.heights.unit / fine.grid.cell;
        for triangle in &stitches.triangles {
            if !triangle.iter().any(|id| stitches.added.binary_search(id).is_ok()) {
                continue;
            }
            let position = |id: u32| {
                let added = stitches.added.binary_search(&id).map(|at| self.heights[at]);
                let [x, z] = liquids.middle(id);
                [x, unit * added.unwrap_or_else(|_| f64::from(liquids.height(id))), z]
            };
            let [a, b, c] = triangle.map(position);
            let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
            let normal = [0, 1, 2].map(|axis| {
                let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
                u[next] * v[last] - u[last] * v[next]
            });
            for at in triangle.iter().filter_map(|id| stitches.added.binary_search(id).ok()) {
                (0..3).for_each(|axis| self.normals[at][axis] += normal[axis]);
            }
        }
    }

    /// Writes one vertex; `frame` is that of its cells.
    fn put(&self, liquids: BothLiquids<'_>, frame: &Frame, at: usize, id: u32, target: &mut Target<'_>) {
        let (columns, _, index) = liquids.of(id);
        let depth = liquids.depth(id);
        let [column, row] = columns.cell(index).map(|at| at as i32);
        let [x, y, z] = self.normals[at];
        let mean = |of: &dyn Fn(u32) -> f32| {
            let count = self.partners(at).len().max(1) as f64;
            if depth > 0 {
                of(id)
            } else {
                (self.partners(at).map(|id| f64::from(of(id))).sum::<f64>() / count) as f32
            }
        };
        let vertex = Vertex {
            position: [frame.centre(0, column), frame.height(self.heights[at] as f32), frame.centre(1, row)],
            normal: upright((x / y) as f32, (z / y) as f32),
            velocity: [0, 1].map(|axis| mean(&|id| liquids.velocity(id)[axis])),
            carried: std::array::from_fn(|scalar| match target.carried[scalar] {
                Some(_) => mean(&|id| liquids.carried(id)[scalar]),
                None => 0.0,
            }),
            depth,
            layer: columns.layer(index) as u32,
            column: id,
        };
        frame.put(at, &vertex, target);
    }
}
