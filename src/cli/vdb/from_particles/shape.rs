//! The surface of one frame: a mesh, and the matching level set.

use clap::ValueEnum;
use frazil::geometry::{DVec3, TriMesh};
use frazil::surface::{
    Distances, HALF_WIDTH, Implicit, Isosurface, is_sphere_radius, level_set, smooth, spheres,
};
use frazil::sweep::{Settings, voxelise};
use frazil::vdb::FloatGrid;
use frazil::vdb::level_set::to_mesh;
use frazil::{Error, Result};

use crate::cli::session::Session;
use crate::cli::vdb::check_surface;

/// Method that makes a surface of particles.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Method {
    /// Smooth, half a spacing above the outermost particles, without bridges between parts far from each other
    Solenthaler,
    /// The union of spheres around the particles
    Spheres,
}

/// The parameters of a surface.
#[derive(Clone, Copy)]
pub struct SurfaceParams {
    pub method: Method,
    /// Initial distance between particles (m).
    pub spacing: f64,
    /// Edge of a cell (m).
    pub cell: f64,
    /// Radius of the spheres (m).
    pub radius: f64,
    /// Passes of smoothing.
    pub passes: u32,
}

impl SurfaceParams {
    /// The surface of particles at positions (m), with its level set if requested; both are empty without particles.
    pub fn surface(
        &self,
        session: &Session,
        positions: &[DVec3],
        wants_grid: bool,
    ) -> Result<(TriMesh, Option<FloatGrid>)> {
        if positions.is_empty() {
            let grid = if wants_grid { Some(FloatGrid::level_set(self.cell, HALF_WIDTH)?) } else { None };
            return Ok((TriMesh::default(), grid));
        }
        let (mut mesh, grid) = match self.method {
            Method::Solenthaler => self.solenthaler(session, positions, wants_grid && self.passes == 0)?,
            // Inside a union the spheres' own values are not distances.
            Method::Spheres => (self.union(session, positions)?, None),
        };
        if self.passes > 0 {
            session.ctx.phase("smooth", || smooth(&session.ctx, &mut mesh, self.passes))?;
        }
        let grid = match grid {
            None if wants_grid => Some(level_set_of(session, mesh.clone(), self.cell)?),
            grid => grid,
        };
        Ok((mesh, grid))
    }

    fn union(&self, session: &Session, positions: &[DVec3]) -> Result<TriMesh> {
        let (ctx, radius, cell) = (&session.ctx, self.radius, self.cell);
        if !is_sphere_radius(radius, cell) {
            let cells = radius / cell;
            return Err(Error::argument(format!(
                "--radius {radius} m is {cells:.3} cells of {cell} m, and must be 1.5 to 100 cells; --cell sets them"
            )));
        }
        let grid = ctx.phase("spheres", || spheres(ctx, positions, radius, cell))?;
        ctx.phase("mesh", || to_mesh(ctx, &grid, 0.0, 0.0))
    }

    /// Distances are exact, to the triangles that become the mesh.
    fn solenthaler(
        &self,
        session: &Session,
        positions: &[DVec3],
        wants_grid: bool,
    ) -> Result<(TriMesh, Option<FloatGrid>)> {
        let ctx = &session.ctx;
        let phi = ctx.phase("phi", || Implicit::new(ctx, positions, self.spacing, self.cell))?;
        let surface = ctx.phase("mesh", || Ok(Isosurface::new(&phi)))?;
        let mesh = surface.mesh(&phi);
        if !wants_grid {
            return Ok((mesh, None));
        }
        let distances = ctx.phase("distance", || Distances::new(ctx, &phi, &surface, HALF_WIDTH))?;
        let grid = ctx.phase("grid", || level_set(ctx, &distances))?;
        Ok((mesh, Some(grid)))
    }
}

/// The level set of the solid that a mesh bounds, on cells of this edge (m); an empty one for an empty mesh.
fn level_set_of(session: &Session, mesh: TriMesh, cell: f64) -> Result<FloatGrid> {
    if mesh.triangles.is_empty() {
        return FloatGrid::level_set(cell, HALF_WIDTH);
    }
    check_surface(session, mesh.area(), cell)?;
    let settings = Settings { half_width: HALF_WIDTH, ..Settings::new(cell) };
    voxelise(&session.ctx, mesh, &settings)
}
