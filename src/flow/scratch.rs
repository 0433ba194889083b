//! Scratch fields, reused between calls: paths during advection, residuals during the pressure solve, tiles that move to other slots. The
//! memory only grows, so that a step with no more tiles than before allocates nothing.

use rayon::prelude::*;

use super::tiles::{Field, Tile, Tiles};

/// Fields whose values are undefined between calls.
#[derive(Debug, Default)]
pub struct Scratch {
    /// For active tiles and the rim.
    with_rim: [Field; 3],
    /// For active tiles.
    fields: [Field; 6],
}

impl Scratch {
    /// For active tiles, three fields each for the paths back and ahead; then three fields that include the rim.
    #[allow(clippy::type_complexity)]
    pub fn paths(&mut self, tiles: &Tiles) -> ([&mut [Tile]; 3], [&mut [Tile]; 3], [&mut [Tile]; 3]) {
        let Self { with_rim, fields } = self;
        let [a, b, c, d, e, f] = fields.each_mut().map(|field| first_tiles(field, tiles.active()));
        ([a, b, c], [d, e, f], with_rim.each_mut().map(|field| first_tiles(field, tiles.count())))
    }

    /// Six fields for active tiles.
    pub fn six(&mut self, tiles: &Tiles) -> [&mut [Tile]; 6] {
        self.fields.each_mut().map(|field| first_tiles(field, tiles.active()))
    }

    /// Moves a field of active tiles and the rim to new slots: `from` has the old slot of each new slot; a new tile gets `fill`.
    pub fn move_with_rim(&mut self, field: &mut Field, from: &[u32], fill: f32) {
        move_tiles(&mut self.with_rim[0], field, from, fill);
    }

    /// The same for a field of active tiles.
    pub fn move_active(&mut self, field: &mut Field, from: &[u32], fill: f32) {
        move_tiles(&mut self.fields[0], field, from, fill);
    }
}

/// Moves a field through a scratch field of its size, then swaps the two.
fn move_tiles(scratch: &mut Field, field: &mut Field, from: &[u32], fill: f32) {
    let to = first_tiles(scratch, from.len());
    to.par_iter_mut().zip(from).with_min_len(16).for_each(|(to, from)| {
        *to = field.get(*from as usize).copied().unwrap_or([fill; 512]);
    });
    std::mem::swap(field, scratch);
    field.truncate(from.len());
}

/// The first tiles of a field, which grows to hold them.
pub fn first_tiles(field: &mut Field, count: usize) -> &mut [Tile] {
    if field.len() < count {
        // Slightly more than now, not twice as much: fields are large, and the flow grows slowly.
        field.reserve_exact(count + count / 16 - field.len());
        field.resize(count, [0.0; 512]);
    }
    &mut field[..count]
}
