//! Surface: Table 2.2 of the thesis beside ours, and what ours does otherwise than the thesis and Yu et al. (2012) beside theirs.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::PathBuf;

use frazil::Context;
use frazil::geometry::mesh::coincident;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::surface::{Distances, Implicit, Isosurface, Params, Particles, Tracker, Weighting, carried};

use crate::common::liquids::{Ball, ball, context, follow, numbered, once_around, surface_on};
use crate::common::nearest::distances;
use crate::common::spot;
use crate::harness::median;
use crate::projections::{Follower, WAYS, measured};
use crate::surface_gates::{steps_with, time};

/// Rows of Table 2.2: particles, triangles, and seconds a frame of the phases below, on one core of an i7-3930K.
pub const EXAMPLES: [(&str, usize, usize, [f64; 4]); 7] = [
    ("dragon", 20_456, 257_785, [1.17, 3.01, 1.39, 1.24]),
    ("gears", 8_877, 121_414, [0.39, 1.82, 3.06, 0.48]),
    ("viscous armadillo", 35_195, 85_274, [0.41, 5.34, 3.43, 0.32]),
    ("melting bunny", 27_952, 66_862, [0.30, 3.98, 0.92, 0.24]),
    ("falling objects", 259_752, 370_789, [1.29, 35.96, 9.60, 1.10]),
    ("splitting gazelle", 21_362, 242_932, [0.87, 3.43, 2.53, 0.81]),
    ("liquid armadillo", 35_214, 100_870, [0.41, 6.04, 4.15, 0.67]),
];
const PHASES: [&str; 4] = ["advect", "phi", "distance", "project"];
/// The first frames of `spot_drop`, which projections are compared on.
const FIRST: usize = 11;
/// How far from the surface distances are known to projections (spacings).
const REACH: f64 = 3.0;

/// Prints all of it.
pub fn tables(cores: usize) {
    title(
        "Surface: seconds a frame, without files; median of 3 frames (of one, for a million) after one to warm up. \
         Ours are balls of as many particles and triangles as in Table 2.2 of the thesis, whose times are from one \
         core; spot_drop is a solver's cache: of it and the balls the worse is to be quoted, and gains divided by 1.8, \
         by which a core of today does more scalar work than the thesis'. phi is told with its triangulation.",
        "like | particles | triangles | by | advect | phi | distance | project | the four",
    );
    for (name, particles, triangles, thesis) in EXAMPLES {
        phases(name, &ball_of(particles, triangles), Some((particles, triangles, thesis)), 3, cores);
    }
    phases("a million", &ball_of(1_000_000, 1_000_000), None, 1, cores);
    let read = |file: PathBuf| (1..=spot::FRAMES).map(|frame| spot::particles_at(&file, frame)).collect();
    let spot: Vec<Particles> = spot::first().map(read).unwrap_or_default();
    if spot.is_empty() {
        println!("\nspot_drop is left out in what follows: no data.");
    }
    if let Some(file) = spot::first() {
        of_cache(&spot::sculpted(&file), &spot, cores);
    }
    weightings(cores, &spot);
    cells(cores, &spot);
    projections(cores, &spot);
}

/// What a table shows, then its head, of columns between bars.
pub fn title(text: &str, columns: &str) {
    println!("\n{text}\n\n| {columns} |\n|{}", "---|".repeat(columns.split(" | ").count()));
}

/// A ball of about so many particles under about so many triangles.
fn ball_of(particles: usize, triangles: usize) -> Ball {
    let radius = (3.0 * particles as f64 / (4.0 * PI)).cbrt();
    ball(radius, (triangles as f64 / 12.0).sqrt().round() as usize, 0.25)
}

fn phases(name: &str, ball: &Ball, thesis: Option<(usize, usize, [f64; 4])>, steps: usize, cores: usize) {
    let row = |who: &str, particles: usize, triangles: usize, times: [f64; 4]| {
        let each = times.map(|time| format!("{time:.3}")).join(" | ");
        let sum: f64 = times.iter().sum();
        println!("| {name} | {particles} | {triangles} | {who} | {each} | {sum:.2} |");
    };
    if let Some((particles, triangles, times)) = thesis {
        row("thesis", particles, triangles, times);
    }
    for threads in [1, cores].into_iter().take(cores.min(2)) {
        let times = phase_times(threads, ball, Params::for_spacing(ball.spacing), steps);
        let who = format!("frazil, {threads} thread{}", if threads > 1 { "s" } else { "" });
        row(&who, ball.positions.len(), ball.mesh.triangles.len(), times);
    }
}

