//! The fraction of each voxel of a block that a level set's solid fills.
//!
//! The distance at a voxel's centre gives the fraction exactly if the surface is flat. At an edge it is off by up to a quarter of a cell.
//! There the level set is reconstructed inside the voxel, on each axis in turn: between two voxels it is extrapolated from either side with
//! that side's slope up to where both meet (subcell resolution: Harten 1989). This is exact where two planes meet.

use crate::numeric::blocks::Values;

/// Maximum distance (cells) from the centre at which an edge of the surface matters to a voxel's fraction.
const MAX_DISTANCE: f32 = 0.75;
/// Minimum second difference (cells) along an axis at an edge.
const MIN_BEND: f32 = 0.1;
/// Parts of a voxel's edge, and their centres (cells from the centre of the voxel).
const PARTS: usize = 4;
const CENTRES: [f32; PARTS] = [-0.375, -0.125, 0.125, 0.375];
/// Assumed magnitude of the change of slope beyond the border of a block, where an edge outside the block may be: chosen so that the errors
/// for edges at random positions have a mean near 0.
const UNSEEN_BEND: f32 = 0.15;
/// Tolerance for the squared gradient of a plane, which should be 1.
const GRADIENT_TOLERANCE: f32 = 0.05;
/// Sentinel: a value that is not known.
const UNKNOWN: f32 = f32::NAN;

/// The filled fraction 0..=1 of each voxel, from distances (m) with cells of `cell` m. It depends only on the block, so that a step removes
/// exactly the difference of the fractions before and after it.
pub(in crate::snow) fn fractions(values: &Values, cell: f32) -> Values {
    let mut out = values.map(|value| filled(value, cell));
    for (index, fraction) in out.iter_mut().enumerate() {
        if values[index].abs() < MAX_DISTANCE * cell {
            let at = [index >> 6, index >> 3 & 7, index & 7];
            let [bend, max] = second_differences(values, at);
            if max > MIN_BEND * cell {
                *fraction = reconstructed(values, at, cell, UNSEEN_BEND * bend.signum());
            }
        }
    }
    out
}

/// Sum of [`fractions`].
pub(in crate::snow) fn volume(values: &Values, cell: f32) -> f64 {
    fractions(values, cell).iter().map(|fraction| f64::from(*fraction)).sum()
}

/// Second differences (m) around a voxel, within the block: the sum over the three axes, positive where the solid is convex, and the
/// maximum magnitude.
fn second_differences(values: &Values, at: [usize; 3]) -> [f32; 2] {
    let (mut sum, mut max) = (0.0f32, 0.0f32);
    for axis in 0..3 {
        let step = 64 >> (3 * axis);
        let mut middle = at;
        middle[axis] = at[axis].clamp(1, 6);
        let index = middle[0] << 6 | middle[1] << 3 | middle[2];
        let second = values[index - step] + values[index + step] - 2.0 * values[index];
        sum += second;
        max = max.max(second.abs());
    }
    [sum, max]
}

/// The filled fraction of a voxel, from the level set inside it. `unseen`: the assumed change of slope beyond the border.
fn reconstructed(values: &Values, at: [usize; 3], cell: f32, unseen: f32) -> f32 {
    // Axes with one side beyond the border come last: the known values on the others then help.
    let mut axes = [0usize, 1, 2];
    let is_border = |axis: usize| at[axis] == 0 || at[axis] == 7;
    axes.sort_by_key(|axis| is_border(*axis));
    let value = |offset: [usize; 3]| {
        let mut index = 0;
        for (axis, by) in axes.iter().zip(offset) {
            let own = at[*axis] + by;
            if !(2..10).contains(&own) {
                return UNKNOWN;
            }
            index |= (own - 2) << (6 - 3 * axis);
        }
        values[index] / cell
    };
    let all = [0, 1, 2, 3, 4];
    // Refined on the first axis, then on the second: at `[last][second]`, then at `[last]`.
    let once = all.map(|last| all.map(|second| refined(all.map(|first| value([first, second, last])))));
    let layer = |last: usize| -> [[f32; PARTS]; PARTS] {
        std::array::from_fn(|first| refined(all.map(|second| once[last][second][first])))
    };
    let layers = all.map(layer);
    let outward = match at[axes[2]] {
        0 => -1.0,
        7 => 1.0,
        _ => 0.0,
    };
    let is_only_border = !is_border(axes[1]);
    let mut sum = 0.0;
    for (first, second) in (0..PARTS * PARTS).map(|part| (part / PARTS, part % PARTS)) {
        let line = all.map(|last| layers[last][first][second]);
        let mut inside = refined(line);
        if outward != 0.0 {
            let slope = if outward > 0.0 { line[2] - line[1] } else { line[2] - line[3] };
            let better =
                is_only_border.then(|| slope_beyond_border(&layers[2], [first, second], slope)).flatten();
            for (value, centre) in inside.iter_mut().zip(CENTRES) {
                let off = (centre * outward).max(0.0);
                if let (true, Some(slope)) = (off > 0.0, better) {
                    *value = line[2] + slope * off;
                }
                *value += unseen * off;
            }
        }
        sum += inside.iter().map(|value| filled(*value, 1.0 / PARTS as f32)).sum::<f32>();
    }
    sum / (PARTS * PARTS * PARTS) as f32
}

