//! Gates of the grains: piles, free motion, deep beds, sourcing, speed.

use frazil::base::DVec3;
use frazil::context::Context;
use frazil::snow::grain_friction::of_repose;
use frazil::snow::grains::Params;
use frazil::snow::grains::heap::{Colliders, Division, Floor, Heap};

use crate::harness::Harness;
use crate::scenes::context;

/// Length of a frame (s).
const FRAME: f64 = 1.0 / 24.0;

/// All of them.
pub fn run(h: &mut Harness) {
    piles(h);
    sizes(h);
    free(h);
    heap_in_the_air(h);
    bed(h);
    rest(h);
    rest_gain(h);
    speed(h);
}

/// Grains and what moves them.
pub struct Experiment {
    pub ctx: Context,
    pub params: Params,
    pub heap: Heap,
    pub division: Division,
    pub colliders: Colliders<'static>,
    pub random: Random,
    /// Whether what rests is visited too.
    visits_all: bool,
}

/// Numbers in 0..1 (xorshift: Marsaglia 2003).
pub struct Random(u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f64 / (1u64 << 24) as f64
    }
}

impl Experiment {
    pub fn new(threads: usize, diameter: f64, friction: f64, seed: u64) -> Self {
        let params = Params { radius: 0.5 * diameter, friction, ..Params::for_cell(1.5 * diameter) };
        let division = Division { dt: FRAME, sub_steps: params.sub_steps(FRAME, 0.0) };
        let floor = Some(Floor { height: 0.0, friction: friction as f32 });
        let colliders = Colliders { floor, ..Colliders::default() };
        let (ctx, heap) = (context(threads), Heap::new(diameter));
        Self { ctx, params, heap, division, colliders, random: Random(seed * 7919 + 1), visits_all: false }
    }

    pub fn diameter(&self) -> f64 {
        2.0 * self.params.radius
    }

    pub fn step(&mut self) {
        let Self { ctx, params, heap, division, colliders, visits_all, .. } = self;
        let mut coefficients = params.coefficients(division);
        coefficients.visits_all = *visits_all;
        let step = || heap.step(ctx, *division, coefficients, colliders);
        ctx.phase("move", step).expect("step");
    }

    /// A truncated cone of upright layers, of a radius in grains.
    fn fill(&mut self, radius: i32) {
        for layer in 0..2 * radius / 3 {
            let reach = f64::from(radius) - 1.5 * f64::from(layer);
            for (x, z) in (-radius..=radius).flat_map(|x| (-radius..=radius).map(move |z| (x, z))) {
                if f64::from(x * x + z * z) < reach * reach {
                    let site = [f64::from(x), f64::from(layer) + 0.5, f64::from(z)];
                    let place = DVec3::from(site) * 1.08 * self.diameter();
                    self.heap.add(self.heap.count() as u32, place, [0.0; 3]).expect("add");
                }
            }
        }
    }

    /// Places and velocities, bit for bit.
    fn state(&self) -> Vec<u32> {
        let places = self
            .heap
            .located()
            .flat_map(|(at, place)| at.map(|block| block as u32).into_iter().chain(place.map(f32::to_bits)));
        places.chain(self.heap.velocities().flat_map(|velocity| velocity.map(f32::to_bits))).collect()
    }

