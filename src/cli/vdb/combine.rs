//! `frazil vdb union`, `difference`, `intersection`.

use super::VdbOutput;
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::vdb::{FloatGrid, file};
use frazil::{Context, Result};
use std::path::PathBuf;

#[derive(clap::Args)]
pub struct Operands {
    /// First level set (.vdb)
    a: PathBuf,
    /// Second level set (.vdb), with cells of the same size
    b: PathBuf,
    /// Grid of the first file [default: its first level set]
    #[arg(long, value_name = "NAME")]
    grid_a: Option<String>,
    /// Grid of the second file [default: its first level set]
    #[arg(long, value_name = "NAME")]
    grid_b: Option<String>,
    #[command(flatten)]
    output: VdbOutput,
}

/// Combines two level sets in a phase of this name.
pub fn run(
    operands: &Operands,
    session: &Session,
    phase: &'static str,
    operation: impl FnOnce(&Context, &mut FloatGrid, FloatGrid) -> Result<()> + Send,
) -> std::result::Result<(), Failure> {
    operands.output.check(&[&operands.a, &operands.b])?;
    let mut a = file::read_level_set(&session.ctx, &operands.a, operands.grid_a.as_deref()).or_refuse()?;
    let b = file::read_level_set(&session.ctx, &operands.b, operands.grid_b.as_deref()).or_refuse()?;
    session.ctx.phase(phase, || operation(&session.ctx, &mut a, b)).or_fail()?;
    operands.output.write(session, a).or_fail()
}
