//! Gate of mist over time: the same at 24, 48 and 96 frames per second.

use frazil::Context;
use frazil::flow::Tiles;
use frazil::geometry::DVec3;
use frazil::snow::mist::{Mist, Params, Source, Start, StepInputs, Surroundings};

use crate::common::shapes::cuboid;
use crate::scenes::{EXACT, body, context, layer};
use crate::snow::mist::open;

/// Edge of a cell of air (m).
const CELL: f64 = 0.0133;
/// Times (s) at which mist is compared, every one a whole number of frames at each rate.
const CHECKS: [f64; 4] = [1.0 / 12.0, 1.0 / 6.0, 1.0 / 3.0, 2.0 / 3.0];
/// Gravity (m/s2), and the velocity that grains keep of a second's in the air.
const GRAVITY: f64 = -9.81;

/// A grain that lies still until it is thrown, and then flies.
#[derive(Clone, Copy)]
struct Flight {
    from: DVec3,
    thrown: f64,
    velocity: DVec3,
}

impl Flight {
    fn at(&self, time: f64) -> Start {
        let time = time - self.thrown;
        if time < 0.0 {
            return Start { position: self.from, velocity: [0.0; 3] };
        }
        let fall = DVec3::new(0.0, GRAVITY, 0.0);
        let velocity = self.velocity + fall * time;
        let position = self.from + self.velocity * time + fall * (0.5 * time * time);
        Start { position, velocity: [velocity.x as f32, velocity.y as f32, velocity.z as f32] }
    }

    fn source(&self, [from, to]: [f64; 2]) -> Source {
        let Start { position, velocity } = self.at(to);
        Source { position, velocity, radius: 0.003, start: Some(self.at(from)) }
    }
}

/// Numbers 0..1 that are the same in every run.
pub fn numbers(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / f64::from(1 << 24)
    }
}

/// A ball of grains that flies up at 3 m/s: that of a scene with initial grains.
fn puff() -> Vec<Flight> {
    let mut next = numbers(5);
    let mut all = Vec::new();
    while all.len() < 600 {
        let at = [next(), next(), next()].map(|x| 2.0 * x - 1.0);
        let at = DVec3::from(at);
        if at.norm() < 1.0 {
            let from = at * 0.08 + DVec3::y() * 0.45;
            all.push(Flight { from, thrown: -1.0e-9, velocity: DVec3::new(0.0, 3.0, 0.0) });
        }
    }
    all
}

/// Grains that are thrown one after another, as by a wheel: at random moments and to all sides.
fn spray() -> Vec<Flight> {
    let mut next = numbers(7);
    let one = |_| {
        let thrown = 0.4 * next();
        let from = DVec3::new(0.2 * next() - 0.1, 0.1 * next(), 1.5 * thrown - 0.4);
        let velocity = DVec3::new(next() - 0.5, 1.5 + 2.0 * next(), 1.0 + next());
        Flight { from, thrown, velocity }
    };
    (0..400).map(one).collect()
}

/// Front of a plate that is pushed through snow (m) at a time (s), and its speed (m/s).
const PLOUGH: f64 = 1.5;
fn front(time: f64) -> f64 {
    -0.5 + PLOUGH * time
}

/// Grains of the snow before a plate, thrown up and forward as it reaches them.
fn ploughed() -> Vec<Flight> {
    let mut next = numbers(11);
    let one = |_| {
        let from = DVec3::new(0.3 * next() - 0.15, 0.02 + 0.1 * next(), 0.7 * next() - 0.35);
        let thrown = (from.z + 0.5) / PLOUGH;
        let velocity = DVec3::new(next() - 0.5, 2.0 + next(), PLOUGH + next());
        Flight { from, thrown, velocity }
    };
    (0..500).map(one).collect()
}

