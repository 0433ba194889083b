//! How long a run still takes, from the frames of each stage that are done.

use std::time::{Duration, Instant};

/// What a frame of a stage takes in comparison with the base layer's, until the stage's own frames tell: measured on a character that walks
/// through deep snow. The stages of other systems are alone in their runs.
const COSTS: [(&str, f64); 5] =
    [("base", 1.0), ("grains", 5.0), ("mist", 30.0), ("volumes", 3.0), ("objects", 0.1)];

/// The frames of a run that are still to be made, and the times that others took.
pub struct Remaining {
    stages: Vec<Frames>,
    /// When a frame was last finished, of any stage.
    last: Instant,
}

/// Frames of a stage.
struct Frames {
    stage: &'static str,
    to_make: usize,
    /// Seconds that each finished frame took, in their order.
    took: Vec<f64>,
    /// When the last of them was finished.
    last: Option<Instant>,
}

impl Frames {
    fn left(&self) -> usize {
        self.to_make.saturating_sub(self.took.len())
    }

    fn cost(&self) -> f64 {
        COSTS.iter().find(|(stage, _)| *stage == self.stage).map_or(1.0, |(_, cost)| *cost)
    }

    /// Seconds of a coming frame: the mean of the later half of those done, as frames become dearer while snow and liquid gather.
    fn of_frame(&self) -> Option<f64> {
        let later = &self.took[self.took.len() / 2..];
        (!later.is_empty()).then(|| later.iter().sum::<f64>() / later.len() as f64)
    }
}

impl Remaining {
    /// A run that begins now, with the stages' counts of frames.
    pub fn of(to_make: &[(&'static str, usize)], now: Instant) -> Self {
        let frames = |&(stage, to_make): &(&'static str, usize)| Frames {
            stage,
            to_make,
            took: Vec::new(),
            last: None,
        };
        Self { stages: to_make.iter().map(frames).collect(), last: now }
    }

    /// Count of all frames of the run.
    pub fn total(&self) -> usize {
        self.stages.iter().map(|frames| frames.to_make).sum()
    }

    /// A frame of a stage is finished.
    pub fn finished(&mut self, stage: &str, now: Instant) {
        let Some(frames) = self.stages.iter_mut().find(|frames| frames.stage == stage) else { return };
        // The first frame of a stage begins when the stage before it ends.
        let begun = frames.last.unwrap_or(self.last);
        frames.took.push(now.saturating_duration_since(begun).as_secs_f64());
        frames.last = Some(now);
        self.last = now;
    }

    /// The time that the frames that are left will take; zero before any is done.
    pub fn time(&self) -> Duration {
        let spent: f64 = self.stages.iter().flat_map(|frames| &frames.took).sum();
        let cost: f64 = self.stages.iter().map(|frames| frames.cost() * frames.took.len() as f64).sum();
        let unit = if cost > 0.0 { spent / cost } else { 0.0 };
        let seconds = |frames: &Frames| {
            frames.left() as f64 * frames.of_frame().unwrap_or_else(|| frames.cost() * unit)
        };
        Duration::from_secs_f64(self.stages.iter().map(seconds).sum::<f64>().min(1.0e12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest factor by which the forecast is wrong from a fifth of a run on, whose stages have frames of these seconds.
    fn worst(stages: &[(&'static str, Vec<f64>)]) -> f64 {
        let start = Instant::now();
        let counts: Vec<(&'static str, usize)> =
            stages.iter().map(|(stage, seconds)| (*stage, seconds.len())).collect();
        let mut remaining = Remaining::of(&counts, start);
        let total: f64 = stages.iter().flat_map(|(_, seconds)| seconds).sum();
        let (mut at, mut worst) = (0.0, 1.0_f64);
        for (stage, seconds) in stages {
            for seconds in seconds {
                at += seconds;
                remaining.finished(stage, start + Duration::from_secs_f64(at));
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
        assert!(worst(&[("liquid", vec![0.5; 40])]) < 1.01);
        // A stage whose frames take fifty times as long as those of the stage before it.
        assert!(worst(&[("base", vec![0.1; 40]), ("grains", vec![5.0; 40])]) < 1.1);
        // Frames that take longer and longer.
        let growing =
            |stage, first: f64| (stage, (0..72).map(|n| first * (1.0 + 3.0 * f64::from(n) / 72.0)).collect());
        let shot = [("base", vec![0.09; 72]), growing("grains", 0.15), growing("mist", 1.4)];
        let worst = worst(&shot);
        assert!(worst < 2.0, "{worst}");
    }

    #[test]
    fn nothing_is_known_before_a_frame_is_done_and_nothing_left_at_the_end() {
        let start = Instant::now();
        let mut remaining = Remaining::of(&[("base", 1), ("mist", 0)], start);
        assert_eq!((remaining.total(), remaining.time()), (1, Duration::ZERO));
        remaining.finished("base", start + Duration::from_secs(2));
        assert_eq!(remaining.time(), Duration::ZERO);
    }
}
