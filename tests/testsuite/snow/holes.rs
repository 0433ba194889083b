//! Objects with holes: grains stay out of small ones, and lie in what is wide open.

use super::grains::in_air;
use crate::common::shapes::sphere;
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::grains::{Base, Grains, Object, Params};
use frazil::sweep::Body;
use frazil::{Context, Pool};

/// Radius of a ball without its lower end (m).
const BALL: f32 = 0.1;

/// Height (m) of a grain at -0.05 m after such a ball, open below a height, has come down over it from 0.2 m to 0, without gravity.
fn height_below(end: f32) -> f64 {
    let mut mesh: TriMesh = sphere(BALL, 24);
    mesh.triangles.retain(|triangle| triangle.iter().any(|&corner| mesh.positions[corner as usize].y > end));
    let key = |time, y| Key { time, at: DVec3::new(0.0, y, 0.0), turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(0.0, 0.2), key(1.0, 0.0)]).unwrap();
    let body = Body::new(Box::new(Rigid::new(mesh, keys)), 0.0).unwrap();
    assert_eq!(body.closed_loops(), 1);
    let params = Params { gravity: 0.0, ..Params::for_cell(0.01) };
    let mut grains = Grains::new(params).unwrap();
    grains.emit(&[DVec3::new(0.001, -0.05, 0.002)], &[], 0).unwrap();
    let objects = [Object::new(&body, 0.3)];
    let around = in_air(Base::Missing, &objects);
    let ctx = Context::new(Pool::new(2).unwrap());
    for frame in 1..=24 {
        let times = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
        grains.step(&ctx, &around, times, frame).unwrap();
    }
    grains.positions().next().unwrap().y
}

#[test]
fn a_small_hole_is_closed_and_a_bowl_is_not() {
    let pushed = height_below(-0.095);
    assert!(pushed < -0.09, "{pushed}");
    let within = height_below(-0.02);
    assert!((within + 0.05).abs() < 1.0e-6, "{within}");
}
