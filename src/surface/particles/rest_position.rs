//! Where the liquid at a position was at the first frame, from the particles around it, by their ids.

use rayon::prelude::*;

use super::affine_fit::{Near, sums};
use super::grid::Cells;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::shape::bounds;
use crate::geometry::{Coord, DVec3};
use crate::mesh_repair::Source;
use crate::surface::Particles;
use crate::surface::pieces::in_pieces;
use crate::surface::topology::change::Change;
use crate::surface::tracked_mesh::Tracker;

/// Radius within which particles count (spacings): that of advection's maps. Where there are none, it is doubled up to `DOUBLINGS` times.
const RADIUS: i32 = 3;
const DOUBLINGS: u32 = 1;
/// Cells along a radius.
const RINGS: i32 = 2;
/// Particles have the same origin if their first positions lie within this many radii (4 spacings) of that of their representative. The
/// particles around a position on the surface lie at most slightly more than a radius from the nearest of them, so that liquid that has
/// kept its shape has a single origin. Two bodies that were more than 4 spacings apart have two; if the gap was narrower, results between
/// them are off by less than the gap. Where the liquid has been compressed by more than this factor, only the nearest particles count.
const TOGETHER: f64 = 4.0 / 3.0;
/// Positions per task.
const PIECE: usize = 256;
/// Particles per task.
const GRAIN: usize = 4096;
/// Maximum coordinate of a cell.
const LIMIT: f64 = (i32::MAX / 4) as f64;

/// The position of each particle at the first frame.
#[derive(Debug, Clone)]
pub struct Rest {
    /// Ascending.
    ids: Vec<i64>,
    /// The particles' positions (m), in the order of the ids.
    positions: Vec<DVec3>,
}

impl Rest {
    /// From the particles at the first frame; none if they have no ids.
    pub fn of(first: &Particles) -> Option<Self> {
        if first.ids.is_empty() {
            return None;
        }
        let mut all: Vec<(i64, DVec3)> =
            first.ids.iter().copied().zip(first.positions.iter().copied()).collect();
        all.sort_unstable_by_key(|(id, _)| *id);
        let (ids, positions) = all.into_iter().unzip();
        Some(Self { ids, positions })
    }

    /// Where the liquid at positions (m) was at the first frame (m), from the particles `now` around them, whose spacing is `spacing` (m).
    /// Their displacements back to the first frame are fitted by an affine map, like those of advection; of particles with different
    /// origins only those of the origin with the largest total weight count. None if no particle within three spacings existed at the first
    /// frame (within six, if there is none at all within three), or if particles have no ids. The results for different positions are
    /// independent.
    ///
    /// # Errors
    /// A spacing that is not over 0; particles too far apart; cancel.
    pub fn positions(
        &self,
        ctx: &Context,
        now: &Particles,
        spacing: f64,
        at: &[DVec3],
    ) -> Result<Vec<Option<DVec3>>> {
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(Error::argument(format!("spacing = {spacing} is not over 0 m")));
        }
        if now.ids.len() != now.positions.len() {
            return Ok(vec![None; at.len()]);
        }
        ctx.phase("rest", || {
            let field = Field::of(self, now, spacing, at)?;
            ctx.check()?;
            in_pieces(ctx, at, PIECE, |_, piece| {
                let mut scratch = Scratch::default();
                piece.iter().map(|position| field.first(*position, &mut scratch)).collect()
            })
        })
    }

    /// The same for the vertices of new triangles after a change, at the time of the particles `now`, as
    /// [`Traced`](crate::mesh_repair::Traced) needs it. None for all other vertices.
    ///
    /// # Errors
    /// As [`Rest::positions`].
    pub fn of_change(
        &self,
        ctx: &Context,
        now: &Particles,
        spacing: f64,
        change: &Change,
    ) -> Result<Vec<Option<DVec3>>> {
        let made = change.triangles.iter().zip(&change.sources).filter(|(_, from)| **from == Source::New);
        let mut vertices: Vec<u32> = made.flat_map(|(corners, _)| *corners).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let at: Vec<DVec3> = vertices.iter().map(|vertex| change.vertices[*vertex as usize]).collect();
        let mut out = vec![None; change.vertices.len()];
        for (vertex, position) in vertices.into_iter().zip(self.positions(ctx, now, spacing, &at)?) {
            out[vertex as usize] = position;
        }
        Ok(out)
    }

    fn find(&self, id: i64) -> Option<DVec3> {
        self.ids.binary_search(&id).ok().map(|at| self.positions[at])
    }
}

