//! Where vertical lines cross a triangle: which lines, decided exactly, and at what heights.
//!
//! Each line is shifted by a symbolic (e, e^2) in (x, z), e infinitesimal, so that it meets no edge and no vertex. Nothing but the shift
//! prefers a side: mirroring the scene or rotating it by 90 degrees gives the same bits unless a line meets an edge exactly.

use super::lines::{Corner, LANES, ROUNDOFF, WHOLE, integer_of, max, min, whole};
use crate::shallow::columns::grid::{Heights, TOP};

/// A triangle that lines may cross.
pub struct Facet {
    /// In the triangle's order, starting with the lowest corner, or with the highest if several are the lowest.
    pub corners: [Corner; 3],
    /// Minimum and maximum height (m).
    range: [f64; 2],
    /// Up to this magnitude, rounding may change the sign of a doubled area (m2).
    doubt: f64,
    /// In a triangle of at most this doubled area (m2), rounding may move a height by 2^-8 units.
    rough: f64,
}

/// How several lines lie relative to a triangle.
#[derive(Default)]
pub struct Crossed {
    /// How far they are inside it, and outside it, measured as doubled areas (m2).
    inside: [f64; LANES],
    outside: [f64; LANES],
    /// Its doubled area (m2), negative if it faces up.
    area: [f64; LANES],
    /// Height (units), clamped to the range and rounded, for [`integer_of`].
    units: [f64; LANES],
}

