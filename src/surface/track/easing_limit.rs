//! Limits easing: parts of a mesh that are displaced towards their future bridge may pass through each other first. There displacements are
//! reduced, down to 0, so that the displayed mesh intersects itself only where the tracked mesh does.

use std::collections::HashSet;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::check::faults::meeting_pairs;
use crate::geometry::coords::{between, cell_of};
use crate::geometry::mesh::compact;
use crate::geometry::{Coord, DVec3, TriMesh};

/// Rounds in which the displacements of intersecting triangles are halved, and the total number of rounds. In the rounds after the halvings
/// these displacements are set to 0, and after the last round all are.
const HALVINGS: usize = 5;
const ROUNDS: usize = 20;
/// Maximum difference of the shares of neighbours after a round: no vertex is left sticking out alone.
const STEP: f64 = 0.25;
/// Maximum number of bins for the box of a triangle; a larger box counts as near everything.
const BINS: i64 = 4096;
/// Sentinel: the vertex is not displaced.
const NONE: u32 = u32::MAX;

/// A vertex, and its displacement (m).
pub type Displaced = (u32, DVec3);

/// Reduces displacements, of different vertices, so that the mesh intersects itself only where it does without them, with positions rounded
/// to the 32 bits that files have.
///
/// # Errors
/// Cancel.
pub fn uncrossed(
    ctx: &Context,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    displaced: Vec<Displaced>,
) -> Result<Vec<Displaced>> {
    if displaced.is_empty() {
        return Ok(displaced);
    }
    ctx.phase("ease", || {
        let reached_region = ReachedRegion::of(vertices, triangles, &displaced);
        let mut shares = vec![0.0; displaced.len()];
        let own = reached_region.intersecting_pairs(&shares);
        shares.fill(1.0);
        for round in 0..=ROUNDS {
            ctx.check()?;
            let crossed = reached_region.crossed(&own, &shares);
            if crossed.is_empty() {
                break;
            }
            if round == ROUNDS {
                shares.fill(0.0);
                break;
            }
            let share = if round < HALVINGS { 0.5 } else { 0.0 };
            crossed.into_iter().for_each(|slot| shares[slot as usize] *= share);
            reached_region.even_out(&mut shares);
        }
        Ok(displaced.iter().zip(shares).map(|((vertex, by), share)| (*vertex, by * share)).collect())
    })
}

/// The part of a mesh that displacements may reach.
struct ReachedRegion<'a> {
    vertices: &'a [DVec3],
    displaced: &'a [Displaced],
    /// Indices of the mesh's vertices, ascending, and the index of each one's displacement, or [`NONE`].
    indices: Vec<u32>,
    slots: Vec<u32>,
    /// Triangles of these vertices.
    triangles: Vec<[u32; 3]>,
}

impl<'a> ReachedRegion<'a> {
    fn of(vertices: &'a [DVec3], triangles: &[[u32; 3]], displaced: &'a [Displaced]) -> Self {
        let mut slots = vec![NONE; vertices.len()];
        (0..).zip(displaced).for_each(|(slot, (vertex, _))| slots[*vertex as usize] = slot);
        let is_moved = |corners: &&[u32; 3]| corners.iter().any(|corner| slots[*corner as usize] != NONE);
        let bounds = |corners: &[u32; 3]| {
            let first = vertices[corners[0] as usize];
            corners.iter().fold([first; 2], |[low, high], corner| {
                let own = vertices[*corner as usize];
                let by =
                    displaced.get(slots[*corner as usize] as usize).map_or(DVec3::zeros(), |(_, by)| *by);
                let to = own + by;
                [low.inf(&own).inf(&to), high.sup(&own).sup(&to)]
            })
        };
        let reached: Vec<[DVec3; 2]> = triangles.iter().filter(is_moved).map(bounds).collect();
        let bins = Bins::of(&reached);
        let near: Vec<[u32; 3]> =
            triangles.iter().filter(|corners| bins.has(&bounds(corners))).copied().collect();
        let (indices, triangles) = compact(vertices.len(), &near);
        let slots = indices.iter().map(|index| slots[*index as usize]).collect();
        Self { vertices, displaced, triangles, indices, slots }
    }

    /// Pairs of triangles that intersect if vertices are displaced by these shares of the requested displacements.
    fn intersecting_pairs(&self, shares: &[f64]) -> Vec<[u32; 2]> {
        let position = |(index, slot): (&u32, &u32)| {
            let own = self.vertices[*index as usize];
            let by = self.displaced.get(*slot as usize).map(|(_, by)| by * shares[*slot as usize]);
            by.map_or(own, |by| own + by).cast()
        };
        let positions = self.indices.iter().zip(&self.slots).map(position).collect();
        meeting_pairs(&TriMesh { positions, triangles: self.triangles.clone() })
    }

    /// Indices of the displacements at triangles that intersect with these shares, but not without displacements; ascending.
    fn crossed(&self, own: &[[u32; 2]], shares: &[f64]) -> Vec<u32> {
        let new = self.intersecting_pairs(shares).into_iter().filter(|pair| own.binary_search(pair).is_err());
        let corners = new.flatten().flat_map(|triangle| self.triangles[triangle as usize]);
        let mut crossed: Vec<u32> =
            corners.map(|corner| self.slots[corner as usize]).filter(|slot| *slot != NONE).collect();
        crossed.sort_unstable();
        crossed.dedup();
        crossed
    }

