//! Gates of detail over whole sequences, with the settings that scenes have by default: what was sculpted is still there in every frame
//! where the liquid has neither broken nor stretched up to then. Whether it has is read off the particles alone, by their ids, and the
//! detail off the mesh alone, as what smoothing takes away; neither asks the tracker.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{Params, Particles, Tracker};

use crate::bins::Bins;
use crate::common::liquids::{Ball, ball, context, numbered, once_around};
use crate::common::shapes::welded;
use crate::harness::Harness;
use crate::scenes::wanted_data;
use crate::surface::rebuilt_sequences::spot_drop;
use crate::surface::spot::{detail, neighbours, regression};

/// Least count of particles in a part of the mesh, as scenes have it.
const MIN_DROP: usize = 8;
/// Particles within so much of each other at the first frame are neighbours; those farther than this were apart (spacings).
const NEAR: f64 = 2.0;
const APART: f64 = 4.0;
/// Liquid has kept its shape while the distances of a particle from its neighbours have changed by less than this, in the mean.
const STRAIN: f64 = 0.1;
/// A vertex lies in liquid that has kept its shape if all particles within so much of where it was at the first frame have (spacings).
const AROUND: f64 = 2.0;
/// Frames in which the ball turns once.
const TURN: usize = 100;

pub fn run(h: &mut Harness) {
    let ctx = context(2);
    let names = ["surface.detail_kept_cache", "surface.detail_kept_cache_gain"];
    if wanted_data(h, &names, "particles/spot_drop/spot.0001.bgeo").is_some() {
        h.measure_all(names, || {
            let cache = spot_drop().expect("the data");
            let frames: Vec<Particles> = (0..cache.frames).map(|frame| by_id(cache.at(frame))).collect();
            report(&kept(&ctx, &cache.mesh, &frames, cache.spacing, cache.dt))
        });
    }
    h.measure_all(["surface.detail_kept_turned", "surface.detail_kept_turned_gain"], || {
        let Ball { spacing, positions, mesh } = ball(8.0, 40, 0.25);
        let at = |frame| numbered(positions.iter().map(|position| once_around(*position, frame)).collect());
        let frames: Vec<Particles> = (0..=TURN).map(at).collect();
        report(&kept(&ctx, &welded(&mesh), &frames, spacing, 1.0 / 24.0))
    });
}

/// How much of the detail is left in a frame.
struct Left {
    /// Share of the vertices of the first frame whose liquid has kept its shape, and of these, those that are there.
    calm: f64,
    there: f64,
    /// Over all of these, those that are gone as flat.
    correlation: f64,
    gain: f64,
}

/// Correlation of the detail with that of the first frame, and by how much its size is off: the worst frames.
fn report(all: &[Left]) -> [(f64, String); 2] {
    for (frame, left) in (2..).zip(all).filter(|(frame, _)| frame % 5 == 1) {
        println!(
            "# frame {frame}: the liquid of {:.1} % has kept its shape; of these {:.2} % are there, correlation {:.4}, gain {:.4}",
            100.0 * left.calm,
            100.0 * left.there,
            left.correlation,
            left.gain
        );
    }
    let frames = (2..).zip(all);
    let (at, least) =
        frames.clone().min_by(|a, b| a.1.correlation.total_cmp(&b.1.correlation)).expect("frames");
    let note = format!("the worst of {} frames: {at}, {:.2} % are there", all.len(), 100.0 * least.there);
    let off = |left: &Left| (left.gain - 1.0).abs();
    let (at, worst) = frames.max_by(|a, b| off(a.1).total_cmp(&off(b.1))).expect("frames");
    let of_gain = format!("a gain of {:.4} in the worst frame, {at}", worst.gain);
    [(least.correlation, note), (off(worst), of_gain)]
}

/// Particles in the order of their ids.
fn by_id(particles: Particles) -> Particles {
    let mut order: Vec<usize> = (0..particles.ids.len()).collect();
    order.sort_unstable_by_key(|at| particles.ids[*at]);
    Particles {
        positions: order.iter().map(|at| particles.positions[*at]).collect(),
        ids: order.iter().map(|at| particles.ids[*at]).collect(),
        velocities: Vec::new(),
    }
}

