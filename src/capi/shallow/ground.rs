//! The ground below shallow liquid, as its handle keeps it.

use std::ops::Range;

use crate::capi::ffi::*;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{TriMesh, Vec3};
use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
use crate::shallow::terrain::facing::facing;
#[cfg(feature = "vdb")]
use crate::shallow::terrain::sampler;
use crate::shallow::terrain::solids::Solid;
use crate::shallow::terrain::triangles::Caster;
use crate::shallow::terrain::{Solids, height};
#[cfg(feature = "vdb")]
use crate::vdb::FloatGrid;

/// What the ground is made from, so that it can be rebuilt.
pub(in crate::capi) enum Terrain {
    Mesh(Box<MovingMesh>),
    /// A height field: the solids of the cells that its last change rebuilt.
    Heights(Vec<[Solid; 1]>),
    /// A level set, which cannot move.
    #[cfg(feature = "vdb")]
    LevelSet,
}

impl Terrain {
    /// The ground of a mesh, and its solids.
    pub(in crate::capi) fn of_mesh(
        ctx: &Context,
        mesh: &TriMesh,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let orientation = facing(mesh);
        let triangles = orientation.applied(&mesh.triangles);
        if orientation.has_open() {
            ctx.warn("the mesh is open: all below its faces that face up is solid");
        }
        if let Some(what) = orientation.warning() {
            ctx.warn(&format!("the mesh: {what}"));
        }
        let mut moving = Box::new(MovingMesh {
            positions: Vec::with_capacity(mesh.positions.len()),
            incoming: mesh.positions.clone(),
            triangles,
            host_triangles: (!orientation.is_unchanged()).then(|| mesh.triangles.clone()),
            caster: Caster::new(grid, heights)?,
        });
        let solids = ctx.phase("cast", || moving.cast(grid, heights))?;
        moving.adopt_incoming();
        Ok((Self::Mesh(moving), solids))
    }

    /// The ground of a height field, which has a height (m) for each cell, and its solids.
    pub(in crate::capi) fn of_heights(
        tops: impl ExactSizeIterator<Item = f32>,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let solids = height::solids(tops.map(f64::from), grid, heights)?;
        Ok((Self::Heights(Vec::with_capacity(grid.cells())), solids))
    }

    /// The ground of a level set, and its solids.
    #[cfg(feature = "vdb")]
    pub(in crate::capi) fn of_level_set(
        ctx: &Context,
        level_set: &FloatGrid,
        grid: Grid,
        heights: Heights,
    ) -> Outcome<(Self, Solids)> {
        let solids = ctx.phase("sample", || {
            let (voxel, between) = (level_set.voxel_size(), level_set.heights());
            sampler::solids(grid, heights, voxel, between, |positions, distances| {
                ctx.check()?;
                level_set.sample_linear(ctx, positions, distances)
            })
        })?;
        Ok((Self::LevelSet, solids))
    }

    /// The mesh, to move it.
    pub(in crate::capi) fn mesh(&mut self) -> Outcome<&mut MovingMesh> {
        match self {
            Self::Mesh(mesh) => Ok(mesh),
            _ => Err(Failure::argument("the liquid was not made with a mesh that could move")),
        }
    }

    /// The solids of a height field, to change it.
    pub(in crate::capi) fn heights(&mut self) -> Outcome<&mut Vec<[Solid; 1]>> {
        match self {
            Self::Heights(solids) => Ok(solids),
            _ => Err(Failure::argument("the liquid was not made on a height field that could change")),
        }
    }

    /// The position (m) on a triangle, given by its index and barycentric coordinates.
    pub(in crate::capi) fn position(&self, (triangle, shares): &(u32, [f64; 3])) -> Outcome<[f64; 3]> {
        let Self::Mesh(mesh) = self else {
            return Err(Failure::argument("the liquid was not made with a mesh: there is no triangle"));
        };
        let own = mesh.host_triangles.as_ref().unwrap_or(&mesh.triangles);
        let Some(corners) = own.get(*triangle as usize) else {
            let count = own.len();
            return Err(Failure::argument(format!(
                "triangle = {triangle} is out of range: the mesh has {count}"
            )));
        };
        let corner = |corner: usize| mesh.positions[corners[corner] as usize].cast::<f64>() * shares[corner];
        Ok((corner(0) + corner(1) + corner(2)).into())
    }
}

