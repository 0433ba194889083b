//! `frazil vdb from-particles`.

mod colliders;
mod shape;

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{Packing, check_name};
use crate::cli::frame_results::FrameResults;
use crate::cli::options::{
    MeshSpace, frame_path, needs_frames, one_frame, positive, refuse_one_file, triple,
};
use crate::cli::output;
use crate::cli::points::points_of_vdb;
use crate::cli::session::{Failure, OrFailure, Session};
use colliders::Colliders;
use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::points::{Attribute, Values};
use frazil::geometry::{DVec3, MeshArray, TriMesh};
use frazil::io::files::sequence::Pattern;
use frazil::io::mesh::extension;
use frazil::io::particles::{self, ParticleData};
use frazil::scene::FrameChoice;
use frazil::surface::{TOO_FAR, estimate_spacing, rough_spacing, specks, transfer};
use frazil::vdb::file;
use frazil::vdb::level_set::to_mesh;
use frazil::{Context, Error, Result, io};
use shape::{Method, SurfaceParams};

/// Make the surface of a liquid from its particles: a level set, a mesh, or both
///
/// The surface is that of Solenthaler et al. (2007): smooth, half a spacing above the outermost particles, and no bridges between
/// parts that are far from each other; or a union of spheres.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil vdb from-particles splash.0001.bgeo --mesh splash.ply
  frazil vdb from-particles splash.0001.bgeo --spacing 0.1 --smooth 10 --subtract boot.vdb --mesh splash.ply -o splash.vdb
  frazil vdb from-particles splash.%04d.bgeo --frames 1-2 -o level.%04d.vdb --mesh splash.%04d.ply --spacing 0.1")]
pub struct Args {
    /// Particles (.bgeo, .vtk, .vtu, .xyz, .ply, .vdb), or a sequence of them (splash.%04d.bgeo)
    particles: PathBuf,
    /// Initial distance between particles (m) [default: estimated and logged]
    #[arg(long, value_name = "M", value_parser = positive)]
    spacing: Option<f64>,
    /// Edge of a voxel (m), 1/8 to 2 spacings; for spheres 1/100 to 2/3 of their radius [default: half a spacing; for spheres at
    /// most a third of their radius]
    #[arg(long, value_name = "M", value_parser = positive)]
    cell: Option<f64>,
    /// Method that makes a surface of particles
    #[arg(long, value_enum, default_value = "solenthaler")]
    method: Method,
    /// Radius of the spheres (m), 1.5 to 100 voxels [default: one spacing; 0.87 of it fills a cubic grid without holes]
    #[arg(long, value_name = "M", value_parser = positive)]
    radius: Option<f64>,
    /// Passes that smooth the surface, 0 to 100; each connected part keeps its volume
    #[arg(long, value_name = "N", default_value = "0", value_parser = clap::value_parser!(u32).range(0..=100))]
    smooth: u32,
    /// Level set to cut out of the liquid (.vdb), or a sequence of them (collider.%04d.vdb); can be given several times
    #[arg(long, value_name = "FILE")]
    subtract: Vec<PathBuf>,
    /// Attributes of the particles to transfer to the mesh (.ply), as means over the particles around each vertex: v, density, or all
    #[arg(long, value_name = "A,B", value_delimiter = ',', requires = "mesh")]
    attributes: Vec<String>,
    /// Leave out isolated groups of fewer than N particles
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    min_drop: Option<u32>,
    /// Only particles in a box: its minimum corner (m)
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true, requires = "box_max")]
    box_min: Option<DVec3>,
    /// Only particles in a box: its maximum corner (m)
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true, requires = "box_min")]
    box_max: Option<DVec3>,
    /// Frames of a sequence
    #[arg(long, value_name = "A-B|A-BxN", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    #[command(flatten)]
    space: MeshSpace,
    /// Level set to write (.vdb), or the pattern of a sequence
    #[arg(short, long, value_name = "FILE", required_unless_present = "mesh")]
    output: Option<PathBuf>,
    /// Mesh to write (.ply, .obj, .stl), or the pattern of a sequence
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Name of the grid in the file
    #[arg(long, value_name = "NAME", default_value = "surface", requires = "output")]
    name: String,
    #[command(flatten)]
    packing: Packing,
}

