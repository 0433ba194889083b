//! The stage `base`: objects press into the layer of snow.

use serde_json::json;

use super::{frames, settings};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::io::records::manifest::Keeps;
use crate::io::usd::{Field, Holds};
use crate::scene::run::{
    DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping, Volume,
};
use crate::scene::snow::inputs::Inputs;
use crate::scene::vdb_metadata::{contents, metadata};
use crate::scene::{BaseMode, Scene, moving};
use crate::snow::base_layer::{BaseLayer, Changes, Grids, Params, StepReport};
use crate::sweep::{Body, TOLERANCE};
use crate::vdb::FloatGrid;
use crate::vdb::file::{WriteOptions, to_bytes};

/// The layer of a scene, pressed by its objects.
pub struct Base<'a> {
    pub scene: &'a Scene,
    pub inputs: &'a Inputs,
}

/// The changes of a step, to be written.
pub struct Step {
    frame: i32,
    changes: Changes,
    /// The contents of the base's file, if they are a whole layer of which the writer has no copy.
    whole: Option<Vec<u8>>,
}

/// Writes frames.
pub struct Writer {
    /// Provides the threads. Its cancel flag is ignored: a frame that was begun is finished.
    ctx: Context,
    half_width: f32,
    /// The layer after the last step, if whole layers are written.
    copy: Option<Grids>,
}

impl Base<'_> {
    /// Whether the writer keeps a copy of the layer.
    fn keeps_copy(&self) -> bool {
        !self.scene.output.base_restarts() || self.scene.output.base_mode == BaseMode::Full
    }

    fn is_first(&self, frame: i32) -> bool {
        frame == self.scene.shot.frames.first
    }

    /// The whole layer, or its changes.
    fn base_bytes(&self, writer: &Writer, step: &Step, made_from: &str) -> Result<Vec<u8>> {
        if self.scene.output.base_mode == BaseMode::Full {
            return vdb_bytes(self.scene, step.frame, &writer.copy()?.list(), made_from);
        }
        let delta = Grids::delta(&writer.ctx, self.inputs.snow.cell, writer.half_width, &step.changes)?;
        vdb_bytes(self.scene, step.frame, &delta.list(), made_from)
    }
}

impl Stage for Base<'_> {
    fn name(&self) -> &'static str {
        "base"
    }

    fn noun(&self) -> &'static str {
        "layer"
    }

    fn why_states_are_missing(&self) -> &'static str {
        "`half` and `base = []` keep only those of the last two frames"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: "base", extensions: &["vdb"] }, FileKind { name: "removed", extensions: &["vdb"] }]
    }

    fn writes(&self, kind: &str) -> bool {
        if kind == "base" { self.scene.output.base } else { self.scene.output.removed }
    }

    fn settings(&self) -> Result<Settings> {
        settings::of_base(self.scene, &self.inputs.input_hashes)
    }

    fn first_state_settings(&self, settings: &Settings) -> Settings {
        settings::of_layer(self.scene.values.keys(), settings)
    }

    fn reads(&self, frame: i32) -> Reads {
        Reads { files: moving::files(self.scene, frame), ahead: Vec::new() }
    }

    fn keeps(&self, frame: i32) -> Keeps {
        let output = self.scene.output;
        match (output.base_restarts(), output.base_mode) {
            (false, _) => Keeps::State,
            (true, BaseMode::Delta) if !self.is_first(frame) => Keeps::Changes,
            (true, _) => Keeps::Whole,
        }
    }

    fn needs_every_frame(&self) -> Option<&'static str> {
        let output = self.scene.output;
        (output.base && output.base_mode == BaseMode::Delta).then_some("base_mode = \"delta\"")
    }

    /// A base stored as changes is left out, as renderers need whole layers.
    fn volumes(&self) -> Vec<Volume> {
        const BASE: &[Field] = &[
            Field::of("surface", Holds::Distance),
            Field::of("compression", Holds::Number),
            Field::of("touched", Holds::Number),
        ];
        const REMOVED: &[Field] = &[Field::of("removed", Holds::Distance)];
        // Renderers that draw level sets would draw the snow twice.
        let has_mesh = self.scene.output.volumes.mesh_usd;
        let base = Volume { kind: "base", prim: "base", fields: BASE, is_guide: has_mesh };
        let whole = self.scene.output.base_mode == BaseMode::Full;
        let removed = Volume { kind: "removed", prim: "removed", fields: REMOVED, is_guide: true };
        whole.then_some(base).into_iter().chain([removed]).collect()
    }
}

