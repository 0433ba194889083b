//! A packet of liquid in the air.

use crate::shallow::columns::Columns;
use crate::shallow::columns::grid::TOP;
use crate::shallow::scalars::MAX_SCALARS;

/// Bytes of a packet in a saved state.
pub(in crate::shallow) const PACKET_BYTES: usize = 88;
/// Upper bound of a packet's speed (cells/s, units/s).
const MAX_SPEED: f64 = 1e30;

/// Liquid in the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shallow) struct Packet {
    /// Its cell (x, z), and its position relative to the cell's centre (cells): -0.5 to 0.5.
    pub cell: [u32; 2],
    pub offset: [f64; 2],
    /// Height, 0 and up, and downward speed (units, units/s).
    pub height: f64,
    pub down: f64,
    /// Velocity along x and z (cells/s).
    pub along: [f64; 2],
    /// Seconds since it left its overflow edge.
    pub age: f64,
    /// Volume (units), above 0, and amount of each scalar; saved states store the amounts separately.
    pub units: i64,
    pub amounts: [i64; MAX_SCALARS],
    /// Its origin: the cell (`Grid::index`), its side and its layer.
    pub source: u64,
    /// When it was created: how many times packets had been created since the start.
    pub tick: u64,
}

impl Packet {
    /// Its serialised form, for a saved state.
    pub fn to_bytes(self) -> [u8; PACKET_BYTES] {
        let cell = u64::from(self.cell[0]) | u64::from(self.cell[1]) << 32;
        let [x, z] = self.offset;
        let [east, south] = self.along;
        let floats = [x, z, self.height, self.down, east, south, self.age].map(f64::to_bits);
        let numbers = [cell, self.units as u64, self.source, self.tick];
        let mut bytes = [0; PACKET_BYTES];
        let all = numbers.iter().chain(&floats);
        bytes.as_chunks_mut().0.iter_mut().zip(all).for_each(|(to, number)| *to = number.to_le_bytes());
        bytes
    }

    /// Reads what [`Packet::to_bytes`] wrote; amounts are 0.
    pub fn from_bytes(bytes: &[u8; PACKET_BYTES]) -> Self {
        let all: [u64; PACKET_BYTES / 8] =
            std::array::from_fn(|at| u64::from_le_bytes(bytes.as_chunks().0[at]));
        let [cell, units, source, tick, floats @ ..] = all;
        let [x, z, height, down, east, south, age] = floats.map(f64::from_bits);
        let (cell, units) = ([cell as u32, (cell >> 32) as u32], units as i64);
        Self {
            cell,
            offset: [x, z],
            height,
            down,
            along: [east, south],
            age,
            units,
            amounts: [0; MAX_SCALARS],
            source,
            tick,
        }
    }

    /// Whether it is valid in the air over these columns.
    pub fn is_valid_in(&self, columns: &Columns) -> bool {
        let [nx, nz] = columns.grid.size;
        (self.cell[0] as usize) < nx
            && (self.cell[1] as usize) < nz
            && self.offset.iter().all(|offset| (-0.5..=0.5).contains(offset))
            && (0.0..=f64::from(TOP)).contains(&self.height)
            && (0.0..MAX_SPEED).contains(&self.down)
            && self.along.iter().all(|speed| (-MAX_SPEED..MAX_SPEED).contains(speed))
            && (0.0..MAX_SPEED).contains(&self.age)
            && self.units > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_survives_its_bytes() {
        let packet = Packet {
            cell: [3, 70_000],
            offset: [-0.25, 0.5],
            height: 1234.5,
            down: 17.0,
            along: [-3.0, 0.125],
            age: 0.75,
            units: 1 << 40,
            amounts: [0; MAX_SCALARS],
            source: 99 << 18,
            tick: 5,
        };
        assert_eq!(Packet::from_bytes(&packet.to_bytes()), packet);
    }
}
