//! Packets from the overflow edge to the ground, step by step: all liquid in the air.

use std::ops::Range;

use super::Falls;
use super::flight::{Air, Outcome};
use super::in_air::{Falling, LANDINGS_PER_PACKET};
use super::packet::Packet;
use super::splash::{Landing, merge, spread};
use super::waiting::{Waiting, add, outward};
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::pipes::cliffs::index_beyond;
use crate::shallow::pipes::side::Side;
use crate::shallow::scalars::amounts::{Account, LawEffect};
use crate::shallow::scalars::shares::{MAX_SCALARS, integer, take};
use crate::shallow::solver::Flow;
use crate::shallow::solver::overflow_edges::Overflow;
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
    pub(in crate::shallow) fn advance_falling(&mut self, dt: f64) {
        let Some(falls) = self.params.falls else { return };
        self.apply_laws_in_air();
        self.fly(dt);
        self.collect_overflow(dt);
        self.falls.since += dt;
        // Tolerates rounding where steps add up to an interval.
        if self.falls.since >= falls.interval * (1.0 - 1e-9) {
            self.falls.since = 0.0;
            self.falls.tick += 1;
            let Falling { rivulets, waiting, .. } = &mut self.falls;
            rivulets.gather(&self.columns, &self.pipes.links, waiting);
            self.release_packets(&falls, 0..self.pipes.links.len(), false);
        }
    }

    /// Applies the laws of scalars to liquid in the air.
    fn apply_laws_in_air(&mut self) {
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
                Outcome::Flies => {}
                Outcome::Lands(column) => landed.push(packet.landing(column)),
                Outcome::Leaves => {
                    lost += packet.units;
                    add(&mut gone, &packet.amounts);
                }
            }
            end == Outcome::Flies
        });
        self.flow.links.lost += lost;
        self.flow.amounts.add_to_account(Account::Lost, &gone);
        self.falls.packets = packets;
        self.land_all(landed);
    }

    /// Adds landed liquid to its columns, all of a column at once, so that the result does not depend on the order of landings, and spreads
    /// what finds no room there to adjacent columns; returns what falls from there into the void.
    fn land_all(&mut self, mut landed: Vec<Landing>) -> i64 {
        merge(&mut landed);
        let max_landings = self.params.falls.map_or(0, |falls| LANDINGS_PER_PACKET * falls.max_packets);
        spread(&self.columns, &mut landed, max_landings);
        merge(&mut landed);
        let mut waits = false;
        for landing in landed.drain(..) {
            waits |= self.land(landing);
        }
        self.falls.landed = landed;
        if waits { self.settle_held() } else { 0 }
    }

    fn air(&self) -> Air<'_> {
        let (grid, [x, y, z]) = (self.columns.grid, self.params.gravity);
        Air {
            columns: &self.columns,
            depth: &self.flow.depth,
            border: self.params.border,
            gravity_along: [x / grid.cell, z / grid.cell],
            gravity_down: -y / self.columns.heights.unit,
        }
    }

    /// Adds liquid to a column; returns whether some finds no room there and waits.
    fn land(&mut self, Landing { column, units, mut amounts }: Landing) -> bool {
        let (columns, flow, column) = (&self.columns, &mut self.flow, column as usize);
        let added = flow.change_depth(columns, column, units);
        let mut own = [0; MAX_SCALARS];
        take(&mut amounts, added, units, &mut own);
        flow.amounts.add_amounts(column, &own);
        let cell = columns.grid.index(columns.cell(column));
        self.remap.held.add(cell, columns.bases()[column], units - added, amounts);
        added < units
    }

    /// Collects what went over the overflow edges in a step of `dt` (s).
    fn collect_overflow(&mut self, dt: f64) {
        let Self { columns, pipes, flow, falls, params, .. } = self;
        let width = columns.heights.unit * columns.grid.cell / dt;
        for overflow in flow.overflow_edges.overflow(&pipes.links, &flow.links) {
            let is_back = overflow.from != pipes.links.from[overflow.link];
            let side = outward(&pipes.links, overflow.link, is_back);
            // Outflow speed (cells/s): the part of the column's depth that left, per second.
            let speed = overflow.units as f64 / (f64::from(overflow.depth.max(1)) * dt);
            // At most the speed at the brink for this discharge, unless the liquid arrives faster. Thin liquid is slower: for it neither is
            // computed.
            let (critical_cube, scale) =
                (-params.gravity[1] * overflow.units as f64 * width, BRINK * columns.grid.cell);
            let scaled = speed * scale;
            let speed = if scaled * scaled * scaled <= critical_cube {
                speed
            } else {
                speed.min((libm::cbrt(critical_cube) / scale).max(arriving(columns, flow, &overflow, side)))
            };
            let waiting = &mut falls.waiting[overflow.link];
            waiting.is_back = is_back;
            waiting.units += overflow.units;
            for (waiting, fallen) in waiting.amounts.iter_mut().zip(&flow.links.fallen) {
                let fallen = fallen.get(overflow.link).copied().unwrap_or(0.0);
                *waiting = waiting.saturating_add(integer(fallen));
            }
            waiting.impulse += overflow.units as f64 * speed;
        }
    }

    /// Turns waiting liquid at some links into packets, if it is enough or `all` is set. If there would be too many packets, all of it
    /// lands at once, so that the result does not depend on the links' order.
    fn release_packets(&mut self, falls: &Falls, links: Range<usize>, all: bool) {
        let (columns, waiting) = (&self.columns, &mut self.falls.waiting);
        let min_units = falls.drop / (columns.grid.cell * columns.grid.cell * columns.heights.unit);
        let mut count = 0;
        for waiting in waiting[links.clone()].iter_mut().filter(|waiting| waiting.units > 0) {
            waiting.waits += u32::from(!all);
            count += usize::from(waiting.is_due(min_units, all));
        }
        let has_room = self.falls.packets.len() + count <= falls.max_packets;
        let mut packets = std::mem::take(&mut self.falls.packets);
        let mut landed = std::mem::take(&mut self.falls.landed);
        for link in links {
            let waiting = self.falls.waiting[link];
            if waiting.units == 0 {
                self.falls.waiting[link].before = 0;
                continue;
            }
            if !waiting.is_due(min_units, all) {
                self.falls.waiting[link].before = waiting.units;
                continue;
            }
            self.falls.waiting[link].clear();
            let end = if has_room {
                let mut packet = self.packet(link, &waiting);
                // It has waited, and left a little earlier: not all overflow edges release packets at the same time.
                let ahead = if all { 0.0 } else { f64::from(waiting.phase) / f64::from(1u32 << 31) };
                let end = self.air().fly(&mut packet, ahead * falls.interval);
                if end == Outcome::Flies {
                    packets.push(packet);
                }
                end
            } else {
                let links = &self.pipes.links;
                match if waiting.is_back { links.from[link] } else { links.to[link] } {
                    NONE => Outcome::Leaves,
                    column => Outcome::Lands(column as usize),
                }
            };
            match end {
                Outcome::Flies => {}
                Outcome::Leaves => {
                    self.flow.links.lost += waiting.units;
                    self.flow.amounts.add_to_account(Account::Lost, &waiting.amounts);
                }
                Outcome::Lands(column) => {
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
        let cell = side
            .cell(own, columns.grid.size)
            .expect("overflow edges are inside the domain")
            .map(|at| at as u32);
        let speed = waiting.impulse / waiting.units as f64;
        let (offset, along) = match side {
            Side::East => ([-0.5, 0.0], [speed, 0.0]),
            Side::West => ([0.5, 0.0], [-speed, 0.0]),
            Side::South => ([0.0, -0.5], [0.0, speed]),
            Side::North => ([0.0, 0.5], [0.0, -speed]),
        };
        let edge = (columns.grid.index(own) * 4 + side as usize) as u64;
        Packet {
            cell,
            offset,
            height: f64::from(columns.bases()[from]),
            down: 0.0,
            along,
            age: 0.0,
            units: waiting.units,
            amounts: waiting.amounts,
            source: edge << 16 | columns.layer(from) as u64,
            tick: self.falls.tick,
        }
    }

    /// Turns all liquid that waits at the links of rows into packets, before the rows change.
    pub(in crate::shallow) fn release_packets_of(&mut self, rows: Range<usize>) {
        if let Some(falls) = self.params.falls {
            let links = &self.pipes.links;
            let links = links.row(rows.start).start..links.row(rows.end - 1).end;
            self.release_packets(&falls, links, true);
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
fn arriving(columns: &Columns, flow: &Flow, overflow: &Overflow, side: Side) -> f64 {
    let from = overflow.from as usize;
    let Some(behind) = index_beyond(columns, from, side.opposite()) else { return 0.0 };
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
