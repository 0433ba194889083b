//! Gates of the made sets, whose mesh is rebuilt: whether it becomes what the liquid does, how soon, and whether what its changes say
//! of themselves is so.

use frazil::base::TriMesh;
use frazil::base::topology::bodies;

use crate::common::liquids::context;
use crate::edit_history::History;
use crate::harness::Harness;
use crate::rebuilt_sequences::{made, own_surface, walk};
use crate::windings::part_volume;

const NAMES: [&str; 3] = ["surface.rebuilt_topology", "surface.rebuilt_late", "surface.rebuilt_edits"];
/// For so many frames the particles' own surface must stay what it has become, so that the mesh must become it.
const KEPT: usize = 3;

/// What a closed surface is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Kind {
    /// Parts with a volume over 0, and others.
    bodies: usize,
    cavities: usize,
    /// Of all of them.
    handles: i64,
}

const fn solid(bodies: usize) -> Kind {
    Kind { bodies, cavities: 0, handles: 0 }
}

/// What each set is at its last frame, by its motion.
///
/// The balls lie in each other. Of the dumbbell's neck, drawn out by 12, the layers of particles that lay within 5 of the middle, one
/// apart, are drops of their own: ten, and what is left of the balls. The sheet is drawn out by 6.6 along x and z, and all but flat:
/// of its 29 x 29 columns of 4 particles each is a drop. The bubble, whose radius was 5.5, loses 4 from its cube in a frame, and is gone
/// after 42.
const TRUTH: [Kind; 4] = [solid(1), solid(12), solid(841), solid(1)];

impl Kind {
    fn of(mesh: &TriMesh) -> Self {
        let parts = bodies(&mesh.triangles);
        let solids = parts.iter().filter(|part| part_volume(mesh, part) > 0.0).count();
        let handles = parts.len() as i64 - mesh.euler_characteristic() / 2;
        Self { bodies: solids, cavities: parts.len() - solids, handles }
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} bodies, {} cavities, {} handles", self.bodies, self.cavities, self.handles)
    }
}

pub fn run(h: &mut Harness) {
    if !NAMES.iter().any(|name| h.wants(name)) {
        return;
    }
    let ctx = context(2);
    let (mut are_true, mut latest, mut fault, mut changes) = (true, 0, None, 0);
    for (sequence, truth) in made(&ctx).iter().zip(TRUTH) {
        let first = Kind::of(&sequence.mesh);
        let (mut own, mut mesh) = (vec![first], vec![first]);
        let mut history = History::new(sequence.mesh.positions.len(), &sequence.mesh.triangles);
        let ended = walk(&ctx, sequence, |frame| {
            own.push(Kind::of(&own_surface(&ctx, &frame.particles.places, sequence.spacing)));
            mesh.push(Kind::of(&frame.tracker.mesh()));
            if let Some(change) = &frame.report.change {
                changes += 1;
                history.follow(change);
                let mut step = History::new(change.before.len(), frame.before);
                step.follow(change);
                let wrong = step.fault(frame.tracker.triangles());
                let wrong = wrong.or_else(|| history.fault(frame.tracker.triangles()));
                if fault.is_none() {
                    fault = wrong.map(|wrong| format!("{}: {wrong}", sequence.title(frame.index)));
                }
            }
        });
        let lags = lags(&own, &mesh);
        let last = *mesh.last().expect("the first frame");
        println!(
            "# {}: at the end {last}, and its particles' own surface {}; that changes for good at frames (with what the mesh \
             takes longer) {lags:?}; {:.0} % of the first triangles are left",
            sequence.name,
            own[own.len() - 1],
            history.alive()
        );
        are_true &= last == truth && ended.is_none();
        latest = lags.iter().map(|lag| lag.1).fold(latest, usize::max);
        if let Some(error) = ended {
            println!("# {error}");
            latest = latest.max(sequence.frames);
        }
    }
    if h.wants(NAMES[0]) {
        h.holds(NAMES[0], are_true, "balls, dumbbell, sheet, bubble: parts, cavities and handles at the end");
    }
    if h.wants(NAMES[1]) {
        h.gate(NAMES[1], latest as f64, "the worst of the made sets");
    }
    if h.wants(NAMES[2]) {
        let note = fault.clone().unwrap_or_else(|| format!("{changes} changes, one by one and together"));
        h.holds(NAMES[2], fault.is_none() && changes > 0, &note);
    }
}

/// The frames at which a surface changes into what it stays for [`KEPT`] frames or more, and how many frames later the mesh is that:
/// as many as it stays so where the mesh never is.
fn lags(own: &[Kind], mesh: &[Kind]) -> Vec<(usize, usize)> {
    let (mut out, mut begin) = (Vec::new(), 0);
    for run in own.chunk_by(|a, b| a == b) {
        let end = begin + run.len();
        if begin > 0 && run.len() >= KEPT {
            let is_there = mesh[begin..end].iter().position(|kind| *kind == run[0]);
            out.push((begin, is_there.unwrap_or(run.len())));
        }
        begin = end;
    }
    out
}
