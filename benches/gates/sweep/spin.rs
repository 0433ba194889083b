//! Gates of fast turns: a bar and a box against dense poses, and what a spinning sphere costs.

use std::time::Instant;

use frazil::geometry::DVec3;
use frazil::motion::Motion;
use frazil::numeric::cpu;
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};
use rayon::prelude::*;

use crate::common::folded::{Elbow, Mirrored};
use crate::common::shapes::globe;
use crate::harness::{Harness, median};
use crate::scenes::{self, context};
use crate::sweep::dense_union::Dense;
use crate::sweep::oracle::MovingBox;
use crate::sweep::walls::{each_voxel, moving_body};

const DEGREES: [f64; 9] = [30.0, 90.0, 180.0, 270.0, 350.0, 360.0, 370.0, 719.0, 1440.0];
const CELLS: [f64; 2] = [0.005, 0.02];
/// Poses of one turn.
const POSES: f64 = 4096.0;
/// Poses of a skin.
const FOLDED_POSES: usize = 193;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure_all(["reliability.spin_missed", "reliability.spin_fat"], spin);
    let names = ["missed", "fat", "steps"].map(|name| format!("reliability.spin_folds_{name}"));
    h.measure_all(names, folds);
    for degrees in [45.0, 90.0, 360.0] {
        h.measure(&format!("reliability.spin_cost_{degrees}"), || {
            let level = cpu::cpu_level();
            let note = format!("threads=2 cpu={level:?} globe of 48 x 24, r = 0.2 m, cells of 5 mm");
            (cost(degrees), note)
        });
    }
}

/// A bar and a box that turn about y, against the poses of what they turn by, of one turn at most.
fn spin() -> [(f64, String); 2] {
    let ctx = context(2);
    let (mut missed, mut fat, mut voxels) = (0, 0, 0);
    for half in [DVec3::new(0.25, 0.04, 0.03), DVec3::repeat(0.1)] {
        for (degrees, cell) in DEGREES.into_iter().flat_map(|degrees| CELLS.map(|cell| (degrees, cell))) {
            let motion = |degrees: f64| MovingBox {
                half,
                // Off the voxels.
                at: [DVec3::new(0.0013, 0.0007, -0.0009); 2],
                turn: [DVec3::zeros(), DVec3::y() * degrees.to_radians()],
            };
            let body = [moving_body(&motion(degrees))];
            let swept = sweep::chain(&ctx, &body, 0.0, 1.0, &Settings::new(cell)).expect("a sweep");
            let turn = degrees.min(360.0);
            let reference = motion(turn);
            let poses = reference.poses((turn / 360.0 * POSES) as usize + 2);
            let mut all = Vec::new();
            each_voxel(&swept, |p, ours| all.push((p, ours)));
            let within = |p: DVec3, limit: f64| {
                poses.iter().any(|pose| reference.distance(std::slice::from_ref(pose), p) < limit * cell)
            };
            let wrong = |&(p, ours): &(DVec3, f64)| match ours > 0.0 {
                true => [u64::from(within(p, -0.5)), 0],
                false => [0, u64::from(!within(p, 0.5))],
            };
            let sum = |a: [u64; 2], b: [u64; 2]| [a[0] + b[0], a[1] + b[1]];
            let count = || Ok(all.par_iter().map(wrong).reduce(|| [0, 0], sum));
            let [less, more] = ctx.phase("oracle", count).expect("no cancel");
            (missed, fat, voxels) = (missed + less, fat + more, voxels + all.len());
        }
    }
    let note = format!("{voxels} voxels; a bar and a box by 30 to 1440 degrees, cells of 5 and 20 mm");
    [(missed as f64, note.clone()), (fat as f64, note)]
}

/// Skins that fold inside out: against where a pose winds around, and in sub-steps.
fn folds() -> [(f64, String); 3] {
    const CELL: f64 = 0.004;
    const HALF: f64 = 0.5 * CELL;
    let ctx = context(2);
    let (mut missed, mut fat, mut inside, mut apart) = (0, 0, 0, 0.0f64);
    let bends = [[0.0, 2.4], [2.4, 0.6], [1.4, 2.5]];
    for number in 0..=bends.len() {
        let skin = || -> Box<dyn Motion> {
            match bends.get(number) {
                Some(bend) => Box::new(Elbow::new(*bend)),
                None => Box::new(Mirrored::new()),
            }
        };
        let body = || [Body::new(skin(), 0.0).expect("a body")];
        let sweep = |from: f64, to: f64| {
            sweep::chain(&ctx, &body(), from, to, &Settings::new(CELL)).expect("a sweep")
        };
        let swept = sweep(0.0, 1.0);
        let dense = Dense::posed(&*skin(), FOLDED_POSES);
        let mut all = Vec::new();
        each_voxel(&swept, |p, ours| all.push((p, ours)));
        let wrong = |&(p, ours): &(DVec3, f64)| match ours > 0.0 {
            true => [u64::from(ours < 2.9 && dense.is_deep(p, HALF)), 0, 0],
            false => [0, u64::from(dense.is_far(p, HALF)), 1],
        };
        let sum = |a: [u64; 3], b: [u64; 3]| [0, 1, 2].map(|i| a[i] + b[i]);
        let count = || Ok(all.par_iter().map(wrong).reduce(|| [0; 3], sum));
        let [less, more, own] = ctx.phase("oracle", count).expect("no cancel");
        (missed, fat, inside) = (missed + less, fat + more, inside + own);
        let volume = |grid: &FloatGrid| level_set::measure(&ctx, grid).expect("a volume").volume;
        let mut parts = sweep(0.0, 1.0 / 16.0);
        for part in 1..16 {
            let next = sweep(f64::from(part) / 16.0, f64::from(part + 1) / 16.0);
            level_set::union(&ctx, &mut parts, next).expect("a union");
        }
        apart = apart.max((volume(&swept) / volume(&parts) - 1.0).abs());
    }
    let note = format!(
        "{inside} voxels inside the bands; three bends of a tube, and a ball turned inside out and back"
    );
    let share = fat as f64 / inside as f64 * 100.0;
    let of_steps = "volume in one step against sixteen".into();
    [(missed as f64, note.clone()), (share, note), (apart * 100.0, of_steps)]
}

/// Seconds that a sphere takes to turn about its axis.
fn cost(degrees: f64) -> f64 {
    let ctx = context(2);
    let turn = [DVec3::zeros(), DVec3::y() * degrees.to_radians()];
    let body = [scenes::body(globe(0.2, 48, 24), [DVec3::zeros(); 2], turn, 1.0)];
    let once = || {
        let start = Instant::now();
        drop(sweep::chain(&ctx, &body, 0.0, 1.0, &Settings::new(0.005)).expect("a sweep"));
        start.elapsed().as_secs_f64()
    };
    median((0..if degrees > 100.0 { 1 } else { 3 }).map(|_| once()).collect())
}
