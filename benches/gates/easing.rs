//! Gates of easing, on the made sets: how far what a change makes lies from the surface that was shown before it, and whether what is
//! shown crosses itself.

use frazil::base::deviation::NearestTree;
use frazil::base::{DVec3, TriMesh};
use frazil::surface::{Change, Outlook, Particles, Tracker};

use crate::common::liquids::context;
use crate::harness::Harness;
use crate::rebuilt_sequences::{Sequence, made};
use crate::windings::astray;

const NAMES: [&str; 3] = ["surface.easing_jump", "surface.easing_depth", "surface.easing_volume"];
/// Frames ahead, as is usual.
const AHEAD: usize = 4;

/// The greatest of some numbers, and where it is.
#[derive(Default)]
struct Worst(f64, String);

impl Worst {
    fn see(&mut self, value: f64, title: impl Fn() -> String) {
        if value > self.0 || value.is_nan() {
            *self = Self(value, title());
        }
    }
}

/// What was found.
#[derive(Default)]
struct Tally {
    /// Farthest that something is made from the surface that was shown (spacings), and from the one that was not eased.
    eased: Worst,
    plain: Worst,
    /// Farthest that easing moves a vertex from one frame to the next (spacings).
    step: Worst,
    /// Deepest place that what is shown surrounds neither once nor never (cells), and the share of the volume that such places have.
    depth: Worst,
    volume: Worst,
    frames: usize,
}

pub fn run(h: &mut Harness) {
    if !NAMES.iter().any(|name| h.wants(name)) {
        return;
    }
    let mut tally = Tally::default();
    for sequence in made(&context(2)) {
        tally.follow(&sequence);
    }
    let Tally { eased, plain, step, depth, volume, frames } = tally;
    let notes = [
        format!(
            "{}, {AHEAD} frames ahead; without {:.2}; before it no vertex is moved farther in a frame than {:.2}",
            eased.1, plain.0, step.0
        ),
        format!("cells, in {frames} frames of the made sets as they are shown; {}", depth.1),
        volume.1,
    ];
    for ((name, value), note) in NAMES.iter().zip([eased.0, depth.0, volume.0]).zip(notes) {
        if h.wants(name) {
            h.gate(name, value, &note);
        }
    }
}

impl Tally {
    fn follow(&mut self, sequence: &Sequence) {
        let ctx = context(2);
        let frames: Vec<Particles> = (0..sequence.frames).map(|frame| sequence.at(frame)).collect();
        let mut tracker =
            Tracker::new(&ctx, sequence.params(), &sequence.mesh, &frames[0]).expect("a tracker");
        let mut outlook = Outlook::default();
        for frame in 1..frames.len() {
            let (from, to) = (&frames[frame - 1], &frames[frame]);
            let coming = &frames[frame..frames.len().min(frame + AHEAD + 1)];
            outlook.look(&ctx, &tracker, from, coming, sequence.dt).expect("steps");
            let title = || sequence.title(frame - 1);
            let moved: Vec<DVec3> = outlook
                .eased(&tracker, AHEAD)
                .iter()
                .zip(tracker.vertices())
                .map(|(shown, own)| shown - own)
                .collect();
            self.see_shown(sequence, &tracker, &moved, title);
            let triangles = tracker.triangles().to_vec();
            let (next, report) = outlook.take(from, to, sequence.dt).expect("the step that was made");
            match &report.change {
                Some(change) => {
                    self.see_change(sequence, (change, &triangles), &moved, || sequence.title(frame))
                }
                None => {
                    let after = outlook.eased(&next, AHEAD);
                    for ((shown, own), before) in after.iter().zip(next.vertices()).zip(&moved) {
                        self.step.see(((shown - own) - before).norm() / sequence.spacing, title);
                    }
                }
            }
            tracker = next;
        }
    }

    /// A frame as it is shown, with vertices moved by so much (m).
    fn see_shown(
        &mut self,
        sequence: &Sequence,
        tracker: &Tracker,
        moved: &[DVec3],
        title: impl Fn() -> String + Copy,
    ) {
        if moved.iter().all(|way| *way == DVec3::zeros()) {
            return;
        }
        self.frames += 1;
        let places = tracker.vertices().iter().zip(moved).map(|(own, way)| (own + way).cast());
        let mesh = TriMesh { positions: places.collect(), triangles: tracker.triangles().to_vec() };
        let Some(astray) = astray(&mesh, sequence.cell() / 4.0) else { return };
        let tree = NearestTree::new(&mesh);
        for place in &astray {
            let depth = tree.nearest(place.cast()).map_or(0.0, |near| near.distance) / sequence.cell();
            self.depth.see(depth, title);
        }
        let volume = astray.len() as f64 * (sequence.cell() / 4.0).powi(3);
        self.volume.see(volume / mesh.volume(), title);
    }

    /// A change of a mesh that had these triangles, and whose vertices were shown so far (m) from where they are.
    fn see_change(
        &mut self,
        sequence: &Sequence,
        (change, triangles): (&Change, &[[u32; 3]]),
        moved: &[DVec3],
        title: impl Fn() -> String + Copy,
    ) {
        let tree = |share: f64| {
            let places = change.before.iter().zip(moved).map(|(place, way)| (place + way * share).cast());
            NearestTree::new(&TriMesh { positions: places.collect(), triangles: triangles.to_vec() })
        };
        for (tree, worst) in [(tree(1.0), &mut self.eased), (tree(0.0), &mut self.plain)] {
            for (place, _) in change.vertices.iter().zip(&change.origins).filter(|(_, own)| own.is_none()) {
                let far = tree.nearest(*place).map_or(f64::INFINITY, |near| near.distance);
                worst.see(far / sequence.spacing, title);
            }
        }
    }
}
