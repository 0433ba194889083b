//! Liquids that merge and split: the caches of a solver and the made sets, and a mesh that follows them and is rebuilt.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Params, Particles, StepReport, Tracker};

use crate::common::character::data;
use crate::common::liquids::{numbered, own_surface};
use crate::common::made_sets::{Set, sets};
use crate::common::spot;

/// Edge of a cell (spacings).
pub const CELL: f64 = 0.5;
/// Initial distance between particles (m), frames and frames per second of the dam break.
const DAM_SPACING: f64 = 0.0332;
const DAM_FRAMES: usize = 31;
const DAM_FPS: f64 = 25.0;
/// Initial distance between particles (m) and frames per second of the made sets.
const SPACING: f64 = 0.01;
const FPS: f64 = 24.0;
/// Frames of each made set. The balls pass through each other from frame 47 on, and the bubble's particles pile up in its middle from
/// frame 47 on too: these are no liquids any more. The dumbbell and the sheet are apart for good from frames 53 and 57 on.
const FRAMES: [usize; 4] = [46, 64, 64, 45];

/// The frame at which the balls' outermost particles are a spacing apart.
const MET: usize = 10;

/// A liquid whose frames are known, and the mesh that it begins with.
pub struct Sequence {
    pub name: &'static str,
    /// The number of its first frame.
    first: usize,
    /// Initial distance between particles (m).
    pub spacing: f64,
    /// Time between frames (s).
    pub dt: f64,
    /// Count of frames.
    pub frames: usize,
    /// Closed, and 2-manifold by index.
    pub mesh: TriMesh,
    /// Whether the topology is matched all over the mesh in every step.
    pub every: bool,
    particles: Box<dyn Fn(usize) -> Particles>,
}

impl Sequence {
    /// One with 24 frames per second, from frame 0 on.
    fn new(
        name: &'static str,
        spacing: f64,
        frames: usize,
        mesh: TriMesh,
        particles: impl Fn(usize) -> Particles + 'static,
    ) -> Self {
        let particles = Box::new(particles);
        Self { name, first: 0, spacing, dt: 1.0 / FPS, frames, mesh, every: false, particles }
    }

    /// A liquid of one frame, at rest.
    pub fn at_rest(name: &'static str, spacing: f64, mesh: TriMesh, positions: Vec<DVec3>) -> Self {
        Self::new(name, spacing, 1, mesh, move |_| numbered(positions.clone()))
    }

    /// A made set for so many frames, with its particles' own surface at the first one; it stays as it is at frame `last`.
    fn of(ctx: &Context, set: Set, frames: usize, last: usize) -> Self {
        let Set { name, positions, motion } = set;
        let at = move |frame: usize| {
            let passed = frame.min(last) as f64;
            numbered(positions.iter().map(|position| motion(*position, passed) * SPACING).collect())
        };
        Self::new(name, SPACING, frames, own_surface(ctx, &at(0).positions, SPACING), at)
    }

    /// The particles of a frame, counted from 0.
    pub fn at(&self, frame: usize) -> Particles {
        (self.particles)(frame)
    }

    /// What a frame, counted from 0, is called.
    pub fn title(&self, frame: usize) -> String {
        format!("{}, frame {}", self.name, self.first + frame)
    }

    pub fn params(&self) -> Params {
        Params { rebuild: true, every: self.every, ..Params::for_spacing(self.spacing) }
    }

    /// Edge of a cell (m).
    pub fn cell(&self) -> f64 {
        CELL * self.spacing
    }
}

/// `spot_drop` with its sculpted mesh, if the data is there.
pub fn spot_drop() -> Option<Sequence> {
    let first = spot::first()?;
    let mesh = spot::sculpted(&first);
    let at = move |frame: usize| spot::particles_at(&first, frame as i32 + 1);
    let sequence = Sequence::new("spot_drop", spot::SPACING, spot::FRAMES as usize, mesh, at);
    Some(Sequence { first: 1, dt: 1.0 / spot::FPS, ..sequence })
}

/// `dambreak` with its particles' own surface at the first frame, if the data is there.
pub fn dambreak(ctx: &Context) -> Option<Sequence> {
    let first = data("particles/dambreak/dambreak.0001.bgeo")?;
    let at = move |frame: usize| spot::read(&first.with_file_name(format!("dambreak.{:04}.bgeo", frame + 1)));
    let mesh = own_surface(ctx, &at(0).positions, DAM_SPACING);
    let sequence = Sequence::new("dambreak", DAM_SPACING, DAM_FRAMES, mesh, at);
    Some(Sequence { first: 1, dt: 1.0 / DAM_FPS, ..sequence })
}

/// The made sets: two balls, a dumbbell, a sheet, a bubble.
pub fn made(ctx: &Context) -> Vec<Sequence> {
    let one = |(set, frames)| Sequence::of(ctx, set, frames, usize::MAX);
    sets().into_iter().zip(FRAMES).map(one).collect()
}

/// The two balls of the made sets, which stay where they are when their particles have met: from then on they are one liquid.
pub fn joined(ctx: &Context) -> Sequence {
    let [balls, ..] = sets();
    Sequence::of(ctx, Set { name: "two balls join", ..balls }, MET + 10, MET)
}

/// A frame of a mesh that follows a liquid.
pub struct Frame<'a> {
    /// Counted from 0.
    pub index: usize,
    pub particles: &'a Particles,
    /// After the step to this frame.
    pub tracker: &'a Tracker,
    pub report: &'a StepReport,
    /// The triangles before that step.
    pub before: &'a [[u32; 3]],
}

/// Lets a mesh follow a sequence to its end, and shows every frame but the first. What ended it early, if anything did.
pub fn walk(ctx: &Context, sequence: &Sequence, mut see: impl FnMut(&Frame<'_>)) -> Option<String> {
    let mut from = sequence.at(0);
    let mut tracker = Tracker::new(ctx, sequence.params(), &sequence.mesh, &from).expect("a tracker");
    for index in 1..sequence.frames {
        let to = sequence.at(index);
        let before = tracker.triangles().to_vec();
        let report = match tracker.step(ctx, &from, &to, sequence.dt) {
            Ok(report) => report,
            Err(error) => return Some(format!("{}: {error}", sequence.title(index))),
        };
        see(&Frame { index, particles: &to, tracker: &tracker, report: &report, before: &before });
        from = to;
    }
    None
}
