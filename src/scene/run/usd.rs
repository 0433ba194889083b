//! `shot.usda`: the whole shot for programs that read USD.

use super::own_files::{Own, SHOT};
use super::plan::Plan;
use super::stage::{Clip, MovingMesh, Prims, Stage, Volume};
use super::stored::Stored;
use crate::error::Result;
use crate::io::usd;
use crate::io::usd::materials::Look;

/// Writes the description of the existing frames, by relative paths.
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
        .map(|(Volume { prim, fields, is_guide, .. }, files)| usd::VolumeFiles {
            name: prim,
            fields,
            is_guide: *is_guide,
            files,
        })
        .collect();
    let clips = stages.iter().filter_map(|(stage, stored)| {
        let clip = stage.clip()?;
        let files = relative(stored, clip.kind).into_iter().filter(|(_, file)| file.ends_with(".usda"));
        let frames: Vec<i32> = files.map(|(frame, _)| frame).collect();
        (!frames.is_empty()).then_some((clip, frames))
    });
    let clips: Vec<(Clip, Vec<i32>)> = clips.collect();
    let clips: Vec<(&str, usd::Clips)> = clips
        .iter()
        .map(|(clip, frames)| {
            let prims = match &clip.prims {
                Prims::Meshes(meshes) => usd::ClipPrims::Meshes(
                    meshes
                        .iter()
                        .map(|MovingMesh { name, look, uvs, primvars }| usd::MeshPrim {
                            name,
                            look: *look,
                            moves: true,
                            uvs: *uvs,
                            primvars,
                        })
                        .collect(),
                ),
                Prims::Surface(name) => usd::ClipPrims::Meshes(vec![usd::MeshPrim {
                    name,
                    look: Look::Snow,
                    moves: false,
                    uvs: None,
                    primvars: &[],
                }]),
                Prims::Points(points) => usd::ClipPrims::Points(points),
            };
            (clip.manifest, usd::Clips { kind: clip.kind, frames: frames.clone(), prims })
        })
        .collect();
    for (manifest, clips) in &clips {
        files.write(manifest, usd::clip_manifest(clips.kind, &clips.prims).as_bytes())?;
    }
    let clips: Vec<usd::Clips> = clips.into_iter().map(|(_, clips)| clips).collect();
    let time = usd::StageTime { first: frames.first, last: frames.last, fps };
    let comment = format!("made by frazil {}", env!("CARGO_PKG_VERSION"));
    let text = usd::stage(&comment, time, &volumes, &clips);
    files.write(SHOT, text.as_bytes())
}
