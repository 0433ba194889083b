//! The stage `mist`: fast grains raise powder into the air.

use serde_json::json;

use super::frames::LayerReader;
use super::grain_reader::GrainReader;
use super::settings;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::flow::{Solids, Tiles};
use crate::geometry::points::Values;
use crate::geometry::{DVec3, TriMesh};
use crate::io::particles::ParticleData;
use crate::io::usd::{Field, Holds};
use crate::motion::{Keys, Rigid};
use crate::scene::run::settings::settings_of_first_state;
use crate::scene::run::{
    DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping, Volume,
};
use crate::scene::snow::inputs::Inputs;
use crate::scene::snow::keys::mist::mist_params;
use crate::scene::snow::wind::wind_file;
use crate::scene::vdb_metadata::{contents, metadata};
use crate::scene::{Scene, moving};
use crate::snow::mist::{self, Grids, Params, Source, Start, StepInputs, StepReport, Surroundings, Wind};
use crate::sweep::Body;
use crate::vdb::file::{self, WriteOptions, any_to_bytes};
use crate::vdb::{FloatGrid, GridRef};

/// Name of the stage, and of the kind of its files.
const NAME: &str = "mist";
/// Name of the grid of densities in its files.
const DENSITY: &str = "density";
/// Names of the grid of velocities that Houdini and Blender look for.
const VELOCITY: [&str; 2] = ["vel", "velocity"];

/// The stage for a scene.
pub struct Mist<'a> {
    pub scene: &'a Scene,
    pub inputs: &'a Inputs,
}

/// State carried from frame to frame.
pub struct State {
    mist: mist::Mist,
    /// Static objects, and the ground if it is a mesh.
    statics: Vec<Body>,
    grains: GrainReader,
    /// The previous frame, and the positions and velocities of its grains.
    starts: Option<(i32, Vec<(i64, Start)>)>,
    /// Reads the base layer after the previous frame.
    layer: LayerReader,
}

/// The density of the mist after a frame.
///
/// # Errors
/// A frame that does not exist; a file that was changed since it was written, or that has no such grid.
pub(in crate::scene::snow) fn density(stored: &DoneFrames, frame: i32) -> Result<FloatGrid> {
    file::read_own_named(&stored.file(frame, NAME)?, DENSITY)
}

impl Mist<'_> {
    fn params(&self) -> Result<Params> {
        mist_params(&self.scene.values).ok_or_else(|| Error::Internal("the scene has no mist".into()))
    }

    /// An error of the mist, with the scene's name.
    fn with_path(&self, error: Error) -> Error {
        error.in_file_at(&self.scene.path, "mist: ")
    }

    /// The grains that are fast enough in a frame to raise mist.
    fn sources(
        &self,
        ctx: &Context,
        state: &mut State,
        stored: &DoneFrames,
        frame: i32,
    ) -> Result<Vec<Source>> {
        let with_frame =
            |frame: i32, error| Error::file(stored.folder(), format!("frame {frame} of grains {error}"));
        let State { mist, grains, starts: cached, .. } = state;
        let starts = match cached.take() {
            Some((at, starts)) if at == frame - 1 => starts,
            _ => {
                let before = grains.particles(ctx, stored, frame - 1)?;
                starts_of(&before).map_err(|error| with_frame(frame - 1, error))?
            }
        };
        let grains = grains.particles(ctx, stored, frame)?;
        let sources = sources_of(&grains, &starts, frame, mist.params());
        let sources = sources.map_err(|error| with_frame(frame, error))?;
        *cached = Some((frame, starts_of(&grains).map_err(|error| with_frame(frame, error))?));
        Ok(sources)
    }

    /// Moves the mist through a frame.
    fn move_mist(&self, ctx: &Context, state: &mut State, to: &StepTarget<'_>) -> Result<StepReport> {
        let [base, grains] = to.upstream else {
            return Err(Error::Internal("mist reads two stages".into()));
        };
        let frame = to.frame;
        let sources = self.sources(ctx, state, grains, frame)?;
        let raises = sources.iter().any(|source| source.raises(state.mist.params()));
        // Air without mist is not simulated, so that obstacles have no effect.
        if !raises && state.mist.flow().tiles().active() == 0 {
            return Ok(StepReport::default());
        }
        let State { mist, statics, layer, .. } = state;
        // The layer before the frame: snow that objects remove during the frame bounds the air until they reach it, see `Surroundings`.
        let layer = layer.after(ctx, base, frame - 1)?;
        let moving = self.scene.objects.iter().filter(|object| object.role.moves());
        let pushing = self.inputs.bodies.iter().zip(moving).filter(|(_, object)| object.role.pushes());
        let (moving, removing): (Vec<&Body>, Vec<bool>) =
            pushing.map(|(body, object)| (body, object.role.removes())).unzip();
        let bodies: Vec<&Body> = moving.into_iter().chain(statics.iter()).collect();
        let around = Surroundings {
            base: Some(&layer.surface),
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
        let around = StepInputs { sources: &sources, boundary: &boundary, fastest, wind: wind.as_ref() };
        mist.step(ctx, &around, times).map_err(|error| self.with_path(error))
    }
}

/// The identities of grains, ascending, with their positions and velocities.
fn starts_of(grains: &ParticleData) -> Result<Vec<(i64, Start)>> {
    // A file without points has no attributes.
    if grains.positions.is_empty() {
        return Ok(Vec::new());
    }
    let (Values::Vector(velocities), Values::Long(ids)) = (attribute(grains, "v")?, attribute(grains, "id")?)
    else {
        return Err(Error::argument("have attributes v and id of other types"));
    };
    let start = |(grain, position): (usize, &DVec3)| {
        (ids.get(grain), Start { position: *position, velocity: velocities.get(grain) })
    };
    Ok(grains.positions.iter().enumerate().map(start).collect())
}

