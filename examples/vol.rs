//! Scratch.
#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../benches/gates/scenes.rs"]
mod scenes;
use common::boot::{left_boot, right_boot, walk};
use frazil::base::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::Params;
use frazil::sweep::Body;
use frazil::vdb::level_set;
use scenes::context;
fn main() {
    let ctx = context(2);
    let body = |mesh, side: f64| {
        let keys = walk(side, 48, 0.08).into_iter().map(|step| Key {
            time: f64::from(step.frame),
            at: DVec3::from(step.at) - DVec3::z() * 1.5,
            turn: DVec3::from(step.turn_deg.map(f64::to_radians)),
        });
        Body::new(Box::new(Rigid::new(mesh, Keys::new(keys.collect()).unwrap())), 1.0).unwrap()
    };
    let bodies = vec![body(left_boot(), -1.0), body(right_boot(), 1.0)];
    let mut base = scenes::snow(&ctx, 7.2, 0.0075, Params { noise: None, tolerance: 0.02 });
    let vol = |g: &frazil::vdb::FloatGrid| level_set::to_mesh(&ctx, g, 0.0, 0.0).unwrap().volume();
    let mut before = vol(base.surface());
    let v = 0.0075f64.powi(3);
    for f in 1..=48 {
        let from = f64::from(if f == 1 { 1 } else { f - 1 });
        let r = base.step(&ctx, &bodies, from, f64::from(f), f).unwrap();
        let (after, removed) = (vol(base.surface()), vol(base.removed()));
        println!(
            "{f} lost {:.0} removed {:.0} report {:.0} voxels; err {:.2}% report err {:.2}%",
            (before - after) / v,
            removed / v,
            r.removed_volume / v,
            ((before - after) / removed - 1.0) * 100.0,
            ((before - after) / r.removed_volume - 1.0) * 100.0
        );
        before = after;
    }
}
