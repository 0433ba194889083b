//! The frame loop: from one frame to the next, and each frame's files.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::changes::changed_keys;
use super::{FrameChoice, Inputs, Scene};
use crate::context::{Context, StageTime};
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::snow::base_layer::{BaseLayer, Params, StepReport};
use crate::vdb::file::{WriteOptions, write};
use crate::vdb::{FloatGrid, MetaValue};

/// Prepares a folder for a scene: makes it, and writes the resolved scene into it.
///
/// # Errors
/// A folder that cannot be made or written, or that holds another scene's output.
pub fn prepare(scene: &Scene, folder: &Path) -> Result<()> {
    let resolved = scene.to_toml();
    let path = folder.join("scene.toml");
    if let Ok(before) = std::fs::read_to_string(&path) {
        let changed = changed_keys(&before, &resolved);
        if !changed.is_empty() {
            let what = format!(
                "the folder holds the output of other settings ({}): choose another -o or remove it",
                changed.join(", ")
            );
            return Err(Error::file(path, what));
        }
    }
    for name in ["", "base", "removed", "report"] {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    }
    atomic::write_bytes(&path, resolved.as_bytes())
}

/// Runs the frames up to the last of `frames`, writes those in `frames`, and tells `done` after each.
///
/// # Errors
/// What a step or a file reports; whole frames are left behind.
pub fn run(
    ctx: &Context,
    scene: &Scene,
    inputs: &Inputs,
    folder: &Path,
    frames: &FrameChoice,
    mut done: impl FnMut(i32, &StepReport),
) -> Result<()> {
    let noise = (scene.snow.noise.amplitude > 0.0).then_some(scene.snow.noise);
    let params = Params { noise, tolerance: 0.02 };
    let mut base = BaseLayer::new(ctx, inputs.layer(ctx, scene.snow.cell)?, params)?;
    log::info!(
        "snow: {} active voxels, {:.1} MB, {:.6} m3",
        base.surface().active_voxels(),
        base.surface().memory_bytes() as f64 / 1e6,
        base.volume()
    );
    let first = scene.shot.frames.first;
    for frame in first..=frames.last() {
        let time = |frame: i32| f64::from(frame) / scene.shot.fps;
        // The first frame's poses are cut out; nothing has moved yet.
        let from = if frame == first { frame } else { frame - 1 };
        let report = base.step(ctx, &inputs.bodies, time(from), time(frame), frame)?;
        log_step(frame, &report);
        if frames.contains(frame) {
            write_frame(scene, &base, folder, frame, &report)?;
            done(frame, &report);
        }
    }
    Ok(())
}

fn log_step(frame: i32, report: &StepReport) {
    let stage = |stage: &StageTime| format!("{} {:.1} ms", stage.name, stage.time.as_secs_f64() * 1e3);
    let stages: Vec<String> = report.stages.iter().map(stage).collect();
    log::info!(
        "frame {frame}: {:.6} m3 removed, {} faces, {} blocks; {}",
        report.removed_volume,
        report.sweep_faces,
        report.touched_blocks,
        stages.join(", ")
    );
}

/// The file of a frame: `base/base.0012.vdb`.
pub fn frame_path(folder: &Path, kind: &str, frame: i32, extension: &str) -> PathBuf {
    folder.join(kind).join(format!("{kind}.{frame:04}.{extension}"))
}

fn write_frame(
    scene: &Scene,
    base: &BaseLayer,
    folder: &Path,
    frame: i32,
    report: &StepReport,
) -> Result<()> {
    let metadata = vec![
        ("frazil:frame".into(), MetaValue::Int(frame.into())),
        ("frazil:fps".into(), MetaValue::Double(scene.shot.fps)),
        ("frazil:units".into(), MetaValue::Text("metres".into())),
        ("frazil:up".into(), MetaValue::Text("y".into())),
        ("frazil:version".into(), MetaValue::Text(env!("CARGO_PKG_VERSION").into())),
    ];
    let options = WriteOptions { metadata, ..WriteOptions::default() };
    let save =
        |kind: &str, grids: &[&FloatGrid]| write(&frame_path(folder, kind, frame, "vdb"), grids, &options);
    if scene.output.removed {
        save("removed", &[base.removed()])?;
    }
    if scene.output.base {
        save("base", &[base.surface(), base.compression(), base.touched()])?;
    }
    let stages: Vec<_> = report
        .stages
        .iter()
        .map(|stage| json!({ "name": stage.name, "seconds": stage.time.as_secs_f64() }))
        .collect();
    let text = json!({
        "frame": frame,
        "removed_m3": report.removed_volume,
        "base_m3": report.base_volume,
        "touched_blocks": report.touched_blocks,
        "sweep_faces": report.sweep_faces,
        "base_bytes": base.surface().memory_bytes(),
        "stages": stages,
    });
    let path = folder.join("report").join(format!("{frame:04}.json"));
    atomic::write_bytes(&path, format!("{text:#}\n").as_bytes())
}
