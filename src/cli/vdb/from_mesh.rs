//! `frazil vdb from-mesh`.

use super::VdbOutput;
use crate::cli::options::{MeshSpace, positive, warn_of_corners};
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::motion::{Keys, Rigid};
use frazil::sweep::{self, Body, Settings};
use std::path::PathBuf;

/// Make a level set of the solid that a mesh bounds; open meshes are closed
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil vdb from-mesh boot.obj --cell 0.002 -o boot.vdb")]
pub struct Args {
    /// Mesh (.obj, .ply, .stl)
    mesh: PathBuf,
    /// Edge of a voxel (m)
    #[arg(long, value_name = "M", value_parser = positive)]
    cell: f64,
    /// Half width of the band of distances (cells), 3 to 64
    #[arg(long, value_name = "CELLS", default_value = "3", value_parser = positive)]
    half_width: f64,
    #[command(flatten)]
    space: MeshSpace,
    #[command(flatten)]
    output: VdbOutput,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let settings = Settings { half_width: args.half_width as f32, ..Settings::new(args.cell) };
    settings.validate().or_refuse()?;
    args.output.check(&[&args.mesh])?;
    let mesh = args.space.read(&args.mesh).or_refuse()?;
    if let Some(what) = super::far_mesh(&args.mesh, &mesh, args.cell) {
        log::warn!("{what}");
    }
    warn_of_corners(&args.mesh, &mesh);
    super::check_surface(session, mesh.area(), args.cell).or_refuse()?;
    let body = Body::new(Box::new(Rigid::new(mesh, Keys::default())), 0.0).or_refuse()?;
    if let Some(what) = body.warning() {
        log::warn!("{}: {what}", args.mesh.display());
    }
    let grid = sweep::chain(&session.ctx, &[body], 0.0, 0.0, &settings).or_fail()?;
    args.output.write(session, grid).or_fail()
}
