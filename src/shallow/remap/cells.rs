//! Moves the liquid of one cell to its new columns.
//!
//! A column that existed before keeps its liquid, on its base, which may rise or sink. Liquid without room there is pushed up, into the
//! next column with room; the same happens to the liquid of a column that has vanished, from the height where it stood. Liquid that finds
//! no room above goes down.

use crate::numeric::lists::refill;
use crate::shallow::columns::NONE;
use crate::shallow::columns::grid::BOTTOMLESS;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::shares::take;

/// Layers for which capacity is reserved from the start.
const LAYERS: usize = 16;

/// A column before the change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OldColumn {
    pub index: u32,
    pub base: i32,
    pub depth: i32,
    pub amounts: [i64; MAX_SCALARS],
}

/// A column after the change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NewColumn {
    pub index: u32,
    pub base: i32,
    pub ceiling: i32,
    /// Depth of the liquid that it receives.
    pub depth: i32,
    /// Index of the column that it was before, or [`NONE`].
    pub from: u32,
    /// Amounts of scalars that it receives.
    pub amounts: [i64; MAX_SCALARS],
}

/// Liquid that must find a column.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Parcel {
    /// It goes to the first column whose ceiling is above this.
    above: i32,
    /// The height at which it stood.
    height: i32,
    units: i64,
    amounts: [i64; MAX_SCALARS],
}

/// The columns of one cell, from the lowest up.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    pub old: Vec<OldColumn>,
    pub new: Vec<NewColumn>,
    /// Underside of the lowest solid after the change.
    pub under: i32,
    /// If there are several columns, one whose base moves further than this (units) counts as a new one.
    pub reach: i64,
    parcels: Vec<Parcel>,
    costs: Vec<i64>,
}

/// Liquid that finds no column in its cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Leftover {
    pub units: i64,
    /// The lowest height at which it stood.
    pub height: i32,
    /// Units that did not stay in their columns, including those that found another one.
    pub displaced: i64,
    /// Amounts of scalars of the units.
    pub amounts: [i64; MAX_SCALARS],
}

impl Default for Cell {
    fn default() -> Self {
        Self {
            old: Vec::with_capacity(LAYERS),
            new: Vec::with_capacity(LAYERS),
            under: BOTTOMLESS,
            reach: 0,
            parcels: Vec::with_capacity(LAYERS),
            costs: Vec::with_capacity((LAYERS + 1) * (LAYERS + 1)),
        }
    }
}

impl Cell {
    /// Gives the old columns' liquid to the new ones.
    pub fn remap(&mut self) -> Leftover {
        self.parcels.clear();
        self.find_same();
        self.keep();
        let mut leftover = Leftover { height: i32::MAX, ..Leftover::default() };
        for at in 0..self.parcels.len() {
            let mut parcel = self.parcels[at];
            leftover.displaced += parcel.units;
            self.place(&mut parcel);
            if parcel.units > 0 {
                leftover.units += parcel.units;
                leftover.height = leftover.height.min(parcel.height);
                leftover.amounts.iter_mut().zip(parcel.amounts).for_each(|(all, left)| *all += left);
            }
        }
        leftover
    }

    /// Finds for each new column the old column that it was.
    fn find_same(&mut self) {
        let reach = self.reach;
        let is_near =
            |(old, new): (&OldColumn, &NewColumn)| (i64::from(old.base) - i64::from(new.base)).abs() <= reach;
        let same_count = self.old.len() == self.new.len();
        if same_count && (self.old.len() == 1 || self.old.iter().zip(&self.new).all(is_near)) {
            self.new.iter_mut().zip(&self.old).for_each(|(new, old)| new.from = old.index);
        } else {
            self.align();
        }
    }

    /// Pairs columns in order, at the least cost (dynamic programming): twice the displacement of a pair's base, and `reach` for each
    /// column without a pair.
    fn align(&mut self) {
        let (rows, width) = (self.old.len(), self.new.len() + 1);
        let pair_cost =
            |old: &OldColumn, new: &NewColumn| 2 * (i64::from(old.base) - i64::from(new.base)).abs();
        refill(&mut self.costs, (0..width as i64).map(|at| at * self.reach));
        for (row, old) in self.old.iter().enumerate() {
            let before = row * width;
            self.costs.push((row as i64 + 1) * self.reach);
            for (at, new) in self.new.iter().enumerate() {
                let pair = self.costs[before + at] + pair_cost(old, new);
                let single = self.costs[before + at + 1].min(self.costs[before + width + at]) + self.reach;
                self.costs.push(pair.min(single));
            }
        }
        let (mut row, mut at) = (rows, width - 1);
        while row > 0 && at > 0 {
            let cost = self.costs[row * width + at];
            let (old, new) = (&self.old[row - 1], &mut self.new[at - 1]);
            if cost == self.costs[(row - 1) * width + at - 1] + pair_cost(old, new) {
                new.from = old.index;
                (row, at) = (row - 1, at - 1);
            } else if cost == self.costs[row * width + at - 1] + self.reach {
                at -= 1;
            } else {
                row -= 1;
            }
        }
    }

    /// Leaves liquid in its columns, and collects what has no room there, from the lowest column up.
    fn keep(&mut self) {
        for old in self.old.iter().filter(|old| old.depth > 0) {
            let (units, amounts) = (i64::from(old.depth), old.amounts);
            let mut parcel = Parcel { above: old.base, height: old.base, units, amounts };
            if let Some(new) = self.new.iter_mut().find(|new| new.from == old.index) {
                new.depth = old.depth.min(new.ceiling - new.base);
                take(&mut parcel.amounts, i64::from(new.depth), units, &mut new.amounts);
                parcel.above = new.ceiling;
                parcel.units -= i64::from(new.depth);
            }
            if parcel.units > 0 {
                self.parcels.push(parcel);
            }
        }
    }

