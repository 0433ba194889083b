//! Vectors at every fourth corner of cells, for fields that vary slowly in space: wind and turbulence.

use rayon::prelude::*;

use crate::flow::{Coord, Flow, tiles::FACES};
use crate::geometry::DVec3;

/// Cells between adjacent samples.
const SPACING: usize = 4;
/// Samples along the edge of a tile, both ends included.
const EDGE: usize = 8 / SPACING + 1;
/// Number of samples of a tile.
pub const POSITIONS: usize = EDGE * EDGE * EDGE;

/// Positions (m) of a tile's samples, for cells with the edge `cell` (m).
pub fn positions(tile: Coord, cell: f64) -> [DVec3; POSITIONS] {
    std::array::from_fn(|index| {
        let at = [index / (EDGE * EDGE), index / EDGE % EDGE, index % EDGE];
        let cells = |axis: usize| f64::from(tile[axis] * 8 + (at[axis] * SPACING) as i32);
        DVec3::new(cells(0), cells(1), cells(2)) * cell
    })
}

/// Changes the velocity (m/s) at all faces of active cells to `change(old, value)`, where `value` is interpolated linearly from the samples
/// of the tile.
pub fn change(flow: &mut Flow, values: &[[[f32; 3]; POSITIONS]], change: impl Fn(f32, f32) -> f32 + Sync) {
    let (tiles, velocity, _) = flow.fields();
    for (axis, field) in velocity.iter_mut().enumerate() {
        field.par_iter_mut().enumerate().with_min_len(8).for_each(|(slot, faces)| {
            let below = tiles.neighbours()[slot][FACES[2 * axis]] as usize;
            for (cell, face) in faces.iter_mut().enumerate() {
                let mut at = [cell >> 6, cell >> 3 & 7, cell & 7];
                // The first faces of the rim are the upper faces of the tile below.
                let values = match values.get(slot) {
                    None if at[axis] == 0 => {
                        at[axis] = 8;
                        values.get(below)
                    }
                    own => own,
                };
                if let Some(values) = values {
                    *face = change(*face, at_face(values, axis, at));
                }
            }
        });
    }
}

/// The component along an axis at the lower face of a cell on that axis; 8 along the axis means the upper faces of the last cells.
fn at_face(values: &[[f32; 3]; POSITIONS], axis: usize, at: [usize; 3]) -> f32 {
    let (mut low, mut share) = ([0; 3], [0.0f32; 3]);
    for along in 0..3 {
        let half = if along == axis { 0.0 } else { 0.5 };
        low[along] = (at[along] / SPACING).min(EDGE - 2);
        share[along] = ((at[along] - low[along] * SPACING) as f32 + half) / SPACING as f32;
    }
    let mut sum = 0.0;
    for corner in 0..8 {
        let step = [corner >> 2, corner >> 1 & 1, corner & 1];
        let weight = |along: usize| if step[along] == 1 { share[along] } else { 1.0 - share[along] };
        let index = [0, 1, 2].map(|along| low[along] + step[along]);
        sum +=
            weight(0) * weight(1) * weight(2) * values[(index[0] * EDGE + index[1]) * EDGE + index[2]][axis];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_is_exact_at_the_faces() {
        let edge = 0.5;
        let field = |position: DVec3| {
            [position.x - 2.0 * position.z, position.y, 3.0 * position.z + position.x].map(|x| x as f32)
        };
        let tile = [2, -1, 0];
        let values = positions(tile, edge).map(field);
        for (axis, cell) in [(0, [0, 0, 0]), (1, [7, 7, 7]), (2, [3, 4, 5]), (0, [8, 7, 1])] {
            let mut at = cell.map(|x| x as f64 + 0.5);
            at[axis] -= 0.5;
            let position = DVec3::from([0, 1, 2].map(|i| (f64::from(tile[i] * 8) + at[i]) * edge));
            assert!((at_face(&values, axis, cell) - field(position)[axis]).abs() < 1e-4);
        }
    }
}
