//! `frazil vdb`: level sets from meshes, moving meshes and each other.

mod combine;
mod displace;
mod filter;
mod from_mesh;
mod from_particles;
pub mod info;
mod rebuild;
mod sweep;
mod to_mesh;

use super::output;
use super::session::{Failure, OrFailure, Session};
use clap::{Subcommand, ValueEnum};
use frazil::geometry::TriMesh;
use frazil::geometry::mesh::{BY_OPTION, too_far_warning};
use frazil::sweep::surface_bytes;
use frazil::vdb::file::{self, Compression, WriteOptions};
use frazil::vdb::{FloatGrid, level_set};
use frazil::{Error, Result};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Make, combine and change level sets in .vdb files
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  frazil vdb from-mesh bunny.obj --cell 0.002 -o bunny.vdb
  frazil vdb offset bunny.vdb --by 0.01 -o fat.vdb
  frazil vdb difference fat.vdb bunny.vdb -o shell.vdb")]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    FromMesh(from_mesh::Args),
    FromParticles(from_particles::Args),
    Sweep(sweep::Args),
    /// Unite two level sets: what lies in A or in B
    #[command(after_help = "Example:\n  frazil vdb union left.vdb right.vdb -o both.vdb")]
    Union(combine::Operands),
    /// Take one level set from another: what lies in A but not in B
    #[command(after_help = "Example:\n  frazil vdb difference snow.vdb boot.vdb -o print.vdb")]
    Difference(combine::Operands),
    /// Intersect two level sets: what lies in A and in B
    #[command(after_help = "Example:\n  frazil vdb intersection snow.vdb boot.vdb -o removed.vdb")]
    Intersection(combine::Operands),
    Offset(filter::OffsetArgs),
    Smooth(filter::SmoothArgs),
    Displace(displace::Args),
    ToMesh(to_mesh::Args),
    Rebuild(rebuild::Args),
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> std::result::Result<(), Failure> {
    match args.command {
        Command::FromMesh(args) => from_mesh::run(&args, session),
        Command::FromParticles(args) => from_particles::run(&args, session),
        Command::Sweep(args) => sweep::run(&args, session),
        Command::Union(args) => combine::run(&args, session, "union", level_set::union),
        Command::Difference(args) => combine::run(&args, session, "difference", level_set::difference),
        Command::Intersection(args) => combine::run(&args, session, "intersection", level_set::intersection),
        Command::Offset(args) => filter::offset(&args, session),
        Command::Smooth(args) => filter::smooth(&args, session),
        Command::Displace(args) => displace::run(&args, session),
        Command::ToMesh(args) => to_mesh::run(&args, session),
        Command::Rebuild(args) => rebuild::run(&args, session),
    }
}

/// Output file and packing of a level set.
#[derive(clap::Args)]
struct VdbOutput {
    /// File to write (.vdb)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Name of the grid in the file
    #[arg(long, value_name = "NAME", default_value = "surface")]
    name: String,
    #[command(flatten)]
    packing: Packing,
}

/// How values are packed.
#[derive(clap::Args)]
struct Packing {
    /// Codec of the file
    #[arg(long, value_enum, default_value = "blosc", requires = "output")]
    compression: Codec,
    /// Store 16-bit values: smaller, for rendering only
    #[arg(long, requires = "output")]
    half: bool,
}

impl Packing {
    /// The library's type for it.
    fn options(&self) -> WriteOptions {
        let compression = match self.compression {
            Codec::Blosc => Compression::Blosc,
            Codec::Zip => Compression::Zip,
            Codec::None => Compression::None,
        };
        WriteOptions { compression, half: self.half, metadata: Vec::new() }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Codec {
    /// Fast
    Blosc,
    /// Small
    Zip,
    /// Neither
    None,
}

impl VdbOutput {
    /// Refuses, before any work, a name or a folder that cannot be written, or an output that is one of the inputs.
    fn check(&self, inputs: &[&Path]) -> std::result::Result<(), Failure> {
        check_name(&self.output, &["vdb"])?;
        output::check_writable(&self.output).or_refuse()?;
        output::refuse_input(&self.output, inputs.iter().copied()).or_refuse()
    }

    /// Writes the grid and records what it holds.
    fn write(&self, session: &Session, mut grid: FloatGrid) -> Result<()> {
        grid.set_name(&self.name)?;
        session.ctx.check()?;
        file::write(&self.output, &[&grid], &self.packing.options())?;
        session.record("active_voxels", json!(grid.active_voxels()));
        session.record("memory_bytes", json!(grid.memory_bytes()));
        Ok(())
    }
}

/// Refuses an output file with the extension of another format.
fn check_name(path: &Path, extensions: &[&str]) -> std::result::Result<(), Failure> {
    let extension = path.extension().and_then(|text| text.to_str()).unwrap_or("").to_lowercase();
    if extensions.contains(&extension.as_str()) {
        return Ok(());
    }
    let wanted: Vec<String> = extensions.iter().map(|name| format!(".{name}")).collect();
    Err(Failure::of_file(path, format!("the output must be a {} file", wanted.join(" or "))))
}

/// The message for a mesh so far away (m) that its file's 32-bit positions are coarse compared with a cell (m).
fn far_mesh(path: &Path, mesh: &TriMesh, cell: f64) -> Option<String> {
    too_far_warning(&path.display().to_string(), mesh.farthest(), 1.0, cell, BY_OPTION)
}

/// Refuses a level set whose surface (m2) would need too much memory with this cell (m).
fn check_surface(session: &Session, area: f64, cell: f64) -> Result<()> {
    let (needed, limit) = (surface_bytes(area, cell), session.max_memory());
    if needed <= limit {
        return Ok(());
    }
    Err(Error::Memory { what: format!("a level set with --cell {cell}"), needed, limit })
}
