//! The path of each particle from one frame to the next.
//!
//! Particles are matched by id, since files order them differently in each frame. With velocities a path is a cubic Hermite curve,
//! otherwise a line. Without ids the displacement is the velocity times the time.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::surface::Particles;

/// The paths of particles that exist in both frames.
#[derive(Debug, Default)]
pub struct Paths {
    from: Vec<DVec3>,
    to: Vec<DVec3>,
    /// Velocities times the time between the frames (m), at both ends; empty: paths are lines.
    tangents: Vec<[DVec3; 2]>,
    /// Rank of each path, which orders particles at the same position.
    ranks: Vec<i64>,
    /// How velocities disagree with positions, if they do: velocities are then ignored.
    pub mismatch: Option<VelocityMismatch>,
    /// Count of particles that exist only in the first frame, and of those that exist only in the second.
    pub died: usize,
    /// See `died`.
    pub born: usize,
}

/// Velocities are used if they predict the end points with a median error of at most this fraction of the median displacement.
const TRUSTED: f64 = 0.5;

impl Paths {
    /// Paths from one frame to the next, `dt` (s) later. If the second has no particles, those of the first continue with their velocities,
    /// if they have any.
    ///
    /// # Errors
    /// Neither ids in both frames nor velocities in the first.
    pub fn between(from: &Particles, to: &Particles, dt: f64) -> Result<Self> {
        let (died, born) = (from.positions.len(), to.positions.len());
        if died == 0 || born == 0 && from.velocities.is_empty() {
            return Ok(Self { died, born, ..Self::default() });
        }
        if born == 0 {
            return Ok(Self { died, ..Self::by_velocity(from, dt)? });
        }
        if from.ids.is_empty() || to.ids.is_empty() {
            return Self::by_velocity(from, dt);
        }
        let sorted = |ids: &[i64]| {
            let mut order: Vec<(i64, u32)> = ids.iter().copied().zip(0..).collect();
            order.par_sort_unstable();
            order
        };
        let (old, new) = (sorted(&from.ids), sorted(&to.ids));
        let mut out = Self::default();
        let has_velocities = !from.velocities.is_empty() && !to.velocities.is_empty();
        let tangent =
            |frame: &Particles, at: u32| DVec3::from(frame.velocities[at as usize].map(f64::from)) * dt;
        let mut next = 0;
        for (id, at) in old {
            while new.get(next).is_some_and(|(other, _)| *other < id) {
                next += 1;
            }
            let Some((_, then)) = new.get(next).filter(|(other, _)| *other == id) else {
                out.died += 1;
                continue;
            };
            out.from.push(from.positions[at as usize]);
            out.to.push(to.positions[*then as usize]);
            out.ranks.push(id);
            if has_velocities {
                out.tangents.push([tangent(from, at), tangent(to, *then)]);
            }
        }
        out.born = to.positions.len() - out.from.len();
        out.mismatch = out.find_mismatch();
        if out.mismatch.is_some() {
            out.tangents.clear();
        }
        Ok(out)
    }

    fn by_velocity(from: &Particles, dt: f64) -> Result<Self> {
        if from.velocities.is_empty() {
            return Err(Error::argument(
                "particles have neither ids in both frames nor velocities: their motion is unknown",
            ));
        }
        let displacements = from.velocities.iter().map(|velocity| DVec3::from(velocity.map(f64::from)) * dt);
        let to = from
            .positions
            .iter()
            .zip(displacements)
            .map(|(position, displacement)| position + displacement)
            .collect();
        let ranks = vec![0; from.positions.len()];
        Ok(Self { from: from.positions.clone(), to, ranks, ..Self::default() })
    }

