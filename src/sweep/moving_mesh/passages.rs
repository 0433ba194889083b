//! When the surface of a moving mesh passes given points, between its poses.

use super::topology::{Simplex, Topology};
use crate::distance::Face;
use crate::distance::lattice::{Fixed, UNITS};
use crate::geometry::DVec3;
use crate::geometry::coords::between;
use crate::geometry::lists::Lists;
use crate::geometry::shape::bounds;
use crate::sweep::chain::STILL;

/// Minimum edge (fixed-point units) of the boxes that tetrahedra and faces are sorted into.
const BOX: f64 = UNITS as f64;
/// Maximum total number of boxes, as a multiple of the number of items.
const BOXES: usize = 4;
/// Sample points of a tetrahedron: barycentric weights, off all symmetries.
const SAMPLES: [[f64; 4]; 5] = [
    [0.252, 0.249, 0.251, 0.248],
    [0.703, 0.102, 0.097, 0.098],
    [0.098, 0.703, 0.102, 0.097],
    [0.097, 0.098, 0.703, 0.102],
    [0.102, 0.097, 0.098, 0.703],
];

/// A triangle of a pose, as an oriented face.
pub fn face(simplex: &Simplex, level: &[Fixed]) -> Face {
    let [a, b, c] = simplex.v.map(|vertex| level[vertex as usize]);
    Face { v: if simplex.sign > 0 { [a, b, c] } else { [a, c, b] }, coef: 1 }
}

/// Identifies a [`Passage`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PassageId {
    /// The triangle whose prism it is part of.
    pub triangle: u32,
    /// Index of the step, which leads from the pose of the same index to the next one.
    pub step: u32,
    /// Which of the prism's three tetrahedra, from 0.
    pub part: u32,
}

/// A tetrahedron that the surface passes through.
pub struct Passage {
    /// Identifies the tetrahedron.
    pub id: PassageId,
    /// 1 when the surface moves outward, -1 when inward.
    pub sign: i32,
    corners: [DVec3; 4],
    /// The dot products of a point's offset from the first corner with these are its barycentric weights for the other three corners.
    weights: [DVec3; 3],
}

/// The effect of a passage on the winding number of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// It rises above 0.
    Counts,
    /// It returns to 0 or less; at some earlier time in the same step it was at least 0.
    Returns,
    /// It rises, but not above 0, and has been negative ever since the step began.
    Rises,
}

/// The poses of a moving mesh.
pub struct Poses<'a> {
    /// Its triangles.
    pub topology: &'a Topology,
    /// Its poses, in time order.
    pub levels: &'a [Vec<Fixed>],
}

impl Poses<'_> {
    /// The tetrahedra that a triangle passes through in a step.
    pub fn passages(&self, step: usize, triangle: u32) -> impl Iterator<Item = Passage> {
        let [a, b] = self.prism(step, triangle);
        let still = STILL * (a[1] - a[0]).cross(&(a[2] - a[0])).norm();
        let sign = i32::from(self.topology.simplices[triangle as usize].sign);
        let id = move |part| PassageId { triangle, step: step as u32, part };
        let tetrahedra = tetrahedra(a, b).into_iter().zip(0..);
        tetrahedra.filter_map(move |(corners, part)| Passage::new(id(part), corners, sign, still))
    }

    /// A triangle before and after a step.
    fn prism(&self, step: usize, triangle: u32) -> [[DVec3; 3]; 2] {
        let corners = self.topology.simplices[triangle as usize].v;
        [step, step + 1].map(|level| corners.map(|vertex| to_f64(self.levels[level][vertex as usize])))
    }
}

/// A pose, prepared for queries at given points.
pub struct PreparedPose {
    faces: Vec<[DVec3; 3]>,
    /// The faces above or below each box.
    columns: Boxes,
}

impl PreparedPose {
    /// Prepares a pose for queries at these points.
    pub fn new(poses: &Poses<'_>, level: usize, points: &[DVec3]) -> Self {
        let flat = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
        let (min, max) = bounds(points);
        let is_near = |corners: &[DVec3; 3]| {
            let (low, high) = bounds(corners);
            low.x <= max.x && high.x >= min.x && low.y <= max.y && high.y >= min.y && high.z >= min.z
        };
        let corners = |simplex| face(simplex, &poses.levels[level]).v.map(to_f64);
        let faces: Vec<[DVec3; 3]> = poses.topology.simplices.iter().map(corners).filter(is_near).collect();
        let extents: Vec<_> = faces.iter().map(|corners| bounds(corners.map(flat))).collect();
        let columns = Boxes::new(points.iter().map(|p| flat(*p)), &extents);
        Self { faces, columns }
    }

