//! Single grains on slopes: they rest below an angle and slide above it.

use super::grains::in_air;
use frazil::geometry::DVec3;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::heap::{Colliders, Division, Floor, Heap};
use frazil::snow::grains::{Base, Grains, Params};
use frazil::vdb::level_set::from_mesh;

use crate::common::liquids::context;
use crate::common::shapes::cuboid;

const CELL: f64 = 0.01;

/// A grain on a plane that leans, as gravity that leans.
#[test]
fn a_grain_slides_where_the_slope_is_steeper_than_its_friction() {
    let ctx = context(1);
    let moved = |degrees: f64| {
        let params = Params { friction: 0.3, air: 1.0, ..Params::for_cell(CELL) };
        let mut heap = Heap::new(2.0 * params.radius);
        heap.add(0, DVec3::new(0.0, params.radius, 0.0), [0.0; 3]).unwrap();
        let division = Division { dt: 1.0 / 24.0, sub_steps: params.sub_steps(1.0 / 24.0, 0.0) };
        let mut coefficients = params.coefficients(&division);
        let (sine, cosine) = degrees.to_radians().sin_cos();
        coefficients.gravity = [(9.81 * sine) as f32, (-9.81 * cosine) as f32, 0.0];
        let floor = Some(Floor { height: 0.0, friction: 0.3 });
        let mut colliders = Colliders { floor, ..Colliders::default() };
        for _ in 0..24 {
            ctx.phase("move", || heap.step(&ctx, division, coefficients, &mut colliders)).unwrap();
        }
        heap.positions().next().unwrap().x
    };
    let angle = 0.3f64.atan().to_degrees();
    assert!(moved(angle - 3.0).abs() < 1e-4, "{}", moved(angle - 3.0));
    let expected = 0.5 * 9.81 * ((angle + 3.0).to_radians().sin() - 0.3 * (angle + 3.0).to_radians().cos());
    assert!((moved(angle + 3.0) / expected - 1.0).abs() < 0.1, "{} {expected}", moved(angle + 3.0));
}

/// A grain on a base layer that leans: the layer is snow too, and holds grains up to their angle of repose, whatever friction
/// that takes between them.
#[test]
fn a_grain_lies_on_a_base_up_to_its_angle_of_repose() {
    const REPOSE: f64 = 30.0;
    let ctx = context(1);
    let slid = |degrees: f64, attraction: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let mut slab = cuboid([1.2, 0.2, 0.2]);
        for position in &mut slab.positions {
            let [x, y] = [position.x, position.y - 0.1].map(f64::from);
            (position.x, position.y) = ((x * cosine - y * sine) as f32, (x * sine + y * cosine) as f32);
        }
        let base = ctx.phase("base", || from_mesh(&ctx, &slab, CELL, 3.0)).unwrap();
        let friction = of_repose(REPOSE, attraction > 0.0);
        let mut grains =
            Grains::new(Params { friction, attraction, air: 1.0, ..Params::for_cell(CELL) }).unwrap();
        let above = grains.params().radius * 1.001;
        grains.emit(&[DVec3::new(-sine * above, cosine * above, 0.0)], &[], 0).unwrap();
        let around = in_air(Base::Whole([&base; 2]), &[]);
        for frame in 1..=12 {
            let times = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
            grains.step(&ctx, &around, times, frame).unwrap();
        }
        let position = grains.positions().next().unwrap();
        -position.x * cosine - position.y * sine
    };
    for attraction in [0.0, 0.01] {
        let [below, above] = [slid(REPOSE - 3.0, attraction), slid(REPOSE + 3.0, attraction)];
        assert!(below.abs() < 1.0e-3, "attraction {attraction}: slid by {below} m");
        assert!(above > 0.02, "attraction {attraction}: slid by {above} m");
    }
}

