//! `frazil vdb from-particles`.

use super::{Packing, check_name};
use crate::cli::cloud::points_of_vdb;
use crate::cli::exit::{Failure, Phase};
use crate::cli::options::{MeshSpace, positive};
use crate::cli::output;
use crate::cli::session::Session;
use frazil::base::{DVec3, TriMesh};
use frazil::io;
use frazil::io::mesh::extension;
use frazil::io::particles::{self, Cloud};
use frazil::io::sequence::Pattern;
use frazil::scene::{FrameChoice, Frames};
use frazil::surface::{Distances, HALF_WIDTH, Implicit, Isosurface, estimate_spacing, level_set};
use frazil::vdb::file;
use frazil::{Error, Result};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Make the surface of a liquid from its particles: a level set, a mesh, or both
///
/// The surface is that of Solenthaler et al. (2007): smooth, half a spacing above the outermost particles, and no bridges between
/// parts that are far from each other.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil vdb from-particles splash.0001.bgeo --mesh splash.ply
  frazil vdb from-particles splash.%04d.bgeo --frames 1-2 -o level.%04d.vdb --mesh splash.%04d.ply --spacing 0.1")]
pub struct Args {
    /// Particles (.bgeo, .vtk, .vtu, .xyz, .ply, .vdb), or a sequence of them (splash.%04d.bgeo)
    particles: PathBuf,
    /// Initial distance between particles (m) [default: estimated, and said]
    #[arg(long, value_name = "M", value_parser = positive)]
    spacing: Option<f64>,
    /// Edge of a voxel (m), 1/8 to 2 spacings [default: half a spacing]
    #[arg(long, value_name = "M", value_parser = positive)]
    cell: Option<f64>,
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
    #[arg(long, value_name = "NAME", default_value = "surface")]
    name: String,
    #[command(flatten)]
    packing: Packing,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> std::result::Result<(), Failure> {
    session.ctx.set_memory_limit(session.max_memory());
    let input = Pattern::parse(&args.particles);
    let frames = args.frames(input.is_some())?;
    for (path, extensions) in [(&args.output, &["vdb"][..]), (&args.mesh, &["ply", "obj", "stl"])] {
        let Some(path) = path else { continue };
        check_name(path, extensions)?;
        output::check_writable(path).before()?;
        let pattern = Pattern::parse(path);
        if pattern.is_none() && frames.count() > 1 {
            let what = format!("{}: several frames need a pattern such as level.%04d.vdb", path.display());
            return Err(Failure::refused(what));
        }
        for frame in frames.iter() {
            let from = of_frame(&args.particles, frame);
            output::refuse_input(&of_frame(path, frame), [from.as_path()]).before()?;
        }
    }
    for frame in frames.iter() {
        // A gap in a sequence is known before any work.
        io::source::open(&of_frame(&args.particles, frame)).before()?;
    }
    let mut spacing = args.spacing;
    let (mut particles, mut triangles) = (0, 0);
    for (n, frame) in frames.iter().enumerate() {
        session.ctx.check().during()?;
        let path = of_frame(&args.particles, frame);
        let read = args.read(&path);
        // What the first file is without, no frame can be begun with.
        let places = if n == 0 { read.before()? } else { read.during()? };
        let spacing = match spacing {
            Some(spacing) => spacing,
            None => *spacing.insert(estimated(&path, &places).before()?),
        };
        if n == 0 && args.spacing.is_some() {
            warn_of_spacing(&path, &places, spacing);
        }
        let made = args.make(session, &places, spacing, frame);
        let is_refused = matches!(made, Err(Error::Argument(_) | Error::Memory { .. }));
        let mesh = if n == 0 && is_refused { made.before()? } else { made.during()? };
        particles += places.len();
        triangles += mesh.triangles.len();
    }
    session.record("frames", json!(frames.count()));
    session.record("particles", json!(particles));
    session.record("spacing_m", json!(spacing));
    session.record("triangles", json!(triangles));
    Ok(())
}

/// The file of a frame, of one file or of a sequence.
fn of_frame(path: &Path, frame: i32) -> PathBuf {
    Pattern::parse(path).map_or_else(|| path.to_path_buf(), |pattern| pattern.path(frame))
}

fn estimated(path: &Path, places: &[DVec3]) -> Result<f64> {
    let Some(spacing) = estimate_spacing(places) else {
        return Err(Error::file(
            path,
            "has too few particles, or too many at one place, to tell their spacing: give --spacing",
        ));
    };
    log::warn!(
        "{}: the spacing of the particles is estimated as {spacing:.6} m; --spacing sets it",
        path.display()
    );
    Ok(spacing)
}

/// How many times as large as the estimate, or as small, a spacing is that looks like a mistake.
const ODD: f64 = 2.0;

/// Says so when a given spacing (m) is not that of the particles: a wrong unit makes single drops, or one lump.
fn warn_of_spacing(path: &Path, places: &[DVec3], spacing: f64) {
    let odd = |estimate: &f64| !(1.0 / ODD..=ODD).contains(&(spacing / estimate));
    if let Some(estimate) = estimate_spacing(places).filter(odd) {
        log::warn!(
            "{}: a spacing of {spacing} m is given, but particles lie {estimate:.6} m apart",
            path.display()
        );
    }
}

impl Args {
    fn frames(&self, is_sequence: bool) -> std::result::Result<FrameChoice, Failure> {
        match &self.frames {
            None if is_sequence => {
                let what = format!("{}: a sequence needs --frames A-B", self.particles.display());
                Err(Failure::refused(what))
            }
            Some(frames) if !is_sequence && frames.count() > 1 => {
                Err(Failure::refused("several --frames are of no use with one file of particles"))
            }
            Some(frames) => Ok(frames.clone()),
            None => Ok(FrameChoice::from(Frames { first: 1, last: 1 })),
        }
    }

    /// Places (m) of the particles of a file.
    fn read(&self, path: &Path) -> Result<Vec<DVec3>> {
        let mut cloud: Cloud =
            if extension(path) == "vdb" { points_of_vdb(path)?.into() } else { particles::read(path)? };
        if cloud.places.is_empty() {
            return Err(Error::file(path, "holds no particles"));
        }
        self.space.space().bring(&mut cloud);
        Ok(cloud.places)
    }

    /// Makes the files of a frame.
    fn make(&self, session: &Session, places: &[DVec3], spacing: f64, frame: i32) -> Result<TriMesh> {
        let ctx = &session.ctx;
        let cell = self.cell.unwrap_or(0.5 * spacing);
        let phi = ctx.phase("phi", || Implicit::new(ctx, places, spacing, cell))?;
        let surface = ctx.phase("mesh", || Ok(Isosurface::new(&phi)))?;
        let mesh = surface.mesh(&phi);
        if let Some(path) = &self.output {
            let distances = ctx.phase("distance", || Distances::new(ctx, &phi, &surface, HALF_WIDTH))?;
            let mut grid = ctx.phase("grid", || level_set(ctx, &distances))?;
            grid.set_name(&self.name)?;
            file::write(&of_frame(path, frame), &[&grid], &self.packing.options())?;
        }
        if let Some(path) = &self.mesh {
            io::mesh::write(&of_frame(path, frame), &mesh)?;
        }
        Ok(mesh)
    }
}
