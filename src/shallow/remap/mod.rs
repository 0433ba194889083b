//! Terrain that moves: columns are rebuilt where it does, and keep their liquid.
//!
//! In each cell that changes, columns before and after are matched. Liquid that has no room where it was is pushed up, to other columns of
//! the cell, to those beside it, or waits until there is room again (`held.rs`): the total never changes. Only the rows with such cells and
//! those beside them are touched; if the count of columns changes, the data of later rows is shifted.
//!
//! | word | meaning |
//! |---|---|
//! | band | the rows that a change rebuilds, as they were before it |
//! | origins | which former column each column was |

mod band;
mod buffers;
mod carry;
mod cells;
mod dirty;
mod held;
mod layout;
mod origins;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::Shallow;
use super::columns::STRIP;
use super::columns::grid::{Cells, check_cells};
use super::pipes::pipe_rules::Rules;
use super::terrain::Solids;
use super::terrain::identity::Identity;
use super::terrain::shapes::Shape;
use super::terrain::solids::Solid;
use crate::error::{Error, Result};
use crate::numeric::checks::ensure;
pub use buffers::Remap;
use carry::{Carry, Change};
pub use held::{Held, Parcel};
use layout::{Liquid, RebuiltRows};

/// Results of a change of the terrain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moved {
    /// Count of rebuilt cells.
    pub cells: usize,
    /// Liquid that could not stay in its column (m3).
    pub displaced: f64,
    /// All liquid that now waits for room (m3).
    pub held: f64,
    /// Liquid that fell where there is no longer any ground (m3); it counts as lost.
    pub fallen: f64,
}

impl Shallow {
    /// Changes the terrain everywhere.
    ///
    /// Nothing is allocated unless there are more columns or links than ever before.
    ///
    /// # Errors
    /// `Argument`: solids of other cells or heights, or none at all.
    pub fn update_terrain(&mut self, solids: &Solids) -> Result<Moved> {
        if (solids.grid, solids.heights) != (self.columns.grid, self.columns.heights) {
            return Err(Error::argument("the terrain's cells or heights are not those of the liquid"));
        }
        ensure(solids.layers() > 0, "the terrain has no surface that faces up within the domain")?;
        let [nx, nz] = self.columns.grid.size;
        self.update_cells([0..nx, 0..nz], |cell| solids.cell(cell))
    }

