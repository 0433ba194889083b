//! Gates of a passage that is flooded up to its ceiling: two legs that it joins below swing with a period of 2 pi (A_leg L / (2 g A_passage))^(1/2), as
//! only the liquid in the passage has inertia (that of a leg moves up and down, and pipes know no such motion), and come to one level.

use std::f64::consts::TAU;

use frazil::Context;
use frazil::shallow::columns::grid::BOTTOMLESS;
use frazil::shallow::material::Liquid;
use frazil::shallow::{Params, Shallow};

use crate::common::shallow::context;
use crate::harness::Harness;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, depth, even, swing, terrain, viscous};

/// Edge of a cell, height of the passage, and how high the legs stand (m).
const CELL: f64 = 0.005;
const HIGH: f64 = 0.01;
const LEVEL: f64 = 0.05;
/// Periods, and frames in each.
const PERIODS: usize = 6;
const FRAMES: usize = 200;

/// Two legs of one cell, and the passage between them: so many cells along x, then so many along z.
#[derive(Clone, Copy)]
struct Tube {
    along: [usize; 2],
}

const TUBES: [(&str, Tube); 3] = [
    ("12 cells", Tube { along: [13, 0] }),
    ("40 cells", Tube { along: [41, 0] }),
    ("a bend, 24 cells", Tube { along: [13, 12] }),
];

/// Both gates.
pub fn run(h: &mut Harness) {
    h.measure("shallow.flooded_period", period);
    h.measure("shallow.flooded_levels", levels);
}

impl Tube {
    /// From one leg's middle to the other's (m).
    fn length(self) -> f64 {
        CELL * (self.along[0] + self.along[1]) as f64
    }

    /// The cells of both legs.
    fn legs(self) -> [[usize; 2]; 2] {
        [[0, 0], self.along]
    }

    /// The period of theory (s): A_leg is a cell's, A_passage CELL x HIGH.
    fn period(self) -> f64 {
        TAU * (CELL * self.length() / (2.0 * G * HIGH)).sqrt()
    }

    /// Legs that stand `apart` (m) from each other around [`LEVEL`], and the passage full.
    fn filled(self, ctx: &Context, apart: f64, params: Params) -> Shallow {
        let legs = self.legs();
        let heights = between(-0.01, 0.3);
        let size = self.along.map(|count| count + 1);
        let is_passage = |[x, z]: [usize; 2]| z == 0 || x == self.along[0];
        let solids = terrain(size, CELL, heights, |cell| {
            let floor = [BOTTOMLESS, heights.round(0.0)];
            match (legs.contains(&cell), is_passage(cell)) {
                (true, _) => vec![floor],
                (_, true) => vec![floor, [heights.round(HIGH), heights.round(0.25)]],
                _ => vec![[BOTTOMLESS, heights.round(0.25)]],
            }
        });
        let mut tube = Shallow::new(ctx, &solids, params).expect("a tube");
        for cell in (0..size[0] * size[1]).map(|index| [index % size[0], index / size[0]]) {
            let depth = match legs.iter().position(|leg| *leg == cell) {
                Some(0) => LEVEL + 0.5 * apart,
                Some(_) => LEVEL - 0.5 * apart,
                None if is_passage(cell) => HIGH,
                None => 0.0,
            };
            let column = tube.columns().column(cell, 0).expect("ground everywhere");
            tube.pour(column, depth);
        }
        tube
    }

    /// The level of the first leg over that of the other one (m).
    fn apart(self, tube: &Shallow) -> f64 {
        let [one, other] = self.legs().map(|leg| depth(tube, leg));
        one - other
    }
}

/// A swing without friction.
fn period() -> (f64, String) {
    let ctx = context();
    let apart = 0.001;
    let (mut worst, mut notes): (f64, Vec<String>) = (0.0, Vec::new());
    let theory = even(0.0, 6.0, 600).map(|t| [t, 1e3 * apart * libm::cos(TAU * t)]);
    let mut plot = Plot::linear(
        "Swing of two legs through a flooded passage",
        "time (periods of theory)",
        "difference of levels (mm)",
    )
    .line("theory", theory);
    for (which, (name, tube)) in TUBES.into_iter().enumerate() {
        let mut liquid = tube.filled(&ctx, apart, viscous(0.0));
        let period = tube.period();
        let dt = period / FRAMES as f64;
        let (swing, own) = swing(&mut liquid, &ctx, dt, PERIODS * FRAMES, |liquid| tube.apart(liquid));
        let off = 100.0 * (own / period - 1.0);
        let last = swing[(PERIODS - 1) * FRAMES..].iter().map(|position| position[1]).fold(0.0, f64::max);
        worst = worst.max(off.abs());
        notes.push(format!("{name}: {off:+.3} %, the last swing is {:.3} of the first", last / apart));
        // Points beside those of the other tubes.
        let shown = swing.iter().skip(which * FRAMES / 30).step_by(FRAMES / 10);
        plot = plot.points(name, shown.map(|[time, y]| [time / period, 1e3 * y]));
    }
    plot.write("shallow_flooded");
    (worst, notes.join("; "))
}

/// Where legs come to rest, against the level at which all liquid is there and the passage is full; over how far they were apart.
fn levels() -> (f64, String) {
    let ctx = context();
    let apart = 0.02;
    let (mut worst, mut notes): (f64, Vec<String>) = (0.0, Vec::new());
    for (name, tube) in TUBES {
        let params = Params { kept: 0.01, liquid: Liquid::WATER, ..viscous(0.0) };
        let mut liquid = tube.filled(&ctx, apart, params);
        (0..40).for_each(|_| {
            liquid.step(&ctx, 1.0).expect("a frame");
        });
        let off = tube.legs().map(|leg| (depth(&liquid, leg) - LEVEL) / apart);
        worst = worst.max(off[0].abs()).max(off[1].abs());
        notes.push(format!("{name}: {:+.1e}, {:+.1e}", off[0], off[1]));
    }
    let unit = between(-0.01, 0.3).unit / apart;
    (worst, format!("{}; a unit is {unit:.1e}", notes.join("; ")))
}
