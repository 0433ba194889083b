//! `frazil vdb to-mesh`.

use super::check_name;
use crate::cli::options::finite;
use crate::cli::output;
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::vdb::{file, level_set};
use serde_json::json;
use std::path::PathBuf;

/// Make a mesh of a level set's surface
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb to-mesh cache/base/base.0048.vdb -o print.ply")]
pub struct Args {
    /// Level set (.vdb)
    input: PathBuf,
    /// Grid of the file [default: its first level set]
    #[arg(long, value_name = "NAME")]
    grid: Option<String>,
    /// Distance of the mesh from the surface (m); below 0 is inside
    #[arg(long, value_name = "M", default_value = "0", value_parser = finite, allow_hyphen_values = true)]
    iso: f64,
    /// How much to enlarge triangles where the surface is flat, 0 to 1
    #[arg(long, value_name = "PART", default_value = "0", value_parser = finite)]
    adaptivity: f64,
    /// File to write (.ply, .obj, .stl)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    if !(0.0..=1.0).contains(&args.adaptivity) {
        return Err(Failure::refused("--adaptivity must lie in 0 to 1"));
    }
    check_name(&args.output, &["ply", "obj", "stl"])?;
    output::check_writable(&args.output).or_refuse()?;
    output::refuse_input(&args.output, [args.input.as_path()]).or_refuse()?;
    let grid = file::read_level_set(&session.ctx, &args.input, args.grid.as_deref()).or_refuse()?;
    if args.iso.abs() >= f64::from(grid.background()) {
        let band = grid.background();
        return Err(Failure::refused(format!("--iso {} lies outside the band of {band} m", args.iso)));
    }
    let (iso, adaptivity) = (args.iso as f32, args.adaptivity as f32);
    let work = || level_set::to_mesh(&session.ctx, &grid, iso, adaptivity);
    let mesh = session.ctx.phase("mesh", work).or_fail()?;
    frazil::io::mesh::write(&args.output, &mesh).or_fail()?;
    session.record("vertices", json!(mesh.positions.len()));
    session.record("triangles", json!(mesh.triangles.len()));
    Ok(())
}
