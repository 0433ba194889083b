//! Triangles of a mesh near a block of grains. A single-precision test of eight triangles at a time, relative to the middle of
//! the block, rejects all but one or two of them; [`Shell::compare`] decides between the rest, so that the result is that of
//! [`Shell::nearest`].

use super::shell::{Best, Nearest, Shell};
use crate::geometry::DVec3;
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::{LANES, Lanes};
use crate::snow::grains::solver::rows::{V8, dot, scaled, sub};

/// The leaves of a mesh near some positions.
#[derive(Default)]
pub struct Nearby {
    which: Vec<u32>,
    boxes: Vec<Boxes>,
    /// Their triangles, once queried.
    triangles: Vec<Option<Triangles>>,
    /// Leaves within reach of the last query, and the squares of the distances to their boxes (m2).
    reached: Vec<(u32, f32)>,
    /// Bounding box of the positions, and the distance from them within which surfaces are known (m).
    positions: [DVec3; 2],
    far: f64,
    /// Box to which the leaves' boxes are clamped (m).
    within: [DVec3; 2],
    middle: DVec3,
}

/// The boxes of eight leaves.
#[derive(Clone, Copy)]
struct Boxes {
    /// Clamped, relative to the middle (m): minimum and maximum along each axis. Slightly enlarged, so that rounding rejects no triangle.
    /// Unused lanes are far away.
    sides: [[Lanes; 2]; 3],
    /// Largest displacement of a vertex in the sub-step (m).
    max_displacements: Lanes,
}

impl Nearby {
    /// Collects each leaf of a mesh that may be within a distance (m), plus the leaf's displacement, of a position in a box.
    pub fn find(&mut self, shell: &Shell, [low, high]: &[DVec3; 2], within: f64) {
        let margin = DVec3::repeat(within + shell.max_displacement);
        let bounds = [low - margin, high + margin];
        self.which.clear();
        self.boxes.clear();
        self.triangles.clear();
        (self.within, self.middle) = (bounds, (bounds[0] + bounds[1]) * 0.5);
        (self.positions, self.far) = ([*low, *high], within);
        shell.for_each_leaf(&[*low, *high], within, |leaf, bounds, max_displacement| {
            self.push(leaf, bounds, max_displacement)
        });
    }

    fn push(&mut self, leaf: u32, [low, high]: &[DVec3; 2], max_displacement: f64) {
        let lane = self.which.len() % LANES;
        self.which.push(leaf);
        self.triangles.push(None);
        if lane == 0 {
            self.boxes.push(Boxes { sides: [[Lanes::all(FAR); 2]; 3], max_displacements: Lanes::all(0.0) });
        }
        let Some(Boxes { sides, max_displacements }) = self.boxes.last_mut() else { return };
        max_displacements.0[lane] = (max_displacement * (1.0 + ROUNDING)) as f32;
        let [low_corner, high_corner] = &self.within;
        let margin = ROUNDING * (high_corner - low_corner).max();
        for (axis, sides) in sides.iter_mut().enumerate() {
            let side = |x: f64| x.clamp(low_corner[axis], high_corner[axis]) - self.middle[axis];
            sides[0].0[lane] = (side(low[axis]) - margin) as f32;
            sides[1].0[lane] = (side(high[axis]) + margin) as f32;
        }
    }

    /// The nearest point of the mesh within a distance (m) plus its displacement in the sub-step. Queries the whole mesh
    /// outside the range of [`Nearby::find`].
    pub fn nearest(&mut self, shell: &Shell, position: DVec3, within: f64) -> Option<Nearest> {
        let [low, high] = &self.positions;
        if within > self.far || !(*low <= position && position <= *high) {
            return shell.nearest(position, within);
        }
        let relative = position - self.middle;
        let relative = [relative.x as f32, relative.y as f32, relative.z as f32];
        let Self { which, boxes, triangles, reached, middle, .. } = self;
        let size = (self.within[1] - self.within[0]).max();
        reach(boxes, relative, (within * (1.0 + ROUNDING)) as f32, reached);
        let nearer = |a: usize, b: usize| if reached[b].1 < reached[a].1 { b } else { a };
        let first = (0..reached.len()).reduce(nearer)?;
        reached.swap(0, first);
        let mut best = Best::default();
        for &(index, apart) in &*reached {
            if f64::from(apart) <= best.max_square {
                let (index, leaf) = (index as usize, which[index as usize]);
                let triangles =
                    triangles[index].get_or_insert_with(|| Triangles::of(shell, leaf, *middle, size));
                let max_displacement = f64::from(boxes[index / LANES].max_displacements.0[index % LANES]);
                triangles.compare(shell, leaf, (position, relative), within + max_displacement, &mut best);
            }
        }
        best.found.map(|found| shell.resolve(found, position))
    }
}