impl Facet {
    /// A triangle; heights on it are needed to within a small part of `unit` (m).
    #[inline(always)]
    pub fn new([a, b, c]: [Corner; 3], unit: f64) -> Self {
        let range = |axis: usize| [min(min(a[axis], b[axis]), c[axis]), max(max(a[axis], b[axis]), c[axis])];
        let [x, y, z] = [range(0), range(1), range(2)];
        let lowest = [a, b, c].map(|corner| u32::from(corner[1] == y[0]));
        let own = if lowest[0] + lowest[1] + lowest[2] == 1 { y[0] } else { y[1] };
        let corners = if a[1] == own {
            [a, b, c]
        } else if b[1] == own {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let area = (x[1] - x[0]) * (z[1] - z[0]);
        // A weight (below) is off by at most 8 roundings of the area: three for each product, two for their difference.
        let doubt = 16.0 * ROUNDOFF * area;
        // Three weights enter the numerator, three the denominator.
        let rough = area * ((y[1] - y[0]) * (48.0 * 256.0 * ROUNDOFF / unit));
        Self { corners, range: y, doubt, rough }
    }

    /// The height (m) at which the line at (x, z), which must be within the ranks of the triangle's corners, crosses it, and whether the
    /// triangle faces up there.
    ///
    /// Whether it crosses is exact. The order of corners, mirroring and rotation by 90 degrees do not change a bit of the height; on an
    /// edge it depends on the edge alone.
    #[inline(never)]
    pub fn cross(&self, at: [f64; 2]) -> Option<(f64, bool)> {
        let from = |corner: usize| [self.corners[corner][0] - at[0], self.corners[corner][2] - at[1]];
        let [r, p, q] = [from(0), from(1), from(2)];
        let [a, b, c] = [cross(p, q), cross(q, r), cross(r, p)];
        let sum = (b + c) + a;
        if min(min(a.abs(), b.abs()), c.abs()) <= self.doubt {
            return self.cross_exactly(at, [a, b, c]);
        }
        let is_left = a > 0.0;
        if (b > 0.0) != is_left || (c > 0.0) != is_left {
            return None;
        }
        let height = if sum.abs() <= self.rough { self.exact_height(at) } else { self.height([b, c], sum) };
        // Seen from above, with x to the right and z downward, a triangle that faces up runs counter-clockwise.
        Some((height, !is_left))
    }

    /// Tests several lines at once; [`Facet::crossing_of`] has the result for each.
    #[inline(always)]
    pub fn cross_all(&self, x: &[f64; LANES], z: &[f64; LANES], heights: &Heights, out: &mut Crossed) {
        let [r, p, q] = self.corners;
        for lane in 0..LANES {
            let from = |corner: Corner| [corner[0] - x[lane], corner[2] - z[lane]];
            let [r, p, q] = [from(r), from(p), from(q)];
            let [a, b, c] = [cross(p, q), cross(q, r), cross(r, p)];
            let sum = (b + c) + a;
            let smallest = min(min(a, b), c);
            let largest = max(max(a, b), c);
            out.inside[lane] = max(smallest, -largest);
            out.outside[lane] = min(largest, -smallest);
            out.area[lane] = sum;
            // As `Heights::round`: halves are rounded up.
            let units = (self.height([b, c], sum) - heights.low) / heights.unit;
            let units = min(max(units, 0.0), f64::from(TOP));
            let even = (units + WHOLE) - WHOLE;
            let up = if units - even >= 0.5 { 1.0 } else { 0.0 };
            out.units[lane] = whole(even + up);
        }
    }

    /// For one of the lines of [`Facet::cross_all`], the height (units) at which it crosses the triangle, and whether the triangle faces
    /// up.
    #[inline(always)]
    pub fn crossing_of(
        &self,
        lane: usize,
        all: &Crossed,
        at: [f64; 2],
        heights: &Heights,
    ) -> Option<(u32, bool)> {
        let area = all.area[lane];
        if all.inside[lane] > self.doubt && area.abs() > self.rough {
            Some((integer_of(all.units[lane]), area < 0.0))
        } else if all.outside[lane] > self.doubt {
            // Weights of both signs, beyond doubt.
            None
        } else {
            self.cross(at).map(|(height, is_up)| (heights.round(height) as u32, is_up))
        }
    }

    /// As [`Facet::cross`], where the sign of a weight is in doubt.
    #[inline(never)]
    fn cross_exactly(&self, at: [f64; 2], mut weights: [f64; 3]) -> Option<(f64, bool)> {
        let mut sides = [false; 3];
        for (corner, weight) in weights.iter_mut().enumerate() {
            let [a, b] = self.opposite(corner);
            if weight.abs() <= self.doubt {
                *weight = exact_cross(a, b, at);
            }
            sides[corner] = match *weight {
                // On the edge the symbolic shift decides: it adds -e times the edge's z and, if that is 0, e^2 times its x.
                0.0 if a[1] != b[1] => b[1] < a[1],
                0.0 => b[0] > a[0],
                weight => weight > 0.0,
            };
        }
        if sides != [sides[0]; 3] {
            return None;
        }
        let [r, p, q] = &self.corners;
        let height = match weights.map(|weight| weight == 0.0) {
            [true, _, _] => along(p, q, at),
            [_, true, _] => along(q, r, at),
            [_, _, true] => along(r, p, at),
            _ => self.exact_height(at),
        };
        Some((height, !sides[0]))
    }

    /// The edge opposite to a corner, (x, z).
    fn opposite(&self, corner: usize) -> [[f64; 2]; 2] {
        [1, 2].map(|turn| self.corners[(corner + turn) % 3]).map(|[x, _, z]| [x, z])
    }

    /// Height (m) from the weights of the last two corners (twice the areas that a point spans with the edges opposite to them) and the sum
    /// of all weights. The two are treated alike, so that their order does not matter.
    #[inline(always)]
    fn height(&self, weights: [f64; 2], sum: f64) -> f64 {
        let [r, p, q] = self.corners.map(|corner| corner[1]);
        let height = r + (weights[0] * (p - r) + weights[1] * (q - r)) / sum;
        min(max(height, self.range[0]), self.range[1])
    }

    /// Height (m) with exact weights.
    #[inline(never)]
    fn exact_height(&self, at: [f64; 2]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|corner| self.opposite(corner)).map(|[a, b]| exact_cross(a, b, at));
        self.height([b, c], (b + c) + a)
    }
}

#[inline(always)]
fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Height (m) of an edge at a point (x, z) on it.
fn along(a: &Corner, b: &Corner, at: [f64; 2]) -> f64 {
    let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
    if low[1] == high[1] {
        return low[1];
    }
    let [dx, dz] = [high[0] - low[0], high[2] - low[2]];
    let part = if dx.abs() >= dz.abs() { (at[0] - low[0]) / dx } else { (at[1] - low[2]) / dz };
    low[1] + part * (high[1] - low[1])
}

