//! The stage `liquid`: a little liquid flows over a terrain.

pub(in crate::scene::shallow) mod liquid_mesh;
pub(in crate::scene::shallow) mod liquid_state;
#[cfg(feature = "vdb")]
mod liquid_volume;
mod saved_liquid;

use serde_json::json;

use super::inputs::scalars;
use super::{Inputs, ML, ROLES, Shallow};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{MeshArray, TriMesh};
use crate::io::mesh;
use crate::io::usd::materials::Look;
use crate::io::usd::{ClipPrims, Clips, MeshPrim, primvars};
use crate::scene::Scene;
use crate::scene::run::settings::{settings_of, settings_of_first_state};
use crate::scene::run::{
    CONTENT, DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping,
    Volume,
};
use crate::shallow;
use crate::shallow::remap::Moved;
use liquid_mesh::{Drawn, Mesher};
use liquid_state::LiquidState;

/// Name of the stage, and of the kind of its files.
const NAME: &str = "liquid";
/// Kind of the volume files.
const VOLUME: &str = "volume";
/// Kind of the files of a stained terrain.
const TERRAIN: &str = "terrain";

/// The stage for a scene.
pub struct Liquid<'a> {
    pub scene: &'a Scene,
    pub of: &'a Shallow,
    pub inputs: &'a Inputs,
}

/// The liquid at a frame.
pub struct State<'a> {
    course: LiquidState<'a>,
    mesher: Mesher,
}

/// The liquid at a frame whose files are written.
pub struct Written {
    drawn: Drawn,
    state: Vec<u8>,
    /// A .vdb file.
    volume: Option<Vec<u8>>,
    /// The terrain and its stains.
    terrain: Option<(TriMesh, Vec<f32>)>,
}

impl<'a> Liquid<'a> {
    /// Advances the liquid to a frame, which may be the current one, and warns of points that can no longer act.
    fn go(
        &self,
        ctx: &Context,
        course: &mut LiquidState<'a>,
        frame: i32,
    ) -> Result<(shallow::Report, Moved)> {
        if frame <= course.frame {
            return Ok(Default::default());
        }
        let before = course.resting();
        let did = course.go(ctx)?;
        for point in course.resting().iter().filter(|point| !before.contains(point)) {
            let path = self.scene.path.display();
            log::warn!(
                "{path}: {point}: at frame {frame} it lies inside solid or outside of the area, and rests until it does not"
            );
        }
        Ok(did)
    }

    /// The data that a frame's files are made from.
    #[cfg_attr(
        not(feature = "vdb"),
        expect(unused_variables, reason = "volumes say what they are made from")
    )]
    fn written(
        &self,
        ctx: &Context,
        state: &mut State<'a>,
        to: &StepTarget<'_>,
        made_from: &str,
    ) -> Result<Written> {
        let State { course, mesher } = state;
        if std::mem::take(&mut course.is_stirred) {
            ctx.phase("lifts", || mesher.fit(&course.liquid, course.ground(), self.of))?;
        }
        let liquid = &course.liquid;
        let drawn = ctx.phase("surface", || mesher.draw(liquid, self.of.opaque_depth))?;
        #[cfg(feature = "vdb")]
        let volume = match self.of.output.vdb {
            true => Some(liquid_volume::bytes(ctx, self.scene, self.of, liquid, to.frame, made_from)?),
            false => None,
        };
        #[cfg(not(feature = "vdb"))]
        let volume = None;
        let state = saved_liquid::save(&course.shapes, &course.points, liquid, course.stains.as_ref());
        Ok(Written { drawn, state, volume, terrain: course.stained()? })
    }

    /// The liquid's material in USD.
    fn look(&self) -> Look {
        match &*self.of.look {
            "water" => Look::Water,
            "paint" => Look::Paint,
            "honey" => Look::Honey,
            _ => Look::Blood,
        }
    }
}

impl Stage for Liquid<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn noun(&self) -> &'static str {
        "liquid"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[
            FileKind { name: NAME, extensions: &["ply", "usda"] },
            FileKind { name: VOLUME, extensions: &["vdb"] },
            FileKind { name: TERRAIN, extensions: &["ply"] },
        ]
    }

    fn writes(&self, kind: &str) -> bool {
        let output = self.of.output;
        match kind {
            VOLUME => output.vdb,
            TERRAIN => self.of.staining.is_some(),
            _ => output.ply || output.usd,
        }
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn keeps_every_state(&self) -> bool {
        true
    }

    fn usd_kind(&self) -> Option<&'static str> {
        self.of.output.usd.then_some(NAME)
    }

    fn settings(&self) -> Result<Settings> {
        let input_hashes = &self.inputs.input_hashes;
        let mut settings = settings_of(self.scene, NAME, input_hashes, ROLES)?;
        let content = match self.of.sequence() {
            Some(_) => "of each frame".to_string(),
            None => input_hashes.hash(&self.of.terrain)?,
        };
        settings.insert("shallow.terrain".into(), format!("{CONTENT}{content}"));
        for (index, obstacle) in self.of.obstacles.iter().enumerate() {
            if let Some(path) = obstacle.file() {
                settings.insert(
                    format!("object[{}].file", index + 1),
                    format!("{CONTENT}{}", input_hashes.hash(path)?),
                );
            }
        }
        Ok(settings)
    }

    fn first_state_settings(&self, settings: &Settings) -> Settings {
        settings_of_first_state(self.scene.values.keys(), settings, NAME)
    }

    fn reads(&self, frame: i32) -> Reads {
        let files = self.of.sequence().map(|_| self.of.terrain_at(frame));
        Reads { files: files.into_iter().collect(), ahead: Vec::new() }
    }

    fn volumes(&self) -> Vec<Volume> {
        #[cfg(feature = "vdb")]
        if self.of.output.vdb {
            return vec![liquid_volume::of_shot(VOLUME)];
        }
        Vec::new()
    }

    fn clip(&self) -> Option<Clips<'_>> {
        let arrays = Drawn::empty(self.of).arrays(self.of.output);
        let primvars = primvars::primvars(&arrays.iter().collect::<Vec<&MeshArray>>());
        let mesh = MeshPrim { name: NAME.into(), look: self.look(), moves: true, uvs: None, primvars };
        Some(Clips::new(NAME, ClipPrims::Meshes(vec![mesh])))
    }
}

