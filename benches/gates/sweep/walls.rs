//! Gates of the swept volume: walls, and distances against exact ones.

use frazil::geometry::DVec3;
use frazil::numeric::blocks::offset;
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::{FloatGrid, level_set};

use crate::common::shapes::{cuboid, sphere};
use crate::harness::Harness;
use crate::scenes::{self, context};
use crate::sweep::oracle::{MovingBox, away_from_creases, capsule};

const CELL: f64 = 0.005;

/// All of them.
pub fn run(h: &mut Harness) {
    wall(h);
    h.measure_all(["snow.base.cube_missed", "snow.base.cube_fat"], cube);
    phi(h);
    h.measure_all(["snow.base.boots_missed", "snow.base.boots_fat"], boots);
}

/// A box as a body that moves from time 0 to 1.
pub fn moving_body(motion: &MovingBox) -> Body {
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
            let mut base = scenes::snow(&ctx, 1.2, CELL, scenes::EXACT);
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
        h.gate(&max, most, &note);
        h.gate(&mean, sum / count as f64, &note);
    }
}

/// Calls `see` with each voxel of a grid's leaves: position (m) and value (cells).
pub fn each_voxel(grid: &FloatGrid, mut see: impl FnMut(DVec3, f64)) {
    let cell = grid.voxel_size();
    for leaf in grid.leaves().expect("leaves") {
        for index in 0..512 {
            let (x, y, z) = (index >> 6, index >> 3 & 7, index & 7);
            let at = [leaf.origin[0] + x as i32, leaf.origin[1] + y as i32, leaf.origin[2] + z as i32];
            let value = f64::from(leaf.values[offset(x, y, z)]) / cell;
            see(DVec3::from(at.map(f64::from)) * cell, value);
        }
    }
}

/// Voxels that a sweep misses, and voxels where it is fat, against the least distance (m) over the poses.
fn missed_and_fat(swept: &FloatGrid, reference: impl Fn(DVec3) -> f64) -> (u64, u64) {
    let (mut missed, mut fat) = (0, 0);
    let cell = swept.voxel_size();
    each_voxel(swept, |p, ours| {
        let truth = reference(p) / cell;
        missed += u64::from(ours > 0.0 && truth < -0.5);
        fat += u64::from(ours < 0.0 && truth > 1.0);
    });
    (missed, fat)
}

/// A cube of 12 triangles that turns about its diagonal.
fn cube() -> [(f64, &'static str); 2] {
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
    [(missed as f64, ""), (fat as f64, "")]
}

/// Distances in the band against exact ones, inside and outside: a box that does not turn, a ball that does.
fn phi(h: &mut Harness) {
    if !h.wants("snow.base.phi") {
        return;
    }
    let ctx = context(2);
    let settings = Settings::new(CELL);
    let worst = |swept: &FloatGrid, truth: &dyn Fn(DVec3) -> f64| {
        let mut worst: f64 = 0.0;
        each_voxel(swept, |p, ours| {
            let truth = truth(p) / CELL;
            if truth.abs() < 2.9 || ours.abs() < 2.9 {
                worst = worst.max((ours - truth.clamp(-3.0, 3.0)).abs());
            }
        });
        worst
    };
    let mut most: f64 = 0.0;
    for seed in 1..=3 {
        let turn = DVec3::new(0.7, 1.9, 3.1) * f64::from(seed);
        let at = [DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.15, 0.1, 0.05)];
        let motion = MovingBox { half: DVec3::repeat(0.1), at, turn: [turn, turn] };
        let swept = sweep::chain(&ctx, &[moving_body(&motion)], 0.0, 1.0, &settings).expect("sweep");
        let poses = motion.poses(1024);
        let truth = |p: DVec3| {
            let depth = motion.depth(p);
            if depth > 0.0 { -depth } else { motion.distance(&poses, p) }
        };
        most = most.max(worst(&swept, &truth));
    }
    h.gate("snow.base.phi_box", most, "all voxels in the band");
    let at = [DVec3::new(-0.2, 0.0, 0.0), DVec3::new(0.2, 0.0, 0.0)];
    let body = scenes::body(sphere(0.1, 64), at, [DVec3::zeros(), DVec3::new(0.1, 0.2, 0.2)], 1.0);
    let swept = sweep::chain(&ctx, &[body], 0.0, 1.0, &settings).expect("sweep");
    let most = worst(&swept, &|p| capsule(p, at[0], at[1], 0.1));
    h.gate("snow.base.phi_ball", most, "turns by 0.3 rad");
}

/// The four fastest frames of the demonstration's walk against the union of 256 poses. A pose's distance is
/// sampled from OpenVDB's level set of the boot at rest, with cells a quarter as large: at the walk's own cells
/// OpenVDB fills the grooves between the treads.
fn boots() -> [(f64, String); 2] {
    let ctx = context(2);
    let cell = scenes::WALK_CELL;
    let boots = scenes::boots(DVec3::zeros());
    let mut speeds: Vec<(f64, usize, i32)> = Vec::new();
    for (boot, (mesh, keys)) in boots.iter().enumerate() {
        for frame in 2..=48 {
            let [(r0, at0), (r1, at1)] = [keys.at(f64::from(frame - 1)), keys.at(f64::from(frame))];
            let moved =
                |p: &frazil::geometry::Vec3| (r1 * p.cast::<f64>() + at1 - r0 * p.cast::<f64>() - at0).norm();
            speeds.push((mesh.positions.iter().map(moved).fold(0.0, f64::max), boot, frame));
        }
    }
    speeds.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let bodies = scenes::walkers();
    let (mut missed, mut fat) = (0, 0);
    for &(_, boot, frame) in &speeds[..4] {
        let (from, to) = (f64::from(frame - 1), f64::from(frame));
        let swept = sweep::chain(&ctx, &bodies[boot..=boot], from, to, &Settings::new(cell)).expect("sweep");
        let (mesh, keys) = &boots[boot];
        let rest = level_set::from_mesh(&ctx, mesh, cell / 4.0, 8.0).expect("boot");
        let mut voxels = Vec::new();
        each_voxel(&swept, |p, ours| voxels.push((p, ours)));
        let mut least = vec![f32::INFINITY; voxels.len()];
        let mut distances = Vec::new();
        for index in 0..256 {
            let (rotation, at) = keys.at(from + (to - from) * f64::from(index) / 255.0);
            let local: Vec<DVec3> = voxels.iter().map(|(p, _)| rotation.inverse() * (p - at)).collect();
            rest.sample_linear(&ctx, &local, &mut distances).expect("samples");
            least.iter_mut().zip(&distances).for_each(|(least, distance)| *least = least.min(*distance));
        }
        for ((_, ours), least) in voxels.into_iter().zip(least) {
            let truth = f64::from(least) / cell;
            missed += u64::from(ours > 0.0 && truth < -0.5);
            fat += u64::from(ours < 0.0 && truth > 1.0);
        }
    }
    let note = format!("{:.0} mm in a frame", speeds[0].0 * 1000.0);
    [(missed as f64, note.clone()), (fat as f64, note)]
}
