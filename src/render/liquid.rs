//! Thin liquids: partly transparent, with a glossy surface.

use super::model::{Hit, Model, smooth_normals};
use super::shade::{Colour, Light, gloss};
use crate::geometry::{DVec3, TriMesh};

/// Maximum number of liquid surfaces that a ray passes.
pub(super) const MAX_FILMS: usize = 8;
/// Opacity at which the sheen of a liquid is full; it fades towards the thin rim.
const FULL_SHEEN_OPACITY: f64 = 0.05;

impl Model {
    /// The surface of a liquid with a colour (linear red, green, blue, 0 to 1) and an opacity per vertex, 0 to 1. It is smooth, casts no
    /// shadow, and is glossy.
    pub fn liquid(mesh: &TriMesh, albedo: [f32; 3], opacities: Vec<f32>) -> Self {
        let mut model = Self::mesh(mesh, albedo);
        model.normals = Some(smooth_normals(mesh));
        model.opacities = Some(opacities);
        model
    }
}

/// Light from a liquid's surface: its own (`surface`), the light from below that it transmits, and reflections; and the share of the light
/// from below that it transmits, 0 to 1.
pub(super) fn shade_liquid(
    light: &Light,
    hit: &Hit,
    opacity: f64,
    [surface, below]: [Colour; 2],
    toward: DVec3,
    blocked: impl Fn(DVec3) -> bool,
) -> (Colour, f64) {
    let body = below.lerp(&surface, opacity);
    let (reflectance, mirrored) = gloss(light, hit.normal, toward, blocked);
    let sheen = (opacity / FULL_SHEEN_OPACITY).min(1.0);
    let refracted = 1.0 - reflectance * sheen;
    (body * refracted + mirrored * sheen, (1.0 - opacity) * refracted)
}
