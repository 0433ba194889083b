//! Packets from the overflow edge to the ground, step by step: all liquid in the air.

use std::ops::Range;

use super::Falls;
use super::flight::{Air, End};
use super::packet::Packet;
use super::rivulets::Threads;
use super::splash::{Landing, merge, spread};
use crate::shallow::columns::{Columns, NONE, resize_part};
use crate::shallow::pipes::Links;
use crate::shallow::pipes::cliffs::beside;
use crate::shallow::pipes::joints::Side;
use crate::shallow::scalars::amounts::{Account, Act};
use crate::shallow::scalars::shares::{MOST, integer, take};
use crate::shallow::solver::Flow;
use crate::shallow::solver::overflow_edges::Over;
use crate::shallow::system::Shallow;

/// Bytes of an overflow edge in a saved state.
pub(in crate::shallow) const LIP: usize = 40;
/// Intervals after which liquid of less than a drop is released anyway.
const PATIENCE: u32 = 60;
/// Capacity for landings: columns for each packet.
const SPLASHES: usize = 4;
/// An overflow edge drips if a drop takes longer than this many intervals; otherwise it pours, in a packet each interval.
const DRIPS: i64 = 8;
/// Depth at the brink of a free overfall, relative to the critical depth (Rouse 1936).
const BRINK: f64 = 0.715;

/// Liquid that went over a link and is not a packet yet.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::shallow) struct Waiting {
    /// Volume (units), 0 and up, and amount of each scalar; saved states store the amounts separately.
    pub units: i64,
    pub amounts: [i64; MOST],
    /// Outward speed (cells/s), times units.
    pub impulse: f64,
    /// Direction of the last fall: from the link's second column.
    pub is_back: bool,
    /// Intervals that it has waited.
    pub waits: u32,
    /// Smoothed inflow of an interval (units), and the volume at the end of the last interval.
    pub steady: i64,
    pub before: i64,
    /// Lead of its packets within the interval, in 2^-31 of it: scattered by the inflow at the time the flow grew.
    pub phase: u32,
    /// Impulse received from other overflow edges; 0 between intervals.
    pub gathered: i64,
}

/// All liquid in the air.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Falling {
    /// In the order of their creation.
    packets: Vec<Packet>,
    /// By link; empty without falls.
    pub(super) waiting: Vec<Waiting>,
    /// Landings of a step; kept to avoid repeated allocation.
    landed: Vec<Landing>,
    pub(super) threads: Threads,
    /// Seconds since packets were last created, and how many times they were.
    pub since: f64,
    pub tick: u64,
}

impl Falling {
    /// Nothing in the air, with capacity for what may come.
    pub fn new(falls: Option<&Falls>, links: usize) -> Self {
        let Some(falls) = falls else { return Self::default() };
        Self {
            packets: Vec::with_capacity(falls.most),
            waiting: vec![Waiting::default(); links],
            landed: Vec::with_capacity(SPLASHES * falls.most),
            threads: Threads::with_room(links),
            ..Self::default()
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.packets.capacity() * (size_of::<Packet>() + SPLASHES * size_of::<Landing>())
            + size_of_val(&self.waiting[..])
            + self.threads.bytes()
    }

    /// All packets.
    pub fn packets(&self) -> &[Packet] {
        &self.packets
    }

    /// The liquid that waits at each link.
    pub fn waiting(&self) -> &[Waiting] {
        &self.waiting
    }

    /// Restores what [`Falling::packets`] and [`Falling::waiting`] returned; the links must be as many.
    pub fn set(&mut self, packets: impl Iterator<Item = Packet>, waiting: impl Iterator<Item = Waiting>) {
        self.packets.clear();
        self.packets.extend(packets);
        self.waiting.iter_mut().zip(waiting).for_each(|(to, waiting)| *to = waiting);
    }

    /// Units in the air.
    pub fn units(&self) -> i64 {
        let packets: i64 = self.packets.iter().map(|packet| packet.units).sum();
        packets + self.waiting.iter().map(|waiting| waiting.units).sum::<i64>()
    }

    /// Amount of a scalar in the air.
    pub fn amount(&self, scalar: usize) -> i128 {
        let packets: i128 = self.packets.iter().map(|packet| i128::from(packet.amounts[scalar])).sum();
        packets + self.waiting.iter().map(|waiting| i128::from(waiting.amounts[scalar])).sum::<i128>()
    }

    /// Clears all amounts, because the scalars have changed.
    pub fn forget_amounts(&mut self) {
        self.loads().for_each(|(_, amounts)| *amounts = [0; MOST]);
    }

    /// Units and amounts of each packet, and of the liquid that waits at each link.
    fn loads(&mut self) -> impl Iterator<Item = (i64, &mut [i64; MOST])> {
        let packets = self.packets.iter_mut().map(|packet| (packet.units, &mut packet.amounts));
        packets.chain(self.waiting.iter_mut().map(|waiting| (waiting.units, &mut waiting.amounts)))
    }

    /// Changes the count of a range of links; nothing waits at the new ones.
    pub fn replace(&mut self, links: Range<usize>, count: usize) {
        let new = links.start..links.start + count;
        resize_part(&mut self.waiting, links, count, Waiting::default());
        self.waiting[new].fill(Waiting::default());
    }
}

impl Waiting {
    /// Its serialised form, for a saved state.
    pub fn to_bytes(self) -> [u8; LIP] {
        let last = u64::from(self.waits) | u64::from(self.is_back) << 32 | u64::from(self.phase) << 33;
        let mut bytes = [0; LIP];
        let numbers =
            [self.units as u64, self.impulse.to_bits(), last, self.steady as u64, self.before as u64];
        bytes.as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(to, number)| *to = number.to_le_bytes());
        bytes
    }

