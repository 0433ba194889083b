//! Values at a position on a triangle, interpolated from those of its corners.

use crate::geometry::DVec3;
use crate::geometry::mesh::attributes::{MeshArray, Number, On};

/// Arrays whose 8-bit integers are colour components: they are interpolated, as floats are.
const COLOURS: [&str; 4] = ["red", "green", "blue", "alpha"];
/// Below this sine at its first corner, a triangle is treated as degenerate: positions on it are those of its edges.
const NEEDLE: f64 = 1e-8;

/// Barycentric weights: how much each corner of a triangle counts at a position on it; 0 or more, 1 in total.
pub type Weights = [f64; 3];

/// The weights of a corner.
pub(in crate::mesh_repair) fn at_corner(corner: usize) -> Weights {
    let mut weights = [0.0; 3];
    weights[corner] = 1.0;
    weights
}

/// The corner with the largest weight, the first of several.
pub(in crate::mesh_repair) fn heaviest(&[a, b, c]: &Weights) -> usize {
    if a >= b && a >= c {
        0
    } else if b >= c {
        1
    } else {
        2
    }
}

/// The weights of the position on a triangle that is nearest to `position` (m); if that is a corner's, exactly those of the corner.
pub fn weights(corners: &[DVec3; 3], position: DVec3) -> Weights {
    if let Some(corner) = corners.iter().position(|corner| *corner == position) {
        return at_corner(corner);
    }
    let [a, b, c] = corners;
    let (ab, ac, ap) = (b - a, c - a, position - a);
    let normal = ab.cross(&ac);
    let square = normal.norm_squared();
    if square > NEEDLE * NEEDLE * ab.norm_squared() * ac.norm_squared() {
        // Shares of the area; rounding leaves them a sum of 1.
        let (of_b, of_c) = (ap.cross(&ac).dot(&normal) / square, ab.cross(&ap).dot(&normal) / square);
        let weights = [1.0 - of_b - of_c, of_b, of_c];
        if weights.iter().all(|weight| *weight >= 0.0) {
            return weights;
        }
    }
    let mut best = (f64::INFINITY, at_corner(0));
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        let along = corners[to] - corners[from];
        let square = along.norm_squared();
        let projection = (position - corners[from]).dot(&along);
        let share = if square > 0.0 { (projection / square).clamp(0.0, 1.0) } else { 0.0 };
        let far = (corners[from] + along * share - position).norm_squared();
        if far < best.0 {
            let mut weights = [0.0; 3];
            weights[from] = 1.0 - share;
            weights[to] = share;
            best = (far, weights);
        }
    }
    best.1
}

/// The value of an array of vertices or corners at a position on a triangle, from those of its corners.
pub(in crate::mesh_repair) fn blended(
    array: &MeshArray,
    triangles: &[[u32; 3]],
    triangle: usize,
    weights: &Weights,
) -> f64 {
    let numbers = match array.on {
        On::Corners => [0, 1, 2].map(|corner| array.values[3 * triangle + corner]),
        _ => triangles[triangle].map(|vertex| array.values[vertex as usize]),
    };
    let nearest = heaviest(weights);
    if weights[nearest] == 1.0 {
        return numbers[nearest];
    }
    match array.number {
        Number::F64 => mean(numbers, weights),
        Number::F32 => f64::from(mean(numbers, weights) as f32),
        Number::I8 | Number::U8 if COLOURS.contains(&&*array.name) => mean(numbers, weights).round(),
        _ => numbers[nearest],
    }
}

/// Texture coordinates at a position, from those of the corners.
pub(in crate::mesh_repair) fn interpolated(positions: [[f32; 2]; 3], weights: &Weights) -> [f32; 2] {
    [0, 1].map(|axis| mean(positions.map(|position| f64::from(position[axis])), weights) as f32)
}

/// The weighted mean of three numbers: exact if all are equal; numbers of weight 0 are ignored.
fn mean(numbers: [f64; 3], weights: &Weights) -> f64 {
    let nearest = heaviest(weights);
    let others = (0..3).filter(|corner| *corner != nearest && weights[*corner] > 0.0);
    others.fold(numbers[nearest], |sum, corner| sum + weights[corner] * (numbers[corner] - numbers[nearest]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_position_of_any_triangle_has_weights() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let triangles = [
            [at(0.0, 0.0, 0.0), at(2.0, 0.1, 0.0), at(0.3, 1.5, 0.7)],
            [at(0.1, 0.2, 0.3); 3],
            [at(0.0, 0.0, 0.0), at(0.3, 0.3, 0.3), at(1.0, 1.0, 1.0)],
            [at(0.0, 0.0, 0.0), at(0.0, 0.0, 0.0), at(1.0, -1.0, 0.5)],
            [at(0.0, 0.0, 0.0), at(1.0, 1e-12, 0.0), at(1e-40, 0.0, 0.0)],
        ];
        let steps = |n: i32| f64::from(n) * 0.4 - 1.0;
        for corners in &triangles {
            let there = |weights: &Weights| -> DVec3 {
                corners.iter().zip(weights).map(|(corner, weight)| corner * *weight).sum()
            };
            for position in (0..216).map(|n| at(steps(n % 6), steps(n / 6 % 6), steps(n / 36))) {
                let found = weights(corners, position);
                assert!(found.iter().all(|weight| (0.0..=1.0).contains(weight)), "{found:?}");
                assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{found:?}");
                let far = (there(&found) - position).norm();
                for n in 0..121 {
                    let [b, c] = [n % 11, n / 11].map(|n| f64::from(n) / 10.0);
                    let other = (there(&[1.0 - b - c, b, c]) - position).norm();
                    assert!(b + c > 1.0 || far <= other + 1e-9, "{corners:?} {position}: {far} {other}");
                }
            }
            (0..3).for_each(|n| assert_eq!(there(&weights(corners, corners[n])), corners[n]));
        }
    }
}
