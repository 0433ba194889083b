//! K_max: scales the inflow of columns to their room (thesis 4.1.1). It is only computed in the few rows whose unscaled inflow could fill a
//! column in this step.

use super::scale;
use crate::shallow::solver::rows::band_views::BandView;
use crate::shallow::solver::rows::buffers::{RING, RowBuffers};
use crate::shallow::solver::rows::positions::RowPositions;
use crate::shallow::solver::rows::{StepInputs, for_each_link_end};
use crate::shallow::solver::viscous_flux::{max, min};

impl RowBuffers {
    /// K_max of a row's columns, as if nothing flowed out; returns whether any is not 1.
    #[inline(always)]
    pub fn find_k_max(&mut self, inputs: &StepInputs, view: &BandView, row: usize) -> bool {
        let StepInputs { columns, active, .. } = inputs;
        let part = view.part(row);
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        if !own.may_fill {
            return false;
        }
        let position = RowPositions::new(columns, row);
        let [k_max, _] = &mut own.k_max;
        for span in active.row(row) {
            let (at, len) = (position.of(span.first), span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            scale::inflow(&around, &mut k_max[at..at + len]);
        }
        let sums = &mut self.linked;
        for_each_link_end(inputs, view, row, false, |column, units| sums[position.of(column)] += units);
        for &column in inputs.pipes.links.columns_of(row) {
            k_max[position.of(column)] += std::mem::take(&mut sums[position.of(column)]) as f32;
        }
        let mut has_k_max = false;
        for span in active.row(row) {
            let (at, first, len) = (position.of(span.first), span.first as usize, span.len as usize);
            let (base, ceiling) = (&columns.bases()[first..], &columns.ceilings()[first..]);
            let depth = &part.depth[first - part.start..];
            has_k_max |= scale::find_k_max(base, ceiling, depth, &mut k_max[at..at + len]) < 1.0;
        }
        own.has_k_max = has_k_max;
        has_k_max
    }

    /// Refines K_max of a row's columns with the room that their outflow makes.
    #[inline(always)]
    pub(in crate::shallow::solver) fn refine_k_max(
        &mut self,
        inputs: &StepInputs,
        view: &BandView,
        row: usize,
    ) {
        let StepInputs { columns, pipes, active, .. } = inputs;
        let part = view.part(row);
        let rows = [row % RING, (row + RING - 1) % RING, (row + 1) % RING];
        let [own, north, south] = self.ring.get_disjoint_mut(rows).expect("three rows");
        if !own.has_k_max {
            return;
        }
        let position = RowPositions::new(columns, row);
        let count = columns.grid.size[1];
        let beyond = if row + 1 < count && south.has_k_max { &south.k_max[0] } else { &self.ones };
        let before = if row > 0 && north.has_k_max { &north.k_max[0] } else { &self.ones };
        let [first, refined] = &mut own.k_max;
        for span in active.row(row) {
            let (at, start, len) = (position.of(span.first), span.first as usize, span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let near = position.beside(first, beyond, &self.ones, span);
            let north_k = position.north(before, &self.ones, span);
            for x in 0..len {
                let i = start + x;
                let k = first[at + x];
                refined[at + x] = k;
                if k < 1.0 {
                    let along = max(around.east[x], 0.0) * near.own[x + 1]
                        - min(around.west[x], 0.0) * first[at + x - 1];
                    let across =
                        max(around.south[x], 0.0) * near.south[x] - min(around.north[x], 0.0) * north_k[x];
                    // Truncation removes up to a unit from each.
                    let leaves = max((along + across) * scale::MARGIN - 4.0, 0.0);
                    let room =
                        scale::room(columns.bases()[i], columns.ceilings()[i], part.depth[i - part.start]);
                    let along = max(around.west[x], 0.0) - min(around.east[x], 0.0);
                    let across = max(around.north[x], 0.0) - min(around.south[x], 0.0);
                    refined[at + x] = scale::k_max(along + across, room + leaves).max(k);
                }
            }
        }
        // The sum lacks the flow through links: their columns keep the first sweep's value.
        for &column in pipes.links.columns_of(row) {
            refined[position.of(column)] = first[position.of(column)];
        }
    }
}

/// The maximum inflow through links of any column of a row (units); `sums` are 0 before and after.
pub fn max_link_inflow(inputs: &StepInputs, view: &BandView, row: usize, sums: &mut [i64]) -> f32 {
    let position = RowPositions::new(inputs.columns, row);
    for_each_link_end(inputs, view, row, false, |column, units| sums[position.of(column)] += units);
    let columns = inputs.pipes.links.columns_of(row).iter();
    columns.map(|&column| std::mem::take(&mut sums[position.of(column)])).max().unwrap_or(0) as f32
}
