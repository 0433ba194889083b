//! The stage `volumes`: data of base, grains and mist for renderers. A frame depends on no frame before it.

use serde_json::{Map, Value, json};

use super::frames::LayerReader;
use super::grain_reader::GrainReader;
use super::mist;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::points::Values;
use crate::geometry::{DVec3, TriMesh};
use crate::io::mesh;
use crate::io::particles::ParticleData;
use crate::io::records::manifest::Keeps;
use crate::io::usd::materials::Look;
use crate::io::usd::{self, ClipPrims, Clips, Field, Holds, MeshPrim, Shading};
use crate::scene::run::settings::settings_of;
use crate::scene::run::{
    DoneFrames, FileKind, FrameFiles, Report, Settings, Stage, StepTarget, Stepped, Stepping, Volume,
};
use crate::scene::snow::Inputs;
use crate::scene::snow::estimate::memory;
use crate::scene::snow::grain_params::params;
use crate::scene::snow::keys::volumes::Needs;
use crate::scene::vdb_metadata::{contents, metadata};
use crate::scene::{Scene, VolumesOutput};
use crate::snow::render_volumes::{fog, united};
use crate::vdb::file::{WriteOptions, to_bytes};
use crate::vdb::{FloatGrid, level_set};

/// The stage for a scene.
pub struct Volumes<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
    output: VolumesOutput,
    needs: Needs,
}

/// Readers, kept from frame to frame only so that less is read.
#[derive(Default)]
pub struct State {
    layer: LayerReader,
    grains: GrainReader,
}

/// Inputs of a frame.
struct Source<'s> {
    frame: i32,
    base: Option<&'s FloatGrid>,
    grains: Option<ParticleData>,
    mist: Option<FloatGrid>,
}

/// Files of a frame. They are packed while they wait for the writer: unpacked, those of several frames would take too much memory.
type Files = Vec<Packed>;

/// A file of a frame.
pub struct Packed {
    kind: &'static str,
    extension: &'static str,
    bytes: Vec<u8>,
    /// Its contents, for the report.
    contents: usd::ContentsByName,
}

impl Packed {
    /// A .vdb file.
    fn grids(kind: &'static str, grids: &[&FloatGrid], options: &WriteOptions) -> Result<Self> {
        let bytes = to_bytes(grids, options)?;
        Ok(Self { kind, extension: "vdb", bytes, contents: contents(grids) })
    }
}

/// Name of the mesh's prim.
const MESH: &str = "base";

impl<'a> Volumes<'a> {
    /// The stage for a scene.
    pub fn new(scene: &'a Scene, inputs: &'a Inputs) -> Self {
        let output = scene.output.volumes;
        Self { scene, inputs, output, needs: Needs::of(output, &scene.values) }
    }

