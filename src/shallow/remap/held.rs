//! Liquid that found no room when the terrain moved: it goes to adjacent cells, and waits if it finds no room there either.
//!
//! Shares are whole units and do not depend on the order of parcels, so that a mirrored scene gets mirrored shares.

use crate::numeric::lists::refill;
use crate::shallow::columns::Columns;
use crate::shallow::columns::grid::BOTTOMLESS;
use crate::shallow::pipes::side::Side;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::Account;
use crate::shallow::scalars::shares::{part, take};
use crate::shallow::solver::Flow;

/// Liquid that waits for room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Parcel {
    /// The cell that it came from (`Grid::index`).
    pub cell: u32,
    /// The height at which it stood (units).
    pub height: i32,
    /// Volume (units), above 0.
    pub units: i64,
    /// Amount of each scalar.
    pub amounts: [i64; MAX_SCALARS],
}

impl Parcel {
    /// Its cell, height and units, for a saved state, which stores amounts separately.
    pub(in crate::shallow) fn to_bytes(self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..4].copy_from_slice(&self.cell.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.height.to_le_bytes());
        bytes[8..].copy_from_slice(&self.units.to_le_bytes());
        bytes
    }

    /// Reads what [`Parcel::to_bytes`] wrote; amounts are 0.
    pub(in crate::shallow) fn from_bytes(bytes: &[u8; 16]) -> Self {
        let all = i128::from_le_bytes(*bytes);
        let (cell, height, units) = (all as u32, (all >> 32) as i32, (all >> 64) as i64);
        Self { cell, height, units, amounts: [0; MAX_SCALARS] }
    }

    /// Whether it is valid over these columns.
    pub(in crate::shallow) fn is_valid_in(&self, columns: &Columns) -> bool {
        (self.cell as usize) < columns.grid.cells() && self.height >= 0 && self.units > 0
    }
}

/// What a parcel offers to an adjacent cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Offer {
    cell: u32,
    height: i32,
    units: i64,
    amounts: [i64; MAX_SCALARS],
    parcel: u32,
}

/// All liquid that waits for room.
#[derive(Debug, Clone)]
pub struct Held {
    /// At most one of each cell, sorted by cell, after [`Held::settle`].
    parcels: Vec<Parcel>,
    offers: Vec<Offer>,
    /// Columns of a cell in the order in which they are filled.
    order: Vec<u32>,
}

impl Default for Held {
    fn default() -> Self {
        let (parcels, offers) = (Vec::with_capacity(256), Vec::with_capacity(1024));
        Self { parcels, offers, order: Vec::with_capacity(16) }
    }
}

impl Held {
    /// Reserves capacity for `parcels` more parcels.
    pub(super) fn reserve(&mut self, parcels: usize) {
        self.parcels.reserve(256 + parcels);
        self.offers.reserve(1024 + 4 * parcels);
    }

    /// Adds liquid that finds no room in its cell (`Grid::index`).
    pub(in crate::shallow) fn add(
        &mut self,
        cell: usize,
        height: i32,
        units: i64,
        amounts: [i64; MAX_SCALARS],
    ) {
        if units > 0 {
            self.parcels.push(Parcel { cell: cell as u32, height, units, amounts });
        }
    }

    /// Removes the parcels in cells for which `is_own` is true, and passes them to `take`.
    pub(in crate::shallow) fn take_out(
        &mut self,
        is_own: impl Fn(usize) -> bool,
        mut take: impl FnMut(Parcel),
    ) {
        self.parcels.retain(|parcel| {
            let is_taken = is_own(parcel.cell as usize);
            if is_taken {
                take(*parcel);
            }
            !is_taken
        });
    }

    /// Units that wait.
    pub fn units(&self) -> i64 {
        self.parcels.iter().map(|parcel| parcel.units).sum()
    }

    /// Amount of a scalar in the liquid that waits.
    pub fn amount(&self, scalar: usize) -> i128 {
        self.parcels.iter().map(|parcel| i128::from(parcel.amounts[scalar])).sum()
    }

    /// Clears all amounts, because the scalars have changed.
    pub(in crate::shallow) fn forget_amounts(&mut self) {
        self.parcels.iter_mut().for_each(|parcel| parcel.amounts = [0; MAX_SCALARS]);
    }

    /// The waiting liquid, by cell: part of the state.
    pub fn parcels(&self) -> &[Parcel] {
        &self.parcels
    }

    /// Restores the parcels that [`Held::parcels`] returned.
    pub fn set(&mut self, parcels: impl Iterator<Item = Parcel>) {
        refill(&mut self.parcels, parcels);
    }

    /// Gives waiting liquid to columns with room: first of its own cell, then of the four beside it in equal shares. Liquid from a cell
    /// without ground that finds no room beside it falls: returns how much (units).
    pub(super) fn settle(&mut self, columns: &Columns, flow: &mut Flow) -> i64 {
        if self.parcels.is_empty() {
            return 0;
        }
        self.unite();
        for parcel in &mut self.parcels {
            put(columns, flow, &mut self.order, parcel);
        }
        self.parcels.retain(|parcel| parcel.units > 0);
        self.offer(columns, flow);
        self.take(columns, flow);
        let mut fallen = 0;
        self.parcels.retain(|parcel| {
            let falls = parcel.units > 0 && is_void(columns, parcel.cell, parcel.height);
            if falls {
                fallen += parcel.units;
                flow.amounts.add_to_account(Account::Lost, &parcel.amounts);
            } else if parcel.units == 0 {
                // What rounding removed from the shares of adjacent cells.
                flow.amounts.add_to_account(Account::Dried, &parcel.amounts);
            }
            parcel.units > 0 && !falls
        });
        fallen
    }