/// The row of the first steps of `spot_drop`.
fn of_cache(mesh: &TriMesh, frames: &[Particles], cores: usize) {
    for threads in [1, cores].into_iter().take(cores.min(2)) {
        let ctx = context(threads);
        let mut tracker =
            Tracker::new(&ctx, Params::for_spacing(spot::SPACING), mesh, &frames[0]).expect("a tracker");
        let step =
            |pair: &[Particles]| tracker.step(&ctx, &pair[0], &pair[1], 1.0 / spot::FPS).expect("a step");
        let reports: Vec<_> = frames[..FIRST].windows(2).map(step).collect();
        let times = PHASES.map(|phase| median(reports.iter().map(|report| time(report, phase)).collect()));
        let each = times.map(|time| format!("{time:.3}")).join(" | ");
        let (particles, triangles) = (frames[0].positions.len(), mesh.triangles.len());
        let (who, sum) = (format!("frazil, {threads} thread(s)"), times.iter().sum::<f64>());
        println!("| spot_drop | {particles} | {triangles} | {who} | {each} | {sum:.2} |");
    }
}

/// Seconds of each phase of a frame.
fn phase_times(threads: usize, ball: &Ball, params: Params, steps: usize) -> [f64; 4] {
    let reports = steps_with(&context(threads), ball, params, steps);
    PHASES.map(|phase| median(reports.iter().map(|(_, report)| time(report, phase)).collect()))
}

/// Mean, 95th percentile and greatest of some numbers.
pub fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    [mean, values[(values.len() * 95 / 100).min(values.len() - 1)], values[values.len() - 1]]
}

/// Mean, 95th percentile and greatest as a cell of a table.
pub fn text(numbers: [f64; 3]) -> String {
    numbers.map(|number| format!("{number:.4}")).join(", ")
}

/// The thesis' advection by means beside affine maps.
fn weightings(cores: usize, spot: &[Particles]) {
    title(
        "Advection. A ball turns once in 100 frames and travels: how far vertices are from where they should be. \
         Every tenth particle of spot_drop is taken out and carried by the others for 40 frames: how far it is from \
         where the solver has it.",
        "weighting | advect (s, like the dragon, 1 thread) | ball: mean, p95, max (r) | flagged | \
         spot_drop: mean, p95, max (r)",
    );
    let ctx = context(cores);
    let (dragon, ball) = (ball_of(EXAMPLES[0].1, EXAMPLES[0].2), ball(10.0, 40, 0.25));
    for (name, weighting) in [("mean (thesis)", Weighting::Mean), ("affine", Weighting::Affine)] {
        let params = Params { weighting, ..Params::for_spacing(ball.spacing) };
        let [advect, ..] = phase_times(1, &dragon, params, 3);
        let (_, errors) = follow(&ctx, &ball, params, 100, once_around);
        let turned = text([errors.mean, errors.p95, errors.most]);
        let own = if spot.is_empty() { "-".to_string() } else { text(left_out(&ctx, spot, weighting)) };
        println!("| {name} | {advect:.3} | {turned} | {} | {own} |", errors.flagged);
    }
}

/// How far (r) a tenth of a solver's particles, carried by the others, are from where they should be at the last frame.
fn left_out(ctx: &Context, frames: &[Particles], weighting: Weighting) -> [f64; 3] {
    let params = Params { weighting, ..Params::for_spacing(spot::SPACING) };
    let others: Vec<Particles> = frames.iter().map(|frame| part(frame, |id| id % 10 != 0)).collect();
    let Particles { ids, mut positions, .. } = part(&frames[0], |id| id % 10 == 0);
    for pair in others.windows(2) {
        positions = carried(ctx, &positions, &pair[0], &pair[1], 1.0 / spot::FPS, &params).expect("a step");
    }
    let last = part(&frames[frames.len() - 1], |id| id % 10 == 0);
    let there: HashMap<i64, DVec3> = last.ids.into_iter().zip(last.positions).collect();
    let off = |(id, position): (&i64, &DVec3)| Some((there.get(id)? - position).norm() / spot::SPACING);
    spread(ids.iter().zip(&positions).filter_map(off).collect())
}

