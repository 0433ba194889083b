//! `frazil convert`: meshes, sequences, characters and points from one file to another.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;

use super::frame_results::FrameResults;
use super::options::{
    Axis, MeshSpace, frame_path, needs_frames, one_frame, positive, refuse_one_file, warn_if_far,
};
use super::session::{Failure, OrFailure, Session};
use super::{output, points};
use frazil::geometry::mesh::attributes::On;
use frazil::geometry::{MeshArray, TriMesh, Uvs, Vec3};
use frazil::io;
use frazil::io::files::atomic;
use frazil::io::files::sequence::Pattern;
use frazil::io::mesh::extension;
use frazil::io::usd;
use frazil::io::usd::points::VELOCITIES;
use frazil::motion::{Character, Keys, MeshSequence, Motion, Placed, Play, Rigid, is_gltf, missing_uvs};
use frazil::scene::FrameChoice;

/// Convert meshes, sequences of meshes, characters and points to other files.
///
/// Moving input needs a pattern for its output (hero.%04d.ply) and --frames.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil convert boot.obj boot.stl --up z
  frazil convert body.%04d.obj posed.%04d.usda --frames 1-2 --scale 0.01
  frazil convert grains.%04d.vdb grains.%04d.usda --frames 1-2
  frazil convert grains.0001.vdb drop.0001.bgeo && frazil convert drop.0001.bgeo drop.ply --up z")]
pub struct Args {
    /// Mesh (.obj, .ply, .stl, .usdc), a sequence of them (body.%04d.obj), a character (.glb, .gltf), or points (.vdb,
    /// .bgeo, .vtk, .vtu, .xyz, .ply, .usdc).
    input: PathBuf,
    /// Mesh (.obj, .ply, .stl, .usda, .usdc) or points (.vdb, .ply, .usda, .usdc, .bgeo, .xyz), or their pattern.
    output: PathBuf,
    /// Frames of a sequence or a character.
    #[arg(long, value_name = "A-B|A-BxN", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Frames per second.
    #[arg(long, default_value = "24", value_parser = positive)]
    fps: f64,
    /// A character's clip; it begins at the first of --frames.
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// Only nodes of this name of a character, and their descendants; * matches any characters, ? exactly one.
    #[arg(long, value_name = "NAME")]
    node: Option<String>,
    #[command(flatten)]
    space: MeshSpace,
    /// Upward axis of the output.
    #[arg(long, value_name = "AXIS", default_value = "y")]
    to_up: Axis,
    /// Factor from metres to the output's unit.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = positive)]
    to_scale: f64,
    /// Edge of the voxels of a .vdb of points (m) [default: the size given in the input file].
    #[arg(long, value_name = "M", value_parser = positive)]
    voxel: Option<f64>,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    if points::converts_points(&args.input, &args.output, args.frames.as_ref()).or_refuse()? {
        return args.points()?.run(session);
    }
    if args.voxel.is_some() {
        return Err(Failure::refused("--voxel is for points"));
    }
    check_output(&args.output)?;
    let (mut source, frames) = args.source()?;
    refuse_one_file(&args.output, &frames, "hero.%04d.ply")?;
    output::check_writable(&args.output).or_refuse()?;
    for frame in frames.iter() {
        // The frame after the last is read for velocities.
        let inputs = [frame, frame.saturating_add(1)].map(|frame| frame_path(&args.input, frame));
        let path = frame_path(&args.output, frame);
        output::refuse_input(&path, inputs.iter().map(PathBuf::as_path)).or_refuse()?;
    }
    let (mut triangles, mut has_warned) = (0, false);
    let write = |frame| source.write(args, &frame_path(&args.output, frame), frame, &mut has_warned);
    let results = FrameResults::run(session, &frames, write, |count| triangles = count)?;
    session.record("triangles", json!(triangles));
    results.finish()
}

/// Arrays of the vertices that hold their velocities (m/s).
pub const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];