    /// Fills columns with a parcel, from its first candidate up, then from there down; the parcel keeps the rest.
    fn place(&mut self, parcel: &mut Parcel) {
        if self.under != BOTTOMLESS && parcel.above < self.under {
            return;
        }
        let first = self.new.partition_point(|new| new.ceiling <= parcel.above);
        let (below, above) = self.new.split_at_mut(first);
        for new in above.iter_mut().chain(below.iter_mut().rev()) {
            let room = new.ceiling - new.base - new.depth;
            let units = i64::from(room).min(parcel.units);
            new.depth += units as i32;
            take(&mut parcel.amounts, units, parcel.units, &mut new.amounts);
            parcel.units -= units;
        }
    }
}

/// A new column without liquid.
pub(super) fn dry(index: usize, base: i32, ceiling: i32) -> NewColumn {
    NewColumn { index: index as u32, base, ceiling, depth: 0, from: NONE, amounts: [0; MAX_SCALARS] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::TOP;

    /// Remaps columns of (base, depth) to columns of [base, ceiling]; returns the depths and the rest.
    fn remap(old: &[(i32, i32)], new: &[[i32; 2]]) -> (Vec<i32>, Leftover) {
        let mut cell = Cell { under: BOTTOMLESS, reach: 100, ..Cell::default() };
        let column = |(index, &(base, depth)): (usize, &(i32, i32))| OldColumn {
            index: index as u32,
            base,
            depth,
            amounts: [0; MAX_SCALARS],
        };
        cell.old = old.iter().enumerate().map(column).collect();
        cell.new = new.iter().enumerate().map(|(index, ends)| dry(index, ends[0], ends[1])).collect();
        let rest = cell.remap();
        (cell.new.iter().map(|new| new.depth).collect(), rest)
    }

    #[test]
    fn liquid_rides_on_its_base() {
        assert_eq!(remap(&[(10, 5)], &[[5000, TOP]]).0, [5]);
        assert_eq!(remap(&[(10, 5), (200, 7)], &[[90, 120], [130, TOP]]).0, [5, 7]);
    }

    #[test]
    fn a_body_in_a_pool_lifts_what_it_displaces() {
        assert_eq!(remap(&[(0, 100)], &[[0, 30], [60, TOP]]).0, [30, 70]);
        assert_eq!(remap(&[(0, 30), (60, 70)], &[[0, TOP]]).0, [100]);
        // Its base sinks: the liquid from below is pushed up into it.
        assert_eq!(remap(&[(0, 30), (60, 70)], &[[0, 10], [40, TOP]]).0, [10, 90]);
        assert_eq!(remap(&[(0, 30), (60, 70)], &[[40, TOP]]).0, [100]);
    }

    #[test]
    fn columns_that_appear_or_vanish_leave_the_others_their_liquid() {
        // A bridge over the ground; its base is far from the others.
        assert_eq!(remap(&[(0, 5)], &[[3, 1000], [1100, TOP]]).0, [5, 0]);
        assert_eq!(remap(&[(0, 5), (1100, 9)], &[[3, TOP]]).0, [14]);
        assert_eq!(remap(&[(0, 5), (50, 6), (1100, 9)], &[[2, 40], [1103, TOP]]).0, [5, 15]);
    }

    #[test]
    fn what_finds_no_room_is_left_over() {
        let (depths, rest) = remap(&[(0, 50), (100, 60)], &[[40, 50], [TOP, TOP]]);
        assert_eq!(depths, [10, 0]);
        assert_eq!(rest, Leftover { units: 100, displaced: 100, ..Leftover::default() });
        assert_eq!(
            remap(&[(7, 50)], &[]).1,
            Leftover { units: 50, height: 7, displaced: 50, amounts: [0; MAX_SCALARS] }
        );
    }

    #[test]
    fn amounts_go_with_their_units() {
        let mut cell = Cell { under: BOTTOMLESS, reach: 100, ..Cell::default() };
        cell.old = vec![
            OldColumn { index: 0, base: 0, depth: 100, amounts: [1000, -50, 7, 0] },
            OldColumn { index: 1, base: 500, depth: 10, amounts: [10, 0, 0, 1 << 40] },
        ];
        // Thirty units stay, seventy are pushed up into the former upper column.
        cell.new = vec![dry(0, 0, 30), dry(1, 500, TOP)];
        assert_eq!(cell.remap().amounts, [0; MAX_SCALARS]);
        assert_eq!(cell.new[0].amounts, [300, -15, 2, 0]);
        assert_eq!(cell.new[1].amounts, [710, -35, 5, 1 << 40]);
    }

    #[test]
    fn liquid_below_a_solid_that_hangs_does_not_get_on_top_of_it() {
        let mut cell = Cell { under: 100, reach: 10, ..Cell::default() };
        let old =
            |index, base| OldColumn { index, base, depth: 5, amounts: [7 + i64::from(base); MAX_SCALARS] };
        cell.old = vec![old(0, 20), old(1, 200)];
        cell.new = vec![dry(0, 200, TOP)];
        assert_eq!(cell.remap(), Leftover { units: 5, height: 20, displaced: 5, amounts: [27; MAX_SCALARS] });
        assert_eq!(cell.new[0].amounts, [207; MAX_SCALARS]);
        assert_eq!(cell.new[0].depth, 5);
    }
}
