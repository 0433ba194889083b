//! Packets from the overflow edge to the ground, step by step: all liquid in the air.

use std::ops::Range;

use super::Falls;
use super::flight::{Air, End};
use super::in_air::{Falling, SPLASHES};
use super::packet::Packet;
use super::splash::{Landing, merge, spread};
use super::waiting::{Waiting, add, outward};
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::pipes::cliffs::beside;
use crate::shallow::pipes::side::Side;
use crate::shallow::scalars::amounts::{Account, LawEffect};
use crate::shallow::scalars::shares::{MAX_SCALARS, integer, take};
use crate::shallow::solver::Flow;
use crate::shallow::solver::overflow_edges::Over;
use crate::shallow::system::Shallow;

/// Depth at the brink of a free overfall, relative to the critical depth (Rouse 1936).
const BRINK: f64 = 0.715;

impl Shallow {
    /// Finds the overflow edges of the next step.
    pub(in crate::shallow) fn find_overflow_edges(&mut self) {
        if self.params.falls.is_some() {
            let cliffs = Falls::cliffs(self.params.falls.as_ref(), &self.columns);
            self.flow.find_overflow_edges(&self.columns, &self.pipes.links, cliffs);
        }
    }

    /// Advances the falling liquid, in a step of `dt` (s) that the flow has made.
    pub(in crate::shallow) fn fall(&mut self, dt: f64) {
        let Some(falls) = self.params.falls else { return };
        self.obey_in_the_air();
        self.fly(dt);
        self.gather(dt);
        self.falls.since += dt;
        // Tolerates rounding where steps add up to an interval.
        if self.falls.since >= falls.interval * (1.0 - 1e-9) {
            self.falls.since = 0.0;
            self.falls.tick += 1;
            let Falling { threads, waiting, .. } = &mut self.falls;
            threads.gather(&self.columns, &self.pipes.links, waiting);
            self.let_go(&falls, 0..self.pipes.links.len(), false);
        }
    }

    /// Applies the laws of scalars to liquid in the air.
    fn obey_in_the_air(&mut self) {
        for (scalar, effect) in self.flow.amounts.law_effects().iter().enumerate() {
            if *effect != LawEffect::default() {
                let loads = self.falls.loads();
                let grown = loads.map(|(units, amounts)| effect.change(units, &mut amounts[scalar])).sum();
                self.flow.amounts.grow(scalar, grown);
            }
        }
    }

    /// Moves all packets, and lands those that hit something. All fly over the same surfaces, so that nothing depends on their order.
    fn fly(&mut self, dt: f64) {
        let mut packets = std::mem::take(&mut self.falls.packets);
        let mut landed = std::mem::take(&mut self.falls.landed);
        let (air, mut lost, mut gone) = (self.air(), 0, [0; MAX_SCALARS]);
        packets.retain_mut(|packet| {
            let end = air.fly(packet, dt);
            match end {
                End::Flies => {}
                End::Lands(column) => landed.push(packet.landing(column)),
                End::Leaves => {
                    lost += packet.units;
                    add(&mut gone, &packet.amounts);
                }
            }
            end == End::Flies
        });
        self.flow.links.lost += lost;
        self.flow.amounts.count_in(Account::Lost, &gone);
        self.falls.packets = packets;
        self.land_all(landed);
    }

    /// Adds landed liquid to its columns, all of a column at once, so that the result does not depend on an order, and spreads what finds
    /// no room there to adjacent columns; returns what falls from there into the void.
    fn land_all(&mut self, mut landed: Vec<Landing>) -> i64 {
        merge(&mut landed);
        let most = self.params.falls.map_or(0, |falls| SPLASHES * falls.most);
        spread(&self.columns, &mut landed, most);
        merge(&mut landed);
        let mut waits = false;
        for landing in landed.drain(..) {
            waits |= self.land(landing);
        }
        self.falls.landed = landed;
        if waits { self.release() } else { 0 }
    }