/// Renames velocities of other programs to our names ([`VELOCITY`]).
pub fn name_velocities(arrays: &mut [MeshArray]) {
    for stem in VELOCITIES {
        let named = |axis: &str| {
            let name = format!("{stem}{axis}");
            let is_named = |array: &MeshArray| array.on == On::Vertices && array.name.to_lowercase() == name;
            arrays.iter().position(is_named)
        };
        if let (Some(x), Some(y), Some(z)) = (named("x"), named("y"), named("z")) {
            for (at, name) in [x, y, z].into_iter().zip(VELOCITY) {
                arrays[at].name = name.into();
            }
            return;
        }
    }
}

/// Vectors of the vertices, from the arrays of their x, y and z.
pub fn vectors(arrays: &[MeshArray], names: [&str; 3]) -> Option<Vec<Vec3>> {
    let part = |name: &str| arrays.iter().find(|array| array.on == On::Vertices && array.name == name);
    let [x, y, z] = names.map(part);
    let parts = x?.values.iter().zip(&y?.values).zip(&z?.values);
    Some(parts.map(|((x, y), z)| Vec3::new(*x as f32, *y as f32, *z as f32)).collect())
}

/// The names, without x, y and z, of vectors that are stored as three arrays, except velocities.
fn vector_stems(arrays: &[MeshArray]) -> Vec<&str> {
    let has = |name: String| arrays.iter().any(|array| array.name == name);
    let stem = |array: &'_ MeshArray| array.name.len().checked_sub(1).filter(|_| array.name.ends_with('x'));
    let named = arrays.iter().filter_map(|array| Some(&array.name[..stem(array)?]));
    let has_all_parts = |stem: &&str| {
        !stem.is_empty() && *stem != "v" && ["y", "z"].iter().all(|part| has(format!("{stem}{part}")))
    };
    named.filter(has_all_parts).collect()
}

/// Joins names: "UVs, normals and materials".
fn joined_names(names: &[&str]) -> String {
    match names {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => names.concat(),
    }
}

/// The name of a mesh in USD, from the name of its file or pattern.
pub fn prim_name(input: &Path) -> String {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    usd::prim_name(stem.split(['%', '#', '$', '.']).next().unwrap_or_default())
}

/// Refuses an output file of a type that cannot hold a mesh.
pub fn check_output(path: &Path) -> Result<(), Failure> {
    let extension = extension(path);
    if usd::Format::of(&extension).is_some() || io::mesh::EXTENSIONS.contains(&extension.as_str()) {
        return Ok(());
    }
    Err(Failure::of_file(path, "the output must be a .obj, .ply, .stl, .usda or .usdc file"))
}

/// A file to be written with one mesh.
pub struct MeshFile<'a> {
    pub path: &'a Path,
    /// Name of the mesh in USD.
    pub name: &'a str,
    pub frame: i32,
    pub fps: f64,
    pub units: usd::Units,
}

impl MeshFile<'_> {
    /// Writes a mesh. USD stores velocities (m/s) as an attribute, not as arrays: `velocities` gets those found among the arrays, and
    /// returns those to write.
    pub fn write(
        &self,
        mesh: &TriMesh,
        uvs: Option<&Uvs>,
        arrays: &[MeshArray],
        velocities: impl FnOnce(Option<Vec<Vec3>>) -> frazil::Result<Vec<Vec3>>,
    ) -> frazil::Result<()> {
        let mut written: Vec<&MeshArray> = arrays.iter().collect();
        let Some(format) = usd::Format::of(&extension(self.path)) else {
            let carried = io::mesh::Carried { uvs, arrays: &written, ..Default::default() };
            return io::mesh::write_carried(self.path, mesh, &carried);
        };
        let found = vectors(arrays, VELOCITY);
        if found.is_some() {
            written.retain(|array| array.on != On::Vertices || !VELOCITY.contains(&&*array.name));
        }
        let velocities = velocities(found)?;
        let carried = io::mesh::Carried { velocities: &velocities, uvs, arrays: &written };
        let mesh = usd::MeshFrame::of(self.name, mesh, &carried, usd::Shading::Creased);
        let bytes = usd::clip("meshes", self.frame, self.fps, self.units, &[mesh]).bytes(format)?;
        atomic::write_bytes(self.path, &bytes)
    }
}

