//! Moving objects: the files of their sequences.

use std::path::PathBuf;

use super::Scene;
use crate::io::files::sequence::Pattern;

/// The sequences of the objects that move, each with its offset (frames).
fn sequences(scene: &Scene) -> impl Iterator<Item = (Pattern, f64)> + '_ {
    let moving = scene.objects.iter().filter(|object| object.role.moves());
    moving.filter_map(|object| Some((Pattern::parse(&object.file)?, object.offset)))
}

/// The files of sequences that the step to a frame reads: all that cover its time interval.
pub(super) fn files(scene: &Scene, frame: i32) -> Vec<PathBuf> {
    let mut out = Vec::new();
    for (pattern, offset) in sequences(scene) {
        let at = |frame: i32| f64::from(frame) - offset;
        let from = if frame == scene.shot.frames.first { at(frame) } else { at(frame - 1) };
        out.extend((from.floor() as i32..=at(frame).ceil() as i32).map(|number| pattern.path(number)));
    }
    out
}

/// The files of sequences that are read only for velocities over the frame after `frame`.
pub(super) fn files_ahead(scene: &Scene, frame: i32) -> Vec<PathBuf> {
    let number = |offset: f64| (f64::from(frame) + 1.0 - offset).ceil() as i32;
    sequences(scene).map(|(pattern, offset)| pattern.path(number(offset))).collect()
}
