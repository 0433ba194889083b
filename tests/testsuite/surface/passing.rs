//! Two bodies that pass by each other: the mesh is one where their particles' surface is, and nowhere else.

use frazil::geometry::DVec3;
use frazil::geometry::check::topology::components;
use frazil::surface::{Params, Tracker};

use crate::common::liquids::{context, filled, numbered, own_surface};

const FRAMES: usize = 24;

/// Two slabs whose outermost particles pass by at a distance: their particles' positions in a frame (spacings).
fn slabs(gap: f64, frame: usize) -> Vec<DVec3> {
    let slab = filled(1.0, 0.1, 8.0, |at| at.x.abs() < 6.0 && at.y.abs() < 3.0 && at.z.abs() < 4.0);
    let along = 10.0 - 20.0 * frame as f64 / FRAMES as f64;
    let by = DVec3::new(along, 2.5 + 0.5 * gap, 0.0);
    slab.iter().map(|at| at + by).chain(slab.iter().map(|at| at - by)).collect()
}

#[test]
fn the_mesh_is_one_where_the_particles_own_surface_is_one() {
    let ctx = context(2);
    // Between their particles. Half-way between flat sides the mean of the particles moves 3.5 times as fast as the point it is taken for where
    // they are 4.2 spacings apart; from that rate on no point is inside.
    for (gap, is_joined) in [(1.6, true), (2.6, true), (5.0, false)] {
        let at = |frame: usize| numbered(slabs(gap, frame));
        let own = |frame: usize| own_surface(&ctx, &at(frame).positions, 1.0);
        let mut from = at(0);
        let params = Params { rebuild: true, min_drop: 8, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(&ctx, params, &own(0), &from).expect("a tracker");
        let (mut counts, mut changed) = (Vec::new(), 0);
        for frame in 1..=FRAMES {
            let to = at(frame);
            let report = tracker.step(&ctx, &from, &to, 1.0 / 24.0).expect("a step");
            from = to;
            changed += report.change.map_or(0, |change| change.flagged_cells);
            counts.push([components(tracker.triangles()).len(), components(&own(frame).triangles).len()]);
        }
        let [first, middle, last] = [0, FRAMES / 2 - 1, FRAMES - 1].map(|at| counts[at]);
        assert_eq!([first, last], [[2; 2]; 2], "{gap}: {counts:?}");
        assert_eq!(middle, [if is_joined { 1 } else { 2 }; 2], "{gap}: {counts:?}");
        assert_eq!(changed > 0, is_joined, "{gap}: {changed} cells");
        // Bubbles in the gap are parts of the particles' surface that the mesh has not.
        let is_one = |count: &[usize; 2]| count[1] < 2 || count[0] > 1;
        assert!(counts.windows(3).all(|all| all.iter().any(is_one)), "{gap}: {counts:?}");
    }
}
