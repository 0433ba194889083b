//! A triangle mesh of the liquid's surface (thesis 4.2.1 to 4.2.4), written into the caller's buffers.
//!
//! It needs [`Columns`] and a depth for each of their indices, so it serves any solver of height fields (thesis 4.4). Every wet column
//! whose surface reaches that of its neighbours becomes a vertex at the centre of its cell, and so do the dry columns around.
//!
//! | word | meaning |
//! |---|---|
//! | height | eta, the level of a column's surface: its base plus its depth (units); for a dry column its base |
//! | room | [min, max) of a column: from the underside of its solid to its ceiling; the rooms of a cell do not overlap |
//! | linked | two columns of neighbouring cells (8), one of them wet, where each one's room holds the other's height |
//! | quartet | the columns of 2 x 2 cells, named by the north-west cell (minimum x and z) |
//! | group | four columns of a quartet, or three that are not part of such four, in which every pair with a wet column is linked |
//! | full | a quartet whose four columns on a layer are a group is full on this layer |
//! | odd | a quartet with a wet column that is in no full group; it is searched for groups column by column |
//! | wall | a column at whose solid a neighbour's surface ends, below the neighbour's ceiling |
//! | extra | a vertex within a wall, to which the surface that ends there is extended |
//!
//! Two dry columns of a group need no link. Groups become one or two triangles, which face up. A group of four is divided along a diagonal:
//! if only one diagonal has ends that are both wet or both dry, along that one; if one is wet and the other dry, along the wet one;
//! otherwise along the one with the larger sum of heights, and if these are equal from north-west to south-east. The surface ends at the
//! centres of the outermost cells.
//!
//! Where a group of four lacks one link, between two cells side by side, its two triangles overlap ([`Check::doubled`]): the liquid of
//! these columns is on different layers there.

pub(in crate::shallow) mod buffers;
pub mod heights;
pub(in crate::shallow) mod quartets;
pub mod rim;
mod self_check;

use super::columns::{Columns, NONE, STRIP};
use super::scalars::MOST;
use crate::error::{Error, Result};
pub use buffers::capacity::bound;
use buffers::normals::Normals;
use buffers::vertices::Vertices;
use quartets::links::Scene;
use quartets::odd::Search;
use quartets::strips::Found;
use rim::boundary::{Around, Walls};
use rim::ledges::Ledges;
use rim::skirts::Skirts;
pub use self_check::{Check, check};

/// The liquid in columns.
#[derive(Debug, Clone, Copy, Default)]
pub struct Depths<'a> {
    /// Depth of each index (units), at most from base to ceiling; 0 or less is dry, and so are indices without a column.
    pub depth: &'a [i32],
    /// Mean velocity of each index along x and z (m/s); may be empty.
    pub velocity: &'a [[f32; 2]],
    /// Whether each strip may have a wet column; if absent, all strips are searched.
    pub active: Option<&'a [bool]>,
    /// Minimum depth at which each index is shown where it is wet (units), at most from base to ceiling; replaces [`Layout::least_depth`].
    /// May be empty. See [`heights::minimum_heights::Lifts`].
    pub least: &'a [i32],
    /// How far below its base each index is shown where it is dry (units), at most down to the underside of its solid; replaces
    /// [`Layout::least_depth`]. May be empty.
    pub sunk: &'a [i32],
    /// One number per index for each array of [`Target::carried`]: concentrations of scalars. May be empty.
    pub carried: [&'a [f32]; MOST],
    /// Where the surface ends above nothing and is extended down to the ground's edge; if absent, it ends in the middle of the last cell.
    pub ledges: Option<&'a Ledges>,
}

/// The axis that points up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Up {
    /// Y: x to the east, z to the south.
    #[default]
    Y,
    /// Z: x to the east, y to the north.
    Z,
}

/// How the mesh is written. Triangles are counter-clockwise seen from above, or clockwise with `left_handed`. In both cases the cross
/// product of a triangle's edges points along its normals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// The caller's units per metre: 1, or 100 for centimetres. For positions, depths and velocities.
    pub scale: f64,
    /// The axis that points up.
    pub up: Up,
    /// Left-handed axes: the horizontal axis that is not x points the other way (Y up: z to the north; Z up: y to the south).
    pub left_handed: bool,
    /// Minimum height of a wet vertex above its base (m), against flicker where the terrain is drawn too (thesis 4.2.4: 0.05 of a cell). A
    /// dry vertex is at least as far below its base, and further where the liquid around is lower.
    pub least_depth: f64,
    /// Depth (m) from which a wet vertex is at its full height. Below it, the thinner the liquid, the closer its vertex is to that of a dry
    /// column, so that no vertex jumps as its column wets or dries. 0: at once; 0.02 of a cell works well.
    pub fade_depth: f64,
    /// Depth from which the liquid is opaque (m), for [`Target::opacities`].
    pub opaque_depth: f64,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: Up::Y,
            left_handed: false,
            least_depth: 0.0,
            fade_depth: 0.0,
            opaque_depth: 0.01,
        }
    }
}