    /// Pours grains through a hole of 2.5 diameters a little above the pile, then waits.
    fn pour(&mut self, count: usize, frames: usize, wait: usize) {
        let d = self.diameter();
        let speed = -0.6 * (d / 0.005).sqrt();
        let each = count.div_ceil(frames);
        while self.heap.count() < count {
            let rests = |velocity: [f32; 3]| velocity.iter().map(|x| x * x).sum::<f32>() < 0.04;
            let places = self.heap.places().zip(self.heap.velocities());
            let near = places.filter(|(place, velocity)| place.xz().norm() < 6.0 * d && rests(*velocity));
            let top = near.map(|(place, _)| place.y).fold(0.0, f64::max);
            let mut born: Vec<DVec3> = Vec::new();
            for _ in 0..30 * each {
                if born.len() == each || self.heap.count() == count {
                    break;
                }
                let (angle, radius) =
                    (self.random.next() * std::f64::consts::TAU, self.random.next().sqrt() * 2.5 * d);
                let height = top + (2.0 + self.random.next() * each as f64 / 6.0) * d;
                let place = DVec3::new(angle.cos() * radius, height, angle.sin() * radius);
                if born.iter().all(|other| (other - place).norm() > d) {
                    self.heap.add(self.heap.count() as u32, place, [0.0, speed as f32, 0.0]).expect("add");
                    born.push(place);
                }
            }
            self.step();
        }
        (0..wait).for_each(|_| self.step());
    }

    /// Slope of the pile (degrees): a line through the mean heights of rings, in the middle 60 % of its radius.
    fn slope(&self) -> f64 {
        let (d, width) = (self.diameter(), 1.5 * self.diameter());
        let mut tops = std::collections::BTreeMap::new();
        for place in self.heap.places() {
            let column = [place.x, place.z].map(|x| (x / width).floor() as i32);
            let top = tops.entry(column).or_insert(0.0f64);
            *top = top.max(place.y + 0.5 * d);
        }
        let ring = |column: &[i32; 2]| {
            (column.iter().map(|x| (f64::from(*x) + 0.5).powi(2)).sum::<f64>().sqrt()) as usize
        };
        let rings = tops.keys().map(ring).max().unwrap_or(0).min(1000) + 1;
        let (mut sums, mut columns) = (vec![0.0; rings], vec![0.0; rings]);
        for x in -(rings as i32)..=rings as i32 {
            for z in -(rings as i32)..=rings as i32 {
                let ring = ring(&[x, z]);
                if ring < rings {
                    columns[ring] += 1.0;
                    sums[ring] += tops.get(&[x, z]).copied().unwrap_or(0.0);
                }
            }
        }
        let heights: Vec<f64> = sums.iter().zip(&columns).map(|(sum, count)| sum / count).collect();
        let edge = heights.iter().position(|height| *height < 0.8 * d).unwrap_or(rings);
        let middle = (0.2 * edge as f64) as usize..(0.8 * edge as f64).ceil() as usize;
        let points: Vec<(f64, f64)> =
            middle.map(|ring| ((ring as f64 + 0.5) * width, heights[ring])).collect();
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
        let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2));
        (-slope).atan().to_degrees()
    }
}

/// Slopes of poured piles against those that were asked for.
fn piles(h: &mut Harness) {
    let worst = |angles: &[f64], seeds: u64, count: usize, frames: usize| {
        let mut worst: f64 = 0.0;
        for &asked in angles {
            for seed in 1..=seeds {
                let mut pile = Experiment::new(2, 0.005, of_repose(asked), seed);
                pile.pour(count, frames, 30);
                let slope = pile.slope();
                println!("# asked {asked} degrees, seed {seed}: {slope:.2}");
                worst = worst.max((slope - asked).abs());
            }
        }
        worst
    };
    if h.wants("snow.grains.pile_10k") {
        h.gate("snow.grains.pile_10k", worst(&[18.0, 25.0, 32.0, 38.0], 3, 10_000, 220), "");
    }
    if h.wants("snow.grains.pile_100k") {
        h.gate("snow.grains.pile_100k", worst(&[25.0, 32.0], 1, 100_000, 500), "");
    }
}

