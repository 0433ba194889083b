//! `shot.usda`: the whole shot for programs that read USD.

use std::path::Path;

use super::done_frames::DoneFrames;
use super::own_files::{OwnFiles, SHOT_USD};
use super::pipeline::Pipeline;
use super::stage::{Stage, Volume};
use crate::context::Context;
use crate::error::Result;
use crate::io::mesh::extension;
use crate::io::usd::{self, Clips, Field, Holds, StillMeshes, VolumeFile, VolumeFiles};

/// Writes the description of the existing frames, with relative paths.
///
/// # Errors
/// What the operating system reports.
pub(super) fn write<'s>(
    ctx: &Context,
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
    let mut still = Vec::new();
    for (stage, stored) in stages {
        for Volume { kind, prim: name, fields, is_guide } in stage.volumes() {
            let of_frame = |(frame, path)| volume_file(stored, (kind, fields), frame, path);
            let files: Vec<VolumeFile> = relative(stored, kind).into_iter().map(of_frame).collect();
            volumes.extend(
                Some(VolumeFiles { name, fields, is_guide, files }).filter(|one| !one.files.is_empty()),
            );
        }
        for mut clip in stage.clips() {
            let is_usd = |file: &String| usd::Format::of(&extension(Path::new(file))).is_some();
            clip.files.extend(relative(stored, clip.kind).into_iter().filter(|(_, file)| is_usd(file)));
            clips.extend(Some(clip).filter(|clip| !clip.files.is_empty()));
        }
        still.extend(stage.still_meshes(ctx)?);
    }
    for Clips { kind, prims, .. } in &clips {
        files.write(&usd::manifest_path(kind), &usd::clip_manifest(kind, prims)?)?;
    }
    if !volumes.is_empty() {
        files.write(usd::SAMPLES, &usd::samples(&volumes)?)?;
    }
    for StillMeshes { kind, bytes, .. } in &still {
        files.write(&usd::still_path(kind), bytes)?;
    }
    let time = usd::StageTime { first: frames.first, last: frames.last, fps };
    let comment = format!("made by frazil {}", env!("CARGO_PKG_VERSION"));
    files.write(SHOT_USD, &usd::stage(&comment, time, &volumes, &clips, &still)?)
}

/// A file of a volume, whose extent is in the frame's report. Reports of frazil 0.1 have none, and one that is damaged (`check` says so)
/// should not keep a run from its end.
fn volume_file(
    stored: &DoneFrames,
    (kind, fields): (&str, &[Field]),
    frame: i32,
    path: String,
) -> VolumeFile {
    type Box = [[f32; 3]; 2];
    let grids = stored.contents(frame, kind).ok().flatten();
    let visible = fields.iter().filter(|field| matches!(field.holds, Holds::Distance | Holds::Density(_)));
    let extent = |field: &Field| grids.as_ref()?.get(field.grid)?.get("extent_m").cloned();
    let known: Vec<serde_json::Value> = visible.filter_map(extent).collect();
    let boxes = known.iter().filter_map(|extent| serde_json::from_value::<Box>(extent.clone()).ok());
    let joined = boxes.reduce(|[low, high], [l, h]| {
        [0, 1].map(|end| {
            [0, 1, 2].map(|axis| match end {
                0 => low[axis].min(l[axis]),
                _ => high[axis].max(h[axis]),
            })
        })
    });
    VolumeFile { frame, path, is_empty: joined.is_none() && !known.is_empty(), extent: joined }
}
