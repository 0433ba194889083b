//! Gates of shallow's time and memory: thread CPU time on one core.

use frazil::numeric::cpu::cpu_level;
use frazil::shallow::material::Liquid;
use frazil::shallow::params::TimeStepping;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};
use rustix::time::{ClockId, clock_gettime};

use crate::common::shallow::{context, covered, floors, ground, waves};
use crate::harness::{Harness, median};

/// Seconds that this thread has worked.
pub fn thread_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Frames of 1/60 s that are timed as one.
const FRAMES: usize = 60;
const FRAME: f64 = 1.0 / 60.0;

/// Times and memory.
pub fn run(h: &mut Harness) {
    let cpu = format!("{:?}", cpu_level());
    type Make = fn() -> Shallow;
    let scenes: [(&str, Make, f64); 3] = [
        ("shallow.frame_one_floor", one_floor, 0.61),
        ("shallow.frame_five_floors", five_floors, 4.86),
        ("shallow.frame_three_floors", three_floors, 0.32),
    ];
    for (name, make, thesis) in scenes {
        h.measure(name, || {
            let frames = Frames::of(&mut make());
            let note = format!("{cpu} thesis={thesis} ms on a GTX 970; {}", frames.note());
            (frames.milliseconds(), note)
        });
    }
    let rated = |frames: Frames| (frames.rate(), format!("{cpu} {}", frames.note()));
    h.measure("shallow.rate_200", || rated(Frames::of(&mut waving(200, 1e-3))));
    h.measure("shallow.rate_4000", || rated(Frames::timed(&mut waving(4000, 1e-3), 1, |_| ())));
    h.measure("shallow.rate_scaled", || rated(drained()));
    h.measure("shallow.puddle", || {
        let [all, puddle] =
            [false, true].map(|is_puddle| Frames::timed(&mut basin(is_puddle), 3, |_| ()).milliseconds());
        (100.0 * puddle / all, format!("{cpu} {puddle:.3} of {all:.3} ms"))
    });
    h.measure("shallow.memory", || {
        let each = |liquid: Shallow| liquid.bytes() as f64 / liquid.columns().count() as f64;
        let [one, five] = [one_floor(), five_floors()].map(each);
        (one.max(five), format!("{one:.1} with one floor, {five:.1} with five"))
    });
}

/// Blood in steps of at most so many seconds.
fn blood(longest: f64) -> Params {
    Params { liquid: Liquid::BLOOD, pace: TimeStepping::Realtime(longest), ..Params::default() }
}

/// Like the thesis' Fig. 4.13: a rolling slope of 200 x 200 cells, 1 mm of blood on all of it.
pub fn one_floor() -> Shallow {
    let cell = 0.0005;
    let solids = ground([200; 2], cell, [-0.01, 0.1], |at @ [x, _]| 0.01 - 0.1 * x + 1e-4 * waves(at, cell));
    covered(&context(), &solids, blood(0.003), |_, _| 1e-3)
}

/// Floors a centimetre apart, each of which rolls and, with holes, is open in the middle.
pub fn stacked(edge: usize, cell: f64, count: usize, holes: bool) -> Solids {
    let half = 0.5 * edge as f64 * cell;
    floors([edge; 2], cell, [-0.01, 0.1], count, |at @ [x, z], floor| {
        let top = 0.01 * floor as f64 + 1e-4 * waves(at, cell);
        let shift = 0.3 * half * if floor % 2 == 0 { -1.0 } else { 1.0 };
        let in_hole = holes && floor > 0 && (x - shift).abs().max(z.abs()) < 0.1 * half;
        (!in_hole).then_some([top - 1e-3, top])
    })
}

/// 1 mm of blood with waves on all floors.
pub fn on_floors(solids: &Solids, longest: f64) -> Shallow {
    let cell = solids.grid.cell;
    covered(&context(), solids, blood(longest), |[x, z], _| 1e-3 + 1e-4 * waves([2.0 * z, 2.0 * x], cell))
}

/// As large as the thesis' surgery (Fig. 4.1).
pub fn five_floors() -> Shallow {
    on_floors(&stacked(200, 0.0005, 5, false), 0.003)
}

/// As large as the thesis' three layers (Fig. 4.15).
pub fn three_floors() -> Shallow {
    on_floors(&stacked(100, 0.001, 3, false), 0.009)
}

/// Water with waves on ground that rolls.
pub fn waving(edge: usize, depth: f64) -> Shallow {
    let cell = 0.0005;
    let solids = ground([edge; 2], cell, [-0.01, 0.1], |at| 1e-4 * waves(at, cell));
    covered(&context(), &solids, blood(0.003), |[x, z], _| depth + 1e-4 * waves([2.0 * z, 2.0 * x], cell))
}