    /// Reads what [`Waiting::to_bytes`] wrote; amounts are 0.
    pub fn from_bytes(bytes: &[u8; LIP]) -> Self {
        let [units, impulse, last, steady, before] =
            std::array::from_fn(|at| u64::from_le_bytes(bytes.as_chunks().0[at]));
        Self {
            units: units as i64,
            amounts: [0; MOST],
            impulse: f64::from_bits(impulse),
            is_back: last >> 32 & 1 != 0,
            waits: last as u32,
            steady: steady as i64,
            before: before as i64,
            phase: (last >> 33) as u32,
            gathered: 0,
        }
    }

    /// Whether it is valid for a link.
    pub fn is_of(&self, columns: &Columns, links: &Links, link: usize) -> bool {
        let is_void = links.to[link] == NONE;
        let is_lip = !is_void
            || !self.is_back
                && outward(links, link, false)
                    .cell(columns.cell(links.from[link] as usize), columns.grid.size)
                    .is_some();
        let steady = 0..i64::MAX / 8;
        self.units >= 0
            && (0.0..1e60).contains(&self.impulse)
            && steady.contains(&self.steady)
            && steady.contains(&self.before)
            && (!self.is_awake() || is_lip)
    }
}

impl Shallow {
    /// Finds the overflow edges of the next step.
    pub(in crate::shallow) fn find_lips(&mut self) {
        if self.params.falls.is_some() {
            let cliffs = Falls::cliffs(self.params.falls.as_ref(), &self.columns);
            self.flow.find_lips(&self.columns, &self.pipes.links, cliffs);
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
            self.falls.gather_threads(&self.columns, &self.pipes.links);
            self.let_go(&falls, 0..self.pipes.links.len(), false);
        }
    }

    /// Applies the laws of scalars to liquid in the air.
    fn obey_in_the_air(&mut self) {
        for (scalar, act) in self.flow.amounts.acts().iter().enumerate() {
            if *act != Act::default() {
                let loads = self.falls.loads();
                let grown = loads.map(|(units, amounts)| act.change(units, &mut amounts[scalar])).sum();
                self.flow.amounts.grow(scalar, grown);
            }
        }
    }

    /// Moves all packets, and lands those that hit something. All fly over the same surfaces, so that nothing depends on their order.
    fn fly(&mut self, dt: f64) {
        let mut packets = std::mem::take(&mut self.falls.packets);
        let mut landed = std::mem::take(&mut self.falls.landed);
        let (air, mut lost, mut gone) = (self.air(), 0, [0; MOST]);
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
        let mut own = [0; MOST];
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
        for over in flow.lips.over(&pipes.links, &flow.links) {
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

/// Adds amounts to others.
pub(super) fn add(to: &mut [i64; MOST], amounts: &[i64; MOST]) {
    to.iter_mut().zip(amounts).for_each(|(to, amount)| *to = to.saturating_add(*amount));
}

impl Waiting {
    fn goes(&self, least: f64, all: bool) -> bool {
        let most = self.units.max(DRIPS * self.steady);
        all || most as f64 >= least || self.waits >= PATIENCE
    }

    /// Whether liquid waits there, or arrived recently.
    pub(super) fn is_awake(&self) -> bool {
        self.units > 0 || self.steady > 0
    }

    /// Resets it after its liquid has left.
    pub(super) fn clear(&mut self) {
        let Self { is_back, steady, phase, .. } = *self;
        *self = Self { is_back, steady, phase, ..Self::default() };
    }
}

/// The side that liquid falls over, seen from the donor.
fn outward(links: &Links, link: usize, is_back: bool) -> Side {
    if is_back { links.sides[link].opposite() } else { links.sides[link] }
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