/// The same angle from grains of three sizes, and what becomes of it in ten seconds.
fn sizes(h: &mut Harness) {
    if !h.wants("snow.grains.pile_size") && !h.wants("snow.grains.pile_creep") {
        return;
    }
    let mut slopes = Vec::new();
    let mut creep: f64 = 0.0;
    for diameter in [0.0015, 0.005, 0.02] {
        let frames = (220.0 * f64::sqrt(diameter / 0.005)).ceil() as usize;
        let mut pile = Experiment::new(2, diameter, of_repose(32.0), 1);
        pile.pour(10_000, frames, frames / 6);
        let slope = pile.slope();
        (0..240).for_each(|_| pile.step());
        println!("# {} mm: {slope:.2} degrees, after 240 frames {:.2}", diameter * 1e3, pile.slope());
        creep = creep.max((slope - pile.slope()).abs());
        slopes.push(slope);
    }
    let most = slopes.iter().copied().fold(f64::MIN, f64::max);
    let least = slopes.iter().copied().fold(f64::MAX, f64::min);
    h.gate("snow.grains.pile_size", most - least, "");
    h.gate("snow.grains.pile_creep", creep, "");
}

/// A grain that nothing touches.
fn free(h: &mut Harness) {
    if !["fall_speed", "fall_way", "air"].iter().any(|name| h.wants(&format!("snow.grains.{name}"))) {
        return;
    }
    let alone = |air: f64, gravity: f64, speed: f32, sub_steps: usize| {
        let mut one = Experiment::new(2, 0.005, 0.2, 1);
        one.colliders = Colliders::default();
        (one.params.air, one.params.gravity, one.division.sub_steps) = (air, gravity, sub_steps);
        one.heap.add(0, DVec3::new(12.3, 45.6, -7.8), [speed, 0.0, 0.0]).expect("add");
        (0..24).for_each(|_| one.step());
        (one.heap.places().next().expect("one"), one.heap.velocities().next().expect("one"))
    };
    let sub_steps = Experiment::new(2, 0.005, 0.2, 1).division.sub_steps;
    let (place, velocity) = alone(1.0, -9.81, 0.0, sub_steps);
    let dt = FRAME / sub_steps as f64;
    h.gate("snow.grains.fall_speed", (f64::from(velocity[1]) / -9.81 - 1.0).abs(), "");
    h.gate("snow.grains.fall_way", ((45.6 - place.y) / (0.5 * 9.81 * (1.0 + dt)) - 1.0).abs(), "");
    let kept = |sub_steps: usize| f64::from(alone(0.5, 0.0, 1.0, sub_steps).1[0]);
    h.gate(
        "snow.grains.air",
        [1, 40].map(|n| (kept(n) / 0.5 - 1.0).abs()).into_iter().fold(0.0, f64::max),
        "",
    );
}

/// A heap that nothing holds: grains that fly into each other.
fn heap_in_the_air(h: &mut Harness) {
    if !h.wants("snow.grains.free_momentum") && !h.wants("snow.grains.free_energy") {
        return;
    }
    let mut heap = Experiment::new(2, 0.005, 0.3, 3);
    heap.colliders = Colliders::default();
    (heap.params.air, heap.params.gravity) = (1.0, 0.0);
    for index in 0..4096u32 {
        let site = DVec3::new(f64::from(index & 15), f64::from(index >> 4 & 15), f64::from(index >> 8))
            * 1.1
            * 0.005;
        let middle = DVec3::repeat(7.5 * 1.1 * 0.005);
        let inward = (middle - site) * 8.0;
        let mut speed = |inward: f64| (inward + heap.random.next() - 0.5) as f32;
        let velocity = [speed(inward.x) + 0.5, speed(inward.y), speed(inward.z)];
        heap.heap.add(index, site, velocity).expect("add");
    }
    let sums = |heap: &Heap| {
        heap.velocities().fold(([0.0f64; 3], 0.0f64), |(sum, energy), v| {
            let v = v.map(f64::from);
            ([0, 1, 2].map(|axis| sum[axis] + v[axis]), energy + v.iter().map(|x| x * x).sum::<f64>())
        })
    };
    let (start, mut energy) = sums(&heap.heap);
    let size = start.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut rise: f64 = 0.0;
    let mut lost: f64 = 0.0;
    let first = energy;
    for _ in 0..24 * heap.division.sub_steps {
        heap.division = Division { dt: heap.division.dt.min(FRAME / 14.0), sub_steps: 1 };
        heap.step();
        let (now, after) = sums(&heap.heap);
        rise = rise.max(after / energy - 1.0);
        energy = after;
        lost = lost.max((0..3).map(|axis| (now[axis] - start[axis]).powi(2)).sum::<f64>().sqrt() / size);
    }
    println!("# energy at the end: {:.3} of that at the start", energy / first);
    h.gate("snow.grains.free_momentum", lost, "");
    h.gate("snow.grains.free_energy", rise, "");
}

