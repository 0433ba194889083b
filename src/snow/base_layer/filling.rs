//! Which part of each voxel of a block a level set's solid fills.
//!
//! The distance at a voxel's centre gives it exactly where the surface is flat, and on an average where it is not. At an edge
//! it counts too much of a solid (a quarter of a cell too much in the worst position), linear interpolation between the voxels too
//! little. Of both together, in a fixed proportion, volumes of flat-sided bodies come out with a third of the error.

use super::columns::filled;
use crate::base::blocks::Values;

/// Distance (cells) from the centre beyond which no part of a surface at an edge is in a voxel.
const FAR: f32 = 1.2;
/// Second difference (cells) along an axis from which on there is an edge.
const EDGE: f32 = 0.1;
/// Share of what interpolation says at edges: where errors of edges at random positions have a mean of 0.
const INTERPOLATED: f32 = 0.4;
/// Parts of a voxel's edge.
const PARTS: usize = 4;

/// The filled part 0..=1 of each voxel, from distances (m) with cells of `cell` m. It depends on the block alone, so that what a
/// step removes is the difference of what was there before and after it.
pub(in crate::snow) fn parts(values: &Values, cell: f32) -> Values {
    let mut out = values.map(|value| filled(value, cell));
    for (index, part) in out.iter_mut().enumerate() {
        if values[index].abs() < FAR * cell {
            let at = [index >> 6, index >> 3 & 7, index & 7];
            if has_edge(values, at, EDGE * cell) {
                *part += INTERPOLATED * (interpolated(values, at, cell) - *part);
            }
        }
    }
    out
}

/// Sum of [`parts`].
pub(in crate::snow) fn volume(values: &Values, cell: f32) -> f64 {
    parts(values, cell).iter().map(|part| f64::from(*part)).sum()
}

/// Whether distances around a voxel change their slope along an axis by more than `least` (m) a cell. At the border of the block
/// nothing is known of it.
fn has_edge(values: &Values, at: [usize; 3], least: f32) -> bool {
    (0..3).any(|axis| {
        let step = 64 >> (3 * axis);
        let index = at[0] << 6 | at[1] << 3 | at[2];
        let is_inner = (1..7).contains(&at[axis]);
        is_inner && (values[index - step] + values[index + step] - 2.0 * values[index]).abs() > least
    })
}

/// The part of a voxel that is filled where distances are linear between the voxels' centres.
fn interpolated(values: &Values, at: [usize; 3], cell: f32) -> f32 {
    let near = around(values, at);
    let weights = |part: usize| {
        let off = (part as f32 + 0.5) / PARTS as f32 - 0.5;
        [(-off).max(0.0), 1.0 - off.abs(), off.max(0.0)]
    };
    let mut sum = 0.0;
    for part in 0..PARTS * PARTS * PARTS {
        let [x, y, z] = [part / (PARTS * PARTS), part / PARTS % PARTS, part % PARTS].map(weights);
        let mut value = 0.0;
        for (i, x) in x.iter().enumerate() {
            let layer: f32 =
                (0..3).map(|j| y[j] * (0..3).map(|k| z[k] * near[9 * i + 3 * j + k]).sum::<f32>()).sum();
            value += x * layer;
        }
        sum += filled(value, cell / PARTS as f32);
    }
    sum / (PARTS * PARTS * PARTS) as f32
}

/// The values (m) of a voxel and of the 26 around it, continued over the border of the block.
fn around(values: &Values, at: [usize; 3]) -> [f32; 27] {
    let mut out = [0.0; 27];
    for (index, value) in out.iter_mut().enumerate() {
        let off = [index / 9, index / 3 % 3, index % 3].map(|x| x as i32 - 1);
        *value = continued(values, [0, 1, 2].map(|axis| at[axis] as i32 + off[axis]), 0);
    }
    out
}

/// The value (m) of a voxel that may lie one beyond the border, where it goes on as it does at the border.
fn continued(values: &Values, mut at: [i32; 3], from: usize) -> f32 {
    for axis in from..3 {
        if !(0..8).contains(&at[axis]) {
            let last = at[axis].clamp(0, 7);
            let inward = if last == 0 { 1 } else { 6 };
            at[axis] = last;
            let one = continued(values, at, axis + 1);
            at[axis] = inward;
            return 2.0 * one - continued(values, at, axis + 1);
        }
    }
    values[(at[0] << 6 | at[1] << 3 | at[2]) as usize]
}

/// The direction in which distances of a block grow at a voxel, of length 1; none where they do not change.
pub fn direction(values: &Values, index: usize) -> Option<[f32; 3]> {
    let at = [index >> 6, index >> 3 & 7, index & 7];
    let slope = |axis: usize| {
        let step = 64 >> (3 * axis);
        let low = if at[axis] > 0 { index - step } else { index };
        let high = if at[axis] < 7 { index + step } else { index };
        (values[high] - values[low]) / ((high - low) / step) as f32
    };
    let slopes = [slope(0), slope(1), slope(2)];
    let norm = slopes.iter().map(|slope| slope * slope).sum::<f32>().sqrt();
    (norm > 0.0).then(|| slopes.map(|slope| slope / norm))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances (m) in a block, from a function of the position (cells).
    fn block(cell: f32, distance: impl Fn([f32; 3]) -> f32) -> Values {
        std::array::from_fn(|index| {
            cell * distance([index >> 6, index >> 3 & 7, index & 7].map(|x| x as f32 + 0.5))
        })
    }

    #[test]
    fn flat_surfaces_fill_what_their_distance_says() {
        for step in 0..20 {
            let height = 3.0 + 0.1 * step as f32;
            let plane = block(0.02, |[_, y, _]| y - height);
            assert!((volume(&plane, 0.02) - f64::from(64.0 * height)).abs() < 1e-3, "{height}");
        }
    }

    #[test]
    fn edges_and_corners_are_right_on_an_average_and_nowhere_far_off() {
        // The corner of a box, at random positions in its voxel.
        let (mut sum, mut worst, mut centres) = (0.0, 0.0f64, 0.0f64);
        const COUNT: u32 = 200;
        for n in 0..COUNT {
            let corner = [0.37, 0.61, 0.83].map(|share: f32| 3.0 + (share * n as f32).fract());
            let own = |at: [f32; 3]| {
                let off = [0, 1, 2].map(|axis| at[axis] - corner[axis]);
                let out: f32 = off.iter().map(|x| x.max(0.0).powi(2)).sum();
                out.sqrt() + off.iter().copied().fold(f32::MIN, f32::max).min(0.0)
            };
            let values = block(1.0, own);
            let exact: f64 = corner.iter().map(|x| f64::from(*x)).product();
            // Its edges are as long as the block's part that it fills: 10 cells or so.
            let edges: f64 = corner.iter().map(|x| f64::from(*x)).sum();
            let off = (volume(&values, 1.0) - exact) / edges;
            let of_centres: f64 = values.iter().map(|value| f64::from(filled(*value, 1.0))).sum();
            sum += off;
            worst = worst.max(off.abs());
            centres = centres.max(((of_centres - exact) / edges).abs());
        }
        let mean = sum / f64::from(COUNT);
        assert!(mean.abs() < 0.03 && worst < 0.7 * centres, "{mean} {worst} {centres}");
    }
}
