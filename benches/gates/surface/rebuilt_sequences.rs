//! Liquids that merge and split: the caches of a solver and the made sets, and a mesh that follows them and is rebuilt.

use std::path::Path;

use frazil::Context;
use frazil::geometry::TriMesh;
use frazil::geometry::points::Values;
use frazil::io::particles;
use frazil::surface::{Params, Particles, StepReport, Tracker};

use crate::common::character::data;
use crate::common::liquids::{numbered, own_surface};
use crate::common::made_sets::{Set, sets};
use crate::common::spot;

/// Edge of a cell (spacings).
pub const CELL: f64 = 0.5;
/// Initial distance between particles (m), frames and frames a second of the dam break.
const DAM_SPACING: f64 = 0.0332;
const DAM_FRAMES: usize = 31;
const DAM_FPS: f64 = 25.0;
/// Initial distance between particles (m) and frames a second of the made sets.
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
    Some(Sequence {
        name: "spot_drop",
        first: 1,
        spacing: spot::SPACING,
        dt: 1.0 / spot::FPS,
        frames: spot::FRAMES as usize,
        mesh,
        every: false,
        particles: Box::new(at),
    })
}

/// `dambreak` with its particles' own surface at the first frame, if the data is there.
pub fn dambreak(ctx: &Context) -> Option<Sequence> {
    let first = data("particles/dambreak/dambreak.0001.bgeo")?;
    let at = move |frame: usize| cached(&first.with_file_name(format!("dambreak.{:04}.bgeo", frame + 1)));
    Some(Sequence {
        name: "dambreak",
        first: 1,
        spacing: DAM_SPACING,
        dt: 1.0 / DAM_FPS,
        frames: DAM_FRAMES,
        mesh: own_surface(ctx, &at(0).positions, DAM_SPACING),
        every: false,
        particles: Box::new(at),
    })
}

/// The made sets, with their particles' own surface at the first frame: two balls, a dumbbell, a sheet, a bubble.
pub fn made(ctx: &Context) -> Vec<Sequence> {
    let one = |(set, frames): (Set, usize)| {
        let Set { name, positions, motion } = set;
        let at = move |frame: usize| {
            numbered(positions.iter().map(|position| motion(*position, frame as f64) * SPACING).collect())
        };
        let mesh = own_surface(ctx, &at(0).positions, SPACING);
        Sequence {
            name,
            first: 0,
            spacing: SPACING,
            dt: 1.0 / FPS,
            frames,
            mesh,
            every: false,
            particles: Box::new(at),
        }
    };
    sets().into_iter().zip(FRAMES).map(one).collect()
}

/// The two balls of the made sets, which stay where they are when their particles have met: from then on they are one liquid.
pub fn joined(ctx: &Context) -> Sequence {
    let [Set { positions, motion, .. }, ..] = sets();
    let at = move |frame: usize| {
        let passed = frame.min(MET) as f64;
        numbered(positions.iter().map(|position| motion(*position, passed) * SPACING).collect())
    };
    let mesh = own_surface(ctx, &at(0).positions, SPACING);
    Sequence {
        name: "two balls join",
        first: 0,
        spacing: SPACING,
        dt: 1.0 / FPS,
        frames: MET + 10,
        mesh,
        every: false,
        particles: Box::new(at),
    }
}

fn cached(path: &Path) -> Particles {
    let cloud = particles::read(path).expect("particles");
    let ids = match cloud.attribute("id") {
        Some(Values::Long(column)) => (0..cloud.positions.len()).map(|n| column.get(n)).collect(),
        Some(Values::Int(column)) => (0..cloud.positions.len()).map(|n| column.get(n).into()).collect(),
        _ => panic!("the particles have no ids"),
    };
    Particles { ids, positions: cloud.positions, velocities: Vec::new() }
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
