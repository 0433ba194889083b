//! The frame to which `--from` goes back, where exact states are kept of some frames only.

use super::done_frames::DoneFrames;
use super::stage::Stage;

/// The frame from which these stages make frames again for `--from`: `from` itself, or, if one of them lacks the exact state after the frame
/// before it, the frame after that stage's latest state, at most `every` frames earlier (0 = never earlier). Without such a state it is
/// `from`, which the run then refuses.
pub(super) fn resumable_from(stages: &[(&dyn Stage, DoneFrames)], from: i32, every: i32) -> i32 {
    let earliest = from.saturating_sub(every);
    let with_memory = || stages.iter().filter(|(stage, _)| stage.has_memory());
    let mut at = from;
    // All stages go back to the same frame, and another one may have no state there.
    loop {
        let latest = |done: &DoneFrames| done.latest_state(earliest..=at - 1).map(|frame| frame + 1);
        let needed = with_memory().filter_map(|(_, done)| latest(done)).min().unwrap_or(at);
        if needed >= at {
            return at;
        }
        at = needed;
    }
}
