//! A mesh, moving or not, as a collider: the nearest point of its triangles at the current sub-step.
//!
//! A signed distance grid of a deforming mesh would have to be rebuilt in each of dozens of sub-steps; triangles only need
//! their bounding boxes refitted, and give the velocity of the surface however thin the mesh is. A plane that moves with the
//! nearest point keeps a grain on its side of the surface. The orientation of the nearest triangle decides between inside and
//! outside, except for wide open meshes, which collide on both sides.

use rayon::prelude::*;

use super::touch::{FIRST_SHELL, Touch};
use crate::geometry::DVec3;
use crate::numeric::lanes::LANES;
use crate::snow::bounds::bounds;
use crate::snow::grains::solver::rows::{Row, dot};

/// Vertices whose displacements one task measures.
const VERTICES_PER_TASK: usize = 4096;
/// Triangles in a leaf of the tree: as many as are compared at once.
const LEAF: usize = LANES;

/// A mesh as a collider.
#[derive(Clone)]
pub struct Shell {
    /// Collider index, set by the step.
    pub collider: u32,
    /// Friction against it.
    pub friction: f32,
    /// Acceleration up to which it holds grains that touch it (multiples of gravity).
    pub stick: f32,
    triangles: Vec<[u32; 3]>,
    /// Whether it has an inside.
    has_inside: bool,
    /// For ground: the bits of the sides and corners of each triangle that lie on the rim of a sheet ([`RIM_CORNER`]).
    rims: Option<Vec<u8>>,
    now: Vec<DVec3>,
    next: Vec<DVec3>,
    /// Bounding boxes of a complete binary tree over leaves of triangles, root first.
    boxes: Vec<[DVec3; 2]>,
    /// Largest displacement of a vertex in the sub-step (m), for each box.
    max_displacements: Vec<f64>,
    leaves: usize,
    /// Largest displacement of a vertex in the sub-step (m).
    pub(super) max_displacement: f64,
    /// Bounds of the displacements (m).
    pub(super) displacement_bounds: [DVec3; 2],
}

/// Below this distance (m) from its nearest point, a position takes the triangle's normal as the outward direction.
const MIN_DISTANCE: f64 = 1.0e-9;
/// Search distance for the surface when a depth is queried (radii of the ball).
pub const DEPTH_REACH: f64 = 3.0;

/// The point of the surface nearest to a position.
pub struct Nearest {
    /// Square of its distance (m2).
    pub square: f64,
    point: DVec3,
    /// Displacement of that point in the sub-step (m).
    pub displacement: DVec3,
    /// Height of the position above the plane of its triangle.
    height: f64,
    normal: DVec3,
    /// Whether the point lies on the rim of a sheet of ground.
    is_on_rim: bool,
}

impl Shell {
    /// A mesh of triangles, counter-clockwise seen from outside, at a pose (m).
    pub fn new(friction: f32, triangles: Vec<[u32; 3]>, has_inside: bool, pose: Vec<DVec3>) -> Self {
        let leaves = triangles.len().div_ceil(LEAF).max(1).next_power_of_two();
        let next = pose.clone();
        let boxes = vec![[DVec3::zeros(); 2]; 2 * leaves - 1];
        let max_displacements = vec![0.0; 2 * leaves - 1];
        let (now, stick, max_displacement, collider) = (pose, 0.0, 0.0, FIRST_SHELL);
        let displacement_bounds = [DVec3::zeros(); 2];
        let mut shell = Self {
            collider,
            friction,
            stick,
            triangles,
            has_inside,
            rims: None,
            now,
            next,
            boxes,
            max_displacements,
            leaves,
            max_displacement,
            displacement_bounds,
        };
        shell.sort();
        shell
    }

    /// A mesh that does not move, for distance queries.
    pub fn at_rest(triangles: Vec<[u32; 3]>, pose: Vec<DVec3>) -> Self {
        let mut shell = Self::new(0.0, triangles, false, pose.clone());
        shell.advance(&pose);
        shell
    }

    /// Ground: a mesh that does not move and whose inside no grain may enter, except beyond the rims of its sheets.
    pub fn ground(
        friction: f32,
        triangles: Vec<[u32; 3]>,
        rims: impl FnOnce(&[[u32; 3]]) -> Vec<u8>,
        pose: Vec<DVec3>,
    ) -> Self {
        let mut shell = Self::new(friction, triangles, true, pose.clone());
        shell.advance(&pose);
        shell.rims = Some(rims(&shell.triangles));
        shell
    }