impl Tracker {
    /// Where the liquid at each vertex was at the first frame (m), from the particles at the end of the last step: see
    /// [`Rest::positions`].
    ///
    /// # Errors
    /// As [`Rest::positions`].
    pub fn rest(&self, ctx: &Context, rest: &Rest, now: &Particles) -> Result<Vec<Option<DVec3>>> {
        rest.positions(ctx, now, self.params.spacing, &self.vertices)
    }
}

/// A particle near a position.
#[derive(Clone, Copy)]
struct Neighbour {
    /// From the corner of the position's cell (cells).
    offset: [f32; 3],
    /// Its position now and at the first frame (m).
    now: DVec3,
    first: DVec3,
    weight: f64,
    /// The particle that represents its origin.
    representative: Option<usize>,
}

/// Scratch buffers of a task.
#[derive(Default)]
struct Scratch {
    neighbours: Vec<Neighbour>,
    near: Near,
    in_radius: Near,
}

/// The particles near some positions.
struct Field {
    cells: Cells,
    /// The current position of each, and that at the first frame if it existed then (m), in the order of cells.
    particles: Vec<(DVec3, Option<DVec3>)>,
    /// m.
    spacing: f64,
}

impl Field {
    fn of(rest: &Rest, now: &Particles, spacing: f64, at: &[DVec3]) -> Result<Self> {
        let reach = DVec3::repeat(f64::from(RADIUS << DOUBLINGS) * spacing);
        let (low, high) = bounds(at);
        let (low, high) = (low - reach, high + reach);
        let is_near = |particle: &u32| {
            let position = now.positions[*particle as usize];
            (0..3).all(|axis| low[axis] <= position[axis] && position[axis] <= high[axis])
        };
        let near: Vec<u32> = (0..now.positions.len() as u32).filter(is_near).collect();
        let positions: Vec<DVec3> = near.iter().map(|particle| now.positions[*particle as usize]).collect();
        let id = |n: u32| now.ids[near[n as usize] as usize];
        let cells = Cells::new(&positions, f64::from(RADIUS) * spacing / f64::from(RINGS), id)?;
        let particle = |n: &u32| (positions[*n as usize], rest.find(id(*n)));
        let particles = cells.order.par_iter().with_min_len(GRAIN).map(particle).collect();
        Ok(Self { cells, particles, spacing })
    }

    /// Where the liquid at a position (m) was at the first frame (m).
    fn first(&self, position: DVec3, scratch: &mut Scratch) -> Option<DVec3> {
        let edge = self.cells.edge();
        let cell = [0, 1, 2].map(|axis| (position[axis] / edge).floor().clamp(-LIMIT, LIMIT) as i32);
        let from = position / edge - DVec3::from(cell.map(f64::from));
        let is_there = |doubling: &u32| self.gather(cell, from, RINGS << *doubling, &mut scratch.neighbours);
        let doubling = (0..=DOUBLINGS).find(is_there)?;
        self.fitted(position, from, RADIUS << doubling, scratch)
    }

    /// Collects the particles that existed at the first frame within `rings` cells of a position, which is relative to the corner of its
    /// cell (cells). Returns whether any particle is near, even one that did not exist then.
    fn gather(&self, cell: Coord, from: DVec3, rings: i32, neighbours: &mut Vec<Neighbour>) -> bool {
        neighbours.clear();
        let (mut is_any, square) = (false, f64::from(rings * rings));
        let [low, high] = [-rings, rings].map(|by| cell.map(|at| at + by));
        self.cells.near(low, high, cell, |particle, offset| {
            let d = DVec3::from(offset.map(f64::from)) - from;
            let q = 1.0 - d.norm_squared() / square;
            if q > 0.0 {
                is_any = true;
                if let (now, Some(first)) = self.particles[particle] {
                    neighbours.push(Neighbour {
                        offset,
                        now,
                        first,
                        weight: q * q * q,
                        representative: None,
                    });
                }
            }
        });
        is_any
    }