    /// The mismatch between velocities and positions, such as that of another unit or frame rate; none if velocities can be trusted.
    fn find_mismatch(&self) -> Option<VelocityMismatch> {
        let mean_tangent = |n: usize| (self.tangents[n][0] + self.tangents[n][1]) * 0.5;
        let displacement = |n: usize| self.to[n] - self.from[n];
        let median = |of: &dyn Fn(usize) -> f64| {
            let mut all: Vec<f64> = (0..self.tangents.len()).map(of).collect();
            let middle = all.len() / 2;
            if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f64::total_cmp).1 }
        };
        let end_distance = median(&|n| (mean_tangent(n) - displacement(n)).norm());
        let by_ids = median(&|n| displacement(n).norm());
        if end_distance <= TRUSTED * by_ids {
            return None;
        }
        let by_velocities = median(&|n| mean_tangent(n).norm());
        let cosine = median(&|n| {
            let lengths = mean_tangent(n).norm() * displacement(n).norm();
            if lengths > 0.0 { mean_tangent(n).dot(&displacement(n)) / lengths } else { 0.0 }
        });
        Some(VelocityMismatch { by_ids, by_velocities, end_distance, cosine })
    }

    /// Count of paths.
    pub fn count(&self) -> usize {
        self.from.len()
    }

    /// Rank of a path, which orders particles at the same position.
    pub fn rank(&self, path: u32) -> i64 {
        self.ranks[path as usize]
    }

    /// Maximum displacement of a particle, or maximum length of a tangent if that is larger (m).
    pub fn max_displacement(&self) -> f64 {
        let each = (0..self.count()).into_par_iter().with_min_len(4096);
        each.map(|n| {
            let displacement = (self.to[n] - self.from[n]).norm();
            self.tangents.get(n).map_or(displacement, |[a, b]| displacement.max(a.norm()).max(b.norm()))
        })
        .reduce(|| 0.0, f64::max)
    }

    /// Positions (m) at a fraction 0..=1 of the time.
    pub fn at(&self, share: f64, out: &mut Vec<DVec3>) {
        let position = |n: usize| {
            let (from, to) = (self.from[n], self.to[n]);
            match self.tangents.get(n) {
                // The ends are exact.
                _ if share <= 0.0 => from,
                _ if share >= 1.0 => to,
                None => from + (to - from) * share,
                Some([a, b]) => {
                    let (s, s2, s3) = (share, share * share, share * share * share);
                    from + (to - from) * (3.0 * s2 - 2.0 * s3) + a * (s3 - 2.0 * s2 + s) + b * (s3 - s2)
                }
            }
        };
        (0..self.count()).into_par_iter().with_min_len(4096).map(position).collect_into_vec(out);
    }
}

/// The particles between two frames of a cache that are `dt` (s) apart, at a fraction 0..1 of the time: those that exist in both, and those
/// that exist only in the first, which continue with their velocities.
///
/// # Errors
/// Neither ids in both frames nor velocities in the first.
pub fn interpolate(from: &Particles, to: &Particles, dt: f64, share: f64) -> Result<Particles> {
    if from.positions.is_empty() {
        return Ok(Particles::default());
    }
    if to.positions.is_empty() && from.velocities.is_empty() {
        return Ok(from.clone());
    }
    if from.ids.is_empty() || to.ids.is_empty() {
        let mut positions = Vec::new();
        Paths::by_velocity(from, dt)?.at(share, &mut positions);
        return Ok(Particles { positions, ..from.clone() });
    }
    let paths = Paths::between(from, to, dt)?;
    let mut out = Particles { ids: paths.ranks.clone(), ..Particles::default() };
    paths.at(share, &mut out.positions);
    let row = |frame: &Particles| -> HashMap<i64, usize> { frame.ids.iter().copied().zip(0..).collect() };
    let (old, new) = (row(from), row(to));
    if !from.velocities.is_empty() && !to.velocities.is_empty() {
        let velocity = |id: &i64| {
            let (a, b) = (from.velocities[old[id]], to.velocities[new[id]]);
            [0, 1, 2].map(|axis| a[axis] + (b[axis] - a[axis]) * share as f32)
        };
        out.velocities = paths.ranks.iter().map(velocity).collect();
    }
    for (row, id) in from.ids.iter().enumerate().filter(|(_, id)| !new.contains_key(id)) {
        let velocity = from.velocities.get(row).copied().unwrap_or_default();
        out.positions.push(from.positions[row] + DVec3::from(velocity.map(f64::from)) * (dt * share));
        out.ids.push(*id);
        if !out.velocities.is_empty() {
            out.velocities.push(velocity);
        }
    }
    Ok(out)
}

/// Displacements of the particles of a frame by their ids and by their velocities (m, medians over the particles).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityMismatch {
    /// Length of the displacements by ids.
    pub by_ids: f64,
    /// Length of the displacements by velocities.
    pub by_velocities: f64,
    /// Distance between the end points of both.
    pub end_distance: f64,
    /// Cosine of the angle between the two displacements.
    pub cosine: f64,
}

impl VelocityMismatch {
    /// End points up to this far apart (spacings) raise no warning: jitter of particles at rest.
    const STILL: f64 = 0.5;
    /// Above this cosine both have the same direction: only the length of the velocities is wrong.
    const ALIGNED: f64 = 0.9;

