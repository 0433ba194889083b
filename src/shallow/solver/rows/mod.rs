//! A step, row by row: fluxes, their scaling and the new depths follow each other at a distance of a few rows, so that data that one stage
//! has read or written is still in the cache for the next (thesis Alg. 4.1, lines 1 to 4).
//!
//! When the front is at row r, the fluxes and K_min of r are computed; with these the pipes of r - 1 can be scaled. Where there are
//! ceilings, K_max of r - 1 follows, and K_max of r - 2 is refined with the room that outflow makes. The transfers of row r - 3 (r - 1
//! where there are no ceilings) are then final, and its depths change; no later stage reads that row again. A band starts some rows before
//! its own rows and ends some rows after them, on copies, so that it computes the same values there as its neighbours.

pub(super) mod band_views;
pub(in crate::shallow) mod bands;
pub(super) mod buffers;
pub(super) mod filling;
pub(super) mod positions;
mod step_inputs;

use super::link_step::{Outside, indices_of};
use super::pressurised::edges::PipeIndex;
use super::transfers::inflow_limit::max_link_inflow;
use super::transfers::scale;
use super::transfers::whole_units::{find_woken, move_units};
use super::viscous_flux::{PipeState, Row, Step, StepKind, by_kind, flux_row, max, solved_row};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{NONE, STRIP};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::Changes;
use band_views::BandView;
use buffers::{Buffer, RING, RowBuffers, SWEEPS};
use positions::{PAD, RowPositions};
pub(super) use step_inputs::for_each_link_end;
pub use step_inputs::{StepInputs, StepResults};

impl RowBuffers {
    /// One step of a band of rows; `deepest` receives the maximum depth of each (units).
    pub fn step(
        &mut self,
        step: &Step,
        inputs: &StepInputs,
        view: &mut BandView,
        deepest: &mut [i32],
        results: &mut StepResults,
    ) {
        let rows = self;
        by_kind!(step, K => dispatch!(RowBuffers::run::<K>(
            rows: &mut RowBuffers, step: &Step, inputs: &StepInputs, view: &mut BandView, deepest: &mut [i32], results: &mut StepResults
        )))
    }

    #[inline(always)]
    fn run<K: StepKind>(
        &mut self,
        step: &Step,
        inputs: &StepInputs,
        view: &mut BandView,
        deepest: &mut [i32],
        results: &mut StepResults,
    ) {
        let count = inputs.columns.grid.size[1];
        // Distance from the front to the row whose transfers are final.
        let lag = if inputs.may_fill.contains(&true) { 1 + SWEEPS } else { 1 };
        let own = view.rows.clone();
        let start = own.start.saturating_sub(1 + lag);
        let mut idle = 0;
        for front in start..own.end + lag {
            idle = if inputs.is_idle(front) { idle + 1 } else { 0 };
            if idle > lag + 1 {
                self.ring[front % RING].clear();
                if let Some(row) = front.checked_sub(lag).filter(|row| own.contains(row)) {
                    deepest[row - own.start] = inputs.active.asleep_depth(row);
                }
                continue;
            }
            if front < count {
                let is_limited = self.find_fluxes::<K>(step, inputs, view, front);
                results.scaled[2] += u32::from(is_limited && own.contains(&front));
                if !inputs.network.is_empty() {
                    self.apply_network(inputs, view, front);
                }
                if !self.scalars.is_empty() {
                    self.scalars.find_levels(inputs, view, front);
                }
                let is_over = self.find_k_min(inputs, view, front);
                results.scaled[0] += u32::from(is_over && own.contains(&front));
            }
            // The row at a distance behind the front, if the band includes it.
            let at = |distance: usize| front.checked_sub(distance).filter(|row| (start..count).contains(row));
            if let Some(row) = at(1) {
                self.scale::<true>(inputs, view, row);
            }
            if let Some(row) = at(1).filter(|_| lag > 1) {
                let is_full = self.find_k_max(inputs, view, row);
                results.scaled[1] += u32::from(is_full && own.contains(&row));
            }
            if let Some(row) = at(2).filter(|_| lag > 1) {
                self.refine_k_max(inputs, view, row);
            }
            if let Some(row) = at(lag).filter(|row| row + 1 >= own.start) {
                self.scale::<false>(inputs, view, row);
                self.move_links(inputs, view, row, &mut results.outside);
                if own.contains(&row) {
                    deepest[row - own.start] = self.apply_transfers(inputs, view, row, &mut results.woken);
                }
                if !self.scalars.is_empty() {
                    self.move_scalars(inputs, view, row, &mut results.scalar_changes);
                }
            }
        }
    }