/// Where vertex indices are written.
#[derive(Debug, Default)]
pub enum Indices<'a> {
    /// Nowhere.
    #[default]
    None,
    /// 16 bits: for at most 65,536 vertices.
    U16(&'a mut [u16]),
    /// 32 bits.
    U32(&'a mut [u32]),
}

/// Buffers of the caller. They are written from the start, in order, and never read; they may be longer than the mesh. Those that are
/// absent are not wanted. Vertices are in the order of their columns' indices, followed by extras.
#[derive(Debug, Default)]
pub struct Target<'a> {
    /// Three numbers per vertex (m x scale).
    pub positions: Option<&'a mut [f32]>,
    /// Three numbers per vertex: a unit vector.
    pub normals: Option<&'a mut [f32]>,
    /// One number per vertex (m x scale); 0 for dry vertices and extras.
    pub depths: Option<&'a mut [f32]>,
    /// One number per vertex: depth / [`Layout::opaque_depth`], at most 1 (thesis 4.2.2).
    pub opacities: Option<&'a mut [f32]>,
    /// Three numbers per vertex (m/s x scale): velocity at the surface, 1.5 times the mean (Eq. 4.4); the upward component is 0.
    pub velocities: Option<&'a mut [f32]>,
    /// One number per vertex for each array of [`Depths::carried`]; for a dry vertex or an extra, the mean of the wet columns around.
    pub carried: [Option<&'a mut [f32]>; MOST],
    /// Layer of each vertex's column; for an extra, the lowest layer of the wet columns around whose surface ends there.
    pub layers: Option<&'a mut [u32]>,
    /// Index of each vertex's column; [`NONE`] for an extra.
    pub columns: Option<&'a mut [u32]>,
    /// Three per triangle.
    pub indices: Indices<'a>,
}

/// Size of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Count of vertices.
    pub vertices: usize,
    /// Of these, extras.
    pub extras: usize,
    /// Count of vertex indices: three for each triangle.
    pub indices: usize,
}

/// Builds surfaces; reuses its memory.
#[derive(Debug, Default)]
pub struct Surface {
    /// For each strip, the one above it, in the columns of the last call of `reserve` or of the first call.
    above: Vec<u32>,
    found: Found,
    walls: Walls,
    skirts: Skirts,
    search: Search,
    normals: Normals,
    around: Around,
    /// Height of each index as shown (units).
    heights: Vec<i32>,
}

impl Surface {
    /// Reserves memory for any liquid that these columns can hold: from then on [`Surface::build`] allocates nothing for them.
    pub fn reserve(&mut self, columns: &Columns) {
        let layers = columns.strips().iter().map(|strip| strip.layer as usize + 1).max().unwrap_or(0);
        quartets::links::find_above(columns, &mut self.above);
        self.found.reset(columns);
        self.normals.reset(columns);
        heights::shown::reserve(columns, &mut self.heights);
        self.walls.reserve(buffers::capacity::Walls::of(columns).pairs, layers);
        let [nx, nz] = columns.grid.size;
        self.search.reserve(layers, (nx - 1) * (nz - 1), bound(columns).indices / 3);
        self.around.reserve();
    }

