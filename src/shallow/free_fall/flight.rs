//! The flight of packets: ballistics without drag, in closed form from cell to cell, with collisions.
//!
//! Positions are a cell and an offset from its centre, heights are in lattice units: a scene that is turned or mirrored has the same
//! flights, bit for bit. A packet is followed from one side of a cell to the next, and hits the surface of the column below it wherever it
//! crosses that surface: no step is so long that it passes through one.

use super::packet::Packet;
use crate::shallow::columns::Columns;
use crate::shallow::pipes::Border;

/// The surroundings of packets.
pub(super) struct Air<'a> {
    pub columns: &'a Columns,
    /// H of every column index (units).
    pub depth: &'a [i32],
    pub border: Border,
    /// Gravity: along x and z (cells/s2), and downward (units/s2).
    pub gravity_along: [f64; 2],
    pub gravity_down: f64,
}

/// The outcome of a part of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// It continues.
    Flies,
    /// It lands on a column.
    Lands(usize),
    /// It leaves the domain.
    Leaves,
}

/// What is at a height in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Location {
    /// The space of a column, wet or not.
    In(usize),
    /// The solid below a column.
    Solid(usize),
    /// No ground below.
    Void,
}

impl Air<'_> {
    /// Moves a packet for `dt` (s), or until its flight ends.
    pub fn fly(&self, packet: &mut Packet, dt: f64) -> Outcome {
        let mut left = dt;
        let mut stopped = [false; 2];
        packet.age += dt;
        loop {
            let (floor, end) = match self.locate(packet.cell, packet.height) {
                Location::Solid(above) => return Outcome::Lands(above),
                Location::In(column) => (self.surface(column), Outcome::Lands(column)),
                Location::Void => (0.0, Outcome::Leaves),
            };
            if packet.height <= floor {
                return end;
            }
            let exits =
                [0, 1].map(|axis| if stopped[axis] { f64::INFINITY } else { self.exit_time(packet, axis) });
            let first = exits[0].min(exits[1]);
            let time = first.min(left);
            if self.fall_time(packet, packet.height - floor) <= time {
                return end;
            }
            self.advance(packet, time, stopped);
            left -= time;
            if first > time {
                return if packet.height <= floor { end } else { Outcome::Flies };
            }
            let crossed = exits.map(|exit| exit == first);
            match self.cross(packet, crossed) {
                Crossed::Stopped(axes) => (0..2).for_each(|axis| stopped[axis] |= axes[axis]),
                Crossed::Into(cell) => packet.cell = cell,
                Crossed::Out => return Outcome::Leaves,
            }
        }
    }

    /// The column above the solid that a packet is in; None if it is not in a solid.
    pub fn above_solid(&self, packet: &Packet) -> Option<usize> {
        match self.locate(packet.cell, packet.height) {
            Location::Solid(above) => Some(above),
            _ => None,
        }
    }

    fn surface(&self, column: usize) -> f64 {
        f64::from(self.columns.bases()[column] + self.depth[column])
    }

    fn locate(&self, cell: [u32; 2], height: f64) -> Location {
        let mut location = Location::Void;
        for column in self.columns.of_cell(cell.map(|at| at as usize)) {
            if height < f64::from(self.columns.bases()[column]) {
                let is_below = height < f64::from(self.columns.unders()[column]);
                // It is not below the ceiling of the column before.
                return if is_below { Location::Void } else { Location::Solid(column) };
            }
            location = Location::In(column);
            if height < f64::from(self.columns.ceilings()[column]) {
                break;
            }
        }
        location
    }

    /// The time (s) until a packet leaves its cell along an axis.
    fn exit_time(&self, packet: &Packet, axis: usize) -> f64 {
        let (at, speed, pull) = (packet.offset[axis], packet.along[axis], self.gravity_along[axis]);
        travel_time(0.5 - at, speed, pull).min(travel_time(0.5 + at, -speed, -pull))
    }

    /// The time (s) until a packet is `drop` lower (units).
    fn fall_time(&self, packet: &Packet, drop: f64) -> f64 {
        let speed = packet.down;
        2.0 * drop / (speed + (speed * speed + 2.0 * self.gravity_down * drop).sqrt())
    }

    fn advance(&self, packet: &mut Packet, time: f64, stopped: [bool; 2]) {
        for axis in (0..2).filter(|&axis| !stopped[axis]) {
            let (speed, pull) = (packet.along[axis], self.gravity_along[axis]);
            packet.offset[axis] = (packet.offset[axis] + (speed + 0.5 * pull * time) * time).clamp(-0.5, 0.5);
            packet.along[axis] = speed + pull * time;
        }
        packet.height -= (packet.down + 0.5 * self.gravity_down * time) * time;
        packet.down += self.gravity_down * time;
    }

    /// Takes a packet over the sides of its cell that it has reached. At a wall it stops, and falls down along it.
    fn cross(&self, packet: &mut Packet, crossed: [bool; 2]) -> Crossed {
        let size = self.columns.grid.size;
        let (mut cell, mut is_out) = (packet.cell, [false; 2]);
        let mut offset = packet.offset;
        for axis in (0..2).filter(|&axis| crossed[axis]) {
            // The nearer side: the packet is at one of them, up to rounding.
            let ahead = packet.offset[axis] > 0.0;
            packet.offset[axis] = if ahead { 0.5 } else { -0.5 };
            offset[axis] = -packet.offset[axis];
            let next = if ahead { cell[axis].wrapping_add(1) } else { cell[axis].wrapping_sub(1) };
            is_out[axis] = next as usize >= size[axis];
            cell[axis] = next;
        }
        let stops = if is_out.contains(&true) {
            if self.border != Border::Closed {
                return Crossed::Out;
            }
            is_out
        } else if matches!(self.locate(cell, packet.height), Location::Solid(_)) {
            crossed
        } else {
            packet.offset = offset;
            return Crossed::Into(cell);
        };
        (0..2).filter(|&axis| stops[axis]).for_each(|axis| packet.along[axis] = 0.0);
        Crossed::Stopped(stops)
    }
}

