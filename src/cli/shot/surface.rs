//! `frazil surface`: a detailed mesh follows the particles of a liquid.

use std::path::{Path, PathBuf};

use frazil::io::files::sequence::Pattern;
use frazil::scene::run::ToMake;
use frazil::scene::{Frames, Scene, surface};

use super::ShotArgs;
use crate::cli::options::positive;
use crate::cli::session::{Failure, OrFailure, Session};

/// Carry a detailed mesh along with the particles of a liquid, frame by frame, keeping its detail.
///
/// Writes surface/surface.%04d.usdc (with velocities over the coming frame, the distance that each vertex keeps, and flags where
/// the liquid merged or split), report/surface.%04d.json, shot.usda and scene.toml, the scene with every default
/// filled in. Frames that exist and match are not made again; a folder with frames of other settings is refused.
#[derive(clap::Args)]
#[command(after_help = "\
Stages:
  surface  the mesh of each frame

Examples:
  frazil surface spot.toml -o out/
  frazil surface -p spot.%04d.bgeo -m spot.ply -o spot/ --fps 25")]
pub struct Args {
    /// Scene file (TOML); or use -p and the options below.
    #[arg(required_unless_present = "particles", conflicts_with = "particles")]
    scene: Option<PathBuf>,
    /// Particles: a sequence, of which all existing frames are used.
    #[arg(short, long, value_name = "PATTERN")]
    particles: Option<PathBuf>,
    /// Mesh at the first frame, in the particles' space [default: the particles' own surface]
    #[arg(short, long, value_name = "FILE", requires = "particles")]
    mesh: Option<PathBuf>,
    /// Initial distance between particles (m) [default: estimated and logged]
    #[arg(long, value_name = "M", value_parser = positive, requires = "particles")]
    spacing: Option<f64>,
    /// Frames per second, of the particles and of the shot [default: 24]
    #[arg(long, value_name = "N", value_parser = positive, requires = "particles")]
    fps: Option<f64>,
    #[command(flatten)]
    shot: ShotArgs,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let scene = args.scene().or_refuse()?;
    let frames = args.shot.frames(&scene)?;
    session.ctx.set_memory_limit(session.max_memory());
    let inputs = surface::Inputs::load(&session.ctx, &scene).or_refuse()?;
    let pipeline = surface::pipeline(&scene, &inputs).or_refuse()?;
    let mut flagged = 0;
    let costs = |to_make: &[ToMake]| Ok(surface::costs(&scene, scene.surface()?, &inputs, to_make));
    args.shot.make(session, &pipeline, &[], &frames, costs, |report| {
        let count = report.results.get("flagged").and_then(|value| value.as_u64());
        flagged = flagged.max(count.unwrap_or(0));
    })?;
    session.record("spacing_m", inputs.spacing.into());
    session.record("most_flagged", flagged.into());
    Ok(())
}

impl Args {
    fn scene(&self) -> frazil::Result<Scene> {
        let Some(particles) = &self.particles else {
            let path = self.scene.as_deref().unwrap_or(Path::new(""));
            return Scene::read_with(path, &self.shot.set);
        };
        let frames = existing_frames(particles)?;
        let quoted = |path: &Path| toml::Value::String(path.to_string_lossy().into_owned()).to_string();
        let mut text = format!("[shot]\nframes = \"{frames}\"\n");
        text += &self.fps.map_or(String::new(), |fps| format!("fps = {fps:?}\n"));
        text += &format!("[surface]\nparticles = {}\n", quoted(particles));
        text += &self.mesh.as_deref().map_or(String::new(), |mesh| format!("mesh = {}\n", quoted(mesh)));
        text += &self.spacing.map_or(String::new(), |spacing| format!("spacing = {spacing:?}\n"));
        Scene::parse(&text, Path::new("command line"), &self.shot.set)
    }
}

/// The existing frames of a sequence, from the first to the last.
fn existing_frames(particles: &Path) -> frazil::Result<Frames> {
    let Some(pattern) = Pattern::parse(particles) else {
        frazil::io::files::source::open(particles)?;
        return Ok(Frames { first: 1, last: 1 });
    };
    let frames = pattern.frames()?;
    match frames[..] {
        [first, .., last] | [first @ last] => Ok(Frames { first, last }),
        [] => Err(frazil::Error::file(particles, "no frame of this sequence exists")),
    }
}
