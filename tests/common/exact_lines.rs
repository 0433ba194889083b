//! What is solid on vertical lines, decided exactly: the winding number from triangles by whole numbers as large as it takes.

use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::shallow::columns::grid::{BOTTOMLESS, Heights, TOP};
use frazil::shallow::terrain::solids::Solid;

use super::bodies::{self, Dice};

/// An integer in digits of 32 bits, the least first; digits need not be carried.
#[derive(Clone, Copy)]
struct Whole([i64; Whole::DIGITS]);

impl Whole {
    const DIGITS: usize = 44;

    /// A number times 2^scale, which must be an integer.
    fn of(value: f64, scale: i32) -> Self {
        let mut digits = [0; Self::DIGITS];
        if value != 0.0 {
            let bits = value.abs().to_bits();
            assert!(bits >> 52 != 0, "{value} is a denormal");
            let mantissa = (bits & ((1 << 52) - 1) | 1 << 52) as u128;
            let zeros = mantissa.trailing_zeros() as i32;
            let position = (bits >> 52) as i32 - 1075 + zeros + scale;
            assert!(position >= 0, "{value} is no multiple of 2^-{scale}");
            let wide = mantissa >> zeros << (position % 32);
            for turn in 0..3 {
                let digit = (wide >> (32 * turn)) as i64 & 0xffff_ffff;
                digits[position as usize / 32 + turn] = if value < 0.0 { -digit } else { digit };
            }
        }
        Self(digits)
    }

    fn sum(self, other: Self, sign: i64) -> Self {
        Self(std::array::from_fn(|position| self.0[position] + sign * other.0[position]))
    }

    /// Digits of one sign.
    fn carried(digits: [i128; Self::DIGITS]) -> Self {
        let mut carry = 0;
        let carried = digits.map(|digit| {
            let value = digit + carry;
            carry = value >> 32;
            (value & 0xffff_ffff) as i64
        });
        match carry {
            0 => Self(carried),
            -1 => Self(Self::carried(digits.map(|digit| -digit)).0.map(|digit| -digit)),
            _ => panic!("more digits are needed"),
        }
    }

    fn times(&self, other: &Self) -> Self {
        let mut digits = [0; Self::DIGITS];
        for (position, digit) in self.0.iter().enumerate().filter(|(_, digit)| **digit != 0) {
            for (other, factor) in other.0.iter().enumerate().filter(|(_, factor)| **factor != 0) {
                digits[position + other] += i128::from(*digit) * i128::from(*factor);
            }
        }
        Self::carried(digits)
    }

    fn sign(&self) -> i32 {
        let top = Self::carried(self.0.map(i128::from)).0.into_iter().rfind(|digit| *digit != 0);
        top.map_or(0, |digit| digit.signum() as i32)
    }
}

/// Where the winding number changes on a line: a triangle above the line's foot, with its weights, and by how much.
struct Change {
    corners: [Vec3; 3],
    weights: [Whole; 3],
    /// +1 for one that faces up.
    change: i32,
}

/// (b - a) x (s - a) in (x, z), times 2^896.
fn area(a: Vec3, b: Vec3, s: &[Whole; 2]) -> Whole {
    let from = |p: Vec3| {
        [p.x, p.z].map(|value| Whole::of(value.into(), 448)).into_iter().zip(s).map(|(p, s)| p.sum(*s, -1))
    };
    let [a, b] = [a, b].map(|p| from(p).collect::<Vec<Whole>>());
    a[0].times(&b[1]).sum(a[1].times(&b[0]), -1)
}

