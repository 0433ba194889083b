//! Single grains on slopes: they rest below an angle and slide above it.

use frazil::base::DVec3;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::heap::{Colliders, Division, Floor, Heap};
use frazil::snow::grains::{Base, Grains, Params, Surroundings};
use frazil::vdb::level_set::from_mesh;
use frazil::{Context, Pool};

use crate::common::shapes::cuboid;

const CELL: f64 = 0.01;

fn context() -> Context {
    Context::new(Pool::new(1).unwrap())
}

/// A grain on a plane that leans, as gravity that leans.
#[test]
fn a_grain_slides_where_the_slope_is_steeper_than_its_friction() {
    let ctx = context();
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
        heap.places().next().unwrap().x
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
    let ctx = context();
    let slid = |degrees: f64, attraction: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let mut slab = cuboid([1.2, 0.2, 0.2]);
        for place in &mut slab.positions {
            let [x, y] = [place.x, place.y - 0.1].map(f64::from);
            (place.x, place.y) = ((x * cosine - y * sine) as f32, (x * sine + y * cosine) as f32);
        }
        let base = ctx.phase("base", || from_mesh(&ctx, &slab, CELL, 3.0)).unwrap();
        let friction = of_repose(REPOSE, attraction > 0.0);
        let mut grains =
            Grains::new(Params { friction, attraction, air: 1.0, ..Params::for_cell(CELL) }).unwrap();
        let above = grains.params().radius * 1.001;
        grains.emit(&[DVec3::new(-sine * above, cosine * above, 0.0)], &[], 0).unwrap();
        let around = Surroundings {
            base: Base::Whole([&base; 2]),
            objects: &[],
            statics: &[],
            ground: &[],
            floor: None,
            lowest: -1.0,
        };
        for frame in 1..=12 {
            let times = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
            grains.step(&ctx, &around, times, frame).unwrap();
        }
        let place = grains.places().next().unwrap();
        -place.x * cosine - place.y * sine
    };
    for attraction in [0.0, 0.01] {
        let [below, above] = [slid(REPOSE - 3.0, attraction), slid(REPOSE + 3.0, attraction)];
        assert!(below.abs() < 1.0e-3, "attraction {attraction}: slid by {below} m");
        assert!(above > 0.02, "attraction {attraction}: slid by {above} m");
    }
}