/// A mesh whose vertices move.
pub(in crate::capi) struct MovingMesh {
    pub(in crate::capi) positions: Vec<Vec3>,
    /// Positions that a call has read but not yet adopted.
    pub incoming: Vec<Vec3>,
    /// Triangles without duplicates, closed parts facing outward.
    pub(in crate::capi) triangles: Vec<[u32; 3]>,
    /// The host's own triangles, if they differ.
    pub host_triangles: Option<Vec<[u32; 3]>>,
    pub caster: Caster,
}

impl MovingMesh {
    /// The solids of all cells with the incoming vertices.
    pub(in crate::capi) fn cast(&mut self, grid: Grid, heights: Heights) -> Result<Solids> {
        self.caster.cast(&self.incoming, &self.triangles, all_cells(&grid))?;
        let mut solids = Solids::empty(grid, heights);
        (0..grid.cells()).for_each(|cell| solids.push(self.caster.at(cell)));
        Ok(solids)
    }

    /// Makes the incoming positions the current ones.
    pub(in crate::capi) fn adopt_incoming(&mut self) {
        std::mem::swap(&mut self.positions, &mut self.incoming);
    }

    /// Reads the incoming positions.
    ///
    /// # Safety
    /// The view must describe memory that can be read.
    pub(in crate::capi) unsafe fn read_positions(&mut self, positions: &frz_view) -> Outcome {
        let count = self.positions.len();
        // SAFETY: guaranteed by the caller.
        let given =
            unsafe { one_for_each::<[f32; 3]>(positions, "positions", count, ["the mesh has", "vertices"]) }?;
        self.incoming.clear();
        self.incoming.extend(given.map(Vec3::from));
        let is_not_finite = |position: &Vec3| !position.iter().all(|number| number.is_finite());
        match self.incoming.iter().position(is_not_finite) {
            None => Ok(()),
            Some(at) => Err(Failure::argument(format!("positions: element {at} is not finite"))),
        }
    }
}

/// All cells of a grid.
pub(in crate::capi) fn all_cells(grid: &Grid) -> [Range<usize>; 2] {
    grid.size.map(|count| 0..count)
}

/// Tolerance (cells) of the test whether a cell's centre lies in a box.
const ROUNDING: f64 = 1e-6;

/// The cells whose centres lie within a host's box; all cells for NULL.
///
/// # Safety
/// The pointer must be NULL or point to four numbers.
pub(in crate::capi) unsafe fn cells_in(grid: &Grid, bounds: *const f64) -> Outcome<[Range<usize>; 2]> {
    if bounds.is_null() {
        return Ok(all_cells(grid));
    }
    // SAFETY: guaranteed by the caller.
    let bounds = unsafe { bounds.cast::<[f64; 4]>().read_unaligned() };
    let [x0, z0, x1, z1] = bounds;
    // Negated, so that NaN is refused too.
    refuse(!(x0 <= x1 && z0 <= z1), || format!("bounds = {bounds:?} m have no inside"))?;
    let range = |axis: usize, low: f64, high: f64| {
        let count = grid.size[axis] as f64;
        // In cells, from the centre of the first.
        let [low, high] = [low, high].map(|position| (position - grid.origin[axis]) / grid.cell - 0.5);
        let first = (low - ROUNDING).ceil().clamp(0.0, count);
        let end = ((high + ROUNDING).floor() + 1.0).clamp(first, count);
        first as usize..end as usize
    };
    Ok([range(0, x0, x1), range(1, z0, z1)])
}

/// The solids of some cells, from a host's heights of all cells.
///
/// # Safety
/// The view must describe memory that can be read.
pub(in crate::capi) unsafe fn read_heights(
    heights: &frz_view,
    grid: &Grid,
    range: &Heights,
    [across, rows]: [Range<usize>; 2],
    solids: &mut Vec<[Solid; 1]>,
) -> Outcome {
    let count = grid.cells();
    // SAFETY: guaranteed by the caller.
    let tops = unsafe { one_for_each::<f32>(heights, "heights", count, ["there are", "cells"]) }?;
    if let Some(at) = tops.clone().position(|top| !top.is_finite()) {
        return Err(Failure::argument(format!("heights: element {at} is not finite")));
    }
    let is_within = |cell: usize| {
        let [x, z] = grid.position(cell);
        across.contains(&x) && rows.contains(&z)
    };
    let own = tops.enumerate().filter(|(cell, _)| is_within(*cell));
    solids.clear();
    solids.extend(own.map(|(_, top)| [[BOTTOMLESS, range.round(top.into())]]));
    Ok(())
}
