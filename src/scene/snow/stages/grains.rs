//! The stage `grains`: snow removed from the base is pushed, piled and thrown.

use std::sync::OnceLock;

use serde_json::json;

use super::grain_files::{self, WHOLE_EVERY, for_clips, ordered};
use super::{frames, settings};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::{Points, TriMesh};
use crate::io::particles::ply;
use crate::io::usd::{ClipPrims, Clips, points};
use crate::scene::run::settings::settings_of_first_state;
use crate::scene::run::{
    DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping,
};
use crate::scene::schema::declaration::OBJECT;
use crate::scene::snow::estimate::grains::{Forecast, Removed};
use crate::scene::snow::grain_params::params;
use crate::scene::snow::initial_grains;
use crate::scene::snow::inputs::Inputs;
use crate::scene::{self, Scene, moving};
use crate::snow::base_layer::Grids;
use crate::snow::grains::{self, Base, Ground, Object, StepReport, Surroundings};
use crate::sweep::Body;

/// The stage for a scene.
pub struct Grains<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
    /// The moving objects, with their parameters for grains.
    objects: Vec<Object<'a>>,
    /// Built when a frame first needs it.
    static_geometry: OnceLock<StaticGeometry<'a>>,
}

/// The ground and the static objects.
struct StaticGeometry<'a> {
    /// The ground's mesh, and static objects that are solids.
    ground: Vec<Ground>,
    /// Other static objects.
    sheets: Vec<&'a TriMesh>,
}

impl<'a> StaticGeometry<'a> {
    fn of(inputs: &'a Inputs) -> Self {
        let (solids, sheets): (Vec<_>, Vec<_>) =
            inputs.statics().iter().partition(|mesh| Ground::is_solid(mesh));
        let ground = solids.into_iter().chain(inputs.ground()).map(Ground::new).collect();
        Self { ground, sheets }
    }
}

/// State carried from frame to frame.
pub struct State {
    grains: grains::Grains,
    /// The previous frame, and the base layer after it.
    layer: Option<(i32, Grids)>,
    /// Whether the warning about grains that fell past the edge of the ground was logged.
    has_warned: bool,
}

/// Writes frames.
pub struct Writer {
    /// Provides the threads. Its cancel flag is ignored: a frame that was begun is finished.
    ctx: Context,
    /// The grains of the previous frame, if changes are written.
    before: Option<Points>,
}

/// Depth (m) below the lowest point of ground and snow at which falling grains are removed.
const FALL_DEPTH: f64 = 1.0;

impl<'a> Grains<'a> {
    /// The stage for a scene.
    pub fn new(scene: &'a Scene, inputs: &'a Inputs) -> Self {
        let moving = scene.objects.iter().enumerate().filter(|(_, object)| object.role.moves());
        let object = |((index, object), body): ((usize, &scene::Object), &'a Body)| {
            let keys = scene.values.element(OBJECT, index);
            Object {
                body,
                friction: keys.get("friction"),
                stick: keys.get("stick"),
                compression: keys.find("compression"),
                removes: object.role.removes(),
                pushes: object.role.pushes(),
            }
        };
        let objects = moving.zip(&inputs.bodies).map(object).collect();
        Self { scene, inputs, objects, static_geometry: OnceLock::new() }
    }

    /// Adds the initial grains, except those in the snow or below the ground; returns the first frame's report.
    fn emit_initial(&self, ctx: &Context, grains: &mut grains::Grains, layer: &Grids) -> Result<Report> {
        let Some(initial) = &self.inputs.initial_grains else { return Ok(Report::default()) };
        let path = initial_grains::file(self.scene).unwrap_or(&self.scene.path);
        let frame = self.scene.shot.frames.first;
        let all = initial.positions.len();
        let (positions, velocities) = initial.outside(
            ctx,
            (self.inputs.ground(), self.inputs.floor()),
            &layer.surface,
            grains.params().radius,
        )?;
        let left_out = all - positions.len();
        if left_out > 0 {
            log::warn!(
                "{}: {left_out} of {all} points lie in the snow or below the ground at frame {frame} and are left out",
                path.display()
            );
        }
        grains
            .emit(&positions, &velocities, frame)
            .map_err(|error| Error::file(path, format!("as grains: {error}")))?;
        Ok(Report::new(json!({ "grains": grains.count(), "left_out": left_out }), Vec::new()))
    }