/// The triangles that the vertical line at (x, z) crosses. They are those of a line that is really shifted, by (2^-200, 2^-400).
fn changes(mesh: &TriMesh, at: [f64; 2]) -> Vec<Change> {
    let exact = at.map(|position| Whole::of(position, 448));
    let mut shifted = exact;
    for (position, shift) in shifted.iter_mut().zip([200, 400]) {
        *position = position.sum(Whole::of(1.0, 448 - shift), 1);
    }
    let around = |corners: &[Vec3; 3]| {
        [0, 2].iter().zip(at).all(|(&axis, at)| {
            let positions = corners.map(|corner| f64::from(corner[axis]));
            positions.iter().any(|position| *position <= at)
                && positions.iter().any(|position| *position >= at)
        })
    };
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|n| mesh.positions[n as usize]));
    corners
        .filter(around)
        .filter_map(|corners| {
            let edges = |[a, b, c]: [Vec3; 3]| [[b, c], [c, a], [a, b]];
            let signs = edges(corners).map(|[a, b]| area(a, b, &shifted).sign());
            let weights = edges(corners).map(|[a, b]| area(a, b, &exact));
            (signs[0] != 0 && signs == [signs[0]; 3]).then_some(Change {
                corners,
                weights,
                change: -signs[0],
            })
        })
        .collect()
}

impl Change {
    /// Whether it is at a height or above, exactly.
    fn is_above(&self, height: f64) -> bool {
        let height = Whole::of(height, 120);
        let zero = Whole([0; Whole::DIGITS]);
        let part =
            |n: usize| self.weights[n].times(&Whole::of(self.corners[n].y.into(), 120).sum(height, -1));
        let lifted = (0..3).fold(zero, |sum, n| sum.sum(part(n), 1)).sign();
        // The weights have the sign of the area.
        let area = self.weights.iter().fold(zero, |sum, weight| sum.sum(*weight, 1)).sign();
        assert!(area != 0);
        lifted * area >= 0
    }

    /// The height, more or less.
    fn about(&self, [x, z]: [f64; 2]) -> f64 {
        let [a, b, c] = self.corners.map(|corner| corner.cast::<f64>());
        let normal = (b - a).cross(&(c - a));
        let height = a.y - (normal.x * (x - a.x) + normal.z * (z - a.z)) / normal.y;
        height.clamp(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y))
    }
}

/// Units of height where a line is solid though the winding number is not above 0, or the other way round. A unit is what its middle is;
/// those around each crossing and each end of a solid are looked at.
pub fn wrong(mesh: &TriMesh, at: [f64; 2], heights: &Heights, solids: &[Solid]) -> Vec<i32> {
    let changes = changes(mesh, at);
    let ends = solids.as_flattened().iter().copied().filter(|end| *end != BOTTOMLESS);
    let crossings = changes.iter().map(|change| heights.round(change.about(at)));
    let mut units: Vec<i32> =
        ends.chain(crossings).flat_map(|end| [end - 2, end - 1, end, end + 1]).collect();
    units.extend([0, TOP - 1]);
    units.retain(|unit| (0..TOP).contains(unit));
    units.sort_unstable();
    units.dedup();
    // Crossings nearer than 2^-8 units to a middle may be on either side of it.
    let winding = |position: f64| {
        let height = heights.low + position * heights.unit;
        changes.iter().filter(|change| change.is_above(height)).map(|change| change.change).sum::<i32>()
    };
    units.retain(|&unit| {
        let is_solid = solids.iter().any(|[bottom, top]| *bottom <= unit && unit < *top);
        let middle = f64::from(unit) + 0.5;
        [middle - 1.0 / 256.0, middle + 1.0 / 256.0]
            .into_iter()
            .all(|position| is_solid != (winding(position) > 0))
    });
    units
}

/// Solids of one to six bodies, in part overlapping, some of them with vertices on a lattice of 1/8 m: lines meet vertices and edges exactly
/// in cells of 0.25 m, and miss edges by roundings in those of 0.1 m.
pub fn random(dice: &mut Dice, cell: f64) -> TriMesh {
    let is_aligned = dice.one_in(3);
    let mut mesh = TriMesh::default();
    for _ in 0..=dice.below(6) {
        let size = dice.between(1.0, 6.0);
        let budget = 20 + dice.below(400);
        let body = bodies::any(dice, size, budget).moved(dice.vector(4.0));
        let position = |place: &DVec3| {
            let place = place * cell;
            let place = if is_aligned { place.map(|value| (value * 8.0).round() / 8.0) } else { place };
            place.cast::<f32>()
        };
        mesh.append(&TriMesh {
            positions: body.positions.iter().map(position).collect(),
            triangles: body.triangles,
        });
    }
    mesh
}
