//! The stage `surface`: a detailed mesh follows the particles of a liquid.

use std::sync::Arc;

use serde_json::json;

use super::time::Liquid;
use super::trail::Trail;
use super::{Inputs, Surface, kept};
use crate::base::arrays::{Number, On};
use crate::base::{DetailedMesh, MeshArray, TriMesh, Vec3};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::io::manifest::Keeps;
use crate::io::{mesh, usd, usd_primvars};
use crate::scene::shot::{
    CONTENT, Clip, FrameFiles, Kind, MovingMesh, Prims, Reads, Report, Settings, Stage, Stepped, Stepping,
    Stored, To,
};
use crate::scene::text::keys::{first_of, settings_of};
use crate::scene::{Scene, System};
use crate::surface::{Apart, Change, Params, StepReport, Tracker, carry_attributes};

/// Name of the stage, and kind of its files.
const NAME: &str = "surface";
/// What the clips of `surface/` share.
const MANIFEST: &str = "surface/surface.manifest.usda";

/// The stage for a scene.
pub struct Track<'a> {
    scene: &'a Scene,
    surface: &'a Surface,
    inputs: &'a Inputs,
}

/// The mesh at a frame.
#[derive(Clone)]
struct Now {
    tracker: Tracker,
    /// What it carries; none: what it began with.
    detail: Option<Arc<DetailedMesh>>,
}

/// The mesh at a frame, with what led there.
struct At {
    now: Now,
    report: StepReport,
    /// Count of particles.
    particles: usize,
    way: Way,
}

/// How the vertices of the frame before went to a frame.
#[derive(Default)]
pub(super) struct Way {
    /// Velocities over it (m/s) of the vertices of the frame before; empty at the first frame.
    pub of_before: Vec<Vec3>,
    /// Velocities over it of the vertices at its end.
    pub of_after: Vec<Vec3>,
}

/// State carried from frame to frame.
pub struct State<'a> {
    liquid: Liquid<'a>,
    /// The mesh after the last frame; none before the first.
    now: Option<Now>,
    /// The mesh at the coming frame, where it is known.
    ahead: Option<At>,
}

/// Input of the writer: the mesh at a frame, if its files are written.
pub struct Step(Option<Written>);

struct Written {
    places: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// What the mesh carries; none: what it began with.
    detail: Option<Arc<DetailedMesh>>,
    velocities: Vec<Vec3>,
    delta: Vec<f32>,
    flags: Vec<bool>,
    state: Vec<u8>,
}

impl<'a> Track<'a> {
    /// The stage for a scene.
    pub fn new(scene: &'a Scene, surface: &'a Surface, inputs: &'a Inputs) -> Self {
        Self { scene, surface, inputs }
    }

    fn params(&self) -> Params {
        Params {
            spacing: self.inputs.spacing,
            cell: self.surface.cell,
            change: self.surface.change,
            weighting: self.surface.weighting,
            half_life: self.surface.half_life.unwrap_or(f64::INFINITY),
            fade: self.surface.fade,
            rebuild: self.surface.rebuild,
        }
    }

    /// An error of the mesh, with its file.
    fn told(&self, error: Error) -> Error {
        match error {
            Error::Argument(what) => {
                Error::file(self.surface.mesh.as_ref().unwrap_or(&self.surface.particles), what)
            }
            other => other,
        }
    }

    /// Tells a mesh which of its detail never fades.
    fn set_lasting(&self, tracker: &mut Tracker) -> Result<()> {
        tracker.set_lasting(self.inputs.lasting.clone()).map_err(|error| self.told(error))
    }

    /// The mesh at the first frame.
    fn first(&self, ctx: &Context, liquid: &mut Liquid<'_>) -> Result<At> {
        let frames = self.scene.shot.frames;
        let particles = liquid.at(self.surface.time(frames, frames.first))?;
        let begun = ctx.step(4, || Tracker::begin(ctx, self.params(), &self.inputs.mesh.mesh, &particles));
        let ((mut tracker, report), phases) = begun.map_err(|error| self.told(error))?;
        self.set_lasting(&mut tracker)?;
        let report = StepReport { phases, ..report };
        let now = Now { tracker, detail: None };
        Ok(At { now, report, particles: particles.places.len(), way: Way::default() })
    }