    fn air(&self) -> Air<'_> {
        let (grid, [x, y, z]) = (self.columns.grid, self.params.gravity);
        Air {
            columns: &self.columns,
            depth: &self.flow.depth,
            border: self.params.border,
            lean: [x / grid.cell, z / grid.cell],
            pull: -y / self.columns.heights.unit,
        }
    }

    /// Adds liquid to a column; returns whether some finds no room there and waits.
    fn land(&mut self, Landing { column, units, mut amounts }: Landing) -> bool {
        let (columns, flow, column) = (&self.columns, &mut self.flow, column as usize);
        let added = flow.change_depth(columns, column, units);
        let mut own = [0; MAX_SCALARS];
        take(&mut amounts, added, units, &mut own);
        flow.amounts.put(column, &own);
        let cell = columns.grid.index(columns.cell(column));
        self.remap.held.add(cell, columns.bases()[column], units - added, amounts);
        added < units
    }

    /// Collects what went over the overflow edges in a step of `dt` (s).
    fn gather(&mut self, dt: f64) {
        let Self { columns, pipes, flow, falls, params, .. } = self;
        let width = columns.heights.unit * columns.grid.cell / dt;
        for over in flow.overflow_edges.over(&pipes.links, &flow.links) {
            let is_back = over.from != pipes.links.from[over.link];
            let side = outward(&pipes.links, over.link, is_back);
            // Flux over section, in cells: the part of the column's depth that left in a step. Thin liquid has run out before it is as fast
            // as that.
            let flux = over.units as f64 / (f64::from(over.depth.max(1)) * dt);
            // At most the speed at its depth at the brink, unless it arrived faster; for thin liquid neither is computed.
            let (most, scale) = (-params.gravity[1] * over.units as f64 * width, BRINK * columns.grid.cell);
            let scaled = flux * scale;
            let speed = if scaled * scaled * scaled <= most {
                flux
            } else {
                flux.min((libm::cbrt(most) / scale).max(arriving(columns, flow, &over, side)))
            };
            let waiting = &mut falls.waiting[over.link];
            waiting.is_back = is_back;
            waiting.units += over.units;
            for (waiting, fallen) in waiting.amounts.iter_mut().zip(&flow.links.fallen) {
                let fallen = fallen.get(over.link).copied().unwrap_or(0.0);
                *waiting = waiting.saturating_add(integer(fallen));
            }
            waiting.impulse += over.units as f64 * speed;
        }
    }

    /// Turns waiting liquid at some links into packets, if it is enough or `all` is set. If there would be too many packets, all of it
    /// lands at once, so that the result does not depend on the links' order.
    fn let_go(&mut self, falls: &Falls, links: Range<usize>, all: bool) {
        let (columns, waiting) = (&self.columns, &mut self.falls.waiting);
        let least = falls.drop / (columns.grid.cell * columns.grid.cell * columns.heights.unit);
        let mut count = 0;
        for waiting in waiting[links.clone()].iter_mut().filter(|waiting| waiting.units > 0) {
            waiting.waits += u32::from(!all);
            count += usize::from(waiting.goes(least, all));
        }
        let fits = self.falls.packets.len() + count <= falls.most;
        let mut packets = std::mem::take(&mut self.falls.packets);
        let mut landed = std::mem::take(&mut self.falls.landed);
        for link in links {
            let waiting = self.falls.waiting[link];
            if waiting.units == 0 {
                self.falls.waiting[link].before = 0;
                continue;
            }
            if !waiting.goes(least, all) {
                self.falls.waiting[link].before = waiting.units;
                continue;
            }
            self.falls.waiting[link].clear();
            let end = if fits {
                let mut packet = self.packet(link, &waiting);
                // It has waited, and left a little earlier: not all overflow edges release packets at the same time.
                let ahead = if all { 0.0 } else { f64::from(waiting.phase) / f64::from(1u32 << 31) };
                let end = self.air().fly(&mut packet, ahead * falls.interval);
                if end == End::Flies {
                    packets.push(packet);
                }
                end
            } else {
                let links = &self.pipes.links;
                match if waiting.is_back { links.from[link] } else { links.to[link] } {
                    NONE => End::Leaves,
                    column => End::Lands(column as usize),
                }
            };
            match end {
                End::Flies => {}
                End::Leaves => {
                    self.flow.links.lost += waiting.units;
                    self.flow.amounts.count_in(Account::Lost, &waiting.amounts);
                }
                End::Lands(column) => {
                    let (column, units, amounts) = (column as u32, waiting.units, waiting.amounts);
                    landed.push(Landing { column, units, amounts });
                }
            }
        }
        self.falls.packets = packets;
        self.land_all(landed);
    }

    /// A packet at the beginning of its flight: at the side of the cell that it falls into.
    fn packet(&self, link: usize, waiting: &Waiting) -> Packet {
        let (columns, links) = (&self.columns, &self.pipes.links);
        let from = (if waiting.is_back { links.to[link] } else { links.from[link] }) as usize;
        let side = outward(links, link, waiting.is_back);
        let own = columns.cell(from);
        let cell = side.cell(own, columns.grid.size).expect("the border has no lips").map(|at| at as u32);
        let speed = waiting.impulse / waiting.units as f64;
        let (offset, along) = match side {
            Side::East => ([-0.5, 0.0], [speed, 0.0]),
            Side::West => ([0.5, 0.0], [-speed, 0.0]),
            Side::South => ([0.0, -0.5], [0.0, speed]),
            Side::North => ([0.0, 0.5], [0.0, -speed]),
        };
        let lip = (columns.grid.index(own) * 4 + side as usize) as u64;
        Packet {
            cell,
            offset,
            height: f64::from(columns.bases()[from]),
            down: 0.0,
            along,
            age: 0.0,
            units: waiting.units,
            amounts: waiting.amounts,
            source: lip << 16 | columns.layer(from) as u64,
            tick: self.falls.tick,
        }
    }

    /// Turns all liquid that waits at the links of rows into packets, before the rows change.
    pub(in crate::shallow) fn let_go_of(&mut self, rows: Range<usize>) {
        if let Some(falls) = self.params.falls {
            let links = &self.pipes.links;
            let links = links.row(rows.start).start..links.row(rows.end - 1).end;
            self.let_go(&falls, links, true);
        }
    }

    /// Lands the packets that the moved terrain has buried, on the column above the solid; returns what falls from there into the void
    /// (units).
    pub(in crate::shallow) fn land_buried(&mut self) -> i64 {
        let mut packets = std::mem::take(&mut self.falls.packets);
        let mut landed = std::mem::take(&mut self.falls.landed);
        let air = self.air();
        packets.retain(|packet| {
            let above = air.above_solid(packet);
            landed.extend(above.map(|column| packet.landing(column)));
            above.is_none()
        });
        self.falls.packets = packets;
        self.land_all(landed)
    }
}

impl Packet {
    /// Its landing on a column.
    fn landing(&self, column: usize) -> Landing {
        Landing { column: column as u32, units: self.units, amounts: self.amounts }
    }
}

/// The speed (cells/s) at which liquid arrives at an overflow edge from the column behind it, through a regular pipe; 0 if none does.
fn arriving(columns: &Columns, flow: &Flow, over: &Over, side: Side) -> f64 {
    let from = over.from as usize;
    let Some(behind) = beside(columns, from, side.opposite()) else { return 0.0 };
    let [east, south] = &flow.flux;
    let flux = match side {
        Side::East => east[behind],
        Side::West => -east[from],
        Side::South => south[behind],
        Side::North => -south[from],
    };
    let depth = flow.depth[behind];
    if flux <= 0.0 || depth <= 0 { 0.0 } else { f64::from(flux) / (f64::from(depth) * flow.last) }
}
