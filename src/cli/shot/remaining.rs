//! Estimates the time that a run still takes, from the times of finished frames and the expected costs of all frames.

use std::time::{Duration, Instant};

use frazil::scene::run::{FrameCosts, Pace, ToMake};

/// Share of a stage's cost whose frames count as done in the expected time when it begins, and less and less later: its first frames alone
/// tell little.
const PRIOR: f64 = 0.05;
/// A frame that takes less than this share of the expected time had nothing to do.
const NOTHING: f64 = 0.03;
/// Steps that wait for files for more than this share of their time are as fast as these are written.
const WAITING: f64 = 0.05;

/// The frames of a run that are still to be made, and the times that others took.
pub struct Remaining {
    stages: Vec<Stage>,
    begun: Instant,
    /// When a frame was last finished.
    last: Instant,
}

/// The frames of a stage.
struct Stage {
    name: &'static str,
    /// What each frame is expected to cost (s).
    costs: Vec<f64>,
    /// How each finished frame was made.
    paces: Vec<Pace>,
}

impl Stage {
    /// The cost of all frames.
    fn total(&self) -> f64 {
        self.costs.iter().sum()
    }

    /// The cost of the finished frames.
    fn done(&self) -> f64 {
        self.costs[..self.paces.len()].iter().sum()
    }

    /// The cost of the frames that are left. Those that are computed count only if files are written more slowly than frames are computed.
    fn left(&self) -> f64 {
        let recent = &self.paces[self.recent()..];
        let of = |part: fn(&Pace) -> Duration| recent.iter().map(part).sum::<Duration>().as_secs_f64();
        let waits_for_files = of(|pace| pace.waited) > WAITING * of(|pace| pace.took);
        let ahead = self.paces.last().map_or(0, |pace| pace.ahead);
        let done = self.paces.len() + if waits_for_files { 0 } else { ahead };
        self.costs[done..].iter().sum()
    }

    /// Index of the first of the later half of the finished frames: what is not expected changes slowly.
    fn recent(&self) -> usize {
        self.paces.len() / 2
    }

    /// Time (s) and cost of the finished frames from an index on, if a unit of cost takes about `expected`. Where there was nothing to do, as in
    /// mist before there is some, a frame tells nothing of the others and is left out.
    fn measured(&self, from: usize, expected: f64) -> [f64; 2] {
        let frames = self.paces.iter().zip(&self.costs).skip(from);
        let all = frames.map(|(pace, cost)| [pace.took.as_secs_f64(), *cost]);
        all.filter(|[took, cost]| *took >= NOTHING * cost * expected).fold([0.0; 2], sum)
    }

    /// The time that a unit of cost takes in this stage, if it takes `expected` in the run as a whole.
    fn unit(&self, expected: f64) -> f64 {
        let prior = PRIOR * (self.total() - self.done());
        let [took, cost] = sum([prior * expected, prior], self.measured(self.recent(), expected));
        took / cost
    }

    fn is_begun(&self) -> bool {
        !self.paces.is_empty()
    }
}