    /// Takes the mesh to a frame from the one before it.
    fn next(&self, ctx: &Context, liquid: &mut Liquid<'_>, before: &Now, frame: i32) -> Result<At> {
        let mut now = before.clone();
        let way = liquid.way(frame);
        let mut report = StepReport::default();
        let mut trail = Trail::of(before.tracker.vertices());
        let mut from = liquid.at(way[0])?;
        // What the step after each goes to; beyond the shot it need not be there.
        let beyond = liquid.way(frame + 1)[1];
        let is_there = self.surface.rebuild && frame < self.scene.shot.frames.last;
        let behind = way[2..].iter().copied().map(Some).chain([is_there.then_some(beyond)]);
        for (ends, behind) in way.windows(2).zip(behind) {
            let to = liquid.at(ends[1])?;
            let dt = (ends[1] - ends[0]) * liquid.file_time();
            if let Some(behind) = behind
                && let Ok(particles) = liquid.at(behind)
            {
                now.tracker.set_ahead(particles);
            }
            let step = now.tracker.step(ctx, &from, &to, dt).map_err(|error| liquid.told(ends[0], error))?;
            let share = (ends[1] - way[0]) / (way[way.len() - 1] - way[0]);
            match &step.change {
                Some(change) => {
                    trail.follow(&change.before, share);
                    now.detail = Some(Arc::new(self.carried(&now, change)));
                    trail.change(change);
                }
                None => trail.follow(now.tracker.vertices(), share),
            }
            report = report.followed_by(step);
            from = to;
        }
        let way = trail.way(now.tracker.vertices(), now.tracker.triangles(), self.scene.shot.fps);
        Ok(At { now, report, particles: from.places.len(), way })
    }

    /// What the mesh carries after a change; its places are those of the change.
    fn carried(&self, now: &Now, change: &Change) -> DetailedMesh {
        let carried = now.detail.as_deref().unwrap_or(&self.inputs.mesh);
        let triangles = carried.mesh.triangles.clone();
        let mesh = TriMesh { positions: usd::to_floats(&change.before), triangles };
        let old = DetailedMesh { mesh, uvs: carried.uvs.clone(), arrays: carried.arrays.clone() };
        carry_attributes(&old, now.tracker.mesh(), &change.origins, &change.sources)
    }

    /// The mesh at the coming frame, where anything needs it. Beyond the shot's end it is only for velocities, and a cache need not have
    /// it.
    fn ahead(&self, ctx: &Context, liquid: &mut Liquid<'_>, now: &Now, frame: i32) -> Result<Option<At>> {
        let is_last = frame == self.scene.shot.frames.last;
        if !is_last {
            return self.next(ctx, liquid, now, frame + 1).map(Some);
        }
        let ahead = self.reads(frame).ahead;
        if ahead.is_empty() || !ahead.iter().all(|path| path.is_file()) {
            return Ok(None);
        }
        match self.next(ctx, liquid, now, frame + 1) {
            Ok(next) => Ok(Some(next)),
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(error) => {
                log::warn!("{error}; frame {frame} has the velocities of the frame before");
                Ok(None)
            }
        }
    }

    /// The arrays that each frame has anew.
    fn arrays(&self, delta: &[f32], flags: &[bool]) -> Vec<MeshArray> {
        let of_vertices =
            |name: &str, number, values| MeshArray { name: name.into(), on: On::Vertices, number, values };
        let output = self.surface.output;
        let delta = output.delta.then(|| {
            let values = delta.iter().map(|delta| f64::from(*delta)).collect();
            of_vertices("delta", Number::F32, values)
        });
        let flagged = output.flagged.then(|| {
            let values = flags.iter().map(|flag| f64::from(u8::from(*flag))).collect();
            of_vertices("flagged", Number::U8, values)
        });
        delta.into_iter().chain(flagged).collect()
    }
}

