//! Grains stay in front of the ground: of hills and slopes that a ball sweeps, and under plates that press them on a plane.

use crate::common::hills::{params, squeeze, terrains};
use crate::common::liquids::context;

#[test]
fn no_grain_is_behind_a_hill_or_a_slope() {
    let ctx = context(2);
    for (seed, terrain) in (0..).zip(terrains()) {
        // The ball comes as near to the ground as 5 mm, which leaves snow thinner than a grain, and 40 mm.
        for clearance in [0.005, 0.04] {
            let out = terrain.sweep(&ctx, clearance, params(seed));
            assert!(out.born > 100, "{}: {out:?}", terrain.name);
            assert_eq!(out.behind, 0, "{} at {clearance} m: {out:?}", terrain.name);
            assert!(out.unaccounted < 1.0e-6, "{}: {out:?}", terrain.name);
        }
    }
}

#[test]
fn no_grain_is_pressed_into_a_plane() {
    let out = squeeze(&context(2), params(1));
    assert!(out.born > 1000, "{out:?}");
    assert_eq!((out.behind, out.low), (0, 0), "{out:?}");
}
