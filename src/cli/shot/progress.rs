//! Progress of a shot on stderr: a bar on a terminal, otherwise one line per frame, as text or as JSON.

use frazil::Context;
use frazil::scene::run::Pace;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::remaining::Remaining;

/// Length of the bar: what a whole run takes.
const LENGTH: u64 = 1000;

/// Shows which frame was finished and the expected end; on a terminal also a bar that moves within frames.
pub struct FrameProgress<'a> {
    ctx: &'a Context,
    bar: Option<ProgressBar>,
    /// How lines are printed, if they are.
    lines: Option<ProgressFormat>,
    remaining: Remaining,
    /// Number of finished frames.
    done: usize,
    clock: Arc<RunClock>,
}

/// The part of its time that a run has taken.
struct RunClock {
    start: Instant,
    /// The time that it is expected to take, once that is known.
    expected: Mutex<Option<Duration>>,
}

impl RunClock {
    fn start() -> Self {
        Self { start: Instant::now(), expected: Mutex::new(None) }
    }

    /// So much time is left.
    fn expect(&self, left: Duration) {
        *self.expected.lock().expect("no panic holds this lock") = Some(self.start.elapsed() + left);
    }

    /// From 0 to 1; 0 while nothing is known.
    fn fraction(&self) -> f64 {
        let expected = *self.expected.lock().expect("no panic holds this lock");
        let spent = self.start.elapsed().as_secs_f64();
        expected.map_or(0.0, |expected| (spent / expected.as_secs_f64().max(1e-9)).min(1.0))
    }
}

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ProgressFormat {
    /// A bar, or a line for each frame.
    Text,
    /// A line of JSON for each frame: stage, frame, fraction (of the time), seconds_left.
    Json,
}

impl ProgressFormat {
    /// Nothing if nothing is to be shown.
    pub fn unless(self, is_quiet: bool) -> Option<Self> {
        (!is_quiet).then_some(self)
    }
}

impl<'a> FrameProgress<'a> {
    /// Starts the display of frames to be made by steps on `ctx`, in addition to `existing` ones.
    pub fn new(
        ctx: &'a Context,
        remaining: Remaining,
        existing: usize,
        format: Option<ProgressFormat>,
    ) -> Self {
        let total = remaining.total();
        if existing > 0 && format == Some(ProgressFormat::Text) {
            // Progress is optional: a closed stderr does not stop the run.
            let _ = writeln!(std::io::stderr(), "{existing} frames exist, {total} are to be made");
        }
        let has_bar = std::io::stderr().is_terminal() && format == Some(ProgressFormat::Text);
        let clock = Arc::new(RunClock::start());
        let bar = has_bar.then(|| {
            let bar = ProgressBar::with_draw_target(Some(LENGTH), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{prefix} [{bar:40}] {percent}% {msg}");
            bar.set_style(style.expect("a fixed template").progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(250));
            ctx.set_poll(Some(bar_poll(bar.clone(), clock.clone())));
            bar
        });
        Self { ctx, bar, lines: format.filter(|_| !has_bar), remaining, done: 0, clock }
    }

    /// The files of a frame are written.
    pub fn finished(&mut self, stage: &str, frame: i32, pace: Pace) {
        self.remaining.finished(stage, pace, Instant::now());
        self.done += 1;
        let left = self.remaining.time();
        self.clock.expect(left);
        if let Some(bar) = &self.bar {
            bar.set_prefix(format!("frame {frame} stage {stage} {}/{}", self.done, self.remaining.total()));
            bar.set_message(format!("eta {}", clock(left)));
            advance(bar, &self.clock);
        }
        let fraction = self.clock.fraction();
        let line = match self.lines {
            Some(ProgressFormat::Text) => {
                format!("frame {frame} stage {stage} {:.0}% eta {}", (100.0 * fraction).floor(), clock(left))
            }
            Some(ProgressFormat::Json) => {
                let left = left.as_secs_f64();
                json!({ "stage": stage, "frame": frame, "fraction": fraction, "seconds_left": left })
                    .to_string()
            }
            None => return,
        };
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}

impl Drop for FrameProgress<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            self.ctx.set_poll(None);
            bar.finish_and_clear();
        }
    }
}

/// A poll that moves the bar within frames.
fn bar_poll(bar: ProgressBar, clock: Arc<RunClock>) -> frazil::context::Poll {
    Box::new(move |_| {
        advance(&bar, &clock);
        false
    })
}

/// Moves the bar; never backwards, though a forecast may grow.
fn advance(bar: &ProgressBar, clock: &RunClock) {
    let position = (clock.fraction() * LENGTH as f64) as u64;
    bar.set_position(position.max(bar.position()));
}

/// A time as `hh:mm:ss`.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use frazil::Pool;

    #[test]
    fn the_time_left_is_hours_minutes_seconds() {
        assert_eq!(clock(Duration::ZERO), "00:00:00");
        assert_eq!(clock(Duration::from_millis(19_600)), "00:00:20");
        assert_eq!(clock(Duration::from_secs(7265)), "02:01:05");
    }

    #[test]
    fn the_bar_moves_within_a_frame_and_never_backwards() {
        let (bar, clock) = (ProgressBar::hidden(), Arc::new(RunClock::start()));
        let ctx = Context::new(Pool::new(1).expect("one thread"));
        ctx.set_poll(Some(bar_poll(bar.clone(), clock.clone())));
        let phase = |name| {
            ctx.phase(name, || Ok(())).expect("no cancel");
            bar.position()
        };
        ctx.step(3, || {
            assert_eq!(phase("nothing is known"), 0);
            clock.expect(Duration::ZERO);
            assert_eq!(phase("no time is left"), LENGTH);
            clock.expect(Duration::from_secs(1000));
            assert_eq!(phase("more time is left"), LENGTH);
            Ok(())
        })
        .expect("no cancel");
        clock.expect(Duration::from_secs(1000));
        assert!(clock.fraction() < 0.1);
    }
}
