//! Which terrain a liquid is on: snapshots and saved states compare this, so that neither has to compare all columns each time.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use xxhash_rust::xxh3::Xxh3;

use crate::shallow::columns::{Columns, STRIP};

/// Distinguishes the columns of a liquid from all others of the process by a number, and from those of other processes by a hash. Changed
/// columns get a new identity.
#[derive(Debug)]
pub(in crate::shallow) struct Identity {
    /// A number that no other columns have had in this process; over 0.
    pub number: u64,
    /// Computed on first use.
    hash: OnceLock<[u8; 16]>,
}

impl Identity {
    /// For columns that are new or have just changed.
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self { number: NEXT.fetch_add(1, Ordering::Relaxed), hash: OnceLock::new() }
    }

    /// Hash of the columns that have this identity: the same on every machine.
    pub fn hash(&self, columns: &Columns) -> [u8; 16] {
        *self.hash.get_or_init(|| hash(columns))
    }
}

fn hash(columns: &Columns) -> [u8; 16] {
    let mut hash = Xxh3::new();
    let (grid, heights) = (&columns.grid, &columns.heights);
    for number in [grid.cell, grid.origin[0], grid.origin[1], heights.low, heights.unit] {
        hash.update(&number.to_le_bytes());
    }
    for number in [grid.size[0], grid.size[1], columns.strips().len()] {
        hash.update(&(number as u64).to_le_bytes());
    }
    for (index, strip) in columns.strips().iter().enumerate() {
        for number in [strip.row, strip.layer, strip.at, columns.present(index).into()] {
            hash.update(&number.to_le_bytes());
        }
    }
    for numbers in [columns.bases(), columns.ceilings(), columns.unders()] {
        for strip in numbers[..columns.len()].as_chunks::<STRIP>().0 {
            hash.update(strip.map(i32::to_le_bytes).as_flattened());
        }
    }
    hash.digest128().to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::super::Solids;
    use super::*;
    use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};

    fn columns(cell: f64, high: f64, ground: i32) -> Columns {
        let grid = Grid { cell, origin: [0.0; 2], size: [20, 3] };
        let heights = Heights::between(0.0, high).unwrap();
        Columns::new(&Solids::new(grid, heights, (0..60).map(|at| vec![[BOTTOMLESS, ground + at / 59]])))
    }

    #[test]
    fn terrains_differ_by_their_hash_and_every_identity_by_its_number() {
        let own = columns(1.0, 2.0, 10);
        let (first, second) = (Identity::new(), Identity::new());
        assert_ne!(first.number, second.number);
        assert_eq!(first.hash(&own), second.hash(&own));
        for other in [columns(1.5, 2.0, 10), columns(1.0, 3.0, 10), columns(1.0, 2.0, 11)] {
            assert_ne!(first.hash(&own), Identity::new().hash(&other));
        }
    }
}