/// Minimum cells in the radius of a sphere, unless `--cell` is given: with half as many, a lone drop loses a third of its volume.
const SPHERE_CELLS: f64 = 3.0;

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> std::result::Result<(), Failure> {
    session.ctx.set_memory_limit(session.max_memory());
    if args.radius.is_some() && args.method != Method::Spheres {
        return Err(Failure::refused("--radius needs --method spheres"));
    }
    let input = Pattern::parse(&args.particles);
    let frames = args.frames(input.is_some())?;
    for (path, extensions) in [(&args.output, &["vdb"][..]), (&args.mesh, &["ply", "obj", "stl"])] {
        let Some(path) = path else { continue };
        check_name(path, extensions)?;
        if !args.attributes.is_empty() && extensions.contains(&"ply") && extension(path) != "ply" {
            return Err(Failure::of_file(path, "only .ply files hold --attributes"));
        }
        output::check_writable(path).or_refuse()?;
        refuse_one_file(path, &frames, "level.%04d.vdb")?;
        for frame in frames.iter() {
            let inputs: Vec<PathBuf> = args.inputs().map(|input| frame_path(input, frame)).collect();
            output::refuse_input(&frame_path(path, frame), inputs.iter().map(PathBuf::as_path))
                .or_refuse()?;
        }
    }
    let mut colliders = Colliders::open(&session.ctx, &args.subtract).or_refuse()?;
    let spacing = match args.spacing {
        Some(spacing) => spacing,
        None => args.estimated_spacing(session, &frames)?,
    };
    let (mut total, mut is_compared) = (Counts::default(), args.spacing.is_none());
    let make = |frame| args.frame(session, frame, spacing, &mut colliders, &mut is_compared);
    let results = FrameResults::run(session, &frames, make, |made| {
        total.particles += made.particles;
        total.specks += made.specks;
        total.triangles += made.triangles;
    })?;
    session.record("particles", json!(total.particles));
    session.record("specks_left_out", json!(total.specks));
    session.record("spacing_m", json!(spacing));
    session.record("triangles", json!(total.triangles));
    results.finish()
}

/// Counts for the report.
#[derive(Default)]
struct Counts {
    particles: usize,
    specks: usize,
    triangles: usize,
}

/// A given spacing that differs from the estimate by more than this factor is probably a mistake.
const MAX_RATIO: f64 = 2.0;

/// Warns if a given spacing (m) does not match the particles, as with a wrong unit: the surface is then single drops, or one lump.
fn warn_of_spacing(path: &Path, positions: &[DVec3], spacing: f64) {
    let is_mistaken = |estimate: &f64| !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&(spacing / estimate));
    if let Some(estimate) = rough_spacing(positions).filter(is_mistaken) {
        log::warn!(
            "{}: a spacing of {spacing} m is given, but particles lie {estimate:.6} m apart",
            path.display()
        );
    }
}

