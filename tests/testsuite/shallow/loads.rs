//! What the liquid does to bodies: their weight in it, a dam, a stream, and what they displace.

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Load, Params, Shallow};

use crate::common::flowing::{FRAME, Frames};
use crate::common::shallow::{context, covered, ground};

const CELL: f64 = 0.002;
const DENSITY: f64 = 1060.0;
const G: f64 = 9.81;

/// A basin 8 cm wide, with a pool of some depth (m) on level ground at 0.
fn pool(ctx: &Context, depth: f64, liquid: Liquid) -> Shallow {
    let params = Params { liquid, pace: TimeStepping::Exact, kept: 0.01, ..Params::default() };
    covered(ctx, &ground([40; 2], CELL, [-0.01, 0.09], |_| 0.0), params, |_, _| depth)
}

fn load(liquid: &Shallow, velocity: [f64; 3]) -> Load {
    let mut out = [Load::default()];
    liquid.loads(DENSITY, &[velocity], &mut out).unwrap();
    out[0]
}

/// Volume of a body's pillars up to a height (m).
fn volume(liquid: &Shallow, body: &Shape, level: f64) -> f64 {
    let (grid, heights) = (liquid.columns().grid, liquid.columns().heights);
    let mut units = 0_i64;
    body.each_cell(&grid, &heights, |_, [bottom, top]| {
        units += i64::from(top.min(heights.round(level)) - bottom).max(0);
    });
    units as f64 * heights.unit * grid.cell * grid.cell
}

fn close(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * b.abs()
}

#[test]
fn what_is_under_the_surface_has_the_weight_of_what_it_displaces() {
    let ctx = context();
    for (height, is_under) in [(0.014, true), (0.027, false)] {
        let mut liquid = pool(&ctx, 0.03, Liquid::new(1e-4));
        let axes = [DVec3::new(0.6, 0.0, 0.8), DVec3::y(), DVec3::new(-0.8, 0.0, 0.6)];
        let bodies = [
            Shape::Sphere { centre: DVec3::new(0.0003, height, -0.0004), radius: 0.009 },
            Shape::Capsule {
                ends: [DVec3::new(-0.01, height, 0.0), DVec3::new(0.012, height + 0.003, 0.004)],
                radius: 0.005,
            },
            Shape::Cuboid { centre: DVec3::new(0.0, height, 0.0), axes, half: [0.01, 0.006, 0.007] },
        ];
        for body in bodies {
            liquid.set_bodies(&[body]).unwrap();
            liquid.frames(&ctx, FRAME, 600);
            let level = liquid.view().at([0.03, 0.03, 0.03]).unwrap().height;
            let displaced = volume(&liquid, &body, level);
            let own = load(&liquid, [0.0; 3]);
            let buoyancy = DENSITY * G * displaced;
            // A film is left on what stands out of it.
            let share = if is_under { 2e-3 } else { 3e-2 };
            assert!(close(own.pressure[1], buoyancy, share), "{body:?}: {own:?}, {buoyancy} N");
            assert!(close(own.displaced, displaced, share), "{body:?}: {own:?}, {displaced} m3");
            let beside = own.pressure[0].abs().max(own.pressure[2].abs());
            assert!(beside < 2e-3 * buoyancy, "{body:?}: {own:?}");
            assert!(own.drag.iter().all(|drag| drag.abs() < 1e-4 * buoyancy), "{body:?}: {own:?}");
            assert!(own.wetted > 0.0 && (is_under || own.displaced < 0.95 * volume(&liquid, &body, 1.0)));
        }
    }
}

#[test]
fn a_dam_holds_back_the_deeper_side() {
    let ctx = context();
    let params = Params { liquid: Liquid::new(1e-4), kept: 0.01, ..Params::default() };
    let ground = ground([40; 2], CELL, [-0.01, 0.09], |_| 0.0);
    let mut liquid = covered(&ctx, &ground, params, |[x, _], _| if x < 0.0 { 0.03 } else { 0.01 });
    let axes = [DVec3::x(), DVec3::y(), DVec3::z()];
    let dam = Shape::Cuboid { centre: DVec3::new(0.0, 0.0, 0.0), axes, half: [0.005, 0.05, 0.1] };
    liquid.set_bodies(&[dam]).unwrap();
    liquid.frames(&ctx, FRAME, 600);
    let [left, right] = [-0.02, 0.02].map(|x| liquid.view().at([x, 0.0, 0.0]).unwrap().depth);
    let own = load(&liquid, [0.0; 3]);
    let wanted = 0.5 * DENSITY * G * (left * left - right * right) * 0.08;
    assert!(left > 0.029 && close(own.pressure[0], wanted, 1e-3), "{own:?}, {wanted} N");
    // It stands on the ground: nothing lifts it, but for a film that is left on its top, and it would turn over to the right.
    assert!((-0.01 * wanted..=0.0).contains(&own.pressure[1]) && own.pressure[2].abs() < 1e-9, "{own:?}");
    let arm = |depth: f64| DENSITY * G * 0.08 * depth * depth * depth / 6.0;
    assert!(close(own.torque[2], arm(right) - arm(left), 1e-3), "{own:?}");
}