/// Sixty layers of grains that settle from the packing in which they are born, between walls.
fn bed(h: &mut Harness) {
    if !h.wants("snow.grains.bed_overlap") {
        return;
    }
    let d = 0.005;
    let mut bed = Experiment::new(2, d, of_repose(32.0), 5);
    let width = 14.0 * d;
    bed.colliders.shells = vec![walls(width, 100.0 * d)];
    let apart = 1.16 * d;
    let across = (width / apart) as u32;
    let mut id = 0;
    for layer in 0..52 {
        for x in 0..across {
            for z in 0..across {
                let mut jitter = || (bed.random.next() - 0.5) * 0.1 * d;
                let site = [x, layer, z].map(|at| (f64::from(at) + 0.5) * apart);
                let place = DVec3::new(
                    site[0] + jitter() - 0.5 * width,
                    site[1] + jitter(),
                    site[2] + jitter() - 0.5 * width,
                );
                bed.heap.add(id, place, [0.0; 3]).expect("add");
                id += 1;
            }
        }
    }
    for frame in 0..72 {
        bed.step();
        if frame % 12 == 0 {
            let top = bed.heap.places().map(|place| place.y).fold(0.0, f64::max) / d;
            println!("# frame {frame}: {top:.1} diameters high, fastest {:.3} m/s", bed.heap.fastest());
        }
    }
    let mut overlaps = bed.heap.overlaps();
    overlaps.sort_by(f32::total_cmp);
    h.gate("snow.grains.bed_overlap", f64::from(overlaps[overlaps.len() * 99 / 100]) * 100.0, "");
}

/// Four walls without friction.
fn walls(
    width: f64,
    height: f64,
) -> (frazil::snow::grains::heap::Shell, frazil::snow::grains::heap::Pose<'static>) {
    let half = 0.5 * width;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let places: Vec<DVec3> =
        [-0.1, height].iter().flat_map(|y| corners.map(|[x, z]| DVec3::new(x, *y, z))).collect();
    let side = |a: u32| {
        let b = (a + 1) % 4;
        [[a, b, b + 4], [a, b + 4, a + 4]]
    };
    let shell = frazil::snow::grains::heap::Shell::new(
        9,
        0.0,
        (0..4).flat_map(side).collect(),
        false,
        places.clone(),
    );
    let pose = move |_: f64, out: &mut Vec<DVec3>| {
        out.clone_from(&places);
        Ok(())
    };
    (shell, Box::new(pose))
}

/// What rest changes: nothing where what rests is left out, little of a pile's angle.
fn rest(h: &mut Harness) {
    if h.wants("snow.grains.rest_bytes") {
        let run = |visits_all: bool| {
            let mut pile = Experiment::new(2, 0.005, of_repose(32.0), 2);
            pile.visits_all = visits_all;
            pile.pour(3_000, 60, 60);
            (pile.state(), pile.heap.resting())
        };
        let (skipped, all) = (run(false), run(true));
        let note = format!("{} of 3000 grains rest", all.1);
        h.holds("snow.grains.rest_bytes", skipped == all && all.1 > 1_000, &note);
    }
    if h.wants("snow.grains.rest_angle") {
        const SEEDS: u64 = 6;
        let slope = |rests: bool| {
            let one = |seed: u64| {
                let mut pile = Experiment::new(2, 0.005, of_repose(32.0), seed);
                pile.params.rests = rests;
                pile.pour(10_000, 220, 30);
                pile.slope()
            };
            (1..=SEEDS).map(one).sum::<f64>() / SEEDS as f64
        };
        let (with, without) = (slope(true), slope(false));
        let note = format!("{with:.2} and {without:.2} degrees, mean of {SEEDS} seeds");
        h.gate("snow.grains.rest_angle", (with - without).abs(), &note);
    }
}

