//! `frazil shallow`: a little liquid flows over a terrain.

use std::path::PathBuf;

use frazil::scene::run::{FrameCosts, Report};
use frazil::scene::{Scene, shallow};
use serde_json::{Map, Value, json};

use super::ShotArgs;
use crate::cli::session::{Failure, OrFailure, Session};

/// Let a little liquid flow over a terrain: blood, water, paint, honey.
///
/// Writes liquid/liquid.%04d.usdc (the surface and the liquid in the air, with velocities, depths, layers, opacities and scalars),
/// volume/volume.%04d.vdb if the scene asks for it, report/liquid.%04d.json (ml inside, added and removed, steps, times), shot.usda and
/// scene.toml, the scene with every default filled in. Frames that exist and match are not made again; a folder with frames of other
/// settings is refused.
#[derive(clap::Args)]
#[command(after_help = "\
Stages:
  liquid   the liquid of each frame: its surface, its volume, the stained terrain

Examples:
  frazil shallow spill.toml -o spill/
  frazil shallow spill.toml -o honey/ --set shallow.liquid=honey")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    #[command(flatten)]
    shot: ShotArgs,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let scene = Scene::read_with(&args.scene, &args.shot.set).or_refuse()?;
    scene.shallow().or_refuse()?;
    let frames = args.shot.frames(&scene)?;
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = shallow::Inputs::load(&session.ctx, &scene).or_refuse()?;
    let pipeline = shallow::pipeline(&session.ctx, &scene, &inputs).or_refuse()?;
    let (mut times, mut last) = (Times::default(), None);
    args.shot.make(
        session,
        &pipeline,
        &[],
        &frames,
        |_| Ok(FrameCosts::default()),
        |report| {
            times.add(report);
            last = Some(report.results.clone());
        },
    )?;
    for (name, value) in last.unwrap_or_default().into_iter().filter(|(name, _)| name.ends_with("_ml")) {
        session.record(&name, value);
    }
    let mut ms = Map::new();
    for (name, all) in times.0 {
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let worst = all.into_iter().fold(0.0, f64::max);
        log::info!("{name}: {mean:.3} ms a frame, at most {worst:.3} ms");
        ms.insert(name.into(), json!({ "mean": mean, "worst": worst }));
    }
    session.record("ms", ms.into());
    Ok(())
}

/// The time of each phase in each frame (ms).
#[derive(Default)]
struct Times(Vec<(&'static str, Vec<f64>)>);

impl Times {
    /// Adds a frame; the first one takes no step, and does not count.
    fn add(&mut self, report: &Report) {
        if report.results.get("steps").and_then(Value::as_u64) == Some(0) {
            return;
        }
        for phase in &report.phases {
            let ms = 1e3 * phase.time.as_secs_f64();
            match self.0.iter_mut().find(|(name, _)| *name == phase.name) {
                Some((_, all)) => all.push(ms),
                None => self.0.push((phase.name, vec![ms])),
            }
        }
    }
}
