//! The thesis' swept volume (section 3.2): the union of N + 1 sampled poses, dilated, then smoothed.
//! A baseline for tests and benchmarks; with `samples = 1`, neither dilated nor smoothed, it is Fig. 3.3a.

use super::Body;
use crate::context::Context;
use crate::error::{Error, Result, fail_if};
use crate::geometry::{TriMesh, Vec3};
use crate::vdb::{FloatGrid, level_set};

/// Parameters of the thesis' swept volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplesSettings {
    /// Cell size (m).
    pub voxel: f64,
    /// Half width of the narrow band (cells).
    pub half_width: f32,
    /// N: poses are taken at t + n dt / N, n = 0..=N.
    pub samples: u32,
    /// Dilation before smoothing (cells); compensates for the shrinkage of smoothing. 0: none.
    pub dilate: f32,
    /// Number of Gaussian smoothing passes with a width of one cell. 0: none.
    pub smooth: u32,
    /// Accuracy of the dilation and smoothing.
    pub scheme: level_set::Scheme,
}

impl SamplesSettings {
    /// Eight samples, dilated by one cell and smoothed once, with OpenVDB's default scheme.
    pub fn new(voxel: f64) -> Self {
        Self { voxel, half_width: 3.0, samples: 8, dilate: 1.0, smooth: 1, scheme: level_set::Scheme::Weno5 }
    }

    /// One step per frame (Fig. 3.3a): only the poses at both ends.
    pub fn one_step(voxel: f64) -> Self {
        Self::sub_steps(voxel, 1)
    }

    /// Many sub-steps per frame (Fig. 3.3b), neither dilated nor smoothed.
    pub fn sub_steps(voxel: f64, steps: u32) -> Self {
        Self { samples: steps, dilate: 0.0, smooth: 0, ..Self::new(voxel) }
    }
}

/// Level set of the union of sampled poses, dilated and smoothed.
///
/// # Errors
/// No object, no sample, a pose that cannot be computed, cancel.
pub fn samples(
    ctx: &Context,
    bodies: &[Body],
    from: f64,
    to: f64,
    settings: &SamplesSettings,
) -> Result<FloatGrid> {
    fail_if(settings.samples == 0, || Error::argument("samples = 0: a sampled sweep needs at least 1"))?;
    let mut union: Option<FloatGrid> = None;
    for body in bodies {
        let mut pose = Vec::new();
        for sample in 0..=settings.samples {
            let time = from + (to - from) * f64::from(sample) / f64::from(settings.samples);
            body.motion().pose(time, &mut pose)?;
            let positions: Vec<Vec3> = pose.iter().map(|position| position.cast()).collect();
            let mesh = TriMesh { positions, triangles: body.motion().triangles().to_vec() };
            let solid = level_set::from_mesh(ctx, &mesh, settings.voxel, settings.half_width)?;
            match &mut union {
                Some(union) => level_set::union(ctx, union, solid)?,
                None => union = Some(solid),
            }
        }
    }
    let mut swept = union.ok_or_else(|| Error::argument("a sweep needs at least one object"))?;
    if settings.dilate > 0.0 {
        level_set::offset(ctx, &mut swept, settings.dilate * settings.voxel as f32, settings.scheme)?;
    }
    if settings.smooth > 0 {
        level_set::gaussian_filter(ctx, &mut swept, 1, settings.smooth, settings.scheme)?;
    }
    Ok(swept)
}
