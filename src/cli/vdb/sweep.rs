//! `frazil vdb sweep`.

use super::VdbOutput;
use crate::cli::options::{MeshSpace, Origin, needs_frames, positive, triple};
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::geometry::{DVec3, TriMesh};
use frazil::io::files::sequence::Pattern;
use frazil::motion::{Key, Keys, MeshSequence, Morph, Motion, Placed, Rigid};
use frazil::scene::Frames;
use frazil::sweep::{self, Body, SamplesSettings, Settings};
use frazil::vdb::FloatGrid;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Make a level set of all the space that a moving mesh passes through
///
/// The motion is a sequence of meshes over some frames; or one mesh that moves and turns; or one mesh that
/// becomes another with the same faces.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil vdb sweep body.%04d.obj --frames 1-2 --cell 0.005 -o sweep.vdb
  frazil vdb sweep box.obj --move 0,0,0.4 --turn-deg 0,17,0 --cell 0.005 -o sweep.vdb
  frazil vdb sweep before.obj after.obj --cell 0.005 -o sweep.vdb")]
pub struct Args {
    /// A sequence (body.%04d.obj, body.####.obj, body.$F4.obj), a mesh, or two meshes
    #[arg(required = true, num_args = 1..=2)]
    mesh: Vec<PathBuf>,
    /// Frames of a sequence
    #[arg(long, value_name = "A-B", value_parser = str::parse::<Frames>, allow_hyphen_values = true)]
    frames: Option<Frames>,
    /// How far one mesh moves (m)
    #[arg(long = "move", value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    by: Option<DVec3>,
    /// How far one mesh turns about x, then y, then z through its origin (degrees)
    #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
    turn_deg: Option<DVec3>,
    /// Edge of a voxel (m)
    #[arg(long, value_name = "M", value_parser = positive)]
    cell: f64,
    /// Half width of the band of distances (cells), 3 to 64
    #[arg(long, value_name = "CELLS", default_value = "3", value_parser = positive)]
    half_width: f64,
    /// Method to find the swept volume
    #[arg(long, value_enum, default_value = "chain")]
    method: Method,
    /// Steps between sampled poses (method samples)
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    samples: u32,
    /// Dilation of the sampled poses (cells; method samples)
    #[arg(long, value_name = "CELLS", default_value = "1")]
    dilate: f32,
    /// Smoothing passes after the dilation (method samples)
    #[arg(long, value_name = "N", default_value = "1")]
    smooth: u32,
    #[command(flatten)]
    space: MeshSpace,
    #[command(flatten)]
    output: VdbOutput,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Exact: signed tetrahedra between poses
    Chain,
    /// The union of sampled poses, dilated and smoothed
    Samples,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let settings = Settings { half_width: args.half_width as f32, ..Settings::new(args.cell) };
    settings.validate().or_refuse()?;
    if !(0.0..=100.0).contains(&args.dilate) {
        return Err(Failure::refused("--dilate must lie in 0 to 100 cells"));
    }
    let inputs: Vec<&Path> = args.mesh.iter().map(PathBuf::as_path).collect();
    args.output.check(&inputs)?;
    let grid = args.sweep(session, &settings)?;
    args.output.write(session, grid).or_fail()
}

impl Args {
    /// Refuses a sweep between two poses that would need too much memory.
    fn check_memory(&self, session: &Session, [from, to]: [&TriMesh; 2]) -> Result<(), Failure> {
        let path = from.positions.iter().zip(&to.positions).map(|(p, q)| (q - p).norm()).fold(0.0, f32::max);
        let round = from.bounds().map_or(0.0, |(low, high)| 4.0 * (high - low).norm());
        // The surfaces of both poses, and the area that their outline sweeps in between.
        let area = from.area() + to.area() + f64::from(round * path);
        super::check_surface(session, area, self.cell).or_refuse()
    }

