//! Tiles and velocities that several tests use.

use frazil::flow::{Coord, Flow};

/// Coordinates of the tiles of a box, sorted.
pub fn box_of(low: [i32; 3], high: [i32; 3]) -> Vec<Coord> {
    let mut out = Vec::new();
    for x in low[0]..high[0] {
        for y in low[1]..high[1] {
            out.extend((low[2]..high[2]).map(|z| [x, y, z]));
        }
    }
    out
}

/// Speeds of -1 to 1 m/s at all faces of active tiles.
pub fn random_velocity(flow: &mut Flow) {
    let mut state = 7u64;
    let (tiles, velocity, _) = flow.fields();
    for field in velocity {
        for speed in field[..tiles.active()].iter_mut().flatten() {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            *speed = (state >> 40) as f32 / (1 << 23) as f32 - 1.0;
        }
    }
}
