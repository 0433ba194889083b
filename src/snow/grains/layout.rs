//! Grains sorted into blocks of 8 x 8 x 8 diameters and those into columns, so that neighbours are near in memory and columns
//! two apart never touch the same grain.

use std::collections::HashMap;

use rayon::prelude::*;

use super::rows::{Row, V};
use crate::base::DVec3;

/// Edge of a block (diameters). At least twice the reach of a contact.
pub const EDGE: f32 = 8.0;
/// Cells along a block's edge: wider than the reach of a contact.
pub const CELLS: usize = 6;
/// Cells of a block.
pub const ALL_CELLS: usize = CELLS * CELLS * CELLS;

/// Index of a block along each axis.
pub type At = [i32; 3];

/// A block with its grains, and those of each of its cells: upward, then along x, then z.
#[derive(Clone)]
pub struct Block {
    /// Which.
    pub at: At,
    /// Its first grain, that of each cell, and the one behind its last.
    pub starts: [u32; ALL_CELLS + 1],
}

/// Blocks one above the other.
#[derive(Clone)]
pub struct Column {
    /// Index along x and z.
    pub at: [i32; 2],
    /// Its grains.
    pub grains: std::ops::Range<usize>,
}

/// Where the grains are.
#[derive(Clone, Default)]
pub struct Layout {
    /// Blocks with grains, by column and upward.
    pub blocks: Vec<Block>,
    /// Columns with grains, along x, then z.
    pub columns: Vec<Column>,
    /// Block of each grain.
    pub of: Vec<u32>,
    index: HashMap<At, u32>,
}

/// Where a grain goes: column, level and cell, then its identity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    cell: u64,
    id: u32,
    from: u32,
}

/// Blocks are counted from the middle of what a key holds: 2^21 of them along x and z, 2^14 upward.
const MIDDLE: [i32; 3] = [1 << 20, 1 << 13, 1 << 20];

impl Layout {
    /// Whether a block index can be sorted.
    pub fn holds(at: At) -> bool {
        (0..3).all(|axis| (-MIDDLE[axis]..MIDDLE[axis]).contains(&at[axis]))
    }

    /// A block that cannot be sorted: grains there are left out.
    pub const NOWHERE: At = [i32::MAX; 3];

    /// Sorts grains; each lies within or beyond the block that it had. Those in a block that cannot be sorted are left out.
    /// Returns where each was before.
    pub fn sort(&mut self, rows: &mut Vec<Row>, ids: &mut Vec<u32>, at: &mut Vec<At>) -> Vec<u32> {
        let mut keys: Vec<Key> = (rows.par_iter_mut(), ids.par_iter(), at.par_iter_mut())
            .into_par_iter()
            .enumerate()
            .filter_map(|(from, (row, id, at))| {
                settle(row, at);
                if !Self::holds(*at) {
                    return None;
                }
                let cell = row.place.map(|x| ((x * (CELLS as f32 / EDGE)) as usize).min(CELLS - 1));
                let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] + MIDDLE[axis]) as u64);
                let within = ((cell[1] * CELLS + cell[0]) * CELLS + cell[2]) as u64;
                Some(Key { cell: ((x << 21 | z) << 14 | y) << 8 | within, id: *id, from: from as u32 })
            })
            .collect();
        keys.par_sort_unstable();
        let from: Vec<u32> = keys.par_iter().map(|key| key.from).collect();
        *rows = from.par_iter().map(|&from| rows[from as usize]).collect();
        *ids = from.par_iter().map(|&from| ids[from as usize]).collect();
        *at = from.par_iter().map(|&from| at[from as usize]).collect();
        self.build(&keys, at);
        from
    }

    fn build(&mut self, keys: &[Key], at: &[At]) {
        let is_first = |slot: &usize| *slot == 0 || keys[*slot].cell >> 8 != keys[slot - 1].cell >> 8;
        let mut firsts: Vec<usize> = (0..keys.len()).into_par_iter().filter(is_first).collect();
        firsts.push(keys.len());
        let block = |pair: &[usize]| {
            let mut starts = [pair[1] as u32; ALL_CELLS + 1];
            let mut next = 0;
            for (key, slot) in keys[pair[0]..pair[1]].iter().zip(pair[0] as u32..) {
                let cell = (key.cell & 0xff) as usize;
                while next <= cell {
                    starts[next] = slot;
                    next += 1;
                }
            }
            Block { at: at[pair[0]], starts }
        };
        self.blocks = firsts.par_windows(2).map(block).collect();
        self.index = self.blocks.iter().enumerate().map(|(index, block)| (block.at, index as u32)).collect();
        self.of = self
            .blocks
            .par_iter()
            .enumerate()
            .flat_map_iter(|(index, block)| block.grains().map(move |_| index as u32))
            .collect();
        self.columns.clear();
        for block in &self.blocks {
            let (at, grains) = ([block.at[0], block.at[2]], block.grains());
            match self.columns.last_mut() {
                Some(last) if last.at == at => last.grains.end = grains.end,
                _ => self.columns.push(Column { at, grains }),
            }
        }
    }

    /// The block at an index.
    pub fn find(&self, at: At) -> Option<&Block> {
        self.index.get(&at).map(|&index| &self.blocks[index as usize])
    }

    /// From one grain to another (diameters).
    pub fn apart(&self, rows: &[Row], to: usize, from: usize) -> V {
        let [a, b] = [to, from].map(|slot| self.blocks[self.of[slot] as usize].at);
        [0, 1, 2]
            .map(|axis| (a[axis] - b[axis]) as f32 * EDGE + rows[to].place[axis] - rows[from].place[axis])
    }

    /// Columns in four sets: of two columns of one set neither is the other's neighbour.
    pub fn colours(&self) -> [Vec<usize>; 4] {
        let mut sets: [Vec<usize>; 4] = Default::default();
        for (index, column) in self.columns.iter().enumerate() {
            sets[((column.at[0] & 1) << 1 | column.at[1] & 1) as usize].push(index);
        }
        sets
    }
}

impl Block {
    /// Its grains.
    pub fn grains(&self) -> std::ops::Range<usize> {
        self.starts[0] as usize..self.starts[ALL_CELLS] as usize
    }
}

/// Moves a grain to the block that its place lies in.
fn settle(row: &mut Row, at: &mut At) {
    for (place, at) in row.place.iter_mut().zip(at) {
        let blocks = (*place / EDGE).floor();
        if blocks != 0.0 {
            *at = at.saturating_add(blocks as i32);
            *place -= blocks * EDGE;
            // A place just below 0 becomes the edge itself.
            if *place >= EDGE {
                *at = at.saturating_add(1);
                *place = 0.0;
            }
        }
    }
}

/// World position (m) of a place in a block.
pub fn world(at: At, place: V, diameter: f64) -> DVec3 {
    DVec3::from(
        [0, 1, 2].map(|axis| (f64::from(at[axis]) * f64::from(EDGE) + f64::from(place[axis])) * diameter),
    )
}

/// Block and place of a world position (m).
pub fn locate(world: DVec3, diameter: f64) -> (At, V) {
    let mut row = Row::default();
    let mut at = [0; 3];
    for axis in 0..3 {
        let place = world[axis] / diameter;
        let block = (place / f64::from(EDGE)).floor();
        at[axis] = block as i32;
        row.place[axis] = (place - block * f64::from(EDGE)) as f32;
    }
    settle(&mut row, &mut at);
    (at, row.place)
}
