//! Every promise with a number: `make gates [ONLY=prefix,...]`.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "gates/harness.rs"]
mod harness;
#[path = "gates/oracle.rs"]
mod oracle;
#[path = "gates/scenes.rs"]
mod scenes;

use common::shapes::cuboid;
use frazil::base::DVec3;
use frazil::base::blocks::offset;
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::{self, Body, SamplesSettings, Settings};
use frazil::vdb::file::{WriteOptions, to_bytes};
use frazil::vdb::{FloatGrid, level_set};
use harness::{Bound, Harness, median, timed};
use oracle::{MovingBox, away_from_creases};
use scenes::{FRAMES, context};

const EXACT: Params = Params { noise: None, tolerance: 0.02 };
const CELL: f64 = 0.005;

fn main() {
    let mut h = Harness::from_arguments();
    wall(&mut h);
    cube(&mut h);
    volume(&mut h);
    times(&mut h);
    bytes(&mut h);
    readers(&mut h);
    h.finish();
}

fn moving_body(motion: &MovingBox) -> Body {
    let size = (motion.half * 2.0).map(|value| value as f32);
    scenes::body(cuboid(size.into()), motion.at, motion.turn, 1.0)
}

/// The walls that a box leaves, against the envelope of 1,024 poses.
fn wall(h: &mut Harness) {
    if !h.wants("snow.base.wall") {
        return;
    }
    let ctx = context(2);
    for (name, spin) in [("translation", 0.0), ("turn", 0.3)] {
        let (mut most, mut sum, mut count) = (0.0f64, 0.0, 0usize);
        for seed in 1..=3 {
            let start = DVec3::new(0.7, 1.9, 3.1) * f64::from(seed);
            let axis = DVec3::new(0.0, 0.0, spin);
            let motion = MovingBox {
                half: DVec3::repeat(0.1),
                at: [DVec3::new(-0.2, 0.3, 0.0), DVec3::new(0.2, 0.3, 0.0)],
                turn: [start, start + axis],
            };
            let mut base = scenes::snow(&ctx, 1.2, CELL, EXACT);
            base.step(&ctx, &[moving_body(&motion)], 0.0, 1.0, 1).expect("step");
            let mesh = level_set::to_mesh(&ctx, base.surface(), 0.0, 0.0).expect("mesh");
            let poses = motion.poses(1024);
            let below = |p: DVec3| p.y < 0.3 - 3.0 * CELL && p.y > 0.02 && p.x.abs() < 0.5 && p.z.abs() < 0.5;
            for p in away_from_creases(&mesh, below, 3.0 * CELL).into_iter().filter(|p| below(*p)) {
                let error = motion.distance(&poses, p).abs() / CELL;
                (most, sum, count) = (most.max(error), sum + error, count + 1);
            }
        }
        let note = format!("vertices={count}");
        let (max, mean) = (format!("snow.base.wall_{name}_max"), format!("snow.base.wall_{name}_mean"));
        h.gate(&max, most, "cells", Bound::Most(0.1), Bound::Most(0.03), &note);
        h.gate(&mean, sum / count as f64, "cells", Bound::Most(0.05), Bound::Most(0.01), &note);
    }
}

/// Voxels that a sweep misses, and voxels where it is fat, against the least distance over the poses.
fn missed_and_fat(swept: &FloatGrid, reference: impl Fn(DVec3) -> f64) -> (u64, u64) {
    let cell = swept.voxel_size();
    let (mut missed, mut fat) = (0, 0);
    for leaf in swept.leaves().expect("leaves") {
        for index in 0..512 {
            let (x, y, z) = (index >> 6, index >> 3 & 7, index & 7);
            let at = [leaf.origin[0] + x as i32, leaf.origin[1] + y as i32, leaf.origin[2] + z as i32];
            let truth = reference(DVec3::from(at.map(f64::from)) * cell) / cell;
            let ours = leaf.values[offset(x, y, z)];
            missed += u64::from(ours > 0.0 && truth < -0.5);
            fat += u64::from(ours < 0.0 && truth > 1.0);
        }
    }
    (missed, fat)
}

