//! Fluxes and remainders of pipes between columns that existed before. Other pipes start at 0.

use std::ops::Range;

use super::band::Band;
use super::origins::Origins;
use crate::shallow::columns::{Columns, NONE, STRIP, Strip, strip_mut, strip_of};
use crate::shallow::pipes::side::Side;
use crate::shallow::pipes::{Links, Pipes};
use crate::shallow::solver::Flow;

/// Flux and remainder.
type Carried = [f32; 2];

/// A link before the change.
#[derive(Debug, Clone, Copy)]
struct OldLink {
    /// x of its cell.
    x: u32,
    from: u32,
    to: u32,
    side: Side,
    carried: Carried,
}

/// The fluxes of links before a change, and those found for the new links.
#[derive(Debug, Clone, Default)]
pub(super) struct Carry {
    /// The former links of `rows`.
    old: Vec<OldLink>,
    /// Index in `old` of the first link of each row, then the end.
    starts: Vec<u32>,
    rows: Range<usize>,
    /// Fluxes and remainders of the new links of these rows.
    pub flux: Vec<f32>,
    pub remainder: Vec<f32>,
}

/// The columns before and after the change.
pub(super) struct Change<'a> {
    pub columns: &'a Columns,
    pub band: &'a Band,
    pub origins: &'a Origins,
}

impl Carry {
    /// Saves the links of some rows.
    pub fn save(&mut self, columns: &Columns, links: &Links, flow: &Flow, rows: Range<usize>) {
        self.old.clear();
        self.starts.clear();
        self.starts.push(0);
        for row in rows.clone() {
            self.old.extend(links.row(row).map(|link| OldLink {
                x: columns.cell(links.from[link] as usize)[0] as u32,
                from: links.from[link],
                to: links.to[link],
                side: links.sides[link],
                carried: [flow.links.flux[link], flow.links.remainder[link]],
            }));
            self.starts.push(self.old.len() as u32);
        }
        self.rows = rows;
    }

    /// Whether the links of these rows still join the same columns.
    pub fn has_same_links(&self, links: &Links) -> bool {
        let ends = links.from.iter().zip(&links.to);
        links.len() == self.old.len()
            && ends.zip(&self.old).all(|((from, to), old)| (*from, *to) == (old.from, old.to))
    }

    /// Finds the fluxes and remainders of the new links of these rows.
    pub fn links(&mut self, change: &Change, flow: &Flow, links: &Links) {
        self.flux.clear();
        self.remainder.clear();
        for link in 0..links.len() {
            let (from, to, side) = (links.from[link], links.to[link], links.sides[link]);
            let [flux, remainder] = self.of(change, flow, [from, to], side);
            self.flux.push(flux);
            self.remainder.push(remainder);
        }
    }

    /// The former flux and remainder of a pipe over a side between two columns; the second is [`NONE`] for the outside.
    fn of(&self, change: &Change, flow: &Flow, [from, to]: [u32; 2], side: Side) -> Carried {
        let Some(old_from) = change.origins.column(from) else { return [0.0; 2] };
        let old_to = if to == NONE { Some(NONE) } else { change.origins.column(to) };
        let Some(old_to) = old_to else { return [0.0; 2] };
        let position = change.old_strip(old_from);
        let row = position.row as usize - self.rows.start;
        let x = position.at * STRIP as u32 + old_from % STRIP as u32;
        let links = &self.old[self.starts[row] as usize..self.starts[row + 1] as usize];
        let first = links.partition_point(|link| link.x < x);
        let mut links = links[first..].iter().take_while(|link| link.x == x);
        let link = links.find(|link| (link.from, link.to, link.side) == (old_from, old_to, side));
        match link {
            Some(link) => link.carried,
            None if old_to != NONE && change.old_strip(old_to).layer == position.layer => {
                change.regular(flow, old_from, side)
            }
            None => [0.0; 2],
        }
    }

