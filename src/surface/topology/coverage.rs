//! Uncovered positions of the particles' surface, on connected parts that the mesh covers elsewhere: a bridge that has just grown between
//! two bodies, the rim of a hole. They reveal a change before a vertex jumps there. The thesis (2.3.3) has no such early test: it misses a
//! thread that forms between vertices, as that moves none of them.
//!
//! The surface is covered by the triangles of feet: the mesh's triangles, with each vertex at its foot. Where nothing changes, these lie on
//! the surface.

use std::collections::HashMap;

use rayon::prelude::*;

use super::uncovered_parts::Parts;
use crate::context::Context;
use crate::distance::triangle::Triangle;
use crate::error::Result;
use crate::geometry::coords::{around, between, cell_of};
use crate::geometry::shape::longest_first;
use crate::geometry::{Coord, DVec3};
use crate::surface::level_set::implicit::{Implicit, SIDE};
use crate::surface::level_set::isosurface::Isosurface;
use crate::surface::pieces::in_pieces;

/// A position of the surface is covered if a triangle of feet is within this distance (spacings; a cell at least).
const SLACK: f64 = 0.5;
/// A vertex is beside an uncovered position if its foot is within this distance of it (spacings; two cells at least).
const NEAR: f64 = 1.0;
/// Factor on `NEAR` at the first frame. Gaps of that frame are not reported as changes, not even if they seem slightly larger later, as the
/// surface moves through the grid.
const FIRST: f64 = 2.0;
/// A triangle of feet that spans more bins than this on an axis does not lie on the surface.
const LONG: f64 = 1024.0;
/// Vertices, positions or triangles between two checks for a cancel.
const GRAIN: usize = 2048;

/// The triangles of feet: the mesh without its detail, on the particles' surface.
pub struct Cover<'a> {
    /// The foot of each vertex (cells), if it has one.
    pub feet: &'a [Option<DVec3>],
    pub triangles: &'a [[u32; 3]],
    /// Initial distance between particles (cells).
    pub spacing: f64,
    /// Whether this is the first frame.
    pub is_first: bool,
}

impl Cover<'_> {
    /// Whether each vertex is beside an uncovered position of the surface, and these positions (cells).
    ///
    /// # Errors
    /// Cancel.
    pub fn beside_uncovered(
        &self,
        ctx: &Context,
        phi: &Implicit,
        surface: &Isosurface,
        parts: &Parts,
    ) -> Result<(Vec<bool>, Vec<DVec3>)> {
        let mut with_feet = Marks::default();
        self.feet.iter().flatten().for_each(|foot| with_feet.set(cell_of(foot)));
        ctx.check()?;
        let uncovered = self.uncovered(ctx, &candidates(phi, surface, parts, &with_feet))?;
        let reach = self.reach();
        let items =
            uncovered.iter().zip(0..).map(|(position, index)| (bin_of(position, reach), index)).collect();
        let bins = Bins::new(reach, items);
        let is_beside = |foot: &Option<DVec3>| {
            let foot = foot.as_ref()?;
            let mut near = bins.near(foot).map(|position| (uncovered[position as usize] - foot).norm());
            near.any(|distance| distance <= reach).then_some(())
        };
        let are_beside =
            |_, feet: &[Option<DVec3>]| feet.iter().map(|foot| is_beside(foot).is_some()).collect();
        Ok((in_pieces(ctx, self.feet, GRAIN, are_beside)?, uncovered))
    }

    /// Maximum distance of a vertex' foot from an uncovered position beside it (cells).
    pub fn reach(&self) -> f64 {
        (NEAR * self.spacing).max(2.0) * if self.is_first { FIRST } else { 1.0 }
    }

    /// Those positions (cells) that are near no triangle of feet.
    fn uncovered(&self, ctx: &Context, positions: &[DVec3]) -> Result<Vec<DVec3>> {
        if positions.is_empty() {
            return Ok(Vec::new());
        }
        let slack = (SLACK * self.spacing).max(1.0);
        let mut wanted = Marks::default();
        positions
            .iter()
            .for_each(|position| around(bin_of(position, slack)).into_iter().for_each(|bin| wanted.set(bin)));
        let in_bins = |first: usize, triangles: &[[u32; 3]]| {
            let (mut out, mut bins) = (Vec::new(), Vec::new());
            for (triangle, index) in triangles.iter().zip(first as u32..) {
                let Some(corners) = self.corners(triangle) else { continue };
                each_bin(corners, slack, |bin| bins.push(bin));
                // Parts of a long triangle share most of their bins.
                bins.sort_unstable();
                bins.dedup();
                out.extend(bins.drain(..).filter(|bin| wanted.has(*bin)).map(|bin| (bin, index)));
            }
            out
        };
        let bins = Bins::new(slack, in_pieces(ctx, self.triangles, GRAIN, in_bins)?);
        let is_uncovered = |position: &DVec3| {
            !bins.near(position).any(|triangle| self.distance(triangle, position) <= slack)
        };
        in_pieces(ctx, positions, GRAIN, |_, positions| {
            positions.iter().filter(|position| is_uncovered(position)).copied().collect()
        })
    }

    fn corners(&self, triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
        let [a, b, c] = triangle.map(|vertex| self.feet[vertex as usize]);
        Some([a?, b?, c?])
    }

    /// Distance (cells) of a position from a triangle of feet.
    fn distance(&self, triangle: u32, position: &DVec3) -> f64 {
        let corners = self.corners(&self.triangles[triangle as usize]).expect("it was listed with its feet");
        let seen = corners.map(|corner| (corner - position).cast::<f32>().into());
        DVec3::from(Triangle::of_cells(seen).closest([0.0; 3]).map(f64::from)).norm()
    }
}

