//! Incompressible flow on a sparse set of tiles of 8 x 8 x 8 cells: the part that mist shares with any other gas or liquid.
//!
//! A step is: forces (applied by the caller), [`Flow::project`], [`Flow::advect`]. Solids are given as open fractions and speeds of faces
//! ([`Solids`]); the caller chooses the tiles ([`Flow::resize`]).
//!
//! | word | meaning |
//! |---|---|
//! | tile | 8 x 8 x 8 cells |
//! | active | a tile that holds cells of the flow |
//! | rim | the tiles adjacent to the active ones: upper faces of their cells, and the state of the surrounding air |
//! | slot | index of a tile; the rim comes after the active ones |
//! | around | a coarser flow with cells twice as wide, which continues beyond the active tiles and may have one around it too |
//! | ambient | velocity of the air outside all flows, where the pressure is 0: the sides are open |
//!
//! Velocities are at the cells' *lower faces* (staggered grid: Harlow and Welch 1965), everything else at their centres.

// Kernels index several arrays by one lane, row or axis.
#![allow(clippy::needless_range_loop)]

mod advection;
mod outer_grid;
mod pressure;
mod scratch;
mod slip;
mod solids;
mod state;
pub mod tiles;
mod vorticity;
mod window;

pub use crate::flow::advection::scheme::MassConservation;
pub use crate::flow::advection::scheme::Scheme;
pub use advection::paths::FARTHEST;
pub use pressure::Solved;
pub use solids::{Faces, Solids};
pub use state::FlowState;
pub use tiles::{Coord, Field, Tile, Tiles};

use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use pressure::multigrid::Multigrid;
use scratch::Scratch;

/// A velocity, a density and a pressure on sparse tiles.
#[derive(Debug, Default)]
pub struct Flow {
    /// Edge of a cell (m).
    cell: f32,
    /// Velocity (m/s) of the air outside all tiles.
    ambient: [f32; 3],
    tiles: Tiles,
    /// Velocity (m/s) at lower faces, of active tiles and the rim.
    velocity: [Field; 3],
    /// Density at the centres, of active tiles.
    density: Field,
    /// Pressure at the centres, of active tiles and the rim: see [`pressure`].
    pressure: Field,
    /// The surrounding air; none: this is the outermost flow.
    around: Option<Box<Flow>>,
    /// The operator of the last projection and its preconditioner.
    multigrid: Multigrid,
    /// The solids of the last projection, until [`Flow::prepare_advection`].
    solids: Option<Solids>,
    scratch_fields: Scratch,
}

/// Open fractions and speeds of faces, for tiles and an edge (m) of their cells.
pub type Boundary<'a> = dyn Fn(&Tiles, f32) -> Result<Solids> + Sync + 'a;

impl Flow {
    /// No tiles yet; given the edge (m) of a cell and the velocity (m/s) of the air outside all tiles.
    ///
    /// # Errors
    /// A cell that is not positive; a velocity that is not finite.
    pub fn new(cell: f64, ambient: [f32; 3]) -> Result<Self> {
        if !(cell > 0.0 && cell.is_finite()) {
            return Err(Error::argument(format!("cell is {cell}: it must be over 0")));
        }
        if ambient.iter().any(|speed| !speed.is_finite()) {
            return Err(Error::argument("the wind is not finite"));
        }
        let cell = cell as f32;
        let cell_at = |level: u32| cell * outer_grid::RATIO.pow(level) as f32;
        let mut flow = Self { cell: cell_at(outer_grid::LEVELS), ambient, ..Self::default() };
        for level in (0..outer_grid::LEVELS).rev() {
            let cell = cell_at(level);
            flow = Self { cell, ambient, around: Some(Box::new(flow)), ..Self::default() };
        }
        Ok(flow)
    }

    /// Edge of a cell (m).
    pub fn cell(&self) -> f32 {
        self.cell
    }

    /// Its tiles.
    pub fn tiles(&self) -> &Tiles {
        &self.tiles
    }

    /// Velocity (m/s) at the lower faces on each axis, by slot.
    pub fn velocity(&self) -> &[Field; 3] {
        &self.velocity
    }

    /// Tiles, velocity and density, for modification.
    pub fn fields(&mut self) -> (&Tiles, &mut [Field; 3], &mut Field) {
        (&self.tiles, &mut self.velocity, &mut self.density)
    }

    /// Density at the centres, by slot.
    pub fn density(&self) -> &Field {
        &self.density
    }

    /// Largest speed (m/s) on any axis.
    pub fn fastest(&self) -> f32 {
        pressure::fastest(&self.velocity)
    }

    /// Speed (m/s, rounded up by less than 1 %) on any axis that only a share 0..=1 of the faces exceeds.
    pub fn fastest_except(&self, share: f64) -> f32 {
        pressure::fastest_except(&self.velocity, share)
    }

