//! A step, row by row: fluxes, their scaling and the new depths follow each other at a distance of a few rows, so that data that one has
//! read or written is still in the cache for the next (thesis Alg. 4.1, lines 1 to 4).
//!
//! When the front is at row r, the fluxes and K_min of r are computed; with these the pipes of r - 1 can be scaled. Where there are
//! ceilings, K_max of r - 1 follows, and K_max of r - 2 is refined with the room that outflow makes. The transfers of row r - 3 (r - 1
//! where there are no ceilings) are then final, and its depths change; no later stage reads that row again. A band starts some rows before
//! its own rows and ends some rows after them, on copies, so that it computes the same values there as its neighbours.

pub(super) mod band_views;
pub(in crate::shallow) mod bands;
pub(super) mod buffers;
pub(super) mod filling;
mod ground;
pub(super) mod positions;

use super::link_step::{Outside, indices_of};
use super::pressurised::edges::At;
use super::transfers::inflow_limit::most_through_links;
use super::transfers::scale;
use super::transfers::whole_units::{find_woken, move_units};
use super::viscous_flux::{Carried, Kind, Row, Step, by_kind, flux_row, max, solved_row};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{NONE, STRIP};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::amounts::Changes;
use band_views::Parts;
use buffers::{Buffer, RING, Rows, SWEEPS};
pub(super) use ground::each_link;
pub use ground::{Ground, Stepped};
use positions::{PAD, Place};

impl Rows {
    /// One step of a band of rows; `deepest` receives the maximum depth of each (units).
    pub fn step(
        &mut self,
        step: &Step,
        ground: &Ground,
        parts: &mut Parts,
        deepest: &mut [i32],
        stepped: &mut Stepped,
    ) {
        let rows = self;
        by_kind!(step, K => dispatch!(Rows::run::<K>(
            rows: &mut Rows, step: &Step, ground: &Ground, parts: &mut Parts, deepest: &mut [i32], stepped: &mut Stepped
        )))
    }

    #[inline(always)]
    fn run<K: Kind>(
        &mut self,
        step: &Step,
        ground: &Ground,
        parts: &mut Parts,
        deepest: &mut [i32],
        stepped: &mut Stepped,
    ) {
        let count = ground.columns.grid.size[1];
        let behind = if ground.may_fill.contains(&true) { 1 + SWEEPS } else { 1 };
        let own = parts.rows.clone();
        let start = own.start.saturating_sub(1 + behind);
        let mut idle = 0;
        for front in start..own.end + behind {
            idle = if ground.is_idle(front) { idle + 1 } else { 0 };
            if idle > behind + 1 {
                self.ring[front % RING].clear();
                if let Some(row) = front.checked_sub(behind).filter(|row| own.contains(row)) {
                    deepest[row - own.start] = ground.active.asleep_depth(row);
                }
                continue;
            }
            if front < count {
                let is_held = self.drive::<K>(step, ground, parts, front);
                stepped.scaled[2] += u32::from(is_held && own.contains(&front));
                if !ground.network.is_empty() {
                    self.shut(ground, parts, front);
                }
                if !self.carried.is_empty() {
                    self.carried.find_levels(ground, parts, front);
                }
                let over = self.find_least(ground, parts, front);
                stepped.scaled[0] += u32::from(over && own.contains(&front));
            }
            // The row at a distance behind the front, if the band includes it.
            let at = |distance: usize| front.checked_sub(distance).filter(|row| (start..count).contains(row));
            if let Some(row) = at(1) {
                self.scale::<true>(ground, parts, row);
            }
            if let Some(row) = at(1).filter(|_| behind > 1) {
                let is_full = self.find_most(ground, parts, row);
                stepped.scaled[1] += u32::from(is_full && own.contains(&row));
            }
            if let Some(row) = at(2).filter(|_| behind > 1) {
                self.find_more(ground, parts, row);
            }
            if let Some(row) = at(behind).filter(|row| row + 1 >= own.start) {
                self.scale::<false>(ground, parts, row);
                self.move_links(ground, parts, row, &mut stepped.outside);
                if own.contains(&row) {
                    deepest[row - own.start] = self.transfer(ground, parts, row, &mut stepped.woken);
                }
                if !self.carried.is_empty() {
                    self.carry(ground, parts, row, &mut stepped.carried);
                }
            }
        }
    }