/// Vertices of the surface (cells) that may be uncovered: on parts that have feet, in cells without any.
fn candidates(phi: &Implicit, surface: &Isosurface, parts: &Parts, with_feet: &Marks) -> Vec<DVec3> {
    let position = |vertex: u32| {
        let position = surface.in_cells(phi, vertex);
        (parts.is_covered(vertex) && !with_feet.has(cell_of(&position))).then_some(position)
    };
    (0..surface.vertex_count() as u32).into_par_iter().with_min_len(4096).filter_map(position).collect()
}

/// Items in cubes (bins) with edges of `edge` (cells).
struct Bins {
    edge: f64,
    /// Ascending, each once.
    items: Vec<(Coord, u32)>,
}

impl Bins {
    fn new(edge: f64, mut items: Vec<(Coord, u32)>) -> Self {
        items.par_sort_unstable();
        items.dedup();
        Self { edge, items }
    }

    /// Items in the bin of a position (cells) and in those around it.
    fn near(&self, position: &DVec3) -> impl Iterator<Item = u32> {
        let [x, y, z] = bin_of(position, self.edge);
        // Three neighbours along z are contiguous in the order.
        (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y))).flat_map(move |(x, y)| {
            let from = self.items.partition_point(|(bin, _)| *bin < [x, y, z - 1]);
            self.items[from..].iter().take_while(move |(bin, _)| *bin <= [x, y, z + 1]).map(|(_, item)| *item)
        })
    }
}

/// Calls `see` with bins of `edge` (cells) that together contain a triangle; it is subdivided until each piece spans only a few bins.
fn each_bin(triangle: [DVec3; 3], edge: f64, mut see: impl FnMut(Coord)) {
    let [a, b, c] = &triangle;
    if (a.sup(b).sup(c) - a.inf(b).inf(c)).max() > LONG * edge {
        return;
    }
    // Most triangles span only a few bins: the list is not allocated for these.
    let (mut due, mut next) = (Vec::new(), Some(triangle));
    while let Some([a, b, c]) = next {
        let [low, high] = [bin_of(&a.inf(&b).inf(&c), edge), bin_of(&a.sup(&b).sup(&c), edge)];
        if (0..3).all(|axis| high[axis] - low[axis] <= 1) {
            between(low, high).for_each(&mut see);
            next = due.pop();
            continue;
        }
        // The longest edge, ab, is halved.
        let [a, b, c] = longest_first([a, b, c]);
        let middle = 0.5 * (a + b);
        due.push([a, middle, c]);
        next = Some([middle, b, c]);
    }
}

/// Marked bins or cells, as one bit each in patches.
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

fn bin_of(position: &DVec3, edge: f64) -> Coord {
    cell_of(&(position / edge))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bins_of_a_triangle_hold_all_of_it_and_a_sliver_has_few() {
        let corners = [DVec3::new(0.3, 0.2, 0.1), DVec3::new(40.2, 38.9, 41.7), DVec3::new(40.3, 39.0, 41.5)];
        let mut bins = Vec::new();
        each_bin(corners, 1.0, |bin| bins.push(bin));
        bins.sort_unstable();
        bins.dedup();
        assert!(bins.len() < 500, "{}", bins.len());
        for n in 0..=1000 {
            let share = f64::from(n) / 1000.0;
            for end in [corners[1], corners[2]] {
                let position = corners[0] + (end - corners[0]) * share;
                assert!(bins.binary_search(&cell_of(&position)).is_ok(), "{position}");
            }
        }
        each_bin([DVec3::zeros(), DVec3::new(3e3, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)], 1.0, |_| {
            panic!("it is too long")
        });
    }
}
