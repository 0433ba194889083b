//! `frazil vdb union`, `difference`, `intersection`.

use super::VdbOutput;
use crate::cli::session::Session;
use crate::cli::session::exit::{Failure, Phase};
use frazil::vdb::{FloatGrid, file, level_set};
use frazil::{Context, Result};
use std::path::PathBuf;

#[derive(clap::Args)]
struct Operands {
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

/// Unite two level sets: what lies in A or in B
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb union left.vdb right.vdb -o both.vdb")]
pub struct UnionArgs {
    #[command(flatten)]
    operands: Operands,
}

/// Take one level set from another: what lies in A but not in B
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb difference snow.vdb boot.vdb -o print.vdb")]
pub struct DifferenceArgs {
    #[command(flatten)]
    operands: Operands,
}

/// Intersect two level sets: what lies in A and in B
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb intersection snow.vdb boot.vdb -o removed.vdb")]
pub struct IntersectionArgs {
    #[command(flatten)]
    operands: Operands,
}

/// Runs `union`.
pub fn union(args: &UnionArgs, session: &Session) -> std::result::Result<(), Failure> {
    combine(&args.operands, session, "union", level_set::union)
}

/// Runs `difference`.
pub fn difference(args: &DifferenceArgs, session: &Session) -> std::result::Result<(), Failure> {
    combine(&args.operands, session, "difference", level_set::difference)
}

/// Runs `intersection`.
pub fn intersection(args: &IntersectionArgs, session: &Session) -> std::result::Result<(), Failure> {
    combine(&args.operands, session, "intersection", level_set::intersection)
}

fn combine(
    operands: &Operands,
    session: &Session,
    phase: &'static str,
    operation: impl FnOnce(&Context, &mut FloatGrid, FloatGrid) -> Result<()> + Send,
) -> std::result::Result<(), Failure> {
    operands.output.check(&[&operands.a, &operands.b])?;
    let mut a = file::read_level_set(&session.ctx, &operands.a, operands.grid_a.as_deref()).before()?;
    let b = file::read_level_set(&session.ctx, &operands.b, operands.grid_b.as_deref()).before()?;
    session.ctx.phase(phase, || operation(&session.ctx, &mut a, b)).during()?;
    operands.output.write(session, a).during()
}
