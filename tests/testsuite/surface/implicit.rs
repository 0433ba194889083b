//! The particles' own surface: against plain sums, and closed.

use frazil::geometry::DVec3;
use frazil::surface::{Implicit, Isosurface};

use crate::common::liquids::{ball, context, filled, plain_phi, two_clouds};

#[test]
fn the_function_is_the_plain_sum() {
    let ctx = context(2);
    // Two clouds with a gap, where the mean moves fast.
    let spacing = 0.1;
    let positions = two_clouds(spacing);
    let phi = Implicit::new(&ctx, &positions, spacing, 0.5 * spacing).unwrap();
    let mut compared = 0;
    for (index, patch) in phi.patches().iter().enumerate().step_by(3) {
        for node in (0..64).step_by(5) {
            let at = [node >> 4, node >> 2 & 3, node & 3];
            let at = DVec3::from([0, 1, 2].map(|axis| f64::from(4 * patch[axis] + at[axis]))) * phi.cell();
            let value = f64::from(phi.values(index)[node as usize]) * phi.cell();
            let expected = plain_phi(&positions, spacing, at);
            if expected.is_finite() && expected < 2.0 * spacing {
                assert!((value - expected).abs() < 1e-4 * spacing, "{value} is not {expected}");
                compared += 1;
            }
        }
    }
    assert!(compared > 300, "{compared}");
}

#[test]
fn the_surface_lies_half_a_spacing_above_the_outermost_particles() {
    let ctx = context(2);
    let positions = filled(1.0, 0.0, 12.0, |position| position.y < 0.0);
    let phi = Implicit::new(&ctx, &positions, 1.0, 0.5).unwrap();
    let mesh = Isosurface::new(&phi).mesh(&phi);
    let middle = mesh.positions.iter().filter(|p| p.x.abs() < 4.0 && p.z.abs() < 4.0 && p.y > -5.0);
    // The outermost centres are at -0.5.
    middle.for_each(|p| assert!((p.y + 0.5 - 0.48).abs() < 0.02, "{p:?}"));
}

#[test]
fn the_surface_is_closed_and_whole() {
    let ctx = context(2);
    let ball = ball(8.0, 4, 0.0);
    let phi = Implicit::new(&ctx, &ball.positions, ball.spacing, 0.5 * ball.spacing).unwrap();
    let mesh = Isosurface::new(&phi).mesh(&phi);
    assert!(mesh.is_manifold());
    assert_eq!(mesh.euler_characteristic(), 2);
    let radius = (mesh.volume() * 0.75 / std::f64::consts::PI).cbrt() / ball.spacing;
    assert!((radius - 8.0).abs() < 0.2, "{radius}");
    // A cloud with gaps and single drops.
    let scattered = filled(1.0, 0.5, 20.0, |p| libm::sin(p.x) + libm::sin(0.7 * p.y) * libm::sin(p.z) > 0.9);
    let phi = Implicit::new(&ctx, &scattered, 1.0, 0.5).unwrap();
    let mesh = Isosurface::new(&phi).mesh(&phi);
    assert!(mesh.is_manifold() && mesh.volume() > 0.0);
}
