//! `frazil vdb displace`.

use super::VdbOutput;
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::snow::NoiseParams;
use frazil::snow::base_layer::displace;
use frazil::vdb::file;
use std::path::PathBuf;

/// Displace a level set's surface outward by noise, never inward
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb displace boot.vdb --amplitude 0.01 --size 0.06 -o ragged.vdb")]
pub struct Args {
    /// Level set (.vdb)
    input: PathBuf,
    /// Grid of the file [default: its first level set]
    #[arg(long, value_name = "NAME")]
    grid: Option<String>,
    /// Maximum displacement (m), up to 32 cells [default: 2 cells]
    #[arg(long, value_name = "M")]
    amplitude: Option<f64>,
    /// Size of the largest clumps (m) [default: 8 cells]
    #[arg(long, value_name = "M")]
    size: Option<f64>,
    /// Octaves, each of half the size and a quarter of the strength, 1 to 8
    #[arg(long, value_name = "N", default_value = "3")]
    octaves: u32,
    /// Seed of the pattern
    #[arg(long, value_name = "N", default_value = "0")]
    seed: i32,
    #[command(flatten)]
    output: VdbOutput,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    args.output.check(&[&args.input])?;
    let mut grid = file::read_level_set(&session.ctx, &args.input, args.grid.as_deref()).or_refuse()?;
    let defaults = NoiseParams::for_cell(grid.voxel_size());
    let amplitude = args.amplitude.unwrap_or(defaults.amplitude);
    let size = args.size.unwrap_or(defaults.size);
    let noise = NoiseParams { amplitude, size, octaves: args.octaves, seed: args.seed };
    noise.validate(grid.voxel_size()).or_refuse()?;
    displace(&session.ctx, &mut grid, &noise).or_fail()?;
    args.output.write(session, grid).or_fail()
}