/// (b - a) x (s - a), twice the signed area of (a, b, s) in (x, z): the sign is exact; the magnitude is off by at most about 2^-64 of it
/// before it is rounded to an f64. Both depend on the exact value alone.
///
/// The sign is exact because products that are not exact in f64 are computed in integers. Each f64 is m 2^k. Where the six coordinates are
/// multiples of a power of two and below 2^62 times it, i128 holds differences (63 bits), products (126) and their difference (127).
/// Otherwise the six products of the expanded determinant are summed in 768 bits, which hold multiples of 2^-320 below 2^448. That
/// suffices: a and b come from f32 without denormals (multiples of 2^-149 below 2^128), and s is the centre of a cell of 1e-9 m or more, a
/// multiple of 2^-84, within some 2^100.
pub fn exact_cross(a: [f64; 2], b: [f64; 2], s: [f64; 2]) -> f64 {
    let products = [[a[0], s[0], b[1], s[1]], [a[1], s[1], b[0], s[0]]].map(exact_product);
    if let [Some(first), Some(second)] = products {
        return first - second;
    }
    let parts = [a[0], a[1], b[0], b[1], s[0], s[1]].map(integer);
    let known = || parts.iter().filter(|(mantissa, _)| *mantissa != 0);
    let Some(low) = known().map(|(_, exponent)| *exponent).min() else { return 0.0 };
    let ends =
        known().map(|(mantissa, exponent)| exponent + 64 - mantissa.unsigned_abs().leading_zeros() as i32);
    if ends.max().unwrap_or(low) - low <= 62 {
        let [ax, az, bx, bz, sx, sz] = parts.map(|(mantissa, exponent)| match mantissa {
            0 => 0,
            _ => mantissa << (exponent - low),
        });
        let product = |p: i64, q: i64| i128::from(p) * i128::from(q);
        let value = product(ax - sx, bz - sz) - product(az - sz, bx - sx);
        return value as f64 * power_of_two(2 * low);
    }
    let [ax, az, bx, bz, sx, sz] = parts;
    let mut sum = Sum([0; 24]);
    for (p, q, sign) in [(ax, bz, 1), (az, bx, -1), (ax, sz, -1), (az, sx, 1), (sx, bz, -1), (sz, bx, 1)] {
        sum.add(i128::from(p.0) * i128::from(q.0) * sign, p.1 + q.1);
    }
    sum.value()
}

/// (a - s) (b - t), if exact in f64: a difference is zero, or both are without rounding error and have up to 26 bits.
fn exact_product([a, s, b, t]: [f64; 4]) -> Option<f64> {
    let (p, q) = (a - s, b - t);
    if p == 0.0 || q == 0.0 {
        return Some(0.0);
    }
    let is_short = |difference: f64| difference.to_bits() & ((1 << 27) - 1) == 0;
    // The rounding error of a - s (Knuth) is 0.
    let is_exact = |difference: f64, a: f64, s: f64| {
        let back = a - difference;
        (a - (difference + back)) + (back - s) == 0.0
    };
    (is_short(p) && is_short(q) && is_exact(p, a, s) && is_exact(q, b, t)).then_some(p * q)
}

/// An f64 that is not denormal, as odd m (or 0) and k of m 2^k.
fn integer(value: f64) -> (i64, i32) {
    let bits = value.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    if exponent == 0 {
        return (0, 0);
    }
    let mantissa = (bits & ((1 << 52) - 1) | 1 << 52) as i64;
    let zeros = mantissa.trailing_zeros();
    let mantissa = mantissa >> zeros;
    (if value < 0.0 { -mantissa } else { mantissa }, exponent - 1075 + zeros as i32)
}

/// 2^k, k from -1022 to 1023.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// A sum of integers times powers of two, in 32-bit digits; the first has the weight 2^-320.
struct Sum([i64; 24]);

impl Sum {
    const LAST: i32 = 320;

    /// Adds an integer below 2^96 times a power of two.
    fn add(&mut self, value: i128, exponent: i32) {
        if value == 0 {
            return;
        }
        let position = (exponent + Self::LAST) as usize;
        let wide = value << (position % 32);
        let digits = &mut self.0[position / 32..position / 32 + 4];
        for (turn, digit) in digits.iter_mut().enumerate() {
            let rest = wide >> (32 * turn);
            *digit += if turn == 3 { rest as i64 } else { rest as i64 & 0xffff_ffff };
        }
    }

    fn carry(&mut self) {
        let mut carry = 0;
        for digit in &mut self.0 {
            let value = *digit + carry;
            *digit = value & 0xffff_ffff;
            carry = value >> 32;
        }
        // The top digit holds the sign.
        self.0[23] += carry << 32;
    }

