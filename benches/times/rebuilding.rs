//! Surface: what matching and rebuilding take and give. Cells as in Table 2.1 and Fig. 2.16 of the thesis, a mesh that is only flagged
//! beside one that is rebuilt, and the stages' shares as in Table 2.2 and Fig. 2.17.

use std::time::Instant;

use frazil::Context;
use frazil::error::Result;
use frazil::geometry::TriMesh;
use frazil::geometry::check::faults::Faults;
use frazil::geometry::check::topology::components;
use frazil::surface::{Params, Particles, Tracker};

use crate::common::liquids::{context, own_surface};
use crate::common::nearest::distances;
use crate::edit_history::History;
use crate::harness::spread;
use crate::rebuilt_sequences::{CELL, Sequence, dambreak, made, spot_drop};
use crate::surface::{EXAMPLES, text, title};
use crate::surface_gates::time;

/// Rows of Table 2.1, of the gazelle: cells (spacings), what they are called, and seconds a frame of matching, and of topology and
/// meshing.
const CELLS: [(f64, &str, [f64; 2]); 4] = [
    (0.25, "r / 4", [155.79, 36.91]),
    (0.5, "r / 2", [8.28, 5.11]),
    (1.0, "r", [0.53, 1.90]),
    (2.0, "2 r", [0.05, 1.11]),
];
/// What Table 2.2 has of its examples besides: frames in which something was matched (%), and seconds a frame of matching, of topology
/// and meshing, and of all.
const MATCHED: [(f64, [f64; 2], f64); EXAMPLES.len()] = [
    (58.0, [1.59, 3.16], 11.55),
    (83.0, [13.48, 5.55], 24.77),
    (43.0, [4.13, 3.59], 17.22),
    (0.0, [0.00, 1.48], 6.92),
    (38.0, [8.18, 7.27], 63.40),
    (83.0, [8.28, 5.11], 21.03),
    (94.0, [5.43, 4.51], 21.20),
];
/// The stages of a step, and the phases that each is made of.
const STAGES: [&[&str]; 7] = [
    &["advect"],
    &["phi"],
    &["distance"],
    &["project", "cover"],
    &["flag", "match"],
    &["rebuild", "dry"],
    &["improve"],
];
/// The stages that the thesis calls topology matching, and explicit topology and meshing.
const MATCH: usize = 4;
const MESH: [usize; 2] = [5, 6];
/// Steps of `spot_drop` on which cells are compared.
const STEPS: usize = 16;
/// Steps of `dambreak` of which shares are told: later ones take a long time.
const DAM_STEPS: usize = 16;
/// Which of the made sets stands for `spot_drop` where that is missing.
const PINCH: usize = 1;

/// Prints all of it.
pub fn tables() {
    let ctx = context(1);
    let (scene, steps) = match spot_drop() {
        Some(scene) => (scene, STEPS),
        None => {
            let scene = made(&ctx).swap_remove(PINCH);
            println!("\nspot_drop: no data. In what follows {} stands for it.", scene.name);
            let steps = scene.frames - 1;
            (scene, steps)
        }
    };
    cells(&ctx, &scene, steps);
    let runs = [false, true].map(|rebuild| {
        let params = Params { rebuild, ..scene.params() };
        Run::of(&ctx, &scene, params, scene.frames - 1).expect("a run")
    });
    flagged_only(&ctx, &scene, &runs);
    let [_, rebuilt] = &runs;
    let dam = dambreak(&ctx).map(|dam| {
        let run = Run::of(&ctx, &dam, dam.params(), DAM_STEPS.min(dam.frames - 1)).expect("a run");
        (dam.name, run)
    });
    shares([(scene.name, rebuilt)].into_iter().chain(dam.as_ref().map(|(name, run)| (*name, run))));
}

/// What following a liquid took, and where it led.
struct Run {
    steps: usize,
    /// Steps in which something was matched.
    matched: usize,
    /// Seconds of all steps, and of each stage of them.
    whole: f64,
    stages: [f64; STAGES.len()],
    /// At the last frame.
    tracker: Tracker,
    particles: Particles,
    /// Share of the first triangles that are left (%).
    alive: f64,
}

impl Run {
    fn of(ctx: &Context, sequence: &Sequence, params: Params, steps: usize) -> Result<Self> {
        let mut from = sequence.at(0);
        let mut tracker = Tracker::new(ctx, params, &sequence.mesh, &from)?;
        let mut history = History::new(sequence.mesh.positions.len(), &sequence.mesh.triangles);
        let (mut matched, mut whole, mut stages) = (0, 0.0f64, [0.0f64; STAGES.len()]);
        for index in 1..=steps {
            let to = sequence.at(index);
            let start = Instant::now();
            let report = tracker.step(ctx, &from, &to, sequence.dt)?;
            whole += start.elapsed().as_secs_f64();
            for (stage, phases) in stages.iter_mut().zip(STAGES) {
                *stage += phases.iter().map(|phase| time(&report, phase)).sum::<f64>();
            }
            if let Some(change) = &report.change {
                matched += usize::from(change.flagged_cells > 0);
                history.follow(change);
            }
            from = to;
        }
        Ok(Self { steps, matched, whole, stages, tracker, particles: from, alive: history.alive() })
    }

    /// Steps in which something was matched (%).
    fn share_matched(&self) -> f64 {
        100.0 * self.matched as f64 / self.steps as f64
    }

