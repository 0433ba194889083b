//! Vertices of the strip between fine and coarse cells that are in neither mesh: of columns whose surface continues only across the edge,
//! and of dry ones beside liquid that ends there.

use super::stitches::Stitches;
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::Columns;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::buffers::frame::{Frame, Vertex};
use crate::shallow::surface::buffers::normals::upright;
use crate::shallow::surface::heights::shown::height_of;
use crate::shallow::surface::{Depths, Layout, Target};
use crate::shallow::two_level::Detail;

/// Source data of these vertices.
#[derive(Debug, Default)]
pub(super) struct Sewn {
    /// Pairs of a vertex and a wet column that share a triangle.
    partners: Vec<[u32; 2]>,
    /// For each vertex: its height as shown (units), and the sum of its triangles' normals.
    heights: Vec<f64>,
    slopes: Vec<[f64; 3]>,
}

/// Both liquids.
#[derive(Clone, Copy)]
struct Columnar<'a> {
    detail: &'a Detail,
    depths: [&'a Depths<'a>; 2],
    layout: &'a Layout,
}

impl<'a> Columnar<'a> {
    /// The liquid of an id, and its index there.
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

    /// The height at which its own depth shows it (units).
    fn height(self, id: u32) -> i32 {
        let (columns, depths, index) = self.of(id);
        height_of(columns, depths, self.layout, index)
    }

    /// Its middle, in fine cells.
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

impl Sewn {
    /// Reserves memory for this many vertices and triangles.
    pub fn reserve(&mut self, vertices: usize, triangles: usize) {
        self.partners.clear();
        self.heights.clear();
        self.slopes.clear();
        self.partners.reserve(6 * triangles);
        self.heights.reserve(vertices);
        self.slopes.reserve(vertices);
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
        if stitches.sewn.is_empty() {
            return;
        }
        let all = Columnar { detail, depths, layout };
        self.find_partners(all, stitches);
        self.find_heights(all, &stitches.sewn);
        self.find_slopes(all, stitches);
        let frames = [&detail.fine.columns, &detail.coarse.columns].map(|columns| Frame::of(columns, layout));
        for (at, &id) in stitches.sewn.iter().enumerate() {
            let is_coarse = id as usize >= detail.fine.columns.len();
            self.put(all, &frames[usize::from(is_coarse)], at, id, target);
        }
    }

    /// Finds the wet columns around each vertex, each only once.
    fn find_partners(&mut self, all: Columnar<'_>, stitches: &Stitches) {
        self.partners.clear();
        for triangle in &stitches.triangles {
            for id in triangle {
                let Ok(at) = stitches.sewn.binary_search(id) else { continue };
                let wet = triangle.iter().filter(|other| *other != id && all.depth(**other) > 0);
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

    /// A wet column has its own height, a dry one the mean of those around, but not above its ground.
    fn find_heights(&mut self, all: Columnar<'_>, sewn: &[u32]) {
        let mut heights = std::mem::take(&mut self.heights);
        refill(
            &mut heights,
            sewn.iter().enumerate().map(|(at, &id)| {
                let (own, partners) = (f64::from(all.height(id)), self.partners(at));
                if all.depth(id) > 0 || partners.len() == 0 {
                    return own;
                }
                let count = partners.len() as f64;
                own.min(partners.map(|id| i64::from(all.height(id))).sum::<i64>() as f64 / count)
            }),
        );
        self.heights = heights;
    }

    /// Sums the normals of triangles, weighted by area, at each vertex.
    fn find_slopes(&mut self, all: Columnar<'_>, stitches: &Stitches) {
        reset(&mut self.slopes, stitches.sewn.len(), [0.0; 3]);
        let fine = &all.detail.fine.columns;
        let unit = fine.heights.unit / fine.grid.cell;
        for triangle in &stitches.triangles {
            if !triangle.iter().any(|id| stitches.sewn.binary_search(id).is_ok()) {
                continue;
            }
            let position = |id: u32| {
                let sewn = stitches.sewn.binary_search(&id).map(|at| self.heights[at]);
                let [x, z] = all.middle(id);
                [x, unit * sewn.unwrap_or_else(|_| f64::from(all.height(id))), z]
            };
            let [a, b, c] = triangle.map(position);
            let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
            let normal = [0, 1, 2].map(|axis| {
                let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
                u[next] * v[last] - u[last] * v[next]
            });
            for at in triangle.iter().filter_map(|id| stitches.sewn.binary_search(id).ok()) {
                (0..3).for_each(|axis| self.slopes[at][axis] += normal[axis]);
            }
        }
    }

    /// Writes one vertex; `frame` is that of its cells.
    fn put(&self, all: Columnar<'_>, frame: &Frame, at: usize, id: u32, target: &mut Target<'_>) {
        let (columns, _, index) = all.of(id);
        let depth = all.depth(id);
        let [column, row] = columns.cell(index).map(|at| at as i32);
        let [x, y, z] = self.slopes[at];
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
            velocity: [0, 1].map(|axis| mean(&|id| all.velocity(id)[axis])),
            carried: std::array::from_fn(|scalar| match target.carried[scalar] {
                Some(_) => mean(&|id| all.carried(id)[scalar]),
                None => 0.0,
            }),
            depth,
            layer: columns.layer(index) as u32,
            column: id,
        };
        frame.put(at, &vertex, target);
    }
}
