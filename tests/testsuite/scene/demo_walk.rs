//! The demonstration's walk is one that a person could walk: treads are left because nothing slides.

use crate::common::boot::{left_boot, right_boot};
use crate::common::walk::walk;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys};

const DEPTH: f64 = 0.08;
const FRAMES: i32 = 48;

fn keys(side: f64) -> Keys {
    let key = |step: crate::common::walk::Step| Key {
        time: f64::from(step.frame),
        at: DVec3::from(step.at),
        turn: DVec3::from(step.turn_deg.map(f64::to_radians)),
    };
    Keys::new(walk(side, FRAMES, DEPTH).into_iter().map(key).collect()).unwrap()
}

#[test]
fn no_tread_digs_below_the_ground_and_none_slides_on_it() {
    for (boot, side) in [(left_boot(), 1.0), (right_boot(), -1.0)] {
        let keys = keys(side);
        let points: Vec<DVec3> = boot.positions.iter().map(|p| p.cast()).collect();
        let at = |time: f64| {
            let (rotation, at) = keys.at(time);
            points.iter().map(|p| rotation * p + at).collect::<Vec<_>>()
        };
        let steps = 8 * (FRAMES - 1);
        let mut before = at(1.0);
        for step in 1..=steps {
            let now = at(1.0 + f64::from(step) / 8.0);
            for (a, b) in before.iter().zip(&now) {
                assert!(b.y > DEPTH - 0.0015, "digs {:.4} m at step {step}", DEPTH - b.y);
                let touching = a.y < DEPTH + 0.001 && b.y < DEPTH + 0.001;
                let slid = ((b.x - a.x).powi(2) + (b.z - a.z).powi(2)).sqrt();
                assert!(!touching || slid < 0.002, "slides {slid:.4} m at step {step}");
            }
            before = now;
        }
    }
}

#[test]
fn each_boot_rests_for_several_frames_and_the_left_one_is_at_the_walkers_left() {
    for side in [1.0, -1.0] {
        let keys = keys(side);
        let still = |frame: &i32| keys.at(f64::from(*frame)) == keys.at(f64::from(*frame) + 1.0);
        assert!((1..FRAMES).filter(still).count() >= 10);
        // Walking towards +Z with Y up, +X is to the left.
        assert!((1..=FRAMES).all(|frame| keys.at(f64::from(frame)).1.x * side > 0.0));
    }
    let (left, right) = (left_boot(), right_boot());
    assert!(left.volume() > 0.0 && (left.volume() - right.volume()).abs() < 1e-9);
}
