//! K_max: scales the inflow of columns to their room (thesis 4.1.1). Few rows have columns that could fill up in a step: they are found
//! from the unscaled sums of inflow.

use super::scale;
use crate::shallow::solver::rows::band_views::Parts;
use crate::shallow::solver::rows::buffers::{RING, Rows};
use crate::shallow::solver::rows::positions::Place;
use crate::shallow::solver::rows::{Ground, each_link};
use crate::shallow::solver::viscous_flux::{max, min};

impl Rows {
    /// K_max of a row's columns, as if nothing flowed out; returns whether any is not 1.
    #[inline(always)]
    pub(in crate::shallow::solver) fn find_most(
        &mut self,
        ground: &Ground,
        parts: &Parts,
        row: usize,
    ) -> bool {
        let Ground { columns, active, .. } = ground;
        let part = parts.see(row);
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        if !own.may_fill {
            return false;
        }
        let position = Place::new(columns, row);
        let [most, _] = &mut own.most;
        for span in active.row(row) {
            let (at, len) = (position.of(span.first), span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            scale::inflow(&around, &mut most[at..at + len]);
        }
        let sums = &mut self.linked;
        each_link(ground, parts, row, false, |column, units| sums[position.of(column)] += units);
        for &column in ground.pipes.links.columns_of(row) {
            most[position.of(column)] += std::mem::take(&mut sums[position.of(column)]) as f32;
        }
        let mut is_full = false;
        for span in active.row(row) {
            let (at, first, len) = (position.of(span.first), span.first as usize, span.len as usize);
            let (base, ceiling) = (&columns.bases()[first..], &columns.ceilings()[first..]);
            let depth = &part.depth[first - part.start..];
            is_full |= scale::find_most(base, ceiling, depth, &mut most[at..at + len]) < 1.0;
        }
        own.is_full = is_full;
        is_full
    }

    /// Refines K_max of a row's columns with the room that their outflow makes.
    #[inline(always)]
    pub(in crate::shallow::solver) fn find_more(&mut self, ground: &Ground, parts: &Parts, row: usize) {
        let Ground { columns, pipes, active, .. } = ground;
        let part = parts.see(row);
        let rows = [row % RING, (row + RING - 1) % RING, (row + 1) % RING];
        let [own, north, south] = self.ring.get_disjoint_mut(rows).expect("three rows");
        if !own.is_full {
            return;
        }
        let position = Place::new(columns, row);
        let count = columns.grid.size[1];
        let beyond = if row + 1 < count && south.is_full { &south.most[0] } else { &self.ones };
        let before = if row > 0 && north.is_full { &north.most[0] } else { &self.ones };
        let [first_most, most] = &mut own.most;
        for span in active.row(row) {
            let (at, first, len) = (position.of(span.first), span.first as usize, span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let near = position.beside(first_most, beyond, &self.ones, span);
            let north_most = position.north(before, &self.ones, span);
            for x in 0..len {
                let i = first + x;
                let k = first_most[at + x];
                most[at + x] = k;
                if k < 1.0 {
                    let along = max(around.east[x], 0.0) * near.own[x + 1]
                        - min(around.west[x], 0.0) * first_most[at + x - 1];
                    let across =
                        max(around.south[x], 0.0) * near.south[x] - min(around.north[x], 0.0) * north_most[x];
                    // Truncation removes up to a unit from each.
                    let leaves = max((along + across) * scale::MARGIN - 4.0, 0.0);
                    let room =
                        scale::room(columns.bases()[i], columns.ceilings()[i], part.depth[i - part.start]);
                    let along = max(around.west[x], 0.0) - min(around.east[x], 0.0);
                    let across = max(around.north[x], 0.0) - min(around.south[x], 0.0);
                    most[at + x] = scale::most(along + across, room + leaves).max(k);
                }
            }
        }
        // The sum lacks the flow through links: their columns keep the first sweep's value.
        for &column in pipes.links.columns_of(row) {
            most[position.of(column)] = first_most[position.of(column)];
        }
    }
}

/// The maximum inflow through links of a column of a row (units); `sums` are 0 before and after.
pub(in crate::shallow::solver) fn most_through_links(
    ground: &Ground,
    parts: &Parts,
    row: usize,
    sums: &mut [i64],
) -> f32 {
    let position = Place::new(ground.columns, row);
    each_link(ground, parts, row, false, |column, units| sums[position.of(column)] += units);
    let columns = ground.pipes.links.columns_of(row).iter();
    columns.map(|&column| std::mem::take(&mut sums[position.of(column)])).max().unwrap_or(0) as f32
}
