//! A triangle mesh of the liquid's surface (thesis 4.2.1 to 4.2.4), written into the caller's buffers.
//!
//! It needs [`Columns`] and a depth for each of their indices, so it serves any solver of height fields (thesis 4.4). Every wet column
//! whose surface reaches that of its neighbours becomes a vertex at the centre of its cell, and so do the dry columns around.
//!
//! | word | meaning |
//! |---|---|
//! | height | eta, the level of a column's surface: its base plus its depth (units); for a dry column its base |
//! | room | [min, max) of a column: from the underside of its solid to its ceiling; the rooms of a cell do not overlap |
//! | linked | two columns, at least one of them wet, of which each one's room holds the other's height; their cells are neighbours (each has 8) |
//! | quartet | the columns of 2 x 2 cells, named by the north-west cell (minimum x and z) |
//! | group | four columns of a quartet in which every pair that includes a wet column is linked; or three such columns, if they are not part of a group of four |
//! | full | a quartet is full on a layer if its four columns there are a group |
//! | odd | a quartet with a wet column that is in no full group; it is searched for groups column by column |
//! | wall | a column at whose solid a neighbour's surface ends, below the neighbour's ceiling |
//! | extra | a vertex within a wall, to which the surface that ends there is extended |
//!
//! Two dry columns of a group need no link. Groups become one or two triangles, which face up. A group of four is divided along a diagonal:
//! if only one diagonal has ends that are both wet or both dry, along that one; if both have, and one diagonal is wet and the other dry,
//! along the wet one; otherwise along the one with the larger sum of heights, and if these are equal from north-west to south-east. The
//! surface ends at the centres of the outermost cells.
//!
//! If of a quartet's four columns only two are not linked, and their cells are side by side, there are two groups of three, whose triangles
//! overlap ([`Check::doubled`]): the liquid splits into two layers there.

pub(super) mod buffers;
pub mod counts;
pub mod heights;
pub mod layout;
pub(super) mod quartets;
pub mod rim;
mod self_check;

use super::columns::{Columns, NONE, STRIP};
use crate::error::{Error, Result};
use crate::numeric::checks::check_each;
pub use buffers::capacity::bound;
use buffers::normals::Normals;
use buffers::vertices::Vertices;
pub use counts::Counts;
pub use layout::{Depths, Indices, Layout, Target, Up};
use quartets::links::LiquidColumns;
use quartets::odd::Search;
use quartets::strips::Found;
use rim::boundary::{Stencil, Walls};
use rim::skirts::Skirts;
pub use self_check::{Check, check};

/// Builds surfaces; reuses its memory.
#[derive(Debug, Default)]
pub struct Surface {
    /// As in [`LiquidColumns`]; of the columns given to the last `reserve` or, without it, to the first call.
    above: Vec<u32>,
    found: Found,
    walls: Walls,
    skirts: Skirts,
    search: Search,
    normals: Normals,
    stencil: Stencil,
    /// Height (units) at which each index is shown: see `heights/shown.rs`.
    heights: Vec<i32>,
}

impl Surface {
    /// Reserves memory for any liquid that these columns can hold: from then on [`Surface::build`] allocates nothing for them.
    pub fn reserve(&mut self, columns: &Columns) {
        let layers = columns.layers();
        quartets::links::find_above(columns, &mut self.above);
        self.found.reset(columns);
        self.normals.reset(columns);
        heights::shown::reserve(columns, &mut self.heights);
        self.walls.reserve(buffers::capacity::Walls::of(columns).pairs, layers);
        let [nx, nz] = columns.grid.size;
        self.search.reserve(layers, (nx - 1) * (nz - 1), bound(columns).indices / 3);
        self.stencil.reserve();
    }

    /// Size of the mesh that [`Surface::build`] would write.
    ///
    /// # Errors
    /// As [`Surface::build`], for the depths.
    pub fn count(&mut self, columns: &Columns, depths: &Depths<'_>) -> Result<Counts> {
        let len = columns.len();
        check_each(depths.depth.len(), "depths", len, "indices")?;
        let lists = [
            (depths.velocity.len(), "velocities"),
            (depths.least.len(), "least depths"),
            (depths.sunk.len(), "sunk depths"),
        ];
        let carried = depths.carried.iter().map(|carried| (carried.len(), "concentrations"));
        for (count, what) in lists.into_iter().chain(carried).filter(|(count, _)| *count > 0) {
            check_each(count, what, len, "indices")?;
        }
        if let Some(active) = depths.active {
            check_each(active.len(), "flags of activity", len / STRIP, "strips")?;
        }
        if depths.ledges.is_some_and(|ledges| ledges.columns != len) {
            return Err(Error::argument("the ledges are those of other columns"));
        }
        if self.above.len() != len / STRIP {
            quartets::links::find_above(columns, &mut self.above);
        }
        let liquid = LiquidColumns { columns, depth: depths.depth, above: &self.above };
        self.found.reset(columns);
        self.walls.clear();
        quartets::full::find_wet(liquid, depths.active, &mut self.found);
        quartets::full::find_full(liquid, &mut self.found);
        let mut triangles = self.found.full_triangles;
        triangles += quartets::odd::find_groups(liquid, &mut self.found, &mut self.walls, &mut self.search);
        let columns_used = self.found.number(columns);
        let extras = self.walls.number(columns_used);
        self.found.has_means |= extras > 0;
        let vertices = columns_used + extras;
        let [skirt_vertices, skirt_indices] =
            self.skirts.find(liquid, &self.found, &self.search, depths.ledges, vertices);
        Ok(Counts {
            vertices: vertices as usize + skirt_vertices,
            extras: extras as usize,
            indices: 3 * triangles + skirt_indices,
        })
    }

    /// Writes the mesh of the liquid's surface and returns its size, at most [`bound`].
    ///
    /// # Errors
    /// `Argument`, and nothing is written: arrays of depths, velocities, activity, minimum heights or concentrations whose length differs
    /// from the columns'; velocities or concentrations that are wanted but not given; a scale or opaque depth that is not positive and
    /// finite; a minimum or fade depth that is negative or not finite; a buffer that is too short; over 65,536 vertices for 16-bit indices.
    pub fn build(
        &mut self,
        columns: &Columns,
        depths: &Depths<'_>,
        layout: &Layout,
        target: &mut Target<'_>,
    ) -> Result<Counts> {
        layout.validate()?;
        target.check_wanted(depths)?;
        let counts = self.count(columns, depths)?;
        target.check(&counts)?;
        let liquid = LiquidColumns { columns, depth: depths.depth, above: &self.above };
        let (found, walls, flipped) = (&self.found, &self.walls.list, layout.left_handed);
        let at = buffers::indices::write_triangles(
            liquid,
            found,
            walls,
            &self.search,
            flipped,
            &mut target.indices,
        );
        self.skirts.write_triangles(found, at, flipped, &mut target.indices);
        self.normals.reset(columns);
        heights::shown::find_heights(columns, found, depths, layout, &mut self.heights);
        let vertices =
            Vertices::new(liquid, found, walls, &self.heights, depths, layout, target.normals.is_some());
        vertices.write(&mut self.normals, &mut self.stencil, target);
        self.skirts.write_vertices(&vertices, target);
        self.normals.clear(found);
        Ok(counts)
    }
}
