//! Progress of a shot on stderr: a bar on a terminal, otherwise one line per frame.

use frazil::{Context, context::Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Length of one frame on the bar.
const FRAME_LENGTH: u64 = 1000;

/// Shows which frame was finished and the expected end; on a terminal also the progress within the running frame.
pub struct FrameProgress<'a> {
    ctx: &'a Context,
    bar: Option<ProgressBar>,
    prints_lines: bool,
    total: usize,
    done: Arc<AtomicUsize>,
    start: Instant,
}

impl<'a> FrameProgress<'a> {
    /// Starts the display of `total` frames to be made by steps on `ctx`, in addition to `existing` ones.
    pub fn new(ctx: &'a Context, total: usize, existing: usize, is_quiet: bool) -> Self {
        if existing > 0 && !is_quiet {
            // Progress is optional: a closed stderr does not stop the run.
            let _ = writeln!(std::io::stderr(), "{existing} frames exist, {total} are to be made");
        }
        let is_terminal = std::io::stderr().is_terminal();
        let done = Arc::new(AtomicUsize::new(0));
        let bar = (is_terminal && !is_quiet).then(|| {
            let length = total as u64 * FRAME_LENGTH;
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% eta {eta_precise}");
            bar.set_style(style.expect("a fixed template").progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(250));
            ctx.set_poll(Some(bar_poll(bar.clone(), done.clone())));
            bar
        });
        Self { ctx, bar, prints_lines: !is_terminal && !is_quiet, total, done, start: Instant::now() }
    }

    /// A frame of a stage is written.
    pub fn finished(&mut self, stage: &str, frame: i32) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(bar) = &self.bar {
            bar.set_message(format!("frame {frame} stage {stage} {done}/{}", self.total));
            advance(bar, done, None);
        }
        if self.prints_lines {
            let percent = 100 * done / self.total.max(1);
            let eta = remaining_time(self.start.elapsed(), done, self.total);
            let _ = writeln!(std::io::stderr(), "frame {frame} stage {stage} {percent}% eta {eta}");
        }
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

/// Remaining time as `hh:mm:ss`, if the coming frames take as long as those done.
fn remaining_time(elapsed: Duration, done: usize, total: usize) -> String {
    let left = elapsed.as_secs_f64() * total.saturating_sub(done) as f64 / done.max(1) as f64;
    let seconds = left.round() as u64;
    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use frazil::Pool;

    #[test]
    fn the_time_left_is_hours_minutes_seconds() {
        assert_eq!(remaining_time(Duration::from_secs(10), 1, 1), "00:00:00");
        assert_eq!(remaining_time(Duration::from_secs(10), 1, 3), "00:00:20");
        assert_eq!(remaining_time(Duration::from_secs(3600), 1, 3), "02:00:00");
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
