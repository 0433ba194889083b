//! Particles sorted into cells, for fast neighbour search.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::geometry::{Coord, DVec3};

/// Beginning of the message about particles too far apart, by which callers recognise it.
pub const TOO_FAR: &str = "particles reach";
/// Bits of each axis in a key.
const BITS: u32 = 21;
/// Maximum distance between two cells on an axis.
const FARTHEST: i64 = 1 << BITS;

/// Particles in the order of the cells that hold them. Their input order makes no difference: within a cell they are sorted by position,
/// then by rank.
#[derive(Debug, Default)]
pub struct Cells {
    /// Edge of a cell (m).
    edge: f64,
    /// Minimum coordinates of the cells that hold particles.
    low: Coord,
    /// Keys of the cells that hold particles, ascending: x in the highest bits, then y, then z.
    keys: Vec<u64>,
    /// `start[n]..start[n + 1]` are the particles of cell `n`.
    start: Vec<u32>,
    /// Input index of each particle.
    pub order: Vec<u32>,
    /// Position of each particle in its cell (edges, 0..1).
    offsets: Vec<[f32; 3]>,
    /// Count of particles in each octant of a cell.
    octants: Vec<[u16; 8]>,
}

/// A particle while it is sorted.
#[derive(Clone, Copy)]
struct Item {
    key: u64,
    /// Bits of the offset: as it is not negative, they sort as the numbers do.
    offset: [u32; 3],
    index: u32,
}

impl Cells {
    /// Sorts particles at positions (m) into cells of `edge` (m); `rank` orders those at the same position.
    ///
    /// # Errors
    /// Particles so far apart that there are more than two million cells between them.
    pub fn new(positions: &[DVec3], edge: f64, rank: impl Fn(u32) -> i64 + Sync) -> Result<Self> {
        let cell_of = |position: &DVec3| [0, 1, 2].map(|axis| (position[axis] / edge).floor());
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for position in positions {
            let cell = cell_of(position);
            for axis in 0..3 {
                low[axis] = low[axis].min(cell[axis]);
                high[axis] = high[axis].max(cell[axis]);
            }
        }
        if positions.is_empty() {
            return Ok(Self { edge, ..Self::default() });
        }
        let limit = f64::from(i32::MAX / 16);
        for axis in 0..3 {
            if high[axis] - low[axis] >= FARTHEST as f64 || low[axis] < -limit || high[axis] > limit {
                let far = (high[axis] - low[axis]).max(-low[axis]).max(high[axis]) * edge;
                return Err(Error::argument(format!(
                    "{TOO_FAR} over {far:.3} m, too far for cells of {edge} m"
                )));
            }
        }
        let low_cell = low.map(|x| x as i32);
        let item = |(position, index): (&DVec3, u32)| {
            let cell = cell_of(position);
            let part = |axis: usize| ((position[axis] / edge - cell[axis]) as f32).clamp(0.0, 1.0);
            let key = pack([0, 1, 2].map(|axis| (cell[axis] - low[axis]) as u64));
            // Adding 0 makes -0 positive.
            Item { key, offset: [0, 1, 2].map(|axis| (part(axis) + 0.0).to_bits()), index }
        };
        let mut items: Vec<Item> =
            positions.par_iter().zip(0..positions.len() as u32).with_min_len(4096).map(item).collect();
        let compare = |a: &Item, b: &Item| {
            a.key.cmp(&b.key).then(a.offset.cmp(&b.offset)).then_with(|| rank(a.index).cmp(&rank(b.index)))
        };
        items.par_sort_unstable_by(compare);
        let mut cells = Self { edge, low: low_cell, ..Self::default() };
        for (n, item) in items.iter().enumerate() {
            if cells.keys.last() != Some(&item.key) {
                cells.keys.push(item.key);
                cells.start.push(n as u32);
                cells.octants.push([0; 8]);
            }
            let octant =
                item.offset.iter().fold(0, |at, bits| at << 1 | usize::from(f32::from_bits(*bits) >= 0.5));
            let count = &mut cells.octants.last_mut().expect("just pushed")[octant];
            *count = count.saturating_add(1);
        }
        cells.start.push(items.len() as u32);
        cells.order = items.iter().map(|item| item.index).collect();
        cells.offsets = items.iter().map(|item| item.offset.map(f32::from_bits)).collect();
        Ok(cells)
    }

    /// Edge of a cell (m).
    pub fn edge(&self) -> f64 {
        self.edge
    }

