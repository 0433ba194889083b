//! `frazil vdb offset` and `smooth`.

use super::VdbOutput;
use crate::cli::options::finite;
use crate::cli::session::{Failure, OrFailure, Session};
use clap::ValueEnum;
use frazil::vdb::file;
use frazil::vdb::level_set::{self, Scheme};
use std::path::PathBuf;

#[derive(clap::Args)]
struct Source {
    /// Level set (.vdb)
    input: PathBuf,
    /// Grid of the file [default: its first level set]
    #[arg(long, value_name = "NAME")]
    grid: Option<String>,
    /// Scheme that restores true distances [default: first-order; weno5 for an offset beyond the band of distances]
    #[arg(long, value_enum)]
    scheme: Option<SchemeName>,
    #[command(flatten)]
    output: VdbOutput,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum SchemeName {
    /// Seven times faster; loses a tenth of the offset
    FirstOrder,
    /// OpenVDB's default, fifth order
    Weno5,
}

impl From<SchemeName> for Scheme {
    fn from(name: SchemeName) -> Self {
        match name {
            SchemeName::FirstOrder => Self::FirstOrder,
            SchemeName::Weno5 => Self::Weno5,
        }
    }
}

/// Move the surface of a level set outward or inward
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb offset boot.vdb --by 0.01 -o thick.vdb")]
pub struct OffsetArgs {
    /// How far (m); below 0 is inward
    #[arg(long, value_name = "M", value_parser = finite, allow_hyphen_values = true)]
    by: f64,
    #[command(flatten)]
    source: Source,
}

/// Smooth a level set
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb smooth snow.vdb --filter mean --times 2 -o soft.vdb")]
pub struct SmoothArgs {
    /// New value of a voxel
    #[arg(long, value_enum, default_value = "gaussian")]
    filter: Filter,
    /// Reach of the filter (cells)
    #[arg(long, value_name = "CELLS", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=64))]
    width: u32,
    /// Passes
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=1000))]
    times: u32,
    #[command(flatten)]
    source: Source,
}

#[derive(Clone, Copy, ValueEnum)]
enum Filter {
    /// Mean of a cube
    Mean,
    /// Four means in succession
    Gaussian,
}

/// Runs `offset`.
pub fn offset(args: &OffsetArgs, session: &Session) -> Result<(), Failure> {
    let source = &args.source;
    source.output.check(&[&source.input])?;
    let mut grid = file::read_level_set(&session.ctx, &source.input, source.grid.as_deref()).or_refuse()?;
    let cells = args.by.abs() / grid.voxel_size();
    if cells > 1000.0 {
        return Err(Failure::refused(format!(
            "--by {} is {cells:.0} cells; at most 1000 are possible",
            args.by
        )));
    }
    let is_beyond_band = level_set::beyond_band(&grid, args.by);
    let scheme =
        source.scheme.unwrap_or(if is_beyond_band { SchemeName::Weno5 } else { SchemeName::FirstOrder });
    if is_beyond_band && scheme == SchemeName::FirstOrder {
        return Err(Failure::refused(format!(
            "--scheme first-order would fall short of --by {} by a tenth, since that leaves the band of distances ({} m): use \
             weno5",
            args.by,
            grid.background()
        )));
    }
    let work = || level_set::offset(&session.ctx, &mut grid, args.by as f32, scheme.into());
    session.ctx.phase("offset", work).or_fail()?;
    if grid.active_voxels() == 0 {
        log::warn!("{}: nothing is left at --by {}", source.input.display(), args.by);
    }
    source.output.write(session, grid).or_fail()
}

/// Runs `smooth`.
pub fn smooth(args: &SmoothArgs, session: &Session) -> Result<(), Failure> {
    let source = &args.source;
    source.output.check(&[&source.input])?;
    let mut grid = file::read_level_set(&session.ctx, &source.input, source.grid.as_deref()).or_refuse()?;
    let (width, times, scheme) =
        (args.width, args.times, source.scheme.unwrap_or(SchemeName::FirstOrder).into());
    let work = || match args.filter {
        Filter::Mean => level_set::mean_filter(&session.ctx, &mut grid, width, times, scheme),
        Filter::Gaussian => level_set::gaussian_filter(&session.ctx, &mut grid, width, times, scheme),
    };
    session.ctx.phase("smooth", work).or_fail()?;
    source.output.write(session, grid).or_fail()
}