    /// Whether the files of a frame contain only changes.
    fn is_delta(&self, frame: i32) -> bool {
        let passed = i64::from(frame) - i64::from(self.scene.shot.frames.first);
        self.scene.output.grains_delta && passed % i64::from(WHOLE_EVERY) != 0
    }

    /// The base layer after a frame; made from the layer before it if that is given and the frame stores changes.
    fn layer(&self, ctx: &Context, stored: &DoneFrames, before: Option<&Grids>, frame: i32) -> Result<Grids> {
        match before {
            Some(before) if stored.keeps_changes(frame) => {
                let mut layer = before.deep_copy()?;
                frames::apply_changes(ctx, stored, &mut layer, frame)?;
                Ok(layer)
            }
            _ => frames::layer_at(ctx, stored, frame),
        }
    }

    fn move_grains(
        &self,
        ctx: &Context,
        state: &mut State,
        layers: [&Grids; 2],
        frame: i32,
    ) -> Result<StepReport> {
        let (floor, ground) = (self.inputs.floor(), self.inputs.ground());
        let static_geometry = self.static_geometry.get_or_init(|| StaticGeometry::of(self.inputs));
        let surface = &layers[1].surface;
        let layer_bottom =
            surface.active_bbox().map_or(0.0, |(low, _)| f64::from(low[1]) * surface.voxel_size());
        let ground_bottom = ground.and_then(|mesh| mesh.bounds()).map(|(low, _)| f64::from(low.y));
        let bottom = [floor, ground_bottom].into_iter().flatten().fold(layer_bottom, f64::min);
        let around = Surroundings {
            base: Base::Whole([&layers[0].surface, surface]),
            objects: &self.objects,
            statics: &static_geometry.sheets,
            ground: &static_geometry.ground,
            floor,
            lowest: bottom - FALL_DEPTH,
        };
        let time = |frame: i32| f64::from(frame) / self.scene.shot.fps;
        let step = state.grains.step(ctx, &around, [time(frame - 1), time(frame)], frame);
        let report = step.map_err(|error| error.in_file_at(&self.scene.path, "grains: "))?;
        if report.fell > 0 && !std::mem::replace(&mut state.has_warned, true) {
            log::warn!(
                "frame {frame}: {} grains fell past the edge of the ground to {FALL_DEPTH} m below it and are dropped, as are all that follow \
                 them (`fell` in the reports): a larger ground keeps them",
                report.fell
            );
        }
        Ok(report)
    }
}

impl Stage for Grains<'_> {
    fn name(&self) -> &'static str {
        "grains"
    }

    fn noun(&self) -> &'static str {
        "grains"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: "grains", extensions: &["vdb", "ply", "usdc", "usda"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        let output = self.scene.output;
        output.grains_vdb || output.grains_ply || output.grains_usd
    }

    fn state_extension(&self) -> &'static str {
        "grains"
    }

    fn settings(&self) -> Result<Settings> {
        let initial = initial_grains::file(self.scene).map(|path| ("grains.initial", path));
        settings::of_stage(self.scene, self.name(), &self.inputs.input_hashes, initial)
    }

    fn first_state_settings(&self, settings: &Settings) -> Settings {
        settings_of_first_state(self.scene.values.keys(), settings, "grains")
    }

    fn upstream(&self) -> &'static [&'static str] {
        &["base"]
    }

    fn reads(&self, frame: i32) -> Reads {
        Reads { files: moving::files(self.scene, frame), ahead: Vec::new() }
    }

    fn usd_kinds(&self) -> Vec<&'static str> {
        self.scene.output.grains_usd.then_some("grains").into_iter().collect()
    }

    fn clips(&self) -> Vec<Clips<'_>> {
        let grains = grains::Grains::new(params(self.scene, self.inputs.snow.cell));
        let clips =
            |grains: grains::Grains| Clips::new("grains", ClipPrims::Points(for_clips(grains.points())));
        grains.ok().map(clips).into_iter().collect()
    }

    fn needs_every_frame(&self) -> Option<&'static str> {
        self.scene.output.grains_delta.then_some("grains_mode = \"delta\"")
    }
}

