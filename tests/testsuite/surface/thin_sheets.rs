//! Sheets and threads of liquid that are drawn out until they are thinner than their particles are apart: the surface encloses their mass.

use frazil::geometry::DVec3;
use frazil::surface::{Params, Tracker};
use nalgebra::{Rotation3, Unit};

use crate::common::liquids::{Random, context, filled, numbered, own_surface};

const FRAMES: usize = 24;
/// Half of the sheet's width at first (spacings).
const HALF: f64 = 9.0;

#[test]
fn a_mesh_keeps_its_volume_while_its_sheet_thins() {
    let ctx = context(2);
    let first = filled(1.0, 0.1, HALF, |at| at.abs().max() < HALF && at.y.abs() < 2.0);
    // From 4 spacings to a half.
    let at = |frame: usize| {
        let wide = libm::exp2(1.5 * frame as f64 / FRAMES as f64);
        numbered(first.iter().map(|at| DVec3::new(at.x * wide, at.y / (wide * wide), at.z * wide)).collect())
    };
    let own = |frame: usize| own_surface(&ctx, &at(frame).positions, 1.0);
    let mut from = at(0);
    let params = Params { rebuild: true, min_drop: 8, ..Params::for_spacing(1.0) };
    let mut tracker = Tracker::new(&ctx, params, &own(0), &from).expect("a tracker");
    for frame in 1..=FRAMES {
        let to = at(frame);
        tracker.step(&ctx, &from, &to, 1.0 / 24.0).expect("a step");
        from = to;
        let volume = tracker.mesh().volume();
        let [of_surface, of_mass] = [own(frame).volume(), first.len() as f64].map(|own| volume / own);
        assert!((of_surface - 1.0).abs() < 0.08, "frame {frame}: {of_surface}");
        assert!((0.85..1.5).contains(&of_mass), "frame {frame}: {of_mass}");
    }
}

#[test]
fn sheets_and_threads_of_any_thickness_and_direction_have_the_volume_of_their_particles() {
    let ctx = context(2);
    let mut random = Random(5);
    for round in 0..8 {
        let is_thread = round % 2 == 1;
        let half = if is_thread { 40.0 } else { 14.0 };
        let is_inside = |at: DVec3| {
            at.abs().max() < half && if is_thread { at.y.hypot(at.z) < 1.8 } else { at.y.abs() < 2.0 }
        };
        let first = filled(1.0, 0.3, half, is_inside);
        // Sheets to half a spacing, threads to a radius of 0.8.
        let wide = libm::exp2(f64::from(round / 2) * if is_thread { 0.75 } else { 0.5 });
        let axis = Unit::new_normalize(random.vector(1.0));
        let turn = Rotation3::from_axis_angle(&axis, 2.0 * random.next());
        let drawn = |(n, at): (usize, &DVec3)| {
            // Columns and layers are not in step.
            let at = at + DVec3::new(n as f64 * 0.618 % 1.0 - 0.5, 0.0, 0.0);
            let thin = if is_thread { 1.0 / wide.sqrt() } else { 1.0 / (wide * wide) };
            let across = if is_thread { thin } else { wide };
            turn * DVec3::new(at.x * wide, at.y * thin, at.z * across)
        };
        let positions: Vec<DVec3> = first.iter().enumerate().map(drawn).collect();
        let mesh = own_surface(&ctx, &positions, 1.0);
        let volume = mesh.volume() / positions.len() as f64;
        let least = if is_thread { 0.6 } else { 0.85 };
        assert!((least..1.45).contains(&volume), "round {round}: {volume}");
        assert_eq!(mesh.euler_characteristic(), 2, "round {round}: a hole, or pieces");
    }
}
