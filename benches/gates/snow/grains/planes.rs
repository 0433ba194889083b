//! Gates of a grain on a plane that leans: it rests below the angle of friction and slides above it.

use frazil::geometry::DVec3;

use crate::snow::grains::{Experiment, FRAME, still};

/// Diameter of a grain (m).
const D: f64 = 0.005;
/// Frames of an experiment.
const FRAMES: usize = 24;
/// How far the planes lean from the angle of friction (degrees).
const OFF: f64 = 3.0;

pub fn measure() -> [(f64, &'static str); 2] {
    let (mut all_rest, mut all_slide) = (true, true);
    for friction in [0.1, 0.2, 0.3, 0.5] {
        let angle = f64::atan(friction).to_degrees();
        let (way, is_still) = slide(friction, angle - OFF);
        let (far, is_caught) = slide(friction, angle + OFF);
        // From rest under a constant force.
        let (sine, cosine) = (angle + OFF).to_radians().sin_cos();
        let time = FRAMES as f64 * FRAME;
        let expected = 0.5 * 9.81 * (sine - friction * cosine) * time * time;
        println!("# friction {friction}: {:.6} m below, {far:.4} m above, formula {expected:.4} m", way);
        all_rest &= way.abs() < 0.01 * D && is_still;
        all_slide &= (far / expected - 1.0).abs() < 0.1 && !is_caught;
    }
    [
        (f64::from(all_rest), "moved by less than 0.01 diameters in a second, and rests"),
        (f64::from(all_slide), "within 10 % of the formula"),
    ]
}

/// How far (m) a grain slides down a plane that leans by so many degrees, and whether it rests in the end.
fn slide(friction: f64, degrees: f64) -> (f64, bool) {
    let mut one = Experiment::new(1, D, friction, 1);
    (one.colliders.floor, one.params.air) = (None, 1.0);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let (down, normal) = (DVec3::new(cosine, -sine, 0.0), DVec3::new(sine, cosine, 0.0));
    let corner = |along: f64, across: f64| down * along + DVec3::z() * across;
    let positions = vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(9.0, 1.0), corner(9.0, -1.0)];
    one.colliders.shells = vec![still(friction as f32, vec![[0, 1, 2], [0, 2, 3]], positions)];
    one.heap.add(0, normal * (0.5 * D), [0.0; 3]).expect("add");
    one.steps(FRAMES);
    (one.heap.positions().next().expect("one").dot(&down), one.heap.resting() == 1)
}
