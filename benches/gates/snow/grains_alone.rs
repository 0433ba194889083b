//! The walking scene with grains only, twice as large as those beside a base layer: what a base saves. The gate has no bound.

use std::time::Instant;

use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Character, Key, Keys, Placed, Play, Space};
use frazil::snow::grains::{Grains, Object, Params, Surroundings};
use frazil::sweep::Body;

use crate::harness::Harness;
use crate::process::kilobytes;
use crate::scenes::{MAN, context, wanted_data};
use crate::snow::grains::{FRAME, ON_A_FLOOR};

/// Radius (m): twice that of examples/scenes/grains_walk.toml.
const RADIUS: f64 = 0.005;
/// Least and greatest corner of the snow (m, along x and z), and its depth.
const AREA: [[f64; 2]; 2] = [[-0.8, -1.1], [0.8, 1.7]];
const DEPTH: f64 = 0.35;
/// Count of frames until the grains rest.
const SETTLE: i32 = 10;
/// Counts of frames that he walks, with and without rest.
const WALK: i32 = 24;
const AWAKE: i32 = 2;

pub fn run(h: &mut Harness) {
    let name = "snow.grains.walk_particles";
    let Some(man) = wanted_data(h, &[name], MAN) else { return };
    let [count, resting, _] = seconds(&man, true, SETTLE, WALK);
    let [_, awake, memory] = seconds(&man, false, 1, AWAKE);
    let note = format!(
        "{count} grains of twice the diameter, threads=2, mean of {WALK} frames; {awake:.1} s without rest; {:.1} GB; thesis: 51.9 s, 273 s, \
         6.9 GB. Beside ours with a base: snow.grains.table_3_11",
        memory / 1e6
    );
    h.gate(name, resting, &note);
}

/// Count of grains, mean time of a frame of the walk (s), and peak memory so far (kB).
fn seconds(man: &std::path::Path, rests: bool, settle: i32, walk: i32) -> [f64; 3] {
    let ctx = context(2);
    let params = Params { rests, ..Params::for_cell(1.5 * RADIUS) };
    let mut grains = Grains::new(Params { radius: RADIUS, ..params }).expect("grains");
    grains.emit(&packed(), &[], 0).expect("grains");
    // Walls at the sides.
    let at = |corner: [f64; 2], y: f64| [corner[0] as f32, y as f32, corner[1] as f32];
    let mut walls = TriMesh::cuboid(at(AREA[0], -1.0), at(AREA[1], 3.0));
    walls.triangles.retain(|triangle| {
        let heights = triangle.map(|corner| walls.positions[corner as usize].y);
        heights[0] != heights[1] || heights[1] != heights[2]
    });
    let body = Body::new(Box::new(walking(man)), 0.0).expect("a body");
    let mut taken = 0.0;
    for frame in 1 - settle..=walk {
        let objects = [Object::new(&body, 0.3)];
        let objects = if frame <= 0 { &objects[..0] } else { &objects[..] };
        let around = Surroundings { objects, statics: &[&walls], ..ON_A_FLOOR };
        let times = [frame - 1, frame].map(|frame| f64::from(frame.max(0)) * FRAME);
        let times = if frame <= 0 { [0.0, FRAME] } else { times };
        let start = Instant::now();
        grains.step(&ctx, &around, times, frame).expect("a step");
        taken += if frame > 0 { start.elapsed().as_secs_f64() } else { 0.0 };
    }
    [grains.ids().len() as f64, taken / f64::from(walk), kilobytes("self", "VmHWM:")]
}

/// Hexagonal layers of grains, alternately shifted, spaced as in a close packing.
fn packed() -> Vec<DVec3> {
    let d = 2.0 * RADIUS;
    let [low, high] = AREA;
    let (wide, up) = (3f64.sqrt() / 2.0 * d, (2f64 / 3.0).sqrt() * d);
    let number = |from: f64, to: f64, step: f64| ((to - from - 1.5 * d) / step) as i32;
    let (layers, rows, along) =
        (number(0.0, DEPTH, up), number(low[1], high[1], wide), number(low[0], high[0], d));
    let mut positions = Vec::new();
    for (y, z) in (0..layers).flat_map(|y| (0..rows).map(move |z| (y, z))) {
        let shift = f64::from((z + y) % 2) * 0.5 * d;
        let row = f64::from(z) * wide + f64::from(y % 2) * wide / 3.0;
        let position = |x: i32| DVec3::new(f64::from(x) * d + shift, f64::from(y) * up, row);
        positions.extend(
            (0..along).map(|x| position(x) + DVec3::new(low[0] + 0.5 * d, 0.5 * d, low[1] + 0.5 * d)),
        );
    }
    positions
}

/// CesiumMan as in examples/scenes/grains_walk.toml, starting outside the snow.
fn walking(man: &std::path::Path) -> Placed {
    let figure = Character::open(man, Play::default()).expect("the figure");
    let key = |time: f64, z: f64| Key { time, at: DVec3::new(0.0, 0.06, z), turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(0.0, -1.7), key(1.0, -0.62)]).expect("keys");
    Placed::new(Box::new(figure), Space { scale: 1.166, ..Space::OWN }, keys)
}
