//! Gates of the made sets, whose mesh is rebuilt: whether it becomes what the liquid does, how soon, and whether what its changes say
//! of themselves is so; and whether it is valid, and becomes that too, where its topology is matched all over it in every step.

use frazil::geometry::check::topology::components;
use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::{DetailedMesh, MeshArray, TriMesh};
use frazil::mesh_repair::carry_attributes;
use frazil::surface::Change;

use crate::common::liquids::{context, own_surface};
use crate::harness::Harness;
use crate::surface::edit_history::History;
use crate::surface::rebuilt::unsound;
use crate::surface::rebuilt_sequences::{Frame, made, walk};
use crate::surface::windings::part_volume;

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
        let parts = components(&mesh.triangles);
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
    let names = ["surface.rebuilt_topology", "surface.rebuilt_late", "surface.rebuilt_edits"];
    h.measure_all(names, followed);
    h.measure("surface.every_valid", matched_in_every_step);
}

/// The mesh as it is usually matched.
fn followed() -> [(f64, String); 3] {
    let ctx = context(2);
    let (mut are_true, mut latest, mut fault, mut changes, mut left) = (true, 0, None, 0, [0; 2]);
    for (sequence, truth) in made(&ctx).iter().zip(TRUTH) {
        let first = Kind::of(&sequence.mesh);
        let (mut own, mut mesh) = (vec![first], vec![first]);
        let mut history = History::new(sequence.mesh.positions.len(), &sequence.mesh.triangles);
        let mut numbers = Numbers::of(&sequence.mesh);
        let ended = walk(&ctx, sequence, |frame| {
            own.push(Kind::of(&own_surface(&ctx, &frame.particles.positions, sequence.spacing)));
            mesh.push(Kind::of(&frame.tracker.mesh()));
            if let Some(change) = &frame.report.change {
                changes += 1;
                history.follow(change);
                // After the first fault numbers are of no mesh any more.
                if fault.is_none() {
                    let mut step = History::new(change.before.len(), frame.before);
                    step.follow(change);
                    let wrong = step.fault(frame.tracker.triangles());
                    let wrong = wrong.or_else(|| history.fault(frame.tracker.triangles()));
                    let wrong = wrong.or_else(|| {
                        numbers.follow(frame, change);
                        numbers.fault(&history)
                    });
                    fault = wrong.map(|wrong| format!("{}: {wrong}", sequence.title(frame.index)));
                }
            }
        });
        for (sum, own) in left.iter_mut().zip(history.survivors()) {
            *sum += own.iter().flatten().count();
        }
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
    let [vertices, triangles] = left;
    let is_right = fault.is_none() && changes > 0 && vertices > 0 && triangles > 0;
    let of_edits = fault.unwrap_or_else(|| {
        format!(
            "{changes} changes, one by one and together; at the end {vertices} vertices and {triangles} triangles are left, with the \
             numbers that they carried along"
        )
    });
    let of_ends = "balls, dumbbell, sheet, bubble: parts, cavities and handles at the end".into();
    [
        (f64::from(are_true), of_ends),
        (latest as f64, "the worst of the made sets".into()),
        (f64::from(is_right), of_edits),
    ]
}

/// A mesh whose first vertices and triangles carry their own numbers.
struct Numbers(DetailedMesh);

impl Numbers {
    fn of(mesh: &TriMesh) -> Self {
        let array = |on, count: usize| MeshArray {
            name: "own".into(),
            on,
            number: Number::U32,
            values: (0..count).map(|n| n as f64).collect(),
        };
        let arrays = vec![array(On::Vertices, mesh.positions.len()), array(On::Faces, mesh.triangles.len())];
        Self(DetailedMesh { mesh: mesh.clone(), uvs: None, arrays })
    }

    /// Goes on by the change of a frame.
    fn follow(&mut self, frame: &Frame<'_>, change: &Change) {
        let positions = change.before.iter().map(|position| position.cast()).collect();
        self.0.mesh = TriMesh { positions, triangles: frame.before.to_vec() };
        self.0 = carry_attributes(&self.0, frame.tracker.mesh(), &change.origins, &change.sources, None);
    }

    /// What is still there and has another number than its own.
    fn fault(&self, history: &History) -> Option<String> {
        let arrays = self.0.arrays.iter().zip(history.survivors());
        arrays.zip(["vertex", "triangle"]).find_map(|((array, own), what)| {
            if array.values.len() != own.len() {
                return Some(format!("{} numbers for {} of kind {what}", array.values.len(), own.len()));
            }
            let mut pairs = array.values.iter().zip(own).enumerate();
            pairs.find_map(|(at, (value, own))| {
                let own = (*own)?;
                (*value != f64::from(own))
                    .then(|| format!("{what} {at} was {what} {own}, but carries the number {value}"))
            })
        })
    }
}

/// The mesh with its topology matched all over it in every step.
fn matched_in_every_step() -> (f64, String) {
    let ctx = context(2);
    let (mut frames, mut faults, mut ends) = (0, 0, Vec::new());
    for (mut sequence, truth) in made(&ctx).into_iter().zip(TRUTH) {
        sequence.every = true;
        let (mut last, mut is_sound) = (None, true);
        let ended = walk(&ctx, &sequence, |frame| {
            let mesh = frame.tracker.mesh();
            let fault = unsound(&mesh);
            frames += 1;
            faults += usize::from(fault.is_some());
            is_sound = fault.is_none();
            if let Some(fault) = fault {
                println!("# match = every, {}: {fault}", sequence.title(frame.index));
            }
            last = Some(mesh);
        });
        if let Some(error) = ended {
            faults += 1;
            println!("# match = every, {error}");
            continue;
        }
        // A frame is at fault once.
        let Some(end) = last.filter(|_| is_sound).map(|mesh| Kind::of(&mesh)) else { continue };
        faults += usize::from(end != truth);
        ends.push(format!("{} {end}", sequence.name));
    }
    let note = format!("of {frames}; at the end: {}", ends.join("; "));
    (if frames > 0 { faults as f64 } else { f64::NAN }, note)
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