/// Mist of flights at the times of [`CHECKS`], in frames of 1 / `fps` (s); `plough`: beside snow that a plate removes.
fn made(ctx: &Context, flights: &[Flight], fps: f64, plough: bool) -> Vec<Mist> {
    let mut mist = Mist::new(Params::for_cell(CELL)).expect("mist");
    let mut scene = plough.then(|| {
        let base = layer(ctx, 0.0, [-0.3, -0.6, 0.3, 0.9], 0.12, 0.01, EXACT);
        let mut plate = cuboid([0.4, 0.3, 0.06]);
        plate.positions.iter_mut().for_each(|at| at.y += 0.16);
        let at = [0.0, 2.0].map(|time| DVec3::z() * (front(time) - 0.03));
        (base, body(plate, at, [DVec3::zeros(); 2], 2.0))
    });
    let mut out = Vec::new();
    let frames = (CHECKS[CHECKS.len() - 1] * fps).round() as i32;
    for frame in 1..=frames {
        let times = [frame - 1, frame].map(|frame| f64::from(frame) / fps);
        let sources: Vec<Source> = flights.iter().map(|flight| flight.source(times)).collect();
        match &mut scene {
            Some((base, body)) => {
                let snow = base.surface().deep_copy().expect("a copy");
                base.step(ctx, std::slice::from_ref(&*body), times[0], times[1], frame).expect("a step");
                let bodies = [&*body];
                let around =
                    Surroundings { base: Some(&snow), bodies: &bodies, removing: &[true], floor: Some(0.0) };
                let walls = around.during(times, CELL).expect("poses");
                let boundary = |tiles: &Tiles, cell: f32, share: f64| walls.faces(ctx, tiles, cell, share);
                let fastest = walls.fastest_near(&mist, &sources);
                let around = StepInputs { sources: &sources, boundary: &boundary, fastest, wind: None };
                mist.step(ctx, &around, times).expect("a step");
            }
            None => {
                let around = StepInputs { sources: &sources, boundary: &open, fastest: 0.0, wind: None };
                mist.step(ctx, &around, times).expect("a step");
            }
        }
        if CHECKS.iter().any(|check| (f64::from(frame) / fps - check).abs() < 1.0e-9) {
            out.push(mist.clone());
        }
    }
    out
}

/// How far mist is from that of another rate: of its mass, of its density where it is (in wide cells, so that what is an eddy's
/// width aside is near), and of its velocity there (all %).
fn differences(one: &Mist, other: &Mist) -> [f64; 3] {
    let mass = (one.mass() / other.mass() - 1.0).abs();
    let [a, b] = [one, other].map(in_blocks);
    let all: std::collections::BTreeSet<[i32; 3]> = a.keys().chain(b.keys()).copied().collect();
    let none = [0.0; 4];
    let (mut off, mut sum, mut speeds, mut speed) = (0.0, 0.0, 0.0, 0.0);
    for at in all {
        let [a, b] = [&a, &b].map(|blocks| blocks.get(&at).unwrap_or(&none));
        off += (a[0] - b[0]).abs();
        sum += b[0];
        speeds += (1..4).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
        speed += (1..4).map(|axis| b[axis].powi(2)).sum::<f64>().sqrt();
    }
    [mass, off / sum, speeds / speed].map(|x| 100.0 * x)
}

/// Mass and momentum in cubes of eight cells.
fn in_blocks(mist: &Mist) -> std::collections::BTreeMap<[i32; 3], [f64; 4]> {
    let mut out = std::collections::BTreeMap::new();
    let flow = mist.flow();
    for (slot, (coord, tile)) in flow.tiles().coords().iter().zip(flow.density()).enumerate() {
        let sums = out.entry(*coord).or_insert([0.0; 4]);
        for (cell, density) in tile.iter().enumerate().filter(|(_, density)| **density > 0.0) {
            sums[0] += f64::from(*density);
            for axis in 0..3 {
                let (above, upper) = flow.tiles().adjacent_cell(slot, cell, axis, true);
                let velocity = &flow.velocity()[axis];
                sums[1 + axis] +=
                    f64::from(*density * 0.5 * (velocity[slot][cell] + velocity[above as usize][upper]));
            }
        }
    }
    out
}

/// How far mist at a lower frame rate is from that at 96 frames per second.
pub fn measure() -> (f64, String) {
    let ctx = context(2);
    let (mut worst, mut note) = (0.0f64, String::new());
    for (scene, flights, plough) in
        [("puff", puff(), false), ("spray", spray(), false), ("plough", ploughed(), true)]
    {
        let [a, b, c] = [24.0, 48.0, 96.0].map(|fps| made(&ctx, &flights, fps, plough));
        // The plate raises nothing before the first time.
        for (at, fine) in c.iter().enumerate().filter(|(_, fine)| fine.mass() > 0.0) {
            for (rate, rough) in [(24, &a), (48, &b)] {
                let off = differences(&rough[at], fine);
                worst = off.into_iter().fold(worst, f64::max);
                note += &format!(
                    "\n#   {scene} {rate} fps at {:.2} s: {:.2} {:.2} {:.2} % of {:.3} l",
                    CHECKS[at],
                    off[0],
                    off[1],
                    off[2],
                    fine.mass() * 1.0e3
                );
            }
        }
    }
    (worst, note)
}
