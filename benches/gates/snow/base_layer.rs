//! Gates of the snow: what is left, what is removed, and that nothing grows.

use frazil::geometry::DVec3;
use frazil::snow::base_layer::Params;
use frazil::vdb::{FloatGrid, level_set};

use crate::harness::Harness;
use crate::scenes::{self, WALK_CELL, context};
use crate::sweep::oracle::{MovingBox, capsule};
use crate::sweep::walls::{each_voxel, moving_body};

const CELL: f64 = 0.005;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure_all(["snow.base.exact_base", "snow.base.exact_removed"], exact);
    h.measure("snow.base.left", left);
    volume(h);
    h.measure("snow.base.islands", islands);
}

/// Snow and removed snow against max(phi, -s) and max(phi, s) of exact distances: a ball that turns, half sunk.
fn exact() -> [(f64, &'static str); 2] {
    let ctx = context(2);
    let at = [DVec3::new(-0.2, 0.3, 0.0), DVec3::new(0.2, 0.3, 0.0)];
    let turn = [DVec3::zeros(), DVec3::new(0.1, 0.2, 0.2)];
    let body = scenes::body(crate::common::shapes::sphere(0.1, 64), at, turn, 1.0);
    let mut base = scenes::snow(&ctx, 1.2, CELL, scenes::EXACT);
    base.step(&ctx, &[body], 0.0, 1.0, 1).expect("step");
    let worst = |grid: &FloatGrid, truth: &dyn Fn(f64, f64) -> f64| {
        let mut worst: f64 = 0.0;
        each_voxel(grid, |p, ours| {
            let truth = truth(p.y - 0.3, capsule(p, at[0], at[1], 0.1)) / CELL;
            let inner = p.y > 0.05 && p.x.abs() < 0.5 && p.z.abs() < 0.5;
            if inner && (truth.abs() < 2.9 || ours.abs() < 2.9) {
                worst = worst.max((ours - truth.clamp(-3.0, 3.0)).abs());
            }
        });
        worst
    };
    let snow = worst(base.surface(), &|phi, s| phi.max(-s));
    let removed = worst(base.removed(), &|phi, s| phi.max(s));
    [(snow, ""), (removed, "")]
}

/// Snow left deeper than half a cell inside the poses of a box that moves and turns.
fn left() -> (f64, &'static str) {
    let ctx = context(2);
    let start = DVec3::new(0.7, 1.9, 3.1);
    let motion = MovingBox {
        half: DVec3::repeat(0.1),
        at: [DVec3::new(-0.2, 0.3, 0.0), DVec3::new(0.2, 0.3, 0.0)],
        turn: [start, start + DVec3::new(0.0, 0.0, 0.3)],
    };
    let mut base = scenes::snow(&ctx, 1.2, CELL, scenes::EXACT);
    base.step(&ctx, &[moving_body(&motion)], 0.0, 1.0, 1).expect("step");
    let poses = motion.poses(1024);
    let mut left = 0u64;
    // Every voxel around the motion, tiles included.
    for x in -80..=80 {
        for y in 10..=60 {
            for z in -40..=40 {
                if base.surface().value([x, y, z]) < 0.0 {
                    let p = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * CELL;
                    left += u64::from(motion.distance(&poses, p) < -0.5 * CELL);
                }
            }
        }
    }
    (left as f64, "")
}

fn mesh_volume(ctx: &frazil::Context, grid: &FloatGrid) -> f64 {
    level_set::to_mesh(ctx, grid, 0.0, 0.0).expect("mesh").volume()
}

/// Snow before = snow after + removed, along the demonstration's walk; and whether it ever grows.
fn volume(h: &mut Harness) {
    if !h.wants("snow.base.volume") && !h.wants("snow.base.monotone") {
        return;
    }
    let ctx = context(2);
    let mut base = scenes::snow(&ctx, 7.2, WALK_CELL, scenes::EXACT);
    let bodies = scenes::walkers();
    let (mut worst, mut worst_reported, mut total, mut reported) = (0.0f64, 0.0f64, 0.0, 0.0);
    let (mut grown, mut before) = (0u64, mesh_volume(&ctx, base.surface()));
    let first = before;
    for frame in 1..=48 {
        let old = base.surface().deep_copy().expect("copy");
        let from = f64::from(if frame == 1 { 1 } else { frame - 1 });
        let report = base.step(&ctx, &bodies, from, f64::from(frame), frame).expect("step");
        grown += growth(&old, base.surface());
        let (after, removed) = (mesh_volume(&ctx, base.surface()), mesh_volume(&ctx, base.removed()));
        if removed > 1000.0 * WALK_CELL.powi(3) {
            worst = worst.max(((before - after) / removed - 1.0).abs() * 100.0);
            worst_reported =
                worst_reported.max(((before - after) / report.removed_volume - 1.0).abs() * 100.0);
        }
        total += removed;
        reported += report.removed_volume;
        before = after;
    }
    let walk = ((first - before) / total - 1.0).abs() * 100.0;
    h.gate("snow.base.volume_frame", worst, "worst frame");
    h.gate("snow.base.volume_walk", walk, "");
    let walk = ((first - before) / reported - 1.0).abs() * 100.0;
    let note = "against the report, which has shells thinner than a cell";
    h.gate("snow.base.volume_told_frame", worst_reported, note);
    h.gate("snow.base.volume_told_walk", walk, note);
    h.gate("snow.base.monotone_grown", grown as f64, "");
}

/// Voxels where the snow is thicker than it was.
fn growth(old: &FloatGrid, new: &FloatGrid) -> u64 {
    let leaves = new.leaves().expect("leaves");
    leaves
        .iter()
        .map(|leaf| {
            let shrinks = |index: usize| {
                let at = [index >> 6, index >> 3 & 7, index & 7];
                let voxel = [0, 1, 2].map(|axis| leaf.origin[axis] + at[axis] as i32);
                leaf.values[index] >= old.value(voxel)
            };
            (0..512).filter(|&index| !shrinks(index)).count() as u64
        })
        .sum()
}

/// Islands that the noise makes: parts of the snow with it, less parts without it.
fn islands() -> (f64, &'static str) {
    let ctx = context(2);
    let bodies = scenes::walkers();
    let parts = |params: Params| {
        let mut base = scenes::snow(&ctx, 7.2, WALK_CELL, params);
        let mut parts = 0;
        for frame in 1..=48 {
            let from = f64::from((frame - 1).max(1));
            base.step(&ctx, &bodies, from, f64::from(frame), frame).expect("step");
            if frame % 12 == 0 {
                parts += level_set::components(&ctx, base.surface()).expect("components").len() as i64;
            }
        }
        parts
    };
    let made = (parts(Params::for_cell(WALK_CELL)) - parts(scenes::EXACT)).max(0);
    (made as f64, "at frames 12, 24, 36, 48")
}
