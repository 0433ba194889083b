//! Gates of easing, on the made sets and the caches: how far what a change makes lies from the surface that was shown before it, and
//! whether what is shown crosses itself.

use frazil::Context;
use frazil::geometry::check::deviation::NearestTree;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Change, Outlook, Particles, Tracker};

use crate::common::liquids::context;
use crate::surface::rebuilt_sequences::{Sequence, dambreak, made, spot_drop};
use crate::surface::windings::depth_and_share;
use crate::worst::Worst;

/// Frames ahead, the default.
const AHEAD: usize = 4;
/// Frames of the caches from one look at the lattice to the next.
const EVERY: usize = 5;

/// What was found of changes.
#[derive(Default)]
struct Jumps {
    /// Farthest that something is made from the surface that was shown (spacings), and from the one that was not eased.
    eased: Worst,
    plain: Worst,
    /// Farthest that easing moves a vertex from one frame to the next (spacings).
    step: Worst,
}

/// What was found of frames as they are shown.
#[derive(Default)]
struct Shown {
    /// Deepest position that the mesh surrounds neither once nor never (cells), and the share of the volume that such positions have.
    depth: Worst,
    volume: Worst,
    frames: usize,
}

pub fn measure() -> [(f64, String); 3] {
    let ctx = context(2);
    let [mut of_made, mut of_caches] = [Jumps::default(), Jumps::default()];
    let mut shown = Shown::default();
    for sequence in made(&ctx) {
        follow(&ctx, &sequence, 1, (&mut of_made, &mut shown));
    }
    let mut names = vec!["the made sets"];
    for (name, cache) in [("spot_drop", spot_drop()), ("dambreak", dambreak(&ctx))] {
        match cache {
            Some(sequence) => {
                names.push(name);
                follow(&ctx, &sequence, EVERY, (&mut of_caches, &mut shown));
            }
            None => println!("# {name} is skipped: no data"),
        }
    }
    let caches = match names[1..].join(", ") {
        found if found.is_empty() => "no caches".into(),
        found => format!("of {found} {:.2}, {}", of_caches.eased.value(), of_caches.told()),
    };
    let frames =
        format!("{} frames of {} as they are shown, where that is eased", shown.frames, names.join(", "));
    [
        (of_made.eased.value(), format!("of the made sets, {}; {caches}", of_made.told())),
        (shown.depth.value(), format!("{frames}; {}", shown.depth.note())),
        (shown.volume.value(), format!("{frames}; {}", shown.volume.note())),
    ]
}

/// Lets a mesh follow a sequence, and looks at every so many frames as they are shown.
fn follow(ctx: &Context, sequence: &Sequence, every: usize, (jumps, shown): (&mut Jumps, &mut Shown)) {
    let frames: Vec<Particles> = (0..sequence.frames).map(|frame| sequence.at(frame)).collect();
    let mut tracker = Tracker::new(ctx, sequence.params(), &sequence.mesh, &frames[0]).expect("a tracker");
    let mut outlook = Outlook::default();
    for frame in 1..frames.len() {
        let (from, to) = (&frames[frame - 1], &frames[frame]);
        let coming = frames[frame..frames.len().min(frame + AHEAD + 1)].to_vec();
        outlook.look(ctx, &tracker, from.clone(), coming, sequence.dt).expect("steps");
        let title = || sequence.title(frame - 1);
        let moved: Vec<DVec3> = outlook
            .eased(ctx, &tracker, AHEAD)
            .expect("places")
            .iter()
            .zip(tracker.vertices())
            .map(|(shown, own)| shown - own)
            .collect();
        if (frame - 1).is_multiple_of(every) {
            shown.see(sequence, &tracker, &moved, title);
        }
        let triangles = tracker.triangles().to_vec();
        let (next, report) = outlook.take(from, to, sequence.dt).expect("the step that was made");
        match &report.change {
            Some(change) => jumps.see(sequence, (change, &triangles), &moved, || sequence.title(frame)),
            None => {
                let after = outlook.eased(ctx, &next, AHEAD).expect("places");
                for ((shown, own), before) in after.iter().zip(next.vertices()).zip(&moved) {
                    jumps.step.see(((shown - own) - before).norm() / sequence.spacing, title);
                }
            }
        }
        tracker = next;
    }
}

impl Jumps {
    /// A change of a mesh that had these triangles, and whose vertices were shown so far (m) from where they are.
    fn see(
        &mut self,
        sequence: &Sequence,
        (change, triangles): (&Change, &[[u32; 3]]),
        moved: &[DVec3],
        title: impl Fn() -> String,
    ) {
        let tree = |share: f64| {
            let places = change.before.iter().zip(moved).map(|(place, way)| (place + way * share).cast());
            NearestTree::new(&TriMesh { positions: places.collect(), triangles: triangles.to_vec() })
        };
        for (tree, worst) in [(tree(1.0), &mut self.eased), (tree(0.0), &mut self.plain)] {
            for (place, _) in change.vertices.iter().zip(&change.origins).filter(|(_, own)| own.is_none()) {
                let far = tree.nearest(*place).map_or(f64::INFINITY, |near| near.distance);
                worst.see(far / sequence.spacing, &title);
            }
        }
    }

    fn told(&self) -> String {
        format!(
            "{}, {AHEAD} frames ahead; without {:.2}; before it no vertex is moved farther in a frame than {:.2}",
            self.eased.note(),
            self.plain.value(),
            self.step.value()
        )
    }
}

impl Shown {
    /// A frame with vertices moved by so much (m). Where none is, it is the mesh of gates `surface.rebuilt_winding`.
    fn see(&mut self, sequence: &Sequence, tracker: &Tracker, moved: &[DVec3], title: impl Fn() -> String) {
        if moved.iter().all(|way| *way == DVec3::zeros()) {
            return;
        }
        self.frames += 1;
        let places = tracker.vertices().iter().zip(moved).map(|(own, way)| (own + way).cast());
        let mesh = TriMesh { positions: places.collect(), triangles: tracker.triangles().to_vec() };
        let [depth, share] = depth_and_share(&mesh, sequence.cell());
        self.depth.see(depth, &title);
        self.volume.see(share, &title);
    }
}