impl Stage for Track<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn noun(&self) -> &'static str {
        "mesh"
    }

    fn kinds(&self) -> &'static [Kind] {
        &[Kind { name: NAME, extensions: &["ply", "usda", "obj"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        let output = self.surface.output;
        output.ply || output.usd || output.obj
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn keeps_every_state(&self) -> bool {
        true
    }

    fn loose_files(&self) -> &'static [&'static str] {
        if self.surface.output.usd { &[MANIFEST] } else { &[] }
    }

    fn settings(&self) -> Result<Settings> {
        let seen = &self.inputs.seen;
        let mut settings = settings_of(self.scene, NAME, seen, &[])?;
        settings.insert("surface.particles".into(), format!("{CONTENT}of each frame"));
        settings.insert("surface.spacing".into(), format!("{:?}", self.inputs.spacing));
        if let Some(path) = &self.surface.mesh {
            settings.insert("surface.mesh".into(), format!("{CONTENT}{}", seen.hash(path)?));
        }
        Ok(settings)
    }

    fn of_first_state(&self, settings: &Settings) -> Settings {
        first_of(System::Surface, settings, NAME)
    }

    fn reads(&self, frame: i32) -> Reads {
        let frames = self.scene.shot.frames;
        let time = |frame: i32| self.surface.time(frames, frame);
        let from = if frame == frames.first { time(frame) } else { time(frame - 1) };
        // What is read anyway is not of the coming frame alone.
        let files = self.surface.files(from, time(frame));
        let output = self.surface.output;
        let has_velocities = output.velocities || output.usd;
        let mut ahead = self.surface.files(time(frame), time(frame + 1));
        ahead.retain(|path| has_velocities && !files.contains(path));
        Reads { files, ahead }
    }

    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::State
    }

    fn clip(&self) -> Option<Clip<'_>> {
        let (mesh, of_frame) = (&self.inputs.mesh, self.arrays(&[], &[]));
        let arrays: Vec<&MeshArray> = mesh.arrays.iter().chain(&of_frame).collect();
        let primvars = usd_primvars::primvars(&arrays);
        let meshes = vec![MovingMesh { name: NAME.into(), uvs: mesh.uvs.as_ref(), primvars }];
        Some(Clip { kind: NAME, manifest: MANIFEST, prims: Prims::Meshes(meshes) })
    }
}

impl<'a> Stepping for Track<'a> {
    type State = State<'a>;
    type Step = Step;
    type Writer = ();