    /// Where the liquid at a position (m) was at the first frame (m), fitted to the particles gathered within a radius (spacings); `from`
    /// is the position relative to the corner of its cell (cells).
    fn fitted(&self, position: DVec3, from: DVec3, radius: i32, scratch: &mut Scratch) -> Option<DVec3> {
        let Scratch { neighbours, near, in_radius } = scratch;
        let max_distance = TOGETHER * f64::from(radius) * self.spacing;
        let representative = heaviest_origin(neighbours, max_distance)?;
        let Neighbour { now, first, .. } = neighbours[representative];
        let displacement = first - now;
        // In spacings. Displacements are relative to that of the representative: they may be long, and differ by little.
        let edge = (self.cells.edge() / self.spacing) as f32;
        near.clear();
        for one in neighbours.iter().filter(|one| one.representative == Some(representative)) {
            let residual = (one.first - one.now - displacement) / self.spacing;
            near.push(
                one.offset.map(|x| edge * x),
                [residual.x as f32, residual.y as f32, residual.z as f32],
            );
        }
        let at = [from.x, from.y, from.z].map(|x| edge * x as f32);
        let to = |residual: DVec3| position + displacement + residual * self.spacing;
        let Some(sums) = sums(near, in_radius, at, radius as f32) else { return Some(to(DVec3::zeros())) };
        let fit = to(sums.map().at(DVec3::zeros()));
        // A fit to few particles may extrapolate far away; their mean is no worse then.
        Some(if (fit - first).norm() <= max_distance { fit } else { to(sums.mean()) })
    }
}