    /// Whether it is ground, which does not move.
    pub fn is_ground(&self) -> bool {
        self.rims.is_some()
    }

    /// Whether a position (m) is inside, at most `within` (m) deep.
    pub fn is_behind(&self, position: DVec3, within: f64) -> bool {
        self.nearest(position, within).is_some_and(|nearest| self.side(position, &nearest).1)
    }

    /// Positions of the vertices (m).
    pub fn vertices(&self) -> &[DVec3] {
        &self.now
    }

    /// Distance (m) of a position from the surface; none if it is over `within`.
    pub fn distance(&self, position: DVec3, within: f64) -> Option<f64> {
        self.nearest(position, within).map(|found| found.square.sqrt())
    }

    /// Sets the acceleration up to which the surface holds grains (multiples of gravity).
    pub fn with_stick(self, stick: f32) -> Self {
        Self { stick, ..self }
    }

    /// Sorts triangles along a Z-order curve, so that those of a leaf are close together.
    fn sort(&mut self) {
        let spread = |x: u64| (0..16).fold(0u64, |out, bit| out | (x >> bit & 1) << (3 * bit));
        let [low, high] = bounds(&self.now);
        let size = (high - low).max().max(1.0e-9);
        let now = &self.now;
        self.triangles.par_sort_by_cached_key(|triangle| {
            let middle = triangle.iter().map(|&index| now[index as usize]).sum::<DVec3>() / 3.0;
            let cell = ((middle - low) * (65_535.0 / size)).map(|x| x as u64);
            spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
        });
    }

    /// Advances to the next sub-step: the next pose becomes the current one, and `pose` the next. Ground is unchanged.
    pub fn advance(&mut self, pose: &[DVec3]) {
        if self.is_ground() {
            return;
        }
        std::mem::swap(&mut self.now, &mut self.next);
        self.next.clear();
        self.next.extend_from_slice(pose);
        self.measure();
        let (now, triangles, leaves) = (&self.now, &self.triangles, self.leaves);
        let (inner, outer) = self.boxes.split_at_mut(leaves - 1);
        let (next, (inner_max, outer_max)) = (&self.next, self.max_displacements.split_at_mut(leaves - 1));
        let outer_nodes = outer.par_iter_mut().zip(outer_max.par_iter_mut());
        outer_nodes.enumerate().with_min_len(256).for_each(|(leaf, (bounds, max_displacement))| {
            (*bounds, *max_displacement) = (EMPTY, 0.0);
            for triangle in triangles.iter().skip(leaf * LEAF).take(LEAF) {
                for &index in triangle {
                    let position = now[index as usize];
                    *bounds = [bounds[0].inf(&position), bounds[1].sup(&position)];
                    *max_displacement = max_displacement.max((next[index as usize] - position).norm());
                }
            }
        });
        for node in (0..inner.len()).rev() {
            let child = |index: usize| match index.checked_sub(leaves - 1) {
                Some(leaf) => (outer[leaf], outer_max[leaf]),
                None => (inner[index], inner_max[index]),
            };
            let ((a, max_displacement), (b, other)) = (child(2 * node + 1), child(2 * node + 2));
            inner[node] = [a[0].inf(&b[0]), a[1].sup(&b[1])];
            inner_max[node] = max_displacement.max(other);
        }
    }

    /// Finds the largest displacement and the bounds of all displacements.
    fn measure(&mut self) {
        let displacements =
            self.now.par_iter().zip(&self.next).with_min_len(VERTICES_PER_TASK).map(|(now, next)| next - now);
        let with = |(square, [low, high]): (f64, [DVec3; 2]), displacement: DVec3| {
            (f64::max(square, displacement.norm_squared()), [low.inf(&displacement), high.sup(&displacement)])
        };
        let both = |(square, [low, high]): (f64, [DVec3; 2]),
                    (other, [box_low, box_high]): (f64, [DVec3; 2])| {
            (f64::max(square, other), [low.inf(&box_low), high.sup(&box_high)])
        };
        let (square, bounds) = displacements.fold(|| (0.0, EMPTY), with).reduce(|| (0.0, EMPTY), both);
        (self.max_displacement, self.displacement_bounds) = (square.sqrt(), bounds);
    }

