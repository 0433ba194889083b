//! `shot.usda`: everything that a shot made, for programs that read USD.

use super::own::{self, Own};
use super::stored::Stored;
use super::{BaseMode, Role, Scene};
use crate::error::Result;
use crate::io::usd;
use crate::sweep::Body;

/// Writes the stage with the frames that are there, by relative paths. The base of a cache of changes is left out: its
/// files are no whole volumes.
///
/// # Errors
/// What the operating system reports.
pub(super) fn write(scene: &Scene, bodies: &[Body], stored: &Stored, files: &mut Own) -> Result<()> {
    let (frames, fps) = (scene.shot.frames, scene.shot.fps);
    let relative = |kind: &str| -> Vec<(i32, String)> {
        let files = stored.files(kind).into_iter().filter(|(frame, _)| frames.contains(*frame));
        files.map(|(frame, path)| (frame, format!("./{path}"))).collect()
    };
    let whole = scene.output.base_mode == BaseMode::Full;
    let base = if whole { relative("base") } else { Vec::new() };
    let removed = relative("removed");
    let volumes = [
        usd::VolumeFiles {
            name: "base",
            grids: &[("surface", true), ("compression", false), ("touched", false)],
            files: &base,
        },
        usd::VolumeFiles { name: "removed", grids: &[("removed", true)], files: &removed },
    ];
    let names = object_names(scene);
    let objects = relative("objects").into_iter().filter(|(_, file)| file.ends_with(".usda"));
    let clips = usd::Clips { kind: "objects", frames: objects.map(|(frame, _)| frame).collect() };
    let meshes = names.iter().zip(bodies);
    let meshes: Vec<usd::MeshPrim> =
        meshes.map(|(name, body)| usd::MeshPrim { name, uvs: body.motion().drawn().uvs }).collect();
    let clips = (!clips.frames.is_empty()).then_some((&clips, &meshes[..]));
    if clips.is_some() {
        let text = usd::clip_manifest("objects", &meshes);
        files.write(own::OBJECTS, text.as_bytes())?;
    }
    let time = usd::StageTime { first: frames.first, last: frames.last, fps };
    let comment = format!("made by frazil {}", env!("CARGO_PKG_VERSION"));
    let text = usd::stage(&comment, time, &volumes, clips);
    files.write(own::SHOT, text.as_bytes())
}

/// Names of the moving objects' prims, each once.
pub(super) fn object_names(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for object in scene.objects.iter().filter(|object| object.role == Role::Collide) {
        let stem = object.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stem =
            usd::prim_name(stem.split(['%', '#', '$']).next().unwrap_or("").trim_end_matches(['.', '_']));
        let count =
            names.iter().filter(|name| **name == stem || name.starts_with(&format!("{stem}_"))).count();
        let numbered = |number: usize| if number == 1 { stem.clone() } else { format!("{stem}_{number}") };
        // Another file may bear the name that the number gives.
        let name = (count + 1..).map(numbered).find(|name| !names.contains(name)).unwrap_or_default();
        names.push(name);
    }
    names
}