/// A cube of 12 triangles that turns about its diagonal.
fn cube(h: &mut Harness) {
    if !h.wants("snow.base.cube") {
        return;
    }
    let ctx = context(2);
    // Turned so that the diagonal points along z, about which the angle then changes.
    let tilt = DVec3::new(std::f64::consts::FRAC_PI_4, -(1.0f64 / 3.0).sqrt().asin(), 0.0);
    let motion = MovingBox {
        half: DVec3::repeat(0.2),
        at: [DVec3::zeros(); 2],
        turn: [tilt, tilt + DVec3::new(0.0, 0.0, 0.3)],
    };
    let swept = sweep::chain(&ctx, &[moving_body(&motion)], 0.0, 1.0, &Settings::new(CELL)).expect("sweep");
    let poses = motion.poses(1024);
    let (missed, fat) = missed_and_fat(&swept, |p| motion.distance(&poses, p));
    h.gate("snow.base.cube_missed", missed as f64, "voxels", Bound::Most(0.0), Bound::Open, "");
    h.gate("snow.base.cube_fat", fat as f64, "voxels", Bound::Most(0.0), Bound::Open, "");
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
    let mut base = scenes::snow(&ctx, 7.2, 0.0075, EXACT);
    let bodies = walkers();
    let (mut worst, mut total) = (0.0f64, 0.0);
    let (mut grown, mut before) = (0u64, mesh_volume(&ctx, base.surface()));
    let first = before;
    for frame in 1..=48 {
        let old = base.surface().deep_copy().expect("copy");
        let from = f64::from(if frame == 1 { 1 } else { frame - 1 });
        base.step(&ctx, &bodies, from, f64::from(frame), frame).expect("step");
        grown += growth(&old, base.surface());
        let (after, removed) = (mesh_volume(&ctx, base.surface()), mesh_volume(&ctx, base.removed()));
        if removed > 1000.0 * 0.0075f64.powi(3) {
            worst = worst.max(((before - after) / removed - 1.0).abs() * 100.0);
        }
        total += removed;
        before = after;
    }
    let walk = ((first - before) / total - 1.0).abs() * 100.0;
    h.gate("snow.base.volume_frame", worst, "%", Bound::Most(0.5), Bound::Most(0.1), "worst frame");
    h.gate("snow.base.volume_walk", walk, "%", Bound::Most(0.5), Bound::Most(0.1), "");
    h.gate("snow.base.monotone_grown", grown as f64, "voxels", Bound::Most(0.0), Bound::Open, "");
}

