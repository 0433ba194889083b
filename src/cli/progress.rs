//! Progress of a shot on stderr: a bar on a terminal, else one line a frame.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Shows which frame was finished and when the last one will be.
pub struct FrameProgress {
    bar: Option<ProgressBar>,
    lines: bool,
    total: usize,
    done: usize,
    start: Instant,
}

impl FrameProgress {
    /// Starts the display of `total` frames to be made, besides those that are `there`.
    pub fn new(total: usize, there: usize, quiet: bool) -> Self {
        if there > 0 && !quiet {
            // Progress is a courtesy: a closed stderr is no reason to stop.
            let _ = writeln!(std::io::stderr(), "{there} frames are there, {total} are to be made");
        }
        let terminal = std::io::stderr().is_terminal();
        let bar = (terminal && !quiet).then(|| {
            let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {pos}/{len} eta {eta_precise}");
            bar.set_style(style.expect("a fixed template").progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        Self { bar, lines: !terminal && !quiet, total, done: 0, start: Instant::now() }
    }

    /// A frame of a stage is written.
    pub fn finished(&mut self, stage: &str, frame: i32) {
        self.done += 1;
        if let Some(bar) = &self.bar {
            bar.set_message(format!("frame {frame} stage {stage}"));
            bar.inc(1);
        }
        if self.lines {
            let percent = 100 * self.done / self.total.max(1);
            let eta = clock(self.start.elapsed(), self.done, self.total);
            let _ = writeln!(std::io::stderr(), "frame {frame} stage {stage} {percent}% eta {eta}");
        }
    }
}

impl Drop for FrameProgress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Time left as `hh:mm:ss`, if the frames to come take as long as those done.
fn clock(elapsed: Duration, done: usize, total: usize) -> String {
    let left = elapsed.as_secs_f64() * total.saturating_sub(done) as f64 / done.max(1) as f64;
    let seconds = left.round() as u64;
    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_hours_minutes_seconds() {
        assert_eq!(clock(Duration::from_secs(10), 1, 1), "00:00:00");
        assert_eq!(clock(Duration::from_secs(10), 1, 3), "00:00:20");
        assert_eq!(clock(Duration::from_secs(3600), 1, 3), "02:00:00");
    }
}