#[test]
fn a_body_that_moves_is_held_back_by_jet_and_shear() {
    let ctx = context();
    let nu = 1e-4;
    let mut liquid = pool(&ctx, 0.02, Liquid::new(nu));
    let axes = [DVec3::x(), DVec3::y(), DVec3::z()];
    let plate = Shape::Cuboid { centre: DVec3::new(0.0, 0.02, 0.0), axes, half: [0.0015, 0.04, 0.0101] };
    liquid.set_bodies(&[plate]).unwrap();
    liquid.frames(&ctx, FRAME, 600);
    let at_rest = load(&liquid, [0.0; 3]);
    let [still, moving] = [[0.0; 3], [0.3, 0.0, 0.0]].map(|velocity| load(&liquid, velocity));
    assert_eq!(still, at_rest);
    // The plate's cells: two across, ten along; one of its faces is run into, two ends are sheared, and so is neither top nor bottom.
    let depth = liquid.view().at([0.03, 0.0, 0.0]).unwrap().depth;
    let mut cells = 0;
    plate.each_cell(&liquid.columns().grid, &liquid.columns().heights, |_, _| cells += 1);
    let (across, along) = (2, cells / 2);
    let front = 0.5 * DENSITY * 0.3 * 0.3 * along as f64 * CELL * depth;
    let sides = DENSITY * nu * (0.3 / (0.5 * CELL)) * 2.0 * across as f64 * CELL * depth;
    assert!(close(-moving.drag[0], front + sides, 5e-3), "{moving:?}, {front} + {sides} N");
    assert!(moving.drag[1] == 0.0 && moving.drag[2].abs() < 1e-6);
    assert_eq!(moving.pressure, still.pressure);
    // Thicker liquid shears more, and liquid that thins less than its viscosity at rest.
    let thick = Params { liquid: Liquid::new(1e-2), ..liquid.params().clone() };
    liquid.set_params(thick).unwrap();
    assert!(load(&liquid, [0.3, 0.0, 0.0]).drag[0] < moving.drag[0] - 50.0 * sides);
    let thins = Liquid::THINNING_BLOOD;
    let (fast, slow) = (thins.viscosity_at(1e6), thins.viscosity_at(0.0));
    assert!(slow == thins.viscosity && fast > 3.25e-6 && fast < 3.4e-6, "{fast}");
}

#[test]
fn what_is_dry_feels_nothing_and_wrong_numbers_are_a_sentence() {
    let ctx = context();
    let mut liquid = pool(&ctx, 0.01, Liquid::BLOOD);
    let above = Shape::Sphere { centre: DVec3::new(0.0, 0.05, 0.0), radius: 0.01 };
    let outside = Shape::Sphere { centre: DVec3::new(9.0, 0.0, 0.0), radius: 0.01 };
    let all = Shape::Sphere { centre: DVec3::new(0.0, 0.0, 0.0), radius: 1.0 };
    liquid.set_bodies(&[above, outside]).unwrap();
    let mut out = [Load { wetted: 7.0, ..Load::default() }; 2];
    liquid.loads(DENSITY, &[[0.1; 3]; 2], &mut out).unwrap();
    assert_eq!(out, [Load::default(); 2]);
    // A tool that fills the domain: all liquid waits, and nothing touches it.
    liquid.set_bodies(&[all]).unwrap();
    liquid.step(&ctx, FRAME).unwrap();
    assert_eq!(load(&liquid, [0.1; 3]), Load::default());
    assert!(liquid.balance().error == 0 && liquid.balance().held > 0.0);
    let said = |density: f64, velocities: &[[f64; 3]], room: usize| {
        liquid.loads(density, velocities, &mut vec![Load::default(); room]).unwrap_err().to_string()
    };
    assert_eq!(said(f64::NAN, &[[0.0; 3]], 1), "density = NaN kg/m3 is not positive and finite");
    assert_eq!(said(1e3, &[], 1), "0 velocities for 1 bodies: one each is needed");
    assert_eq!(said(1e3, &[[0.0; 3]], 2), "2 loads for 1 bodies: one each is needed");
    assert_eq!(said(1e3, &[[0.0, f64::INFINITY, 0.0]], 1), "the velocity of body 0 is not finite");
}