    /// Coordinates of the cells that hold particles, ascending.
    pub fn coords(&self) -> impl Iterator<Item = Coord> + '_ {
        self.keys.iter().map(|key| {
            let at = unpack(*key);
            [0, 1, 2].map(|axis| self.low[axis] + at[axis] as i32)
        })
    }

    /// Input indices of the particles of each cell that holds any.
    pub fn runs(&self) -> impl Iterator<Item = &[u32]> {
        self.start.windows(2).map(|ends| &self.order[ends[0] as usize..ends[1] as usize])
    }

    /// The index of a cell, if it holds particles.
    pub fn find(&self, coord: Coord) -> Option<usize> {
        let at = [0, 1, 2].map(|axis| i64::from(coord[axis]) - i64::from(self.low[axis]));
        if at.iter().any(|x| !(0..FARTHEST).contains(x)) {
            return None;
        }
        self.keys.binary_search(&pack(at.map(|x| x as u64))).ok()
    }

    /// Calls `see` with the index and coordinates of each cell from `low` to `high` that holds particles, in ascending order.
    fn between(&self, low: Coord, high: Coord, mut see: impl FnMut(usize, Coord)) {
        let shifted = |at: Coord| [0, 1, 2].map(|axis| i64::from(at[axis]) - i64::from(self.low[axis]));
        let (first, last) = (shifted(low), shifted(high).map(|x| x.min(FARTHEST - 1)));
        if last.iter().any(|x| *x < 0) {
            return;
        }
        for x in first[0].max(0)..=last[0] {
            for y in first[1].max(0)..=last[1] {
                let begin = pack([x, y, first[2].max(0)].map(|x| x as u64));
                let end = pack([x, y, last[2]].map(|x| x as u64));
                let at = self.keys.partition_point(|key| *key < begin);
                for (cell, key) in self.keys.iter().enumerate().skip(at).take_while(|(_, key)| **key <= end) {
                    let at = unpack(*key);
                    see(cell, [0, 1, 2].map(|axis| self.low[axis] + at[axis] as i32));
                }
            }
        }
    }

    /// Calls `see` with the particles in the cells from `low` to `high`: their indices in the order of cells, and their offsets from the
    /// minimum corner of the cell `from` (edges).
    pub fn near(&self, low: Coord, high: Coord, from: Coord, mut see: impl FnMut(usize, [f32; 3])) {
        self.between(low, high, |cell, at| {
            let shift = [0, 1, 2].map(|axis| (at[axis] - from[axis]) as f32);
            for n in self.start[cell] as usize..self.start[cell + 1] as usize {
                see(n, [0, 1, 2].map(|axis| shift[axis] + self.offsets[n][axis]));
            }
        });
    }

    /// Calls `see` with each octant of the cells from `low` to `high` that hold particles: its coordinates (in halves of a cell's edge) and
    /// its count of particles.
    pub fn counts(&self, low: Coord, high: Coord, mut see: impl FnMut([i32; 3], u16)) {
        self.between(low, high, |cell, at| {
            for (octant, count) in self.octants[cell].iter().enumerate() {
                let part = [octant >> 2, octant >> 1 & 1, octant & 1];
                see([0, 1, 2].map(|axis| 2 * at[axis] + part[axis] as i32), *count);
            }
        });
    }
}

fn pack([x, y, z]: [u64; 3]) -> u64 {
    x << (2 * BITS) | y << BITS | z
}

fn unpack(key: u64) -> [u64; 3] {
    let mask = (1 << BITS) - 1;
    [key >> (2 * BITS), key >> BITS & mask, key & mask]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particles_are_found_in_the_cells_around_in_any_order() {
        let positions: Vec<DVec3> = (0..200)
            .map(|n| DVec3::new((n * 37 % 50) as f64, (n * 13 % 40) as f64 - 20.0, (n % 30) as f64) * 0.1)
            .collect();
        let mut reversed = positions.clone();
        reversed.reverse();
        let near = |positions: &[DVec3]| {
            let cells = Cells::new(positions, 0.7, |_| 0).unwrap();
            let mut found = Vec::new();
            cells.near([1, -2, 0], [3, 0, 2], [2, 0, 1], |_, offset| found.push(offset.map(f32::to_bits)));
            found
        };
        let found = near(&positions);
        assert_eq!(found, near(&reversed));
        let is_in = |p: &&DVec3| {
            let cell = [0, 1, 2].map(|axis| (p[axis] / 0.7).floor() as i32);
            (1..=3).contains(&cell[0]) && (-2..=0).contains(&cell[1]) && (0..=2).contains(&cell[2])
        };
        assert_eq!(found.len(), positions.iter().filter(is_in).count());
        assert!(Cells::new(&[DVec3::zeros(), DVec3::new(1e7, 0.0, 0.0)], 0.1, |_| 0).is_err());
    }
}