impl Stepping for Base<'_> {
    type State = BaseLayer;
    type Step = Step;
    type Writer = Writer;

    fn load(&self, ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<BaseLayer> {
        let scene = self.scene;
        let noise = Some(self.inputs.snow.noise).filter(|noise| noise.amplitude > 0.0);
        let params = Params { noise, tolerance: TOLERANCE };
        let initial = self.inputs.layer(ctx);
        let initial = initial.map_err(|error| match (error, self.inputs.far_static(scene)) {
            (Error::Argument(_), Some(what)) => Error::file(&scene.path, what),
            (other, _) => other,
        })?;
        let mut layer = match after {
            None => BaseLayer::new(ctx, initial, params)?,
            Some(frame) => BaseLayer::resume(ctx, initial, frames::layer_at(ctx, done, frame)?, params)?,
        };
        layer.set_min_crumb(self.inputs.snow.min_crumb);
        log::info!(
            "snow: {} active voxels, {:.1} MB, {:.6} m3; {}",
            layer.surface().active_voxels(),
            layer.surface().memory_bytes() as f64 / 1e6,
            layer.volume(),
            after.map_or("at rest".into(), |frame| format!("resumes after frame {frame}"))
        );
        Ok(layer)
    }

    fn step(&self, ctx: &Context, layer: &mut BaseLayer, to: &StepTarget<'_>) -> Result<Stepped<Step>> {
        let frame = to.frame;
        let time = |frame: i32| f64::from(frame) / self.scene.shot.fps;
        // At the first frame the objects are cut out where they stand: they have not moved yet.
        let from = if self.is_first(frame) { frame } else { frame - 1 };
        let moving = self.scene.objects.iter().filter(|object| object.role.moves());
        let removing = self.inputs.bodies.iter().zip(moving).filter(|(_, object)| object.role.removes());
        let bodies: Vec<&Body> = removing.map(|(body, _)| body).collect();
        let report = layer.step(ctx, &bodies, time(from), time(frame), frame);
        let report =
            report.map_err(|error| error.in_file_at(&self.scene.path, format!("frame {frame}: ")))?;
        log_step(frame, &report);
        let changes = layer.take_changes()?;
        // The whole file at the first frame of a cache of changes needs no copy of the layer.
        let whole = match to.made_from {
            Some(made_from) if self.scene.output.base && self.is_first(frame) && !self.keeps_copy() => {
                Some(vdb_bytes(self.scene, frame, &layer.grids().list(), made_from)?)
            }
            _ => None,
        };
        Ok(Stepped { step: Step { frame, changes, whole }, report: report_of(report) })
    }

    fn writer(&self, ctx: &Context, layer: &BaseLayer) -> Result<Writer> {
        let copy = if self.keeps_copy() { Some(layer.grids().deep_copy()?) } else { None };
        Ok(Writer { ctx: Context::new(ctx.pool().clone()), half_width: layer.half_width(), copy })
    }

    fn write(&self, writer: &mut Writer, step: Step, files: Option<&mut FrameFiles>) -> Result<()> {
        if let Some(copy) = &mut writer.copy {
            copy.apply(&writer.ctx, &step.changes)?;
        }
        let Some(files) = files else { return Ok(()) };
        let output = self.scene.output;
        if output.removed {
            let bytes = vdb_bytes(self.scene, step.frame, &[&step.changes.removed], files.made_from)?;
            files.save("removed", "vdb", &bytes)?;
            files.describe("removed", &contents(&[&step.changes.removed]));
        }
        if output.base {
            match &step.whole {
                Some(bytes) => files.save("base", "vdb", bytes)?,
                None => files.save("base", "vdb", &self.base_bytes(writer, &step, files.made_from)?)?,
            }
            // Only whole layers are volumes of the shot.
            if let Some(copy) = writer.copy.as_ref().filter(|_| output.base_mode == BaseMode::Full) {
                files.describe("base", &contents(&[&copy.surface]));
            }
        }
        if !output.base_restarts() {
            files.save_state(&to_bytes(&writer.copy()?.list(), &WriteOptions::default())?)?;
        }
        Ok(())
    }
}

impl Writer {
    fn copy(&self) -> Result<&Grids> {
        self.copy.as_ref().ok_or_else(|| Error::Internal("the writer has no grids".into()))
    }
}

/// A frame's .vdb file.
fn vdb_bytes(scene: &Scene, frame: i32, grids: &[&FloatGrid], made_from: &str) -> Result<Vec<u8>> {
    let metadata = metadata(scene, frame, made_from);
    to_bytes(grids, &WriteOptions { metadata, half: scene.output.half, ..WriteOptions::default() })
}

fn report_of(report: StepReport) -> Report {
    let results = json!({
        "removed_m3": report.removed_volume,
        "base_m3": report.base_volume,
        "touched_blocks": report.touched_blocks,
        "sweep_faces": report.sweep_faces,
        "crumbs": report.crumbs,
    });
    Report::new(results, report.phases)
}

fn log_step(frame: i32, report: &StepReport) {
    let time = |time: &PhaseTime| format!("{} {:.1} ms", time.name, time.time.as_secs_f64() * 1e3);
    let times: Vec<String> = report.phases.iter().map(time).collect();
    log::info!(
        "frame {frame}: {:.6} m3 removed, {} faces, {} blocks; {}",
        report.removed_volume,
        report.sweep_faces,
        report.touched_blocks,
        times.join(", ")
    );
}