/// What is left of the detail in each frame after the first.
fn kept(ctx: &Context, mesh: &TriMesh, frames: &[Particles], spacing: f64, dt: f64) -> Vec<Left> {
    let first = &frames[0];
    assert!(frames.iter().all(|frame| frame.ids == first.ids), "particles are born or die");
    let bins = Bins::new(&first.positions, NEAR * spacing);
    let mut neighbours_of = vec![Vec::new(); first.positions.len()];
    for (own, position) in neighbours_of.iter_mut().zip(&first.positions) {
        bins.near(position, |other| own.push((other, (first.positions[other] - position).norm())));
        own.retain(|(_, far)| *far > 0.0);
    }
    let mut around = vec![Vec::new(); mesh.positions.len()];
    let of_vertices = Bins::new(&first.positions, AROUND * spacing);
    for (own, position) in around.iter_mut().zip(&mesh.positions) {
        of_vertices.near(&position.cast(), |particle| own.push(particle));
    }
    let params = Params { rebuild: true, min_drop: MIN_DROP, ..Params::for_spacing(spacing) };
    let mut tracker = Tracker::new(ctx, params, mesh, first).expect("a tracker");
    let before = detail(mesh, &neighbours(mesh));
    // The vertex of the first frame that each one is, and whether particles have been among the same ones all along.
    let mut origins: Vec<Option<u32>> = (0..mesh.positions.len() as u32).map(Some).collect();
    let mut is_calm = vec![true; first.positions.len()];
    let mut out = Vec::new();
    for pair in frames.windows(2) {
        let report = tracker.step(ctx, &pair[0], &pair[1], dt).expect("a step");
        if let Some(change) = report.change {
            origins = change.origins.iter().map(|at| at.and_then(|at| origins[at as usize])).collect();
        }
        shaken(&pair[1].positions, &neighbours_of, &first.positions, spacing, &mut is_calm);
        let is_whole = |own: &Vec<usize>| !own.is_empty() && own.iter().all(|particle| is_calm[*particle]);
        let mesh = tracker.mesh();
        let now = detail(&mesh, &neighbours(&mesh));
        let mut left: Vec<Option<f64>> = vec![None; before.len()];
        for (at, detail) in origins.iter().zip(&now) {
            if let Some(at) = at {
                left[*at as usize] = Some(*detail);
            }
        }
        let calm: Vec<usize> = (0..before.len()).filter(|vertex| is_whole(&around[*vertex])).collect();
        let pairs: Vec<[f64; 2]> =
            calm.iter().map(|vertex| [before[*vertex], left[*vertex].unwrap_or(0.0)]).collect();
        let there = calm.iter().filter(|vertex| left[**vertex].is_some()).count();
        let [correlation, gain] = regression(&pairs);
        let share = |part: usize, of: usize| part as f64 / of as f64;
        let (there, calm) = (share(there, calm.len()), share(calm.len(), before.len()));
        out.push(Left { calm, there, correlation, gain });
    }
    out
}

/// Marks the particles whose neighbours have moved away or nearer, or among which others have come.
fn shaken(
    now: &[DVec3],
    neighbours: &[Vec<(usize, f64)>],
    first: &[DVec3],
    spacing: f64,
    is_calm: &mut [bool],
) {
    let bins = Bins::new(now, NEAR * spacing);
    for particle in 0..now.len() {
        if !is_calm[particle] {
            continue;
        }
        let change = |(other, far): &(usize, f64)| ((now[*other] - now[particle]).norm() / far - 1.0).abs();
        let own = &neighbours[particle];
        let strain = own.iter().map(change).sum::<f64>() / own.len().max(1) as f64;
        let mut is_met = false;
        bins.near(&now[particle], |other| {
            is_met |= (first[other] - first[particle]).norm() > APART * spacing;
        });
        is_calm[particle] = strain < STRAIN && !is_met;
    }
}