/// Lets a heap move for some frames on a floor that leans by so many degrees toward greater x.
fn step_on_floor(heap: &mut Heap, params: &Params, floor: f32, degrees: f64, frames: usize) {
    let ctx = context(1);
    let division = Division { dt: 1.0 / 24.0, sub_steps: params.sub_steps(1.0 / 24.0, 0.0) };
    let mut coefficients = params.coefficients(&division);
    let (sine, cosine) = degrees.to_radians().sin_cos();
    coefficients.gravity = [(9.81 * sine) as f32, (-9.81 * cosine) as f32, 0.0];
    coefficients.up = [-sine as f32, cosine as f32, 0.0];
    let floor = Some(Floor { height: 0.0, friction: floor });
    let mut colliders = Colliders { floor, ..Colliders::default() };
    for _ in 0..frames {
        ctx.phase("move", || heap.step(&ctx, division, coefficients, &mut colliders)).unwrap();
    }
}

/// A grain that was thrown down a slope on which it could lie slows down as over other grains, and stops.
#[test]
fn a_grain_that_slides_is_slowed_by_the_friction_between_grains() {
    const FRICTION: f64 = 0.15;
    let params = Params { radius: 0.0025, friction: FRICTION, air: 1.0, ..Params::for_cell(CELL) };
    let hold = 30.0f64.to_radians().tan() as f32;
    for degrees in [0.0, 10.0, 20.0] {
        let way = |speed: f32| {
            let mut heap = Heap::new(2.0 * params.radius);
            heap.add(0, DVec3::new(0.0, params.radius, 0.0), [speed, 0.0, 0.0]).unwrap();
            step_on_floor(&mut heap, &params, hold, degrees, 36);
            assert_eq!(heap.resting(), 1, "{speed} m/s on {degrees} degrees");
            heap.positions().next().unwrap().x
        };
        let slows = FRICTION * 9.81 * degrees.to_radians().cos();
        let (lies, slid, expected) = (way(0.0), way(1.0), 0.5 / slows);
        assert!(lies.abs() < 1.0e-4, "slid by {lies} m from rest on {degrees} degrees");
        assert!(
            (slid / expected - 1.0).abs() < 0.05,
            "{slid} m on {degrees} degrees, by the formula {expected} m"
        );
    }
}

/// In experiments a column that collapses runs as far on rough ground as on smooth (Lube et al. 2004).
#[test]
fn columns_run_as_far_on_rough_ground_as_on_smooth() {
    const ACROSS: i32 = 6;
    let params = Params { radius: 0.0025, ..Params::for_cell(CELL) };
    let runs = |floor: f32| {
        let (mut heap, mut random) = (Heap::new(2.0 * params.radius), 1u32);
        let mut off = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1u32 << 24) - 0.5
        };
        for layer in 0..12 {
            for (x, z) in (-ACROSS..=ACROSS).flat_map(|x| (-ACROSS..=ACROSS).map(move |z| (x, z))) {
                if x * x + z * z <= ACROSS * ACROSS {
                    let site = DVec3::new(f64::from(x), f64::from(layer) + 0.5, f64::from(z)) * 1.1;
                    let position = site + DVec3::new(off(), off(), off()) * 0.1;
                    heap.add(heap.count() as u32, position * (2.0 * params.radius), [0.0; 3]).unwrap();
                }
            }
        }
        step_on_floor(&mut heap, &params, floor, 0.0, 24);
        let mut distances: Vec<f64> = heap.positions().map(|position| position.xz().norm()).collect();
        distances.sort_by(f64::total_cmp);
        distances[distances.len() * 98 / 100] / (2.2 * params.radius * f64::from(ACROSS)) - 1.0
    };
    let [smooth, rough, rougher] = [0.2, 0.6, 1.0].map(runs);
    println!("{smooth} {rough} {rougher}");
    assert!(
        rough > 0.85 * smooth && rougher > 0.85 * smooth,
        "{smooth} radii, on rough ground {rough} and {rougher}"
    );
}
