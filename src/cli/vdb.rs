//! `frazil vdb`: operations on level sets.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use frazil::io::sequence::Pattern;
use frazil::motion::{Keys, MeshSequence, Motion, Rigid};
use frazil::snow::base_layer::{NoiseParams, displace};
use frazil::sweep::{self, Body, SamplesSettings, Settings};
use frazil::vdb::file::{WriteOptions, read_named, write};
use frazil::vdb::level_set::{self, Scheme};
use frazil::vdb::{FloatGrid, GridClass};
use frazil::{Context, Error, io};

use super::exit::{Failure, Phase};
use super::output;
use super::session::Session;

/// Make and change level sets in .vdb files.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb from-mesh boot.obj -o boot.vdb --cell 0.002")]
pub struct Args {
    #[command(subcommand)]
    operation: Operation,
}

#[derive(Subcommand)]
enum Operation {
    /// The solid that a mesh bounds.
    #[command(after_help = "Example:\n  frazil vdb from-mesh boot.obj -o boot.vdb --cell 0.002")]
    FromMesh {
        mesh: PathBuf,
        #[command(flatten)]
        made: Made,
    },
    /// The volume that a mesh sequence sweeps.
    #[command(after_help = "Example:\n  frazil vdb sweep body.%04d.obj --frames 1-2 -o sweep.vdb --cell 0.005")]
    Sweep {
        /// A pattern such as body.%04d.obj.
        sequence: PathBuf,
        /// First and last frame.
        #[arg(long, value_name = "A-B")]
        frames: frazil::scene::Frames,
        /// `samples` is the thesis' way: a union of poses.
        #[arg(long, value_enum, default_value = "chain")]
        method: Method,
        /// Poses a frame, for --method samples.
        #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1024))]
        samples: u32,
        #[command(flatten)]
        made: Made,
    },
    /// A or B.
    #[command(after_help = "Example:\n  frazil vdb union a.vdb b.vdb -o both.vdb")]
    Union(Two),
    /// A without B.
    #[command(after_help = "Example:\n  frazil vdb difference snow.vdb boot.vdb -o print.vdb")]
    Difference(Two),
    /// What A and B share.
    #[command(after_help = "Example:\n  frazil vdb intersection snow.vdb boot.vdb -o removed.vdb")]
    Intersection(Two),
    /// Move the surface outward (inward when negative).
    #[command(after_help = "Example:\n  frazil vdb offset boot.vdb -o thick.vdb --by 0.002")]
    Offset {
        #[command(flatten)]
        one: One,
        /// How far (m).
        #[arg(long, value_name = "M", allow_hyphen_values = true)]
        by: f32,
    },
    /// Smooth the surface.
    #[command(after_help = "Example:\n  frazil vdb smooth boot.vdb -o soft.vdb --filter mean --times 2")]
    Smooth {
        #[command(flatten)]
        one: One,
        #[arg(long, value_enum, default_value = "gaussian")]
        filter: Filter,
        /// Cells to each side.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=16))]
        width: u32,
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
        times: u32,
    },
    /// Displace the surface outward by noise.
    #[command(after_help = "Example:\n  frazil vdb displace boot.vdb -o ragged.vdb --amplitude 0.01 --size 0.06")]
    Displace {
        #[command(flatten)]
        one: One,
        /// Greatest displacement (m) [default: 2 cells].
        #[arg(long)]
        amplitude: Option<f64>,
        /// Size of the largest clumps (m) [default: 8 cells].
        #[arg(long)]
        size: Option<f64>,
        #[arg(long, default_value_t = 3)]
        octaves: u32,
        #[arg(long, default_value_t = 0)]
        seed: i32,
    },
    /// The surface as triangles.
    #[command(after_help = "Example:\n  frazil vdb to-mesh print.vdb -o print.ply")]
    ToMesh {
        #[command(flatten)]
        one: One,
        /// Merge flat regions, 0 to 1.
        #[arg(long, default_value_t = 0.0)]
        adaptivity: f32,
    },
}

#[derive(clap::Args)]
struct Made {
    /// The .vdb file to write.
    #[arg(short, long)]
    output: PathBuf,
    /// Edge of a cell (m).
    #[arg(long, value_name = "M")]
    cell: f64,
    /// Half width of the narrow band (cells).
    #[arg(long, default_value_t = 3.0)]
    half_width: f32,
}

impl Made {
    fn settings(&self) -> Settings {
        Settings { half_width: self.half_width, ..Settings::new(self.cell) }
    }
}

