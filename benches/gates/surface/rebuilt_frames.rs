//! Gates of the time of whole frames in scenes like those of the thesis' Table 2.2, and of matching on its finest grid.
//!
//! Each has about as many particles and triangles as the thesis' scene, and something of the same kind happens to it. Every particle's
//! way is known, and simple enough that no cache is needed. These, and the gates of `rebuilt_large.rs`, are steps alone: nothing is eased,
//! no arrays are carried, and no files are read or written.

use std::f64::consts::TAU;
use std::time::Instant;

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Params, Particles, StepReport, Tracker};

use crate::common::liquids::{context, filled, numbered, surface_on};
use crate::harness::{Harness, median};
use crate::surface::known_motion::time;
use crate::surface::rebuilt_sequences::CELL;

/// A gate, its scene, and the seconds that a frame of it takes in the thesis.
type Example = (&'static str, fn(&Context) -> Scene, f64);

const EXAMPLES: [Example; 4] = [
    ("surface.frame_bunny", bunny, 6.92),
    ("surface.frame_gazelle", gazelle, 21.03),
    ("surface.frame_gears", gears, 24.77),
    ("surface.frame_armadillo", armadillo, 21.2),
];
const FRAME: f64 = 1.0 / 24.0;
/// Initial distance between particles (m).
pub const SPACING: f64 = 0.01;
/// How far particles lie beside a lattice at most (spacings).
const JITTER: f64 = 0.1;
/// How high a mesh' own detail is, and how long divided by 2 pi (spacings).
pub const DETAIL: f64 = 0.25;
const LONG: f64 = 1.5;
/// Edge of a cell of the thesis' Table 2.1 (spacings), and the frames that are looked at on it.
const FINE: f64 = 0.25;
const FINE_FRAMES: usize = 9;

/// Frames in which the bunny melts; by how much its base becomes thinner in a frame (natural logarithm).
const MELTING: usize = 14;
const MELT: f64 = 0.12;

/// Frames in which a row is torn. How far the halves of a joint have come apart at the first one, and come apart in each (spacings).
const TEARING: usize = 14;
const APART: f64 = 4.5;
const AWAY: f64 = 0.5;
/// Between lobes of a row (spacings).
const GAP: f64 = 5.0;
/// A strand is as thin as it is long within so much of a joint's middle, and as thick as ever from so far on (spacings).
const THIN: [f64; 2] = [0.8, 2.2];
/// Half of what is drawn out of a joint's shortest strand, and of its longest (spacings): the shortest tears first.
const HALVES: [f64; 2] = [1.5, 2.2];

/// Frames in which splashes fly. Their count and radius, and that of the body (spacings); how far they fly in a frame (spacings), and
/// which share of its height all of it loses.
const FLYING: usize = 12;
const SPLASHES: usize = 24;
const SPLASH: f64 = 2.5;
const BODY: f64 = 20.1;
const FLIGHT: f64 = 0.25;
const LOWER: f64 = 0.01;
/// Gaps between splashes and the body at the first frame, of those that fly in and of those that fly away: least and greatest (spacings).
/// Where it is over about 2 they are apart.
const GAPS: [[f64; 2]; 2] = [[2.8, 4.4], [0.4, 1.6]];
/// The angle between positions that lie evenly on a sphere from pole to pole (rad).
const GOLDEN: f64 = 2.399_963_229_728_653;

/// Particles at a frame, counted from 0.
type Motion = Box<dyn Fn(usize) -> Particles>;

/// A liquid whose frames are known, and the mesh that it begins with.
pub struct Scene {
    /// Closed, and 2-manifold by index.
    pub mesh: TriMesh,
    pub motion: Motion,
    /// Steps that are made.
    pub steps: usize,
    /// Whether steps count in which the topology was matched, not all in which the mesh was changed.
    pub is_matched: bool,
}

/// What a step took in which the mesh was changed (s).
pub struct Step {
    whole: f64,
    flag: f64,
    matching: f64,
    rebuild: f64,
    improve: f64,
    /// Cells in which the mesh did not fit.
    flagged: usize,
}

pub fn run(h: &mut Harness) {
    for (name, scene, thesis) in EXAMPLES {
        if h.wants(name) {
            let ctx = context(1);
            let scene = scene(&ctx);
            let (seconds, note) = scene.told(&scene.follow(&ctx, params()));
            h.gate(name, seconds, &format!("{note} thesis={thesis} s"));
        }
    }
    h.measure("surface.match_fine", fine);
}

/// A mesh with the spacing of the scenes that is rebuilt.
pub fn params() -> Params {
    Params { rebuild: true, ..Params::for_spacing(SPACING) }
}

/// Matching alone, of the thesis' gazelle on cells of r / 4 (Table 2.1): what is flagged, and the signs of the whole grid, are counted
/// too.
fn fine() -> (f64, String) {
    let ctx = context(1);
    let scene = Scene { steps: FINE_FRAMES, ..gazelle(&ctx) };
    let steps = scene.follow(&ctx, Params { cell: FINE, ..params() });
    let seconds = middle(&scene.counted(&steps), |step| step.flag + step.matching);
    let (whole, note) = scene.told(&steps);
    let note =
        format!("flag and match; cells of {FINE} r, whole frames {whole:.2} s; {note} thesis=155.79 s");
    (seconds, note)
}

/// The median of what some steps took; NaN without any.
fn middle(steps: &[&Step], of: fn(&Step) -> f64) -> f64 {
    if steps.is_empty() { f64::NAN } else { median(steps.iter().copied().map(of).collect()) }
}

impl Step {
    fn of(report: &StepReport, whole: f64) -> Option<Self> {
        let change = report.change.as_ref()?;
        let [flag, matching, rebuild, improve] =
            ["flag", "match", "rebuild", "improve"].map(|phase| time(report, phase));
        Some(Self { whole, flag, matching, rebuild, improve, flagged: change.flagged_cells })
    }
}

impl Scene {
    /// Lets the mesh follow the liquid. Steps that do not change it are left out.
    pub fn follow(&self, ctx: &Context, params: Params) -> Vec<Step> {
        let mut from = (self.motion)(0);
        let mut tracker = Tracker::new(ctx, params, &self.mesh, &from).expect("a tracker");
        let mut steps = Vec::new();
        for frame in 1..=self.steps {
            let to = (self.motion)(frame);
            let start = Instant::now();
            let report = tracker.step(ctx, &from, &to, FRAME).expect("a step");
            steps.extend(Step::of(&report, start.elapsed().as_secs_f64()));
            from = to;
        }
        steps
    }

    /// The steps that count.
    fn counted<'a>(&self, steps: &'a [Step]) -> Vec<&'a Step> {
        steps.iter().filter(|step| step.flagged > 0 || !self.is_matched).collect()
    }

    /// Seconds of a step, the median of those that count, and what there is to say of them.
    pub fn told(&self, steps: &[Step]) -> (f64, String) {
        let counted = self.counted(steps);
        let note = format!(
            "{} of {} steps changed the mesh, in {} its topology was matched; the median of {}: {:.0} cells flagged, \
             flag {:.3} s, match {:.3} s, rebuild {:.3} s, improve {:.3} s; {} particles, {} triangles; threads=1 cpu={:?}",
            steps.len(),
            self.steps,
            steps.iter().filter(|step| step.flagged > 0).count(),
            counted.len(),
            middle(&counted, |step| step.flagged as f64),
            middle(&counted, |step| step.flag),
            middle(&counted, |step| step.matching),
            middle(&counted, |step| step.rebuild),
            middle(&counted, |step| step.improve),
            (self.motion)(0).positions.len(),
            self.mesh.triangles.len(),
            frazil::numeric::cpu::cpu_level()
        );
        (middle(&counted, |step| step.whole), note)
    }
}

