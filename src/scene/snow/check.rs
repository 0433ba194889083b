//! Checks every input of every frame of a scene, without simulating.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::estimate::{disk, memory};
use super::inspect::foot_slip::Walk;
use super::inspect::object_path::Course;
use super::inspect::relief::Relief;
use super::{Forecast, Inputs, MistForecast, has_grains, has_mist};
use crate::context::Context;
use crate::error::Result;
use crate::scene::run::Stored;
use crate::scene::{Layer, Scene, Value};
use crate::snow::base_layer::initial::thin;

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
    /// The grains, if the scene has some and its base exists.
    pub grains: Option<Forecast>,
    /// The mist, if the scene has some.
    pub mist: Option<MistForecast>,
    /// Estimated memory of the run (bytes); without mist, and without grains whose number is not known yet.
    pub memory_bytes: u64,
    /// Estimated size of its files (bytes); without mist, and without grains whose number is not known yet.
    pub disk_bytes: Option<u64>,
    /// Probable mistakes, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in: `snow.cell`, `object[1].scale`.
    pub settings: BTreeMap<String, Value>,
}

/// Summary of an object over the shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Its file.
    pub file: String,
    /// collide, base or grains.
    pub role: &'static str,
    /// Its triangles.
    pub triangles: usize,
    /// Open loops that are closed; loops that share a vertex count once.
    pub closed_loops: usize,
    /// Holes at the first frame, counted as in `frazil mesh check`.
    pub holes: usize,
    /// Edges where its triangles disagree on inside and outside.
    pub contradictions: usize,
    /// Width, height and depth at the first frame (m).
    pub size_m: [f64; 3],
    /// Minimum and maximum position over the shot (m).
    pub bounds_m: [[f64; 3]; 2],
    /// Maximum speed of a vertex between two frames (m/s), and the frame that ends that step.
    pub fastest_m_per_s: f64,
    /// See [`ObjectReport::fastest_m_per_s`].
    pub fastest_frame: i32,
    /// First and last frame at which its bounds touch the snow's.
    pub touches: Option<[i32; 2]>,
    /// Its depth, if the ground is known and the object comes over it.
    pub deepest: Option<Deepest>,
    /// How its clip must be carried.
    pub walk: Option<Walk>,
}

/// The lowest position of an object relative to the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deepest {
    /// Frame of that position.
    pub frame: i32,
    /// Its y (m).
    pub y_m: f64,
    /// Height above the ground (m); negative below it.
    pub above_ground_m: f64,
    /// Depth below the snow's top (m); negative above it.
    pub below_top_m: f64,
}

/// Checks a scene whose inputs are open; `folder` is its output folder: the base there tells how many grains there will be, and the mist
/// how far it spreads.
///
/// # Errors
/// A frame that cannot be read or does not match the others; a damaged record of the base; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs, folder: Option<&Path>) -> Result<Report> {
    let mut warnings = inputs.warnings.clone();
    if let Layer::Depth(depth) = inputs.snow.layer {
        warnings.extend(thin(depth, inputs.snow.cell));
    }
    let relief = Relief::new(inputs);
    let mut objects = Vec::new();
    let courses = Course::all(ctx, scene, inputs)?;
    for course in &courses {
        let report = course.report(relief.as_ref())?;
        warnings.extend(course.warnings(ctx, &report)?);
        objects.push(report);
    }
    warnings.extend(inputs.far_static(scene));
    if objects.is_empty() {
        warnings.push("nothing moves through the snow: no object has the role collide".into());
    }
    let grains = match folder.filter(|_| has_grains(&scene.values)) {
        Some(folder) => Forecast::of(scene, inputs, &Stored::read(folder, "base")?, scene.shot.frames.last)?,
        None => None,
    };
    let mist = folder.filter(|_| has_mist(&scene.values));
    let mist = mist.map(|folder| Stored::read(folder, "mist")).transpose()?;
    let mist = MistForecast::of(ctx, scene, &courses, mist.as_ref())?;
    let (memory, disk) = match &grains {
        Some(grains) => {
            let volumes = memory::of_volumes(scene, inputs, grains.grains)?;
            (grains.memory_bytes.max(volumes), grains.disk_bytes)
        }
        None => (0, 0),
    };
    Ok(Report {
        frames: [scene.shot.frames.first, scene.shot.frames.last],
        fps: scene.shot.fps,
        area_m: inputs.area(),
        cell_m: inputs.snow.cell,
        objects,
        grains,
        mist,
        memory_bytes: memory::estimate(scene, inputs)?.max(memory),
        disk_bytes: Some(disk::estimate(scene, inputs) + disk),
        warnings,
        settings: scene.values.by_path(),
    })
}
