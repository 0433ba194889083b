//! `frazil vdb sweep`.

use super::VdbOutput;
use crate::cli::exit::{Failure, Phase};
use crate::cli::options::{MeshSpace, positive, triple};
use crate::cli::session::Session;
use frazil::base::{DVec3, TriMesh};
use frazil::io::sequence::Pattern;
use frazil::motion::{Key, Keys, MeshSequence, Motion, Rigid};
use frazil::scene::Frames;
use frazil::sweep::{self, Body, SamplesSettings, Settings};
use frazil::vdb::FloatGrid;
use std::path::PathBuf;

/// Make a level set of all the space that a moving mesh passes through
///
/// The motion is a sequence of meshes over some frames; or one mesh that moves and turns; or one mesh that
/// becomes another with the same triangles.
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
    /// How the swept volume is found
    #[arg(long, value_enum, default_value = "chain")]
    method: Method,
    /// Steps between sampled poses (method samples)
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    samples: u32,
    /// Dilation of the sampled poses (cells; method samples)
    #[arg(long, value_name = "CELLS", default_value = "1")]
    dilate: f32,
    /// Smoothing passes after that (method samples)
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
    settings.validate().before()?;
    if !(0.0..=100.0).contains(&args.dilate) {
        return Err(Failure::refused("--dilate must lie in 0 to 100 cells"));
    }
    args.output.check()?;
    let grid = match &args.mesh[..] {
        [from, to] => {
            args.refuse_motion("two meshes")?;
            if args.method == Method::Samples {
                return Err(Failure::refused("--method samples needs a sequence or one mesh, not two"));
            }
            let [first, second] = [from, to].map(|path| args.space.read_polygons(path));
            let (first, second) = (first.before()?, second.before()?);
            if !first.has_faces_of(&second) {
                let (from, to) = (from.display(), to.display());
                return Err(Failure::refused(format!("{to}: has other faces than {from}")));
            }
            let to = TriMesh { triangles: first.triangles(), positions: second.positions };
            let from = first.into_triangles();
            args.check_memory(session, [&from, &to])?;
            sweep::chain_meshes(&session.ctx, &from, &to, &settings).during()?
        }
        _ => args.sweep_one(session, &settings)?,
    };
    args.output.write(session, grid).during()
}

impl Args {
    fn refuse_motion(&self, with: &str) -> Result<(), Failure> {
        let given = [
            ("--frames", self.frames.is_some()),
            ("--move", self.by.is_some()),
            ("--turn-deg", self.turn_deg.is_some()),
        ];
        match given.iter().find(|option| option.1) {
            Some((name, _)) => Err(Failure::refused(format!("{name} is of no use with {with}"))),
            None => Ok(()),
        }
    }

    /// Refuses a sweep between two poses that would need too much memory.
    fn check_memory(&self, session: &Session, [from, to]: [&TriMesh; 2]) -> Result<(), Failure> {
        let path = from.positions.iter().zip(&to.positions).map(|(p, q)| (q - p).norm()).fold(0.0, f32::max);
        let round = from.bounds().map_or(0.0, |(low, high)| 4.0 * (high - low).norm());
        // Of the surface at both ends, and of what its outline sweeps on the way.
        let area = from.area() + to.area() + f64::from(round * path);
        session.check_surface(area, self.cell).before()
    }

    fn sweep_one(&self, session: &Session, settings: &Settings) -> Result<FloatGrid, Failure> {
        let (motion, from, to) = self.motion()?;
        let posed = |time: f64| -> frazil::Result<TriMesh> {
            let mut pose = Vec::new();
            motion.pose(time, &mut pose)?;
            let positions = pose.iter().map(|at| at.cast()).collect();
            Ok(TriMesh { positions, triangles: motion.triangles().to_vec() })
        };
        self.check_memory(session, [&posed(from).before()?, &posed(to).before()?])?;
        let bodies = [Body::new(motion, from).before()?];
        match self.method {
            Method::Chain => sweep::chain(&session.ctx, &bodies, from, to, settings).during(),
            Method::Samples => {
                let settings = SamplesSettings {
                    half_width: settings.half_width,
                    samples: self.samples,
                    dilate: self.dilate,
                    smooth: self.smooth,
                    ..SamplesSettings::new(self.cell)
                };
                sweep::samples(&session.ctx, &bodies, from, to, &settings).during()
            }
        }
    }

    /// The motion with its first and last time; frames and the whole of a move count as seconds here.
    fn motion(&self) -> Result<(Box<dyn Motion>, f64, f64), Failure> {
        let path = &self.mesh[0];
        if let Some(pattern) = Pattern::parse(path) {
            let Some(frames) = self.frames else {
                return Err(Failure::refused(format!("{}: a sequence needs --frames A-B", path.display())));
            };
            if self.by.is_some() || self.turn_deg.is_some() {
                return Err(Failure::refused("--move and --turn-deg are of no use with a sequence"));
            }
            if self.space.scale != 1.0 || self.space.up != crate::cli::options::Axis::Y {
                return Err(Failure::refused("--scale and --up are of no use with a sequence"));
            }
            let motion = MeshSequence::open(pattern, frames.first, frames.last, 1.0, 0.0).before()?;
            return Ok((Box::new(motion), frames.first.into(), frames.last.into()));
        }
        if self.frames.is_some() {
            return Err(Failure::refused("--frames needs a sequence such as body.%04d.obj"));
        }
        if self.by.is_none() && self.turn_deg.is_none() {
            let what = format!("{}: one mesh needs --move or --turn-deg", path.display());
            return Err(Failure::refused(what));
        }
        let mesh = self.space.read(path).before()?;
        let turn = self.turn_deg.unwrap_or_default().map(f64::to_radians);
        let start = Key { time: 0.0, at: DVec3::zeros(), turn: DVec3::zeros() };
        let end = Key { time: 1.0, at: self.by.unwrap_or_default(), turn };
        let keys = Keys::new(vec![start, end]).before()?;
        Ok((Box::new(Rigid::new(mesh, keys)), 0.0, 1.0))
    }
}