    /// Size of the mesh that [`Surface::build`] would write.
    ///
    /// # Errors
    /// As [`Surface::build`], for the depths.
    pub fn count(&mut self, columns: &Columns, depths: &Depths<'_>) -> Result<Counts> {
        let len = columns.len();
        if depths.depth.len() != len {
            return Err(Error::argument(format!(
                "{} depths are not one for each of {len} indices",
                depths.depth.len()
            )));
        }
        if !depths.velocity.is_empty() && depths.velocity.len() != len {
            let count = depths.velocity.len();
            return Err(Error::argument(format!("{count} velocities are not one for each of {len} indices")));
        }
        for (name, lengths) in [("least depths", depths.least), ("sunk depths", depths.sunk)] {
            if !lengths.is_empty() && lengths.len() != len {
                let count = lengths.len();
                return Err(Error::argument(format!("{count} {name} are not one for each of {len} indices")));
            }
        }
        if let Some(carried) =
            depths.carried.iter().find(|carried| !carried.is_empty() && carried.len() != len)
        {
            let count = carried.len();
            return Err(Error::argument(format!(
                "{count} concentrations are not one for each of {len} indices"
            )));
        }
        if let Some(active) = depths.active.filter(|active| active.len() != len / STRIP) {
            let (count, strips) = (active.len(), len / STRIP);
            return Err(Error::argument(format!(
                "{count} flags of activity are not one for each of {strips} strips"
            )));
        }
        if depths.ledges.is_some_and(|ledges| ledges.columns != len) {
            return Err(Error::argument("the ledges are those of other columns"));
        }
        if self.above.len() != len / STRIP {
            quartets::links::find_above(columns, &mut self.above);
        }
        let scene = Scene { columns, depth: depths.depth, above: &self.above };
        self.found.reset(columns);
        self.walls.clear();
        quartets::full::find_wet(scene, depths.active, &mut self.found);
        quartets::full::find_full(scene, &mut self.found);
        let mut triangles = self.found.full_triangles;
        triangles += quartets::odd::find_groups(scene, &mut self.found, &mut self.walls, &mut self.search);
        let columns_used = self.found.number(columns);
        let extras = self.walls.number(columns_used);
        self.found.has_means |= extras > 0;
        let vertices = columns_used + extras;
        let [hems, skirts] = self.skirts.find(scene, &self.found, &self.search, depths.ledges, vertices);
        Ok(Counts {
            vertices: vertices as usize + hems,
            extras: extras as usize,
            indices: 3 * triangles + skirts,
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
        let scene = Scene { columns, depth: depths.depth, above: &self.above };
        let (found, walls, flipped) = (&self.found, &self.walls.list, layout.left_handed);
        let at = buffers::indices::write_triangles(
            scene,
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
            Vertices::new(scene, found, walls, &self.heights, depths, layout, target.normals.is_some());
        vertices.write(&mut self.normals, &mut self.around, target);
        self.skirts.write_hems(&vertices, target);
        self.normals.clear(found);
        Ok(counts)
    }
}

impl Layout {
    pub(super) fn validate(&self) -> Result<()> {
        let positive = |name: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(Error::argument(format!("{name} = {value} is not positive and finite")))
            }
        };
        positive("scale", self.scale)?;
        positive("opaque_depth", self.opaque_depth)?;
        for (name, value) in [("least_depth", self.least_depth), ("fade_depth", self.fade_depth)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::argument(format!("{name} = {value} is not finite and 0 or more")));
            }
        }
        Ok(())
    }
}

impl Target<'_> {
    /// Checks that everything wanted is given.
    pub(in crate::shallow) fn check_wanted(&self, depths: &Depths<'_>) -> Result<()> {
        if self.velocities.is_some() && depths.velocity.is_empty() && !depths.depth.is_empty() {
            return Err(Error::argument("velocities of the surface are wanted, and the liquid has none"));
        }
        let is_bare = |(to, from): (&Option<&mut [f32]>, &&[f32])| to.is_some() && from.is_empty();
        if !depths.depth.is_empty() && self.carried.iter().zip(&depths.carried).any(is_bare) {
            return Err(Error::argument("concentrations of the surface are wanted, and the liquid has none"));
        }
        Ok(())
    }

    /// Checks that the mesh fits the buffers.
    pub(in crate::shallow) fn check(&self, counts: &Counts) -> Result<()> {
        let fits = |name: &str, room: Option<usize>, needed: usize| match room {
            Some(room) if room < needed => Err(Error::argument(format!(
                "{name} has room for {room} numbers, and the surface has {needed}"
            ))),
            _ => Ok(()),
        };
        let count = counts.vertices;
        fits("positions", self.positions.as_ref().map(|out| out.len()), 3 * count)?;
        fits("normals", self.normals.as_ref().map(|out| out.len()), 3 * count)?;
        fits("depths", self.depths.as_ref().map(|out| out.len()), count)?;
        fits("opacities", self.opacities.as_ref().map(|out| out.len()), count)?;
        fits("velocities", self.velocities.as_ref().map(|out| out.len()), 3 * count)?;
        for carried in &self.carried {
            fits("carried", carried.as_ref().map(|out| out.len()), count)?;
        }
        fits("layers", self.layers.as_ref().map(|out| out.len()), count)?;
        fits("columns", self.columns.as_ref().map(|out| out.len()), count)?;
        let room = match &self.indices {
            Indices::None => None,
            Indices::U16(out) => Some(out.len()),
            Indices::U32(out) => Some(out.len()),
        };
        fits("indices", room, counts.indices)?;
        if matches!(self.indices, Indices::U16(_)) && count > 1 << 16 {
            return Err(Error::argument(format!(
                "{count} vertices are too many for indices of 16 bits: take those of 32"
            )));
        }
        Ok(())
    }
}
