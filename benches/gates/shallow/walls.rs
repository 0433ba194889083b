//! Gates of friction at walls and ceilings: closed ducts and open channels against the exact flow (White, *Viscous Fluid Flow*, 3-3.3), and what it costs.

use std::f64::consts::PI;

use frazil::Context;
use frazil::numeric::cpu::cpu_level;
use frazil::shallow::columns::grid::BOTTOMLESS;
use frazil::shallow::params::{Friction, TimeStepping};
use frazil::shallow::{Params, Shallow};

use crate::common::shallow::{context, covered, ground, waves};
use crate::harness::Harness;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, even, terrain, viscous};
use crate::shallow::speed::Frames;

/// Edge of a cell (m), cells across, how far gravity leans, and viscosity (m2/s).
const CELL: f64 = 5.0e-4;
const ACROSS: usize = 8;
const LEAN: f64 = 0.02;
const VISCOSITY: f64 = 1.0e-4;
/// Frames of a step (s).
const STEP: f64 = 1.0e-3;
/// Width over depth.
const FORMS: [f64; 3] = [1.0, 2.0, 8.0];
/// How much over the duct the columns at its ends stand (m).
const HEAD: f64 = 0.02;

/// All gates.
pub fn run(h: &mut Harness) {
    let ctx = context();
    let kinds = [
        ("shallow.duct_closed", "shallow.duct_closed_ground", true),
        ("shallow.channel_open", "shallow.channel_open_ground", false),
    ];
    for (name, without, is_closed) in kinds {
        h.measure_all([name, without], || {
            let [own, thesis] =
                [Friction::Walls, Friction::Ground].map(|friction| off(&ctx, is_closed, friction));
            [own, (thesis.0, format!("{}; friction at the ground only", thesis.1))]
        });
    }
    h.measure("shallow.duct_settles", || settles(&ctx));
    if h.wants("shallow.duct_closed") {
        plot(&ctx);
    }
    costs(h);
}

/// A straight passage of [`ACROSS`] cells between walls along x.
#[derive(Clone, Copy)]
struct Passage {
    /// Cells from end to end; the first and the last are open above.
    long: usize,
    depth: f64,
    is_closed: bool,
    viscosity: f64,
    friction: Friction,
}

impl Passage {
    /// Filled, and at rest.
    fn filled(self, ctx: &Context) -> Shallow {
        let heights = between(-0.02, 0.2);
        let solids = terrain([self.long, ACROSS + 2], CELL, heights, |[x, z]| {
            let floor = [BOTTOMLESS, heights.round(0.0)];
            if z == 0 || z == ACROSS + 1 {
                vec![[BOTTOMLESS, heights.round(0.15)]]
            } else if self.is_closed && !self.is_end(x) {
                vec![floor, [heights.round(self.depth), heights.round(0.15)]]
            } else {
                vec![floor]
            }
        });
        let params =
            Params { gravity: [LEAN * G, -G, 0.0], friction: self.friction, ..viscous(self.viscosity) };
        let mut liquid = Shallow::new(ctx, &solids, params).expect("a passage");
        self.fill(&mut liquid);
        liquid
    }

    fn is_end(self, x: usize) -> bool {
        x == 0 || x + 1 == self.long
    }

    /// Makes the ends, and all of an open channel, as deep as they were.
    fn fill(self, liquid: &mut Shallow) {
        let unit = liquid.columns().heights.unit;
        for index in 0..liquid.columns().len() {
            if !liquid.columns().is_column(index) || liquid.columns().layer(index) > 0 {
                continue;
            }
            let [x, z] = liquid.columns().cell(index);
            if (1..=ACROSS).contains(&z) {
                let over = if self.is_closed && self.is_end(x) { HEAD } else { 0.0 };
                if self.is_closed && !self.is_end(x) && liquid.depths()[index] > 0 {
                    continue;
                }
                liquid.pour(index, self.depth + over - unit * f64::from(liquid.depths()[index]));
            }
        }
    }

    /// Velocities across its middle (m/s) after each step; so many.
    fn run(self, ctx: &Context, steps: usize) -> Vec<[f64; ACROSS]> {
        let mut liquid = self.filled(ctx);
        let frame = |_| {
            liquid.step(ctx, STEP).expect("a frame");
            self.fill(&mut liquid);
            std::array::from_fn(|z| {
                let column = liquid.columns().column([self.long / 2, z + 1], 0).expect("the floor");
                f64::from(liquid.velocity(column)[0])
            })
        };
        (0..steps).map(frame).collect()
    }

    /// Its mean velocity (m/s) when it is steady. Of a closed one what its ends hold back is taken out, by the difference to one of half the length.
    fn steady(self, ctx: &Context) -> f64 {
        let steps = (3.0 * self.depth.powi(2) / self.viscosity / STEP).max(150.0) as usize;
        let of = |passage: Self| {
            // The mean of some steps: units are whole.
            let all = passage.run(ctx, steps + 20);
            all[steps..].iter().map(mean).sum::<f64>() / 20.0
        };
        if !self.is_closed {
            return of(self);
        }
        let half = Self { long: (self.long - 1) / 2 + 1, ..self };
        let [pipes, fewer] = [self, half].map(|passage| (passage.long - 1) as f64);
        (pipes - fewer) / (pipes / of(self) - fewer / of(half))
    }