    /// Computes the fluxes of a row's pipes; returns whether fast films were limited.
    #[inline(always)]
    fn drive<K: Kind>(&mut self, step: &Step, ground: &Ground, parts: &mut Parts, row: usize) -> bool {
        let Ground { columns, pipes, active, fast, .. } = ground;
        let (light, is_fast) = (&fast.light, fast.row(row));
        let (walls, is_walled) = (ground.walls, K::VISCOUS && !K::WHOLE && ground.walls.row(row));
        let start = columns.row(row).start * STRIP;
        let buffer = &mut self.ring[row % RING];
        buffer.clear();
        let (own, beyond) = parts.both(row);
        let ([flux_east, flux_south], [left_east, left_south]) = (&mut own.flux, &mut own.left);
        let (mut end, mut is_held) = (0, false);
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
                let carried = Carried {
                    flux: [&mut flux_east[mine.clone()], &mut flux_south[mine.clone()]],
                    left: [&mut left_east[mine.clone()], &mut left_south[mine]],
                    transfer: [&mut buffer.east[at.clone()], &mut buffer.south[at]],
                };
                if is_walled {
                    let solved = walls.solved().map(|flux| &flux[first..]);
                    if is_fast {
                        is_held |= solved_row::<true>(step, &row, solved, carried);
                    } else {
                        solved_row::<false>(step, &row, solved, carried);
                    }
                } else {
                    is_held |= match (K::VISCOUS && !K::WHOLE && is_fast, ground.may_rest) {
                        (true, true) => flux_row::<K, true, true>(step, &row, carried),
                        (true, false) => flux_row::<K, true, false>(step, &row, carried),
                        (false, true) => flux_row::<K, false, true>(step, &row, carried),
                        (false, false) => flux_row::<K, false, false>(step, &row, carried),
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
            own.links.drive::<K>(step, columns, ground.links_of(row), depth);
        }
        is_held
    }

    /// Moves the units of the flooded pipes (the network of `pressurised`) in a row, after the fluxes of that row, and closes the network's
    /// pipes there for the rest of the step.
    fn shut(&mut self, ground: &Ground, parts: &mut Parts, row: usize) {
        let (position, buffer) = (Place::new(ground.columns, row), &mut self.ring[row % RING]);
        let part = parts.of(row);
        let (start, first_link) = (part.start, part.links.first);
        let (depth, transfer) = (&mut *part.depth, &mut *part.links.transfer);
        ground.network.move_units(
            &indices_of(ground.columns, row),
            &ground.pipes.links.row(row),
            |column, units| depth[column as usize - start] += units,
            |at| match at {
                At::East(column) => buffer.east[position.of(column)] = 0.0,
                At::South(column) => buffer.south[position.of(column)] = 0.0,
                At::Link(link) => transfer[link as usize - first_link] = 0.0,
            },
        );
    }

    /// Finds K_min of a row's columns; returns whether any is not 1.
    #[inline(always)]
    fn find_least(&mut self, ground: &Ground, parts: &Parts, row: usize) -> bool {
        let Ground { columns, pipes, active, .. } = ground;
        let part = parts.see(row);
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        let position = Place::new(columns, row);
        let (mut over, may_fill, mut into) = (false, ground.may_fill[row], [0.0; STRIP]);
        for span in active.row(row) {
            let (at, len) = (position.of(span.first), span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let depth = &part.depth[span.first as usize - part.start..];
            let out = &mut own.least[at..at + len];
            over |= if may_fill {
                scale::outflow::<true>(depth, &around, out, &mut into)
            } else {
                scale::outflow::<false>(depth, &around, out, &mut into)
            };
        }
        if !pipes.links.columns_of(row).is_empty() {
            let sums = &mut self.linked;
            each_link(ground, parts, row, true, |column, units| sums[position.of(column)] += units);
            for &column in pipes.links.columns_of(row) {
                own.least[position.of(column)] += std::mem::take(&mut sums[position.of(column)]) as f32;
            }
            // Few columns have links, but any of these may now exceed its depth.
            over = true;
        }
        if may_fill {
            let linked = most_through_links(ground, parts, row, &mut self.linked);
            own.may_fill =
                into.into_iter().fold(0.0, max) + linked > ground.room[row] || !ground.network.is_empty();
        }
        let mut is_less = false;
        if over {
            for span in active.row(row) {
                let (at, len) = (position.of(span.first), span.len as usize);
                let depth = &part.depth[span.first as usize - part.start..];
                is_less |= scale::least(depth, &mut own.least[at..at + len]) < 1.0;
            }
        }
        own.is_less = is_less;
        is_less
    }

    /// Multiplies a row's transfers by K_min of the donors (`GIVES`), or by K_max of the receivers.
    #[inline(always)]
    fn scale<const GIVES: bool>(&mut self, ground: &Ground, parts: &mut Parts, row: usize) {
        let [own, south] = self.ring.get_disjoint_mut([row % RING, (row + 1) % RING]).expect("two rows");
        let has_south = row + 1 < ground.columns.grid.size[1];
        let (is_scaled, south_is_scaled, own_factors, south_factors) = if GIVES {
            (own.is_less, has_south && south.is_less, &own.least, &south.least)
        } else {
            (own.is_full, has_south && south.is_full, &own.most[1], &south.most[1])
        };
        if !is_scaled && !south_is_scaled {
            return;
        }
        let factors = if is_scaled { own_factors } else { &self.ones };
        let beyond = if south_is_scaled { south_factors } else { &self.ones };
        let position = Place::new(ground.columns, row);
        let part = parts.of(row);
        let [flux_east, flux_south] = &mut part.flux;
        for span in ground.active.row(row) {
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
        part.links.scale(ground.links_of(row), GIVES, factor);
    }

    /// Applies the transfers of a row's links to the band's own columns.
    fn move_links(&self, ground: &Ground, parts: &mut Parts, row: usize, outside: &mut Outside) {
        if ground.pipes.links.row(row).is_empty() {
            return;
        }
        let is_own = parts.rows.contains(&row);
        let own = band_views::indices(ground.columns, &parts.rows);
        let mut elsewhere = Outside::default();
        let outside = if is_own { outside } else { &mut elsewhere };
        let (part, next) = parts.both(row);
        let (start, depth) = (part.start, &mut *part.depth);
        let mut next = next.map(|next| (next.start, &mut *next.depth));
        part.links.move_units(ground.links_of(row), outside, |column, units| {
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
    fn transfer(&mut self, ground: &Ground, parts: &mut Parts, row: usize, woken: &mut Vec<u32>) -> i32 {
        let [own, north] =
            self.ring.get_disjoint_mut([row % RING, (row + RING - 1) % RING]).expect("two rows");
        let position = Place::new(ground.columns, row);
        let part = parts.of(row);
        let mut deepest = [0; STRIP];
        for span in ground.active.row(row) {
            let (mine, len) = (span.first as usize - part.start, span.len as usize);
            let around = position.around(&own.east, &own.south, &north.south, &self.zeros, span);
            let depth = &mut part.depth[mine..mine + len];
            move_units(&around, depth, &mut deepest);
            let strip = span.first / STRIP as u32;
            let marks = [&ground.active.wet, &ground.active.moving].map(|marks| &marks[strip as usize..]);
            find_woken(&around, depth, marks, |position| woken.push(strip + position as u32));
        }
        deepest.into_iter().fold(ground.active.asleep_depth(row), i32::max)
    }

    /// Moves the scalars of a row's transfers; its depths are final.
    fn carry(
        &mut self,
        ground: &Ground,
        parts: &mut Parts,
        row: usize,
        changes: &mut [Changes; MAX_SCALARS],
    ) {
        let Self { carried, ring, .. } = self;
        let Buffer { east, south, .. } = &ring[row % RING];
        carried.move_links(ground, parts, row, changes);
        carried.move_row(ground, parts, row, [east, south], changes);
    }
}