/// The output of a conversion, as far as it determines what data are lost.
pub struct Losses<'a> {
    /// File or pattern.
    pub output: &'a Path,
    /// Whether positions are unchanged.
    pub keeps_space: bool,
    /// Whether the input is a sequence, whose meshes all get the triangles of the first.
    pub is_sequence: bool,
}

impl Losses<'_> {
    /// Warns about data of an input file that the output cannot hold; `uvs` are its texture coordinates.
    pub fn warn(&self, input: &Path, uvs: Option<&Uvs>) -> frazil::Result<()> {
        let mut lost = if is_gltf(input) { Character::extras(input)? } else { io::mesh::extras::of(input)? };
        let uvs = uvs.filter(|_| io::mesh::holds_uvs(self.output));
        let to = extension(self.output);
        let is_usd = usd::Format::of(&to).is_some();
        lost.retain(|name| match *name {
            "UVs" => uvs.is_none(),
            "colours" => !["ply", "obj"].contains(&to.as_str()) && !is_usd,
            "velocities" => (to != "ply" && !is_usd) || !self.keeps_space,
            _ => true,
        });
        if let Some(missing) = uvs.map(|uvs| uvs.missing).filter(|missing| *missing > 0) {
            log::warn!("{}", missing_uvs(&input.display().to_string(), missing));
        }
        if !lost.is_empty() {
            log::warn!("{}: {} are not carried over", input.display(), joined_names(&lost));
        }
        // There are warnings about these above.
        const HAVE_OWN_WARNING: [&str; 7] = ["vx", "vy", "vz", "red", "green", "blue", "alpha"];
        let from = extension(input);
        if from != "ply" && usd::Format::of(&from).is_none() {
            return Ok(());
        }
        let arrays = io::mesh::read_any(input)?.into_detailed().arrays;
        let holds_arrays = to == "ply" || is_usd;
        let is_lost = |array: &&MeshArray| {
            if holds_arrays {
                self.is_sequence && array.on == On::Corners
            } else {
                !HAVE_OWN_WARNING.contains(&&*array.name)
            }
        };
        let names: Vec<&str> = arrays.iter().filter(is_lost).map(|array| &array.name[..]).collect();
        if !names.is_empty() {
            log::warn!("{}: arrays are not carried over: {}", input.display(), names.join(", "));
        }
        if is_usd && self.is_sequence && vectors(&arrays, VELOCITY).is_some() {
            log::warn!(
                "{}: its velocities are replaced by those computed from each frame to the next",
                input.display()
            );
        }
        let vectors = vector_stems(&arrays);
        if !vectors.is_empty() && !self.keeps_space && holds_arrays {
            log::warn!(
                "{}: these vectors keep their axes and units: {}",
                input.display(),
                vectors.join(", ")
            );
        }
        Ok(())
    }
}

/// The input of a conversion.
enum Source {
    /// A static mesh, or a character.
    One(Box<dyn Motion>),
    Sequence(Sequence),
}

/// A mesh for each frame.
struct Sequence {
    pattern: Pattern,
    /// Last frame to convert.
    last: i32,
    /// Consecutive frames, as long as their faces do not change.
    run: Option<Box<dyn Motion>>,
}

impl Source {
    /// Writes the mesh of a frame; returns its number of triangles.
    fn write(
        &mut self,
        args: &Args,
        path: &Path,
        frame: i32,
        has_warned: &mut bool,
    ) -> frazil::Result<usize> {
        match self {
            Self::One(motion) => {
                args.warn_once(&args.input, &**motion, frame, has_warned)?;
                args.write(path, &**motion, frame, false)?;
                Ok(motion.triangles().len())
            }
            Self::Sequence(sequence) => sequence.write(args, path, frame, has_warned),
        }
    }
}

