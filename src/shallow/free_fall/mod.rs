//! Liquid that falls freely over cliffs, through holes and into the void: it flies, in packets, until it lands.
//!
//! | word | meaning |
//! |---|---|
//! | overflow edge | a link that liquid falls freely from in a step: the void is beyond, or the surface there is lower by more than a given height (`solver/overflow_edges.rs`) |
//! | rivulet | an overflow edge that also takes the liquid of those near it (`free_fall/rivulets.rs`) |
//! | packet | what went over an overflow edge in some steps; whole units of volume, which fly together (`flight.rs`) and land together (`falling.rs`, `splash.rs`) |
//! | drop | a packet, as a host sees it |
//! | strand | a tube between consecutive packets of an overflow edge, and from the edge to the newest (`mesh.rs`) |
//!
//! A packet begins at the base of the overflow edge, with the velocity of the liquid there. This is limited to the velocity at the brink of
//! a free overfall, 1.4 times the critical velocity of its flow (Rouse, Civil Engineering 6, 1936), or to that of the liquid that arrives
//! there, if it is faster. It flies without drag, and lands on and around the first surface that it hits; liquid that finds no room there
//! is handled as when the terrain moves (`remap/held.rs`). At a wall it stops, and falls down along it. Where there is no ground it leaves
//! the domain below its minimum height, or over an open border, and is lost.

mod falling;
mod flight;
mod in_air;
pub mod mesh;
mod packet;
mod params;
mod rivulets;
mod splash;
mod waiting;

use super::scalars::MAX_SCALARS;
use super::scalars::shares::LEVELS;
use super::system::Shallow;
pub(super) use crate::shallow::free_fall::in_air::Falling;
pub(super) use crate::shallow::free_fall::waiting::{WAITING_BYTES, Waiting};
pub(super) use packet::{PACKET_BYTES, Packet};
pub use params::Falls;

/// Liquid in the air, as a host sees it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Droplet {
    /// Its position (m).
    pub position: [f64; 3],
    /// Its velocity (m/s).
    pub velocity: [f64; 3],
    /// Volume (m3).
    pub volume: f64,
    /// Radius of a ball of its volume (m).
    pub radius: f64,
    /// Seconds since it left its overflow edge.
    pub age: f64,
    /// Its overflow edge: the same number for all drops from one side of one column.
    pub source: u64,
    /// Concentration of each scalar, in the scalar's own unit.
    pub concentrations: [f32; MAX_SCALARS],
    /// Where the liquid leaves the ground; only for the newest drop there.
    pub overflow_edge: Option<OverflowEdge>,
    /// One more than the number of the previous drop of the same overflow edge, unless the flow there was interrupted.
    pub number: u64,
}

/// Where liquid leaves the ground.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OverflowEdge {
    /// The middle of the column that it comes from, at half its depth (m).
    pub position: [f64; 3],
    /// Depth there (m).
    pub depth: f64,
    /// A unit vector along the edge.
    pub edge: [f64; 3],
}

impl Shallow {
    /// The liquid in the air, in the order in which it left the overflow edges; at most [`Falls::max_packets`].
    pub fn drops(&self) -> impl ExactSizeIterator<Item = Droplet> + '_ {
        let (grid, heights) = (self.columns.grid, self.columns.heights);
        let unit = grid.cell * grid.cell * heights.unit;
        let scalars = self.scalars();
        self.falls.packets.iter().map(move |packet| {
            let mut concentrations = [0.0; MAX_SCALARS];
            for ((out, scalar), amount) in concentrations.iter_mut().zip(scalars).zip(packet.amounts) {
                *out = (amount as f64 / packet.units as f64 * (scalar.range / LEVELS)) as f32;
            }
            let coordinate = |axis: usize| {
                grid.origin[axis] + (f64::from(packet.cell[axis]) + 0.5 + packet.offset[axis]) * grid.cell
            };
            let [east, south] = packet.along.map(|speed| speed * grid.cell);
            let volume = packet.units as f64 * unit;
            let overflow_edge =
                (packet.tick == self.falls.tick).then(|| self.overflow_edge_of(packet)).flatten();
            Droplet {
                position: [coordinate(0), heights.low + packet.height * heights.unit, coordinate(1)],
                velocity: [east, -packet.down * heights.unit, south],
                volume,
                radius: libm::cbrt(0.75 / std::f64::consts::PI * volume),
                age: packet.age,
                source: packet.source,
                concentrations,
                overflow_edge,
                number: packet.tick,
            }
        })
    }

    /// Where a packet's liquid comes from; None if the ground has moved since.
    fn overflow_edge_of(&self, packet: &Packet) -> Option<OverflowEdge> {
        let (columns, unit) = (&self.columns, self.columns.heights.unit);
        let (cell, layer) = ((packet.source >> 18) as usize, (packet.source & 0xffff) as usize);
        let cell = [cell % columns.grid.size[0], cell / columns.grid.size[0]];
        let column = columns.column(cell, layer)?;
        let ([x, z], base) = (columns.grid.centre(cell), f64::from(columns.bases()[column]) * unit);
        let depth = f64::from(self.flow.depth[column]) * unit;
        // Sides to the east and to the west have even numbers.
        let edge = if packet.source >> 16 & 1 == 0 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
        Some(OverflowEdge { position: [x, columns.heights.low + base + 0.5 * depth, z], depth, edge })
    }
}
