//! Forecast of the count, memory and disk space of the grains that a base makes, from the base's reports, before the first grain is made.

use serde::Serialize;

use super::{disk, memory};
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::run::DoneFrames;
use crate::scene::schema::declaration::OBJECT;
use crate::scene::snow::Inputs;
use crate::scene::snow::grain_params::params;
use crate::snow::grains::PACKING;

/// Relative error of an estimate of the count of grains.
const ESTIMATE_ERROR: f64 = 0.1;

/// Forecast of the grains from a base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// The last frame of the base that is counted.
    pub to_frame: i32,
    /// Snow removed after the first frame (m3).
    pub removed_m3: f64,
    /// Share of that snow that does not become grains: the minimum over all objects that remove snow.
    pub compression: f64,
    /// Largest count of grains at one time.
    pub grains: u64,
    /// Whether `grains` is an upper bound: objects differ in `compression`, or a `keep_box` removes grains.
    pub at_most: bool,
    /// Memory of the stage (bytes).
    pub memory_bytes: u64,
    /// Disk space of the stage's files and states (bytes).
    pub disk_bytes: u64,
}

impl Forecast {
    /// Forecast from the frames of a base up to `last`; ends at the first missing frame or report. None if that is the first
    /// frame.
    ///
    /// # Errors
    /// A damaged report; a file of the layer that cannot be read.
    pub fn of(scene: &Scene, inputs: &Inputs, base: &DoneFrames, last: i32) -> Result<Option<Self>> {
        let first = scene.shot.frames.first;
        let mut removed = Vec::new();
        for frame in first..=last {
            let report = if base.is_done(frame) { base.report(frame)? } else { None };
            let Some(volume) = report.as_ref().and_then(|report| report.get("removed_m3")?.as_f64()) else {
                break;
            };
            // Snow cut out by the first poses was removed before the shot began.
            removed.push(if frame == first { 0.0 } else { volume });
        }
        if removed.is_empty() {
            return Ok(None);
        }
        let params = params(scene, inputs.snow.cell);
        let removers = scene.objects.iter().enumerate().filter(|(_, object)| object.role.removes());
        let compression_of = |index| scene.values.element(OBJECT, index).find("compression");
        let all: Vec<f64> =
            removers.map(|(index, _)| compression_of(index).unwrap_or(params.compression)).collect();
        let compression = all.iter().copied().reduce(f64::min).unwrap_or(params.compression);
        let grain = std::f64::consts::PI / 6.0 * (2.0 * params.radius).powi(3);
        let grains_of = |volume: f64| volume * (1.0 - compression) * PACKING / grain;
        let mut born: Vec<f64> = removed.iter().map(|volume| grains_of(*volume)).collect();
        born[0] += inputs.initial_grains.as_ref().map_or(0.0, |initial| initial.positions.len() as f64);
        let lifetime = params.lifetime.map(|lifetime| (lifetime * scene.shot.fps).ceil() as usize);
        let counts = alive(&born, lifetime.unwrap_or(usize::MAX));
        let grains = counts.iter().copied().fold(0.0, f64::max).round() as u64;
        Ok(Some(Self {
            to_frame: first + (removed.len() - 1) as i32,
            removed_m3: removed.iter().sum(),
            compression,
            grains,
            at_most: all.iter().any(|other| *other != compression) || params.keep_box.is_some(),
            memory_bytes: memory::of_grains(inputs, grains)?,
            disk_bytes: disk::of_grains(scene, &counts),
        }))
    }

    /// Fails if there would be too many grains, or if they would need too much memory. An upper bound may fail needlessly.
    ///
    /// # Errors
    /// More than `grains.max` by over a tenth, which exceeds the error of estimates; more memory than the limit (bytes).
    pub fn check(&self, scene: &Scene, limit: u64) -> Result<()> {
        if self.grains as f64 > (1.0 + ESTIMATE_ERROR) * max_grains(scene) as f64 {
            return Err(Error::argument(self.too_many(scene)));
        }
        let what = || format!("{}: stage grains with {}", scene.path.display(), self.count());
        Error::check_memory(self.memory_bytes, limit, what)
    }

    /// The warning about an estimate that exceeds `grains.max` by no more than its error.
    pub fn warning(&self, scene: &Scene) -> Option<String> {
        let (grains, max) = (self.grains, max_grains(scene));
        let is_close = grains > max && grains as f64 <= (1.0 + ESTIMATE_ERROR) * max as f64;
        is_close.then(|| self.too_many(scene))
    }

    fn too_many(&self, scene: &Scene) -> String {
        format!(
            "{}: the base up to frame {} makes {}, more than grains.max = {}: a larger grains.radius or \
             grains.compression makes fewer",
            scene.path.display(),
            self.to_frame,
            self.count(),
            max_grains(scene)
        )
    }

    /// "about 30261 grains at once".
    pub fn count(&self) -> String {
        format!("{} {} grains at once", if self.at_most { "at most about" } else { "about" }, self.grains)
    }
}

/// The maximum number of grains of a scene.
fn max_grains(scene: &Scene) -> u64 {
    scene.values.table("grains").get("max")
}

/// Count of grains after each frame, given those born in each and their lifetime in frames.
fn alive(born: &[f64], lifetime: usize) -> Vec<f64> {
    let from = |frame: usize| (frame + 1).saturating_sub(lifetime);
    (0..born.len()).map(|frame| born[from(frame)..=frame].iter().sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_are_there_for_their_lifetime() {
        let born = [1.0, 10.0, 100.0, 0.0];
        assert_eq!(alive(&born, usize::MAX), [1.0, 11.0, 111.0, 111.0]);
        assert_eq!(alive(&born, 2), [1.0, 11.0, 110.0, 100.0]);
        assert_eq!(alive(&born, 1), born);
    }
}