/// Error bound of a distance in single precision, relative to the largest number that it is computed from.
const ROUNDING: f64 = 4.0e-6;

/// Eight triangles relative to the middle (m). Unused lanes are far away.
struct Triangles {
    corner: V8,
    /// The edges from that corner.
    sides: [V8; 2],
    /// 1 over the squared lengths of these edges and of the third one.
    inverse: V8,
    /// The dot product with a position relative to that corner is the barycentric weight of the edge's end.
    weights: [V8; 2],
    /// Of unit length.
    normal: V8,
    /// Error bound of a distance (m).
    error: f64,
}

impl Triangles {
    fn of(shell: &Shell, leaf: u32, middle: DVec3, size: f64) -> Self {
        let mut corners = [[Lanes::all(FAR); 3]; 3];
        let mut largest = 0.0f64;
        for (lane, triangle) in shell.leaf_corners(leaf).enumerate() {
            for (corner, position) in corners.iter_mut().zip(triangle) {
                let relative = position - middle;
                largest = largest.max(relative.amax());
                for axis in 0..3 {
                    corner[axis].0[lane] = relative[axis] as f32;
                }
            }
        }
        let mut out = prepared(&corners);
        out.error = ROUNDING * (largest + size);
        out
    }

    /// Compares the triangles within a reach (m) that may be nearer than the best so far.
    #[inline]
    fn compare(
        &self,
        shell: &Shell,
        leaf: u32,
        (position, relative): (DVec3, [f32; 3]),
        reach: f64,
        best: &mut Best,
    ) {
        let squares = squares(self, relative);
        let square = reach * reach;
        let near = |best: &Best| {
            let max = best.max_square.min(square).sqrt() + self.error;
            squares.is_less(Lanes::all((max * max * (1.0 + ROUNDING)) as f32)).bits()
        };
        let mut left = near(best);
        while left != 0 {
            // Starting with the nearest rejects most others.
            let mut lane = left.trailing_zeros() as usize;
            let mut others = left & (left - 1);
            while others != 0 {
                let other = others.trailing_zeros() as usize;
                lane = if squares.0[other] < squares.0[lane] { other } else { lane };
                others &= others - 1;
            }
            shell.compare(leaf as usize * LANES + lane, position, square, best);
            left &= near(best) & !(1 << lane);
        }
    }
}

/// Position of lanes without a triangle (m): small enough that its square is finite.
const FAR: f32 = 1.0e9;

fn prepared(corners: &[V8; 3]) -> Triangles {
    dispatch!(prepare(corners: &[V8; 3]) -> Triangles)
}

#[inline(always)]
fn prepare([a, b, c]: &[V8; 3]) -> Triangles {
    let (ab, ac, bc) = (sub(*b, *a), sub(*c, *a), sub(*c, *b));
    let one = Lanes::all(1.0);
    let (d00, d01, d11) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let across = cross(&ab, &ac);
    let square = dot(across, across);
    // A triangle without area has weights of NaN, so no point is inside it.
    let inverse = one / square;
    let length = one / square.sqrt();
    // An edge of length 0 counts as a point.
    let tiny = Lanes::all(f32::MIN_POSITIVE);
    Triangles {
        corner: *a,
        sides: [ab, ac],
        inverse: [one / d00.max(tiny), one / d11.max(tiny), one / dot(bc, bc).max(tiny)],
        weights: [weight(&ab, d11, &ac, d01, inverse), weight(&ac, d00, &ab, d01, inverse)],
        normal: scaled(across, length),
        error: 0.0,
    }
}

fn squares(triangles: &Triangles, position: [f32; 3]) -> Lanes {
    dispatch!(squares_of(triangles: &Triangles, position: [f32; 3]) -> Lanes)
}

