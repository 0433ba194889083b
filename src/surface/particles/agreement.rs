//! Checks whether ids, velocities and positions of two frames of particles agree: ids may be row numbers, which denote other particles in
//! every frame, and velocities may be in another unit.

use std::collections::{HashMap, HashSet};

use super::paths::Paths;
use crate::error::Result;
use crate::geometry::coords::{around, cell_of};
use crate::geometry::{Coord, DVec3};
use crate::surface::Particles;
use crate::surface::report::StepReport;

/// Maximum number of particles that are sampled.
const SAMPLES: usize = 2000;
/// If the median relative displacement of neighbouring particles in a frame is over this (spacings), ids do not identify them: in a
/// splashing dam break it is 0.2.
const TOO_FAR_APART: f64 = 1.0;
/// Distance (spacings) up to which particles are neighbours.
const BESIDE: f64 = 1.5;
/// Velocities are wrong if more than this fraction of the particles miss: they find no other particle where their velocity takes them.
const MISSED: f64 = 0.5;
/// If more than the first fraction of the particles miss, factors on the velocities are tried; the best one is reported if it divides that
/// fraction by more than the second number.
const SOME_MISSED: [f64; 2] = [0.05, 4.0];
/// Factors between units: feet, ten, inches, centimetres and millimetres. Of equally good factors the first is taken: very small velocities
/// leave all particles within the liquid, where none miss.
const FACTORS: [f64; 10] =
    [0.3048, 1.0 / 0.3048, 0.1, 10.0, 0.0254, 1.0 / 0.0254, 0.01, 100.0, 0.001, 1000.0];

/// A sentence that describes how the particles of two frames, which are `dt` (s) apart, contradict each other; their spacing is `spacing`
/// (m). None if they do not, or if a frame has no particles.
///
/// # Errors
/// Neither ids in both frames nor velocities in the first.
pub fn disagreement(from: &Particles, to: &Particles, dt: f64, spacing: f64) -> Result<Option<String>> {
    if from.positions.is_empty() || to.positions.is_empty() {
        return Ok(None);
    }
    let paths = Paths::between(from, to, dt)?;
    if let Some(warning) = paths.mismatch.and_then(|mismatch| mismatch.sentence(spacing)) {
        return Ok(Some(warning));
    }
    if from.ids.is_empty() || to.ids.is_empty() {
        return Ok(velocities_miss(from, to, dt, spacing));
    }
    Ok(median_separation(&paths, spacing).filter(|separation| *separation > TOO_FAR_APART).map(|separation| {
        format!(
            "by their ids, neighbouring particles move apart by {separation:.2} spacings in a frame (median): are ids row numbers, which \
             refer to other particles in each frame?"
        )
    }))
}

/// Adds a warning to a step's report if over half of the mesh was lost or rebuilt, with a possible reason in the particles: `lost` of its
/// `all` vertices did not find the particles' surface. There is no warning if much of the liquid itself has disappeared or is new.
///
/// # Errors
/// As [`disagreement`].
pub(in crate::surface) fn warn_of_lost_mesh(
    report: &mut StepReport,
    (lost, all): (usize, usize),
    (from, to, dt): (&Particles, &Particles, f64),
    spacing: f64,
) -> Result<()> {
    let [old, new] = [from, to].map(|frame| frame.positions.len());
    let warnings = &mut report.mesh_warnings;
    if 2 * lost > all && 2 * report.died <= old && 3 * new >= 2 * old {
        warnings.push(format!("{lost} of the mesh's {all} vertices did not find the particles' surface"));
    }
    if let Some(change) = report.change.as_ref().filter(|_| 2 * report.born <= new && 2 * new <= 3 * old) {
        let (made, triangles) = (change.rebuilt_triangles(), change.triangles.len());
        if 2 * made > triangles {
            warnings.push(format!("{made} of the mesh's {triangles} triangles were made anew"));
        }
    }
    if !warnings.is_empty() && report.particle_warning.is_none() {
        report.particle_warning = disagreement(from, to, dt, spacing)?;
    }
    Ok(())
}

