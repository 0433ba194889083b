//! `frazil preview`: pictures of meshes, level sets, points, fog and whole shots; cuts through grids; flipbooks.

mod camera_options;
pub(in crate::cli) mod drawing;
mod flipbook;
mod format;
#[cfg(feature = "vdb")]
mod grids;
mod in_order;
mod parts;
mod shallow_folder;
#[cfg(feature = "vdb")]
mod shot_folder;
pub(in crate::cli) mod sources;
mod tint;

use std::path::{Path, PathBuf};

use super::session::{Failure, OrFailure, Session};
use super::{options, output};
pub(in crate::cli) use camera_options::CameraOptions;
use drawing::Look;
use flipbook::Flipbook;
use format::PictureFormat;
use frazil::io::files::atomic;
use frazil::io::files::sequence::Pattern;
use frazil::io::mesh::extension;
use frazil::render::Plane;
use frazil::scene::FrameChoice;
use sources::Sources;
use tint::Tint;

/// Default extinction (1/m) of a fog of density 1.
pub(in crate::cli) const FOG_DENSITY: f64 = 5.0;

/// Draw meshes, level sets, points, fog or frames of a shot: a PNG, an EXR for compositing, or a flipbook.
#[derive(clap::Args)]
#[command(
    group = clap::ArgGroup::new("when").args(["frame", "frames"]),
    after_help = "Examples:\n  frazil preview cache/base/base.0048.vdb boot.obj -o print.png --eye 1,1.5,2 --target 0,0,1\n  \
                  frazil preview cache/ --frame 48 -o look.png\n  \
                  frazil preview cache/ --frame 48 -o look.exr\n  \
                  frazil preview cache/ --frames 1-48x8 -o shot.gif --size 640x360\n  \
                  frazil preview cache/ --frames 40-42 -o p.%04d.png --size 640x360\n  \
                  frazil preview cache/base/base.0048.vdb --cut x=0 -o cut.png\n  \
                  frazil preview hero.glb --clip walk --frame 12 -o pose.png\n  \
                  frazil preview grains.0001.vdb -o grains.png --color v"
)]
pub struct Args {
    /// .vdb (its first level set, else its fog, else its points), a mesh, a character, points (.ply), the output folder of
    /// `frazil snow`, `surface` or `shallow`, or, with --frame or --frames, a pattern (base.%04d.vdb).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The picture (.png, or .exr: R, G, B in linear light multiplied by A, without the sky; A, opacity; Z, depth in m along the view
    /// direction, infinity where nothing is); for several frames a pattern (p.%04d.png, p.%04d.exr), or a .gif.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Attribute that colours points and vertices of a mesh, from dark blue to pale yellow over its values.
    #[arg(long, value_name = "NAME")]
    color: Option<String>,
    /// Scalar that tints a liquid, from clear water at 0 to blood, paint, honey, milk or coffee at 1.
    #[arg(long, value_name = "NAME=LIQUID", conflicts_with = "color")]
    tint: Option<Tint>,
    /// Draw only a plane across an axis at a position (m), seen from the axis' end. The first grid has colours from dark blue to pale
    /// yellow: for a level set from the inner end of its narrow band to the outer, for any other from the minimum to the maximum of
    /// its values and 0 (-v prints both). Level sets are drawn as white lines, meshes as black ones; points are left out.
    #[arg(long, value_name = "AXIS=M", value_parser = plane, conflicts_with_all = ["color", "tint", "sun", "fog_density"])]
    cut: Option<Plane>,
    /// Clip that characters play [default: they are at rest, or play their only clip with --frame].
    #[arg(long, value_name = "NAME")]
    clip: Option<String>,
    /// Frame of a shot [default: its last one]; clips of characters start at frame 1.
    #[arg(long, value_name = "N", value_parser = options::finite, allow_hyphen_values = true)]
    frame: Option<f64>,
    /// Frames of a flipbook [default: all of a shot, if the output is a pattern or a .gif].
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Frames per second [default: as in the shot's scene, else 24].
    #[arg(long, value_name = "N", value_parser = options::positive)]
    fps: Option<f64>,
    /// Extinction of a fog of density 1 (1/m), if its file does not give it (frazil:density_scale).
    #[arg(long, value_name = "N", default_value_t = FOG_DENSITY, value_parser = options::positive)]
    fog_density: f64,
    #[command(flatten)]
    camera: CameraOptions,
}

fn plane(text: &str) -> Result<Plane, String> {
    let wrong = || "write an axis and a position on it (m), such as x=0.1".to_string();
    let (name, at) = text.split_once('=').ok_or_else(wrong)?;
    let axis = ["x", "y", "z"].iter().position(|axis| *axis == name.trim()).ok_or_else(wrong)?;
    let at = options::finite(at.trim()).map_err(|_| wrong())?;
    Ok(Plane { axis, at })
}

/// The kind of output.
enum Job {
    /// A picture, of one frame if anything moves.
    Still(Option<f64>, PathBuf, PictureFormat),
    /// A picture of each frame.
    Pictures(Vec<i32>, Pattern, PictureFormat),
    /// A GIF of all frames.
    Gif(Vec<i32>, PathBuf),
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let look = args.look()?;
    #[cfg(feature = "vdb")]
    session.ctx.set_memory_limit(session.max_memory());
    let sources = Sources::open(&args.files, args.clip.clone(), args.fps).or_refuse()?;
    args.refuse_idle_options(&sources)?;
    let job = args.job(&sources)?;
    job.check(&sources).or_refuse()?;
    match job {
        Job::Still(frame, path, format) => still(session, &look, sources, frame, (&path, format)),
        Job::Pictures(frames, pattern, format) => {
            Flipbook::open(session, &look, sources, frames)?.pictures(&pattern, format)
        }
        Job::Gif(frames, path) => {
            let fps = sources.fps().or_refuse()?;
            Flipbook::open(session, &look, sources, frames)?.gif(&path, fps)
        }
    }
}

/// Draws one picture.
fn still(
    session: &Session,
    look: &Look,
    mut sources: Sources,
    frame: Option<f64>,
    (path, format): (&Path, PictureFormat),
) -> Result<(), Failure> {
    let parts = sources.read(&session.ctx, frame).or_refuse()?;
    let drawing = look.build(&session.ctx, parts).or_refuse()?;
    let view = look.view(std::slice::from_ref(&drawing), look.wanted_focus(&mut sources))?;
    let bytes = view.encoded(&session.ctx, &drawing, format);
    bytes.and_then(|bytes| atomic::write_bytes(path, &bytes)).or_fail()
}

impl Args {
    fn look(&self) -> Result<Look, Failure> {
        let camera = self.camera.camera()?;
        let holds_eye = |plane: &Plane| self.camera.eye.is_some_and(|eye| eye[plane.axis] == plane.at);
        if let Some(plane) = self.cut.filter(holds_eye) {
            return Err(Failure::refused(format!("--eye lies in the plane of --cut {plane}")));
        }
        Ok(Look {
            size: self.camera.size,
            camera,
            light: self.camera.light(),
            color: self.color.clone(),
            tint: self.tint.clone(),
            cut: self.cut,
            fog_density: self.fog_density,
        })
    }

