//! The stage `mist`: fast grains raise powder into the air.

use serde_json::json;

use super::frames;
use super::grain_files::Whole;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::flow::{Solids, Tiles};
use crate::geometry::points::Values;
use crate::geometry::{DVec3, Points, TriMesh};
use crate::io::records::manifest::Keeps;
use crate::io::usd::{Field, Holds};
use crate::motion::{Keys, Rigid};
use crate::scene::run::settings::{first_of, settings_of};
use crate::scene::run::{
    FrameFiles, Kind, Reads, Report, Settings, Stage, Stepped, Stepping, Stored, To, Volume,
};
use crate::scene::snow::inputs::Inputs;
use crate::scene::snow::keys::mist::mist_params;
use crate::scene::snow::wind::wind_file;
use crate::scene::{Role, Scene, moving};
use crate::snow::base_layer;
use crate::snow::mist::{self, Around, Grids, Params, Source, Start, StepReport, Surroundings, Wind};
use crate::sweep::Body;
use crate::vdb::file::any_to_bytes;
use crate::vdb::write_options::WriteOptions;
use crate::vdb::{FloatGrid, GridRef, file};

/// Name of the stage, and of the kind of its files.
const NAME: &str = "mist";
/// Name of the grid of densities in its files.
const DENSITY: &str = "density";

/// The stage for a scene.
pub struct Mist<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
}

/// State carried from frame to frame.
pub struct State {
    mist: mist::Mist,
    /// Static objects, and the ground if it is a mesh.
    statics: Vec<Body>,
    /// The grains after a frame.
    grains: Whole,
    /// Grains' positions and velocities after a frame: the one before the frame being made.
    starts: Option<(i32, Vec<(i64, Start)>)>,
    /// The base layer after a frame: the one before the frame being made.
    layer: Option<(i32, base_layer::Grids)>,
}

/// Input of the writer: the mist after a step, if its files are written.
pub struct Step(Option<mist::Mist>);

/// Writes frames.
pub struct Writer {
    /// Provides the threads. Its cancel flag is ignored: a frame that was begun is finished.
    ctx: Context,
}

/// The density of the mist after a frame.
///
/// # Errors
/// A frame that does not exist; a file that was changed since it was written, or that has no such grid.
pub(in crate::scene::snow) fn density(stored: &Stored, frame: i32) -> Result<FloatGrid> {
    file::read_own_named(&stored.file(frame, NAME)?, DENSITY)
}

impl<'a> Mist<'a> {
    /// The stage for a scene.
    pub fn new(scene: &'a Scene, inputs: &'a Inputs) -> Self {
        Self { scene, inputs }
    }

    fn params(&self) -> Result<Params> {
        mist_params(&self.scene.values).ok_or_else(|| Error::Internal("the scene has no mist".into()))
    }

    /// An error of the mist, with the scene's name.
    fn with_path(&self, error: Error) -> Error {
        match error {
            Error::Argument(what) => Error::file(&self.scene.path, format!("mist: {what}")),
            other => other,
        }
    }

    /// The grains of a frame that may raise mist.
    fn sources(&self, ctx: &Context, state: &mut State, stored: &Stored, frame: i32) -> Result<Vec<Source>> {
        let of_frame =
            |frame: i32, error| Error::file(stored.folder(), format!("frame {frame} of grains {error}"));
        let State { mist, grains, starts: known, .. } = state;
        let starts = match known.take() {
            Some((at, starts)) if at == frame - 1 => starts,
            _ => {
                let (before, _) = grains.points(ctx, stored, frame - 1)?;
                starts_of(before).map_err(|error| of_frame(frame - 1, error))?
            }
        };
        let (points, _) = grains.points(ctx, stored, frame)?;
        let sources = sources_of(points, &starts, frame, mist.params());
        let sources = sources.map_err(|error| of_frame(frame, error))?;
        *known = Some((frame, starts_of(points).map_err(|error| of_frame(frame, error))?));
        Ok(sources)
    }

