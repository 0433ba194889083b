//! All liquid in the air.

use std::iter::repeat_n;
use std::ops::Range;

use super::Falls;
use super::packet::Packet;
use super::rivulets::Rivulets;
use super::splash::Landing;
use super::waiting::Waiting;
use crate::numeric::lists::refill;
use crate::shallow::scalars::shares::MAX_SCALARS;

/// Capacity of the list of landings: this many columns for each packet.
pub(super) const LANDINGS_PER_PACKET: usize = 4;

/// All liquid in the air.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Falling {
    /// In the order of their creation.
    pub packets: Vec<Packet>,
    /// By link; empty without falls.
    pub waiting: Vec<Waiting>,
    /// Landings of a step; kept to avoid repeated allocation.
    pub(super) landed: Vec<Landing>,
    pub(super) rivulets: Rivulets,
    /// Seconds since packets were last created, and how many times packets were created.
    pub since: f64,
    pub tick: u64,
}

impl Falling {
    /// Nothing in the air, with capacity for what may come.
    pub fn new(falls: Option<&Falls>, links: usize) -> Self {
        let Some(falls) = falls else { return Self::default() };
        Self {
            packets: Vec::with_capacity(falls.max_packets),
            waiting: vec![Waiting::default(); links],
            landed: Vec::with_capacity(LANDINGS_PER_PACKET * falls.max_packets),
            rivulets: Rivulets::with_room(links),
            ..Self::default()
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.packets.capacity() * (size_of::<Packet>() + LANDINGS_PER_PACKET * size_of::<Landing>())
            + size_of_val(&self.waiting[..])
            + self.rivulets.bytes()
    }

    /// Replaces the packets, and what waits at each link.
    pub fn set(&mut self, packets: impl Iterator<Item = Packet>, waiting: impl Iterator<Item = Waiting>) {
        refill(&mut self.packets, packets);
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
        self.loads().for_each(|(_, amounts)| *amounts = [0; MAX_SCALARS]);
    }

    /// Units and amounts of each packet, and of the liquid that waits at each link.
    pub fn loads(&mut self) -> impl Iterator<Item = (i64, &mut [i64; MAX_SCALARS])> {
        let packets = self.packets.iter_mut().map(|packet| (packet.units, &mut packet.amounts));
        packets.chain(self.waiting.iter_mut().map(|waiting| (waiting.units, &mut waiting.amounts)))
    }

    /// Changes the count of a range of links; nothing waits at the new ones.
    pub fn replace(&mut self, links: Range<usize>, count: usize) {
        self.waiting.splice(links, repeat_n(Waiting::default(), count));
    }
}