fn walkers() -> Vec<Body> {
    use common::boot::{left_boot, right_boot, walk};
    use frazil::motion::{Key, Keys, Rigid};
    let body = |mesh, side: f64| {
        let keys = walk(side, 48, 0.08).into_iter().map(|step| Key {
            time: f64::from(step.frame),
            at: DVec3::from(step.at) - DVec3::z() * 1.5,
            turn: DVec3::from(step.turn_deg.map(f64::to_radians)),
        });
        let keys = Keys::new(keys.collect()).expect("keys");
        Body::new(Box::new(Rigid::new(mesh, keys)), 1.0).expect("body")
    };
    vec![body(left_boot(), -1.0), body(right_boot(), 1.0)]
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

/// Seconds of each frame of a scene, after the first pose.
fn run(ctx: &frazil::Context, base: &mut BaseLayer, body: &Body) -> Vec<f64> {
    let bodies = std::slice::from_ref(body);
    base.step(ctx, bodies, 0.0, 0.0, 0).expect("first pose");
    let step =
        |frame: i32| timed(|| drop(base.step(ctx, bodies, f64::from(frame - 1), f64::from(frame), frame))).0;
    (1..=FRAMES).map(step).collect()
}

fn times(h: &mut Harness) {
    let ctx = context(2);
    let cpu = format!("threads=2 cpu={:?}", frazil::base::cpu::cpu_level());
    if h.wants("snow.base.small") || h.wants("snow.base.stock_small") {
        let (mut base, body) = scenes::small(&ctx, 2.0);
        let seconds = median(run(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=1.7-1.84 s on 6 cores");
        h.gate("snow.base.small", seconds, "s", Bound::Most(0.15), Bound::Most(0.04), &note);
        let (stock, noisy) = timed(|| stock(&ctx, &body, &scenes::snow(&ctx, 2.0, 0.005, EXACT)));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_small", stock / seconds, "x", Bound::Least(20.0), Bound::Least(60.0), &note);
    }
    if ["large", "area", "stock_large", "memory"].iter().any(|name| h.wants(&format!("snow.base.{name}"))) {
        let (mut base, body) = scenes::large(&ctx, 6.0);
        let seconds = median(run(&ctx, &mut base, &body));
        let note = format!("{cpu} thesis=3.15-4.59 s on 6 cores");
        h.gate("snow.base.large", seconds, "s", Bound::Most(0.15), Bound::Most(0.05), &note);
        let bytes = base.surface().memory_bytes() as f64 / base.surface().active_voxels() as f64;
        h.gate("snow.base.memory_voxel", bytes, "B", Bound::Most(14.0), Bound::Most(12.0), "stock=12-14");
        let peak = peak_megabytes();
        h.gate(
            "snow.base.memory_peak",
            peak,
            "MB",
            Bound::Most(300.0),
            Bound::Most(200.0),
            "stock=370; this process",
        );
        let (stock, noisy) = timed(|| stock(&ctx, &body, &base));
        let note = format!("stock {stock:.2} s{noisy}");
        h.gate("snow.base.stock_large", stock / seconds, "x", Bound::Least(40.0), Bound::Least(120.0), &note);
        drop(base);
        let (mut wide, body) = scenes::large(&ctx, 20.0);
        let ratio = median(run(&ctx, &mut wide, &body)) / seconds;
        h.gate("snow.base.area", ratio, "x", Bound::Most(1.2), Bound::Most(1.05), &cpu);
    }
}

fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    line.split_whitespace().next().and_then(|kilobytes| kilobytes.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

/// The thesis' step with OpenVDB's default tools: 9 poses, dilated, smoothed, advected by noise, cut out.
fn stock(ctx: &frazil::Context, body: &Body, base: &BaseLayer) {
    let cell = base.surface().voxel_size();
    let settings = SamplesSettings::new(cell);
    let mut swept = sweep::samples(ctx, std::slice::from_ref(body), 0.0, 1.0, &settings).expect("samples");
    let speed = FloatGrid::new(cell, cell as f32).expect("speed");
    level_set::advect_outward(ctx, &mut swept, &speed).expect("advection");
    level_set::intersection_copy(ctx, base.surface(), &swept).expect("removed");
    let mut snow = base.surface().deep_copy().expect("copy");
    level_set::difference(ctx, &mut snow, swept).expect("difference");
}

/// The same bytes from 1 and 2 threads.
fn bytes(h: &mut Harness) {
    if !h.wants("snow.base.same_bytes") {
        return;
    }
    let make = |threads: usize| {
        let ctx = context(threads);
        let (mut base, body) = scenes::small(&ctx, 1.4);
        run(&ctx, &mut base, &body);
        let grids = [base.surface(), base.removed(), base.compression(), base.touched()];
        to_bytes(&grids, &WriteOptions::default()).expect("bytes")
    };
    h.holds("snow.base.same_bytes_threads", make(1) == make(2), "1 and 2 threads");
}

/// pyopenvdb and vdb_print see what we see.
fn readers(h: &mut Harness) {
    if !h.wants("snow.base.readers") {
        return;
    }
    let ctx = context(2);
    let base = scenes::snow(&ctx, 1.0, 0.01, EXACT);
    let path = std::env::temp_dir().join(format!("frazil-gates-{}.vdb", std::process::id()));
    frazil::vdb::file::write(&path, &[base.surface()], &WriteOptions::default()).expect("write");
    let script = "import sys, pyopenvdb as v; g = v.readAllGridMetadata(sys.argv[1])[0]; g = v.read(sys.argv[1], 'surface'); \
                  print(g.activeVoxelCount(), g.gridClass, g.transform.voxelSize()[0])";
    let python = std::process::Command::new("/usr/bin/python3").args(["-c", script]).arg(&path).output();
    let expected = format!("{} level set 0.01", base.surface().active_voxels());
    let said =
        python.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string()).unwrap_or_default();
    h.holds("snow.base.readers_pyopenvdb", said == expected, &format!("{said} | {expected}"));
    let print = std::process::Command::new("vdb_print").arg("-l").arg(&path).output();
    h.holds("snow.base.readers_vdb_print", print.is_ok_and(|output| output.status.success()), "");
    let _ = std::fs::remove_file(path);
}
