//! What does not make up a whole coarse unit in a coarse cell: it waits there, with what it carries.

use super::FINE;
use crate::numeric::lists::reset;
use crate::shallow::Shallow;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::Account;
use crate::shallow::scalars::shares::{integer, part};

/// Some liquid: units, and amounts of scalars.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(in crate::shallow) struct Load {
    pub units: i64,
    pub amounts: [i64; MAX_SCALARS],
}

impl Load {
    /// The sum of both.
    pub fn with(mut self, other: &Self) -> Self {
        self.units += other.units;
        self.amounts.iter_mut().zip(other.amounts).for_each(|(all, own)| *all += own);
        self
    }

    /// What is left without another load.
    pub fn without(self, other: &Self) -> Self {
        let other = Self { units: -other.units, amounts: other.amounts.map(|amount| -amount) };
        self.with(&other)
    }

    /// The load of a coarse column in fine units.
    pub fn in_fine(self) -> Self {
        Self { units: FINE * self.units, amounts: self.amounts.map(|amount| FINE * amount) }
    }

    /// The share of this load that a count of units takes along.
    pub fn part(&self, units: i64) -> Self {
        Self { units, amounts: part(&self.amounts, units, self.units) }
    }
}

/// The remainders of all coarse cells (fine units).
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Rests {
    units: Vec<i64>,
    /// Empty where nothing is carried.
    amounts: Vec<[i64; MAX_SCALARS]>,
}

impl Rests {
    /// Empty, for this many cells.
    pub fn new(cells: usize) -> Self {
        Self { units: vec![0; cells], amounts: Vec::new() }
    }

    /// From now on the liquid carries this many scalars, all 0 so far.
    pub fn carry(&mut self, scalars: usize) {
        reset(&mut self.amounts, if scalars > 0 { self.units.len() } else { 0 }, [0; MAX_SCALARS]);
    }

    /// Removes everything that waits.
    pub fn clear(&mut self) {
        self.units.fill(0);
        self.amounts.fill([0; MAX_SCALARS]);
    }

    /// Count of cells.
    pub fn len(&self) -> usize {
        self.units.len()
    }

    /// Whether scalars may be carried.
    pub fn has_amounts(&self) -> bool {
        !self.amounts.is_empty()
    }

    /// What waits in a cell.
    pub fn of(&self, cell: usize) -> Load {
        Load { units: self.units[cell], amounts: self.amounts.get(cell).copied().unwrap_or_default() }
    }

    /// Replaces what waits in a cell.
    pub fn set(&mut self, cell: usize, load: Load) {
        self.units[cell] = load.units;
        if let Some(amounts) = self.amounts.get_mut(cell) {
            *amounts = load.amounts;
        }
    }

    /// Takes what waits in a cell.
    pub fn take(&mut self, cell: usize) -> Load {
        let load = self.of(cell);
        self.set(cell, Load::default());
        load
    }

    /// Cells where something waits, and what.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Load)> + '_ {
        (0..self.len()).map(|cell| (cell, self.of(cell))).filter(|(_, load)| *load != Load::default())
    }

    /// Total of fine units.
    pub fn units(&self) -> i64 {
        self.units.iter().sum()
    }

    /// Total amount of a scalar.
    pub fn amount(&self, scalar: usize) -> i128 {
        self.amounts.iter().map(|amounts| i128::from(amounts[scalar])).sum()
    }

    /// Adds liquid (in fine units) to a cell's remainder, and takes what makes whole coarse units (in coarse units), with its share of all
    /// amounts.
    pub fn whole(&mut self, cell: usize, load: &Load) -> Load {
        let all = self.of(cell).with(load);
        let rest = all.units.rem_euclid(FINE);
        let mut whole = Load { units: (all.units - rest) / FINE, amounts: [0; MAX_SCALARS] };
        let mut left = Load { units: rest, amounts: [0; MAX_SCALARS] };
        if self.has_amounts() {
            let share = if all.units > 0 { part(&all.amounts, rest, all.units) } else { all.amounts };
            for (at, share) in share.into_iter().enumerate() {
                // So that the other amounts make whole coarse ones.
                left.amounts[at] = share + (all.amounts[at] - share).rem_euclid(FINE);
                whole.amounts[at] = (all.amounts[at] - left.amounts[at]) / FINE;
            }
            if whole.units == 0 {
                (left.amounts, whole.amounts) = (all.amounts, [0; MAX_SCALARS]);
            }
        }
        self.set(cell, left);
        whole
    }
}

/// The contents of a column.
pub(super) fn of_column(liquid: &Shallow, column: usize) -> Load {
    let amounts = &liquid.flow.amounts;
    let amount = |at: usize| if at < amounts.count() { integer(amounts.amounts[at][column]) } else { 0 };
    Load { units: i64::from(liquid.flow.depths()[column]), amounts: std::array::from_fn(amount) }
}

/// Changes the contents of a column: what does not fit in it waits in its cell, and what rounding leaves in a dry one is counted.
pub(super) fn change(liquid: &mut Shallow, column: usize, load: &Load) {
    if *load == Load::default() {
        return;
    }
    let Shallow { flow, columns, .. } = &mut *liquid;
    let given = flow.change_depth(columns, column, load.units);
    flow.amounts.put(column, &load.amounts);
    let cell = columns.grid.index(columns.cell(column));
    let base = columns.bases()[column];
    let all = of_column(liquid, column);
    let Shallow { flow, remap, .. } = liquid;
    if given < load.units {
        let over = load.units - given;
        let off = Load { units: all.units + over, ..all }.part(over);
        flow.amounts.put(column, &off.amounts.map(|amount| -amount));
        remap.held.add(cell, base, over, off.amounts);
    } else if all.units == 0 && all.amounts != [0; MAX_SCALARS] {
        flow.amounts.put(column, &all.amounts.map(|amount| -amount));
        flow.amounts.count_in(Account::Dried, &all.amounts);
    }
}
