//! Places of the particles' surface that the mesh does not cover, though it covers others of the same part: a bridge that has just
//! grown between two bodies, the rim of a hole. They tell of a change before a vertex jumps there (the early test that thesis 2.3.3
//! has not: a thread between vertices moves none of them).
//!
//! What covers the surface is the mesh of the feet: each vertex without its detail. Where nothing changes it lies on the surface.

use std::collections::HashMap;

use rayon::prelude::*;

use super::apart::Parts;
use super::cells::{Coord, cell_of};
use super::implicit::{Implicit, SIDE};
use super::isosurface::Isosurface;
use crate::base::DVec3;
use crate::context::Context;
use crate::distance::triangle::Triangle;
use crate::error::Result;

/// A place of the surface is covered if a triangle of feet is so near (cells); at most 1, the cells that are searched.
const SLACK: f64 = 1.0;
/// Vertices whose feet lie in so many cells around an uncovered place are beside it.
const BESIDE: i32 = 2;
/// A triangle of feet over more cells than this on an axis does not lie on the surface.
const LONG: i32 = 64;

/// The mesh without its detail, on the particles' surface.
pub struct Cover<'a> {
    /// The foot of each vertex (cells), if it has one.
    pub feet: &'a [Option<DVec3>],
    pub triangles: &'a [[u32; 3]],
}

impl Cover<'_> {
    /// Whether each vertex is beside a place of the surface that is not covered.
    ///
    /// # Errors
    /// Cancel.
    pub fn beside_bare(
        &self,
        ctx: &Context,
        phi: &Implicit,
        surface: &Isosurface,
        parts: &Parts,
    ) -> Result<Vec<bool>> {
        let mut trodden = Marks::default();
        self.feet.iter().flatten().for_each(|foot| trodden.set(cell_of(foot)));
        let doubtful = doubtful(phi, surface, parts, &trodden);
        ctx.check()?;
        let bare = self.bare(ctx, &doubtful)?;
        let mut beside = Marks::default();
        bare.iter().for_each(|place| around(cell_of(place), BESIDE).for_each(|cell| beside.set(cell)));
        let is_beside = |foot: &Option<DVec3>| foot.is_some_and(|foot| beside.has(cell_of(&foot)));
        Ok(self.feet.par_iter().with_min_len(4096).map(is_beside).collect())
    }

    /// Those of some places (cells) that no triangle of feet is near.
    fn bare(&self, ctx: &Context, places: &[DVec3]) -> Result<Vec<DVec3>> {
        if places.is_empty() {
            return Ok(Vec::new());
        }
        let mut wanted = Marks::default();
        places.iter().for_each(|place| around(cell_of(place), 1).for_each(|cell| wanted.set(cell)));
        let in_cells = |(index, triangle): (u32, &[u32; 3])| {
            let corners = self.corners(triangle)?;
            let [low, high] = bounds(&corners);
            if (0..3).any(|axis| high[axis] - low[axis] > LONG) {
                return None;
            }
            let cells = each_cell(low, high).filter(|cell| wanted.has(*cell));
            Some(cells.map(move |cell| (cell, index)).collect::<Vec<_>>())
        };
        let numbered =
            (0..self.triangles.len() as u32).into_par_iter().zip(self.triangles).with_min_len(4096);
        let mut near: Vec<(Coord, u32)> = numbered.filter_map(in_cells).flatten_iter().collect();
        near.par_sort_unstable();
        let is_bare = |place: &&DVec3| {
            let [x, y, z] = cell_of(place);
            let rows = each_cell([x - 1, y - 1, z - 1], [x + 1, y + 1, z - 1]);
            !rows.into_iter().any(|row| {
                let from = near.partition_point(|(cell, _)| *cell < row);
                let here = near[from..].iter().take_while(|(cell, _)| *cell <= [row[0], row[1], z + 1]);
                here.into_iter().any(|(_, triangle)| self.distance(*triangle, place) <= SLACK)
            })
        };
        ctx.check()?;
        Ok(places.par_iter().with_min_len(256).filter(is_bare).copied().collect())
    }

    fn corners(&self, triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
        let [a, b, c] = triangle.map(|vertex| self.feet[vertex as usize]);
        Some([a?, b?, c?])
    }

    /// Distance (cells) of a place from a triangle of feet.
    fn distance(&self, triangle: u32, place: &DVec3) -> f64 {
        let corners = self.corners(&self.triangles[triangle as usize]).expect("it was listed with its feet");
        let nearest =
            Triangle::of_cells(corners.map(|corner| (corner - place).cast::<f32>().into())).closest([0.0; 3]);
        DVec3::from(nearest.map(f64::from)).norm()
    }
}

/// Corners of the surface's triangles (cells), on parts that have feet, in cells without any.
fn doubtful(phi: &Implicit, surface: &Isosurface, parts: &Parts, trodden: &Marks) -> Vec<DVec3> {
    let place = |vertex: u32| {
        let place = surface.in_cells(phi, vertex);
        (parts.is_covered(vertex) && !trodden.has(cell_of(&place))).then_some(place)
    };
    (0..surface.vertices() as u32).into_par_iter().with_min_len(4096).filter_map(place).collect()
}

/// Marked cells: a bit for each of those in a patch.
#[derive(Default)]
struct Marks {
    patches: HashMap<Coord, u64>,
}

impl Marks {
    fn set(&mut self, cell: Coord) {
        *self.patches.entry(cell.map(|x| x.div_euclid(SIDE))).or_default() |= bit(cell);
    }

    fn has(&self, cell: Coord) -> bool {
        self.patches.get(&cell.map(|x| x.div_euclid(SIDE))).is_some_and(|bits| bits & bit(cell) != 0)
    }
}

fn bit(cell: Coord) -> u64 {
    let [x, y, z] = cell.map(|x| x.rem_euclid(SIDE));
    1 << (x << 4 | y << 2 | z)
}

fn bounds(corners: &[DVec3; 3]) -> [Coord; 2] {
    let [a, b, c] = corners;
    [cell_of(&a.inf(b).inf(c)), cell_of(&a.sup(b).sup(c))]
}

/// The cells from one to another, ascending.
fn each_cell(low: Coord, high: Coord) -> impl Iterator<Item = Coord> {
    let on = move |axis: usize| low[axis]..=high[axis];
    on(0).flat_map(move |x| on(1).flat_map(move |y| on(2).map(move |z| [x, y, z])))
}

fn around(cell: Coord, by: i32) -> impl Iterator<Item = Coord> {
    each_cell(cell.map(|x| x - by), cell.map(|x| x + by))
}