/// The particles whose id is wanted.
fn part(frame: &Particles, is_wanted: fn(i64) -> bool) -> Particles {
    let rows = frame.ids.iter().zip(&frame.positions).filter(|(id, _)| is_wanted(**id));
    let (ids, positions) = rows.map(|(id, position)| (*id, *position)).unzip();
    Particles { ids, positions, velocities: Vec::new() }
}

/// Cells of r beside those of r / 2.
fn cells(cores: usize, spot: &[Particles]) {
    title(
        &format!(
            "Cells of the particles' surface. The ball as above; {FIRST} frames of spot_drop: how far vertices are from \
             the distance that they keep, from a surface triangulated on r / 4."
        ),
        "cell | phi, distance (s, like the dragon, 1 thread) | ball: mean, p95, max (r) | \
         spot_drop: mean, p95, max (r) | flagged",
    );
    let ctx = context(cores);
    let (dragon, ball) = (ball_of(EXAMPLES[0].1, EXAMPLES[0].2), ball(10.0, 40, 0.25));
    for (name, cell) in [("r", 1.0), ("r / 2 (thesis)", 0.5)] {
        let params = Params { cell, ..Params::for_spacing(ball.spacing) };
        let [_, phi, distance, _] = phase_times(1, &dragon, params, 3);
        let (_, errors) = follow(&ctx, &ball, params, 100, once_around);
        let turned = text([errors.mean, errors.p95, errors.most]);
        let own = if spot.is_empty() { "- | -".to_string() } else { tracked(&ctx, spot, cell) };
        println!("| {name} | {phi:.3}, {distance:.3} | {turned} | {own} |");
    }
}

/// How far vertices of spot's mesh are from their distance to the surface (r), and how many are flagged, after the first frames.
fn tracked(ctx: &Context, frames: &[Particles], cell: f64) -> String {
    let file = spot::first().expect("the data");
    let params = Params { cell, ..Params::for_spacing(spot::SPACING) };
    let frames = &frames[..FIRST];
    let mut tracker = Tracker::new(ctx, params, &spot::sculpted(&file), &frames[0]).expect("a tracker");
    for pair in frames.windows(2) {
        tracker.step(ctx, &pair[0], &pair[1], 1.0 / spot::FPS).expect("a step");
    }
    let delta: Vec<f64> = tracker.delta().iter().map(|delta| f64::from(*delta)).collect();
    let kept: Vec<bool> = tracker.flags().iter().map(|flag| !flag).collect();
    let flagged = kept.iter().filter(|kept| !**kept).count();
    let surface = truth(ctx, &frames[frames.len() - 1], spot::SPACING);
    let off = off_distance(&surface, spot::SPACING, tracker.vertices(), &delta, &kept);
    format!("{} | {flagged}", text(off))
}

/// The surface of particles of a spacing (m), on cells finer than those that meshes follow it on.
fn truth(ctx: &Context, particles: &Particles, spacing: f64) -> TriMesh {
    surface_on(ctx, &particles.positions, spacing, 0.25)
}

/// How far vertices that are kept are from their distance to a surface (r).
fn off_distance(
    surface: &TriMesh,
    spacing: f64,
    vertices: &[DVec3],
    delta: &[f64],
    kept: &[bool],
) -> [f64; 3] {
    let positions: Vec<Vec3> = vertices.iter().map(|position| position.cast()).collect();
    let found = distances(surface, &positions, 0.25 * spacing);
    let known = (0..positions.len()).filter(|vertex| kept[*vertex] && !delta[*vertex].is_nan());
    spread(known.map(|vertex| (found[vertex] - delta[vertex].abs()).abs() / spacing).collect())
}

/// A mesh and the particles that it follows.
struct Set<'a> {
    name: &'a str,
    spacing: f64,
    mesh: TriMesh,
    frames: &'a [Particles],
    /// How far the mesh lies beside its position at the first frame, when its distances are known (m).
    aside: DVec3,
    /// Where vertices should be at the last frame, if that is known.
    image: Option<fn(DVec3, usize) -> DVec3>,
}

impl<'a> Set<'a> {
    fn of(ball: &Ball, name: &'a str, frames: &'a [Particles]) -> Self {
        let (spacing, mesh) = (ball.spacing, ball.mesh.clone());
        Self { name, spacing, mesh, frames, aside: DVec3::zeros(), image: None }
    }
}