/// Squared distances (m2) of triangles from a position.
#[inline(always)]
fn squares_of(triangles: &Triangles, position: [f32; 3]) -> Lanes {
    let Triangles { corner, sides: [ab, ac], inverse, weights, normal, .. } = triangles;
    let position = [Lanes::all(position[0]), Lanes::all(position[1]), Lanes::all(position[2])];
    let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
    let from = sub(position, *corner);
    let (first, second) = (side(&from, ab, inverse[0]), side(&from, ac, inverse[1]));
    let third = side(&sub(from, *ab), &sub(*ac, *ab), inverse[2]);
    let outside = first.min(second).min(third);
    let height = dot(from, *normal);
    let (v, w) = (dot(from, weights[0]), dot(from, weights[1]));
    let is_inside = zero.is_less(v) & zero.is_less(w) & (v + w).is_less(one);
    is_inside.choose(height * height, outside)
}

/// The dot product of the result with a position, relative to the common corner, is the weight of the end of `side`.
#[inline(always)]
fn weight(side: &V8, of_other: Lanes, other: &V8, of_both: Lanes, inverse: Lanes) -> V8 {
    scaled(sub(scaled(*side, of_other), scaled(*other, of_both)), inverse)
}

/// Squared distances (m2) of edges from positions relative to the start of each edge.
#[inline(always)]
fn side(position: &V8, side: &V8, inverse: Lanes) -> Lanes {
    let along = (dot(*position, *side) * inverse).max(Lanes::all(0.0)).min(Lanes::all(1.0));
    let off = sub(*position, scaled(*side, along));
    dot(off, off)
}

#[inline(always)]
fn cross(a: &V8, b: &V8) -> V8 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn reach(boxes: &[Boxes], position: [f32; 3], within: f32, out: &mut Vec<(u32, f32)>) {
    dispatch!(reach_of(boxes: &[Boxes], position: [f32; 3], within: f32, out: &mut Vec<(u32, f32)>))
}

/// Each box within a distance (m), plus the box's displacement, of a position, with the square of its distance (m2).
#[inline(always)]
fn reach_of(boxes: &[Boxes], position: [f32; 3], within: f32, out: &mut Vec<(u32, f32)>) {
    out.clear();
    for (first, Boxes { sides, max_displacements }) in (0..).step_by(LANES).zip(boxes) {
        let zero = Lanes::all(0.0);
        let mut square = zero;
        for (axis, [low, high]) in sides.iter().enumerate() {
            let at = Lanes::all(position[axis]);
            let beyond = (*low - at).max(at - *high).max(zero);
            square = square + beyond * beyond;
        }
        let reach = Lanes::all(within) + *max_displacements;
        let mut near = square.is_less(reach * reach).bits();
        while near != 0 {
            let lane = near.trailing_zeros();
            out.push((first + lane, square.0[lane as usize]));
            near &= near - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of all shapes about the origin: slivers, some without area, and one that is far larger than the others.
    fn shell(random: &mut impl FnMut() -> f64) -> Shell {
        let mut positions = Vec::new();
        for index in 0..90 {
            let first = DVec3::new(random(), random(), random());
            let size: f64 = [0.3, 1.0e-3, 0.0, 200.0][if index == 89 { 3 } else { index % 3 }];
            let along = DVec3::new(random(), random(), random()) * size.max(0.2);
            let across = DVec3::new(random(), random(), random()) * size;
            positions.extend([first, first + along, first + along * random() + across]);
        }
        let triangles = (0..90).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]).collect();
        let mut shell = Shell::new(0.0, triangles, false, positions.clone());
        shell.advance(&positions);
        shell
    }

    #[test]
    fn the_nearest_point_is_that_of_the_whole_mesh() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        let (mut nearby, mut found) = (Nearby::default(), 0);
        for _ in 0..40 {
            let shell = shell(&mut random);
            let middle = DVec3::new(random(), random(), random());
            let corner = DVec3::repeat(0.2);
            let within = 0.15 * (random() + 1.0);
            nearby.find(&shell, &[middle - corner, middle + corner], within);
            for _ in 0..200 {
                let position = middle + DVec3::new(random(), random(), random()) * 0.2;
                let expected = shell.nearest(position, within).map(|nearest| nearest.square);
                let nearest = nearby.nearest(&shell, position, within).map(|nearest| nearest.square);
                assert_eq!(nearest.is_some(), expected.is_some(), "{position} within {within}");
                if let (Some(nearest), Some(expected)) = (nearest, expected) {
                    assert!((nearest - expected).abs() <= 1.0e-8 * expected, "{nearest} for {expected}");
                    found += 1;
                }
            }
        }
        assert!((1_000..7_000).contains(&found), "{found} of 8000 are near");
    }
}
