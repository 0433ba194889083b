//! Splashes: drops land on several columns.
//!
//! A drop that hits a surface spreads over about twice its own width. If all of it went to one column, where the liquid is thinner than the
//! drop, it would form a spike and leave ripples of a cell's size. Equal parts go to the surrounding columns at about the same height that
//! are open towards its own.

use super::waiting::add;
use crate::shallow::columns::Columns;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::shares::part;

/// Maximum radius of the spread (cells).
const MAX_SPREAD: i32 = 3;

/// Liquid that lands on a column: units and amounts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Landing {
    pub column: u32,
    pub units: i64,
    pub amounts: [i64; MAX_SCALARS],
}

/// Adds up the landings on each column, so that the result does not depend on their order; sorts by column.
pub(super) fn merge(landed: &mut Vec<Landing>) {
    landed.sort_unstable_by_key(|landing| landing.column);
    landed.dedup_by(|next, first| {
        let same = next.column == first.column;
        if same {
            first.units += next.units;
            add(&mut first.amounts, &next.amounts);
        }
        same
    });
}

/// Gives equal parts to the surrounding columns, if the list then has at most `max_landings` entries; otherwise does nothing.
pub(super) fn spread(columns: &Columns, landed: &mut Vec<Landing>, max_landings: usize) {
    let mut count = 0;
    for landing in &*landed {
        for_each_spread(columns, landing, |_| count += 1);
    }
    if landed.len() + count > max_landings {
        return;
    }
    for at in 0..landed.len() {
        let landing = landed[at];
        let mut count = 1;
        for_each_spread(columns, &landing, |_| count += 1);
        let units = landing.units / count;
        let amounts = part(&landing.amounts, units, landing.units);
        for_each_spread(columns, &landing, |column| {
            let own = &mut landed[at];
            own.units -= units;
            own.amounts.iter_mut().zip(amounts).for_each(|(own, part)| *own -= part);
            landed.push(Landing { column, units, amounts });
        });
    }
}

/// The columns that a landing spreads to.
fn for_each_spread(columns: &Columns, landing: &Landing, mut with: impl FnMut(u32)) {
    let (own, grid) = (landing.column as usize, columns.grid);
    let depth = landing.units as f64 * columns.heights.unit / grid.cell;
    // Squared diameter (cells) of a ball of its volume.
    let radius = libm::cbrt(0.75 / std::f64::consts::PI * depth);
    let square = (4.0 * radius * radius).min(f64::from(MAX_SPREAD * MAX_SPREAD)) as i32;
    if square < 1 {
        return;
    }
    let ([x, z], base) = (columns.cell(own), columns.bases()[own]);
    let step = grid.cell / columns.heights.unit;
    for south in -MAX_SPREAD..=MAX_SPREAD {
        for east in -MAX_SPREAD..=MAX_SPREAD {
            let away = east * east + south * south;
            if away == 0 || away > square {
                continue;
            }
            let cell = [x.wrapping_add_signed(east as isize), z.wrapping_add_signed(south as isize)];
            if cell[0] >= grid.size[0] || cell[1] >= grid.size[1] {
                continue;
            }
            // At most one column per cell, no further up or down than a slope of 45 degrees.
            let max_rise = step * f64::from(away).sqrt();
            let joins = |&column: &usize| {
                f64::from((columns.bases()[column] - base).abs()) <= max_rise && columns.overlap(own, column)
            };
            if let Some(column) = columns.of_cell(cell).find(joins) {
                with(column as u32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
    use crate::shallow::terrain::Solids;

    #[test]
    fn a_drop_spreads_over_level_ground_and_not_over_an_edge() {
        let heights = Heights::between(0.0, 1.0).unwrap();
        let grid = Grid { cell: 0.001, origin: [0.0; 2], size: [20, 20] };
        let cells = (0..grid.cells())
            .map(|index| vec![[BOTTOMLESS, heights.round(if index % 20 < 10 { 0.5 } else { 0.1 })]]);
        let columns = Columns::new(&Solids::new(grid, heights, cells));
        let spread_at = |x: usize, volume: f64| {
            let column = columns.column([x, 9], 0).unwrap() as u32;
            let units = (volume / (1e-6 * heights.unit)) as i64;
            let mut landed = Vec::with_capacity(200);
            landed.push(Landing { column, units, amounts: [7 * units; MAX_SCALARS] });
            spread(&columns, &mut landed, 200);
            merge(&mut landed);
            assert_eq!(landed.iter().map(|landing| landing.units).sum::<i64>(), units);
            assert!(landed.iter().all(|landing| landing.amounts == [7 * landing.units; MAX_SCALARS]));
            assert!(landed.iter().all(|landing| columns.cell(landing.column as usize)[0] < 10) == (x < 10));
            landed.len()
        };
        // Balls with radii of 0.2 mm, 0.5 mm and many cells, in the open and beside the edge.
        assert_eq!([3.4e-11, 5.3e-10, 1e-6].map(|volume| spread_at(5, volume)), [1, 5, 29]);
        assert_eq!([5.3e-10, 1e-6].map(|volume| spread_at(9, volume)), [4, 18]);
        // Without capacity for all parts it lands in one.
        let mut landed = Vec::with_capacity(4);
        landed.push(Landing {
            column: columns.column([5, 5], 0).unwrap() as u32,
            units: 1 << 29,
            amounts: [0; MAX_SCALARS],
        });
        spread(&columns, &mut landed, 4);
        assert_eq!((landed.len(), landed[0].units), (1, 1 << 29));
    }
}