/// Projection along normals and by Eq. 2.1 beside ours.
fn projections(cores: usize, spot: &[Particles]) {
    title(
        &format!(
            "Projection. A ball with ripples of 0.25 r, 3 r long, turns half around in 50 frames; for one frame it \
             lies 0.3 r beside its particles, which rest; {FIRST} frames of spot_drop. Off their distance: vertices that \
             the last frame projected, from a surface triangulated on r / 4."
        ),
        "set | projection | off their image: mean, p95, max (r) | off their distance: mean, p95, max (r) | \
         not projected (% of vertices and frames) | triangles turned over, in all frames",
    );
    let ball = rippled();
    let at = |frame| numbered(ball.positions.iter().map(|position| once_around(*position, frame)).collect());
    let frames: Vec<Particles> = (0..=50).map(at).collect();
    let rest = [frames[0].clone(), frames[0].clone()];
    compare(cores, &Set { image: Some(once_around), ..Set::of(&ball, "ball, turns", &frames) });
    let aside = DVec3::new(1.0, 2.0, -1.5).normalize() * (0.3 * ball.spacing);
    compare(cores, &Set { aside, ..Set::of(&ball, "ball, aside", &rest) });
    if let Some(file) = spot::first() {
        let (mesh, frames) = (spot::sculpted(&file), &spot[..FIRST]);
        let (name, spacing, aside, image) = ("spot_drop", spot::SPACING, DVec3::zeros(), None);
        compare(cores, &Set { name, spacing, mesh, frames, aside, image });
    }
}

/// A ball whose mesh has one vertex at each position, and ripples short enough for normals that do not lead to the surface.
fn rippled() -> Ball {
    let mut out = ball(10.0, 60, 0.0);
    let size = 10.0 * out.spacing;
    for position in &mut out.mesh.positions {
        let unit = position.cast::<f64>().normalize();
        let wave = (20.0 * unit.x).sin() * (20.0 * unit.y).sin() * (20.0 * unit.z).sin();
        *position = (unit * (size + 0.25 * wave * out.spacing)).cast();
    }
    let firsts = coincident(out.mesh.positions.iter().map(|position| position.cast()));
    for vertex in out.mesh.triangles.as_flattened_mut() {
        *vertex = firsts[*vertex as usize];
    }
    out.mesh = out.mesh.without_unused();
    out
}

/// Distances from the particles' surface, on cells of r / 2.
fn signed(ctx: &Context, particles: &Particles, params: Params) -> Distances {
    let cell = params.cell * params.spacing;
    let phi = Implicit::new(ctx, &particles.positions, params.spacing, cell).expect("a surface");
    Distances::new(ctx, &phi, &Isosurface::new(&phi), (REACH / params.cell) as f32).expect("distances")
}

fn compare(cores: usize, set: &Set<'_>) {
    let ctx = context(cores);
    let params = Params::for_spacing(set.spacing);
    let begin: Vec<DVec3> = set.mesh.positions.iter().map(|position| position.cast()).collect();
    let delta = measured(&signed(&ctx, &set.frames[0], params), &begin);
    let aside: Vec<DVec3> = begin.iter().map(|position| position + set.aside).collect();
    let mut followers =
        WAYS.map(|(_, project)| Follower::new(project, &set.mesh, aside.clone(), delta.clone()));
    for pair in set.frames.windows(2) {
        let distances = signed(&ctx, &pair[1], params);
        for follower in &mut followers {
            follower.step(&ctx, &params, [&pair[0], &pair[1]], 1.0 / spot::FPS, &distances);
        }
    }
    let steps = set.frames.len() - 1;
    let surface = truth(&ctx, &set.frames[steps], set.spacing);
    for ((name, _), follower) in WAYS.iter().zip(&followers) {
        let image = set.image.map_or("-".to_string(), |image| {
            let pairs = follower.vertices.iter().zip(&begin);
            let off = pairs.map(|(vertex, position)| (vertex - image(*position, steps)).norm() / set.spacing);
            text(spread(off.collect()))
        });
        let Follower { vertices, delta, is_placed, missed, turned_over, .. } = follower;
        let off = text(off_distance(&surface, set.spacing, vertices, delta, is_placed));
        let missed = 100.0 * *missed as f64 / (steps * vertices.len()) as f64;
        println!("| {} | {name} | {image} | {off} | {missed:.3} | {turned_over} |", set.name);
    }
}