impl Sequence {
    fn write(
        &mut self,
        args: &Args,
        path: &Path,
        frame: i32,
        has_warned: &mut bool,
    ) -> frazil::Result<usize> {
        let input = self.pattern.path(frame);
        io::files::source::open(&input).inspect_err(|_| self.run = None)?;
        if self.run.is_none() {
            let is_there = |frame: &i32| self.pattern.path(*frame).is_file();
            let last = (frame..=self.last).take_while(is_there).last().unwrap_or(frame);
            let (pattern, origin) = (self.pattern.clone(), args.space.origin.at);
            let run =
                MeshSequence::open_with_hashes(pattern, frame, last, args.fps, 0.0, Arc::default(), origin);
            self.run = run.ok().map(|run| args.in_metres(Box::new(run)));
        }
        if let Some(motion) = self.run.as_deref() {
            args.warn_once(&input, motion, frame, has_warned)?;
            match args.write(path, motion, frame, true) {
                Ok(()) => return Ok(motion.triangles().len()),
                Err(error @ (frazil::Error::Cancelled | frazil::Error::Io { .. })) => return Err(error),
                // Its faces differ from those of the run or of the next frame.
                Err(_) => self.run = None,
            }
        }
        let motion = args.static_mesh(&input)?;
        args.warn_once(&input, &*motion, frame, has_warned)?;
        args.write(path, &*motion, frame, false)?;
        log::info!(
            "{}: converted without velocities: its faces differ from those of the frames before or of the next frame",
            input.display()
        );
        Ok(motion.triangles().len())
    }
}