/// Median relative displacement (spacings) of neighbouring particles.
fn median_separation(paths: &Paths, spacing: f64) -> Option<f64> {
    let (mut from, mut to) = (Vec::new(), Vec::new());
    paths.at(0.0, &mut from);
    paths.at(1.0, &mut to);
    let edge = BESIDE * spacing;
    let bin = |position: &DVec3| cell_of(&(position / edge));
    let sampled = samples(from.len());
    let mut near: HashMap<Coord, Vec<usize>> =
        sampled.clone().flat_map(|at| around(bin(&from[at]))).map(|cell| (cell, Vec::new())).collect();
    for (at, position) in from.iter().enumerate() {
        if let Some(list) = near.get_mut(&bin(position)) {
            list.push(at);
        }
    }
    let separation = |at: usize| {
        let others = around(bin(&from[at])).into_iter().filter_map(|cell| near.get(&cell)).flatten();
        let beside = others
            .filter(|other| **other != at)
            .map(|other| ((from[*other] - from[at]).norm(), *other))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
            .filter(|(distance, _)| *distance <= edge)?;
        Some(((to[at] - from[at]) - (to[beside.1] - from[beside.1])).norm() / spacing)
    };
    let mut all: Vec<f64> = sampled.filter_map(separation).collect();
    if all.is_empty() {
        return None;
    }
    let middle = all.len() / 2;
    Some(*all.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A warning that velocities take particles to where there are no others.
fn velocities_miss(from: &Particles, to: &Particles, dt: f64, spacing: f64) -> Option<String> {
    let bin = |position: &DVec3| cell_of(&(position / spacing));
    let filled = |frame: &Particles| -> HashSet<Coord> { frame.positions.iter().map(bin).collect() };
    let (old, new) = (filled(from), filled(to));
    // Tested forward from the first frame, and backward from the second.
    let missed = |frame: &Particles, other: &HashSet<Coord>, time: f64| {
        let goes = |at: usize| frame.positions[at] + DVec3::from(frame.velocities[at].map(f64::from)) * time;
        let is_missed = |at: &usize| !around(bin(&goes(*at))).iter().any(|cell| other.contains(cell));
        let sampled = samples(frame.positions.len());
        sampled.clone().filter(is_missed).count() as f64 / sampled.count() as f64
    };
    let share = |factor: f64| {
        let ahead = missed(from, &new, factor * dt);
        let back = if to.velocities.is_empty() { ahead } else { missed(to, &old, -factor * dt) };
        ahead.max(back)
    };
    let own = share(1.0);
    if own <= SOME_MISSED[0] {
        return None;
    }
    let (best, factor) =
        FACTORS.map(|factor| (share(factor), factor)).into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let percent = 100.0 * own;
    if best * SOME_MISSED[1] < own {
        return Some(format!(
            "velocities take {percent:.0} % of the particles to where no others are a frame later; with velocities {factor:.4} times as \
             large it would be {:.0} %: are they in another unit?",
            100.0 * best
        ));
    }
    (own > MISSED).then(|| {
        format!(
            "velocities take {percent:.0} % of the particles to where no others are a frame later: are they in another unit, or for \
             another frame rate?"
        )
    })
}

/// A subset of `count` particles, evenly spaced.
fn samples(count: usize) -> impl Iterator<Item = usize> + Clone {
    (0..count).step_by(count.div_ceil(SAMPLES).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::shell;

    const DT: f64 = 1.0 / 24.0;

    /// A ball of particles, 0.1 m apart, that falls and rotates at a frame, with its velocities times a factor.
    fn ball(frame: i32, factor: f64) -> Particles {
        let time = f64::from(frame) * DT;
        let (turn, fall) = (2.0 * time, DVec3::new(0.3, -1.0 - 4.9 * time, 0.0) * time);
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        let turned = |p: DVec3| DVec3::new(c * p.x + s * p.z, p.y, c * p.z - s * p.x);
        let first = shell(DVec3::zeros(), 0.0, 6.3);
        let positions: Vec<DVec3> = first.iter().map(|p| turned(p * 0.1) + fall).collect();
        let speed = |p: &DVec3| {
            let arm = p - fall;
            (DVec3::new(2.0 * arm.z, 0.0, -2.0 * arm.x) + DVec3::new(0.3, -1.0 - 9.8 * time, 0.0)) * factor
        };
        let velocities = positions.iter().map(|p| speed(p).cast::<f32>().into()).collect();
        Particles { ids: (0..positions.len() as i64).collect(), positions, velocities }
    }

    fn warning(from: &Particles, to: &Particles) -> Option<String> {
        disagreement(from, to, DT, 0.1).unwrap()
    }

    fn without_ids(particles: &Particles) -> Particles {
        Particles { ids: Vec::new(), ..particles.clone() }
    }

    fn without_velocities(particles: &Particles) -> Particles {
        Particles { velocities: Vec::new(), ..particles.clone() }
    }

    #[test]
    fn particles_that_agree_raise_no_warning() {
        for frame in 0..12 {
            let (from, to) = (ball(frame, 1.0), ball(frame + 1, 1.0));
            assert_eq!(warning(&from, &to), None);
            assert_eq!(warning(&without_ids(&from), &without_ids(&to)), None);
            assert_eq!(warning(&without_velocities(&from), &without_velocities(&to)), None);
            assert_eq!(warning(&from, &Particles::default()), None);
        }
    }

    #[test]
    fn velocities_in_another_unit_are_reported_with_their_factor() {
        for factor in [100.0, 0.01, 3.28084] {
            let (from, to) = (ball(3, factor), ball(4, factor));
            let what = warning(&from, &to).unwrap();
            let (before, _) = what.split_once(" times as large").unwrap();
            let factor_found: f64 = before.rsplit(' ').next().unwrap().parse().unwrap();
            // Paths of rotating particles are curved.
            assert!(
                (factor_found / factor - 1.0).abs() < 1e-3 || (factor_found - factor).abs() < 6e-4,
                "{what}"
            );
        }
        for (factor, words) in [(100.0, "0.0100 times"), (1000.0, "0.0010 times")] {
            let what = warning(&without_ids(&ball(3, factor)), &without_ids(&ball(4, factor))).unwrap();
            assert!(what.contains(words), "{what}");
        }
    }

    #[test]
    fn ids_that_are_rows_are_reported() {
        // The particles in the first rows are removed, so that all others move up, or rows come in any order.
        let rows = |from: &Particles, to: &Particles| {
            let shifted = |frame: &Particles, by: usize| {
                let count = frame.positions.len() - by;
                Particles {
                    positions: frame.positions[by..].to_vec(),
                    velocities: frame.velocities.get(by..).unwrap_or_default().to_vec(),
                    ids: (0..count as i64).collect(),
                }
            };
            let mixed = |frame: &Particles| {
                let count = frame.positions.len();
                let row = |n: usize| (n * 7919 + 13) % count;
                Particles {
                    positions: (0..count).map(|n| frame.positions[row(n)]).collect(),
                    ..frame.clone()
                }
            };
            [(shifted(from, 0), shifted(to, 29)), (from.clone(), mixed(to))]
        };
        let (from, to) = (ball(3, 1.0), ball(4, 1.0));
        for (from, to) in rows(&from, &to) {
            let what = warning(&from, &to).unwrap();
            assert!(what.contains("row numbers"), "{what}");
        }
        let (_, mixed) = &rows(&without_velocities(&from), &without_velocities(&to))[1];
        let what = warning(&without_velocities(&from), mixed).unwrap();
        assert!(what.contains("row numbers"), "{what}");
    }
}
