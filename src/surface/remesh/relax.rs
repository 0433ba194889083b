//! Vertices created in this frame move along the surface toward the middle of their neighbours: edges and angles become even.

use super::shape::{is_upright, min_angle};
use super::vertex_rings::VertexRings;
use crate::geometry::DVec3;
use crate::geometry::shape::normal;

/// Fraction of the displacement to the neighbours' middle that a vertex moves at once.
const SHARE: f64 = 0.5;

impl VertexRings<'_, '_> {
    /// The relaxed position along the surface of a vertex created in this frame; none if nothing is gained, or the vertex must stay.
    pub fn relaxed(&self, vertex: u32) -> Option<DVec3> {
        let fan = self.around(vertex);
        if self.has_origin(vertex) || fan.is_empty() {
            return None;
        }
        let position = self.position(vertex);
        let (mut sum, mut across) = (DVec3::zeros(), DVec3::zeros());
        for &triangle in fan {
            let corners = self.corners(triangle);
            if self.is_whole(triangle) || corners.iter().any(|&corner| self.is_flagged(corner)) {
                return None;
            }
            // Each neighbour is shared by two triangles.
            sum += corners.iter().map(|&corner| self.position(corner)).sum::<DVec3>() - position;
            across += normal(&self.positions(triangle));
        }
        let across = across.try_normalize(0.0)?;
        let offset = sum / (2.0 * fan.len() as f64) - position;
        let to = position + (offset - across * across.dot(&offset)) * SHARE;
        let (mut before, mut after) = (f64::INFINITY, f64::INFINITY);
        for &triangle in fan {
            let old = self.positions(triangle);
            let new = self
                .corners(triangle)
                .map(|corner| if corner == vertex { to } else { self.position(corner) });
            if !is_upright(&old, &new) {
                return None;
            }
            (before, after) = (before.min(min_angle(&old)), after.min(min_angle(&new)));
        }
        (after > before).then_some(to)
    }
}
