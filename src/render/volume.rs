//! Level sets and fog volumes as surfaces to be drawn.

use super::model::Model;
use super::shade::SNOW;
use crate::base::{TriMesh, Vec3};
use crate::context::Context;
use crate::error::Result;
use crate::vdb::{FloatGrid, level_set};

impl Model {
    /// A level set with the colour of snow.
    ///
    /// # Errors
    /// A cancel, or what OpenVDB reports.
    pub fn level_set(ctx: &Context, grid: &FloatGrid) -> Result<Self> {
        let mesh = level_set::to_mesh(ctx, grid, 0.0, 0.0)?;
        let normals = smooth_normals(&mesh);
        Ok(Self::new(mesh, Some(normals), SNOW, 0.5 * grid.voxel_size()))
    }

    /// A fog volume with the colour of snow: the surface where its density is half of the greatest; and that density.
    ///
    /// # Errors
    /// A cancel, or what OpenVDB reports.
    pub fn fog(ctx: &Context, grid: &FloatGrid) -> Result<(Self, f32)> {
        let leaves = grid.leaves()?;
        let stored = leaves.iter().map(|leaf| leaf.values.iter().copied().fold(0.0, f32::max));
        let half = 0.5 * stored.fold(0.0, f32::max);
        if half == 0.0 {
            return Ok((Self::new(TriMesh::default(), None, SNOW, grid.voxel_size()), half));
        }
        // Densities fall outward where distances rise: the triangles look inward.
        let mesh = level_set::to_mesh(ctx, grid, half, 0.0)?.reversed();
        let normals = smooth_normals(&mesh);
        Ok((Self::new(mesh, Some(normals), SNOW, 0.5 * grid.voxel_size()), half))
    }
}

/// The mean of the triangles' normals around each vertex, weighted by area.
fn smooth_normals(mesh: &TriMesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        let area = (b - a).cross(&(c - a));
        for index in triangle {
            normals[*index as usize] += area;
        }
    }
    normals.iter().map(|normal| normal.try_normalize(0.0).unwrap_or_else(Vec3::y)).collect()
}