/// The surface of particles at positions (m) as a mesh of about so many triangles, with detail of its own.
fn detailed(ctx: &Context, positions: &[DVec3], triangles: usize) -> TriMesh {
    let on = |cell: f64| surface_on(ctx, positions, SPACING, cell);
    // A surface has so many triangles as its area has faces of cells, nearly.
    let share = (on(CELL).triangles.len() as f64 / triangles as f64).sqrt();
    let mut mesh = on((CELL * share).clamp(0.15, 1.0));
    let normals = mesh.normals();
    for (position, normal) in mesh.positions.iter_mut().zip(normals) {
        let at: DVec3 = position.cast::<f64>() / (LONG * SPACING);
        let wave = libm::sin(at.x) * libm::sin(at.y) * libm::sin(at.z);
        *position += normal * (DETAIL * SPACING * wave) as f32;
    }
    mesh
}

/// The melting bunny (Fig. 2.11): a viscous solid that melts from its base, which spreads. Its topology never changes: the thesis
/// matched it in none of its frames, and what changes here are triangles that are stretched or pressed.
fn bunny(ctx: &Context) -> Scene {
    // A ball without its lowest quarter. Layers become thinner as they lie deeper, and as much wider as keeps their volume.
    let (radius, base) = (19.92, -9.96);
    let high = radius - base;
    let positions = filled(1.0, JITTER, radius, |position| position.norm() <= radius && position.y >= base);
    let motion = move |frame: usize| {
        let melt = MELT * (frame + 1) as f64;
        let one = |position: &DVec3| {
            let deep = (radius - position.y) / high;
            let wide = libm::exp(0.5 * melt * deep);
            let y = base + high / melt * (libm::exp(-melt * deep) - libm::exp(-melt));
            DVec3::new(position.x * wide, y, position.z * wide) * SPACING
        };
        numbered(positions.iter().map(one).collect())
    };
    let mesh = detailed(ctx, &motion(0).positions, 66_862);
    Scene { mesh, motion: Box::new(motion), steps: MELTING, is_matched: false }
}