impl Stepping for Grains<'_> {
    type State = State;
    /// The grains after a step, if their files or the changes are written.
    type Step = Option<grains::Grains>;
    type Writer = Writer;

    fn precheck(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()> {
        let [base] = upstream else { return Err(Error::Internal("grains read one stage".into())) };
        let removed = Removed::by_base(self.scene, base, last)?;
        let Some(forecast) = Forecast::of(self.scene, self.inputs, &removed)? else { return Ok(()) };
        log::info!(
            "grains: {}, {:.1} MB of memory, {:.1} MB of files",
            forecast.count(),
            forecast.memory_bytes as f64 / 1e6,
            forecast.disk_bytes as f64 / 1e6
        );
        if let Some(warning) = forecast.warning(self.scene) {
            log::warn!("{warning}");
        }
        match forecast.check(self.scene, ctx.memory_limit()) {
            // The forecast is an upper bound.
            Err(error) if forecast.at_most => log::warn!("{error}"),
            other => return other,
        }
        Ok(())
    }

    fn load(&self, _ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<State> {
        let params = params(self.scene, self.inputs.snow.cell);
        let grains = match after {
            None => grains::Grains::new(params),
            Some(frame) => done.resume(frame, |bytes| grains::Grains::resume(params, bytes)),
        };
        let grains = grains.map_err(|error| error.in_file_at(&self.scene.path, "grains: "))?;
        Ok(State { grains, layer: None, has_warned: false })
    }

    fn step(&self, ctx: &Context, state: &mut State, to: &StepTarget<'_>) -> Result<Stepped<Self::Step>> {
        let [stored] = to.upstream else { return Err(Error::Internal("grains read one stage".into())) };
        let frame = to.frame;
        let is_first = frame == self.scene.shot.frames.first;
        let before = match state.layer.take() {
            Some((at, layer)) if at == frame - 1 => Some(layer),
            _ if is_first => None,
            _ => Some(self.layer(ctx, stored, None, frame - 1)?),
        };
        let after = self.layer(ctx, stored, before.as_ref(), frame)?;
        let report = match &before {
            // Snow cut out by the first poses was removed before the shot began.
            None => self.emit_initial(ctx, &mut state.grains, &after)?,
            Some(before) => report_of(&self.move_grains(ctx, state, [before, &after], frame)?),
        };
        state.layer = Some((frame, after));
        let is_wanted = to.made_from.is_some() || self.scene.output.grains_delta;
        Ok(Stepped { step: is_wanted.then(|| state.grains.clone()), report })
    }

    fn writer(&self, ctx: &Context, state: &State) -> Result<Writer> {
        let before = self.scene.output.grains_delta.then(|| ordered(state.grains.points()));
        Ok(Writer { ctx: Context::new(ctx.pool().clone()), before })
    }

    fn write(&self, writer: &mut Writer, step: Self::Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let Some(grains) = step else { return Ok(()) };
        let points = ordered(grains.points());
        if let Some(files) = files {
            let output = self.scene.output;
            if output.grains_vdb {
                let before = writer.before.as_ref().filter(|_| self.is_delta(files.frame));
                grain_files::write(&writer.ctx, self.scene, files, &points, before)?;
            }
            if output.grains_ply {
                files.save("grains", "ply", &ply::to_bytes(&points)?)?;
            }
            if output.grains_usd {
                let points = for_clips(points.clone());
                let fps = self.scene.shot.fps;
                files.save_usd("grains", points::frame("grains", files.frame, fps, &points))?;
            }
            files.save_state(&grains.save())?;
        }
        if writer.before.is_some() {
            writer.before = Some(points);
        }
        Ok(())
    }
}

fn report_of(report: &StepReport) -> Report {
    let results = json!({
        "grains": report.count,
        "born": report.born,
        "resting": report.resting,
        "trapped": report.trapped,
        // A sum of nothing is -0.
        "owed": report.owed + 0.0,
        "dropped": report.dropped,
        "fell": report.fell,
        "expired": report.expired,
        "removed_m3": report.removed_volume,
        "sub_steps": report.sub_steps,
        "fastest_m_per_s": report.fastest,
    });
    Report::new(results, report.phases.clone())
}
