//! Looks at every input of every frame of a scene with `[surface]`, and computes nothing else.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Inputs;
use super::inputs::all_files;
use super::time::read;
use crate::base::DVec3;
use crate::context::Context;
use crate::error::Result;
use crate::scene::{Scene, Value};
use crate::surface::Particles;

/// What a scene will do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames a second.
    pub fps: f64,
    /// Count of files of particles.
    pub files: usize,
    /// Least and greatest count of particles in a file.
    pub particles: [usize; 2],
    /// Whether they have ids, and velocities, in all files.
    pub has_ids: bool,
    /// See `has_ids`.
    pub has_velocities: bool,
    /// Least and greatest place of a particle over the shot (m).
    pub particles_bounds_m: [[f64; 3]; 2],
    /// Initial distance between particles (m).
    pub spacing_m: f64,
    /// Vertices and triangles of the mesh.
    pub vertices: usize,
    /// See `vertices`.
    pub triangles: usize,
    /// Width, height and depth of the mesh at the first frame (m).
    pub size_m: [f64; 3],
    /// Length of its edges in the mean (m).
    pub edge_m: f64,
    /// Space that the files need, about (bytes).
    pub disk_bytes: u64,
    /// What looks wrong, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in.
    pub settings: BTreeMap<String, Value>,
}

/// Edges longer than this (spacings) are too coarse for what the particles do.
const LONG_EDGE: f64 = 2.0;

/// Checks a scene whose inputs are open.
///
/// # Errors
/// A file that cannot be read, or that has no particles; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs) -> Result<Report> {
    let (surface, shot) = (scene.surface()?, scene.shot);
    let mut warnings = inputs.warnings.clone();
    let (mut low, mut high) = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
    let (mut least, mut most) = (usize::MAX, 0);
    let (mut has_ids, mut has_velocities) = (true, true);
    let files = all_files(scene, surface);
    for path in &files {
        ctx.check()?;
        let Particles { places, velocities, ids } = read(path, surface, &inputs.seen)?;
        (least, most) = (least.min(places.len()), most.max(places.len()));
        has_ids &= !ids.is_empty();
        has_velocities &= !velocities.is_empty();
        (low, high) = places.iter().fold((low, high), |(low, high), p| (low.inf(p), high.sup(p)));
    }
    let mesh = &inputs.mesh.mesh;
    let (from, to) = mesh.bounds().unwrap_or_default();
    let (from, to) = (from.cast::<f64>(), to.cast::<f64>());
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let length =
        |[a, b]: [u32; 2]| f64::from((mesh.positions[a as usize] - mesh.positions[b as usize]).norm());
    let edge = edges.map(length).sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64;
    let spacing = inputs.spacing;
    if edge > LONG_EDGE * spacing {
        warnings.push(format!(
            "the mesh's edges are {edge:.4} m long, particles {spacing:.4} m apart: a mesh that coarse cannot follow them closely"
        ));
    }
    if let Some(share) = outside(&inputs.particles.places, from, to, spacing) {
        warnings.push(format!(
            "{:.0} % of the first frame's particles lie outside of the mesh's bounds: are both in the same space and unit?",
            100.0 * share
        ));
    }
    if !has_ids && !has_velocities {
        warnings
            .push("some files have neither ids nor velocities: where their particles go is not known".into());
    }
    let count = shot.frames.count() as u64;
    Ok(Report {
        frames: [shot.frames.first, shot.frames.last],
        fps: shot.fps,
        files: files.len(),
        particles: [least, most],
        has_ids,
        has_velocities,
        particles_bounds_m: [low.into(), high.into()],
        spacing_m: spacing,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        size_m: (to - from).into(),
        edge_m: edge,
        disk_bytes: count * bytes_of_frame(scene, inputs)?,
        warnings,
        settings: scene.values.by_path(),
    })
}

/// Share of places outside of a box by more than two spacings, where it is a tenth or more.
fn outside(places: &[DVec3], low: DVec3, high: DVec3, spacing: f64) -> Option<f64> {
    let margin = DVec3::repeat(2.0 * spacing);
    let is_outside = |place: &&DVec3| {
        let (below, above) = (low - margin - *place, *place - high - margin);
        below.max() > 0.0 || above.max() > 0.0
    };
    let share = places.iter().filter(is_outside).count() as f64 / places.len() as f64;
    (share >= 0.1).then_some(share)
}

/// Bytes of a number in text, with what stands around it.
const TEXT: u64 = 12;

/// What a frame takes, about.
fn bytes_of_frame(scene: &Scene, inputs: &Inputs) -> Result<u64> {
    let output = scene.surface()?.output;
    let detail = &inputs.mesh;
    let [vertices, triangles] = [detail.mesh.positions.len(), detail.mesh.triangles.len()].map(|n| n as u64);
    let own: u64 = detail.arrays.iter().map(|array| (array.values.len() * array.number.size()) as u64).sum();
    let of_vertex =
        12 + 12 * u64::from(output.velocities) + 4 * u64::from(output.delta) + u64::from(output.flagged);
    let uvs = detail.uvs.as_ref().map_or(0, |uvs| match uvs.corners {
        Some(_) => 25 * triangles,
        None => 8 * vertices,
    });
    let ply = vertices * of_vertex + triangles * 13 + own + uvs;
    let obj = TEXT * (3 * vertices + 2 * triangles);
    let usd = TEXT * (6 * vertices + 3 * triangles);
    // The exact state: places in 64 bits, distances, flags.
    let state = 29 * vertices;
    Ok(state + ply * u64::from(output.ply) + obj * u64::from(output.obj) + usd * u64::from(output.usd))
}
