//! `shot.usda`: the whole shot for programs that read USD.

use super::done_frames::DoneFrames;
use super::own_files::{OwnFiles, SHOT_USD, usd_manifest};
use super::pipeline::Pipeline;
use super::stage::{Stage, Volume};
use crate::error::Result;
use crate::io::usd::{self, Clips, VolumeFiles};

/// Writes the description of the existing frames, with relative paths.
///
/// # Errors
/// What the operating system reports.
pub(super) fn write<'s>(
    pipeline: &Pipeline,
    stages: impl Iterator<Item = (&'s dyn Stage, &'s DoneFrames)>,
    files: &mut OwnFiles,
) -> Result<()> {
    let (frames, fps) = (pipeline.scene.shot.frames, pipeline.scene.shot.fps);
    let relative = |stored: &DoneFrames, kind: &str| -> Vec<(i32, String)> {
        let files = stored.files(kind).into_iter().filter(|(frame, _)| frames.contains(*frame));
        files.map(|(frame, path)| (frame, format!("./{path}"))).collect()
    };
    let (mut volumes, mut clips): (Vec<VolumeFiles>, Vec<Clips>) = (Vec::new(), Vec::new());
    for (stage, stored) in stages {
        volumes.extend(stage.volumes().into_iter().map(|Volume { kind, prim: name, fields, is_guide }| {
            VolumeFiles { name, fields, is_guide, files: relative(stored, kind) }
        }));
        let Some(mut clip) = stage.clip() else { continue };
        let files = relative(stored, clip.kind).into_iter().filter(|(_, file)| file.ends_with(".usda"));
        clip.frames.extend(files.map(|(frame, _)| frame));
        clips.extend(Some(clip).filter(|clip| !clip.frames.is_empty()));
    }
    for Clips { kind, prims, .. } in &clips {
        let manifest = usd::clip_manifest(kind, prims);
        files.write(&usd_manifest(kind), manifest.as_bytes())?;
    }
    let time = usd::StageTime { first: frames.first, last: frames.last, fps };
    let comment = format!("made by frazil {}", env!("CARGO_PKG_VERSION"));
    let text = usd::stage(&comment, time, &volumes, &clips);
    files.write(SHOT_USD, text.as_bytes())
}