    /// A warning for particles with this spacing (m); none if ids and velocities agree closely enough.
    pub fn sentence(&self, spacing: f64) -> Option<String> {
        if self.end_distance <= Self::STILL * spacing {
            return None;
        }
        let [ids, velocities] = [self.by_ids, self.by_velocities].map(|length| length / spacing);
        let why = if self.cosine > Self::ALIGNED {
            format!(
                "velocities are {:.3} times as large as they should be: are they in another unit, or for another frame rate?",
                self.by_velocities / self.by_ids.max(f64::MIN_POSITIVE)
            )
        } else {
            "are ids row numbers, which refer to other particles in each frame?".to_string()
        };
        Some(format!(
            "ids and velocities contradict each other: the median distance that particles travel in a frame is {ids:.2} spacings by \
             their ids, and {velocities:.2} by their velocities; {why}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(ids: &[i64], x: &[f64], speed: f32) -> Particles {
        Particles {
            positions: x.iter().map(|x| DVec3::new(*x, 0.0, 0.0)).collect(),
            velocities: vec![[speed, 0.0, 0.0]; x.len()],
            ids: ids.to_vec(),
        }
    }

    #[test]
    fn particles_are_matched_by_id() {
        let from = frame(&[7, 3, 9], &[0.0, 1.0, 2.0], 10.0);
        let to = frame(&[9, 5, 7], &[3.0, 0.0, 1.0], 10.0);
        let paths = Paths::between(&from, &to, 0.1).unwrap();
        assert_eq!((paths.count(), paths.died, paths.born), (2, 1, 1));
        let mut positions = Vec::new();
        paths.at(0.5, &mut positions);
        assert!((positions[0].x - 0.5).abs() < 1e-12 && (positions[1].x - 2.5).abs() < 1e-12);
        assert_eq!(paths.max_displacement(), 1.0);
    }

    #[test]
    fn a_frame_may_have_no_particles() {
        let some = frame(&[7, 3], &[0.0, 1.0], 10.0);
        let none = Particles::default();
        let away = Paths::between(&some, &none, 0.1).unwrap();
        assert_eq!((away.count(), away.died, away.born), (2, 2, 0));
        assert_eq!(away.max_displacement(), 1.0, "they go on");
        let back = Paths::between(&none, &some, 0.1).unwrap();
        assert_eq!((back.count(), back.died, back.born), (0, 0, 2));
        let still = Particles { velocities: Vec::new(), ..some.clone() };
        assert_eq!(Paths::between(&still, &none, 0.1).unwrap().count(), 0);
        assert_eq!(interpolate(&none, &some, 0.1, 0.5).unwrap(), none);
        assert_eq!(interpolate(&still, &none, 0.1, 0.5).unwrap(), still);
        assert_eq!(interpolate(&some, &none, 0.1, 0.5).unwrap().positions[1].x, 1.5);
    }

    #[test]
    fn without_ids_velocities_count_and_without_both_nothing_does() {
        let from = frame(&[], &[0.0, 1.0], 10.0);
        let mut positions = Vec::new();
        Paths::between(&from, &from, 0.1).unwrap().at(1.0, &mut positions);
        assert_eq!(positions[1].x, 2.0);
        let none = Particles { velocities: Vec::new(), ..from };
        assert!(Paths::between(&none, &none, 0.1).is_err());
    }

    #[test]
    fn between_two_frames_all_particles_of_the_first_are_there() {
        let from = frame(&[7, 3, 9], &[0.0, 1.0, 2.0], 10.0);
        let to =
            Particles { velocities: vec![[20.0, 0.0, 0.0]; 3], ..frame(&[9, 5, 7], &[3.0, 0.0, 1.5], 0.0) };
        let half = interpolate(&from, &to, 0.1, 0.5).unwrap();
        assert_eq!(half.ids, [7, 9, 3]);
        assert!((half.positions[2].x - 1.5).abs() < 1e-12, "one that ends moves on");
        assert_eq!(half.velocities, [[15.0, 0.0, 0.0], [15.0, 0.0, 0.0], [10.0, 0.0, 0.0]]);
        let without = |frame: &Particles| Particles { ids: Vec::new(), ..frame.clone() };
        let half = interpolate(&without(&from), &without(&to), 0.1, 0.5).unwrap();
        assert_eq!(half.positions[1].x, 1.5);
    }

    #[test]
    fn velocities_that_contradict_the_positions_are_left_out() {
        let (from, to) = (frame(&[1], &[0.0], 500.0), frame(&[1], &[1.0], 500.0));
        let mut positions = Vec::new();
        Paths::between(&from, &to, 0.1).unwrap().at(0.5, &mut positions);
        assert_eq!(positions[0].x, 0.5);
    }
}
