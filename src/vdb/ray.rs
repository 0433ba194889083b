//! Rays against level sets.

use super::bridge::ffi;
use super::{FloatGrid, call, fail};
use crate::base::{DVec3, Vec3};
use crate::context::Context;
use crate::error::Result;

/// A ray in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts (m).
    pub origin: DVec3,
    /// Where it goes; a unit vector.
    pub direction: DVec3,
}

/// Where a ray meets the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray (m).
    pub distance: f32,
    /// Outward unit normal.
    pub normal: Vec3,
}

/// First hits of rays with a level set's surface, in the order of the rays.
///
/// # Errors
/// When the grid is no level set with uniform cells or holds nothing; cancel.
pub fn cast(ctx: &Context, grid: &FloatGrid, rays: &[Ray]) -> Result<Vec<Option<Hit>>> {
    let flat: Vec<f64> = rays
        .iter()
        .flat_map(|ray| {
            [ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y, ray.direction.z]
        })
        .collect();
    let mut hits: Vec<ffi::Hit> =
        rays.iter().map(|_| ffi::Hit { distance: f32::INFINITY, normal: [0.0; 3] }).collect();
    let (call, _running) = call(ctx);
    ffi::cast_rays(&grid.inner, &call, &flat, &mut hits).map_err(fail)?;
    let found = |hit: ffi::Hit| {
        hit.distance.is_finite().then(|| Hit { distance: hit.distance, normal: Vec3::from(hit.normal) })
    };
    Ok(hits.into_iter().map(found).collect())
}