    /// Moves the mist through a frame.
    fn move_mist(&self, ctx: &Context, state: &mut State, to: &To<'_>) -> Result<StepReport> {
        let [base, grains] = to.upstream else {
            return Err(Error::Internal("mist reads two stages".into()));
        };
        let frame = to.frame;
        let sources = self.sources(ctx, state, grains, frame)?;
        let raises = sources.iter().any(|source| source.raises(state.mist.params()));
        // Air without mist is not computed, so that its obstacles do not matter.
        if !raises && state.mist.flow().tiles().active() == 0 {
            return Ok(StepReport::default());
        }
        // Snow removed in this frame bounds the air until the objects reach it: see `Surroundings`.
        self.go_to(ctx, state, base, frame - 1)?;
        let State { mist, statics, layer, .. } = state;
        let moving = self.scene.objects.iter().filter(|object| object.role.moves());
        let pushing = self.inputs.bodies.iter().zip(moving).filter(|(_, object)| object.role.pushes());
        let (moving, removing): (Vec<&Body>, Vec<bool>) =
            pushing.map(|(body, object)| (body, object.role.removes())).unzip();
        let bodies: Vec<&Body> = moving.into_iter().chain(statics.iter()).collect();
        let around = Surroundings {
            base: layer.as_ref().map(|(_, layer)| &layer.surface),
            bodies: &bodies,
            removing: &removing,
            floor: self.inputs.floor(),
        };
        let time = |frame: i32| f64::from(frame) / self.scene.shot.fps;
        let times = [time(frame - 1), time(frame)];
        let walls = around.during(times, mist.params().cell)?;
        let boundary =
            |tiles: &Tiles, cell: f32, share: f64| -> Result<Solids> { walls.faces(ctx, tiles, cell, share) };
        let sample = |ctx: &Context, positions: &[DVec3]| match &self.inputs.wind {
            Some(wind) => wind.sample(ctx, positions, true),
            None => Ok(vec![[0.0; 3]; positions.len()]),
        };
        let wind = self.inputs.wind.as_ref().map(|_| Wind(&sample));
        let fastest = walls.fastest_near(mist, &sources);
        let around = Around { sources: &sources, boundary: &boundary, fastest, wind: wind.as_ref() };
        mist.step(ctx, &around, times).map_err(|error| self.with_path(error))
    }

    /// Advances the base layer to a frame.
    fn go_to(&self, ctx: &Context, state: &mut State, base: &Stored, frame: i32) -> Result<()> {
        let layer = match state.layer.take() {
            Some((at, mut layer)) if at == frame - 1 && base.keeps_changes(frame) => {
                frames::follow(ctx, base, &mut layer, frame)?;
                layer
            }
            _ => frames::grids(ctx, base, frame)?,
        };
        state.layer = Some((frame, layer));
        Ok(())
    }
}

/// The identities of grains, ascending, with their positions and velocities.
fn starts_of(points: &Points) -> Result<Vec<(i64, Start)>> {
    // A file without points has no attributes.
    if points.count() == 0 {
        return Ok(Vec::new());
    }
    let (Values::Vector(velocities), Values::Long(ids)) = (attribute(points, "v")?, attribute(points, "id")?)
    else {
        return Err(Error::argument("have attributes v and id of other types"));
    };
    let start = |point| Start { position: points.position(point), velocity: velocities.get(point) };
    Ok((0..points.count()).map(|point| (ids.get(point), start(point))).collect())
}

fn attribute<'a>(points: &'a Points, name: &str) -> Result<&'a Values> {
    points.attribute(name).ok_or_else(|| Error::argument(format!("have no attribute {name}")))
}

/// Grains after a frame as sources of mist, with their positions before it; without those that are too slow.
fn sources_of(points: &Points, starts: &[(i64, Start)], frame: i32, params: &Params) -> Result<Vec<Source>> {
    if points.count() == 0 {
        return Ok(Vec::new());
    }
    let all = ["v", "id", "pscale", "source_frame", "rest"].map(|name| attribute(points, name));
    let [v, id, pscale, source_frame, rest] = all;
    let (
        Values::Vector(velocities),
        Values::Long(ids),
        Values::Float(radii),
        Values::Int(births),
        Values::Vector(rests),
    ) = (v?, id?, pscale?, source_frame?, rest?)
    else {
        return Err(Error::argument("have attributes of other types"));
    };
    let source = |point: usize| {
        let known = starts.binary_search_by_key(&ids.get(point), |(id, _)| *id);
        let start = match known {
            Ok(index) => Some(starts[index].1),
            // It was born in this frame, at rest.
            Err(_) if births.get(point) == frame => {
                Some(Start { position: DVec3::from(rests.get(point).map(f64::from)), velocity: [0.0; 3] })
            }
            Err(_) => None,
        };
        Source {
            position: points.position(point),
            velocity: velocities.get(point),
            radius: f64::from(radii.get(point)),
            start,
        }
    };
    Ok((0..points.count()).map(source).filter(|source| source.raises(params)).collect())
}

/// A mesh as a body at rest; `None` if it has no triangles.
fn still(mesh: &TriMesh) -> Option<Result<Body>> {
    let body = || Body::new(Box::new(Rigid::new(mesh.clone(), Keys::default())), 0.0);
    (!mesh.triangles.is_empty()).then(body)
}

