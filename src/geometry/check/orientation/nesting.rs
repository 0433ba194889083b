//! Which parts of a mesh lie within others, and which must be turned outward.

use rayon::prelude::*;

use crate::geometry::check::deviation::Facet;
use crate::geometry::shape::bounds;
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh, Vec3};

/// Directions of rays, which no edges of modelled meshes follow; two of the three must agree that a point is inside.
pub(super) const ASLANT: [DVec3; 3] = [
    DVec3::new(0.5773, 0.6533, 0.4896),
    DVec3::new(-0.6123, 0.3871, 0.6894),
    DVec3::new(0.2411, -0.7327, 0.6364),
];
/// Nearly straight up.
const UP: DVec3 = DVec3::new(1.3e-5, 1.0, -0.7e-5);
/// Points within this fraction of the overall size lie on a surface: 32-bit coordinates are that coarse.
const ON_SURFACE: f64 = 1.0e-6;
/// Maximum number of a part's triangles whose centres are tested if its outermost corners all lie on other parts.
const MIDDLES: usize = 16;

/// A part of a mesh, as the space that it bounds.
pub(super) struct Shape {
    /// Its triangles, then those that close it.
    pub(super) triangles: Vec<[DVec3; 3]>,
    /// How many of them are its own.
    pub(super) own: usize,
    /// Signed volume (m3); 0: it bounds nothing.
    pub(super) volume: f64,
    /// Whether it may be turned; if not, it can only contain parts.
    pub(super) can_turn: bool,
    /// Whether it is an open sheet below whose upward-facing triangles everything is solid; its volume then means nothing.
    pub(super) is_bottomless: bool,
}

/// The parts to turn so that none is empty that should be solid.
pub(super) struct Turns {
    /// For each part, whether it must be turned.
    pub(super) turned: Vec<bool>,
    /// Parts to be turned whose inner parts may or may not be cavities.
    pub(super) ambiguous: usize,
}

/// Where a part lies.
#[derive(Clone, Copy, PartialEq)]
enum Position {
    /// One of its outermost corners lies in no other part.
    Outside,
    /// Entirely within this part and no smaller one.
    Within(u32),
    /// Within several parts together.
    Between,
}

/// Which parts to turn, if some are inside out.
pub(super) fn turns(shapes: &[Shape]) -> Turns {
    let space = Space::of(shapes);
    let bounds_space = |shape: &Shape| shape.can_turn && shape.volume != 0.0;
    let position = |(part, shape): (usize, &Shape)| match bounds_space(shape) {
        true => space.position(part as u32),
        false => Position::Between,
    };
    let positions: Vec<Position> = shapes.par_iter().enumerate().map(position).collect();
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); shapes.len()];
    for (part, position) in (0..).zip(&positions) {
        if let Position::Within(parent) = position {
            children[*parent as usize].push(part);
        }
    }
    let mut out = Turns { turned: vec![false; shapes.len()], ambiguous: 0 };
    let mut signs: Vec<i32> = shapes.iter().map(Shape::sign).collect();
    // Winding number of the surrounding parts, as they are turned now, around each part.
    let mut around = vec![0i32; shapes.len()];
    let mut order: Vec<u32> =
        (0..shapes.len() as u32).filter(|part| bounds_space(&shapes[*part as usize])).collect();
    order.sort_by(|a, b| shapes[*b as usize].size().total_cmp(&shapes[*a as usize].size()).then(a.cmp(b)));
    for &part in &order {
        let at = part as usize;
        around[at] = match positions[at] {
            Position::Outside => 0,
            Position::Within(parent) => around[parent as usize] + signs[parent as usize],
            Position::Between => continue,
        };
        if around[at] + signs[at] >= 0 {
            continue;
        }
        let mut below = children[at].clone();
        let mut reached = 0;
        while reached < below.len() {
            below.extend_from_slice(&children[below[reached] as usize]);
            reached += 1;
        }
        let has = |parts: &[u32], sign: i32| parts.iter().any(|other| signs[*other as usize] == sign);
        let [has_solid, has_cavity] = [1, -1].map(|sign| has(&children[at], sign));
        // If the parts directly within it face the other way, turn it with everything in it: it is a solid whose whole surface is inside
        // out. Otherwise inside-out parts within it are already cavities.
        let as_a_whole = has_solid && !has_cavity;
        let is_clear = as_a_whole || below.is_empty() || (!has_solid && has(&below, 1));
        out.ambiguous += usize::from(!is_clear);
        for other in below.iter().filter(|_| as_a_whole).chain([&part]) {
            out.turned[*other as usize] ^= true;
            signs[*other as usize] *= -1;
        }
    }
    out
}

impl Shape {
    fn sign(&self) -> i32 {
        match self.is_bottomless {
            true => 1,
            false => i32::from(self.volume > 0.0) - i32::from(self.volume < 0.0),
        }
    }

    fn size(&self) -> f64 {
        if self.is_bottomless { f64::INFINITY } else { self.volume.abs() }
    }

    fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.triangles[..self.own].iter().flatten().copied()
    }
}

/// All parts, moved near the origin so that 32-bit coordinates suffice.
struct Space<'a> {
    shapes: &'a [Shape],
    low: DVec3,
    /// Distance (m) within which a point counts as on a surface.
    near: f64,
    corners: Vec<[Vec3; 3]>,
    tree: Bvh,
    /// The part of each triangle.
    owner: Vec<u32>,
}

impl<'a> Space<'a> {
    fn of(shapes: &'a [Shape]) -> Self {
        let (low, high) = bounds(shapes.iter().flat_map(Shape::corners));
        let (mut corners, mut owner) = (Vec::new(), Vec::new());
        for (shape, part) in shapes.iter().zip(0..).filter(|(shape, _)| shape.sign() != 0) {
            corners.extend(shape.triangles.iter().map(|corners| corners.map(|p| (p - low).cast::<f32>())));
            owner.resize(corners.len(), part);
        }
        let tree = Bvh::new(&TriMesh::soup(corners.as_flattened().to_vec()));
        Self { shapes, low, near: ON_SURFACE * (high - low).norm(), corners, tree, owner }
    }

    /// The other parts that contain a point, ascending, each with whether the point is strictly inside and not on the surface.
    fn holders(&self, point: DVec3, own: u32) -> Vec<(u32, bool)> {
        let point = (point - self.low).cast::<f32>();
        let origin: DVec3 = point.cast();
        let margin = Vec3::repeat(self.near as f32);
        let mut out = Vec::new();
        self.tree.in_box(point - margin, point + margin, |triangle| {
            let is_on =
                || Facet::new(self.corners[triangle], 0).nearest(origin, 0).square <= self.near * self.near;
            if self.owner[triangle] != own && is_on() {
                out.push((self.owner[triangle], false));
            }
        });
        out.sort_unstable();
        out.dedup();
        let mut hits: Vec<(u32, usize, i32)> = Vec::new();
        for (axis, direction) in ASLANT.into_iter().chain([UP]).enumerate() {
            self.tree.crossings(origin, direction, |triangle, sign| {
                let part = self.owner[triangle];
                let is_bottomless = self.shapes[part as usize].is_bottomless;
                if part != own && is_bottomless == (axis == ASLANT.len()) {
                    hits.push((part, axis, sign));
                }
            });
        }
        hits.sort_unstable();
        let on = out.len();
        for of_part in hits.chunk_by(|a, b| a.0 == b.0) {
            let (part, sign) = (of_part[0].0, self.shapes[of_part[0].0 as usize].sign());
            let along = of_part.chunk_by(|a, b| a.1 == b.1);
            let votes = along.filter(|hits| sign * hits.iter().map(|hit| hit.2).sum::<i32>() > 0).count();
            let min_votes = if self.shapes[part as usize].is_bottomless { 1 } else { 2 };
            if votes >= min_votes && !out[..on].contains(&(part, false)) {
                out.push((part, true));
            }
        }
        out.sort_unstable();
        out
    }

    fn position(&self, part: u32) -> Position {
        let shape = &self.shapes[part as usize];
        let end = |axis: usize, is_high: bool| {
            let by_axis = move |a: &DVec3, b: &DVec3| a[axis].total_cmp(&b[axis]);
            if is_high { shape.corners().max_by(by_axis) } else { shape.corners().min_by(by_axis) }
        };
        let ends = (0..3).flat_map(|axis| [end(axis, false), end(axis, true)]).flatten();
        // Most parts are outside, which one corner decides.
        let holders = |point: DVec3| Some(self.holders(point, part)).filter(|held| !held.is_empty());
        let Some(mut held) = ends.map(holders).collect::<Option<Vec<Vec<(u32, bool)>>>>() else {
            return Position::Outside;
        };
        if held.iter().flatten().all(|(_, is_within)| !is_within) {
            let some = shape.triangles[..shape.own].iter().step_by(shape.own.div_ceil(MIDDLES).max(1));
            held = some.map(|[a, b, c]| self.holders((a + b + c) / 3.0, part)).collect();
            let is_apart =
                held.iter().any(Vec::is_empty) || held.iter().flatten().all(|(_, is_within)| !is_within);
            if is_apart {
                return Position::Outside;
            }
        }
        let holds_all = |(holder, is_within): &(u32, bool)| {
            let is_holder = |other: &(u32, bool)| other.0 == *holder;
            *is_within && held.iter().all(|held| held.iter().any(is_holder))
        };
        let size = |part: u32| self.shapes[part as usize].size();
        let all = held.iter().flatten().filter(|holder| holds_all(holder) && size(holder.0) > shape.size());
        let smallest = all.min_by(|a, b| size(a.0).total_cmp(&size(b.0)).then(a.0.cmp(&b.0)));
        smallest.map_or(Position::Between, |holder| Position::Within(holder.0))
    }
}
