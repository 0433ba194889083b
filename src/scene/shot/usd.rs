//! `shot.usda`: everything that a shot made, for programs that read USD.

use super::own::Own;
use super::run::Plan;
use super::stage::Stage;
use super::stored::Stored;
use crate::base::Uvs;
use crate::error::Result;
use crate::io::usd;

/// The shot for programs that read USD.
pub(super) const SHOT: &str = "shot.usda";

/// A kind of a stage's files that holds volumes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Volume {
    /// The kind, and the name of the prim.
    pub kind: &'static str,
    /// Its grids: name, and whether it is a level set.
    pub grids: &'static [(&'static str, bool)],
}

/// A kind of a stage's files that holds moving meshes: a .usda file a frame.
pub struct Clip<'a> {
    /// The kind.
    pub kind: &'static str,
    /// What the frames have in common: a file that belongs to no frame.
    pub manifest: &'static str,
    /// Names of the meshes' prims, and their texture coordinates.
    pub meshes: Vec<(String, Option<&'a Uvs>)>,
}

/// Writes the description of the frames that are there, by relative paths.
///
/// # Errors
/// What the operating system reports.
pub(super) fn write<'s>(
    plan: &Plan,
    stages: impl Iterator<Item = (&'s dyn Stage, &'s Stored)>,
    files: &mut Own,
) -> Result<()> {
    let (frames, fps) = (plan.scene.shot.frames, plan.scene.shot.fps);
    let stages: Vec<_> = stages.collect();
    let relative = |stored: &Stored, kind: &str| -> Vec<(i32, String)> {
        let files = stored.files(kind).into_iter().filter(|(frame, _)| frames.contains(*frame));
        files.map(|(frame, path)| (frame, format!("./{path}"))).collect()
    };
    let volumes: Vec<(Volume, Vec<(i32, String)>)> = stages
        .iter()
        .flat_map(|(stage, stored)| stage.volumes().into_iter().map(|v| (v, relative(stored, v.kind))))
        .collect();
    let volumes: Vec<usd::VolumeFiles> = volumes
        .iter()
        .map(|(volume, files)| usd::VolumeFiles { name: volume.kind, grids: volume.grids, files })
        .collect();
    let clip = stages.iter().find_map(|(stage, stored)| {
        let clip = stage.clip()?;
        let files = relative(stored, clip.kind).into_iter().filter(|(_, file)| file.ends_with(".usda"));
        let frames: Vec<i32> = files.map(|(frame, _)| frame).collect();
        (!frames.is_empty()).then_some((clip, frames))
    });
    let meshes: Vec<usd::MeshPrim> = clip
        .iter()
        .flat_map(|(clip, _)| clip.meshes.iter().map(|(name, uvs)| usd::MeshPrim { name, uvs: *uvs }))
        .collect();
    if let Some((clip, _)) = &clip {
        files.write(clip.manifest, usd::clip_manifest(clip.kind, &meshes).as_bytes())?;
    }
    let clips = clip.as_ref().map(|(clip, frames)| usd::Clips { kind: clip.kind, frames: frames.clone() });
    let time = usd::StageTime { first: frames.first, last: frames.last, fps };
    let comment = format!("made by frazil {}", env!("CARGO_PKG_VERSION"));
    let text = usd::stage(&comment, time, &volumes, clips.as_ref().map(|clips| (clips, &meshes[..])));
    files.write(SHOT, text.as_bytes())
}