    fn load(&self, ctx: &Context, done: &Stored, after: Option<i32>) -> Result<State<'a>> {
        let mut liquid = Liquid::new(self.surface, self.scene.shot, &self.inputs.seen);
        let now = match after {
            None => {
                // A mesh that is not where the particles are is refused before anything is written.
                let ahead = Some(self.first(ctx, &mut liquid)?);
                return Ok(State { liquid, now: None, ahead });
            }
            Some(frame) => {
                let path = done.state_file(frame)?;
                let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
                let resumed = kept::resume(self.params(), &self.inputs.mesh, &bytes);
                let (mut tracker, detail) = resumed.map_err(|error| Error::file(path, error.to_string()))?;
                let detail = detail.map(|detail| {
                    let triangles = tracker.triangles().to_vec();
                    Arc::new(DetailedMesh { mesh: TriMesh { positions: Vec::new(), triangles }, ..detail })
                });
                if !tracker.is_rebuilt() {
                    self.set_lasting(&mut tracker)?;
                }
                Some(Now { tracker, detail })
            }
        };
        Ok(State { liquid, now, ahead: None })
    }

    fn step(&self, ctx: &Context, state: &mut State<'a>, to: &To<'_>) -> Result<Stepped<Step>> {
        let State { liquid, now, ahead } = state;
        let At { now: at, report, particles, way } = match (ahead.take(), &now) {
            (Some(ahead), _) => ahead,
            (None, Some(before)) => self.next(ctx, liquid, before, to.frame)?,
            (None, None) => return Err(Error::Internal("a mesh was not begun".into())),
        };
        let next = self.ahead(ctx, liquid, &at, to.frame)?;
        let tracker = &at.tracker;
        // Over the coming frame, or where that is not known over the one before.
        let velocities = match &next {
            Some(next) => next.way.of_before.clone(),
            None if way.of_after.is_empty() => vec![Vec3::zeros(); tracker.vertices().len()],
            None => way.of_after,
        };
        let step = to.made_from.map(|_| Written {
            places: usd::to_floats(tracker.vertices()),
            triangles: tracker.triangles().to_vec(),
            detail: at.detail.clone(),
            velocities,
            delta: tracker.delta().to_vec(),
            flags: tracker.flags().to_vec(),
            state: kept::save(tracker, at.detail.as_deref().unwrap_or(&self.inputs.mesh)),
        });
        let report = told(&report, particles, tracker);
        (*now, *ahead) = (Some(at), next);
        Ok(Stepped { step: Step(step), report })
    }

    fn writer(&self, _ctx: &Context, _state: &State<'a>) -> Result<()> {
        Ok(())
    }

    fn write(&self, _writer: &mut (), step: Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(step), Some(files)) = (step.0, files) else { return Ok(()) };
        let (output, detail) = (self.surface.output, step.detail.as_deref().unwrap_or(&self.inputs.mesh));
        let of_frame = self.arrays(&step.delta, &step.flags);
        let arrays: Vec<&MeshArray> = detail.arrays.iter().chain(&of_frame).collect();
        let velocities = if output.velocities { &step.velocities[..] } else { &[] };
        let mesh = TriMesh { positions: step.places, triangles: step.triangles };
        let carried = mesh::Carried { velocities, uvs: detail.uvs.as_ref(), arrays: &arrays };
        if output.ply {
            files.save(NAME, "ply", &mesh::ply_bytes(&mesh, &carried))?;
        }
        if output.obj {
            files.save(NAME, "obj", &mesh::obj_bytes(&mesh, &carried))?;
        }
        if output.usd {
            let frame = usd::MeshFrame {
                name: NAME,
                points: &mesh.positions,
                velocities: &step.velocities,
                triangles: &mesh.triangles,
                uvs: detail.uvs.as_ref(),
                arrays: &arrays,
            };
            let text = usd::clip(NAME, files.frame, self.scene.shot.fps, usd::Units::OWN, &[frame]);
            files.save(NAME, "usda", text.as_bytes())?;
        }
        files.save_state(&step.state)
    }
}

/// Parts apart from the mesh that a report lists.
const LISTED: usize = 100;

fn told(report: &StepReport, particles: usize, tracker: &Tracker) -> Report {
    let (drops, bubbles): (Vec<&Apart>, Vec<&Apart>) =
        report.apart.iter().partition(|apart| apart.volume >= 0.0);
    let listed: Vec<serde_json::Value> = report
        .apart
        .iter()
        .take(LISTED)
        .map(|apart| json!({ "at_m": <[f64; 3]>::from(apart.place), "volume_m3": apart.volume }))
        .collect();
    let changed = |number: fn(&Change) -> usize| report.change.as_ref().map_or(0, number);
    let serde_json::Value::Object(results) = json!({
        "particles": particles,
        "born": report.born,
        "died": report.died,
        "vertices": tracker.vertices().len(),
        "flagged": report.flagged(),
        "jumped": report.jumped,
        "lost": report.lost,
        "uncovered": report.uncovered,
        "changed_cells": changed(|change| change.flagged_cells),
        "rebuilt_cells": changed(|change| change.rebuilt_cells),
        "rebuilt_rung": changed(|change| change.rung),
        "made_triangles": changed(|change| change.made_triangles()),
        "dry_parts": changed(|change| change.dry),
        "drops": drops.len(),
        "drops_m3": drops.iter().fold(0.0, |sum, drop| sum + drop.volume),
        "bubbles": bubbles.len(),
        "bubbles_m3": bubbles.iter().fold(0.0, |sum, bubble| sum - bubble.volume),
        "apart": listed,
        "parts": report.parts,
        "volume_m3": tracker.mesh().volume(),
        "particles_triangles": report.triangles,
    }) else {
        unreachable!("it is written as an object")
    };
    Report { results, phases: report.phases.clone() }
}
