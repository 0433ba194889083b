//! Flow through links: pipes between layers, over cliffs, and out of the domain. They are few, and processed one at a time.

use std::ops::Range;

use super::fast_films;
use super::link_flow::beyond;
use super::overflow_edges::{Fall, OverflowEdges, edge_drop};
use super::rows::band_views::LinkPart;
use super::viscous_flux::{Step, StepKind, flux_of, min, whole_and_remainder};
use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::pipes::Links;

/// Clamp on transfers, beyond any column's depth (units): their sums fit 64 bits.
const MAX_TRANSFER: f32 = 2.1e9;

/// Units that crossed the border of the domain.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Outside {
    /// Out of it.
    pub lost: i64,
    /// Into it.
    pub gained: i64,
}

/// The links that a row owns.
#[derive(Clone, Copy)]
pub struct RowLinks<'a> {
    /// All links.
    pub links: &'a Links,
    /// Those that liquid falls freely from.
    pub overflow_edges: &'a OverflowEdges,
    /// The row.
    pub row: usize,
}

impl RowLinks<'_> {
    /// The column that gives (or receives) a transfer through a link, if any.
    fn end_column(&self, link: usize, transfer: f32, gives: bool) -> Option<u32> {
        let column = if (transfer > 0.0) == gives { self.links.from[link] } else { self.links.to[link] };
        let is_there = column != NONE && (gives || self.overflow_edges.at(link) == Fall::No);
        (transfer != 0.0 && is_there).then_some(column)
    }
}

impl LinkPart<'_> {
    /// Computes the flux and the transfer of the links that a row owns; `depth` gives H of columns of this row and the next one.
    pub fn find_fluxes<K: StepKind>(
        &mut self,
        step: &Step,
        columns: &Columns,
        RowLinks { links, overflow_edges, row }: RowLinks,
        depth: impl Fn(usize) -> i32,
    ) {
        let base = columns.bases();
        for link in links.row(row) {
            let (i, open) = (links.from[link] as usize, links.open[link]);
            let own = depth(i);
            let at = link - self.first;
            let (eta, beyond, is_still) = match links.to[link] {
                // The surface below does not matter: it falls as into the void.
                _ if overflow_edges.at(link) == Fall::Ahead => (base[i] - edge_drop(columns), 0, false),
                j if overflow_edges.at(link) == Fall::Back => {
                    let (base, depth) = (base[j as usize], depth(j as usize));
                    let (fall, depth) = (base + depth - (base - edge_drop(columns)), [depth as f32, 0.0]);
                    self.set_flux(at, 0.0 - driven::<K>(step, fall, depth, -self.flux[at], open));
                    continue;
                }
                NONE => beyond(links, columns, link, step.still_level),
                j => (base[j as usize] + depth(j as usize), depth(j as usize), false),
            };
            let fall = (base[i] + own).saturating_sub(eta);
            let depth = [own as f32, beyond as f32];
            let flux = if is_still {
                radiated(step, fall, depth)
            } else {
                driven::<K>(step, fall, depth, self.flux[at], open)
            };
            self.set_flux(at, flux);
        }
    }

    /// Sets the flux of a link of the part, and its transfer.
    fn set_flux(&mut self, at: usize, flux: f32) {
        self.flux[at] = flux;
        let [transfer, remainder] = whole_and_remainder(flux, self.remainder[at]);
        (self.transfer[at], self.remainder[at]) = (transfer.clamp(-MAX_TRANSFER, MAX_TRANSFER), remainder);
    }

    /// Calls `add` with each column of `within` that gives (or receives) through a link of a row, and how much (units, rounded up to
    /// integers, so that sums do not depend on their order).
    pub fn for_each_end(
        &self,
        of: RowLinks,
        within: &Range<u32>,
        gives: bool,
        mut add: impl FnMut(u32, i64),
    ) {
        for link in of.links.row(of.row) {
            let transfer = self.transfer[link - self.first];
            if let Some(column) =
                of.end_column(link, transfer, gives).filter(|column| within.contains(column))
            {
                add(column, transfer.abs().ceil() as i64);
            }
        }
    }

    /// Multiplies the transfers and fluxes of the links that a row owns by a factor of the donor or of the receiver.
    pub fn scale(&mut self, of: RowLinks, gives: bool, factor: impl Fn(u32) -> f32) {
        for link in of.links.row(of.row) {
            let at = link - self.first;
            if let Some(k) = of.end_column(link, self.transfer[at], gives).map(&factor) {
                self.transfer[at] *= k;
                self.flux[at] *= k;
            }
        }
    }

    /// Applies the transfers of a row's links in whole units; `change` is called with each column and its gain. Liquid that falls freely
    /// only leaves its column.
    pub fn move_units(&self, of: RowLinks, outside: &mut Outside, mut change: impl FnMut(usize, i32)) {
        let RowLinks { links, overflow_edges, row } = of;
        for link in links.row(row) {
            // K limits it to 32 bits.
            let units = self.transfer[link - self.first] as i32;
            if units == 0 {
                continue;
            }
            match overflow_edges.at(link) {
                Fall::No => {}
                Fall::Ahead => {
                    change(links.from[link] as usize, -units);
                    continue;
                }
                Fall::Back => {
                    change(links.to[link] as usize, units);
                    continue;
                }
            }
            change(links.from[link] as usize, -units);
            match links.to[link] {
                NONE if units > 0 => outside.lost += i64::from(units),
                NONE => outside.gained -= i64::from(units),
                to => change(to as usize, units),
            }
        }
    }
}

/// The flux that the next step drives through a link (units per step), given the surface drop and both depths (units).
fn driven<K: StepKind>(step: &Step, fall: i32, depth: [f32; 2], flux: f32, open: f32) -> f32 {
    let light = if K::VISCOUS && !K::WHOLE { fast_films::light(step, depth, flux) } else { 1.0 };
    step.rest_if_slow::<K>(fall, depth, flux_of::<K>(step, fall, depth, flux, open, light))
}

/// The flux of a wave that leaves over the border (units per step): a surface that is `fall` above the one at rest flows out at the speed
/// of waves (Sommerfeld's condition), and waves are not reflected.
fn radiated(step: &Step, fall: i32, depth: [f32; 2]) -> f32 {
    let mean = if step.is_whole { step.section } else { min(0.5 * (depth[0] + depth[1]), step.section) };
    if fall.saturating_abs() <= step.rest_drop {
        0.0
    } else {
        min(step.wave * mean.sqrt(), 1.0) * fall as f32
    }
}

/// The indices of a row's columns.
pub fn indices_of(columns: &Columns, row: usize) -> Range<u32> {
    let strips = columns.row(row);
    (strips.start * STRIP) as u32..(strips.end * STRIP) as u32
}
