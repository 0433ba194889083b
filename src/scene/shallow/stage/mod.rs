//! The stage `liquid`: a little liquid flows over a terrain.

pub(in crate::scene::shallow) mod colours;
pub(in crate::scene::shallow) mod liquid_mesh;
pub(in crate::scene::shallow) mod liquid_state;
#[cfg(feature = "vdb")]
mod liquid_volume;
mod saved_liquid;
mod surroundings_usd;

use serde_json::json;

use super::inputs::scalars;
use super::{Inputs, ML, ROLES, Shallow};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::geometry::MeshArray;
use crate::io::mesh;
use crate::io::usd::materials::Look;
use crate::io::usd::{ClipPrims, Clips, ContentsByName, MeshPrim, Shading, StillMeshes, primvars};
use crate::scene::Scene;
use crate::scene::run::settings::{settings_of, settings_of_first_state};
use crate::scene::run::{
    CONTENT, DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping,
    Volume,
};
use crate::shallow;
use crate::shallow::remap::Moved;
use crate::shallow::terrain::shapes::Shape;
use liquid_mesh::{LiquidMesh, Mesher};
use liquid_state::LiquidState;
use surroundings_usd::{
    OBSTACLES, SURROUNDINGS, TERRAIN, TerrainFrame, obstacle_prims, obstacles_file, still_meshes,
    terrain_prims,
};

/// Name of the stage, and of the kind of its files.
const NAME: &str = "liquid";
/// Kind of the volume files.
const VOLUME: &str = "volume";

/// The stage for a scene.
pub struct Liquid<'a> {
    pub scene: &'a Scene,
    pub setup: &'a Shallow,
    pub inputs: &'a Inputs,
}

/// The liquid at a frame.
pub struct State<'a> {
    liquid_state: LiquidState<'a>,
    mesher: Mesher,
}

/// The data of a frame's files.
pub struct FrameData {
    surface: LiquidMesh,
    state: Vec<u8>,
    /// A .vdb file, and its contents.
    volume: Option<(Vec<u8>, ContentsByName)>,
    /// The terrain, if it changes and is written.
    terrain: Option<TerrainFrame>,
    /// The obstacles with keys, if they are written.
    shapes: Vec<Shape>,
}

impl<'a> Liquid<'a> {
    /// Advances the liquid to a frame, which may be the current one, and warns of points that begin to rest.
    fn advance(
        &self,
        ctx: &Context,
        liquid_state: &mut LiquidState<'a>,
        frame: i32,
    ) -> Result<(shallow::Report, Moved)> {
        if frame <= liquid_state.frame {
            return Ok(Default::default());
        }
        let before = liquid_state.resting();
        let did = liquid_state.advance(ctx)?;
        for point in liquid_state.resting().iter().filter(|point| !before.contains(point)) {
            let path = self.scene.path.display();
            log::warn!(
                "{path}: {point}: at frame {frame} it lies inside solid or outside of the area, and rests until it no longer does"
            );
        }
        Ok(did)
    }

