//! A frame's files, written on a thread of their own while the next frame is computed.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::stage::object_names;
use super::stored::{STAGE, state_path};
use super::{BaseMode, Scene};
use crate::base::{DVec3, TriMesh, Uvs};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::io::manifest::{Keeps, Manifest, Written};
use crate::io::{atomic, mesh, sealed, usd};
use crate::motion::Drawn;
use crate::snow::base_layer::{Changes, Grids, StepReport};
use crate::sweep::Body;
use crate::vdb::file::{WriteOptions, to_bytes};
use crate::vdb::{FloatGrid, MetaValue};

/// Exact states that are kept where the base's own files are not enough.
const STATES_KEPT: i32 = 2;

/// What the writer is told, in the order of the frames.
pub(super) enum Job {
    /// The grids from which the next steps start.
    Start(Box<Grids>),
    /// A step that was made.
    Step(Box<Step>),
}

/// A step with what it changed.
pub(super) struct Step {
    pub frame: i32,
    pub changes: Changes,
    pub report: StepReport,
    /// What the frame is made from, when it is to be written.
    pub inputs: Option<Made>,
    /// The base's file, where it is whole and the writer has no copy of the layer.
    pub whole: Option<Vec<u8>>,
}

/// Hashes of what a frame is made from.
pub(super) struct Made {
    /// The settings, and the files that it and the frames before it read.
    pub from: String,
    /// The files that only its velocities read.
    pub next: Option<String>,
}

/// Writes frames, following the layer by its changes.
pub(super) struct Writer<'a> {
    ctx: Context,
    scene: &'a Scene,
    bodies: &'a [Body],
    names: Vec<String>,
    folder: PathBuf,
    half_width: f32,
    /// The layer as it was after the last step, where whole grids are written.
    copy: Option<Grids>,
}

impl<'a> Writer<'a> {
    /// A writer into a folder; `ctx` gives the threads, its cancel flag does not matter: a frame begun is finished.
    pub fn new(ctx: &Context, scene: &'a Scene, bodies: &'a [Body], folder: &Path, half_width: f32) -> Self {
        let (ctx, folder) = (Context::new(ctx.pool().clone()), folder.to_path_buf());
        Self { ctx, scene, bodies, names: object_names(scene), folder, half_width, copy: None }
    }

    /// Whether it needs a copy of the layer.
    pub fn follows(scene: &Scene) -> bool {
        !scene.output.base_restarts() || scene.output.base_mode == BaseMode::Full
    }

    /// Does a job; gives the manifest of a frame that was written.
    ///
    /// # Errors
    /// What the operating system or OpenVDB reports; the frame is then not done.
    pub fn work(&mut self, job: Job) -> Result<Option<(Manifest, StepReport)>> {
        match job {
            Job::Start(grids) => {
                self.copy = Some(*grids);
                Ok(None)
            }
            Job::Step(step) => {
                if let Some(copy) = &mut self.copy {
                    copy.apply(&self.ctx, &step.changes)?;
                }
                if step.inputs.is_none() {
                    return Ok(None);
                }
                let manifest = self.write_frame(&step)?;
                Ok(Some((manifest, step.report)))
            }
        }
    }

    fn write_frame(&self, step: &Step) -> Result<Manifest> {
        let (output, frame) = (self.scene.output, step.frame);
        let inputs = step.inputs.as_ref().map_or("", |made| &made.from);
        let mut files = Vec::new();
        if output.removed {
            let bytes = vdb_bytes(self.scene, frame, &[&step.changes.removed], inputs)?;
            files.push(self.save("removed", frame, "vdb", &bytes)?);
        }
        if output.base {
            files.push(match &step.whole {
                Some(bytes) => self.save("base", frame, "vdb", bytes)?,
                None => self.save("base", frame, "vdb", &self.base_bytes(step)?)?,
            });
        }
        if output.objects_usd || output.objects_ply {
            self.save_objects(frame, &mut files)?;
        }
        let mut state = None;
        if !output.base_restarts() {
            let grids = self.copy()?.list();
            let bytes = to_bytes(&grids, &WriteOptions::default())?;
            atomic::write_bytes(&state_path(&self.folder, frame), &bytes)?;
            state = Some(Written::new(format!("state/{STAGE}.{frame:04}.vdb"), &bytes));
        }
        self.write_report(frame, &step.report)?;
        let next = step.inputs.as_ref().and_then(|made| made.next.clone());
        let keeps = self.keeps(frame);
        let manifest = Manifest { frame, inputs: inputs.to_string(), keeps, files, state, next };
        manifest.write(&self.folder, STAGE)?;
        if !output.base_restarts() {
            // And those that a run was killed before it removed. One that cannot be removed does no harm.
            let mut passed = (self.scene.shot.frames.first..=frame - STATES_KEPT).rev();
            while passed.next().is_some_and(|old| std::fs::remove_file(state_path(&self.folder, old)).is_ok())
            {
            }
        }
        Ok(manifest)
    }

