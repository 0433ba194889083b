//! Forces on the air.

mod coarse_grid;
pub(super) mod turbulence;
pub(super) mod wind;

use rayon::prelude::*;

use crate::flow::{Flow, tiles::FACES};

/// Gravity acts where there is mist (thesis section 3.4.1): a face between two cells with mist gains the full `speed` (m/s, upward), a face
/// at the border of the mist half of it.
pub fn apply_gravity(flow: &mut Flow, speed: f32) {
    if speed == 0.0 {
        return;
    }
    let (tiles, [_, upward, _], density) = flow.fields();
    let density = &*density;
    upward.par_iter_mut().enumerate().with_min_len(16).for_each(|(slot, faces)| {
        let own = density.get(slot);
        let below = density.get(tiles.neighbours()[slot][FACES[2]] as usize);
        let half = |tile: Option<&crate::flow::Tile>, cell: usize| match tile {
            Some(tile) if tile[cell] > 0.0 => 0.5 * speed,
            _ => 0.0,
        };
        for (cell, face) in faces.iter_mut().enumerate() {
            let lower = if cell & 0o70 == 0 { half(below, cell + 0o70) } else { half(own, cell - 0o10) };
            *face += lower + half(own, cell);
        }
    });
}