impl<'a> Stepping for Liquid<'a> {
    type State = State<'a>;
    type Step = Option<Written>;
    type Writer = ();

    fn load(&self, ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<State<'a>> {
        let of = (self.scene, self.of, self.inputs);
        let course = match after {
            None => LiquidState::begin(ctx, of)?,
            Some(frame) => {
                let path = done.state_file(frame)?;
                let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
                LiquidState::resume(ctx, of, frame, &bytes).map_err(|error| match error {
                    Error::Bytes(what) => Error::file(path, what),
                    other => other,
                })?
            }
        };
        Ok(State { course, mesher: Mesher::default() })
    }

    fn step(&self, ctx: &Context, state: &mut State<'a>, to: &StepTarget<'_>) -> Result<Stepped<Self::Step>> {
        let ((step, did), phases) = ctx.step(4, || {
            let did = self.go(ctx, &mut state.course, to.frame)?;
            let written = to.made_from.map(|made_from| self.written(ctx, state, to, made_from));
            Ok((written.transpose()?, did))
        })?;
        let report = report_of(&state.course, did, step.as_ref(), phases)?;
        Ok(Stepped { step, report })
    }

    fn writer(&self, _ctx: &Context, _state: &State<'a>) -> Result<()> {
        Ok(())
    }

    fn writes_frames_independently(&self) -> bool {
        true
    }

    fn write(&self, _writer: &mut (), step: Self::Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(Written { drawn, state, volume, terrain }), Some(files)) = (step, files) else {
            return Ok(());
        };
        let output = self.of.output;
        let arrays = drawn.arrays(output);
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        if output.ply {
            let velocities = if output.velocities { &drawn.velocities[..] } else { &[] };
            let carried = mesh::Carried { velocities, uvs: None, arrays: &arrays };
            files.save(NAME, "ply", &mesh::ply_bytes(&drawn.mesh, &carried))?;
        }
        if output.usd {
            let carried = mesh::Carried { velocities: &drawn.velocities, uvs: None, arrays: &arrays };
            files.save_clip(NAME, self.scene.shot.fps, &drawn.mesh, &carried)?;
        }
        if let Some(volume) = volume {
            files.save(VOLUME, "vdb", &volume)?;
        }
        if let Some((mesh, stains)) = terrain {
            let values = stains.into_iter().map(f64::from).collect();
            let stain = MeshArray { name: "stain".into(), on: On::Vertices, number: Number::F32, values };
            let carried = mesh::Carried { velocities: &[], uvs: None, arrays: &[&stain] };
            files.save(TERRAIN, "ply", &mesh::ply_bytes(&mesh, &carried))?;
        }
        files.save_state(&state)
    }
}

/// The report of a frame.
fn report_of(
    course: &LiquidState<'_>,
    (report, moved): (shallow::Report, Moved),
    written: Option<&Written>,
    phases: Vec<PhaseTime>,
) -> Result<Report> {
    let liquid = &course.liquid;
    let (balance, depths) = (liquid.balance(), liquid.depths());
    let wet = depths.iter().filter(|depth| **depth > 0).count();
    let deepest = depths.iter().copied().max().unwrap_or(0);
    let mesh = written.map(|written| &written.drawn.mesh);
    let ml = |cubic: f64| cubic / ML;
    let results = json!({
        "inside_ml": ml(balance.inside),
        "poured_ml": ml(balance.poured),
        "sourced_ml": ml(balance.sourced),
        "drained_ml": ml(balance.drained),
        "absorbed_ml": ml(balance.absorbed),
        "lost_ml": ml(balance.lost),
        "gained_ml": ml(balance.gained),
        "falling_ml": ml(balance.falling),
        "missing_units": balance.error,
        "drops": liquid.drops().len(),
        "scalars": scalars::balances(liquid)?,
        "wet_columns": wet,
        "deepest_m": liquid.columns().heights.length(deepest.into()),
        "displaced_ml": ml(moved.displaced),
        "held_ml": ml(moved.held),
        "resting": course.resting(),
        "steps": report.steps,
        "simulated_s": liquid.time(),
        "emptied_rows": report.emptied,
        "filled_rows": report.filled,
        "slowed_rows": report.slowed,
        "vertices": mesh.map_or(0, |mesh| mesh.positions.len()),
        "triangles": mesh.map_or(0, |mesh| mesh.triangles.len()),
    });
    Ok(Report::new(results, phases))
}