/// A pit of a tenth of the edge in the middle of 1,000 x 1,000 cells, with liquid in the pit, or everywhere.
fn basin(is_puddle: bool) -> Shallow {
    let (edge, cell) = (1000, 0.0005);
    let is_inside = move |[x, z]: [f64; 2]| x.abs().max(z.abs()) < 0.05 * edge as f64 * cell;
    let height = |at| if is_inside(at) { 0.0 } else { 5e-3 } + 1e-4 * waves(at, cell);
    let solids = ground([edge; 2], cell, [-0.01, 0.1], height);
    covered(&context(), &solids, blood(0.003), |at @ [x, z], _| {
        let depth = 1e-3 + 1e-4 * waves([2.0 * z, 2.0 * x], cell);
        if is_inside(at) || !is_puddle { depth } else { 0.0 }
    })
}

/// A film on a steep slope that loses more in a step than it has: it is made up for after each frame.
fn drained() -> Frames {
    let (cell, depth) = (0.0005, 2e-5);
    let solids = ground([200; 2], cell, [-0.01, 0.1], |[x, _]| 0.03 - 0.5 * x);
    let params = Params { liquid: Liquid::new(0.0), ..blood(0.003) };
    let mut liquid = covered(&context(), &solids, params, |_, _| depth);
    let unit = solids.heights.unit;
    Frames::timed(&mut liquid, FRAMES, |liquid| {
        for index in 0..liquid.columns().len() {
            if liquid.columns().is_column(index) {
                let missing = depth - unit * f64::from(liquid.depths()[index]);
                liquid.pour(index, missing);
            }
        }
    })
}

/// Frames that were timed.
pub struct Frames {
    /// Seconds of each frame, and its steps.
    times: Vec<(f64, u32)>,
    columns: usize,
    /// Columns with liquid, and with a flux, at the end.
    wet: usize,
    flows: usize,
    /// Rows scaled by K_min and by K_max, of all.
    emptied: f64,
    filled: f64,
    together: usize,
}

impl Frames {
    /// Frames of a liquid, after half a second to warm up.
    pub fn of(liquid: &mut Shallow) -> Self {
        Self::timed(liquid, FRAMES, |_| ())
    }

    /// Five times so many frames; `between` is called after each and not timed.
    pub fn timed(liquid: &mut Shallow, together: usize, mut between: impl FnMut(&mut Shallow)) -> Self {
        let ctx = context();
        let mut times = Vec::new();
        let (mut emptied, mut filled, mut rows) = (0, 0, 0);
        for frame in 0..together.min(30) + 5 * together {
            let start = thread_seconds();
            let report = liquid.step(&ctx, FRAME).expect("a frame");
            let seconds = thread_seconds() - start;
            between(liquid);
            if frame >= together.min(30) {
                times.push((seconds, report.steps));
                emptied += report.emptied;
                filled += report.filled;
                rows += u64::from(report.steps) * liquid.columns().grid.size[1] as u64;
            }
        }
        let columns = liquid.columns();
        let [east, south] = liquid.fluxes();
        let is_wet = |index: &usize| liquid.depths()[*index] > 0;
        let moves = |index: &usize| east[*index] != 0.0 || south[*index] != 0.0;
        Self {
            times,
            columns: columns.count(),
            wet: columns.indices().filter(is_wet).count(),
            flows: columns.indices().filter(moves).count(),
            emptied: emptied as f64 / rows as f64,
            filled: filled as f64 / rows as f64,
            together,
        }
    }

    /// Median over the five of what a frame takes on average (ms).
    pub fn milliseconds(&self) -> f64 {
        let mean =
            |frames: &[(f64, u32)]| frames.iter().map(|frame| frame.0).sum::<f64>() / frames.len() as f64;
        1e3 * median(self.times.chunks(self.together).map(mean).collect())
    }

    /// What the longest frame takes (ms).
    pub fn worst(&self) -> f64 {
        1e3 * self.times.iter().map(|frame| frame.0).fold(0.0, f64::max)
    }

    /// Median over the five of columns times steps a second (millions).
    pub fn rate(&self) -> f64 {
        let rate = |frames: &[(f64, u32)]| {
            let [seconds, steps] = [0, 1].map(|which| {
                frames.iter().map(|frame| if which == 0 { frame.0 } else { f64::from(frame.1) }).sum::<f64>()
            });
            1e-6 * self.columns as f64 * steps / seconds
        };
        median(self.times.chunks(self.together).map(rate).collect())
    }

    /// How many columns are wet and move, and how much is scaled.
    pub fn note(&self) -> String {
        let [wet, flows] = [self.wet, self.flows].map(|count| 100.0 * count as f64 / self.columns as f64);
        format!(
            "{} columns, {wet:.1} % wet, {flows:.1} % move; {:.1} M/s; worst {:.3} ms; rows scaled by K_min {:.0} %, K_max \
             {:.0} %",
            self.columns,
            self.rate(),
            self.worst(),
            100.0 * self.emptied,
            100.0 * self.filled
        )
    }
}