    /// Refuses options that have no effect on these inputs.
    fn refuse_idle_options(&self, sources: &Sources) -> Result<(), Failure> {
        if self.clip.is_some() && !sources.has_characters() {
            return Err(Failure::refused("--clip is for .glb and .gltf files, and none is given"));
        }
        let is_timed = self.frame.is_some() || self.frames.is_some() || self.fps.is_some();
        if is_timed && !sources.moves() {
            let what = "--frame, --frames and --fps are for .glb and .gltf files, patterns and folders of shots, and none is given";
            return Err(Failure::refused(what));
        }
        Ok(())
    }

    /// The kind of output, from its name and the frames.
    fn job(&self, sources: &Sources) -> Result<Job, Failure> {
        let path = self.output.clone();
        let refused = |what: &str| Err(Failure::refused(format!("{}: {what}", path.display())));
        let (is_gif, format) = match (extension(&path) == "gif", PictureFormat::of(&path)) {
            (true, _) => (true, PictureFormat::Png),
            (false, Some(format)) => (false, format),
            // Any other file under that name, especially a shot's, is not a picture.
            (false, None) => {
                return refused(
                    "a picture is a .png or .exr file, a flipbook a .gif file or a pattern (p.%04d.png)",
                );
            }
        };
        if format == PictureFormat::Exr && self.cut.is_some() {
            return refused("--cut draws the colours of numbers, which are not light: choose a .png file");
        }
        if self.fps.is_some() && !is_gif && !sources.has_characters() {
            return refused("--fps is for .gif files and for characters");
        }
        let pattern = Pattern::parse(&path);
        let frames: Option<Vec<i32>> = match (&self.frames, self.frame) {
            (Some(frames), _) => Some(frames.iter().collect()),
            (None, Some(_)) => None,
            (None, None) => sources.frames(),
        };
        if frames.as_ref().is_some_and(Vec::is_empty) {
            return Err(Failure::refused("the shots have no frame in common"));
        }
        match (pattern, frames) {
            (Some(_), _) if is_gif => refused("a .gif holds all frames, and has one name"),
            (Some(pattern), Some(frames)) => Ok(Job::Pictures(frames, pattern, format)),
            (Some(_), None) => refused("a pattern is for several frames: choose them with --frames"),
            (None, Some(frames)) if is_gif => Ok(Job::Gif(frames, path)),
            (None, None) if is_gif => {
                refused("a .gif is for several frames of something that moves: choose them with --frames")
            }
            (None, Some(frames)) if self.frames.is_some() && frames.len() > 1 => {
                refused("several frames need a pattern such as p.%04d.png, or a .gif")
            }
            (None, frames) => {
                let last = frames.and_then(|frames| frames.last().copied()).map(f64::from);
                Ok(Job::Still(self.frame.or(last), path, format))
            }
        }
    }
}

impl Job {
    /// Refuses frames that a shot lacks, frames of which a sequence has none, and an output that cannot be written.
    fn check(&self, sources: &Sources) -> frazil::Result<()> {
        let (first, frames) = match self {
            Self::Still(frame, path, _) => (path.clone(), vec![*frame]),
            Self::Pictures(frames, pattern, _) => (pattern.path(frames[0]), as_options(frames)),
            Self::Gif(frames, path) => (path.clone(), as_options(frames)),
        };
        output::check_writable(&first)?;
        frames.iter().try_for_each(|frame| sources.refuse_missing_in_shots(*frame))?;
        let missing = frames.into_iter().map(|frame| sources.refuse_missing(frame));
        missing.reduce(|first, next| if next.is_ok() { next } else { first }).unwrap_or(Ok(()))
    }
}

fn as_options(frames: &[i32]) -> Vec<Option<f64>> {
    frames.iter().map(|frame| Some(f64::from(*frame))).collect()
}