    fn value(mut self) -> f64 {
        self.carry();
        let is_negative = self.0[23] < 0;
        if is_negative {
            self.0.iter_mut().for_each(|digit| *digit = -*digit);
            self.carry();
        }
        let Some(top) = self.0.iter().rposition(|digit| *digit != 0) else { return 0.0 };
        let first = top.saturating_sub(2);
        let digits = self.0[first..=top].iter().rev().fold(0u128, |sum, digit| sum << 32 | *digit as u128);
        let value = digits as f64 * power_of_two(32 * first as i32 - Self::LAST);
        if is_negative { -value } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lines::{Lines, Outline, Spans};
    use super::*;

    #[test]
    fn areas_are_exact_at_every_spread_of_exponents() {
        // Short differences, 62 bits, and more.
        assert_eq!(exact_cross([0.0, 0.0], [8.0, 4.0], [2.0, 1.0]), 0.0);
        assert_eq!(exact_cross([0.0, 0.0], [8.0, 4.0], [2.0, 1.5]), 4.0);
        let tenth = [0.1f64, 0.1];
        assert_eq!(exact_cross([-1.0, -1.0], [3.0, 3.0], tenth), 0.0);
        let above = [0.1, 0.1f64.next_up()];
        assert_eq!(exact_cross([-1.0, -1.0], [3.0, 3.0], above), 4.0 * (above[1] - above[0]));
        let far = 2f64.powi(100);
        assert_eq!(exact_cross([-far, -far], [far, far], tenth), 0.0);
        assert_eq!(exact_cross([-far, -far], [far, far], above), 2.0 * far * (above[1] - above[0]));
        assert_eq!(exact_cross([far, far], [-far, -far], above), -2.0 * far * (above[1] - above[0]));
        let near = 2f64.powi(-149);
        assert_eq!(exact_cross([0.0, near], [far, near], [1.0, 3e-30]), far * (3e-30 - near));
        assert_eq!(exact_cross([0.0, near], [far, near], [1.0, near]), 0.0);
    }

    /// A fan around the line at (0.25, 0.25), whose spokes pass exactly through other lines.
    #[test]
    fn a_fan_is_crossed_once_even_at_its_hub_and_its_spokes() {
        let lines = |positions: &[f64]| Lines::new(positions.iter().copied(), 0.5, 4.0);
        let ring =
            [[2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [-2, 2], [-2, 0], [-2, -2], [-1, -2], [0, -2], [2, -2]];
        let positions = [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5].map(|position| 0.25 + position);
        let lines = [lines(&positions), lines(&positions)];
        let corner = |[x, z]: [i32; 2]| [f64::from(x) + 0.25, 0.3, f64::from(z) + 0.25];
        let mut counts = [[0; 7]; 7];
        for (turn, spoke) in ring.iter().enumerate() {
            let corners = [corner([0, 0]), corner(*spoke), corner(ring[(turn + 1) % ring.len()])];
            let facet = Facet::new(corners, 1e-9);
            let ranks = corners.map(|corner| [lines[0].rank(corner[0]), lines[1].rank(corner[2])]);
            let ends = |axis: usize| {
                let ranks = ranks.map(|rank| rank[axis]);
                [ranks.into_iter().min().unwrap(), ranks.into_iter().max().unwrap()]
            };
            for row in ends(1)[0]..ends(1)[1] {
                let z = lines[1].at(row);
                let mut spans = Spans::default();
                Outline::new(&facet.corners, &lines[0]).spans(&[z; LANES], ends(0), &mut spans);
                let span = spans.lines(0);
                for column in ends(0)[0]..ends(0)[1] {
                    let crossing = facet.cross([lines[0].at(column), z]);
                    counts[row as usize][column as usize] += i32::from(crossing.is_some());
                    assert!(crossing.is_none() || (span[0]..span[1]).contains(&column), "({column}, {row})");
                    assert!(crossing.is_none_or(|(height, up)| height == 0.3 && !up), "{crossing:?}");
                }
            }
        }
        assert_eq!(counts, [[1; 7]; 7]);
    }

    #[test]
    fn lines_beside_an_edge_by_less_than_rounding_are_on_the_right_side() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            f64::from((state >> 40) as f32 / (1 << 23) as f32 - 1.0)
        };
        // Numbers from -1 to 1 as integers, on a lattice whose areas fit i128.
        let scale = 2f64.powi(57);
        let exact = |value: f64| (value * scale) as i128;
        let mut wrong = 0;
        for n in 0..2000 {
            let corners = [(); 3].map(|()| [random(), 0.5, random()]);
            let [a, b, _] = corners;
            let part = random().abs() / 3.0;
            let at = [0, 2].map(|axis| ((a[axis] + part * (b[axis] - a[axis])) * scale).round() / scale);
            let sides = [[0, 1], [1, 2], [2, 0]].map(|edge| {
                let [a, b] = edge.map(|corner| [corners[corner][0], corners[corner][2]]);
                let rounded = cross([a[0] - at[0], a[1] - at[1]], [b[0] - at[0], b[1] - at[1]]);
                let [[ax, az], [bx, bz], [x, z]] = [a, b, at].map(|position| position.map(exact));
                let side = ((ax - x) * (bz - z) - (az - z) * (bx - x)).signum();
                wrong += i32::from((rounded > 0.0) != (side > 0) || (rounded < 0.0) != (side < 0));
                side
            });
            let expected = (sides == [sides[0]; 3]).then_some(sides[0] < 0);
            let found = Facet::new(corners, 1e-9).cross(at).map(|(_, is_up)| is_up);
            assert!(found == expected || sides.contains(&0), "{n}: {corners:?} {at:?}");
        }
        assert!(wrong > 100, "f64 alone is wrong {wrong} times");
    }

