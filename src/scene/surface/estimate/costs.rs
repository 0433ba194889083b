//! What the frames of the stage take in comparison with each other, so that a run can say how long it will take.

use crate::scene::run::{FrameCosts, ToMake};
use crate::scene::surface::{Inputs, Surface};
use crate::scene::{Frames, Scene};

/// Writing a frame, in comparison with computing it.
const WRITING: f64 = 0.05;

/// What the frames of a scene take, in the stage that a run makes. A step to a frame computes frames after it, its first step those that all
/// others have: the last frames of a shot cost nothing but their files.
#[must_use]
pub fn costs(scene: &Scene, surface: &Surface, inputs: &Inputs, to_make: &[ToMake]) -> FrameCosts {
    let shot = scene.shot.frames;
    let (ahead, end) = (surface.frames_ahead(), last_computed(surface, shot));
    let computing = |frame: i32| f64::from((inputs.begins..=end).contains(&frame));
    let mut of_frames: Vec<f64> = shot.iter().map(|frame| WRITING + computing(frame + ahead)).collect();
    let first = to_make.first().and_then(|of_stage| of_stage.frames.first());
    if let Some(first) = first.map(|frames| *frames.start()) {
        of_frames[(first - shot.first) as usize] += (first..first + ahead).map(computing).sum::<f64>();
    }
    let mut costs = FrameCosts::new(shot.first);
    costs.add("surface", of_frames);
    costs
}

/// The last frame that is computed: the shot's, or one after it whose particles exist.
fn last_computed(surface: &Surface, shot: Frames) -> i32 {
    let is_there = |frame: &i32| {
        surface.reads_ahead()
            && surface.files_between(shot, frame - 1, *frame).iter().all(|path| path.is_file())
    };
    let after = shot.last + 1..=shot.last + surface.frames_ahead();
    after.take_while(is_there).last().unwrap_or(shot.last)
}
