//! Liquid of coarse cells that does not make up a coarse unit: it waits in its cell, with the scalars that it carries.

use super::FINE_PER_COARSE;
use crate::numeric::lists::reset;
use crate::shallow::Shallow;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::Account;
use crate::shallow::scalars::shares::{integer, part};

/// A quantity of liquid, as in a column or of a transfer: units, and amounts of scalars.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(in crate::shallow) struct Contents {
    pub units: i64,
    pub amounts: [i64; MAX_SCALARS],
}

impl Contents {
    /// The sum of both.
    pub fn plus(mut self, other: &Self) -> Self {
        self.units += other.units;
        self.amounts.iter_mut().zip(other.amounts).for_each(|(all, own)| *all += own);
        self
    }

    /// The difference of both.
    pub fn minus(self, other: &Self) -> Self {
        let other = Self { units: -other.units, amounts: other.amounts.map(|amount| -amount) };
        self.plus(&other)
    }

    /// Converts the contents of a coarse column to fine units.
    pub fn in_fine(self) -> Self {
        Self {
            units: FINE_PER_COARSE * self.units,
            amounts: self.amounts.map(|amount| FINE_PER_COARSE * amount),
        }
    }

    /// The share of this that belongs to a count of its units.
    pub fn part(&self, units: i64) -> Self {
        Self { units, amounts: part(&self.amounts, units, self.units) }
    }
}

/// The remainders of all coarse cells (fine units).
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Remainders {
    units: Vec<i64>,
    /// Empty without scalars.
    amounts: Vec<[i64; MAX_SCALARS]>,
}

impl Remainders {
    /// Empty, for this many cells.
    pub fn new(cells: usize) -> Self {
        Self { units: vec![0; cells], amounts: Vec::new() }
    }

    /// Sets the count of scalars that the liquid carries; all amounts are 0.
    pub fn set_scalars(&mut self, scalars: usize) {
        reset(&mut self.amounts, if scalars > 0 { self.units.len() } else { 0 }, [0; MAX_SCALARS]);
    }

    /// Removes all remainders.
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

    /// The remainder of a cell.
    pub fn of(&self, cell: usize) -> Contents {
        Contents { units: self.units[cell], amounts: self.amounts.get(cell).copied().unwrap_or_default() }
    }

    /// Replaces the remainder of a cell.
    pub fn set(&mut self, cell: usize, contents: Contents) {
        self.units[cell] = contents.units;
        if let Some(amounts) = self.amounts.get_mut(cell) {
            *amounts = contents.amounts;
        }
    }

    /// Removes the remainder of a cell and returns it.
    pub fn take(&mut self, cell: usize) -> Contents {
        let contents = self.of(cell);
        self.set(cell, Contents::default());
        contents
    }

    /// Cells with a remainder, and the remainder.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Contents)> + '_ {
        (0..self.len())
            .map(|cell| (cell, self.of(cell)))
            .filter(|(_, contents)| *contents != Contents::default())
    }

    /// Total of fine units.
    pub fn units(&self) -> i64 {
        self.units.iter().sum()
    }

    /// Total amount of a scalar.
    pub fn amount(&self, scalar: usize) -> i128 {
        self.amounts.iter().map(|amounts| i128::from(amounts[scalar])).sum()
    }

    /// Adds liquid (fine units) to a cell's remainder, and takes out whole coarse units (returned in coarse units) with their share of all
    /// amounts.
    pub fn take_whole_units(&mut self, cell: usize, contents: &Contents) -> Contents {
        let all = self.of(cell).plus(contents);
        let rest = all.units.rem_euclid(FINE_PER_COARSE);
        let mut whole = Contents { units: (all.units - rest) / FINE_PER_COARSE, amounts: [0; MAX_SCALARS] };
        let mut left = Contents { units: rest, amounts: [0; MAX_SCALARS] };
        if self.has_amounts() {
            let share = if all.units > 0 { part(&all.amounts, rest, all.units) } else { all.amounts };
            for (at, share) in share.into_iter().enumerate() {
                // What is taken out must be whole coarse amounts.
                left.amounts[at] = share + (all.amounts[at] - share).rem_euclid(FINE_PER_COARSE);
                whole.amounts[at] = (all.amounts[at] - left.amounts[at]) / FINE_PER_COARSE;
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
pub(super) fn of_column(liquid: &Shallow, column: usize) -> Contents {
    let amounts = &liquid.flow.amounts;
    let amount = |at: usize| if at < amounts.count() { integer(amounts.amounts[at][column]) } else { 0 };
    Contents { units: i64::from(liquid.flow.depths()[column]), amounts: std::array::from_fn(amount) }
}

/// Adds to the contents of a column (negative: removes). What does not fit waits in the cell; amounts that rounding leaves in a dry column
/// are removed and counted.
pub(super) fn add_to_column(liquid: &mut Shallow, column: usize, contents: &Contents) {
    if *contents == Contents::default() {
        return;
    }
    let Shallow { flow, columns, .. } = &mut *liquid;
    let given = flow.change_depth(columns, column, contents.units);
    flow.amounts.add_amounts(column, &contents.amounts);
    let cell = columns.grid.index(columns.cell(column));
    let base = columns.bases()[column];
    let all = of_column(liquid, column);
    let Shallow { flow, remap, .. } = liquid;
    if given < contents.units {
        let over = contents.units - given;
        let off = Contents { units: all.units + over, ..all }.part(over);
        flow.amounts.add_amounts(column, &off.amounts.map(|amount| -amount));
        remap.held.add(cell, base, over, off.amounts);
    } else if all.units == 0 && all.amounts != [0; MAX_SCALARS] {
        flow.amounts.add_amounts(column, &all.amounts.map(|amount| -amount));
        flow.amounts.add_to_account(Account::Dried, &all.amounts);
    }
}