    #[test]
    fn an_edge_has_the_same_height_in_both_of_its_triangles() {
        let [a, b] = [[-1.0, 0.1, -1.0], [3.0, 0.7, 3.0]];
        let sides = [[[3.0, 0.35, -1.7], a, b], [b, a, [-1.3, 0.9, 2.0]]];
        for position in [0.1, 0.3, 1.7, 2.9] {
            let heights = sides.map(|corners| {
                let facet = Facet::new(corners, 1e-9);
                facet.cross_exactly([position; 2], [0.0; 3]).map(|(height, _)| height)
            });
            let height = 0.1 + (position + 1.0) / 4.0 * (0.7 - 0.1);
            // One of the two has the edge.
            assert_eq!(heights.map(|height| height.is_some()).iter().filter(|has| **has).count(), 1);
            assert!(heights.iter().flatten().all(|found| *found == height), "{heights:?}, {height}");
        }
        let reversed = sides.map(|[a, b, c]| Facet::new([c, b, a], 1e-9).cross_exactly([0.3; 2], [0.0; 3]));
        assert_eq!(reversed.iter().flatten().count(), 1);
    }

    #[test]
    fn heights_do_not_depend_on_the_order_of_corners() {
        let corners = [[0.13, 0.2, 0.07], [0.91, 0.2, 0.35], [0.42, 0.83, 0.77]];
        let at = [0.5, 0.41];
        let [a, b, c] = corners;
        let height =
            |corners: [Corner; 3]| Facet::new(corners, 1e-9).cross(at).map(|(height, _)| height.to_bits());
        let first = height([a, b, c]);
        assert!(first.is_some());
        for other in [[b, c, a], [c, a, b], [c, b, a], [b, a, c], [a, c, b]] {
            assert_eq!(height(other), first);
        }
        let mirrored = corners.map(|[x, y, z]| [-x, y, z]);
        let found = Facet::new(mirrored, 1e-9).cross([-at[0], at[1]]);
        assert_eq!(found.map(|(height, _)| height.to_bits()), first);
        let turned = corners.map(|[x, y, z]| [z, y, -x]);
        let found = Facet::new(turned, 1e-9).cross([at[1], -at[0]]);
        assert_eq!(found.map(|(height, _)| height.to_bits()), first);
    }

    #[test]
    fn slivers_have_their_heights_too() {
        // 1 m long and 2^-30 m wide, seen from above: rounded weights would be off by a tenth.
        let thin = 2f64.powi(-30);
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0 + thin]];
        let at = [0.1, 0.1 + thin / 32.0];
        let (height, _) = Facet::new(corners, 1e-9).cross(at).unwrap();
        // Across the sliver the height grows from 0 on one edge.
        let across = (at[1] - at[0]) / thin;
        assert!((height - across).abs() < 1e-12, "{height} {across}");
    }
}