/// The slope beyond the border (dimensionless), from the values in the voxel's layer there: the gradient of distances has length 1. None if
/// the slope before the border agrees with this or is near 0.
fn slope_beyond_border(
    layer: &[[f32; PARTS]; PARTS],
    [first, second]: [usize; 2],
    slope: f32,
) -> Option<f32> {
    if slope.abs() < 0.02 {
        return None;
    }
    let own = layer[first][second];
    let rise = |other: f32| (other - own) * PARTS as f32;
    let along_first = [first.wrapping_sub(1), first + 1].map(|at| layer.get(at).map(|row| rise(row[second])));
    let along_second =
        [second.wrapping_sub(1), second + 1].map(|at| layer[first].get(at).map(|value| rise(*value)));
    let (mut sum, mut count) = (0.0, 0.0);
    for a in along_first.iter().flatten() {
        for b in along_second.iter().flatten() {
            let square = a * a + b * b;
            if (square + slope * slope - 1.0).abs() < GRADIENT_TOLERANCE {
                return None;
            }
            sum += (1.0 - square).max(0.0).sqrt();
            count += 1.0;
        }
    }
    Some(slope.signum() * sum / count)
}

/// Values at [`CENTRES`] around the middle of five values, some of which may be unknown.
fn refined([far_below, below, own, above, far_above]: [f32; 5]) -> [f32; PARTS] {
    let [a, b, c, d] = CENTRES;
    [
        beside(own, [below, far_below], above, -a),
        beside(own, [below, far_below], above, -b),
        beside(own, [above, far_above], below, c),
        beside(own, [above, far_above], below, d),
    ]
}

/// The value at a distance (cells) from a voxel towards `next`; `far` is the voxel after `next`, and `back` the one on the other side.
fn beside(own: f32, [next, far]: [f32; 2], back: f32, distance: f32) -> f32 {
    if next.is_nan() {
        return if back.is_nan() { own } else { own + (own - back) * distance };
    }
    let between = own + (next - own) * distance;
    if far.is_nan() || back.is_nan() {
        return between;
    }
    let bends = [next + back - 2.0 * own, far + own - 2.0 * next];
    let (one, other) = (own + (own - back) * distance, next - (far - next) * (1.0 - distance));
    match bends {
        [a, b] if a >= 0.0 && b >= 0.0 => one.max(other),
        [a, b] if a <= 0.0 && b <= 0.0 => one.min(other),
        _ => between,
    }
}

/// The direction of increasing distance at a voxel of a block, normalised; none where the distances are constant.
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

/// Fraction of a cell that a level set's solid fills, from the distance at its centre (both in metres).
pub(in crate::snow) fn filled(distance: f32, cell: f32) -> f32 {
    (0.5 - distance / cell).clamp(0.0, 1.0)
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
    fn flat_surfaces_fill_exact_fractions() {
        for step in 0..20 {
            let height = 3.0 + 0.1 * step as f32;
            let plane = block(0.02, |[_, y, _]| y - height);
            assert!((volume(&plane, 0.02) - f64::from(64.0 * height)).abs() < 1e-3, "{height}");
        }
    }

    #[test]
    fn straight_edges_inside_a_block_are_right() {
        // The edge of a layer, and of a pit with vertical walls, at random positions; some of them rotated about y.
        let (mut worst, mut worst_of_centres) = (0.0f32, 0.0f32);
        for n in 0..90 {
            let random = |factor: f32| (factor * (n + 1) as f32).fract();
            let turn = if n % 3 == 0 { 0.0 } else { 0.4 * random(0.5698) };
            let (top, wall) = (3.4 + 1.2 * random(0.618), 3.6 + 0.8 * random(0.7548));
            let across = |[x, _, z]: [f32; 3]| turn.cos() * (x - wall) + turn.sin() * (z - 4.0);
            let layer = block(1.0, |at| across(at).max(at[1] - top));
            let pit = block(1.0, |at| across(at).min(at[1] - top));
            // In the centre of the block: 4 cells of edge, along which the wall moves from one side to the other.
            let layer_area = (wall - 2.0) * (top - 2.0);
            let pit_area = 16.0 - (6.0 - wall) * (6.0 - top);
            for (values, area) in [(layer, layer_area), (pit, pit_area)] {
                let inner = |index: usize| {
                    [index >> 6, index >> 3 & 7, index & 7].iter().all(|at| (2..6).contains(at))
                };
                let sum = |fractions: &Values| {
                    (0..512).filter(|at| inner(*at)).map(|at| fractions[at]).sum::<f32>()
                };
                let off = sum(&fractions(&values, 1.0)) / 4.0 - area;
                let of_centres = sum(&values.map(|value| filled(value, 1.0))) / 4.0 - area;
                worst = worst.max(off.abs());
                worst_of_centres = worst_of_centres.max(of_centres.abs());
            }
        }
        // Square cells for each cell of the edge.
        assert!(worst < 0.05 && worst_of_centres > 0.15, "{worst}, of centres {worst_of_centres}");
    }

    #[test]
    fn corners_are_right_on_average_and_nowhere_far_off() {
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
