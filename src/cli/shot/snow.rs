//! `frazil snow`: objects press into a layer of snow, frame by frame.

use std::path::PathBuf;

use frazil::scene::run::ToMake;
use frazil::scene::{Inputs, Scene, check_memory, snow};

use super::ShotArgs;
use crate::cli::session::{Failure, OrFailure, Session};

/// Press moving objects into a layer of snow.
///
/// Writes base/base.%04d.vdb (surface, compression, touched), removed/removed.%04d.vdb, grains/, mist/, fog/, snow/, mesh/ and objects/
/// if the scene asks for it, report/base.%04d.json, shot.usda and scene.toml, the scene with every default filled in. Frames that exist
/// and match are not made again; a folder with frames of other settings is refused.
#[derive(clap::Args)]
#[command(after_help = "\
Stages:
  base     the layer of snow, and what each frame takes away from it
  grains   snow that is pushed and thrown, if the scene has a table [grains]
  mist     powder in the air, if the scene has a table [mist]
  volumes  fog, level sets and meshes to render, if [output] asks for fog, snow or mesh
  objects  the objects as they moved, if [output] asks for objects

Examples:
  frazil snow walker.toml -o cache/
  frazil snow walker.toml -o cache/ --from 40 --set snow.noise.seed=2
  frazil snow walker.toml -o look/ --preview 3 --frames 1-24")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Make only these stages of the scene (base, grains, mist, volumes, objects) [default: all].
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    stage: Vec<String>,
    /// Make the cells N times as large, for a quick preview in a folder of its own.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=100))]
    preview: Option<u16>,
    #[command(flatten)]
    shot: ShotArgs,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let mut scene = Scene::read_with(&args.scene, &args.shot.set).or_refuse()?;
    scene.snow().or_refuse()?;
    if let Some(factor) = args.preview {
        scene.coarsen(factor.into()).or_refuse()?;
    }
    let frames = args.shot.frames(&scene)?;
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = Inputs::load(&scene).or_refuse()?;
    check_memory(&scene, &inputs, session.max_memory()).or_refuse()?;
    let pipeline = snow::pipeline(&scene, &inputs);
    let mut removed = 0.0;
    let costs = |to_make: &[ToMake]| snow::costs(&session.ctx, &scene, &inputs, &args.shot.output, to_make);
    args.shot.make(session, &pipeline, &args.stage, &frames, costs, |report| {
        let volume = report.results.get("removed_m3").and_then(|value| value.as_f64());
        removed += volume.unwrap_or(0.0);
    })?;
    session.record("removed_m3", removed.into());
    Ok(())
}