    /// The data of a frame's files.
    #[cfg_attr(
        not(feature = "vdb"),
        expect(unused_variables, reason = "only volumes hold the hash of their inputs")
    )]
    fn frame_data(
        &self,
        ctx: &Context,
        state: &mut State<'a>,
        to: &StepTarget<'_>,
        made_from: &str,
    ) -> Result<FrameData> {
        let State { liquid_state, mesher } = state;
        if std::mem::take(&mut liquid_state.has_new_ground) {
            ctx.phase("lifts", || {
                mesher.fit_to_ground(&liquid_state.liquid, liquid_state.ground(), self.setup)
            })?;
        }
        let liquid = &liquid_state.liquid;
        let surface = ctx.phase("surface", || mesher.build(liquid, self.setup.opaque_depth))?;
        #[cfg(feature = "vdb")]
        let volume = match self.setup.output.vdb {
            true => Some(liquid_volume::bytes(ctx, self.scene, self.setup, liquid, to.frame, made_from)?),
            false => None,
        };
        #[cfg(not(feature = "vdb"))]
        let volume = None;
        let state = saved_liquid::save(
            &liquid_state.shapes,
            &liquid_state.points,
            liquid,
            liquid_state.stains.as_ref(),
        );
        let terrain = if self.writes(TERRAIN) { liquid_state.terrain_frame()? } else { None };
        let shapes = if self.writes(OBSTACLES) { liquid_state.shapes.clone() } else { Vec::new() };
        Ok(FrameData { surface, state, volume, terrain, shapes })
    }

    /// Whether the terrain moves or is stained, so that it has a file for each frame.
    fn terrain_changes(&self) -> bool {
        self.setup.sequence().is_some() || self.setup.staining.is_some()
    }

    /// Count of the obstacles with keys.
    fn obstacles_with_keys(&self) -> usize {
        self.setup.obstacles.iter().filter(|obstacle| obstacle.file().is_none()).count()
    }

    /// The liquid's material in USD.
    fn look(&self) -> Look {
        match &*self.setup.look {
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
            FileKind { name: NAME, extensions: &["ply", "usdc", "usda"] },
            FileKind { name: VOLUME, extensions: &["vdb"] },
            FileKind { name: TERRAIN, extensions: &["ply", "usdc"] },
            FileKind { name: OBSTACLES, extensions: &["usdc"] },
        ]
    }

    fn writes(&self, kind: &str) -> bool {
        let output = self.setup.output;
        match kind {
            VOLUME => output.vdb,
            TERRAIN => self.terrain_changes() && (output.terrain_ply || output.terrain_usd),
            OBSTACLES => self.obstacles_with_keys() > 0 && output.terrain_usd,
            _ => output.ply || output.usd,
        }
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn keeps_every_state(&self) -> bool {
        true
    }

    fn usd_kinds(&self) -> Vec<&'static str> {
        let output = self.setup.output;
        let liquid = output.usd.then_some(NAME);
        let surroundings = output.terrain_usd.then_some([TERRAIN, OBSTACLES, SURROUNDINGS]);
        liquid.into_iter().chain(surroundings.into_iter().flatten()).collect()
    }

    fn settings(&self) -> Result<Settings> {
        let input_hashes = &self.inputs.input_hashes;
        let mut settings = settings_of(self.scene, NAME, input_hashes, ROLES)?;
        let content = match self.setup.sequence() {
            Some(_) => "of each frame".to_string(),
            None => input_hashes.hash(&self.setup.terrain)?,
        };
        settings.insert("shallow.terrain".into(), format!("{CONTENT}{content}"));
        for (index, obstacle) in self.setup.obstacles.iter().enumerate() {
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
        let files = self.setup.sequence().map(|_| self.setup.terrain_at(frame));
        Reads { files: files.into_iter().collect(), ahead: Vec::new() }
    }

    fn volumes(&self) -> Vec<Volume> {
        #[cfg(feature = "vdb")]
        if self.setup.output.vdb {
            return vec![liquid_volume::of_shot(VOLUME)];
        }
        Vec::new()
    }

    fn clips(&self) -> Vec<Clips<'_>> {
        let arrays = LiquidMesh::empty(self.setup).arrays(self.setup.output);
        let primvars = primvars::primvars(&arrays.iter().collect::<Vec<&MeshArray>>());
        let (name, look, shading) = (NAME.into(), self.look(), Shading::Smooth);
        let mesh = MeshPrim { name, look, moves: true, uvs: None, primvars, shading };
        let terrain = terrain_prims(self.setup.staining.is_some(), self.look());
        let obstacles = obstacle_prims(self.obstacles_with_keys());
        let kinds = [(NAME, vec![mesh]), (TERRAIN, terrain), (OBSTACLES, obstacles)];
        kinds.map(|(kind, meshes)| Clips::new(kind, ClipPrims::Meshes(meshes))).into()
    }

    fn still_meshes(&self, ctx: &Context) -> Result<Option<StillMeshes>> {
        match self.setup.output.terrain_usd {
            true => still_meshes(ctx, self.scene, !self.terrain_changes()),
            false => Ok(None),
        }
    }
}

impl<'a> Stepping for Liquid<'a> {
    type State = State<'a>;
    type Step = Option<FrameData>;
    type Writer = ();

    fn load(&self, ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<State<'a>> {
        let inputs = (self.scene, self.setup, self.inputs);
        let liquid_state = match after {
            None => LiquidState::begin(ctx, inputs)?,
            Some(frame) => {
                let path = done.state_file(frame)?;
                let bytes = std::fs::read(&path).map_err(|error| Error::io(&path, "read", error))?;
                LiquidState::resume(ctx, inputs, frame, &bytes).map_err(|error| match error {
                    Error::Bytes(what) => Error::file(path, what),
                    other => other,
                })?
            }
        };
        Ok(State { liquid_state, mesher: Mesher::default() })
    }

