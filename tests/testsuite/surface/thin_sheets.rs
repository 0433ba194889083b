//! A sheet of liquid that is drawn out until it is thinner than its particles are apart: the mesh has the volume of the particles' surface,
//! which lies one spacing off the sheet on both sides.

use frazil::base::DVec3;
use frazil::surface::{Params, Tracker};

use crate::common::liquids::{context, filled, numbered, own_surface};

const FRAMES: usize = 24;
/// Half of the sheet's width at first (spacings).
const HALF: f64 = 9.0;

#[test]
fn a_sheet_that_thins_has_the_volume_of_the_particles_own_surface() {
    let ctx = context(2);
    let first = filled(1.0, 0.1, HALF, |at| at.abs().max() < HALF && at.y.abs() < 2.0);
    // From 4 spacings to 1.
    let at = |frame: usize| {
        let wide = libm::exp2(frame as f64 / FRAMES as f64);
        numbered(first.iter().map(|at| DVec3::new(at.x * wide, at.y / (wide * wide), at.z * wide)).collect())
    };
    let own = |frame: usize| own_surface(&ctx, &at(frame).places, 1.0);
    let mut from = at(0);
    let params = Params { rebuild: true, min_drop: 8, ..Params::for_spacing(1.0) };
    let mut tracker = Tracker::new(&ctx, params, &own(0), &from).expect("a tracker");
    for frame in 1..=FRAMES {
        let to = at(frame);
        tracker.step(&ctx, &from, &to, 1.0 / 24.0).expect("a step");
        from = to;
        let ratio = tracker.mesh().volume() / own(frame).volume();
        assert!((ratio - 1.0).abs() < 0.01, "frame {frame}: {ratio}");
    }
    // All that is within a spacing of a plate of the particles, which stand for half as much.
    let (volume, edge) = (tracker.mesh().volume(), 4.0 * HALF - 2.0);
    let expected = 2.0 * edge * edge + 2.0 * std::f64::consts::PI * edge;
    assert!((volume / expected - 1.0).abs() < 0.1, "{volume} of {expected}");
    assert!(volume > 1.8 * first.len() as f64, "{volume} of {} particles", first.len());
}
