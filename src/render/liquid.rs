//! Thin liquids: what lies below is visible where they are not opaque, and their surface is glossy.

use super::model::{Hit, Model, smooth_normals};
use super::shade::{Colour, Light, gloss};
use crate::geometry::{DVec3, TriMesh};

/// Maximum number of liquid surfaces that a ray passes.
pub(super) const MOST_FILMS: usize = 8;
/// Opacity from which the sheen of a liquid is full; it fades towards the dry rim.
const SHEEN_FROM: f64 = 0.05;

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

/// Light from a liquid's surface: its own, what it transmits from below, and what it mirrors.
pub(super) fn wet(
    light: &Light,
    hit: &Hit,
    opacity: f64,
    [own, below]: [Colour; 2],
    toward: DVec3,
    blocked: impl Fn(DVec3) -> bool,
) -> Colour {
    let body = below.lerp(&own, opacity);
    let (share, mirrored) = gloss(light, hit.normal, toward, blocked);
    let sheen = (opacity / SHEEN_FROM).min(1.0);
    body * (1.0 - share * sheen) + mirrored * sheen
}