    fn step(&self, ctx: &Context, state: &mut State<'a>, to: &StepTarget<'_>) -> Result<Stepped<Self::Step>> {
        let ((step, did), phases) = ctx.step(4, || {
            let did = self.advance(ctx, &mut state.liquid_state, to.frame)?;
            let data = to.made_from.map(|made_from| self.frame_data(ctx, state, to, made_from));
            Ok((data.transpose()?, did))
        })?;
        let report = report_of(&state.liquid_state, did, step.as_ref(), phases)?;
        Ok(Stepped { step, report })
    }

    fn writer(&self, _ctx: &Context, _state: &State<'a>) -> Result<()> {
        Ok(())
    }

    fn writes_frames_independently(&self) -> bool {
        true
    }

    fn write(&self, _writer: &mut (), step: Self::Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(FrameData { surface, state, volume, terrain, shapes }), Some(files)) = (step, files) else {
            return Ok(());
        };
        let output = self.setup.output;
        let arrays = surface.arrays(output);
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        if output.ply {
            let velocities = if output.velocities { &surface.velocities[..] } else { &[] };
            // Programs take an opacity only together with a colour.
            let colours =
                vec![self.look().colour(); if output.alpha { surface.mesh.positions.len() } else { 0 }];
            let colours = colours::srgb(&colours);
            let coloured = arrays.iter().copied().chain(colours.iter().filter(|_| output.alpha));
            let arrays: Vec<&MeshArray> = coloured.collect();
            let carried = mesh::Carried { velocities, uvs: None, arrays: &arrays };
            files.save(NAME, "ply", &mesh::ply_bytes(&surface.mesh, &carried))?;
        }
        if output.usd {
            let carried = mesh::Carried { velocities: &surface.velocities, uvs: None, arrays: &arrays };
            files.save_clip(NAME, self.scene.shot.fps, &surface.mesh, &carried)?;
        }
        if let Some((bytes, contents)) = volume {
            files.save(VOLUME, "vdb", &bytes)?;
            files.describe(VOLUME, &contents);
        }
        if let Some(terrain) = terrain {
            if output.terrain_ply {
                files.save(TERRAIN, "ply", &terrain.ply(self.look()))?;
            }
            if output.terrain_usd {
                files.save_usd(TERRAIN, terrain.usd(files.frame, self.scene.shot.fps, self.look()))?;
            }
        }
        if !shapes.is_empty() {
            files.save_usd(OBSTACLES, obstacles_file(&shapes, files.frame, self.scene.shot.fps))?;
        }
        files.save_state(&state)
    }
}

/// The report of a frame.
fn report_of(
    liquid_state: &LiquidState<'_>,
    (report, moved): (shallow::Report, Moved),
    data: Option<&FrameData>,
    phases: Vec<PhaseTime>,
) -> Result<Report> {
    let liquid = &liquid_state.liquid;
    let (balance, depths) = (liquid.balance(), liquid.depths());
    let wet = depths.iter().filter(|depth| **depth > 0).count();
    let deepest = depths.iter().copied().max().unwrap_or(0);
    let mesh = data.map(|data| &data.surface.mesh);
    let ml = |cubic: f64| cubic / ML;
    let results = json!({
        "missing_units": balance.error,
        "drops": liquid.drops().len(),
        "scalars": scalars::balances(liquid)?,
        "wet_columns": wet,
        "deepest_m": liquid.columns().heights.length(deepest.into()),
        "displaced_ml": ml(moved.displaced),
        "held_ml": ml(moved.held),
        "resting": liquid_state.resting(),
        "steps": report.steps,
        "simulated_s": liquid.time(),
        "emptied_rows": report.emptied,
        "filled_rows": report.filled,
        "slowed_rows": report.slowed,
        "vertices": mesh.map_or(0, |mesh| mesh.positions.len()),
        "triangles": mesh.map_or(0, |mesh| mesh.triangles.len()),
    });
    let mut report = Report::new(results, phases);
    report.results.extend(scalars::amounts_in_ml!(balance));
    Ok(report)
}