impl Args {
    /// All files that are read, or their patterns.
    fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.particles).chain(&self.subtract)
    }

    fn frames(&self, is_sequence: bool) -> std::result::Result<FrameChoice, Failure> {
        let sequence = self.inputs().find(|path| Pattern::parse(path).is_some());
        match (&self.frames, sequence) {
            (None, Some(path)) => Err(needs_frames(path)),
            (Some(frames), _) if !is_sequence && frames.count() > 1 => {
                Err(Failure::refused("several --frames cannot be used with a single file of particles"))
            }
            (Some(frames), _) => Ok(frames.clone()),
            (None, None) => Ok(one_frame()),
        }
    }

    /// The spacing (m) of the particles, from the first frame that allows an estimate.
    fn estimated_spacing(
        &self,
        session: &Session,
        frames: &FrameChoice,
    ) -> std::result::Result<f64, Failure> {
        let mut first_error: Option<Error> = None;
        for frame in frames.iter() {
            session.ctx.check().or_fail()?;
            let path = frame_path(&self.particles, frame);
            match self.read(&path) {
                Ok(data) => {
                    if let Some(spacing) = estimate_spacing(&data.positions) {
                        log::warn!(
                            "{}: the spacing of the particles is estimated as {spacing:.6} m; --spacing sets it",
                            path.display()
                        );
                        return Ok(spacing);
                    }
                    let what = "has too few particles, or too many at one position, to tell their spacing: give --spacing";
                    first_error.get_or_insert_with(|| Error::file(&path, what));
                }
                Err(error) => {
                    first_error.get_or_insert(error);
                }
            }
        }
        Err(first_error.map_or_else(|| Failure::refused("there are no frames"), Failure::refused))
    }

    /// Makes the files of a frame.
    fn frame(
        &self,
        session: &Session,
        frame: i32,
        spacing: f64,
        colliders: &mut Colliders,
        is_compared: &mut bool,
    ) -> Result<Counts> {
        let path = frame_path(&self.particles, frame);
        let mut data = self.read(&path)?;
        if !data.positions.is_empty() && !std::mem::replace(is_compared, true) {
            warn_of_spacing(&path, &data.positions, spacing);
        }
        let specks = self.leave_out(&mut data, spacing, &path)?;
        // A file without particles may lack their attributes.
        let columns = if data.positions.is_empty() { Vec::new() } else { self.columns(&data, &path)? };
        let made = self.make(session, (&data.positions, &columns), spacing, (frame, colliders));
        let mesh = made.map_err(|error| match error {
            Error::Argument(what) if what.starts_with(TOO_FAR) => Error::file(&path, what),
            other => other,
        })?;
        Ok(Counts { particles: data.positions.len(), specks, triangles: mesh.triangles.len() })
    }

    /// Handles options that leave no particles: an error for a single file, a warning for a frame of a sequence, which may have no liquid.
    fn refuse_nothing(&self, path: &Path, what: &str) -> Result<()> {
        if Pattern::parse(&self.particles).is_none() {
            return Err(Error::file(path, what));
        }
        log::warn!("{}: {what}: its surface is empty", path.display());
        Ok(())
    }

    /// The particles of a file (m) that lie in the box; a warning if there are none.
    fn read(&self, path: &Path) -> Result<ParticleData> {
        let mut data: ParticleData =
            if extension(path) == "vdb" { points_of_vdb(path)?.into() } else { particles::read(path)? };
        if data.positions.is_empty() {
            log::warn!("{}: holds no particles: its surface is empty", path.display());
            return Ok(data);
        }
        self.space.space().convert(&mut data);
        if let (Some(low), Some(high)) = (self.box_min, self.box_max) {
            let is_inside = |p: &DVec3| (0..3).all(|axis| (low[axis]..=high[axis]).contains(&p[axis]));
            let is_kept: Vec<bool> = data.positions.iter().map(is_inside).collect();
            data.retain(&is_kept);
            if data.positions.is_empty() {
                self.refuse_nothing(path, "has no particles in the box")?;
            }
        }
        Ok(data)
    }

    /// Leaves small groups of particles out; returns the number of these particles.
    fn leave_out(&self, data: &mut ParticleData, spacing: f64, path: &Path) -> Result<usize> {
        let Some(min_count) = self.min_drop else { return Ok(0) };
        let specks = specks(&data.positions, spacing, min_count as usize)?;
        let count = specks.iter().filter(|is| **is).count();
        if count > 0 && count == data.positions.len() {
            self.refuse_nothing(path, &format!("has no group of {min_count} particles"))?;
        }
        if count > 0 {
            log::info!(
                "{}: {count} particles in groups of fewer than {min_count} are left out",
                path.display()
            );
            data.retain(&specks.iter().map(|is| !is).collect::<Vec<_>>());
        }
        Ok(count)
    }

    /// The attributes for the mesh, with the names of its arrays.
    fn columns(&self, data: &ParticleData, path: &Path) -> Result<Vec<(String, Vec<f32>)>> {
        let count = data.positions.len();
        let wanted = |attribute: &&Attribute| {
            matches!(attribute.values, Values::Float(_) | Values::Vector(_))
                && self.attributes.iter().any(|name| name == "all" || *name == attribute.name)
        };
        let found: Vec<&Attribute> = data.attributes.iter().filter(wanted).collect();
        let is_missing =
            |name: &&String| *name != "all" && !found.iter().any(|attribute| attribute.name == **name);
        if let Some(missing) = self.attributes.iter().find(is_missing) {
            let available: Vec<&str> = data.attributes.iter().map(|attribute| &attribute.name[..]).collect();
            let what = format!(
                "has no attribute \"{missing}\" of floats or vectors; it has {}",
                available.join(", ")
            );
            return Err(Error::file(path, what));
        }
        if let Some(attribute) = found.iter().find(|attribute| attribute.name.contains(char::is_whitespace)) {
            let what = format!("the name \"{}\" has a space, which .ply cannot hold", attribute.name);
            return Err(Error::file(path, what));
        }
        let mut out: Vec<(String, Vec<f32>)> = Vec::new();
        for attribute in found {
            match &attribute.values {
                Values::Float(column) => {
                    out.push((attribute.name.clone(), (0..count).map(|n| column.get(n)).collect()));
                }
                Values::Vector(column) => {
                    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                        let part = (0..count).map(|n| column.get(n)[axis]).collect();
                        out.push((format!("{}{letter}", attribute.name), part));
                    }
                }
                _ => {}
            }
        }
        let is_taken = |n: &usize| {
            let name = &out[*n].0;
            ["x", "y", "z"].contains(&&name[..]) || out[..*n].iter().any(|(other, _)| other == name)
        };
        if let Some(n) = (0..out.len()).find(is_taken) {
            let what =
                format!("the mesh would have two arrays \"{}\": choose others with --attributes", out[n].0);
            return Err(Error::file(path, what));
        }
        Ok(out)
    }

    /// The options that make a surface from particles of a spacing (m).
    fn surface_params(&self, spacing: f64) -> SurfaceParams {
        let radius = self.radius.unwrap_or(spacing);
        let cell = match self.method {
            Method::Solenthaler => 0.5 * spacing,
            Method::Spheres => (radius / SPHERE_CELLS).min(0.5 * spacing),
        };
        let cell = self.cell.unwrap_or(cell);
        SurfaceParams { method: self.method, spacing, cell, radius, passes: self.smooth }
    }

    /// Makes the files of a frame.
    fn make(
        &self,
        session: &Session,
        (positions, columns): (&[DVec3], &[(String, Vec<f32>)]),
        spacing: f64,
        (frame, colliders): (i32, &mut Colliders),
    ) -> Result<TriMesh> {
        let ctx = &session.ctx;
        let surface_params = self.surface_params(spacing);
        let wants_grid = self.output.is_some() || !colliders.is_empty();
        let (mut mesh, mut grid) = surface_params.surface(session, positions, wants_grid)?;
        if !colliders.is_empty()
            && let Some(liquid) = &mut grid
        {
            colliders.cut(session, liquid, frame)?;
            let cut = &*liquid;
            mesh = ctx.phase("mesh", || to_mesh(ctx, cut, 0.0, 0.0))?;
            if mesh.triangles.is_empty() && !positions.is_empty() {
                let particles = frame_path(&self.particles, frame);
                log::warn!("{}: nothing is left of the liquid", particles.display());
            }
        }
        if let (Some(path), Some(grid)) = (&self.output, &mut grid) {
            grid.set_name(&self.name)?;
            file::write(&frame_path(path, frame), &[&*grid], &self.packing.options())?;
        }
        if let Some(path) = &self.mesh {
            let means = ctx.phase("attributes", || means(ctx, positions, spacing, &mesh, columns))?;
            let arrays: Vec<&MeshArray> = means.iter().collect();
            let carried = io::mesh::Carried { arrays: &arrays, ..Default::default() };
            io::mesh::write_carried(&frame_path(path, frame), &mesh, &carried)?;
        }
        Ok(mesh)
    }
}

/// The mean attributes of the particles around each vertex, as arrays of a mesh.
fn means(
    ctx: &Context,
    positions: &[DVec3],
    spacing: f64,
    mesh: &TriMesh,
    columns: &[(String, Vec<f32>)],
) -> Result<Vec<MeshArray>> {
    if columns.is_empty() {
        return Ok(Vec::new());
    }
    let vertices: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    let numbers: Vec<Vec<f32>> = columns.iter().map(|(_, numbers)| numbers.clone()).collect();
    let means = transfer(ctx, positions, spacing, &vertices, &numbers)?;
    let array = |((name, _), values): (&(String, Vec<f32>), Vec<f32>)| MeshArray {
        name: name.clone(),
        on: On::Vertices,
        number: Number::F32,
        values: values.into_iter().map(f64::from).collect(),
    };
    Ok(columns.iter().zip(means).map(array).collect())
}
