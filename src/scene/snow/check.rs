//! Looks at every input of every frame of a scene, and computes nothing else.

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

/// What a scene will do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames a second.
    pub fps: f64,
    /// Least and greatest x and z of the snow (m), where it is known before it is made.
    pub area_m: Option<[f64; 4]>,
    /// Edge of a voxel (m).
    pub cell_m: f64,
    /// The objects.
    pub objects: Vec<ObjectReport>,
    /// The grains, where the scene has some and its base is there.
    pub grains: Option<Forecast>,
    /// The mist, where the scene has some.
    pub mist: Option<MistForecast>,
    /// Memory that the run needs, about (bytes); without mist, and without grains that are not known yet.
    pub memory_bytes: u64,
    /// Space that its files need, about (bytes); without mist, and without grains that are not known yet.
    pub disk_bytes: Option<u64>,
    /// What looks wrong, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in: `snow.cell`, `object[1].scale`.
    pub settings: BTreeMap<String, Value>,
}

/// What an object does over the shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Its file.
    pub file: String,
    /// collide, base or grains.
    pub role: &'static str,
    /// Its triangles.
    pub triangles: usize,
    /// Open loops that are closed; those that share a vertex count once.
    pub closed_loops: usize,
    /// Holes at the first frame, counted as `frazil mesh check` does.
    pub holes: usize,
    /// Edges where its triangles do not agree about inside and outside.
    pub contradictions: usize,
    /// Width, height and depth at the first frame (m).
    pub size_m: [f64; 3],
    /// Least and greatest position over the shot (m).
    pub bounds_m: [[f64; 3]; 2],
    /// Greatest speed of a vertex on its way from frame to frame (m/s), and the frame that ends that step.
    pub fastest_m_per_s: f64,
    /// See [`ObjectReport::fastest_m_per_s`].
    pub fastest_frame: i32,
    /// First and last frame at which its bounds touch the snow's.
    pub touches: Option<[i32; 2]>,
    /// How deep it goes, where the ground is known and it comes over it.
    pub deepest: Option<Deepest>,
    /// How its clip must be carried.
    pub walk: Option<Walk>,
}

/// The position of an object that lies lowest against the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deepest {
    /// Frame at which it is there.
    pub frame: i32,
    /// Its y (m).
    pub y_m: f64,
    /// How far it is above the ground (m); negative below it.
    pub above_ground_m: f64,
    /// How deep it is under the snow's top (m); negative above it.
    pub below_top_m: f64,
}

/// Checks a scene whose inputs are open; `folder` is that of its output, whose base says how many grains there will be, and
/// whose mist how far it spreads.
///
/// # Errors
/// A frame that cannot be read or fits no other; a damaged record of the base; cancel.
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