    /// The frames of an upstream stage.
    fn stored<'s>(&self, upstream: &'s [DoneFrames], name: &str) -> Result<&'s DoneFrames> {
        let index = self.upstream().iter().position(|upstream| *upstream == name);
        let stored = index.and_then(|index| upstream.get(index));
        stored.ok_or_else(|| Error::Internal(format!("volumes do not read {name}")))
    }

    /// Reads the inputs of a frame.
    fn read<'s>(&self, ctx: &Context, state: &'s mut State, to: &StepTarget<'_>) -> Result<Source<'s>> {
        let State { layer, grains } = state;
        let mut source = Source { frame: to.frame, base: None, grains: None, mist: None };
        if self.needs.base {
            let stored = self.stored(to.upstream, "base")?;
            source.base = Some(&layer.after(ctx, stored, to.frame)?.surface);
        }
        if self.needs.grains {
            source.grains = Some(grains.particles(ctx, self.stored(to.upstream, "grains")?, to.frame)?);
        }
        if self.needs.mist {
            source.mist = Some(mist::density(self.stored(to.upstream, "mist")?, to.frame)?);
        }
        Ok(source)
    }

    /// Makes the grids of the fog.
    fn fog(&self, ctx: &Context, source: &mut Source<'_>) -> Result<Vec<FloatGrid>> {
        let names = fog_names(self.output);
        let mut grids = Vec::new();
        let mut add = |mut grid: FloatGrid, name: Option<&str>| {
            grid.set_name(name.unwrap_or_default())?;
            grids.push(grid);
            Ok::<(), Error>(())
        };
        if let Some(surface) = source.base.filter(|_| self.output.fog_base) {
            add(fog::base(ctx, surface)?, names[0])?;
        }
        if let Some(grains) = source.grains.as_ref().filter(|_| self.output.fog_grains) {
            let radius = self.radius();
            add(fog::grains(ctx, &grains.positions, radius, fog::VOXEL * radius)?, names[1])?;
        }
        if let Some(mist) = source.mist.take() {
            add(mist, names[2])?;
        }
        Ok(grids)
    }

    /// Unites the base with resting grains.
    fn snow(&self, ctx: &Context, surface: &FloatGrid, grains: Option<&ParticleData>) -> Result<FloatGrid> {
        let Some(grains) = grains else { return surface.deep_copy() };
        let resting: Vec<DVec3> = match grains.attribute("active") {
            Some(Values::Bool(active)) => {
                let all = grains.positions.iter().enumerate();
                all.filter(|(grain, _)| !active.get(*grain)).map(|(_, position)| *position).collect()
            }
            // A file without points has no attributes.
            _ => Vec::new(),
        };
        united::unite(ctx, surface, &resting, self.radius())
    }

    /// Radius of a grain (m).
    fn radius(&self) -> f64 {
        params(self.scene, self.inputs.snow.cell).radius
    }

    /// Makes a frame's files and its report.
    fn make(
        &self,
        ctx: &Context,
        source: &mut Source<'_>,
        made_from: &str,
    ) -> Result<(Files, Map<String, Value>)> {
        let (mut files, mut results) = (Files::new(), Map::new());
        let metadata = metadata(self.scene, source.frame, made_from);
        let options = WriteOptions { metadata, ..WriteOptions::default() };
        if self.output.fog() {
            let grids = ctx.phase("fog", || self.fog(ctx, source))?;
            let voxels: u64 = grids.iter().map(FloatGrid::active_voxels).sum();
            results.insert("fog_voxels".into(), json!(voxels));
            // Renderers use at most 16 bits of a density.
            let options = WriteOptions { half: true, ..options.clone() };
            let grids: Vec<&FloatGrid> = grids.iter().collect();
            files.push(ctx.phase("pack", || Packed::grids("fog", &grids, &options))?);
        }
        let Some(surface) = source.base else { return Ok((files, results)) };
        if self.output.snow {
            let grid = ctx.phase("snow", || self.snow(ctx, surface, source.grains.as_ref()))?;
            results.insert("snow_voxels".into(), json!(grid.active_voxels()));
            files.push(ctx.phase("pack", || Packed::grids("snow", &[&grid], &options))?);
        }
        if self.output.mesh() {
            let mesh = ctx.phase("mesh", || {
                level_set::to_mesh(ctx, surface, 0.0, self.output.mesh_adaptivity as f32)
            })?;
            results.insert("mesh_triangles".into(), json!(mesh.triangles.len()));
            files.extend(ctx.phase("pack", || self.mesh_files(&mesh, source.frame))?);
        }
        Ok((files, results))
    }

    /// The files of the base's surface.
    fn mesh_files(&self, surface: &TriMesh, frame: i32) -> Result<Files> {
        let (mut files, carried) = (Files::new(), mesh::Carried::default());
        if self.output.mesh_ply {
            let bytes = mesh::ply_bytes(surface, &carried);
            files.push(Packed { kind: "mesh", extension: "ply", bytes, contents: Vec::new() });
        }
        if self.output.mesh_usd {
            let mesh = usd::MeshFrame::of(MESH, surface, &carried, Shading::Smooth);
            let (fps, units) = (self.scene.shot.fps, usd::Units::OWN);
            let file = usd::clip("mesh", frame, fps, units, &[mesh]);
            let contents = file.contents().clone();
            let bytes = file.bytes(usd::Format::Binary)?;
            files.push(Packed { kind: "mesh", extension: usd::BINARY, bytes, contents });
        }
        Ok(files)
    }
}

/// Names of the fog's grids of base, grains and mist. A single one has the name that smoke shaders look for.
fn fog_names(output: VolumesOutput) -> [Option<&'static str>; 3] {
    let parts = [(output.fog_base, "base"), (output.fog_grains, "grains"), (output.fog_mist, "mist")];
    let is_alone = parts.iter().filter(|(is_wanted, _)| *is_wanted).count() == 1;
    parts.map(|(is_wanted, name)| is_wanted.then_some(if is_alone { "density" } else { name }))
}

