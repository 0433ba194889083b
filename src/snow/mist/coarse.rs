//! Vectors at every fourth corner of cells, for what changes slowly from place to place: wind and turbulence.

use rayon::prelude::*;

use crate::base::DVec3;
use crate::flow::{Coord, Flow};

/// Cells between two places.
const SPACING: usize = 4;
/// Places along the edge of a tile, both ends included.
const EDGE: usize = 8 / SPACING + 1;
/// Places of a tile.
pub const PLACES: usize = EDGE * EDGE * EDGE;

/// The places (m) of a tile with cells of an edge (m).
pub fn places(tile: Coord, cell: f64) -> [DVec3; PLACES] {
    std::array::from_fn(|index| {
        let at = [index / (EDGE * EDGE), index / EDGE % EDGE, index % EDGE];
        let cells = |axis: usize| f64::from(tile[axis] * 8 + (at[axis] * SPACING) as i32);
        DVec3::new(cells(0), cells(1), cells(2)) * cell
    })
}

/// Changes the velocity (m/s) at the lower faces of active tiles: `change(old, value)` of the vectors at their places, interpolated
/// linearly.
pub fn change(flow: &mut Flow, values: &[[[f32; 3]; PLACES]], change: impl Fn(f32, f32) -> f32 + Sync) {
    let (_, velocity, _) = flow.fields();
    for (axis, field) in velocity.iter_mut().enumerate() {
        field.par_iter_mut().zip(values).with_min_len(8).for_each(|(faces, values)| {
            for (cell, face) in faces.iter_mut().enumerate() {
                *face = change(*face, at_face(values, axis, cell));
            }
        });
    }
}

/// The component on an axis at a cell's lower face on it.
fn at_face(values: &[[f32; 3]; PLACES], axis: usize, cell: usize) -> f32 {
    let at = [cell >> 6, cell >> 3 & 7, cell & 7];
    let (mut low, mut share) = ([0; 3], [0.0f32; 3]);
    for along in 0..3 {
        let half = if along == axis { 0.0 } else { 0.5 };
        low[along] = at[along] / SPACING;
        share[along] = ((at[along] % SPACING) as f32 + half) / SPACING as f32;
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
        let cell = 0.5;
        let field =
            |place: DVec3| [place.x - 2.0 * place.z, place.y, 3.0 * place.z + place.x].map(|x| x as f32);
        let tile = [2, -1, 0];
        let values = places(tile, cell).map(field);
        for (axis, index) in [(0, 0), (1, 0o777), (2, 0o345)] {
            let mut at = [index >> 6, index >> 3 & 7, index & 7].map(|x| x as f64 + 0.5);
            at[axis] -= 0.5;
            let place = DVec3::from([0, 1, 2].map(|i| (f64::from(tile[i] * 8) + at[i]) * cell));
            assert!((at_face(&values, axis, index) - field(place)[axis]).abs() < 1e-4);
        }
    }
}