/// The splitting gazelle (Fig. 2.13): an object that is torn apart. The thesis matched it in 83 % of its frames. Here two lobes part,
/// and the strands between them tear one after the other, in several positions each.
fn gazelle(ctx: &Context) -> Scene {
    let row = Row { lobes: 2, radius: 13.55, strands: 5, thick: 2.5, around: 6.5 };
    torn(ctx, row, 0.0, 242_932)
}

/// The gears (Fig. 2.10e): rigid gears tear a viscous object apart; few particles, spread over a large volume. The thesis matched it in
/// 83 % of its frames. Here four lobes in a row part, and each turns against the next.
fn gears(ctx: &Context) -> Scene {
    let row = Row { lobes: 4, radius: 7.87, strands: 3, thick: 2.2, around: 3.2 };
    torn(ctx, row, 0.03, 121_414)
}

/// A row that is torn at all of its joints, with `turn` rad in each frame.
fn torn(ctx: &Context, row: Row, turn: f64, triangles: usize) -> Scene {
    let positions = row.positions();
    let motion = move |frame: usize| {
        let (apart, turn) = (APART + AWAY * frame as f64, turn * frame as f64);
        numbered(positions.iter().map(|position| row.torn(*position, apart, turn) * SPACING).collect())
    };
    let mesh = detailed(ctx, &motion(0).positions, triangles);
    Scene { mesh, motion: Box::new(motion), steps: TEARING, is_matched: true }
}

/// Lobes in a row along x, around the origin, and strands at each joint between two of them (lengths in spacings).
#[derive(Clone, Copy)]
struct Row {
    lobes: usize,
    /// Of a lobe.
    radius: f64,
    /// Strands of a joint.
    strands: usize,
    /// Radius of a strand.
    thick: f64,
    /// How far strands are from the row's axis.
    around: f64,
}

impl Row {
    /// The middle of a lobe, on x.
    fn lobe(&self, index: usize) -> f64 {
        (index as f64 - 0.5 * (self.lobes - 1) as f64) * (2.0 * self.radius + GAP)
    }

    /// The middle of the joint behind a lobe, on x.
    fn joint(&self, index: usize) -> f64 {
        self.lobe(index) + self.radius + 0.5 * GAP
    }

    /// A position on the axis of a strand.
    fn strand(&self, index: usize) -> DVec3 {
        let angle = TAU * index as f64 / self.strands as f64;
        DVec3::new(0.0, libm::cos(angle), libm::sin(angle)) * self.around
    }

    /// Half of what is drawn out of a strand.
    fn half(&self, index: usize) -> f64 {
        let share = index as f64 / (self.strands - 1) as f64;
        HALVES[0] + share * (HALVES[1] - HALVES[0])
    }

    /// How far a position is from the axis of a strand.
    fn beside(&self, position: DVec3, strand: usize) -> f64 {
        (position - self.strand(strand)).yz().norm()
    }