    /// Winding number of the pose at one of the points.
    pub fn winding(&self, p: &DVec3) -> i32 {
        let column = self.columns.at(&DVec3::new(p.x, p.y, 0.0)).iter();
        column.map(|&id| self.faces[id as usize]).map(|[a, b, c]| above(p, &a, &b, &c)).sum()
    }
}

/// A pose and the passages to the next one, prepared for queries at given points.
pub struct PreparedStep {
    before: PreparedPose,
    passages: Vec<Passage>,
    boxes: Boxes,
}

impl PreparedStep {
    /// Prepares the step that begins at this pose for queries at these points.
    pub fn new(poses: &Poses<'_>, step: usize, points: &[DVec3]) -> Self {
        let (min, max) = bounds(points);
        let is_near = |triangle: &u32| {
            let corners = poses.prism(step, *triangle);
            let (low, high) = bounds(corners.as_flattened());
            (0..3).all(|axis| low[axis] <= max[axis] && high[axis] >= min[axis])
        };
        let near = (0..poses.topology.simplices.len() as u32).filter(is_near);
        let passages: Vec<Passage> = near.flat_map(|triangle| poses.passages(step, triangle)).collect();
        let extents: Vec<_> = passages.iter().map(|passage| bounds(passage.corners)).collect();
        let boxes = Boxes::new(points.iter().copied(), &extents);
        Self { before: PreparedPose::new(poses, step, points), passages, boxes }
    }

    /// The passages at one of the points, with their times, in order of time.
    fn passing(&self, p: &DVec3) -> Vec<(f64, &Passage)> {
        let near = self.boxes.at(p).iter().map(|&id| &self.passages[id as usize]);
        let mut passing: Vec<(f64, &Passage)> =
            near.filter_map(|passage| passage.time(p).map(|time| (time, passage))).collect();
        // A stable sort: passages at equal times stay in the order of the triangles.
        passing.sort_by(|a, b| a.0.total_cmp(&b.0));
        passing
    }

    /// The effect of a passage at one of the points.
    pub fn change(&self, id: PassageId, p: &DVec3) -> Change {
        let mut winding = self.before.winding(p);
        let mut was_nonnegative = winding >= 0;
        for (_, passage) in self.passing(p) {
            if passage.id == id {
                return match (winding >= 0, was_nonnegative) {
                    (true, _) => Change::Counts,
                    (false, true) => Change::Returns,
                    (false, false) => Change::Rises,
                };
            }
            winding += passage.sign;
            was_nonnegative |= winding >= 0;
        }
        Change::Counts
    }

    /// Whether the winding number at one of the points is negative throughout the step.
    pub fn is_below(&self, p: &DVec3) -> bool {
        let mut winding = self.before.winding(p);
        winding < 0
            && self.passing(p).iter().all(|(_, passage)| {
                winding += passage.sign;
                winding < 0
            })
    }
}

/// Items sorted into the boxes that they touch; only boxes that contain query points have lists.
struct Boxes {
    low: DVec3,
    edge: DVec3,
    size: [usize; 3],
    /// For each box that contains a query point, the items that touch it; none for the other boxes.
    items: Lists<u32>,
}

impl Boxes {
    /// Boxes about as large as the items with these bounds.
    fn new(points: impl Iterator<Item = DVec3> + Clone, items: &[(DVec3, DVec3)]) -> Self {
        let (low, high) = bounds(points.clone());
        let count = items.len().max(1);
        let sum: DVec3 = items.iter().map(|(low, high)| high - low).sum();
        let mut edge = (sum / count as f64).map(|mean| mean.max(BOX));
        let size = |edge: &DVec3| [0, 1, 2].map(|axis| ((high - low)[axis] / edge[axis]).floor() + 1.0);
        while size(&edge).iter().product::<f64>() > (BOXES * count) as f64 {
            edge *= 1.5;
        }
        let mut out =
            Self { low, edge, size: size(&edge).map(|value| value as usize), items: Lists::one(Vec::new()) };
        let mut used = vec![false; out.size.iter().product()];
        points.for_each(|p| used[out.number(out.box_of(&p))] = true);
        let mut pairs = Vec::new();
        for ((from, to), id) in items.iter().zip(0..) {
            if (0..3).any(|axis| to[axis] < low[axis] || from[axis] > high[axis]) {
                continue;
            }
            let [first, last] = [from, to].map(|p| out.box_of(p).map(|index| index as i32));
            for at in between(first, last) {
                let number = out.number(at.map(|index| index as usize));
                if used[number] {
                    pairs.push((number as u32, id));
                }
            }
        }
        out.items = Lists::new(used.len(), pairs.iter().copied());
        out
    }

