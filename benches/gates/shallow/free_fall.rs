//! Gates of falls: liquid that leaves an edge flies as ballistics says, and is in the balance all the way.

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::shallow::free_fall::Falls;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::shapes::Shape;
use frazil::shallow::{Params, Shallow};

use crate::common::bodies::Dice;
use crate::common::shallow::{Turn, busy, context, ground, source};
use crate::harness::Harness;
use crate::shallow::ground::{G, change};

/// Edge of a cell (m).
const CELL: f64 = 0.002;
const FRAME: f64 = 1.0 / 60.0;
/// Steps of the run whose units are counted, and frames between changes.
const STEPS: u32 = 100_000;
const EVERY: u32 = 25;

/// Both gates.
pub fn run(h: &mut Harness) {
    h.measure("shallow.fall_path", path);
    h.measure("shallow.fall_volume", volume);
}

/// The furthest that a packet, or the middle of the first liquid that has landed, is from where ballistics has it (% of the height).
fn path() -> (f64, String) {
    let ctx = context();
    let (mut worst, mut note): (f64, String) = (0.0, String::new());
    for (height, name, viscosity, rate) in [
        (0.02, "water", 1e-6, 2e-6),
        (0.3, "water", 1e-6, 5e-6),
        (1.5, "water", 1e-6, 5e-6),
        (0.1, "blood", 4e-6, 2e-6),
        (0.5, "paint", 4e-5, 5e-6),
    ] {
        for pace in [TimeStepping::Exact, TimeStepping::Realtime(0.003)] {
            let params = Params {
                liquid: Liquid::new(viscosity),
                pace,
                falls: Some(Falls { height: 0.005, ..Falls::default() }),
                ..Params::default()
            };
            let [flight, landing, count] = off(&ctx, height, params, rate);
            worst = worst.max(flight).max(landing);
            note +=
                &format!("{name} {height} m {pace:?}: {count} places {flight:.1e}, landing {landing:.3}; ");
        }
    }
    (worst, note)
}

/// How far packets over a fall of a height (m), and the first liquid on the ground below, are off (% of it), and the count of positions that were compared.
fn off(ctx: &Context, height: f64, params: Params, rate: f64) -> [f64; 3] {
    let (low, size) = (0.05, [260, 12]);
    // From a table a tenth of a metre deep.
    let edge = 0.1;
    let half = 0.5 * size[0] as f64 * CELL;
    let solids = ground(size, CELL, [0.0, 2.0], |[x, _]| if x + half < edge { low + height } else { low });
    let mut liquid = Shallow::new(ctx, &solids, params).expect("a liquid");
    let middle = edge - half - 0.01;
    let point = source([middle, low + height, 0.0], 0.006, rate);
    liquid.set_flows(&[point], |_| "the source".into()).expect("a source");
    let time = (2.0 * height / G).sqrt();
    let (mut off, mut count, mut landing) = (0.0_f64, 0.0, f64::NAN);
    // What is to land, by when it does: volume, and where.
    let mut lands: Vec<[f64; 3]> = Vec::new();
    let mut known = 0;
    while landing.is_nan() || count < 1000.0 {
        liquid.step(ctx, FRAME / 4.0).expect("a frame");
        for drop in liquid.drops() {
            let ([x, y, _], [east, ..]) = (drop.position, drop.velocity);
            let there = [edge - half + east * drop.age, low + height - 0.5 * G * drop.age * drop.age];
            off = off.max(libm::hypot(x - there[0], y - there[1]));
            count += 1.0;
            if drop.number > known {
                lands.push([liquid.time() - drop.age + time, drop.volume, edge - half + east * time]);
            }
        }
        known = liquid.drops().map(|drop| drop.number).max().unwrap_or(known);
        if landing.is_nan()
            && let Some(middle) = middle_below(&liquid, edge - half)
        {
            let landed = || lands.iter().filter(|land| land[0] <= liquid.time() + 1e-9);
            let all: f64 = landed().map(|[_, volume, _]| volume).sum();
            let theory = landed().map(|[_, volume, x]| volume * x).sum::<f64>() / all;
            landing = (middle - theory).abs();
        }
    }
    let share = 100.0 / height;
    // A column stands for the positions of its cell.
    [off * share, (landing - 0.5 * CELL).max(0.0) * share, count]
}

/// The middle of the liquid beyond a position along x (m).
fn middle_below(liquid: &Shallow, edge: f64) -> Option<f64> {
    let columns = liquid.columns();
    let (mut sum, mut moment) = (0.0, 0.0);
    for index in columns.indices() {
        let [x, _] = columns.grid.centre(columns.cell(index));
        let depth = if x > edge { f64::from(liquid.depths()[index]) } else { 0.0 };
        sum += depth;
        moment += depth * x;
    }
    (sum > 0.0).then(|| moment / sum)
}

/// Units that are missing, or too many, in any frame of a busy scene with falls, in which a ball moves about.
fn volume() -> (f64, String) {
    let ctx = context();
    let mut plan = busy([93, 61]);
    let falls = Falls { height: 0.002, drop: 0.0, max_packets: 500, ..Falls::default() };
    plan.params.falls = Some(falls);
    let mut liquid = plan.make(&ctx, Turn::NONE);
    let mut dice = Dice(17);
    let (mut steps, mut frame, mut wrong) = (0, 0, 0);
    let (mut most, mut flown, mut full) = (0, 0, 0);
    while steps < STEPS {
        if frame % EVERY == 0 {
            change(&mut liquid, &mut dice);
        }
        if frame % 3 == 0 {
            let centre =
                DVec3::new(dice.between(-0.03, 0.03), dice.between(0.0, 0.02), dice.between(-0.02, 0.02));
            liquid.set_bodies(&[Shape::Sphere { centre, radius: 0.008 }]).expect("a ball");
            wrong += liquid.balance().error.unsigned_abs();
        }
        steps += liquid.step(&ctx, FRAME).expect("a frame").steps;
        wrong += liquid.balance().error.unsigned_abs();
        let count = liquid.drops().len();
        (most, flown, full) = (most.max(count), flown + count, full + u32::from(count == falls.max_packets));
        frame += 1;
    }
    let all = liquid.balance();
    let note = format!(
        "{steps} steps, {frame} frames, {:.0} packets on average, at most {most} of {}, {full} frames full; ml inside {:.2}, in the air {:.4}, lost {:.1}, \
         held {:.4}",
        flown as f64 / f64::from(frame),
        falls.max_packets,
        1e6 * all.inside,
        1e6 * all.falling,
        1e6 * all.lost,
        1e6 * all.held,
    );
    (wrong as f64, note)
}