    /// Merges the parcels of each cell, and sorts them.
    pub(in crate::shallow) fn unite(&mut self) {
        self.parcels.sort_unstable();
        self.parcels.dedup_by(|next, first| {
            let same = next.cell == first.cell;
            if same {
                first.units += next.units;
                first.amounts.iter_mut().zip(next.amounts).for_each(|(all, own)| *all += own);
            }
            same
        });
    }

    /// Offers each parcel to the adjacent cells that have room.
    fn offer(&mut self, columns: &Columns, flow: &Flow) {
        let grid = &columns.grid;
        self.offers.clear();
        for (number, parcel) in self.parcels.iter().enumerate() {
            let own = grid.position(parcel.cell as usize);
            let first = self.offers.len();
            for cell in Side::ALL.into_iter().filter_map(|side| side.cell(own, grid.size)) {
                let cell = grid.index(cell) as u32;
                if room(columns, flow, cell, parcel.height) > 0 {
                    let (height, amounts) = (parcel.height, [0; MAX_SCALARS]);
                    self.offers.push(Offer { cell, height, units: 0, amounts, parcel: number as u32 });
                }
            }
            let count = (self.offers.len() - first) as i64;
            for offer in &mut self.offers[first..] {
                offer.units = parcel.units / count;
                offer.amounts = part(&parcel.amounts, offer.units, parcel.units);
            }
        }
    }

    /// Fills cells with the parcels offered to them; if these exceed the cell's room, all are reduced by the same factor.
    fn take(&mut self, columns: &Columns, flow: &mut Flow) {
        self.offers.retain(|offer| offer.units > 0);
        self.offers.sort_unstable();
        let parcels = &mut self.parcels;
        for offers in self.offers.chunk_by(|a, b| a.cell == b.cell) {
            let offered: i64 = offers.iter().map(|offer| offer.units).sum();
            // The minimum over all offers: liquid from below an overhanging solid finds no room above it.
            let rooms = offers.iter().map(|offer| room(columns, flow, offer.cell, offer.height));
            let room = rooms.min().unwrap_or(0);
            for offer in offers {
                let units = if offered <= room {
                    offer.units
                } else {
                    (i128::from(offer.units) * i128::from(room) / i128::from(offered)) as i64
                };
                let amounts = part(&offer.amounts, units, offer.units);
                let mut parcel = Parcel { cell: offer.cell, height: offer.height, units, amounts };
                put(columns, flow, &mut self.order, &mut parcel);
                let from = &mut parcels[offer.parcel as usize];
                from.units -= units - parcel.units;
                for (at, from) in from.amounts.iter_mut().enumerate() {
                    *from -= amounts[at] - parcel.amounts[at];
                }
            }
        }
    }
}

/// Whether a cell is void at a height: it has no ground, or only ground that hangs above.
fn is_void(columns: &Columns, cell: u32, height: i32) -> bool {
    let lowest = columns_of(columns, cell).next();
    lowest.is_none_or(|lowest| {
        let under = columns.unders()[lowest];
        under != BOTTOMLESS && height < under
    })
}

fn columns_of(columns: &Columns, cell: u32) -> impl Iterator<Item = usize> {
    columns.of_cell(columns.grid.position(cell as usize))
}

fn room_of(columns: &Columns, flow: &Flow, column: usize) -> i64 {
    let room = columns.ceilings()[column] - columns.bases()[column] - flow.depth[column];
    i64::from(room.max(0))
}

/// The room of a cell for liquid at a height (units).
fn room(columns: &Columns, flow: &Flow, cell: u32, height: i32) -> i64 {
    if is_void(columns, cell, height) {
        return 0;
    }
    columns_of(columns, cell).map(|column| room_of(columns, flow, column)).sum()
}

/// Fills the columns of a cell, from the one at the parcel's height up, then from there down; the parcel keeps the rest.
fn put(columns: &Columns, flow: &mut Flow, order: &mut Vec<u32>, parcel: &mut Parcel) {
    if is_void(columns, parcel.cell, parcel.height) {
        return;
    }
    refill(order, columns_of(columns, parcel.cell).map(|column| column as u32));
    let first = order.partition_point(|&column| columns.ceilings()[column as usize] <= parcel.height);
    let (below, above) = order.split_at(first);
    for &column in above.iter().chain(below.iter().rev()) {
        let column = column as usize;
        let units = room_of(columns, flow, column).min(parcel.units);
        if units > 0 {
            let units = flow.change_depth(columns, column, units);
            let mut amounts = [0; MAX_SCALARS];
            take(&mut parcel.amounts, units, parcel.units, &mut amounts);
            parcel.units -= units;
            flow.amounts.add_amounts(column, &amounts);
        }
    }
}