impl Stage for Mist<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn kinds(&self) -> &'static [Kind] {
        &[Kind { name: NAME, extensions: &["vdb"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        self.scene.output.mist
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn settings(&self) -> Result<Settings> {
        let roles = [&Role::MOVING[..], &[Role::Static]].concat();
        let mut settings = settings_of(self.scene, self.name(), &self.inputs.seen, &roles)?;
        let files = self.scene.snow.iter().flat_map(|snow| snow.files());
        let ground = files.filter(|(key, _)| *key == "snow.ground").map(|(key, path)| (key, path.clone()));
        let wind = wind_file(self.scene).map(|path| ("mist.wind", path.to_path_buf()));
        for (key, path) in ground.chain(wind) {
            let hash = self.inputs.seen.hash(&path)?;
            settings.insert(key.into(), format!("{}{hash}", crate::scene::run::CONTENT));
        }
        Ok(settings)
    }

    fn of_first_state(&self, settings: &Settings) -> Settings {
        first_of(self.scene.values.keys(), settings, NAME)
    }

    fn upstream(&self) -> &'static [&'static str] {
        &["base", "grains"]
    }

    fn reads_state_of(&self, upstream: &str) -> bool {
        // Grains are read from their files.
        upstream != "grains"
    }

    fn reads(&self, frame: i32) -> Reads {
        Reads { files: moving::files(self.scene, frame), ahead: Vec::new() }
    }

    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::State
    }

    fn volumes(&self) -> Vec<Volume> {
        const FIELDS: &[Field] = &[Field::of(DENSITY, Holds::Density(1.0)), Field::of("vel", Holds::Vector)];
        vec![Volume { kind: NAME, prim: NAME, fields: FIELDS, is_guide: false }]
    }
}

impl Stepping for Mist<'_> {
    type State = State;
    type Step = Step;
    type Writer = Writer;

    fn load(&self, _ctx: &Context, done: &Stored, after: Option<i32>) -> Result<State> {
        let params = self.params()?;
        let mist = match after {
            None => mist::Mist::new(params).map_err(|error| self.with_path(error))?,
            Some(frame) => {
                let path = done.state_file(frame)?;
                let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
                mist::Mist::resume(params, &bytes).map_err(|error| Error::file(path, error.to_string()))?
            }
        };
        let statics = self.inputs.statics().iter().chain(self.inputs.ground());
        let statics = statics.filter_map(still).collect::<Result<_>>()?;
        Ok(State { mist, statics, grains: Whole::default(), starts: None, layer: None })
    }

    fn step(&self, ctx: &Context, state: &mut State, to: &To<'_>) -> Result<Stepped<Step>> {
        // Before the first frame nothing moves.
        let report = match to.frame == self.scene.shot.frames.first {
            true => StepReport::default(),
            false => self.move_mist(ctx, state, to)?,
        };
        if to.frame == self.scene.shot.frames.last && report.sources == 0 && report.mass == 0.0 {
            let speed = state.mist.params().from_speed;
            log::warn!(
                "frame {}: no mist is left: grains raise it while they are faster than mist.from_speed = {speed} m/s",
                to.frame
            );
        }
        Ok(Stepped { step: Step(to.made_from.map(|_| state.mist.clone())), report: report_of(&report) })
    }

    fn writer(&self, ctx: &Context, _state: &State) -> Result<Writer> {
        Ok(Writer { ctx: Context::new(ctx.pool().clone()) })
    }

    fn write(&self, writer: &mut Writer, step: Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(mist), Some(files)) = (step.0, files) else { return Ok(()) };
        if self.scene.output.mist {
            let grids = Grids::of(&writer.ctx, &mist)?;
            let metadata = frames::metadata(self.scene, files.frame, files.made_from);
            let grids = [GridRef::Floats(&grids.density), GridRef::Vectors(&grids.velocity)];
            let options = WriteOptions { metadata, ..WriteOptions::default() };
            files.save(NAME, "vdb", &any_to_bytes(&grids, &options)?)?;
        }
        files.save_state(&mist.save())
    }
}

fn report_of(report: &StepReport) -> Report {
    let serde_json::Value::Object(results) = json!({
        "cells": report.cells,
        "mist_m3": report.mass,
        "sources": report.sources,
        "sub_steps": report.sub_steps,
        "iterations": report.iterations,
        "divergence": report.divergence,
        "fastest_m_per_s": report.fastest,
    }) else {
        unreachable!("it is written as an object")
    };
    Report { results, phases: report.phases.clone() }
}