    /// Restores the regular pipes of the band's rows, and the southward pipes of the row before it: these still hold their values and
    /// are only cleared, or looked up again, where one end was rebuilt.
    pub fn regular(&self, change: &Change, pipes: &Pipes, flow: &mut Flow) {
        let Change { columns, band, origins } = change;
        let rows = band.rows.clone();
        for row in rows.start.saturating_sub(1)..rows.end {
            for strip in columns.row(row) {
                let (old, kept) = origins.strip(strip);
                let south = match columns.south(strip) {
                    NONE => 0,
                    southern => origins.strip(southern as usize).1,
                };
                let is_in = rows.contains(&row);
                let old = if is_in && old >= band.first { Some(old - band.first) } else { None };
                if is_in {
                    let next = columns.east(strip).map_or(0, |next| origins.strip(next).1);
                    let kept = kept & (kept >> 1 | next << (STRIP - 1));
                    self.strip(change, &pipes.east, flow, strip, old, kept, Side::East);
                }
                self.strip(change, &pipes.south, flow, strip, old, kept & south, Side::South);
            }
        }
    }

    /// Restores the pipes of a strip over a side. `kept` has the bits of those whose two columns both stayed in their strips; `old` is the
    /// former strip, if it is in the band.
    #[expect(clippy::too_many_arguments)]
    fn strip(
        &self,
        change: &Change,
        open: &[f32],
        flow: &mut Flow,
        strip: usize,
        old: Option<usize>,
        kept: u16,
        side: Side,
    ) {
        let axis = usize::from(side == Side::South);
        let open = strip_of(open, strip);
        let mut before = [[0.0; STRIP]; 2];
        if kept != 0 {
            before = match old {
                Some(old) => [&change.band.flux, &change.band.remainder].map(|of| *strip_of(&of[axis], old)),
                None => [&flow.flux, &flow.remainder].map(|of| *strip_of(&of[axis], strip)),
            };
        }
        for (number, before) in before.iter_mut().enumerate() {
            for x in 0..STRIP {
                before[x] = if open[x] > 0.0 { before[x] } else { 0.0 };
            }
            if kept != u16::MAX {
                (0..STRIP).filter(|x| kept >> x & 1 == 0).for_each(|x| before[x] = 0.0);
            }
            let now = if number == 0 { &mut flow.flux } else { &mut flow.remainder };
            *strip_mut(&mut now[axis], strip) = *before;
        }
        if change.origins.relayered.is_empty() {
            return;
        }
        for x in (0..STRIP).filter(|x| kept >> x & 1 == 0 && open[*x] > 0.0) {
            let from = (strip * STRIP + x) as u32;
            let to = match side {
                Side::South => change.columns.south(strip) * STRIP as u32 + x as u32,
                _ => from + 1,
            };
            let [flux, remainder] = self.of(change, flow, [from, to], side);
            flow.flux[axis][from as usize] = flux;
            flow.remainder[axis][from as usize] = remainder;
        }
    }

    /// Restores the heads of the band's columns.
    pub fn heads(change: &Change, flow: &mut Flow) {
        let Change { columns, band, origins } = change;
        let heads = flow.network.excess_heads_mut();
        for row in band.rows.clone() {
            for strip in columns.row(row) {
                let (old, kept) = origins.strip(strip);
                let now = strip_mut(heads, strip);
                now.fill(0.0);
                if kept != 0 {
                    let before = strip_of(&band.excess_heads, old - band.first);
                    for x in 0..STRIP {
                        now[x] = if kept >> x & 1 == 1 { before[x] } else { 0.0 };
                    }
                }
            }
        }
        for [index, old] in &origins.relayered {
            heads[*index as usize] = band.excess_heads[*old as usize];
        }
    }
}

impl Change<'_> {
    /// The former strip of an index.
    fn old_strip(&self, index: u32) -> Strip {
        let (strip, range) = (index as usize / STRIP, self.band.range());
        if range.contains(&strip) {
            return self.band.strips[strip - range.start];
        }
        let is_after = strip >= range.end;
        let shift = if is_after { self.origins.shift() } else { 0 };
        self.columns.strips()[(strip as u32).wrapping_add(shift) as usize]
    }

    /// The former flux and remainder of the regular pipe of an old index over a side. Pipes after the band stay regular and are never asked
    /// for; those before it have not shifted in `flow`.
    fn regular(&self, flow: &Flow, index: u32, side: Side) -> Carried {
        let axis = usize::from(side == Side::South);
        let (strip, range) = (index as usize / STRIP, self.band.range());
        if range.contains(&strip) {
            let at = index as usize - range.start * STRIP;
            [self.band.flux[axis][at], self.band.remainder[axis][at]]
        } else {
            [flow.flux[axis][index as usize], flow.remainder[axis][index as usize]]
        }
    }
}
