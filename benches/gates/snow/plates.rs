//! Gate of the volume that flat-sided bodies remove, against what they cut out of the snow.

use frazil::geometry::DVec3;

use crate::common::shapes::cuboid;
use crate::scenes::{EXACT, body, context, layer};
use crate::snow::mist::frame_rate::numbers;

/// Edge of a cell, and depth of the snow (m): those of a scene of a few boots.
const CELL: f64 = 0.01;
const DEPTH: f64 = 0.15;

pub fn measure() -> (f64, String) {
    let ctx = context(2);
    let mut next = numbers(3);
    let (mut worst, mut which, mut sum) = (0.0f64, String::new(), 0.0);
    for plate in 0..100 {
        let size = [(3.0 + 5.0 * next()) * CELL, 0.4, (20.0 + 20.0 * next()) * CELL];
        let (is_turned, is_down) = (plate % 2 == 1, plate % 4 < 2);
        let turn = if is_turned { DVec3::y() * (std::f64::consts::PI * next()) } else { DVec3::zeros() };
        let height = CELL * next();
        let sole = height + if is_down { 0.0 } else { (2.0 + 5.0 * next()) * CELL };
        let at = DVec3::new(CELL * next(), sole + 0.2, CELL * next());
        let mut base = layer(&ctx, height, [-0.35, -0.35, 0.35, 0.35], DEPTH, CELL, EXACT);
        let body = body(cuboid(size.map(|x| x as f32)), [at; 2], [turn; 2], 1.0);
        let report = base.step(&ctx, &[body], 0.0, 1.0, 1).expect("a step");
        let exact = size[0] * size[2] * (height + DEPTH - sole);
        let off = 100.0 * (report.removed_volume / exact - 1.0);
        sum += off;
        if off.abs() > worst {
            worst = off.abs();
            let [turned, down] =
                [(is_turned, "turned"), (is_down, "on the ground")].map(|(is, word)| match is {
                    true => word,
                    false => "-",
                });
            which = format!("{off:+.2} % of plate {plate} of {:.1} cells ({turned}, {down})", size[0] / CELL);
        }
    }
    (worst, format!("{which}; mean {:+.2} %", sum / 100.0))
}