    /// The mean velocity of theory (m/s): of a duct of twice the depth where it is open.
    fn theory(self) -> f64 {
        let (width, height) =
            (ACROSS as f64 * CELL, if self.is_closed { self.depth } else { 2.0 * self.depth });
        let sum: f64 = odd().map(|n| libm::tanh(n * PI * height / (2.0 * width)) / n.powi(5)).sum();
        let plates = LEAN * G * width * width / (12.0 * self.viscosity);
        plates * (1.0 - 192.0 * width / (PI.powi(5) * height) * sum)
    }

    /// Theory's mean over the height (m/s) at a position across (m) from the middle.
    fn profile(self, y: f64) -> f64 {
        let (width, height) =
            (ACROSS as f64 * CELL, if self.is_closed { self.depth } else { 2.0 * self.depth });
        let term = |n: f64| {
            let half = n * PI * height / (2.0 * width);
            let sign = if (n as i64) % 4 == 1 { 1.0 } else { -1.0 };
            sign / n.powi(3) * (1.0 - libm::tanh(half) / half) * libm::cos(n * PI * y / width)
        };
        4.0 * width * width / PI.powi(3) * LEAN * G / self.viscosity * odd().map(term).sum::<f64>()
    }
}

fn odd() -> impl Iterator<Item = f64> {
    (0..100).map(|i| f64::from(2 * i + 1))
}

fn mean(all: &[f64; ACROSS]) -> f64 {
    all.iter().sum::<f64>() / ACROSS as f64
}

fn passage(form: f64, is_closed: bool, friction: Friction) -> Passage {
    Passage { long: 25, depth: ACROSS as f64 * CELL / form, is_closed, viscosity: VISCOSITY, friction }
}

/// The worst of all forms (%), and each.
fn off(ctx: &Context, is_closed: bool, friction: Friction) -> (f64, String) {
    let each = FORMS.map(|form| {
        let passage = passage(form, is_closed, friction);
        100.0 * (passage.steady(ctx) / passage.theory() - 1.0)
    });
    let notes: Vec<String> =
        FORMS.iter().zip(each).map(|(form, off)| format!("{form}:1 {off:+.2} %")).collect();
    (
        each.into_iter().map(f64::abs).fold(0.0, f64::max),
        format!("{}, {ACROSS} cells across", notes.join(", ")),
    )
}

/// Honey that begins to flow is steady at once; how long passages of it take to come to 99 %, in steps of 1 ms.
fn settles(ctx: &Context) -> (f64, String) {
    let (mut worst, mut notes) = (0.0f64, Vec::new());
    for (is_closed, name) in [(true, "a duct"), (false, "a channel")] {
        let all = Passage { viscosity: 0.04, ..passage(1.0, is_closed, Friction::Walls) }.run(ctx, 400);
        let last = all[380..].iter().map(mean).sum::<f64>() / 20.0;
        let steps = all.iter().position(|velocities| mean(velocities) > 0.99 * last).map_or(400, |at| at + 1);
        worst = worst.max(steps as f64);
        notes.push(format!("{name} 1:1: {steps}"));
    }
    (worst, format!("{}; 0.04 m2/s, steps of 1 ms", notes.join(", ")))
}

fn plot(ctx: &Context) {
    let mut plot = Plot::linear(
        "Passages of 8 x 8 cells: velocity over the height",
        "from the middle (mm)",
        "velocity (mm/s)",
    );
    for (is_closed, name) in [(true, "a closed duct"), (false, "an open channel")] {
        let own = passage(1.0, is_closed, Friction::Walls);
        let all = own.run(ctx, 600);
        let wide = 0.5 * ACROSS as f64 * CELL;
        let curve = even(-wide, wide, 80).map(|y| [1e3 * y, 1e3 * own.profile(y)]);
        let position = |z: usize| 1e3 * CELL * (z as f64 + 0.5 - 0.5 * ACROSS as f64);
        let points = all[599].iter().enumerate().map(|(z, u)| [position(z), 1e3 * u]);
        plot = plot.line(&format!("theory, {name}"), curve).points(&format!("pipes, {name}"), points);
    }
    plot.write("shallow_walls");
}

/// 1 mm of liquid on 200 x 200 cells of a rolling slope; where it is narrow, with a wall in every sixth row.
fn slope(friction: Friction, viscosity: f64, is_narrow: bool) -> Shallow {
    let row = |z: f64| (z / CELL).floor() as i64;
    let is_wall = |z: f64| is_narrow && row(z).rem_euclid(6) == 0;
    let solids = ground([200; 2], CELL, [-0.01, 0.1], |at @ [x, z]| {
        0.01 - 0.1 * x + 1e-4 * waves(at, CELL) + if is_wall(z) { 0.005 } else { 0.0 }
    });
    let params = Params { friction, kept: 0.5, pace: TimeStepping::Realtime(0.003), ..viscous(viscosity) };
    covered(&context(), &solids, params, |[_, z], _| if is_wall(z) { 0.0 } else { 1e-3 })
}

fn costs(h: &mut Harness) {
    let scenes = [
        ("shallow.walls_frame", 4e-6, false),
        ("shallow.walls_frame_narrow", 4e-6, true),
        ("shallow.walls_frame_thick", 1e-3, false),
    ];
    for (name, viscosity, is_narrow) in scenes {
        h.measure(name, || {
            let [own, ground] = [Friction::Walls, Friction::Ground]
                .map(|friction| Frames::of(&mut slope(friction, viscosity, is_narrow)).milliseconds());
            let level = cpu_level();
            (own, format!("{level:?} {viscosity} m2/s; {ground:.3} ms without, {:.2} x", own / ground))
        });
    }
}
