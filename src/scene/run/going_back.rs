//! The frame to which `--from` goes back, where exact states are kept of some frames only.

use super::done_frames::DoneFrames;
use super::stage::Stage;

/// The frame from which these stages make frames again, at most `from`: if one of them has no exact state after the frame before, the frame
/// after the latest state that it keeps, at most `every` frames earlier (0: not at all). If there is none, `from`: the run then refuses it.
pub(super) fn resumable_from(stages: &[(&dyn Stage, DoneFrames)], from: i32, every: i32) -> i32 {
    let earliest = from.saturating_sub(every);
    let with_memory = || stages.iter().filter(|(stage, _)| stage.has_memory());
    let mut at = from;
    // Stages that go back take the others with them, which may then need an earlier state.
    loop {
        let latest = |done: &DoneFrames| done.latest_state(earliest..=at - 1).map(|frame| frame + 1);
        let needed = with_memory().filter_map(|(_, done)| latest(done)).min().unwrap_or(at);
        if needed >= at {
            return at;
        }
        at = needed;
    }
}
