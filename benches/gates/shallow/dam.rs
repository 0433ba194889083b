//! What virtual pipes leave out: momentum that the flow carries along. A dam that breaks over shallow water, against Stoker (1957), and
//! against the equations that pipes do solve, H' + q_x = 0 and q' + g H H_x = 0.

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, dry, even, ground, pour, run_until, viscous};

/// Depths behind and before the dam (m).
const DEEP: f64 = 0.1;
const SHALLOW: f64 = 0.02;
const CELLS: usize = 1000;
const CELL: f64 = 2.0e-3;
const TIME: f64 = 0.6;

pub fn measure() -> [(f64, String); 2] {
    let ctx = context(0);
    let solids = ground([CELLS, 1], CELL, between(0.0, 0.2), |_| 0.0);
    let mut shallow = dry(&ctx, &solids, viscous(0.0));
    let dam = 0.5 * CELLS as f64 * CELL;
    pour(&mut shallow, |[x, _]| if x < dam { DEEP } else { SHALLOW });
    run_until(&mut shallow, &ctx, TIME, 1.0 / 60.0);
    let own: Vec<[f64; 2]> =
        (0..CELLS).map(|x| [(x as f64 + 0.5) * CELL - dam, depth(&shallow, [x, 0])]).collect();
    let (stoker, pipes) = (Break::new(true), Break::new(false));
    let half = 0.5 * (SHALLOW + pipes.depth);
    let front = own.iter().rev().find(|[_, depth]| *depth > half).expect("a front")[0];
    let plateau: Vec<f64> =
        own.iter().filter(|[x, _]| (0.3..0.7).contains(&(x / front))).map(|at| at[1]).collect();
    let middle = plateau.iter().sum::<f64>() / plateau.len() as f64;
    let off = |own: f64, theory: f64| 100.0 * (own / theory - 1.0);
    let note = |theory: f64| format!("off Stoker; off the pipes' own equations: {theory:.2} %");
    let line =
        |theory: &Break| theory.shape().map(|[speed, depth]| [speed * TIME, 1e3 * depth]).collect::<Vec<_>>();
    Plot::linear("A dam breaks over shallow water, after 0.6 s", "from the dam (m)", "depth (mm)")
        .line("theory (Stoker 1957)", line(&stoker))
        .line("theory without carried momentum", line(&pipes))
        .points("pipes", own.iter().step_by(8).map(|[x, depth]| [*x, 1e3 * depth]))
        .write("shallow_dam");
    let speed = front / TIME;
    [
        (off(speed, stoker.front), note(off(speed, pipes.front))),
        (off(middle, stoker.depth), note(off(middle, pipes.depth))),
    ]
}

/// A dam that has broken: waves that run up into the deep water, a plateau, and a step that runs over the shallow water.
struct Break {
    is_whole: bool,
    /// Depth of the plateau (m).
    depth: f64,
    /// Speed of the step (m/s).
    front: f64,
}

impl Break {
    /// With the momentum that is carried along, or without it.
    fn new(is_whole: bool) -> Self {
        let (mut low, mut high) = (SHALLOW, DEEP);
        for _ in 0..100 {
            let depth = 0.5 * (low + high);
            // The plateau's discharge behind the waves falls with its depth, that behind the step rises.
            if behind_waves(is_whole, depth) > behind_step(is_whole, depth) {
                low = depth
            } else {
                high = depth
            }
        }
        let discharge = behind_step(is_whole, low);
        Self { is_whole, depth: low, front: discharge / (low - SHALLOW) }
    }

    /// Depths (m) over x / t (m/s).
    fn shape(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let waves = even(DEEP, self.depth, 50);
        let speed = |depth: f64| {
            let along = if self.is_whole { 2.0 * (wave(DEEP) - wave(depth)) } else { 0.0 };
            along - wave(depth)
        };
        let step = [[self.front, self.depth], [self.front, SHALLOW], [1.2 * self.front, SHALLOW]];
        [[-1.2 * wave(DEEP), DEEP]]
            .into_iter()
            .chain(waves.map(move |depth| [speed(depth), depth]))
            .chain(step)
    }
}

/// The speed of waves (m/s).
fn wave(depth: f64) -> f64 {
    (G * depth).sqrt()
}

/// Discharge (m2/s) at a depth behind the waves.
fn behind_waves(is_whole: bool, depth: f64) -> f64 {
    if is_whole {
        2.0 * depth * (wave(DEEP) - wave(depth))
    } else {
        // dq = -(g H)^(1/2) dH.
        2.0 / 3.0 * (DEEP * wave(DEEP) - depth * wave(depth))
    }
}

/// Discharge (m2/s) at a depth behind the step: what it must be that mass and momentum are kept.
fn behind_step(is_whole: bool, depth: f64) -> f64 {
    let rise = depth - SHALLOW;
    if is_whole {
        rise * (0.5 * G * depth * (depth + SHALLOW) / SHALLOW).sqrt()
    } else {
        rise * (0.5 * G * (depth + SHALLOW)).sqrt()
    }
}
