//! Checks every input of every frame of a scene with `[surface]`, without simulating.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Inputs;
use super::estimate::disk::FrameSize;
use super::estimate::memory::ParticleMaxima;
use super::inputs::all_files;
use super::inputs::particle_times::read;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::scene::{Scene, Value};
use crate::surface::{Particles, disagreement};

/// Summary of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames per second.
    pub fps: f64,
    /// Number of particle files.
    pub files: usize,
    /// Minimum and maximum count of particles in a file; may be 0.
    pub particles: [usize; 2],
    /// Whether all files have ids.
    pub has_ids: bool,
    /// Whether all files have velocities.
    pub has_velocities: bool,
    /// Minimum and maximum position of a particle over the shot (m).
    pub particles_bounds_m: [[f64; 3]; 2],
    /// Initial distance between particles (m).
    pub spacing_m: f64,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Width, height and depth of the mesh at the first frame (m).
    pub size_m: [f64; 3],
    /// Mean length of its edges (m).
    pub edge_m: f64,
    /// Bound of the run's memory (bytes); it may be more if vertices keep a distance of more than half a spacing from
    /// the particles' surface.
    pub memory_bytes: u64,
    /// Memory that the run is expected to take at its peak (bytes).
    pub memory_forecast_bytes: u64,
    /// Estimated size of the files (bytes).
    pub disk_bytes: u64,
    /// Estimated size of the files of a frame (bytes): the mesh, its exact state, report and record.
    pub frame_bytes: u64,
    /// Probable mistakes, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in.
    pub settings: BTreeMap<String, Value>,
}

impl Report {
    /// Fails if the run would need more memory than a limit (bytes).
    ///
    /// # Errors
    /// [`Error::Memory`] names the counts of particles and triangles.
    pub fn check_memory(&self, limit: u64) -> Result<()> {
        let [particles, triangles] = [self.particles[1], self.triangles];
        Error::check_memory(self.memory_bytes, limit, || {
            format!("surface of {particles} particles and {triangles} triangles")
        })
    }
}

/// Edges longer than this (spacings) are too coarse for the motion of the particles.
const LONG_EDGE: f64 = 2.0;

/// Checks a scene whose inputs are open.
///
/// # Errors
/// A file that cannot be read; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs) -> Result<Report> {
    let (surface, shot) = (scene.surface()?, scene.shot);
    let mut warnings = inputs.warnings.clone();
    let mut bounds: Option<[DVec3; 2]> = None;
    let (mut min_count, mut max_count) = (usize::MAX, 0);
    let (mut has_ids, mut has_velocities) = (true, true);
    let files = all_files(scene, surface);
    let (mut before, mut has_warned): (Option<Particles>, bool) = (None, false);
    let mut maxima = ParticleMaxima::default();
    for path in &files {
        ctx.check()?;
        let particles = read(path, surface, &inputs.input_hashes)?;
        ctx.pool().install(|| maxima.add(&particles, inputs.spacing, surface.cell));
        if let Some(before) = before.take().filter(|_| !has_warned) {
            // Particles with neither ids nor velocities are reported below.
            let compared = || disagreement(&before, &particles, 1.0 / shot.fps, inputs.spacing);
            if let Ok(Some(what)) = ctx.pool().install(compared) {
                warnings.push(format!("{}: {what}", path.display()));
                has_warned = true;
            }
        }
        let Particles { positions, velocities, ids } = &particles;
        (min_count, max_count) = (min_count.min(positions.len()), max_count.max(positions.len()));
        has_ids &= !ids.is_empty() || positions.is_empty();
        has_velocities &= !velocities.is_empty() || positions.is_empty();
        bounds = positions.iter().fold(bounds, |bounds, p| {
            let [low, high] = bounds.unwrap_or([*p; 2]);
            Some([low.inf(p), high.sup(p)])
        });
        before = Some(particles);
    }
    let mesh = &inputs.mesh.mesh;
    let (low, high) = mesh.bounds().unwrap_or_default();
    let (low, high) = (low.cast::<f64>(), high.cast::<f64>());
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
    if let Some(share) = outside(&inputs.particles.positions, low, high, spacing) {
        warnings.push(format!(
            "{:.0} % of the first frame's particles lie outside of the mesh's bounds: are both in the same space and unit?",
            100.0 * share
        ));
    }
    if !has_ids && !has_velocities {
        warnings
            .push("some files have neither ids nor velocities: where their particles go is not known".into());
    }
    let (count, frame) =
        (shot.frames.count() as u64, FrameSize::of(surface.output, surface.rebuild, &inputs.mesh));
    let [memory_bytes, memory_forecast_bytes] = maxima.estimate(surface, files.len(), &inputs.mesh, &frame);
    Ok(Report {
        frames: [shot.frames.first, shot.frames.last],
        fps: shot.fps,
        files: files.len(),
        particles: [min_count, max_count],
        has_ids,
        has_velocities,
        particles_bounds_m: bounds.unwrap_or_default().map(Into::into),
        spacing_m: spacing,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        size_m: (high - low).into(),
        edge_m: edge,
        memory_bytes,
        memory_forecast_bytes,
        disk_bytes: count * frame.sum(),
        frame_bytes: frame.sum(),
        warnings,
        settings: scene.values.by_path(),
    })
}

/// Share of positions more than two spacings outside a box, if it is at least a tenth.
fn outside(positions: &[DVec3], low: DVec3, high: DVec3, spacing: f64) -> Option<f64> {
    let margin = DVec3::repeat(2.0 * spacing);
    let is_outside = |position: &&DVec3| {
        let (below, above) = (low - margin - *position, *position - high - margin);
        below.max() > 0.0 || above.max() > 0.0
    };
    let share = positions.iter().filter(is_outside).count() as f64 / positions.len() as f64;
    (share >= 0.1).then_some(share)
}
