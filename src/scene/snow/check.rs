//! Checks every input of every frame of a scene, without simulating.

pub use crate::scene::snow::inspect::object_path::ObjectReport;
use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::estimate::peak::{Counts, peak};
use super::estimate::removed::removed_snow;
use super::estimate::{disk, memory};
use super::inspect::object_path::ObjectPath;
use super::inspect::relief::Relief;
use super::{Forecast, Inputs, MistForecast, has_grains, has_mist};
use crate::context::Context;
use crate::error::Result;
use crate::scene::run::DoneFrames;
use crate::scene::{Layer, Scene, Value};
use crate::snow::base_layer::initial::thin_warning;

/// Summary of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames per second.
    pub fps: f64,
    /// Minimum and maximum x and z of the snow (m), if known before it is made.
    pub area_m: Option<[f64; 4]>,
    /// Edge of a voxel (m).
    pub cell_m: f64,
    /// The objects.
    pub objects: Vec<ObjectReport>,
    /// The grains, if the scene has some, and the heights of its snow are known or its base exists.
    pub grains: Option<Forecast>,
    /// The mist, if the scene has some.
    pub mist: Option<MistForecast>,
    /// Bound of the run's memory (bytes), by which it is refused; without mist, and without grains whose number is not known yet.
    pub memory_bytes: u64,
    /// Memory that the run is expected to take at its peak (bytes), with mist; without grains whose number is not known yet.
    pub memory_forecast_bytes: u64,
    /// Estimated size of its files (bytes); without mist, and without grains whose number is not known yet.
    pub disk_bytes: Option<u64>,
    /// Probable mistakes, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in: `snow.cell`, `object[1].scale`.
    pub settings: BTreeMap<String, Value>,
}

/// Checks a scene whose inputs are open. `folder` is its output folder: the number of grains is estimated from the base there, if it exists,
/// and the extent of mist from the mist there.
///
/// # Errors
/// A frame that cannot be read or does not match the others; a damaged record of the base; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs, folder: Option<&Path>) -> Result<Report> {
    let mut warnings = inputs.warnings.clone();
    if let Layer::Depth(depth) = inputs.snow.layer {
        warnings.extend(thin_warning(depth, inputs.snow.cell));
    }
    let relief = Relief::new(inputs);
    let mut objects = Vec::new();
    let paths = ObjectPath::all(ctx, scene, inputs)?;
    for path in &paths {
        let report = path.report(relief.as_ref())?;
        warnings.extend(path.warnings(ctx, &report)?);
        objects.push(report);
    }
    warnings.extend(inputs.far_static(scene));
    if objects.is_empty() {
        warnings
            .push("nothing moves through the snow: no object has the role collide, base or grains".into());
    }
    let grains = match has_grains(&scene.values) {
        true => {
            Forecast::of(scene, inputs, &removed_snow(ctx, scene, inputs, folder, &paths, relief.as_ref())?)?
        }
        false => None,
    };
    let mist = folder.filter(|_| has_mist(&scene.values));
    let mist = mist.map(|folder| DoneFrames::read(folder, "mist")).transpose()?;
    let mist = MistForecast::of(ctx, scene, &paths, mist.as_ref())?;
    let memory =
        grains.as_ref().map(|grains| memory::with_grains(scene, inputs, grains.grains)).transpose()?;
    let disk = grains.as_ref().map_or(0, |grains| grains.disk_bytes);
    let counts = Counts {
        grains: grains.as_ref().map_or(0, |grains| grains.grains),
        cells: mist.as_ref().map_or(0, |mist| mist.cells),
    };
    Ok(Report {
        frames: [scene.shot.frames.first, scene.shot.frames.last],
        fps: scene.shot.fps,
        area_m: inputs.area(),
        cell_m: inputs.snow.cell,
        objects,
        grains,
        mist,
        memory_bytes: memory::estimate(scene, inputs)?.max(memory.unwrap_or_default()),
        memory_forecast_bytes: peak(scene, inputs, &counts)?,
        disk_bytes: Some(disk::estimate(scene, inputs) + disk),
        warnings,
        settings: scene.values.by_path(),
    })
}
