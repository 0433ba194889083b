//! The liquids of known motion that gates use: their motion is what it says it is.

use frazil::geometry::DVec3;

use crate::common::made_sets::{Set, Vortex, sets};

/// The volume that a small cube around a position takes after a motion, over what it took before.
fn swelling(at: DVec3, size: f64, motion: impl Fn(DVec3) -> DVec3) -> f64 {
    let column = |axis: usize| {
        let mut by = DVec3::zeros();
        by[axis] = size;
        (motion(at + by) - motion(at - by)) / (2.0 * size)
    };
    column(0).cross(&column(1)).dot(&column(2))
}

fn after(position: DVec3, times: [f64; 2], steps: u32) -> DVec3 {
    let mut positions = [position];
    Vortex::carry(&mut positions, times, steps);
    positions[0]
}

#[test]
fn the_vortex_keeps_volumes_and_takes_every_particle_back() {
    let vortex = Vortex::new(300, 4);
    assert!((270..330).contains(&vortex.positions.len()), "{}", vortex.positions.len());
    let half = 0.5 * Vortex::PERIOD;
    let mut farthest = 0.0f64;
    for &position in &vortex.positions {
        let there = after(position, [0.0, half], 144);
        assert!((there - after(position, [0.0, half], 288)).norm() < 2e-6);
        assert!((after(there, [half, Vortex::PERIOD], 144) - position).norm() < 1e-6);
        farthest = farthest.max((there - position).norm());
    }
    // Otherwise a flow that does nothing would pass.
    assert!(farthest > 0.3, "{farthest}");
    for position in vortex.positions.iter().step_by(30) {
        let swelling = swelling(*position, 1e-5, |position| after(position, [0.0, half], 144));
        assert!((swelling - 1.0).abs() < 1e-3, "{swelling}");
    }
}

#[test]
fn the_vortex_has_the_velocity_that_leveque_gives() {
    // At a quarter of each edge sin^2(pi x) = 1/2 and sin(2 pi x) = 1.
    let quarter = DVec3::repeat(0.25);
    assert!((Vortex::velocity(quarter, 0.0) - DVec3::new(1.0, -0.5, -0.5)).norm() < 1e-12);
    assert!(Vortex::velocity(quarter, 0.5 * Vortex::PERIOD).norm() < 1e-12);
    assert!(Vortex::velocity(DVec3::new(0.0, 0.3, 0.4), 1.0).norm() < 1e-12);
}

#[test]
fn made_sets_begin_where_their_particles_are() {
    for set in sets() {
        assert!(set.positions.len() > 500, "{}: {} particles", set.name, set.positions.len());
        let off = set.positions.iter().map(|position| ((set.motion)(*position, 0.0) - position).norm());
        assert!(off.fold(0.0, f64::max) < 1e-12, "{}", set.name);
    }
}

#[test]
fn the_sheet_and_the_bubble_keep_volumes_and_the_bubble_closes() {
    let [balls, _, sheet, bubble] = sets();
    for set in [&sheet, &bubble] {
        for position in set.positions.iter().step_by(97) {
            let swelling = swelling(*position, 1e-4, |position| (set.motion)(position, 10.0));
            assert!((swelling - 1.0).abs() < 1e-6, "{}: {swelling}", set.name);
        }
    }
    let least = |set: &Set, frame: f64| {
        set.positions.iter().map(|position| (set.motion)(*position, frame).norm()).fold(f64::MAX, f64::min)
    };
    assert!(least(&bubble, 0.0) > 5.0 && least(&bubble, 45.0) < 1.0);
    let gap = |frame: f64| {
        let right =
            balls.positions.iter().map(|position| (balls.motion)(*position, frame)).filter(|p| p.x > 0.0);
        2.0 * right.map(|position| position.x).fold(f64::MAX, f64::min)
    };
    assert!(gap(0.0) > 3.0 && gap(15.0) < 1.0, "{} {}", gap(0.0), gap(15.0));
}
