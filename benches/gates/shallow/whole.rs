//! Gates of a whole frame of shallow: what flows, what falls, and the surface and the drops in the caller's buffers; thread CPU time on one core.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::columns::Columns;
use frazil::shallow::free_fall::mesh::Balls;
use frazil::shallow::free_fall::{Droplet, Falls};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::{Depths, Layout, Surface};
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};

use crate::common::shallow::{context, covered, ground, waves};
use crate::harness::{Harness, median};
use crate::shallow::buffers::Buffers;
use crate::shallow::speed::{stacked, thread_seconds};

const FRAME: f64 = 1.0 / 60.0;
/// Frames that are timed, and those before.
const FRAMES: usize = 300;
const BEFORE: usize = 30;
/// Depth of the liquid at first (m).
const DEPTH: f64 = 1e-3;

/// All of them.
pub fn run(h: &mut Harness) {
    // The thesis' times on a GTX 970: simulation and mesh, without the drawing.
    type Make = fn() -> Shallow;
    let scenes: [(&str, Make, f64); 3] = [
        ("shallow.whole_one_floor", ledge, 1.04),
        ("shallow.whole_five_floors", || falling(&stacked(200, 0.0005, 5, true), 0.003), 5.96),
        ("shallow.whole_three_floors", || falling(&stacked(100, 0.001, 3, true), 0.009), 0.69),
    ];
    for (name, make, thesis) in scenes {
        h.measure(name, || {
            let (time, note) = timed(&mut make());
            (time, format!("{:?} thesis={thesis} ms on a GTX 970; {note}", cpu_level()))
        });
    }
}

/// A rolling slope with a ledge of 2 cm across its middle.
fn ledge() -> Shallow {
    let cell = 0.0005;
    let height = |at @ [x, _]: [f64; 2]| if x < 0.0 { 0.04 } else { 0.02 } - 0.1 * x + 1e-4 * waves(at, cell);
    falling(&ground([200; 2], cell, [-0.01, 0.1], height), 0.003)
}

/// Blood on all columns, in steps of at most so many seconds, that falls from 5 mm on.
fn falling(solids: &Solids, longest: f64) -> Shallow {
    let falls = Some(Falls { height: 0.005, ..Falls::default() });
    let pace = TimeStepping::Realtime(longest);
    let params = Params { liquid: Liquid::BLOOD, pace, falls, ..Params::default() };
    covered(&context(), solids, params, |_, _| DEPTH)
}

/// What a host draws, in its buffers.
struct Drawn {
    surface: Surface,
    balls: Balls,
    drops: Vec<Droplet>,
    buffers: Buffers,
    layout: Layout,
}

impl Drawn {
    fn new(columns: &Columns, most: usize) -> Self {
        let (mut surface, mut balls) = (Surface::default(), Balls::default());
        surface.reserve(columns);
        balls.reserve(most);
        let layout = Layout { fade_depth: 0.02 * columns.grid.cell, ..Layout::default() };
        let buffers = Buffers::new(columns, &Ledges::default(), most);
        Self { surface, balls, drops: Vec::with_capacity(most), buffers, layout }
    }

    /// Writes the surface, and then the drops; returns the count of drops.
    fn draw(&mut self, liquid: &Shallow) -> usize {
        let Self { surface, balls, drops, buffers, layout } = self;
        let depths = Depths { depth: liquid.depths(), active: Some(liquid.active()), ..Depths::default() };
        surface.build(liquid.columns(), &depths, layout, &mut buffers.drawn()).expect("a surface");
        drops.clear();
        drops.extend(liquid.drops());
        balls.build(drops, layout, &mut buffers.drops()).expect("drops");
        drops.len()
    }
}

/// Mean time of a frame (ms), the median of five times sixty, and what it consists of.
fn timed(liquid: &mut Shallow) -> (f64, String) {
    let ctx = context();
    let most = liquid.params().falls.map_or(0, |falls| falls.max_packets);
    let mut drawn = Drawn::new(liquid.columns(), most);
    let (mut flows, mut draws, mut drops) = (Vec::new(), Vec::new(), 0);
    for frame in 0..BEFORE + FRAMES {
        let start = thread_seconds();
        liquid.step(&ctx, FRAME).expect("a frame");
        let flown = thread_seconds();
        let count = drawn.draw(liquid);
        if frame >= BEFORE {
            flows.push(1e3 * (flown - start));
            draws.push(1e3 * (thread_seconds() - flown));
            drops += count;
        }
    }
    assert_eq!(liquid.balance().error, 0);
    let mean = |times: &[f64]| {
        median(times.chunks(FRAMES / 5).map(|times| times.iter().sum::<f64>() / times.len() as f64).collect())
    };
    let (flow, draw) = (mean(&flows), mean(&draws));
    let worst = flows.iter().zip(&draws).map(|(flow, draw)| flow + draw).fold(0.0, f64::max);
    let note = format!(
        "{flow:.3} ms flows and falls, {draw:.3} ms surface and drops, worst {worst:.3} ms; {} drops on average",
        drops / FRAMES
    );
    (flow + draw, note)
}