    /// Lowers shares that are far above those of neighbours.
    fn even_out(&self, shares: &mut [f64]) {
        let before = shares.to_vec();
        for corners in &self.triangles {
            let slots = corners.map(|corner| self.slots[corner as usize]);
            let own = slots.into_iter().filter(|slot| *slot != NONE);
            let min = own.clone().map(|slot| before[slot as usize]).fold(f64::INFINITY, f64::min);
            for slot in own {
                let share = &mut shares[slot as usize];
                *share = share.min(min + STEP);
            }
        }
    }
}

/// The bins that boxes touch.
struct Bins {
    /// Edge (m).
    edge: f64,
    /// Bounds of all boxes (m).
    bounds: [DVec3; 2],
    touched: HashSet<Coord>,
    /// Whether a box was too large to be listed.
    is_all: bool,
}

impl Bins {
    fn of(boxes: &[[DVec3; 2]]) -> Self {
        let first = boxes.first().copied().unwrap_or_default();
        let bounds = boxes.iter().fold(first, |[low, high], [a, b]| [low.inf(a), high.sup(b)]);
        let sum: f64 = boxes.iter().map(|[low, high]| (high - low).amax()).sum();
        let edge = 2.0 * sum / boxes.len().max(1) as f64;
        let mut bins = Self { edge, bounds, touched: HashSet::new(), is_all: false };
        for own in boxes {
            match bins.between(own) {
                Some([low, high]) => bins.touched.extend(between(low, high)),
                None => bins.is_all = true,
            }
        }
        bins
    }

    /// Whether a box touches one of the listed bins.
    fn has(&self, own: &[DVec3; 2]) -> bool {
        let [low, high] = self.bounds;
        if (0..3).any(|axis| own[1][axis] < low[axis] || own[0][axis] > high[axis]) {
            return false;
        }
        let Some([low, high]) = self.between(own) else { return true };
        self.is_all || between(low, high).any(|bin| self.touched.contains(&bin))
    }

    /// The range of bins of a box; none if there are too many.
    fn between(&self, [low, high]: &[DVec3; 2]) -> Option<[Coord; 2]> {
        let from = self.bounds[0];
        let ends = [low, high].map(|position| cell_of(&((position - from) / self.edge)));
        let count = |axis: usize| i64::from(ends[1][axis]) - i64::from(ends[0][axis]) + 1;
        let all = count(0).checked_mul(count(1))?.checked_mul(count(2))?;
        (self.edge > 0.0 && all <= BINS).then_some(ends)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Outlook;
    use crate::surface::test_particles::{context, rebuilt, two_balls};

    /// Two cubes with a gap of 1 between them.
    fn cubes() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut mesh = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        mesh.append(&TriMesh::cuboid([2.0, 0.0, 0.0], [3.0, 1.0, 1.0]));
        (mesh.positions.iter().map(|position| position.cast()).collect(), mesh.triangles)
    }

    /// Moves the faces at the gap towards each other by `by`.
    fn towards(vertices: &[DVec3], by: f64) -> Vec<Displaced> {
        let at_gap = (0..).zip(vertices).filter(|(_, position)| position.x == 1.0 || position.x == 2.0);
        at_gap
            .map(|(vertex, position)| (vertex, DVec3::x() * if position.x < 1.5 { by } else { -by }))
            .collect()
    }

    #[test]
    fn faces_that_would_pass_through_each_other_stop_short_and_others_do_not() {
        let ctx = context(2);
        let (vertices, triangles) = cubes();
        let within = |by: f64| uncrossed(&ctx, &vertices, &triangles, towards(&vertices, by)).unwrap();
        assert_eq!(within(0.49), towards(&vertices, 0.49));
        assert!(within(0.0).iter().all(|(_, by)| *by == DVec3::zeros()));
        for by in [0.51, 0.8, 5.0, 10.0] {
            let left = within(by);
            let far = left.iter().map(|(_, by)| by.norm()).fold(0.0, f64::max);
            assert!((0.1..0.5).contains(&far), "{by}: {far}");
            let asked = towards(&vertices, by);
            assert!(
                left.iter()
                    .zip(&asked)
                    .all(|(left, asked)| left.0 == asked.0 && left.1.norm() <= asked.1.norm())
            );
        }
        ctx.cancel();
        assert!(uncrossed(&ctx, &vertices, &triangles, towards(&vertices, 0.8)).is_err());
    }

    #[test]
    fn a_mesh_that_is_shown_before_a_merge_meets_itself_nowhere_that_it_does_not_anyway() {
        const AHEAD: usize = 4;
        let ctx = context(2);
        let balls = |frame: usize| two_balls(4.2, DVec3::new(6.5 - 0.2 * frame as f64, 0.1, 0.0));
        let mut tracker = rebuilt(&ctx, &balls(0));
        let (mut outlook, mut moved) = (Outlook::default(), 0);
        for frame in 0..14 {
            let coming = (1..=AHEAD + 1).map(|ahead| balls(frame + ahead)).collect();
            outlook.look(&ctx, &tracker, balls(frame), coming, 0.04).unwrap();
            let positions = outlook.eased(&ctx, &tracker, AHEAD).unwrap();
            moved += positions.iter().zip(tracker.vertices()).filter(|(shown, own)| shown != own).count();
            let pairs = |positions: &[DVec3]| {
                let positions = positions.iter().map(|position| position.cast()).collect();
                meeting_pairs(&TriMesh { positions, triangles: tracker.triangles().to_vec() })
            };
            let own = pairs(tracker.vertices());
            assert!(pairs(&positions).iter().all(|pair| own.contains(pair)), "frame {frame}");
            tracker = outlook.take(&balls(frame), &balls(frame + 1), 0.04).unwrap().0;
        }
        assert!(moved > 20, "{moved}");
    }
}