    /// The items that touch the box around a point.
    fn at(&self, p: &DVec3) -> &[u32] {
        self.items.get(self.number(self.box_of(p)))
    }

    /// The box around a point, or the nearest one.
    fn box_of(&self, p: &DVec3) -> [usize; 3] {
        let position = (p - self.low).component_div(&self.edge);
        [0, 1, 2].map(|axis| (position[axis].max(0.0) as usize).min(self.size[axis] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.size[1] + y) * self.size[2] + z
    }
}

/// Corners of the three tetrahedra of a prism, in the order of [`crate::sweep::chain`]. Where a triangle of sign 1 moves outward, the
/// second has a negative volume and the others a positive one.
fn tetrahedra([a0, a1, a2]: [DVec3; 3], [b0, b1, b2]: [DVec3; 3]) -> [[DVec3; 4]; 3] {
    [[a0, a1, a2, b2], [a0, a1, b1, b2], [a0, b0, b1, b2]]
}

impl Passage {
    /// The tetrahedron of a triangle of this sign; none if the surface does not move in it.
    fn new(id: PassageId, corners: [DVec3; 4], sign: i32, still: f64) -> Option<Self> {
        let [u, v, w] = [1, 2, 3].map(|corner| corners[corner] - corners[0]);
        let volume = u.cross(&v).dot(&w);
        if volume.abs() <= still || volume == 0.0 {
            return None;
        }
        let outward = ((volume > 0.0) == (id.part != 1)) == (sign > 0);
        let weights = [v.cross(&w) / volume, w.cross(&u) / volume, u.cross(&v) / volume];
        Some(Self { id, sign: if outward { 1 } else { -1 }, corners, weights })
    }

    /// Its sample points.
    pub fn samples(&self) -> impl Iterator<Item = DVec3> {
        let at = |weights: &[f64; 4]| {
            self.corners.iter().zip(weights).map(|(corner, weight)| corner * *weight).sum()
        };
        SAMPLES.iter().map(at)
    }

    /// When the surface passes a point (0 to 1 within the step); none if the point is outside the tetrahedron. It is the sum of the
    /// barycentric weights of the corners at the later pose: the last one, two or three, depending on the part.
    fn time(&self, p: &DVec3) -> Option<f64> {
        let offset = p - self.corners[0];
        let [u, v, w] = self.weights.map(|row| row.dot(&offset));
        let is_within = u >= 0.0 && v >= 0.0 && w >= 0.0 && u + v + w <= 1.0;
        is_within.then_some([w, v + w, u + v + w][self.id.part as usize])
    }
}

/// 1 if a face above a point faces up, -1 if down; 0 if it is not above the point.
fn above(p: &DVec3, a: &DVec3, b: &DVec3, c: &DVec3) -> i32 {
    let side = |s: &DVec3, t: &DVec3| (t.x - s.x) * (p.y - s.y) - (t.y - s.y) * (p.x - s.x);
    let sides = [side(a, b), side(b, c), side(c, a)];
    let up = sides.iter().all(|side| *side > 0.0);
    let down = sides.iter().all(|side| *side < 0.0);
    if !up && !down {
        return 0;
    }
    let normal = (b - a).cross(&(c - a));
    let is_above = normal.dot(&(p - a)) * normal.z < 0.0;
    match (is_above, up) {
        (false, _) => 0,
        (true, true) => 1,
        (true, false) => -1,
    }
}

/// A fixed-point position as `f64`.
pub fn to_f64(p: Fixed) -> DVec3 {
    DVec3::from(p.map(f64::from))
}