/// Groups particles by origin: those whose first positions lie within `max_distance` (m) of that of the heaviest particle left form a
/// group, represented by it. Returns the representative of the group with the largest total weight; none without particles.
fn heaviest_origin(neighbours: &mut [Neighbour], max_distance: f64) -> Option<usize> {
    let mut left: f64 = neighbours.iter().map(|one| one.weight).sum();
    let mut best: Option<(f64, usize)> = None;
    while best.is_none_or(|(weight, _)| left > weight) {
        let free = neighbours.iter().enumerate().filter(|(_, one)| one.representative.is_none());
        let Some((representative, _)) = free.max_by(|a, b| a.1.weight.total_cmp(&b.1.weight)) else { break };
        let (first, mut weight) = (neighbours[representative].first, 0.0);
        for one in neighbours.iter_mut().filter(|one| one.representative.is_none()) {
            if (one.first - first).norm() <= max_distance {
                one.representative = Some(representative);
                weight += one.weight;
            }
        }
        left -= weight;
        if best.is_none_or(|(other, _)| weight > other) {
            best = Some((weight, representative));
        }
    }
    best.map(|(_, representative)| representative)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, numbered};

    /// A block of n^3 positions, one apart, starting at a corner.
    fn block(corner: DVec3, n: i32) -> impl Iterator<Item = DVec3> {
        let on = move |axis: u32| (0..n * n * n).map(move |at| f64::from(at / n.pow(axis) % n));
        on(0).zip(on(1)).zip(on(2)).map(move |((x, y), z)| corner + DVec3::new(x, y, z))
    }

    /// Rotated by 1 rad about an axis, stretched, and moved far away.
    fn moved(position: DVec3) -> DVec3 {
        let axis = DVec3::new(1.0, 2.0, 0.5).normalize();
        let p = position.component_mul(&DVec3::new(1.2, 0.95, 0.9));
        let turned = p * libm::cos(1.0)
            + axis.cross(&p) * libm::sin(1.0)
            + axis * (axis.dot(&p) * (1.0 - libm::cos(1.0)));
        turned + DVec3::new(40.0, -3.0, 7.0)
    }

    #[test]
    fn liquid_that_turned_and_stretched_is_found_where_it_was() {
        let ctx = context(2);
        let spacing = 0.01;
        let first = numbered(block(DVec3::zeros(), 9).map(|position| position * spacing).collect());
        let rest = Rest::of(&first).unwrap();
        // In reverse order, and with particles that were born later, far away.
        let mut now = numbered(block(DVec3::zeros(), 9).map(|position| moved(position) * spacing).collect());
        now.positions.extend(block(DVec3::new(90.0, 0.0, 0.0), 3).map(|position| position * spacing));
        now.ids.extend(10_000..10_027);
        now.positions.reverse();
        now.ids.reverse();
        let wanted = [[4.0, 4.0, 4.0], [4.3, 3.6, 4.1], [-0.5, 4.0, 4.0], [8.4, 8.4, 8.4], [-0.5, -0.5, 4.0]]
            .map(DVec3::from);
        let mut at: Vec<DVec3> = wanted.iter().map(|position| moved(*position) * spacing).collect();
        at.extend(
            [DVec3::new(91.0, 1.0, 1.0), DVec3::new(-50.0, 0.0, 0.0)].map(|position| position * spacing),
        );
        let found = rest.positions(&ctx, &now, spacing, &at).unwrap();
        for (found, wanted) in found.iter().zip(&wanted) {
            let off = (found.unwrap() / spacing - wanted).norm();
            assert!(off < 5e-3, "{wanted}: {off} spacings off");
        }
        assert_eq!(found[wanted.len()..], [None, None]);
        // One by one, and on one thread, the results are the same bit for bit.
        let alone = context(0);
        for (position, found) in at.iter().zip(&found) {
            assert_eq!(rest.positions(&alone, &now, spacing, &[*position]).unwrap(), [*found]);
        }
        let nameless = Particles { ids: Vec::new(), ..now.clone() };
        assert!(Rest::of(&nameless).is_none());
        assert_eq!(rest.positions(&ctx, &nameless, spacing, &at[..2]).unwrap(), [None, None]);
        let error = rest.positions(&ctx, &now, 0.0, &at).unwrap_err();
        assert_eq!(error.to_string(), "spacing = 0 is not over 0 m");
        ctx.cancel();
        assert!(matches!(rest.positions(&ctx, &now, spacing, &at), Err(Error::Cancelled)));
    }

    #[test]
    fn a_position_between_liquids_that_came_together_was_in_one_of_the_two() {
        let ctx = context(2);
        // Two blocks with a gap of 5 between them, which closes to one spacing, and to a half.
        for deep in [0.0, 0.5] {
            let displacements =
                [DVec3::new(2.0 + 0.5 * deep, 0.0, 0.0), DVec3::new(-2.0 - 0.5 * deep, 0.0, 0.0)];
            let corners = [DVec3::zeros(), DVec3::new(10.0, 0.3, 0.4)];
            let all = |share: f64| {
                let one =
                    |n: usize| block(corners[n], 6).map(move |position| position + displacements[n] * share);
                numbered(one(0).chain(one(1)).collect())
            };
            let rest = Rest::of(&all(0.0)).unwrap();
            let at: Vec<DVec3> = (0..400)
                .map(|n| [n % 20, n / 20 % 5, n / 100].map(f64::from))
                .map(|[x, y, z]| DVec3::new(5.5 + 0.2 * x, 1.2 * y - 0.3, 1.5 * z))
                .collect();
            let found = rest.positions(&ctx, &all(1.0), 1.0, &at).unwrap();
            let mut counts = [0; 2];
            for (position, found) in at.iter().zip(&found) {
                let off = displacements.map(|displacement| (found.unwrap() + displacement - position).norm());
                let nearer = usize::from(off[1] < off[0]);
                assert!(off[nearer] < 1e-3, "{deep}, {position}: {off:?}");
                counts[nearer] += 1;
            }
            assert!(counts.iter().all(|count| *count > 150), "{counts:?}");
        }
    }
}