    /// The contact between the grain in a slot and the plane through a nearest point.
    pub fn touch(
        &self,
        slot: u32,
        row: &Row,
        position: DVec3,
        nearest: &Nearest,
        diameter: f64,
        dt: f64,
    ) -> Touch {
        let (distance, inside, out) = self.side(position, nearest);
        let normal = [out.x as f32, out.y as f32, out.z as f32];
        let gap = (if inside { -distance } else { distance }) / diameter - 0.5;
        let velocity = nearest.displacement / dt;
        Touch {
            grain: slot,
            collider: self.collider,
            normal,
            offset: dot(normal, row.position) - gap as f32,
            velocity: [velocity.x as f32, velocity.y as f32, velocity.z as f32],
            friction: self.friction,
            stick: self.stick,
            is_ground: self.is_ground(),
            ..Touch::default()
        }
    }

    /// Distance (m) of a position from its nearest point, whether it is inside, and the outward direction.
    fn side(&self, position: DVec3, nearest: &Nearest) -> (f64, bool, DVec3) {
        let distance = nearest.square.sqrt();
        let inside = self.has_inside && nearest.height < 0.0 && !nearest.is_on_rim;
        let out = if distance > MIN_DISTANCE {
            (position - nearest.point) * (if inside { -1.0 } else { 1.0 } / distance)
        } else {
            nearest.normal
        };
        (distance, inside, out)
    }

    /// Distance (m) and direction in which a ball of a radius (m) must move to leave the mesh; none if it does not overlap
    /// the mesh or no surface lies within three radii. The mesh must be at rest.
    pub fn depth(&self, position: DVec3, radius: f64) -> Option<(f64, DVec3)> {
        self.depth_from(position, radius, self.nearest(position, DEPTH_REACH * radius))
    }

    /// The same, given the nearest point within [`DEPTH_REACH`] radii.
    pub fn depth_from(&self, position: DVec3, radius: f64, nearest: Option<Nearest>) -> Option<(f64, DVec3)> {
        let nearest = nearest?;
        let (distance, inside, out) = self.side(position, &nearest);
        let depth = if inside { radius + distance } else { radius - distance };
        (depth > 0.0).then_some((depth, out))
    }

    /// The nearest point of the surface within a distance (m) plus the displacement of the surface in the sub-step.
    pub fn nearest(&self, position: DVec3, within: f64) -> Option<Nearest> {
        let apart = |bounds: &[DVec3; 2]| {
            let outside = (bounds[0] - position).sup(&(position - bounds[1])).sup(&DVec3::zeros());
            outside.norm_squared()
        };
        let mut best = Best::default();
        let mut stack = [0usize; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = stack[depth];
            let reach = (within + self.max_displacements[node]).powi(2);
            if apart(&self.boxes[node]) > best.max_square.min(reach) {
                continue;
            }
            if node < self.leaves - 1 {
                let (a, b) = (2 * node + 1, 2 * node + 2);
                let first_is_nearer = apart(&self.boxes[a]) <= apart(&self.boxes[b]);
                (stack[depth], stack[depth + 1]) = if first_is_nearer { (b, a) } else { (a, b) };
                depth += 2;
                continue;
            }
            self.compare_all(node - (self.leaves - 1), position, reach, &mut best);
        }
        best.found.map(|found| self.resolve(found, position))
    }

    /// Compares the triangles of a leaf with the best so far; `reach` is the square of the maximum distance (m2).
    fn compare_all(&self, leaf: usize, position: DVec3, reach: f64, best: &mut Best) {
        let first = leaf * LEAF;
        for index in first..(first + LEAF).min(self.triangles.len()) {
            self.compare(index, position, reach, best);
        }
    }

    /// Compares a triangle with the best so far; `reach` is the square of the maximum distance (m2).
    pub(in crate::snow::grains) fn compare(
        &self,
        index: usize,
        position: DVec3,
        reach: f64,
        best: &mut Best,
    ) {
        let [a, b, c] = self.corners(index);
        let weights = nearest_weights(position, a, b, c);
        let point = a * weights[0] + b * weights[1] + c * weights[2];
        let square = (position - point).norm_squared();
        let mut height = None;
        let is_better = match &mut best.found {
            None => square <= reach,
            Some(other) => {
                let tie = 1.0e-9 * (square + other.square);
                let over = |triangle: usize| self.plane(triangle, position).0.abs();
                // At a shared edge or vertex, the triangle whose plane is farthest from the position decides its side.
                square < other.square - tie
                    || square <= other.square + tie
                        && *height.insert(over(index))
                            > *other.height.get_or_insert_with(|| over(other.triangle))
            }
        };
        if is_better {
            best.max_square = best.max_square.min(square * (1.0 + 1.0e-8));
            best.found = Some(Found { square, triangle: index, weights, point, height });
        }
    }