/// The sums of times and of costs.
fn sum(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

impl Remaining {
    /// A run that begins now.
    pub fn of(to_make: &[ToMake], costs: &FrameCosts, now: Instant) -> Self {
        let stage = |to_make: &ToMake| Stage {
            name: to_make.stage,
            costs: to_make.frames.iter().map(|frames| costs.sum(to_make.stage, frames.clone())).collect(),
            paces: Vec::new(),
        };
        Self { stages: to_make.iter().map(stage).collect(), begun: now, last: now }
    }

    /// Count of all frames of the run.
    pub fn total(&self) -> usize {
        self.stages.iter().map(|stage| stage.costs.len()).sum()
    }

    /// A frame of a stage is finished.
    pub fn finished(&mut self, stage: &str, pace: Pace, now: Instant) {
        let Some(stage) = self.stages.iter_mut().find(|known| known.name == stage) else { return };
        stage.paces.push(pace);
        self.last = now;
    }

    /// The time that the frames that are left will take; zero before any is done.
    pub fn time(&self) -> Duration {
        let Some(unit) = self.unit() else { return Duration::ZERO };
        let (begun, others): (Vec<&Stage>, Vec<&Stage>) =
            self.stages.iter().partition(|stage| stage.is_begun());
        let running: Vec<f64> =
            begun.iter().map(|stage| stage.left() * stage.unit(unit)).filter(|left| *left > 0.0).collect();
        // Stages that run at the same time slow each other down: the longest takes as long as it seems if the others use little, and as long as the
        // mean if all use every thread.
        let longest = running.iter().copied().fold(0.0, f64::max);
        let mean = running.iter().sum::<f64>() / running.len().max(1) as f64;
        let to_begin: f64 = others.iter().map(|stage| stage.total() * unit).sum();
        Duration::from_secs_f64((0.5 * (longest + mean) + to_begin).min(1.0e12))
    }

    /// The time that a unit of cost takes in the run as a whole; `None` before a frame is done.
    fn unit(&self) -> Option<f64> {
        let measured = |expected: f64| {
            let [took, cost] =
                self.stages.iter().map(|stage| stage.measured(0, expected)).fold([0.0; 2], sum);
            // Without the time in which files were read before the first frame.
            let took = took.min((self.last - self.begun).as_secs_f64());
            (cost > 0.0).then(|| took / cost)
        };
        measured(measured(0.0)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The frames of a stage of a run: what each is expected to cost, and how long it takes (s).
    type Shot = (&'static str, Vec<[f64; 2]>);

    fn remaining(shot: &[Shot], now: Instant) -> Remaining {
        let mut costs = FrameCosts::new(1);
        shot.iter()
            .for_each(|(stage, frames)| costs.add(stage, frames.iter().map(|[cost, _]| *cost).collect()));
        let to_make = |(stage, frames): &Shot| ToMake {
            stage,
            frames: (1..=frames.len() as i32).map(|frame| frame..=frame).collect(),
        };
        Remaining::of(&shot.iter().map(to_make).collect::<Vec<_>>(), &costs, now)
    }

    fn pace(took: f64) -> Pace {
        Pace { took: Duration::from_secs_f64(took), ..Pace::default() }
    }

    /// The largest factor by which the forecast is wrong from a fifth of a run on.
    fn worst(shot: &[Shot]) -> f64 {
        let start = Instant::now();
        let mut remaining = remaining(shot, start);
        let total: f64 = shot.iter().flat_map(|(_, frames)| frames).map(|[_, took]| took).sum();
        let (mut at, mut worst) = (0.0, 1.0_f64);
        for (stage, frames) in shot {
            for [_, took] in frames {
                at += took;
                remaining.finished(stage, pace(*took), start + Duration::from_secs_f64(at));
                let (left, forecast) = (total - at, remaining.time().as_secs_f64());
                // The last frames are over before anyone asks.
                if at > 0.2 * total && left > 0.05 * total {
                    worst = worst.max(left / forecast).max(forecast / left);
                }
            }
        }
        worst
    }

    #[test]
    fn each_stage_counts_by_its_own_frames() {
        assert!(worst(&[("liquid", vec![[1.0, 0.5]; 40])]) < 1.01);
        // A stage whose frames take fifty times as long as those of the stage before it, on a computer that is half as fast as expected.
        let of = |cost: f64, took: f64| vec![[cost, took]; 40];
        assert!(worst(&[("base", of(0.05, 0.1)), ("grains", of(2.5, 5.0))]) < 1.1);
        // One that takes half as long again as expected, in comparison with the others.
        assert!(worst(&[("base", of(0.1, 0.1)), ("grains", of(1.0, 1.0)), ("mist", of(2.0, 3.0))]) < 1.51);
        // One with nothing to do at first, which was not expected.
        let late = (0..40).map(|n| [1.0, if n < 12 { 0.001 } else { 1.0 }]).collect();
        assert!(worst(&[("grains", of(0.5, 0.5)), ("mist", late)]) < 1.5);
        // Frames that take longer and longer, as expected.
        let growing = |first: f64| (0..72).map(|n| [first * (1.0 + 3.0 * f64::from(n) / 72.0); 2]).collect();
        let worst = worst(&[("base", of(0.09, 0.09)), ("grains", growing(0.15)), ("mist", growing(1.4))]);
        assert!(worst < 1.01, "{worst}");
    }

    #[test]
    fn frames_that_wait_for_their_files_count_if_these_are_slow() {
        let start = Instant::now();
        let [left, left_for_files] = [0.0, 0.5].map(|waited| {
            let mut remaining = remaining(&[("surface", vec![[1.0, 1.0]; 8])], start);
            for at in 1..=4 {
                let pace = Pace { waited: Duration::from_secs_f64(waited), ahead: 2, ..pace(1.0) };
                remaining.finished("surface", pace, start + Duration::from_secs(at));
            }
            remaining.time()
        });
        assert_eq!([left, left_for_files], [2, 4].map(Duration::from_secs));
    }

    #[test]
    fn stages_at_once_do_not_take_as_long_as_one_after_the_other() {
        let start = Instant::now();
        let shot = ["grains", "volumes"].map(|stage| (stage, vec![[1.0, 2.0]; 10]));
        let mut remaining = remaining(&shot, start);
        for stage in ["grains", "volumes"] {
            remaining.finished(stage, pace(2.0), start + Duration::from_secs(2));
        }
        let left = remaining.time().as_secs_f64();
        assert!((9.0..=18.0).contains(&left), "{left}");
    }

    #[test]
    fn nothing_is_known_before_a_frame_is_done_and_nothing_left_at_the_end() {
        let start = Instant::now();
        let mut remaining = remaining(&[("base", vec![[1.0, 2.0]])], start);
        assert_eq!((remaining.total(), remaining.time()), (1, Duration::ZERO));
        remaining.finished("base", pace(2.0), start + Duration::from_secs(2));
        assert_eq!(remaining.time(), Duration::ZERO);
    }
}
