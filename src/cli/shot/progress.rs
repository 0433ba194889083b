//! Progress of a shot on stderr: a bar on a terminal, otherwise one line per frame, as text or as JSON.

use frazil::{Context, context::Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::remaining::Remaining;

/// Length of one frame on the bar.
const FRAME_LENGTH: u64 = 1000;

/// Shows which frame was finished and the expected end; on a terminal also the progress within the running frame.
pub struct FrameProgress<'a> {
    ctx: &'a Context,
    bar: Option<ProgressBar>,
    /// How lines are printed, if they are.
    lines: Option<ProgressFormat>,
    remaining: Remaining,
    done: Arc<AtomicUsize>,
    start: Instant,
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
        let done = Arc::new(AtomicUsize::new(0));
        let bar = has_bar.then(|| {
            let length = total as u64 * FRAME_LENGTH;
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{prefix} [{bar:40}] {percent}% {msg}");
            bar.set_style(style.expect("a fixed template").progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(250));
            ctx.set_poll(Some(bar_poll(bar.clone(), done.clone())));
            bar
        });
        Self { ctx, bar, lines: format.filter(|_| !has_bar), remaining, done, start: Instant::now() }
    }

    /// A frame of a stage is written.
    pub fn finished(&mut self, stage: &str, frame: i32) {
        let (done, total) = (self.done.fetch_add(1, Ordering::Relaxed) + 1, self.remaining.total());
        self.remaining.finished(stage, Instant::now());
        let left = self.remaining.time();
        if let Some(bar) = &self.bar {
            bar.set_prefix(format!("frame {frame} stage {stage} {done}/{total}"));
            bar.set_message(format!("eta {}", clock(left)));
            advance(bar, done, None);
        }
        let line = match self.lines {
            Some(ProgressFormat::Text) => {
                let percent = 100 * done / total.max(1);
                format!("frame {frame} stage {stage} {percent}% eta {}", clock(left))
            }
            Some(ProgressFormat::Json) => {
                let [spent, left] = [self.start.elapsed(), left].map(|time| time.as_secs_f64());
                let fraction = if left > 0.0 { spent / (spent + left) } else { 1.0 };
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

/// A poll that moves the bar within the running frame.
fn bar_poll(bar: ProgressBar, done: Arc<AtomicUsize>) -> frazil::context::Poll {
    Box::new(move |progress: &Progress| {
        advance(&bar, done.load(Ordering::Relaxed), progress.fraction);
        false
    })
}

/// Moves the bar to a frame count and a fraction of the next frame; never backwards, though frames are computed ahead of the
/// files.
fn advance(bar: &ProgressBar, done: usize, fraction: Option<f32>) {
    let position = done as u64 * FRAME_LENGTH + (fraction.unwrap_or(0.0) * FRAME_LENGTH as f32) as u64;
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
        let (bar, done) = (ProgressBar::hidden(), Arc::new(AtomicUsize::new(1)));
        let ctx = Context::new(Pool::new(1).expect("one thread"));
        ctx.set_poll(Some(bar_poll(bar.clone(), done)));
        let half = || {
            ctx.phase("first", || Ok(()))?;
            assert_eq!(bar.position(), FRAME_LENGTH);
            ctx.phase("second", || Ok(()))
        };
        ctx.step(2, half).expect("no cancel");
        assert_eq!(bar.position(), FRAME_LENGTH + FRAME_LENGTH / 2);
        advance(&bar, 1, None);
        assert_eq!(bar.position(), FRAME_LENGTH + FRAME_LENGTH / 2);
        advance(&bar, 2, None);
        assert_eq!(bar.position(), 2 * FRAME_LENGTH);
    }
}