    /// Visits each leaf that may be within a distance (m), plus the leaf's largest displacement, of a position in the given
    /// box; `visit` gets the leaf, its own bounding box and that displacement (m).
    pub(in crate::snow::grains) fn for_each_leaf(
        &self,
        [low, high]: &[DVec3; 2],
        within: f64,
        mut visit: impl FnMut(u32, &[DVec3; 2], f64),
    ) {
        let mut stack = [0usize; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = stack[depth];
            let margin = within + self.max_displacements[node];
            let [box_low, box_high] = &self.boxes[node];
            if (0..3).any(|axis| box_low[axis] - margin > high[axis] || box_high[axis] + margin < low[axis]) {
                continue;
            }
            if node < self.leaves - 1 {
                (stack[depth], stack[depth + 1]) = (2 * node + 2, 2 * node + 1);
                depth += 2;
            } else {
                visit((node - (self.leaves - 1)) as u32, &self.boxes[node], self.max_displacements[node]);
            }
        }
    }

    /// Corners of the triangles of a leaf.
    pub(in crate::snow::grains) fn leaf_corners(&self, leaf: u32) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        let first = leaf as usize * LEAF;
        (first..(first + LEAF).min(self.triangles.len())).map(|index| self.corners(index))
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|index| self.now[index as usize])
    }

    /// Height (m) of a position above the plane of a triangle, and the normal of the plane.
    fn plane(&self, triangle: usize, position: DVec3) -> (f64, DVec3) {
        let [a, b, c] = self.corners(triangle);
        let across = (b - a).cross(&(c - a));
        let length = across.norm();
        let normal = if length > 0.0 { across / length } else { DVec3::y() };
        ((position - a).dot(&normal), normal)
    }

    pub(in crate::snow::grains) fn resolve(&self, found: Found, position: DVec3) -> Nearest {
        let Found { square, triangle, weights, point, .. } = found;
        let displacement = |corner: usize| {
            let index = self.triangles[triangle][corner] as usize;
            (self.next[index] - self.now[index]) * weights[corner]
        };
        let (height, normal) = self.plane(triangle, position);
        let is_on_rim = self.rims.as_ref().is_some_and(|rims| is_on_rim(rims[triangle], weights));
        Nearest {
            square,
            point,
            displacement: displacement(0) + displacement(1) + displacement(2),
            height,
            normal,
            is_on_rim,
        }
    }
}

/// Whether a point of a triangle (barycentric weights) lies on one of the sides or corners of a rim.
fn is_on_rim(rim: u8, weights: [f64; 3]) -> bool {
    let is_on = |corner: usize| {
        rim >> corner & 1 == 1 && weights[corner] <= 0.0
            || rim >> (RIM_CORNER as usize + corner) & 1 == 1 && weights[corner] >= 1.0
    };
    rim != 0 && (0..3).any(is_on)
}

/// The nearest triangle so far.
pub(in crate::snow::grains) struct Best {
    pub(in crate::snow::grains) found: Option<Found>,
    /// Square of the distance (m2) beyond which no triangle can be better.
    pub(in crate::snow::grains) max_square: f64,
}

impl Default for Best {
    fn default() -> Self {
        Self { found: None, max_square: f64::INFINITY }
    }
}

/// A triangle, the barycentric weights of its nearest point, that point, and the square of its distance (m2).
pub(in crate::snow::grains) struct Found {
    square: f64,
    triangle: usize,
    weights: [f64; 3],
    point: DVec3,
    /// Distance of the position from its plane (m), once computed.
    height: Option<f64>,
}

/// An empty box.
const EMPTY: [DVec3; 2] = [
    DVec3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    DVec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
];

/// Barycentric weights of the point of a triangle nearest to a position (Ericson, Real-Time Collision Detection, 5.1.5).
fn nearest_weights(position: DVec3, a: DVec3, b: DVec3, c: DVec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, position - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = position - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let cp = position - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if sum <= 0.0 { [1.0, 0.0, 0.0] } else { [va / sum, vb / sum, vc / sum] }
}

/// First bit of the corners in the byte that tells which parts of a triangle lie on the rim of a sheet: bit k stands for the
/// side opposite to corner k, bit 3 + k for corner k.
pub const RIM_CORNER: u8 = 3;