    /// Changes the terrain in a box of cells: ranges of x and of z. `solids(n)` gives the solids of the n-th cell of the box,
    /// counted along x, then z, as [`Caster::at`](super::terrain::triangles::Caster::at) does: disjoint, from the lowest up. It is called
    /// more than once.
    ///
    /// Nothing is allocated unless there are more columns or links, or a larger box, than ever before.
    ///
    /// # Errors
    /// `Argument`: the box is not within the domain.
    pub fn update_cells<'a>(&mut self, cells: Cells, solids: impl Fn(usize) -> &'a [Solid]) -> Result<Moved> {
        let grid = self.columns.grid;
        check_cells(&cells, grid.size)?;
        self.remap.dirty.clear(grid.size);
        self.remap.dirty.mark(&cells);
        if self.remap.ground.bodies().is_empty() {
            return Ok(self.rebuild(solids));
        }
        self.remap.ground.replace(&grid, &cells, solids);
        Ok(self.rebuild_over_bodies())
    }

    /// Replaces the solid shapes that move over the terrain.
    ///
    /// Only the cells of shapes that differ from the previous shape of the same index are rebuilt, and no rays are cast at the
    /// terrain again. As for [`Shallow::update_cells`], nothing is allocated, provided there are no more shapes than before.
    ///
    /// # Errors
    /// As [`Shape::validate`].
    pub fn set_bodies(&mut self, bodies: &[Shape]) -> Result<Moved> {
        bodies.iter().try_for_each(Shape::validate)?;
        let Self { columns, remap, .. } = self;
        let Remap { ground, dirty, stacks, .. } = remap;
        if ground.bodies().is_empty() && !bodies.is_empty() {
            ground.clear();
            for row in 0..columns.grid.size[1] {
                stacks.find_row(columns, row);
                for x in 0..columns.grid.size[0] {
                    let indices = stacks.columns(columns, x);
                    ground.add(indices.map(|index| [columns.unders()[index], columns.bases()[index]]));
                }
            }
        }
        dirty.clear(columns.grid.size);
        ground.set_bodies(&columns.grid, bodies, |cells| dirty.mark(&cells));
        Ok(self.rebuild_over_bodies())
    }

    /// The solid shapes that move over the terrain.
    pub fn bodies(&self) -> &[Shape] {
        self.remap.ground.bodies()
    }

    fn rebuild_over_bodies(&mut self) -> Moved {
        let mut ground = std::mem::take(&mut self.remap.ground);
        let excluded = |cell| self.excluded.as_ref().is_some_and(|excluded| excluded.has(cell));
        ground.unite(&self.columns.grid, &self.columns.heights, self.remap.dirty.iter(), excluded);
        let moved = self.rebuild(|rank| ground.united(rank));
        self.remap.ground = ground;
        moved
    }

    /// Rebuilds the dirty cells. `cast` gives the solids of a dirty cell by the cell's rank among the dirty cells.
    fn rebuild<'a>(&mut self, cast: impl Fn(usize) -> &'a [Solid]) -> Moved {
        let rows = self.remap.dirty.rows.clone();
        let volume = self.columns.grid.cell * self.columns.grid.cell * self.columns.heights.unit;
        if rows.is_empty() {
            return Moved { held: self.remap.held.units() as f64 * volume, ..Moved::default() };
        }
        let around = rows.start.saturating_sub(1)..(rows.end + 1).min(self.columns.grid.size[1]);
        self.release_packets_of(around.clone());
        let displaced = self.rebuild_columns(cast, rows.clone(), around.clone());
        let has_same_links = self.rebuild_pipes(around.clone());
        self.identity = Identity::new();
        self.flow.refit(&self.columns, &self.pipes, rows, has_same_links);
        self.flow_points.find_again(&self.columns);
        let fallen = self.land_buried() + self.settle_held();
        Moved {
            cells: self.remap.dirty.count(),
            displaced: displaced as f64 * volume,
            held: self.remap.held.units() as f64 * volume,
            fallen: fallen as f64 * volume,
        }
    }

    /// Rebuilds the columns of rows and gives them their liquid; returns how much did not stay in its column (units).
    fn rebuild_columns<'a>(
        &mut self,
        cast: impl Fn(usize) -> &'a [Solid],
        rows: Range<usize>,
        around: Range<usize>,
    ) -> i64 {
        let Self { columns, pipes, flow, remap, .. } = self;
        let Remap { dirty, band, layout, origins, carry, held, .. } = remap;
        carry.save(columns, &pipes.links, flow, around);
        band.save(columns, flow, rows.clone());
        let change = RebuiltRows { dirty, band, cast };
        layout.plan(&change);
        columns.resize_rows(rows.clone(), layout.counts.iter().copied());
        let strips = columns.row(rows.start).start..columns.row(rows.end - 1).end;
        let (old, len) = (band.range(), strips.len() * STRIP);
        let old = old.start * STRIP..old.end * STRIP;
        for open in [&mut pipes.east, &mut pipes.south] {
            open.resize_part(old.clone(), len, 0.0);
        }
        flow.resize_part(old, len);
        let amounts = flow.amounts.amounts.each_mut().map(|amounts| &mut amounts[..]);
        let mut liquid = Liquid { depth: &mut flow.depth, amounts };
        let displaced = layout.build(&change, columns, &mut liquid, origins, held);
        origins.finish();
        columns.connect(rows);
        displaced
    }

    /// Rebuilds the pipes of rows, with their fluxes; returns whether the links still join the same columns.
    fn rebuild_pipes(&mut self, rows: Range<usize>) -> bool {
        let Self { columns, pipes, flow, remap, params, falls, excluded, .. } = self;
        let Remap { band, origins, carry, finder, ends, links, .. } = remap;
        links.clear();
        let rules = Rules::of(params, columns, excluded.as_ref());
        finder.find(columns, &rules, rows.clone(), [&mut pipes.east, &mut pipes.south], links);
        let change = Change { columns, band, origins };
        carry.links(&change, flow, links);
        carry.regular(&change, pipes, flow);
        Carry::heads(&change, flow);
        let old = pipes.links.row(rows.start).start..pipes.links.row(rows.end - 1).end;
        let shift = origins.shift().wrapping_mul(STRIP as u32);
        let has_same_links = shift == 0 && carry.has_same_links(links);
        flow.links.replace(old.clone(), &carry.flux, &carry.remainder, flow.amounts.count());
        if params.falls.is_some() {
            falls.replace(old.clone(), links.len());
        }
        pipes.links.replace_rows(rows, links, shift);
        if !has_same_links {
            pipes.links.list_columns(columns, ends);
        }
        has_same_links
    }

    /// Moves waiting liquid to where there is room now; returns what fell into the void (units).
    pub(super) fn settle_held(&mut self) -> i64 {
        let fallen = self.remap.held.settle(&self.columns, &mut self.flow);
        self.flow.links.lost += fallen;
        fallen
    }
}