    fn keeps(&self, frame: i32) -> Keeps {
        let output = self.scene.output;
        match (output.base_restarts(), output.base_mode) {
            (false, _) => Keeps::State,
            (true, BaseMode::Delta) if frame > self.scene.shot.frames.first => Keeps::Changes,
            (true, _) => Keeps::Whole,
        }
    }

    fn copy(&self) -> Result<&Grids> {
        self.copy.as_ref().ok_or_else(|| Error::Internal("the writer has no grids".into()))
    }

    /// The whole layer, or what changed of it.
    fn base_bytes(&self, step: &Step) -> Result<Vec<u8>> {
        let inputs = step.inputs.as_ref().map_or("", |made| &made.from);
        if self.scene.output.base_mode == BaseMode::Full {
            return vdb_bytes(self.scene, step.frame, &self.copy()?.list(), inputs);
        }
        let delta = Grids::delta(&self.ctx, self.scene.snow.cell, self.half_width, &step.changes)?;
        vdb_bytes(self.scene, step.frame, &delta.list(), inputs)
    }

    fn save(&self, kind: &str, frame: i32, extension: &str, bytes: &[u8]) -> Result<Written> {
        let path = format!("{kind}/{kind}.{frame:04}.{extension}");
        atomic::write_bytes(&self.folder.join(&path), bytes)?;
        Ok(Written::new(path, bytes))
    }

    /// The objects as they are at a frame, with their velocities over the coming one.
    fn save_objects(&self, frame: i32, files: &mut Vec<Written>) -> Result<()> {
        let fps = self.scene.shot.fps;
        let (mut pose, mut velocities) = (Vec::<DVec3>::new(), Vec::<DVec3>::new());
        let mut meshes = Vec::new();
        for body in self.bodies {
            body.motion().drawn_pose(f64::from(frame) / fps, &mut pose)?;
            body.motion().velocities_ahead(f64::from(frame) / fps, 1.0 / fps, &mut velocities)?;
            meshes.push((usd::to_floats(&pose), usd::to_floats(&velocities)));
        }
        let drawn: Vec<Drawn> = self.bodies.iter().map(|body| body.motion().drawn()).collect();
        if self.scene.output.objects_ply {
            let (mut all, mut velocities) = (TriMesh::default(), Vec::new());
            for (drawn, (positions, speeds)) in drawn.iter().zip(&meshes) {
                all.append(&TriMesh { positions: positions.clone(), triangles: drawn.triangles.to_vec() });
                velocities.extend_from_slice(speeds);
            }
            let uvs = Uvs::joined(drawn.iter().map(|drawn| (drawn.uvs, drawn.vertices, drawn.triangles)));
            let bytes = mesh::ply_bytes(&all, &velocities, uvs.as_ref());
            files.push(self.save("objects", frame, "ply", &bytes)?);
        }
        if self.scene.output.objects_usd {
            let frames = meshes.iter().zip(drawn.iter().zip(&self.names));
            let frames: Vec<usd::MeshFrame> = frames
                .map(|((points, velocities), (drawn, name))| usd::MeshFrame {
                    name,
                    points,
                    velocities,
                    triangles: drawn.triangles,
                    uvs: drawn.uvs,
                })
                .collect();
            let text = usd::clip("objects", frame, fps, usd::Units::OWN, &frames);
            files.push(self.save("objects", frame, "usda", text.as_bytes())?);
        }
        Ok(())
    }

    fn write_report(&self, frame: i32, report: &StepReport) -> Result<()> {
        let phase = |phase: &PhaseTime| json!({ "name": phase.name, "seconds": phase.time.as_secs_f64() });
        let phases: Vec<_> = report.phases.iter().map(phase).collect();
        let text = json!({
            "check": sealed::UNSTAMPED,
            "frame": frame,
            "removed_m3": report.removed_volume,
            "base_m3": report.base_volume,
            "touched_blocks": report.touched_blocks,
            "sweep_faces": report.sweep_faces,
            "crumbs": report.crumbs,
            "phases": phases,
        });
        let path = self.folder.join("report").join(format!("{frame:04}.json"));
        atomic::write_bytes(&path, sealed::stamp(&format!("{text:#}\n")).as_bytes())
    }
}

/// A frame's .vdb file.
///
/// # Errors
/// What OpenVDB reports.
pub(super) fn vdb_bytes(scene: &Scene, frame: i32, grids: &[&FloatGrid], inputs: &str) -> Result<Vec<u8>> {
    let fps = scene.shot.fps;
    let text = |text: &str| MetaValue::Text(text.into());
    let metadata = vec![
        ("frazil:frame".into(), MetaValue::Int(frame.into())),
        ("frazil:fps".into(), MetaValue::Double(fps)),
        ("frazil:seconds".into(), MetaValue::Double(f64::from(frame) / fps)),
        ("frazil:units".into(), text("metres")),
        ("frazil:up".into(), text("y")),
        ("frazil:version".into(), text(env!("CARGO_PKG_VERSION"))),
        ("frazil:inputs".into(), text(inputs)),
    ];
    to_bytes(grids, &WriteOptions { metadata, half: scene.output.half, ..WriteOptions::default() })
}