    /// Makes these tiles (sorted, without duplicates) the active ones. Existing values are kept; new tiles take the velocity of the
    /// surrounding air, and a density of 0.
    pub fn resize(&mut self, active: &[Coord]) {
        if &self.tiles.coords()[..self.tiles.active()] == active {
            return;
        }
        // Solids are known for the old tiles only.
        self.prepare_advection();
        let old = std::mem::replace(&mut self.tiles, Tiles::new(active));
        let Self { tiles, velocity, density, pressure, scratch_fields, .. } = self;
        let find = |coord: &Coord| old.find(*coord).unwrap_or(tiles::NONE);
        let from: Vec<u32> = tiles.coords().par_iter().with_min_len(64).map(find).collect();
        for (field, speed) in velocity.iter_mut().zip(self.ambient) {
            scratch_fields.move_with_rim(field, &from, speed);
        }
        scratch_fields.move_with_rim(pressure, &from, 0.0);
        scratch_fields.move_active(density, &from[..tiles.active()], 0.0);
        if let Some(around) = &mut self.around {
            around.resize(&outer_grid::tiles_around(active));
        }
        let tiles = std::mem::take(&mut self.tiles);
        self.set_outer_velocity(&tiles, &old);
        self.tiles = tiles;
    }

    /// Sets the velocity at the faces of `tiles` from the surrounding air, except at faces of cells that are active in `set`.
    fn set_outer_velocity(&mut self, tiles: &Tiles, set: &Tiles) {
        let Some(around) = &self.around else { return };
        for axis in 0..3 {
            let reader = around.faces(axis);
            let faces = self.velocity[axis].par_iter_mut().zip(tiles.coords()).with_min_len(4);
            faces.for_each_init(window::Window::default, |window, (tile, coord)| {
                let is_active = |coord| set.find(coord).is_some_and(|slot| (slot as usize) < set.active());
                if is_active(*coord) {
                    return;
                }
                let keeps_first = is_active(tiles::shifted(*coord, axis, -1));
                let values = reader.read(window, *coord);
                for (cell, speed) in tile.iter_mut().enumerate() {
                    if !keeps_first || cell >> (6 - 3 * axis) & 7 != 0 {
                        *speed = values[cell];
                    }
                }
            });
        }
    }

    /// Makes the velocity divergence-free: the remaining divergence, times the cell, is at most `tolerance` times the largest speed.
    ///
    /// # Errors
    /// Cancel; errors of the boundary.
    pub fn project(&mut self, ctx: &Context, boundary: &Boundary<'_>, tolerance: f32) -> Result<Solved> {
        if let Some(mut around) = self.around.take() {
            outer_grid::restrict(self, &mut around);
            std::mem::swap(&mut around.scratch_fields, &mut self.scratch_fields);
            let solved = around.project(ctx, boundary, tolerance);
            std::mem::swap(&mut around.scratch_fields, &mut self.scratch_fields);
            self.take_rim_pressure(&around);
            self.around = Some(around);
            solved?;
        }
        let solids = boundary(&self.tiles, self.cell)?;
        let Self { tiles, velocity, pressure, multigrid, scratch_fields, .. } = self;
        let fields = scratch_fields.six(tiles);
        let solved =
            pressure::project(ctx, (tiles, &solids), velocity, pressure, multigrid, fields, tolerance)?;
        self.solids = Some(solids);
        Ok(solved)
    }

    /// Sets the velocity in and near the solids of the last projection, and in the rim, to the values that advection reads; a second call has
    /// no effect. [`Flow::advect`] calls this itself. After a call, [`Flow::fastest`] is the largest speed that advection will read.
    pub fn prepare_advection(&mut self) {
        let Some(solids) = self.solids.take() else { return };
        if let Some(around) = &mut self.around {
            around.prepare_advection();
        }
        slip::slow_gaps(&solids, &mut self.velocity);
        slip::extend(&self.tiles, &self.multigrid.finest, &solids, &mut self.velocity);
        let tiles = std::mem::take(&mut self.tiles);
        self.set_outer_velocity(&tiles, &tiles);
        self.tiles = tiles;
    }

    /// Reads its velocity at lower faces on an axis for finer tiles.
    fn faces(&self, axis: usize) -> outer_grid::Reader<'_> {
        outer_grid::Reader {
            tiles: &self.tiles,
            field: &self.velocity[axis],
            axis: Some(axis),
            outside: self.ambient[axis],
        }
    }

    /// Sets the pressure in the rim from the surrounding air.
    fn take_rim_pressure(&mut self, around: &Self) {
        let coarse = outer_grid::extrapolated(&around.multigrid.finest, &around.pressure);
        let reader = outer_grid::Reader { tiles: &around.tiles, field: &coarse, axis: None, outside: 0.0 };
        let (tiles, active) = (&self.tiles, self.tiles.active());
        let rim = self.pressure[active..].par_iter_mut().enumerate().with_min_len(4);
        rim.for_each_init(window::Window::default, |window, (index, tile)| {
            *tile = reader.read(window, tiles.coords()[active + index]);
            tile.iter_mut().for_each(|pressure| *pressure *= outer_grid::RATIO as f32);
        });
    }

    /// Clears the density of cells that the solids of the last projection cover.
    pub fn clear_covered(&mut self) {
        self.multigrid.finest.clear_covered(&mut self.density);
    }

    /// Net inflow of each active cell (m/s): minus the divergence times the edge of a cell.
    pub fn net_inflow(&self, solids: &Solids) -> Field {
        let mut out = vec![[0.0; 512]; self.tiles.active()];
        pressure::net_inflow(&self.tiles, solids, &self.velocity, &mut out);
        out
    }
}