/// A walker of 96 frames: time of the grains' motion in the last 48 without rest over that with it.
fn rest_gain(h: &mut Harness) {
    if !h.wants("snow.grains.rest_gain") {
        return;
    }
    let Some(man) = crate::common::character::data("character/CesiumMan.glb") else {
        h.skipped("snow.grains.rest_gain", "no data");
        return;
    };
    let folder = std::env::temp_dir().join(format!("frazil-rest-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let seconds = |rests: bool| {
        let (scene, out) = (folder.join("walk.toml"), folder.join(format!("rest-{rests}")));
        let text = format!(
            r#"
shot = {{ frames = "1-96" }}
snow = {{ ground = 0.0, area = [-0.9, -1.6, 0.9, 3.4], depth = 0.2, cell = 0.009 }}
grains = {{ rest = {rests} }}
[[object]]
file = {:?}
scale = 1.166
keys = [{{ frame = 1, at = [0.0, 0.06, -1.15] }}, {{ frame = 96, at = [0.0, 0.06, 3.0] }}]
"#,
            man.display().to_string()
        );
        std::fs::write(&scene, text).expect("a scene");
        let mut run = std::process::Command::new(env!("CARGO_BIN_EXE_frazil"));
        let run = run.arg("snow").arg(&scene).arg("-o").arg(&out).args(["-q", "--threads", "2"]);
        assert!(run.stderr(std::process::Stdio::null()).status().expect("frazil").success());
        (49..=96).map(|frame| moving(&out.join(format!("report/grains.{frame:04}.json")))).sum::<f64>()
    };
    let (with, without) = (seconds(true), seconds(false));
    let _ = std::fs::remove_dir_all(&folder);
    let note = format!("threads=2 {with:.1} s with rest, {without:.1} s without; thesis=1.58 x");
    h.gate("snow.grains.rest_gain", without / with, &note);
}

/// Seconds of a frame's `move`, from its report.
fn moving(report: &std::path::Path) -> f64 {
    let text = std::fs::read(report).expect("a report");
    let report: serde_json::Value = serde_json::from_slice(&text).expect("a report");
    let phases = report["phases"].as_array().expect("phases").iter();
    phases.filter(|phase| phase["name"] == "move").filter_map(|phase| phase["seconds"].as_f64()).sum()
}

/// The state of a heap of 10,000 grains some frames after it began to collapse.
pub fn collapse(threads: usize) -> Vec<u32> {
    let mut heap = Experiment::new(threads, 0.0015, of_repose(25.0), 1);
    heap.fill(24);
    (0..8).for_each(|_| heap.step());
    heap.state()
}

/// All grains of a heap that collapses at work.
fn speed(h: &mut Harness) {
    if !h.wants("snow.grains.speed") {
        return;
    }
    let mut pile = Experiment::new(1, 0.0015, of_repose(32.0), 1);
    pile.params.rests = false;
    pile.fill(60);
    (0..12).for_each(|_| pile.step());
    let frames = 6;
    let start = std::time::Instant::now();
    (0..frames).for_each(|_| pile.step());
    let seconds = start.elapsed().as_secs_f64();
    let rate = pile.heap.count() as f64 * f64::from(frames) / seconds / 1e3;
    let note = format!(
        "threads=1 cpu={:?} {} grains, {} sub-steps, {:.1} M grain-sub-steps/s; thesis=3-13 Newton=1.8 MPM=48-93 Taichi=2.4",
        frazil::base::cpu::cpu_level(),
        pile.heap.count(),
        pile.division.sub_steps,
        rate * pile.division.sub_steps as f64 / 1e3
    );
    h.gate("snow.grains.speed", rate, &note);
}
