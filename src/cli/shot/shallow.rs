//! `frazil shallow`: a little liquid flows over a terrain.

use std::path::PathBuf;

use frazil::scene::run::Report;
use frazil::scene::{Scene, shallow};
use serde_json::{Map, Value, json};

use super::ShotArgs;
use crate::cli::session::{Failure, Phase, Session};

/// Let a little liquid flow over a terrain: blood, water, paint, honey.
///
/// Writes liquid/liquid.%04d.ply (the surface and the liquid in the air, with velocities, depths, layers, opacities and scalars),
/// volume/volume.%04d.vdb if the scene asks for it, report/liquid.%04d.json (ml inside, added and removed, steps, times), shot.usda and
/// scene.toml, the scene with every default filled in. Frames that are there and match are not made again; a folder with frames of other
/// settings is refused.
#[derive(clap::Args)]
#[command(after_help = "\
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
    let scene = Scene::read_with(&args.scene, &args.shot.set).before()?;
    scene.shallow().before()?;
    let frames = args.shot.frames(&scene)?;
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = shallow::Inputs::load(&session.ctx, &scene).before()?;
    let plan = shallow::plan(&session.ctx, &scene, &inputs).before()?;
    let (mut times, mut last) = (Times::default(), None);
    args.shot.make(session, &plan, &[], &frames, |report| {
        times.add(report);
        last = Some(report.results.clone());
    })?;
    for (name, value) in last.unwrap_or_default().into_iter().filter(|(name, _)| name.ends_with("_ml")) {
        session.record(&name, value);
    }
    times.0.iter().for_each(|phase| {
        log::info!("{}: {:.3} ms a frame, at most {:.3} ms", phase.name, phase.mean(), phase.worst);
    });
    session.record("ms", times.into_json());
    Ok(())
}

/// Times of the phases of frames.
#[derive(Default)]
struct Times(Vec<Phases>);

/// A phase, over all frames.
struct Phases {
    name: &'static str,
    /// Milliseconds: total over all frames, and maximum.
    sum: f64,
    worst: f64,
    count: usize,
}

impl Phases {
    fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }
}

impl Times {
    /// Adds a frame; the first one takes no step, and does not count.
    fn add(&mut self, report: &Report) {
        if report.results.get("steps").and_then(Value::as_u64) == Some(0) {
            return;
        }
        for phase in &report.phases {
            let ms = 1e3 * phase.time.as_secs_f64();
            match self.0.iter_mut().find(|known| known.name == phase.name) {
                Some(known) => {
                    known.sum += ms;
                    known.worst = known.worst.max(ms);
                    known.count += 1;
                }
                None => self.0.push(Phases { name: phase.name, sum: ms, worst: ms, count: 1 }),
            }
        }
    }

    /// Mean and maximum of each phase.
    fn into_json(self) -> Value {
        let of =
            |phase: Phases| (phase.name.to_string(), json!({ "mean": phase.mean(), "worst": phase.worst }));
        Value::Object(self.0.into_iter().map(of).collect::<Map<String, Value>>())
    }
}