    /// Computes the fluxes of a row's pipes; returns whether fast films were limited.
    #[inline(always)]
    fn find_fluxes<K: StepKind>(
        &mut self,
        step: &Step,
        inputs: &StepInputs,
        view: &mut BandView,
        row: usize,
    ) -> bool {
        let StepInputs { columns, pipes, active, fast, .. } = inputs;
        let (light, is_fast) = (&fast.light, fast.row(row));
        let (friction, has_friction) =
            (inputs.friction, K::VISCOUS && !K::WHOLE && inputs.friction.includes_row(row));
        let start = columns.row(row).start * STRIP;
        let buffer = &mut self.ring[row % RING];
        buffer.clear();
        let (own, beyond) = view.part_and_next(row);
        let ([flux_east, flux_south], [remainder_east, remainder_south]) =
            (&mut own.flux, &mut own.remainder);
        let (mut end, mut is_limited) = (0, false);
        for span in active.row(row) {
            let at = PAD + span.first as usize - start;
            if at != end {
                buffer.east[at - 1] = 0.0;
            }
            end = at + span.len as usize;
            let depth = &own.depth[span.first as usize - own.start..];
            // No depth follows the last strip of a band: it is done separately, on a copy with the first depth of the next row.
            let (mut last, len) = ([0; STRIP + 1], span.len as usize);
            let cut = if depth.len() > len { len } else { len - STRIP };
            if cut < len {
                last[..STRIP].copy_from_slice(&depth[cut..len]);
                last[STRIP] = beyond.as_ref().map_or(0, |next| next.depth[0]);
            }
            for (position, len) in [(0, cut), (cut, len - cut)].into_iter().filter(|(_, len)| *len > 0) {
                let (first, at) = (span.first as usize + position, at + position);
                let mine = first - own.start;
                let south = if span.south == NONE { first } else { span.south as usize + position };
                let south_depth = match &beyond {
                    Some(next) if span.south != NONE => &next.depth[south - next.start..],
                    _ => &own.depth[south - own.start..],
                };
                let row = Row {
                    base: &columns.bases()[first..],
                    depth: if position < cut { depth } else { &last },
                    south_base: &columns.bases()[south..],
                    south_depth,
                    open: [&pipes.east[first..], &pipes.south[first..]],
                    light: &light[first..],
                    is_light: &fast.strips[first / STRIP..],
                };
                let (mine, at) = (mine..mine + len, at..at + len);
                let state = PipeState {
                    flux: [&mut flux_east[mine.clone()], &mut flux_south[mine.clone()]],
                    remainder: [&mut remainder_east[mine.clone()], &mut remainder_south[mine]],
                    transfer: [&mut buffer.east[at.clone()], &mut buffer.south[at]],
                };
                if has_friction {
                    let solved = friction.solved().map(|flux| &flux[first..]);
                    if is_fast {
                        is_limited |= solved_row::<true>(step, &row, solved, state);
                    } else {
                        solved_row::<false>(step, &row, solved, state);
                    }
                } else {
                    is_limited |= match (K::VISCOUS && !K::WHOLE && is_fast, inputs.may_rest) {
                        (true, true) => flux_row::<K, true, true>(step, &row, state),
                        (true, false) => flux_row::<K, true, false>(step, &row, state),
                        (false, true) => flux_row::<K, false, true>(step, &row, state),
                        (false, false) => flux_row::<K, false, false>(step, &row, state),
                    };
                }
            }
        }
        if !pipes.links.is_empty() {
            let next = beyond.as_ref().map(|next| (next.start, &*next.depth));
            let depth = |index: usize| match next {
                Some((start, depth)) if index >= start => depth[index - start],
                _ => own.depth[index - own.start],
            };
            own.links.find_fluxes::<K>(step, columns, inputs.links_of(row), depth);
        }
        is_limited
    }

    /// Moves the units of the network of full columns in a row, after the fluxes of that row, and closes its pipes there for the rest of
    /// the step.
    fn apply_network(&mut self, inputs: &StepInputs, view: &mut BandView, row: usize) {
        let (position, buffer) = (RowPositions::new(inputs.columns, row), &mut self.ring[row % RING]);
        let part = view.part_mut(row);
        let (start, first_link) = (part.start, part.links.first);
        let (depth, transfer) = (&mut *part.depth, &mut *part.links.transfer);
        inputs.network.move_units(
            &indices_of(inputs.columns, row),
            &inputs.pipes.links.row(row),
            |column, units| depth[column as usize - start] += units,
            |at| match at {
                PipeIndex::East(column) => buffer.east[position.of(column)] = 0.0,
                PipeIndex::South(column) => buffer.south[position.of(column)] = 0.0,
                PipeIndex::Link(link) => transfer[link as usize - first_link] = 0.0,
            },
        );
    }

