//! Blocks in which the band of distances must reach farther than elsewhere: around the few vertices with much deeper detail than nearly all
//! others. A band that wide over the whole surface would take many times as long.

use std::collections::BTreeMap;

use crate::geometry::coords::{between, cell_of};
use crate::geometry::{Coord, DVec3};
use crate::numeric::blocks::DIM;
use crate::surface::level_set::band::reach_in;
use crate::surface::tracked_mesh::{DRIFT, REACH, Tracker, WIDER};

/// Blocks of the band, ascending, and its reach in each (cells).
pub type Deep = Vec<(Coord, f32)>;

/// Distance of nodes from a vertex that splines read (cells), plus one for rounding.
const READ: f64 = 3.0;
/// Reaches are rounded up to multiples of this (cells), so that the reach of a vertex does not depend on how it was measured.
const STEP: f64 = 0.25;

impl Tracker {
    /// The reach of the band (r) that a vertex with a given distance (r) needs.
    pub(in crate::surface) fn reach_for(&self, delta: f64) -> f64 {
        // Splines read two nodes farther; a vertex drifts less than `DRIFT` before it is moved back.
        (WIDER * delta + DRIFT + 2.0 * self.params.cell).clamp(REACH[0], REACH[1])
    }

    /// The blocks around vertices at these positions (m) in which the band must reach farther than elsewhere. Around vertices without a
    /// distance it reaches as far as `unknown` (r).
    pub(in crate::surface) fn deep(&self, vertices: &[DVec3], unknown: f64) -> Deep {
        let (spacing, cell) = (self.params.spacing, self.params.cell * self.params.spacing);
        let cells = |length: f64| (length / self.params.cell / STEP).ceil() * STEP;
        // Neighbours share their blocks: each set of blocks is listed once.
        let mut boxes: BTreeMap<[Coord; 2], f64> = BTreeMap::new();
        for (position, delta) in vertices.iter().zip(&self.delta) {
            let far = f64::from(delta.abs()) / spacing;
            // Maximum length of the path of a vertex to its foot (r).
            let [reach, path] =
                if delta.is_nan() { [unknown; 2] } else { [self.reach_for(far), far + 2.0 * DRIFT] };
            if reach > self.reach {
                let side = DVec3::repeat(cells(path) + READ);
                let corners = [position / cell - side, position / cell + side];
                let max_reach = boxes.entry(corners.map(|at| cell_of(&(at / DIM as f64)))).or_default();
                *max_reach = max_reach.max(cells(reach));
            }
        }
        let blocks = |([low, high], reach): ([Coord; 2], f64)| {
            between(low, high).map(move |block| (block, reach as f32))
        };
        sorted(boxes.into_iter().flat_map(blocks).collect())
    }
}

/// Sorts blocks; each appears once, with its largest reach.
pub fn sorted(mut blocks: Deep) -> Deep {
    blocks.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    blocks.dedup_by_key(|(block, _)| *block);
    blocks
}

/// Whether the band reaches at least as far in all blocks of `deep` as in those of `other`.
pub fn covers(deep: &[(Coord, f32)], other: &[(Coord, f32)]) -> bool {
    other.iter().all(|(block, reach)| reach_in(deep, *block).is_some_and(|own| own >= *reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::{context, numbered, own_surface, shell};
    use crate::surface::{Params, Particles};

    #[test]
    fn one_deep_detail_widens_the_band_around_it_alone_and_is_kept() {
        let ctx = context(2);
        let positions = shell(DVec3::zeros(), 0.0, 6.2);
        let mut mesh = own_surface(&ctx, &positions);
        for vertex in [17, 18] {
            let out = mesh.positions[vertex].normalize();
            mesh.positions[vertex] += out * 2.7;
        }
        let at = |frame: i32| -> Particles {
            let by = DVec3::new(0.11, 0.07, -0.05) * f64::from(frame);
            numbered(positions.iter().map(|position| position + by).collect())
        };
        let params = Params::for_spacing(1.0);
        let mut tracker = Tracker::new(&ctx, params, &mesh, &at(0)).unwrap();
        assert!(tracker.delta().iter().all(|delta| !delta.is_nan()));
        assert!((tracker.delta()[17] - 2.7).abs() < 0.2, "{}", tracker.delta()[17]);
        assert!(tracker.reach < 2.6, "{} r everywhere", tracker.reach);
        let deep = tracker.deep(tracker.vertices(), 0.0);
        assert!(!deep.is_empty() && deep.len() <= 128, "{} blocks", deep.len());
        for frame in 0..4 {
            let report = tracker.step(&ctx, &at(frame), &at(frame + 1), 0.04).unwrap();
            assert_eq!(report.flagged(), 0, "frame {frame}");
        }
        let by = at(4).positions[0] - positions[0];
        let off = tracker
            .vertices()
            .iter()
            .zip(&mesh.positions)
            .map(|(now, first)| now - (first.cast::<f64>() + by));
        let most = off.map(|off| off.norm()).fold(0.0, f64::max);
        assert!(most < 0.05, "a vertex is off by {most} r");
    }

    #[test]
    fn lists_of_blocks_keep_the_farthest_reach() {
        let list = sorted(vec![([1, 0, 0], 3.0), ([0, 0, 0], 2.0), ([1, 0, 0], 5.0)]);
        assert_eq!(list, [([0, 0, 0], 2.0), ([1, 0, 0], 5.0)]);
        assert!(covers(&list, &[([1, 0, 0], 4.0)]) && covers(&list, &[]));
        assert!(!covers(&list, &[([1, 0, 0], 6.0)]) && !covers(&list, &[([2, 0, 0], 1.0)]));
    }
}