/// What is beyond a side of a cell.
enum Crossed {
    /// A wall, along these axes.
    Stopped([bool; 2]),
    /// Another cell.
    Into([u32; 2]),
    /// Nothing: the border is open.
    Out,
}

/// The time (s) in which a body with a speed and an acceleration moves a distance of 0 or more outward; infinite if it never does.
fn travel_time(distance: f64, speed: f64, pull: f64) -> f64 {
    let square = speed * speed + 2.0 * pull * distance;
    if speed > 0.0 && square >= 0.0 {
        2.0 * distance / (speed + square.sqrt())
    } else if pull > 0.0 {
        // It comes back, or starts from rest.
        (square.sqrt() - speed) / pull
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
    use crate::shallow::terrain::Solids;

    /// Cells of a millimetre; units in a metre.
    const CELL: f64 = 0.001;
    const METRE: f64 = (1 << 30) as f64 / 8.0;

    /// Columns above the solids (m) of each cell, 8 m high.
    fn columns(size: [usize; 2], cell: impl Fn([usize; 2]) -> Vec<[f64; 2]>) -> Columns {
        let heights = Heights::between(0.0, 8.0).unwrap();
        let solid = |[low, top]: [f64; 2]| {
            [if low < 0.0 { BOTTOMLESS } else { heights.round(low) }, heights.round(top)]
        };
        let cells = (0..size[0] * size[1]).map(|index| cell([index % size[0], index / size[0]]));
        let cells = cells.map(|cell| cell.into_iter().map(solid).collect::<Vec<_>>());
        Columns::new(&Solids::new(Grid { cell: CELL, origin: [0.0; 2], size }, heights, cells))
    }

    /// The end of a flight that begins in the middle of a cell at a height (m), with a velocity (m/s), in steps of `dt` (s); and the
    /// packet.
    fn end(
        columns: &Columns,
        border: Border,
        (cell, height): ([u32; 2], f64),
        [east, down, south]: [f64; 3],
        dt: f64,
    ) -> (Outcome, Packet) {
        let depth = vec![0; columns.len()];
        let air = Air { columns, depth: &depth, border, gravity_along: [0.0; 2], gravity_down: 9.81 * METRE };
        let mut packet = Packet {
            cell,
            offset: [0.0; 2],
            height: height * METRE,
            down: down * METRE,
            along: [east / CELL, south / CELL],
            age: 0.0,
            units: 1,
            source: 0,
            tick: 0,
            amounts: Default::default(),
        };
        for _ in 0..10_000 {
            match air.fly(&mut packet, dt) {
                Outcome::Flies => {}
                end => return (end, packet),
            }
        }
        (Outcome::Flies, packet)
    }

    #[test]
    fn fast_packets_pass_through_no_layer() {
        // A sheet of 10 um over the ground, hit slantwise, in steps of 30 cm.
        let sheet = columns([600, 4], |_| vec![[-1.0, 0.1], [0.5, 0.500_01]]);
        for velocity in [[0.0, 10.0, 0.0], [5.0, 10.0, 0.0], [10.0, 0.1, 0.0], [8.0, 6.0, 0.002]] {
            for height in [0.501, 0.65, 0.7] {
                let (end, packet) = end(&sheet, Border::Closed, ([10, 1], height), velocity, 0.03);
                let Outcome::Lands(column) = end else { panic!("{end:?} {packet:?}") };
                assert_eq!(sheet.layer(column), 1, "{velocity:?} from {height} m");
            }
        }
        // A wall one cell thick: it falls down along it, onto the ground.
        let wall = columns([600, 4], |[x, _]| vec![[-1.0, if x == 300 { 3.0 } else { 0.1 }]]);
        for (cell, east) in [([10, 1], 10.0), ([590, 2], -10.0)] {
            let (end, packet) = end(&wall, Border::Closed, (cell, 2.0), [east, 0.0, 0.0], 0.03);
            let Outcome::Lands(column) = end else { panic!("{end:?}") };
            let [x, _] = wall.cell(column);
            assert_eq!((x, packet.along[0]), (if east > 0.0 { 299 } else { 301 }, 0.0));
        }
        // Along both axes at once, through the corner of four cells.
        let corner = columns([40, 40], |[x, z]| vec![[-1.0, if x + z >= 40 { 3.0 } else { 0.1 }]]);
        let (end, packet) = end(&corner, Border::Closed, ([10, 10], 2.0), [10.0, 0.0, 10.0], 0.03);
        assert!(
            matches!(end, Outcome::Lands(column) if corner.cell(column) == [19, 19]),
            "{end:?} {packet:?}"
        );
    }

    #[test]
    fn a_flight_ends_where_the_parabola_meets_the_ground() {
        let ground = columns([4000, 1], |_| vec![[-1.0, 0.1]]);
        for (height, east) in [(1.1, 1.0), (0.6, 2.0), (3.1, 0.3), (7.9, 2.5)] {
            for dt in [1e-3, 0.0137, 0.2, 3.0] {
                let (end, _) = end(&ground, Border::Closed, ([0, 0], height), [east, 0.0, 0.0], dt);
                let reach = east * (2.0 * (height - 0.1) / 9.81_f64).sqrt() + 0.5 * CELL;
                let Outcome::Lands(column) = end else { panic!("{end:?}") };
                assert_eq!(ground.cell(column)[0], (reach / CELL) as usize, "{height} {east} {dt}");
            }
        }
    }

    #[test]
    fn packets_leave_through_the_void_and_open_borders_and_stop_at_walls() {
        let void = columns([30, 3], |[x, _]| if x > 10 { vec![] } else { vec![[0.5, 0.6]] });
        let at = ([12, 1], 0.6);
        assert_eq!(end(&void, Border::Closed, at, [0.01, 0.0, 0.0], 0.01).0, Outcome::Leaves, "below");
        let (over, packet) = end(&void, Border::Open, at, [1.0, 0.0, 0.0], 0.01);
        assert!(over == Outcome::Leaves && packet.age < 0.03, "over the border: {packet:?}");
        let (below, packet) = end(&void, Border::Closed, at, [1.0, 0.0, 0.0], 0.01);
        assert!(below == Outcome::Leaves && packet.age > 0.3 && packet.cell[0] == 29, "{packet:?}");
        // From the void below a slab it does not rise through the slab.
        let back = end(&void, Border::Closed, ([12, 1], 0.55), [-1.0, 0.0, 0.0], 0.01);
        assert!(back.0 == Outcome::Leaves && back.1.cell[0] == 11 && back.1.along[0] == 0.0, "{back:?}");
    }

    #[test]
    fn a_distance_is_reached_where_the_parabola_says() {
        for (distance, speed, pull) in
            [(0.3, 2.0, 0.0), (0.3, 2.0, 5.0), (0.3, -2.0, 5.0), (0.3, 2.0, -5.0), (0.9, 0.0, 3.0)]
        {
            let time = travel_time(distance, speed, pull);
            let gone = speed * time + 0.5 * pull * time * time;
            assert!((gone - distance).abs() < 1e-12, "{distance} {speed} {pull}: {gone} after {time} s");
            assert!(speed + pull * time > 0.0, "outward");
        }
        assert_eq!(travel_time(0.3, 1.0, -5.0), f64::INFINITY);
        assert_eq!(travel_time(0.3, -1.0, 0.0), f64::INFINITY);
        assert_eq!((travel_time(0.0, 1.0, -5.0), travel_time(0.0, 0.0, 1.0)), (0.0, 0.0));
    }
}
