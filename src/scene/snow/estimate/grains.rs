//! Forecast of the count, memory and disk space of grains before the first one is made: from the snow that the base's reports say is removed,
//! or, where the base does not exist yet, that objects would remove.

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

/// Forecast of the grains of a shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forecast {
    /// The last frame that is counted.
    pub to_frame: i32,
    /// The last frame whose removed snow is known from the base; that of later frames is estimated from the poses of objects.
    pub base_to_frame: Option<i32>,
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

/// Snow removed in each frame from a shot's first one on (m3).
#[derive(Default)]
pub(in crate::scene::snow) struct Removed {
    volumes: Vec<f64>,
    /// How many of the frames are known from the base.
    by_base: usize,
}

impl Removed {
    /// Up to `last`, from the reports of a base; ends at the first missing frame or report.
    ///
    /// # Errors
    /// A damaged report.
    pub fn by_base(scene: &Scene, base: &DoneFrames, last: i32) -> Result<Self> {
        let mut volumes = Vec::new();
        for frame in scene.shot.frames.first..=last {
            let report = if base.is_done(frame) { base.report(frame)? } else { None };
            let Some(volume) = report.as_ref().and_then(|report| report.get("removed_m3")?.as_f64()) else {
                break;
            };
            volumes.push(volume);
        }
        let by_base = volumes.len();
        Ok(Self { volumes, by_base })
    }

    /// With the frames that are not known from the base, by an estimate of all frames (m3).
    pub fn and_estimated(mut self, estimated: &[f64]) -> Self {
        self.volumes.extend(estimated.iter().skip(self.by_base));
        self
    }

    /// The volume of each known frame (m3); none for the first one: snow cut out by the first poses was removed before the shot began.
    fn after_first(&self) -> impl Iterator<Item = f64> {
        self.volumes.iter().enumerate().map(|(at, volume)| if at == 0 { 0.0 } else { *volume })
    }

    /// Number of frames of the shot that are not known.
    pub fn missing(&self, scene: &Scene) -> usize {
        scene.shot.frames.count() - self.volumes.len()
    }
}

impl Forecast {
    /// Forecast from the snow that is removed. None if not even the first frame is known.
    ///
    /// # Errors
    /// A file of the layer that cannot be read.
    pub(in crate::scene::snow) fn of(
        scene: &Scene,
        inputs: &Inputs,
        removed: &Removed,
    ) -> Result<Option<Self>> {
        let Some(counts) = counts(scene, inputs, removed) else { return Ok(None) };
        let (first, volumes) = (scene.shot.frames.first, removed.after_first());
        let params = params(scene, inputs.snow.cell);
        let all = compressions(scene, params.compression);
        let compression = minimum(&all, params.compression);
        let grains = counts.iter().copied().fold(0.0, f64::max).round() as u64;
        Ok(Some(Self {
            to_frame: first + (counts.len() - 1) as i32,
            base_to_frame: removed.by_base.checked_sub(1).map(|after| first + after as i32),
            removed_m3: volumes.sum(),
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
        let source = match self.base_to_frame {
            Some(frame) if frame == self.to_frame => "the base",
            _ => "what objects remove",
        };
        format!(
            "{}: {source} up to frame {} makes {}, more than grains.max = {}: a larger grains.radius or \
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

/// Count of grains after each frame whose removed snow is known; `None` if not even that of the first frame is.
pub(in crate::scene::snow) fn counts(scene: &Scene, inputs: &Inputs, removed: &Removed) -> Option<Vec<f64>> {
    let params = params(scene, inputs.snow.cell);
    let compression = minimum(&compressions(scene, params.compression), params.compression);
    let grain = std::f64::consts::PI / 6.0 * (2.0 * params.radius).powi(3);
    let mut born: Vec<f64> =
        removed.after_first().map(|volume| volume * (1.0 - compression) * PACKING / grain).collect();
    *born.first_mut()? +=
        inputs.initial_grains.as_ref().map_or(0.0, |initial| initial.positions.len() as f64);
    let lifetime = params.lifetime.map(|lifetime| (lifetime * scene.shot.fps).ceil() as usize);
    Some(alive(&born, lifetime.unwrap_or(usize::MAX)))
}

/// The compression of each object that removes snow.
fn compressions(scene: &Scene, default: f64) -> Vec<f64> {
    let removers = scene.objects.iter().enumerate().filter(|(_, object)| object.role.removes());
    let of = |index| scene.values.element(OBJECT, index).find("compression");
    removers.map(|(index, _)| of(index).unwrap_or(default)).collect()
}

/// The minimum of some numbers, or the default without any.
fn minimum(of: &[f64], default: f64) -> f64 {
    of.iter().copied().reduce(f64::min).unwrap_or(default)
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