    /// Finds K_min of a row's columns; returns whether any is not 1.
    #[inline(always)]
    fn find_k_min(&mut self, inputs: &StepInputs, view: &BandView, row: usize) -> bool {
        let StepInputs { columns, pipes, active, .. } = inputs;
        let part = view.part(row);
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        let position = RowPositions::new(columns, row);
        let (mut may_exceed, may_fill, mut into) = (false, inputs.may_fill[row], [0.0; STRIP]);
        for span in active.row(row) {
            let (at, len) = (position.of(span.first), span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let depth = &part.depth[span.first as usize - part.start..];
            let out = &mut own.k_min[at..at + len];
            may_exceed |= if may_fill {
                scale::outflow::<true>(depth, &around, out, &mut into)
            } else {
                scale::outflow::<false>(depth, &around, out, &mut into)
            };
        }
        if !pipes.links.columns_of(row).is_empty() {
            let sums = &mut self.linked;
            for_each_link_end(inputs, view, row, true, |column, units| sums[position.of(column)] += units);
            for &column in pipes.links.columns_of(row) {
                own.k_min[position.of(column)] += std::mem::take(&mut sums[position.of(column)]) as f32;
            }
            // Few columns have links, but any of these may now exceed its depth.
            may_exceed = true;
        }
        if may_fill {
            let linked = max_link_inflow(inputs, view, row, &mut self.linked);
            own.may_fill =
                into.into_iter().fold(0.0, max) + linked > inputs.room[row] || !inputs.network.is_empty();
        }
        let mut has_k_min = false;
        if may_exceed {
            for span in active.row(row) {
                let (at, len) = (position.of(span.first), span.len as usize);
                let depth = &part.depth[span.first as usize - part.start..];
                has_k_min |= scale::find_k_min(depth, &mut own.k_min[at..at + len]) < 1.0;
            }
        }
        own.has_k_min = has_k_min;
        has_k_min
    }

    /// Multiplies a row's transfers by K_min of the donors (`GIVES`), or by K_max of the receivers.
    #[inline(always)]
    fn scale<const GIVES: bool>(&mut self, inputs: &StepInputs, view: &mut BandView, row: usize) {
        let [own, south] = self.ring.get_disjoint_mut([row % RING, (row + 1) % RING]).expect("two rows");
        let has_south = row + 1 < inputs.columns.grid.size[1];
        let (is_scaled, south_is_scaled, own_factors, south_factors) = if GIVES {
            (own.has_k_min, has_south && south.has_k_min, &own.k_min, &south.k_min)
        } else {
            (own.has_k_max, has_south && south.has_k_max, &own.k_max[1], &south.k_max[1])
        };
        if !is_scaled && !south_is_scaled {
            return;
        }
        let factors = if is_scaled { own_factors } else { &self.ones };
        let beyond = if south_is_scaled { south_factors } else { &self.ones };
        let position = RowPositions::new(inputs.columns, row);
        let part = view.part_mut(row);
        let [flux_east, flux_south] = &mut part.flux;
        for span in inputs.active.row(row) {
            let (at, len) = (position.of(span.first), span.len as usize);
            let mine = span.first as usize - part.start;
            let factor = position.beside(factors, beyond, &self.ones, span);
            scale::scale::<GIVES>(
                &factor,
                &mut own.east[at..at + len],
                &mut own.south[at..at + len],
                &mut flux_east[mine..mine + len],
                &mut flux_south[mine..mine + len],
            );
        }
        let factor = |column| position.pick(factors, beyond, column);
        part.links.scale(inputs.links_of(row), GIVES, factor);
    }

    /// Applies the transfers of a row's links to the band's own columns.
    fn move_links(&self, inputs: &StepInputs, view: &mut BandView, row: usize, outside: &mut Outside) {
        if inputs.pipes.links.row(row).is_empty() {
            return;
        }
        let is_own = view.rows.contains(&row);
        let own = band_views::indices(inputs.columns, &view.rows);
        let mut elsewhere = Outside::default();
        let outside = if is_own { outside } else { &mut elsewhere };
        let (part, next) = view.part_and_next(row);
        let (start, depth) = (part.start, &mut *part.depth);
        let mut next = next.map(|next| (next.start, &mut *next.depth));
        part.links.move_units(inputs.links_of(row), outside, |column, units| {
            if own.contains(&column) {
                match &mut next {
                    Some((start, depth)) if column >= *start => depth[column - *start] += units,
                    _ => depth[column - start] += units,
                }
            }
        });
    }

    /// Applies a row's transfers; returns its maximum new depth.
    #[inline(always)]
    fn apply_transfers(
        &mut self,
        inputs: &StepInputs,
        view: &mut BandView,
        row: usize,
        woken: &mut Vec<u32>,
    ) -> i32 {
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        let position = RowPositions::new(inputs.columns, row);
        let part = view.part_mut(row);
        let mut deepest = [0; STRIP];
        for span in inputs.active.row(row) {
            let (mine, len) = (span.first as usize - part.start, span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let depth = &mut part.depth[mine..mine + len];
            move_units(&around, depth, &mut deepest);
            let strip = span.first / STRIP as u32;
            let marks = [&inputs.active.wet, &inputs.active.moving].map(|marks| &marks[strip as usize..]);
            find_woken(&around, depth, marks, |position| woken.push(strip + position as u32));
        }
        deepest.into_iter().fold(inputs.active.asleep_depth(row), i32::max)
    }

    /// Moves the scalars of a row's transfers; its depths are final.
    fn move_scalars(
        &mut self,
        inputs: &StepInputs,
        view: &mut BandView,
        row: usize,
        changes: &mut [Changes; MAX_SCALARS],
    ) {
        let Self { scalars, ring, .. } = self;
        let Buffer { east, south, .. } = &ring[row % RING];
        scalars.move_links(inputs, view, row, changes);
        scalars.move_row(inputs, view, row, [east, south], changes);
    }
}