    fn sweep(&self, session: &Session, settings: &Settings) -> Result<FloatGrid, Failure> {
        let (motion, from, to) = self.motion()?;
        let ends = [motion.mesh_at(from).or_refuse()?, motion.mesh_at(to).or_refuse()?];
        if let Some(what) = super::far_mesh(&self.mesh[0], &ends[0], self.cell) {
            log::warn!("{what}");
        }
        self.check_memory(session, [&ends[0], &ends[1]])?;
        let bodies = [Body::new(motion, from).or_refuse()?];
        for what in bodies[0].warning().into_iter().chain(bodies[0].weld_warning()) {
            log::warn!("{}: {what}", self.mesh[0].display());
        }
        match self.method {
            Method::Chain => sweep::chain(&session.ctx, &bodies, from, to, settings).or_fail(),
            Method::Samples => {
                let settings = SamplesSettings {
                    half_width: settings.half_width,
                    samples: self.samples,
                    dilate: self.dilate,
                    smooth: self.smooth,
                    ..SamplesSettings::new(self.cell)
                };
                sweep::samples(&session.ctx, &bodies, from, to, &settings).or_fail()
            }
        }
    }

    /// The motion with its first and last time. A frame of a sequence counts as one second, and a whole move or change lasts one second.
    fn motion(&self) -> Result<(Box<dyn Motion>, f64, f64), Failure> {
        let (motion, from, to) = match &self.mesh[..] {
            [from, to] => {
                self.refuse_motion("two meshes", ["--frames", "--move", "--turn-deg"])?;
                (morph(&self.space.origin, from, to)?, 0.0, 1.0)
            }
            [path, ..] => match Pattern::parse(path) {
                Some(pattern) => {
                    self.refuse_motion("a sequence", ["--move", "--turn-deg"])?;
                    let Frames { first, last } = self.frames.ok_or_else(|| needs_frames(path))?;
                    let (hashes, origin) = (Arc::default(), self.space.origin.at);
                    let sequence =
                        MeshSequence::open_with_hashes(pattern, first, last, 1.0, 0.0, hashes, origin);
                    (Box::new(sequence.or_refuse()?) as Box<dyn Motion>, first.into(), last.into())
                }
                None => {
                    self.refuse_motion("one mesh", ["--frames"])?;
                    if self.by.is_none() && self.turn_deg.is_none() {
                        return Err(Failure::of_file(path, "one mesh needs --move or --turn-deg"));
                    }
                    let mesh = Rigid::of_polygons(self.space.origin.read(path).or_refuse()?, Keys::default());
                    (Box::new(mesh) as Box<dyn Motion>, 0.0, 1.0)
                }
            },
            [] => return Err(Failure::refused("a sweep needs a mesh")),
        };
        Ok((Box::new(Placed::new(motion, self.space.space().without_origin(), self.keys()?)), from, to))
    }

    /// The keys of `--move` and `--turn-deg`.
    fn keys(&self) -> Result<Keys, Failure> {
        if self.by.is_none() && self.turn_deg.is_none() {
            return Ok(Keys::default());
        }
        let turn = self.turn_deg.unwrap_or_default().map(f64::to_radians);
        let start = Key { time: 0.0, at: DVec3::zeros(), turn: DVec3::zeros() };
        let end = Key { time: 1.0, at: self.by.unwrap_or_default(), turn };
        Keys::new(vec![start, end]).or_refuse()
    }

    fn refuse_motion<const N: usize>(&self, with: &str, refused: [&str; N]) -> Result<(), Failure> {
        let given = [
            ("--frames", self.frames.is_some()),
            ("--move", self.by.is_some()),
            ("--turn-deg", self.turn_deg.is_some()),
        ];
        match given.iter().find(|(name, given)| *given && refused.contains(name)) {
            Some((name, _)) => Err(Failure::refused(format!("{name} cannot be used with {with}"))),
            None => Ok(()),
        }
    }
}

/// One mesh that becomes another with the same faces.
fn morph(origin: &Origin, from: &Path, to: &Path) -> Result<Box<dyn Motion>, Failure> {
    let [first, second] = [from, to].map(|path| origin.read(path));
    let (first, second) = (first.or_refuse()?, second.or_refuse()?);
    if !first.has_faces_of(&second) {
        return Err(Failure::of_file(to, format!("has different faces from those of {}", from.display())));
    }
    Ok(Box::new(Morph::new(first.into_triangles(), second.positions).or_refuse()?))
}