impl Args {
    /// The conversion of points, which are written in metres with Y up.
    fn points(&self) -> Result<points::Conversion<'_>, Failure> {
        if self.to_scale != 1.0 || self.to_up == Axis::Z {
            return Err(Failure::refused("--to-scale and --to-up are for meshes"));
        }
        if self.clip.is_some() || self.node.is_some() {
            return Err(Failure::refused("--clip and --node are for .glb and .gltf files"));
        }
        Ok(points::Conversion {
            input: &self.input,
            output: &self.output,
            frames: self.frames.as_ref(),
            fps: self.fps,
            voxel: self.voxel,
            space: self.space.space(),
        })
    }

    /// Warns about data of the first file that the output cannot hold.
    fn warn_once(
        &self,
        one: &Path,
        motion: &dyn Motion,
        frame: i32,
        has_warned: &mut bool,
    ) -> frazil::Result<()> {
        if std::mem::replace(has_warned, true) {
            return Ok(());
        }
        let is_sequence = Pattern::parse(&self.input).is_some();
        let losses = Losses { output: &self.output, keeps_space: self.keeps_space(), is_sequence };
        let mut pose = Vec::new();
        motion.drawn_pose(f64::from(frame) / self.fps, &mut pose)?;
        let triangles = motion.drawn().triangles.to_vec();
        warn_if_far(one, &TriMesh { positions: usd::to_floats(&pose), triangles });
        losses.warn(one, motion.drawn().uvs)
    }

    /// The input, in metres with Y up, and its frames.
    fn source(&self) -> Result<(Source, FrameChoice), Failure> {
        let is_character = is_gltf(&self.input);
        if !is_character && (self.clip.is_some() || self.node.is_some()) {
            return Err(Failure::refused("--clip and --node are for .glb and .gltf files"));
        }
        match Pattern::parse(&self.input) {
            None if is_character => {
                let frames = self.frames.clone().unwrap_or_else(one_frame);
                let (node, clip) = (self.node.clone(), self.clip.clone());
                let start = f64::from(frames.first()) / self.fps;
                let play = Play { node, clip, repeat: true, start };
                let character = Box::new(Character::open(&self.input, play).or_refuse()?);
                let motion = Placed::new(character, self.space.space(), Keys::default());
                Ok((Source::One(Box::new(motion)), frames))
            }
            None if self.frames.is_some() => {
                Err(Failure::refused("--frames cannot be used with a single mesh"))
            }
            None => Ok((Source::One(self.static_mesh(&self.input).or_refuse()?), one_frame())),
            Some(pattern) => {
                let frames = self.frames.clone().ok_or_else(|| needs_frames(&self.input))?;
                let last = frames.last();
                Ok((Source::Sequence(Sequence { pattern, last, run: None }), frames))
            }
        }
    }

    /// A mesh, or meshes, read relative to the origin, in metres with Y up.
    fn in_metres(&self, motion: Box<dyn Motion>) -> Box<dyn Motion> {
        Box::new(Placed::new(motion, self.space.space().without_origin(), Keys::default()))
    }

    /// A static mesh.
    fn static_mesh(&self, path: &Path) -> frazil::Result<Box<dyn Motion>> {
        Ok(self.in_metres(Box::new(Rigid::of_polygons(
            io::mesh::read_any_from(path, self.space.origin.at)?,
            Keys::default(),
        ))))
    }

    /// The arrays of a frame's mesh, if the output holds any: characters have none.
    fn arrays(&self, output: &Path, frame: i32, is_sequence: bool) -> frazil::Result<Vec<MeshArray>> {
        let input = frame_path(&self.input, frame);
        if is_gltf(&input) || extension(output) == "stl" {
            return Ok(Vec::new());
        }
        let mut arrays = io::mesh::read_any(&input)?.into_detailed().arrays;
        if usd::Format::of(&extension(output)).is_some() {
            name_velocities(&mut arrays);
        }
        // Velocities are not converted to another space.
        arrays.retain(|array| self.keeps_space() || !VELOCITY.contains(&&*array.name));
        // Each mesh of a sequence may triangulate its polygons differently, but all get the triangles of the first.
        arrays.retain(|array| array.on != On::Corners || !is_sequence);
        Ok(arrays)
    }

    /// Whether positions are unchanged.
    fn keeps_space(&self) -> bool {
        self.space.space().keeps_vectors() && self.to_scale == 1.0 && self.to_up == Axis::Y
    }

    /// Writes the mesh of a frame; in a sequence its velocities lead to the next frame.
    fn write(&self, path: &Path, motion: &dyn Motion, frame: i32, is_sequence: bool) -> frazil::Result<()> {
        let time = f64::from(frame) / self.fps;
        let (mut pose, mut velocities) = (Vec::new(), Vec::new());
        motion.drawn_pose(time, &mut pose)?;
        let to_output_space = |vectors: &mut Vec<frazil::geometry::DVec3>| {
            vectors.iter_mut().for_each(|p| {
                *p *= self.to_scale;
                if self.to_up == Axis::Z {
                    *p = frazil::geometry::DVec3::new(p.x, -p.z, p.y);
                }
            });
        };
        to_output_space(&mut pose);
        let (positions, drawn) = (usd::to_floats(&pose), motion.drawn());
        let mesh = TriMesh { positions, triangles: drawn.triangles.to_vec() };
        let arrays = self.arrays(path, frame, is_sequence)?;
        let name = prim_name(&self.input);
        let units = usd::Units { metres: 1.0 / self.to_scale, z_up: self.to_up == Axis::Z };
        let file = MeshFile { path, name: &name, frame, fps: self.fps, units };
        file.write(&mesh, drawn.uvs, &arrays, |found| {
            motion.velocities_ahead(time, 1.0 / self.fps, &mut velocities)?;
            to_output_space(&mut velocities);
            // In a sequence, velocities lead from each mesh to the next.
            Ok(found.filter(|_| !is_sequence).unwrap_or_else(|| usd::to_floats(&velocities)))
        })
    }
}