#[derive(clap::Args)]
struct One {
    input: PathBuf,
    /// The file to write.
    #[arg(short, long)]
    output: PathBuf,
}

#[derive(clap::Args)]
struct Two {
    a: PathBuf,
    b: PathBuf,
    /// The .vdb file to write.
    #[arg(short, long)]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Method {
    Chain,
    Samples,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Filter {
    Mean,
    Gaussian,
}

type Csg = fn(&Context, &FloatGrid, &FloatGrid) -> frazil::Result<FloatGrid>;

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let ctx = &session.ctx;
    match args.operation {
        Operation::FromMesh { mesh, made } => {
            output::check_writable(&made.output).before()?;
            let mesh = io::mesh::read(&mesh).before()?;
            save(&made.output, sweep::voxelise(ctx, &mesh, &made.settings()).during()?)
        }
        Operation::Sweep { sequence, frames, method, samples, made } => {
            output::check_writable(&made.output).before()?;
            let bodies = [body(&sequence, frames).before()?];
            let (from, to) = (f64::from(frames.first), f64::from(frames.last));
            let swept = match method {
                Method::Chain => sweep::chain(ctx, &bodies, from, to, &made.settings()),
                Method::Samples => {
                    let settings = SamplesSettings { samples, half_width: made.half_width, ..SamplesSettings::new(made.cell) };
                    made.settings().validate().and_then(|()| sweep::samples(ctx, &bodies, from, to, &settings))
                }
            };
            save(&made.output, swept.during()?)
        }
        Operation::Union(two) => csg(&two, ctx, level_set::union_copy),
        Operation::Difference(two) => csg(&two, ctx, level_set::difference_copy),
        Operation::Intersection(two) => csg(&two, ctx, level_set::intersection_copy),
        Operation::Offset { one, by } => change(&one, |grid| level_set::offset(ctx, grid, by, Scheme::Weno5)),
        Operation::Smooth { one, filter, width, times } => change(&one, |grid| match filter {
            Filter::Mean => level_set::mean_filter(ctx, grid, width, times, Scheme::Weno5),
            Filter::Gaussian => level_set::gaussian_filter(ctx, grid, width, times, Scheme::Weno5),
        }),
        Operation::Displace { one, amplitude, size, octaves, seed } => change(&one, |grid| {
            let defaults = NoiseParams::for_cell(grid.voxel_size());
            let amplitude = amplitude.unwrap_or(defaults.amplitude);
            let noise = NoiseParams { amplitude, size: size.unwrap_or(defaults.size), octaves, seed };
            displace(ctx, grid, &noise)
        }),
        Operation::ToMesh { one, adaptivity } => {
            let grid = open(&one.input, &one.output)?;
            if !(0.0..=1.0).contains(&adaptivity) {
                return Err(Failure::refused(format!("--adaptivity {adaptivity} is not within 0 to 1")));
            }
            let mesh = level_set::to_mesh(ctx, &grid, 0.0, adaptivity).during()?;
            io::mesh::write(&one.output, &mesh).during()
        }
    }
}

fn body(sequence: &Path, frames: frazil::scene::Frames) -> frazil::Result<Body> {
    let motion: Box<dyn Motion> = match Pattern::parse(sequence) {
        Some(pattern) => Box::new(MeshSequence::open(pattern, frames.first, frames.last, 1.0, 0.0)?),
        None => Box::new(Rigid::new(io::mesh::read(sequence)?, Keys::default())),
    };
    Body::new(motion, f64::from(frames.first))
}

/// Opens the level set of a command that writes another file.
fn open(input: &Path, written: &Path) -> Result<FloatGrid, Failure> {
    output::check_writable(written).before()?;
    let grid = read_named(input, None).before()?;
    if grid.class() != GridClass::LevelSet {
        return Err(Failure::refused(Error::file(input, format!("grid \"{}\" is not a level set", grid.name()))));
    }
    Ok(grid)
}

fn change(one: &One, operation: impl FnOnce(&mut FloatGrid) -> frazil::Result<()>) -> Result<(), Failure> {
    let mut grid = open(&one.input, &one.output)?;
    operation(&mut grid).during()?;
    save(&one.output, grid)
}

fn csg(two: &Two, ctx: &Context, operation: Csg) -> Result<(), Failure> {
    let a = open(&two.a, &two.output)?;
    let b = open(&two.b, &two.output)?;
    save(&two.output, operation(ctx, &a, &b).during()?)
}

fn save(path: &Path, mut grid: FloatGrid) -> Result<(), Failure> {
    grid.set_name("surface").and_then(|()| write(path, &[&grid], &WriteOptions::default())).during()
}