    /// Seconds a step of some stages.
    fn seconds(&self, stages: &[usize]) -> f64 {
        stages.iter().map(|stage| self.stages[*stage]).sum::<f64>() / self.steps as f64
    }
}

/// How far the vertices of a mesh are from another: mean, 95th percentile and greatest, in spacings (m).
fn apart(from: &TriMesh, to: &TriMesh, spacing: f64) -> String {
    let off = distances(to, &from.positions, CELL * spacing);
    text(spread(off.into_iter().map(|off| off / spacing).collect()))
}

/// Cells of four sizes.
fn cells(ctx: &Context, scene: &Sequence, steps: usize) {
    title(
        &format!(
            "Table 2.1 and Fig. 2.16: cells, 1 thread. Seconds a frame: the thesis' are of its gazelle, 21362 particles and 242932 \
             triangles, with Gamma on these cells and phi on r / 2; ours of {}, {} particles and {} triangles, for {steps} frames, \
             with both on these cells; to say which cells no longer fit counts as matching. Then what the mesh is in the end: its \
             connected parts, its first triangles that are left, its volume over that of r / 4, and how far from it the vertices \
             of r / 4 are.",
            scene.name,
            scene.at(0).positions.len(),
            scene.mesh.triangles.len()
        ),
        "cell | by | matching | topology and meshing | frames matched | triangles | parts | first triangles left | volume | \
         off r / 4: mean, p95, max (r)",
    );
    let mut finest: Option<TriMesh> = None;
    for (cell, name, [matching, meshing]) in CELLS {
        println!("| {name} | thesis | {matching:.2} | {meshing:.2} | - | - | - | - | - | - |");
        let run = match Run::of(ctx, scene, Params { cell, ..scene.params() }, steps) {
            Ok(run) => run,
            Err(error) => {
                println!("| {name} | frazil | {error} | - | - | - | - | - | - | - |");
                continue;
            }
        };
        let mesh = run.tracker.mesh();
        let is_first = finest.is_none();
        let finest = finest.get_or_insert_with(|| mesh.clone());
        println!(
            "| {name} | frazil | {:.3} | {:.3} | {:.0} % | {} | {} | {:.1} % | {:.2} % | {} |",
            run.seconds(&[MATCH]),
            run.seconds(&MESH),
            run.share_matched(),
            mesh.triangles.len(),
            components(&mesh.triangles).len(),
            run.alive,
            100.0 * mesh.volume() / finest.volume(),
            if is_first { "-".to_string() } else { apart(finest, &mesh, scene.spacing) }
        );
    }
}

/// A mesh that is only flagged beside one that is rebuilt.
fn flagged_only(ctx: &Context, scene: &Sequence, runs: &[Run; 2]) {
    title(
        &format!(
            "Matching off and on. {} for {} frames, 1 thread: the mean time of a frame, and what the mesh is in the end: pairs of \
             its triangles that pass through each other, its connected parts, its volume over that of the particles' surface, \
             and how far from it the vertices of that surface are.",
            scene.name, runs[0].steps
        ),
        "mesh | s a frame | triangles | flagged vertices | crossings | parts | volume | \
         from the particles' surface: mean, p95, max (r)",
    );
    let own = own_surface(ctx, &runs[0].particles.positions, scene.spacing);
    for (name, run) in ["flagged only", "rebuilt"].into_iter().zip(runs) {
        let mesh = run.tracker.mesh();
        let faults = Faults::of(&mesh);
        println!(
            "| {name} | {:.3} | {} | {} | {} | {} | {:.1} % | {} |",
            run.whole / run.steps as f64,
            mesh.triangles.len(),
            run.tracker.flags().iter().filter(|flag| **flag).count(),
            faults.crossings + faults.corner_crossings,
            components(&mesh.triangles).len(),
            100.0 * mesh.volume() / own.volume(),
            apart(&own, &mesh, scene.spacing)
        );
    }
    let parts = components(&own.triangles).len();
    println!("| the particles' surface | - | {} | - | - | {parts} | 100 % | - |", own.triangles.len());
}

/// Frames in which something was matched, and what share of a frame each stage takes.
fn shares<'a>(runs: impl Iterator<Item = (&'a str, &'a Run)>) {
    title(
        "Table 2.2 and Fig. 2.17: frames in which something was matched, and the stages' shares of a frame (%), 1 thread. \
         The thesis counts improvement as rebuilding. Ours has the search for what the mesh does not cover in projection; what is \
         missing to 100 is in no stage; particles and triangles are those in the end.",
        "scene | by | particles | triangles | frames matched | advect | phi | distance | project | flag, match | rebuild | \
         improve | s a frame",
    );
    for ((name, particles, triangles, first), (matched, last, whole)) in EXAMPLES.into_iter().zip(MATCHED) {
        let each: String =
            first.iter().chain(&last).map(|stage| format!(" {:.1} |", 100.0 * stage / whole)).collect();
        println!("| {name} | thesis | {particles} | {triangles} | {matched:.0} % |{each} - | {whole:.2} |");
    }
    for (name, run) in runs {
        let each: String =
            run.stages.iter().map(|stage| format!(" {:.1} |", 100.0 * stage / run.whole)).collect();
        println!(
            "| {name}, {} frames | frazil | {} | {} | {:.0} % |{each} {:.3} |",
            run.steps,
            run.particles.positions.len(),
            run.tracker.triangles().len(),
            run.share_matched(),
            run.whole / run.steps as f64
        );
    }
}
