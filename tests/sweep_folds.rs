//! Skins that fold inside out.

#[path = "common/elbow.rs"]
#[allow(dead_code)]
mod elbow;
#[path = "common/shapes.rs"]
#[allow(dead_code)]
mod shapes;

use elbow::Elbow;
use frazil::base::{DVec3, TriMesh, Vec3};
use frazil::motion::Motion;
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Context, Pool, Result};

const CELL: f64 = 0.004;

/// A ball that is pressed flat along x, comes out inside out, twice as thick, and goes back the same way.
struct Mirrored(TriMesh);

impl Motion for Mirrored {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }

    fn vertex_count(&self) -> usize {
        self.0.positions.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let along = 1.0 - 3.0 * (1.0 - (2.0 * time - 1.0).abs());
        let place = |p: &Vec3| DVec3::new(f64::from(p.x) * along, f64::from(p.y), f64::from(p.z));
        out.clear();
        out.extend(self.0.positions.iter().map(place));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        [0.5].into_iter().filter(|&time| time > from && time < to).collect()
    }
}

#[test]
fn what_only_winds_backward_is_not_swept() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [Body::new(Box::new(Mirrored(shapes::sphere(0.05, 6))), 0.0).unwrap()];
    let volume = |to: f64| {
        let grid = sweep::chain(&ctx, &body, 0.0, to, &Settings::new(CELL)).unwrap();
        level_set::measure(&ctx, &grid).unwrap().volume
    };
    let (rest, moved) = (volume(0.0), volume(1.0));
    assert!((moved / rest - 1.0).abs() < 0.01, "{moved}, not {rest}");
}

/// What an elbow sweeps while it bends from one angle to another (radians), in a number of sub-steps.
fn volume(bend: [f64; 2], parts: u32) -> f64 {
    let ctx = Context::new(Pool::new(2).unwrap());
    let body = [Body::new(Box::new(Elbow::new(bend, 0.02)), 0.0).unwrap()];
    let mut all: Option<FloatGrid> = None;
    for part in 0..parts {
        let [from, to] = [part, part + 1].map(|part| f64::from(part) / f64::from(parts));
        let grid = sweep::chain(&ctx, &body, from, to, &Settings::new(CELL)).unwrap();
        match &mut all {
            Some(all) => level_set::union(&ctx, all, grid).unwrap(),
            None => all = Some(grid),
        }
    }
    level_set::measure(&ctx, &all.unwrap()).unwrap().volume
}

#[test]
fn a_fold_sweeps_the_same_in_one_step_as_in_sixteen() {
    for bend in [[0.0, 2.4], [2.4, 0.6], [1.4, 2.5]] {
        let [one, sixteen] = [1, 16].map(|parts| volume(bend, parts));
        assert!((one / sixteen - 1.0).abs() < 0.01, "bend {bend:?}: {one} in one step, {sixteen} in sixteen");
    }
}