    /// The particles, before anything is drawn out.
    fn positions(&self) -> Vec<DVec3> {
        let is_in_lobe = |position: DVec3| {
            (0..self.lobes).any(|lobe| (position - DVec3::x() * self.lobe(lobe)).norm() <= self.radius)
        };
        // Strands end in the lobes.
        let reach = 0.5 * (GAP + self.radius);
        let is_in_strand = |position: DVec3| {
            (0..self.lobes - 1).any(|joint| (position.x - self.joint(joint)).abs() < reach)
                && (0..self.strands).any(|strand| self.beside(position, strand) < self.thick)
        };
        let size = self.lobe(self.lobes - 1) + self.radius;
        filled(1.0, JITTER, size, |position| is_in_lobe(position) || is_in_strand(position))
    }

    /// Where a position is when the halves of each joint have come `apart` spacings farther from its middle, and lobes have turned by
    /// `turn` rad to the one side and to the other in turn. Strands become as thin as keeps their volume.
    fn torn(&self, position: DVec3, apart: f64, turn: f64) -> DVec3 {
        let strands = (0..self.strands).map(|strand| (self.beside(position, strand), strand));
        let nearest = strands.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, strand)| strand);
        let (axis, half) = (self.strand(nearest), self.half(nearest));
        let thin = 1.0 / (1.0 + apart / half).sqrt();
        let (mut to, mut angle) = (position, turn);
        for joint in 0..self.lobes - 1 {
            let from = position.x - self.joint(joint);
            // Lobes are farther from it than `half` and THIN, so that they keep their shape.
            let side = (from / half).clamp(-1.0, 1.0);
            to.x += apart * side;
            angle *= -side;
            let share = ((THIN[1] - from.abs()) / (THIN[1] - THIN[0])).clamp(0.0, 1.0);
            let width = 1.0 + (thin - 1.0) * share;
            to.y = axis.y + (to.y - axis.y) * width;
            to.z = axis.z + (to.z - axis.z) * width;
        }
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        DVec3::new(to.x, to.y * cosine - to.z * sine, to.y * sine + to.z * cosine)
    }
}

/// The liquid armadillo (Fig. 2.14): a detailed body of a liquid without viscosity that collapses, with splashes, so that it merges and
/// splits in many positions at once. The thesis matched it in 94 % of its frames. Here a ball becomes flat, half of its splashes fly away
/// from it, and half fall into it, at different times.
fn armadillo(ctx: &Context) -> Scene {
    let splash = |index: usize| {
        let height = 1.0 - (2 * index + 1) as f64 / SPLASHES as f64;
        let (across, angle) = ((1.0 - height * height).sqrt(), GOLDEN * index as f64);
        let out = DVec3::new(across * libm::cos(angle), height, across * libm::sin(angle));
        let ([least, most], way) =
            if index.is_multiple_of(2) { (GAPS[0], -FLIGHT) } else { (GAPS[1], FLIGHT) };
        let gap = least + (most - least) * index as f64 / SPLASHES as f64;
        Lump { radius: SPLASH, centre: out * (BODY + SPLASH + gap), way: out * way }
    };
    let body = Lump { radius: BODY, centre: DVec3::zeros(), way: DVec3::zeros() };
    let lumps: Vec<Lump> = std::iter::once(body).chain((0..SPLASHES).map(splash)).collect();
    let motion = flying(&lumps, LOWER);
    let mesh = detailed(ctx, &motion(0).positions, 100_870);
    Scene { mesh, motion, steps: FLYING, is_matched: true }
}

/// A ball of particles that flies (spacings).
pub struct Lump {
    pub radius: f64,
    /// At the first frame.
    pub centre: DVec3,
    /// In each frame.
    pub way: DVec3,
}

/// The particles of lumps, which all become lower by a share of their height in each frame, and as much wider as keeps their volume.
pub fn flying(lumps: &[Lump], lower: f64) -> Motion {
    let mut particles: Vec<(DVec3, DVec3)> = Vec::new();
    for Lump { radius, centre, way } in lumps {
        let positions = filled(1.0, JITTER, *radius, |position| position.norm() <= *radius);
        particles.extend(positions.iter().map(|position| (position + centre, *way)));
    }
    Box::new(move |frame: usize| {
        let high = 1.0 - lower * frame as f64;
        let wide = 1.0 / high.sqrt();
        let one = |(position, way): &(DVec3, DVec3)| {
            let low = DVec3::new(position.x * wide, position.y * high, position.z * wide);
            (low + way * frame as f64) * SPACING
        };
        numbered(particles.iter().map(one).collect())
    })
}