fn attribute<'a>(grains: &'a ParticleData, name: &str) -> Result<&'a Values> {
    grains.attribute(name).ok_or_else(|| Error::argument(format!("have no attribute {name}")))
}

/// Grains after a frame as sources of mist, with their positions before it; grains that are too slow are left out.
fn sources_of(
    grains: &ParticleData,
    starts: &[(i64, Start)],
    frame: i32,
    params: &Params,
) -> Result<Vec<Source>> {
    if grains.positions.is_empty() {
        return Ok(Vec::new());
    }
    let all = ["v", "id", "pscale", "source_frame", "rest"].map(|name| attribute(grains, name));
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
    let source = |(grain, position): (usize, &DVec3)| {
        let start = match starts.binary_search_by_key(&ids.get(grain), |(id, _)| *id) {
            Ok(index) => Some(starts[index].1),
            // It was born in this frame, at rest.
            Err(_) if births.get(grain) == frame => {
                Some(Start { position: DVec3::from(rests.get(grain).map(f64::from)), velocity: [0.0; 3] })
            }
            Err(_) => None,
        };
        Source {
            position: *position,
            velocity: velocities.get(grain),
            radius: f64::from(radii.get(grain)),
            start,
        }
    };
    Ok(grains.positions.iter().enumerate().map(source).filter(|source| source.raises(params)).collect())
}

/// A mesh as a body at rest; `None` if it has no triangles.
fn static_body(mesh: &TriMesh) -> Option<Result<Body>> {
    let body = || Body::new(Box::new(Rigid::new(mesh.clone(), Keys::default())), 0.0);
    (!mesh.triangles.is_empty()).then(body)
}

impl Stage for Mist<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: NAME, extensions: &["vdb"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        self.scene.output.mist
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn settings(&self) -> Result<Settings> {
        let wind = wind_file(self.scene).map(|path| ("mist.wind", path));
        settings::of_stage(self.scene, self.name(), &self.inputs.input_hashes, wind)
    }

    fn first_state_settings(&self, settings: &Settings) -> Settings {
        settings_of_first_state(self.scene.values.keys(), settings, NAME)
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

    fn volumes(&self) -> Vec<Volume> {
        const fn fields(velocity: &'static str) -> [Field; 2] {
            [Field::of(DENSITY, Holds::Density(1.0)), Field::of(velocity, Holds::Vector)]
        }
        const OF_HOUDINI: &[Field] = &fields(VELOCITY[0]);
        const OF_BLENDER: &[Field] = &fields(VELOCITY[1]);
        let fields = if self.scene.output.blender_names { OF_BLENDER } else { OF_HOUDINI };
        vec![Volume { kind: NAME, prim: NAME, fields, is_guide: false }]
    }
}

impl Stepping for Mist<'_> {
    type State = State;
    /// The mist after a step, if its files are written.
    type Step = Option<mist::Mist>;
    /// Provides the threads. Its cancel flag is ignored: a frame that was begun is finished.
    type Writer = Context;

    fn load(&self, _ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<State> {
        let params = self.params()?;
        let mist = match after {
            None => mist::Mist::new(params).map_err(|error| self.with_path(error))?,
            Some(frame) => done.resume(frame, |bytes| mist::Mist::resume(params, bytes))?,
        };
        let statics = self.inputs.statics().iter().chain(self.inputs.ground());
        let statics = statics.filter_map(static_body).collect::<Result<_>>()?;
        Ok(State {
            mist,
            statics,
            grains: GrainReader::default(),
            starts: None,
            layer: LayerReader::default(),
        })
    }

    fn step(&self, ctx: &Context, state: &mut State, to: &StepTarget<'_>) -> Result<Stepped<Self::Step>> {
        // At the first frame nothing has moved yet.
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
        Ok(Stepped { step: to.made_from.map(|_| state.mist.clone()), report: report_of(&report) })
    }

    fn writer(&self, ctx: &Context, _state: &State) -> Result<Context> {
        Ok(Context::new(ctx.pool().clone()))
    }

    fn write(&self, ctx: &mut Context, step: Self::Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(mist), Some(files)) = (step, files) else { return Ok(()) };
        if self.scene.output.mist {
            let Grids { density, mut velocity } = Grids::of(ctx, &mist)?;
            velocity.set_name(VELOCITY[usize::from(self.scene.output.blender_names)])?;
            let metadata = metadata(self.scene, files.frame, files.made_from);
            let grids = [GridRef::Floats(&density), GridRef::Vectors(&velocity)];
            let options =
                WriteOptions { metadata, half: self.scene.output.mist_half, ..WriteOptions::default() };
            files.save(NAME, "vdb", &any_to_bytes(&grids, &options)?)?;
            files.describe(NAME, &contents(&[&density]));
        }
        files.save_state(&mist.save())
    }
}

fn report_of(report: &StepReport) -> Report {
    let results = json!({
        "cells": report.cells,
        "mist_m3": report.mass,
        "sources": report.sources,
        "sub_steps": report.sub_steps,
        "iterations": report.iterations,
        "divergence": report.divergence,
        "fastest_m_per_s": report.fastest,
    });
    Report::new(results, report.phases.clone())
}