impl Stage for Volumes<'_> {
    fn name(&self) -> &'static str {
        "volumes"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[
            FileKind { name: "fog", extensions: &["vdb"] },
            FileKind { name: "snow", extensions: &["vdb"] },
            FileKind { name: "mesh", extensions: &["ply", "usdc", "usda"] },
        ]
    }

    fn writes(&self, kind: &str) -> bool {
        match kind {
            "fog" => self.output.fog(),
            "snow" => self.output.snow,
            _ => self.output.mesh(),
        }
    }

    fn settings(&self) -> Result<Settings> {
        settings_of(self.scene, self.name(), &self.inputs.input_hashes, &[])
    }

    fn upstream(&self) -> &'static [&'static str] {
        match (self.needs.base, self.needs.grains, self.needs.mist) {
            (true, true, true) => &["base", "grains", "mist"],
            (true, true, false) => &["base", "grains"],
            (true, false, true) => &["base", "mist"],
            (true, false, false) => &["base"],
            (false, true, true) => &["grains", "mist"],
            (false, true, false) => &["grains"],
            (false, false, true) => &["mist"],
            (false, false, false) => &[],
        }
    }

    fn reads_state_of(&self, _upstream: &str) -> bool {
        false
    }

    fn has_memory(&self) -> bool {
        false
    }

    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::Whole
    }

    fn usd_kinds(&self) -> Vec<&'static str> {
        self.output.mesh_usd.then_some("mesh").into_iter().collect()
    }

    fn volumes(&self) -> Vec<Volume> {
        /// The density of a part, from the grid with the part's name or from the only grid.
        const fn density(grid: &'static str, scale: f32) -> [Field; 1] {
            [Field { name: "density", grid, holds: Holds::Density(scale) }]
        }
        type Part = (&'static str, [&'static [Field]; 2]);
        const SNOW_SCALE: f32 = fog::DENSITY_SCALE;
        const PARTS: [Part; 3] = [
            ("fog_base", [&density("density", SNOW_SCALE), &density("base", SNOW_SCALE)]),
            ("fog_grains", [&density("density", SNOW_SCALE), &density("grains", SNOW_SCALE)]),
            ("fog_mist", [&density("density", 1.0), &density("mist", 1.0)]),
        ];
        let volume_of = |(name, (prim, [alone, several])): (Option<&str>, Part)| {
            let fields = if name? == "density" { alone } else { several };
            Some(Volume { kind: "fog", prim, fields, is_guide: false })
        };
        let fog = fog_names(self.output).into_iter().zip(PARTS).filter_map(volume_of);
        const SURFACE: &[Field] = &[Field::of("surface", Holds::Distance)];
        let snow = Volume { kind: "snow", prim: "snow", fields: SURFACE, is_guide: false };
        fog.chain(self.output.snow.then_some(snow)).collect()
    }

    fn clips(&self) -> Vec<Clips<'_>> {
        // A different mesh at each frame, without velocities.
        let (name, primvars) = (MESH.into(), Vec::new());
        let mesh =
            MeshPrim { name, look: Look::Snow, moves: false, uvs: None, primvars, shading: Shading::Smooth };
        let clips = || Clips::new("mesh", ClipPrims::Meshes(vec![mesh]));
        self.output.mesh_usd.then(clips).into_iter().collect()
    }
}

impl Stepping for Volumes<'_> {
    type State = State;
    type Step = Files;
    type Writer = ();

    fn precheck(&self, ctx: &Context, upstream: &[DoneFrames], last: i32) -> Result<()> {
        let grains = match self.needs.grains {
            true => max_grains(self.stored(upstream, "grains")?, last)?,
            false => 0,
        };
        let needed = memory::of_volumes(self.scene, self.inputs, grains)?;
        let what = format!("{}: stage volumes with {grains} grains", self.scene.path.display());
        ctx.allow(&what, needed)
    }

    fn load(&self, _ctx: &Context, _done: &DoneFrames, _after: Option<i32>) -> Result<State> {
        Ok(State::default())
    }

    fn step(&self, ctx: &Context, state: &mut State, to: &StepTarget<'_>) -> Result<Stepped<Files>> {
        let Some(made_from) = to.made_from else {
            return Ok(Stepped { step: Files::new(), report: Report::default() });
        };
        let wanted = [self.output.fog(), self.output.snow, self.output.mesh()];
        let phases = 1 + 2 * wanted.iter().filter(|is_wanted| **is_wanted).count();
        let work = || {
            let mut source = ctx.phase("read", || self.read(ctx, state, to))?;
            self.make(ctx, &mut source, made_from)
        };
        let made = ctx.step(phases, work);
        let ((step, results), phases) =
            made.map_err(|error| error.in_file_at(&self.scene.path, format!("frame {}: ", to.frame)))?;
        Ok(Stepped { step, report: Report { results, phases } })
    }

    fn writer(&self, _ctx: &Context, _state: &State) -> Result<()> {
        Ok(())
    }

    fn writes_frames_independently(&self) -> bool {
        true
    }

    fn write(&self, _writer: &mut (), step: Files, files: Option<&mut FrameFiles>) -> Result<()> {
        let Some(files) = files else { return Ok(()) };
        step.into_iter().try_for_each(|Packed { kind, extension, bytes, contents }| {
            files.describe(kind, &contents);
            files.save(kind, extension, &bytes)
        })
    }
}

/// The maximum count of grains after any frame up to `last`, from the existing reports.
fn max_grains(grains: &DoneFrames, last: i32) -> Result<u64> {
    let mut max = 0;
    for frame in grains.frames().filter(|frame| *frame <= last) {
        let count = grains.report(frame)?.and_then(|report| report.get("grains")?.as_u64());
        max = max.max(count.unwrap_or(0));
    }
    Ok(max)
}
