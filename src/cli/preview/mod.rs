//! `frazil preview`: pictures of meshes, level sets, points, fog and whole shots; flipbooks.

mod drawing;
mod flipbook;
mod in_order;
#[cfg(feature = "vdb")]
mod shot;
mod sources;

use std::path::PathBuf;

use frazil::base::DVec3;
use frazil::io::mesh::extension;
use frazil::io::sequence::Pattern;
use frazil::motion::is_gltf;
use frazil::render::Size;
use frazil::scene::FrameChoice;

use super::exit::{Failure, Phase};
use super::session::Session;
use super::{options, output};
use drawing::Look;
use flipbook::{Flipbook, Target};
use sources::{Posing, Sources};

/// Draw meshes, level sets, points, fog or frames of a shot: a PNG, or a flipbook.
#[derive(clap::Args)]
#[command(
    group = clap::ArgGroup::new("when").args(["frame", "frames"]),
    after_help = "Examples:\n  frazil preview cache/base/base.0048.vdb boot.obj -o print.png --eye 1,1.5,2 --target 0,0,1\n  \
                  frazil preview cache/ --frame 48 -o look.png\n  \
                  frazil preview cache/ --frames 1-48x8 -o shot.gif --size 640x360\n  \
                  frazil preview cache/ --frames 40-42 -o p.%04d.png --size 640x360\n  \
                  frazil preview hero.glb --clip walk --frame 12 -o pose.png\n  \
                  frazil preview grains.0001.vdb -o grains.png --color v"
)]
pub struct Args {
    /// .vdb (its first level set, else a fog volume, else points), a mesh, a character, points (.ply), or, with --frame or
    /// --frames, a pattern (base.%04d.vdb) or the output folder of `frazil snow`.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The picture (.png); of several frames their pattern (p.%04d.png), or a .gif.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Attribute that gives points their colours, from dark blue to pale yellow over its values.
    #[arg(long, value_name = "NAME")]
    color: Option<String>,
    /// Clip that characters play [default: they are at rest, or play their only clip with --frame].
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// Frame of a shot; clips of characters begin at frame 1.
    #[arg(long, value_name = "N", value_parser = options::finite, allow_hyphen_values = true)]
    frame: Option<f64>,
    /// Frames of a flipbook.
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Frames of the shot a second [default: as its scene says, else 24].
    #[arg(long, value_name = "N", value_parser = options::positive, requires = "when")]
    fps: Option<f64>,
    /// Part of the light that fog of density 1 takes away per metre (1/m, for short ways).
    #[arg(long, value_name = "N", default_value = "5", value_parser = options::positive)]
    fog_density: f64,
    /// Pixels.
    #[arg(long, default_value = "1280x720", value_parser = options::size)]
    size: Size,
    /// Where the camera is (m) [default: so that everything is seen].
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "target")]
    eye: Option<DVec3>,
    /// What it looks at (m).
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "eye")]
    target: Option<DVec3>,
    /// Vertical field of view (degrees).
    #[arg(long, default_value_t = 35.0, requires = "eye")]
    fov: f64,
    /// Azimuth and elevation of the sun (degrees) [default: beside the camera].
    #[arg(long, value_name = "AZ,EL", value_parser = sun, allow_hyphen_values = true)]
    sun: Option<(f64, f64)>,
}

fn sun(text: &str) -> Result<(f64, f64), String> {
    let (azimuth, elevation) = text.split_once(',').ok_or("give azimuth,elevation")?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("\"{text}\" is not a number"));
    let (azimuth, elevation) = (number(azimuth)?, number(elevation)?);
    if !(1.0..=90.0).contains(&elevation) || !azimuth.is_finite() {
        return Err("the elevation must be within 1 to 90 degrees".into());
    }
    Ok((azimuth, elevation))
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let look = args.look()?;
    #[cfg(feature = "vdb")]
    session.ctx.set_memory_limit(session.max_memory());
    let (frames, target) = (args.times(), args.target_of_pictures()?);
    let sources =
        Sources::open(&args.files, Posing { clip: args.clip.clone(), fps: args.fps }).before()?;
    let is_posed = args.clip.is_some() && !args.files.iter().any(|path| is_gltf(path));
    let is_timed = (args.frame.is_some() || args.frames.is_some()) && !sources.moves();
    if is_posed || is_timed {
        let what = "--clip is for .glb and .gltf files, --frame and --frames for those, patterns and folders of shots; none \
                    is given";
        return Err(Failure::refused(what));
    }
    sources.refuse_missing(&frames).before()?;
    args.check_outputs(&target, &frames, &sources)?;
    let fps = sources.fps();
    let count = frames.len();
    Flipbook { look: &look, frames, target, fps }.make(sources, session)?;
    session.record("frames", count.into());
    Ok(())
}

impl Args {
    fn look(&self) -> Result<Look, Failure> {
        if !(1.0..=170.0).contains(&self.fov) {
            return Err(Failure::refused(format!("--fov {} is not within 1 to 170 degrees", self.fov)));
        }
        let camera = self.eye.zip(self.target).map(|(eye, target)| (eye, target, self.fov));
        if camera.is_some_and(|(eye, target, _)| eye == target) {
            return Err(Failure::refused("--eye and --target are the same point"));
        }
        let (size, sun, color) = (self.size, self.sun, self.color.clone());
        Ok(Look { size, camera, sun, color, fog_density: self.fog_density })
    }

    /// The frames, ascending; a still of what does not move has none.
    fn times(&self) -> Vec<Option<f64>> {
        match &self.frames {
            Some(frames) => frames.iter().map(|frame| Some(f64::from(frame))).collect(),
            None => vec![self.frame],
        }
    }

    /// Where the pictures go, by the name of the output.
    fn target_of_pictures(&self) -> Result<Target, Failure> {
        let path = self.output.clone();
        let pattern = self.frames.as_ref().and_then(|_| Pattern::parse(&path));
        let refused = |what: &str| Err(Failure::refused(format!("{}: {what}", path.display())));
        match (extension(&path) == "gif", pattern) {
            (true, Some(_)) => refused("a .gif holds all frames, and has one name"),
            (true, None) => Ok(Target::Gif(path)),
            (false, Some(pattern)) => Ok(Target::Pictures(pattern)),
            (false, None) if self.frames.as_ref().is_some_and(|frames| frames.count() > 1) => {
                refused("several frames need a pattern such as p.%04d.png, or a .gif")
            }
            (false, None) => Ok(Target::Picture(path)),
        }
    }

    /// Refuses outputs that cannot be written, or that are read.
    fn check_outputs(
        &self,
        target: &Target,
        frames: &[Option<f64>],
        sources: &Sources,
    ) -> Result<(), Failure> {
        output::check_writable(&self.output).before()?;
        for frame in frames {
            let path = match (target, frame) {
                (Target::Pictures(pattern), Some(frame)) => pattern.path(*frame as i32),
                _ => self.output.clone(),
            };
            let inputs = sources.files(*frame);
            output::refuse_input(&path, inputs.iter().map(PathBuf::as_path)).before()?;
        }
        Ok(())
    }
}
