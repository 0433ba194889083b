//! Exact distances from the union of dense poses of a moving mesh: nothing of the sweep is used.

use std::collections::BTreeMap;

use frazil::geometry::spatial::bvh::Bvh;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::Motion;
use nalgebra::Rotation3;
use rayon::prelude::*;

use crate::common::nearest::closest;

/// Directions that a depth is looked for in, at first and closely.
const DIRECTIONS: usize = 256;
const CLOSELY: usize = 16_384;
/// Balls of growing radius that are asked.
const RINGS: usize = 16;
/// Halvings between two of them.
const HALVINGS: usize = 2;
/// Directions of rays that tell inside from outside: two of three decide.
const RAYS: [[f64; 3]; 3] = [[0.5377, 0.8339, -0.2259], [-0.8622, 0.3188, 0.4336], [0.3426, -0.4925, 0.8003]];

/// Poses of a mesh; inside is where any of them winds around.
pub struct Dense {
    shapes: Vec<Shape>,
    poses: Vec<Pose>,
    directions: Vec<DVec3>,
    closely: Vec<DVec3>,
}

/// A mesh in a tree, and the ball around it.
struct Shape {
    tree: Bvh,
    corners: Vec<[DVec3; 3]>,
    /// How often each face is there: those turned round count below 0.
    layers: Vec<i32>,
    centre: DVec3,
    radius: f64,
}

/// Where a shape is.
struct Pose {
    back: Rotation3<f64>,
    at: DVec3,
    shape: usize,
}

impl Dense {
    /// One mesh at each of these rotations and positions (m).
    pub fn rigid(mesh: &TriMesh, poses: impl Iterator<Item = (Rotation3<f64>, DVec3)>) -> Self {
        let poses = poses.map(|(rotation, at)| Pose { back: rotation.inverse(), at, shape: 0 });
        Self::of(vec![Shape::new(mesh)], poses.collect())
    }

    /// A motion at `count` times from 0 to 1.
    pub fn posed(motion: &dyn Motion, count: usize) -> Self {
        let still = (0..count).map(|_| (Rotation3::identity(), DVec3::zeros()));
        Self::moved(motion, count, still)
    }

    /// A motion at `count` times from 0 to 1, carried to rotations and positions (m) that follow each other evenly in time.
    pub fn moved(
        motion: &dyn Motion,
        count: usize,
        places: impl ExactSizeIterator<Item = (Rotation3<f64>, DVec3)>,
    ) -> Self {
        let shape = |index: usize| {
            let mut pose = Vec::new();
            motion.pose(index as f64 / (count - 1) as f64, &mut pose).expect("a pose");
            let positions = pose.iter().map(|p| p.cast::<f32>()).collect();
            Shape::new(&TriMesh { positions, triangles: motion.triangles().to_vec() })
        };
        let last = places.len() - 1;
        let pose = |(index, (rotation, at)): (usize, (Rotation3<f64>, DVec3))| Pose {
            back: rotation.inverse(),
            at,
            shape: (index * (count - 1) + last / 2) / last,
        };
        let shapes = (0..count).into_par_iter().map(shape).collect();
        Self::of(shapes, places.enumerate().map(pose).collect())
    }

    fn of(shapes: Vec<Shape>, poses: Vec<Pose>) -> Self {
        Self { shapes, poses, directions: directions(DIRECTIONS), closely: directions(CLOSELY) }
    }

    /// Signed distance (m) of a point from the union, cut off at `limit`; pits and slits may be missed that are narrower
    /// than a fifth of their distance.
    pub fn distance(&self, p: DVec3, limit: f64) -> f64 {
        self.looked_for(p, limit, &self.directions)
    }

    /// As [`Dense::distance`], but what is wider than a fortieth of its distance is seen: slow.
    pub fn distance_closely(&self, p: DVec3, limit: f64) -> f64 {
        self.looked_for(p, limit, &self.closely)
    }

    fn looked_for(&self, p: DVec3, limit: f64, directions: &[DVec3]) -> f64 {
        let mut hint = 0;
        if self.is_inside(p, &mut hint) {
            -self.depth(p, limit, directions, hint)
        } else {
            self.gap(p, limit)
        }
    }

    /// Whether a point lies inside by more than a depth (m).
    pub fn is_deep(&self, p: DVec3, depth: f64) -> bool {
        let mut hint = 0;
        self.is_inside(p, &mut hint) && self.depth(p, 2.0 * depth, &self.directions, hint) > depth
    }

    /// Whether a point lies outside by more than a gap (m).
    pub fn is_far(&self, p: DVec3, gap: f64) -> bool {
        !self.is_inside(p, &mut 0) && self.gap(p, 2.0 * gap) > gap
    }

    /// Whether a point lies in any pose; `hint` is the one that was right last.
    fn is_inside(&self, p: DVec3, hint: &mut usize) -> bool {
        let holds = |pose: &Pose| self.shapes[pose.shape].holds(pose.local(p));
        if holds(&self.poses[*hint]) {
            return true;
        }
        // From the hint outward: neighbours in time are likely.
        let count = self.poses.len();
        let order = (1..count).flat_map(|step| [hint.checked_sub(step), Some(*hint + step)]);
        let found = order.flatten().filter(|&index| index < count).find(|&index| holds(&self.poses[index]));
        *hint = found.unwrap_or(*hint);
        found.is_some()
    }

    /// Distance (m) of a point outside from the nearest pose.
    fn gap(&self, p: DVec3, limit: f64) -> f64 {
        self.poses.iter().fold(limit, |best, pose| self.shapes[pose.shape].gap(pose.local(p), best))
    }

    /// Radius (m) of the largest ball around a point that lies inside.
    fn depth(&self, p: DVec3, limit: f64, directions: &[DVec3], mut hint: usize) -> f64 {
        let mut within =
            |radius: f64| directions.iter().all(|way| self.is_inside(p + way * radius, &mut hint));
        // Outward: a slit may lie inside a larger ball of which all directions are inside.
        let radius = |ring: usize| limit * ring as f64 / RINGS as f64;
        let Some(ring) = (1..=RINGS).find(|&ring| !within(radius(ring))) else { return limit };
        let (mut low, mut high) = (radius(ring - 1), radius(ring));
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            (low, high) = if within(middle) { (middle, high) } else { (low, middle) };
        }
        (low + high) / 2.0
    }
}

impl Pose {
    fn local(&self, p: DVec3) -> DVec3 {
        self.back * (p - self.at)
    }
}

impl Shape {
    fn new(mesh: &TriMesh) -> Self {
        let (triangles, layers): (Vec<[u32; 3]>, Vec<i32>) = distinct(&mesh.triangles).into_iter().unzip();
        let mesh = &TriMesh { positions: mesh.positions.clone(), triangles };
        let corners: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|index| mesh.corners(index)).collect();
        let start = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
        let (low, high) = corners.iter().flatten().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
        let centre = (low + high) / 2.0;
        let radius = corners.iter().flatten().map(|p| (p - centre).norm()).fold(0.0, f64::max);
        Self { tree: Bvh::new(mesh), corners, layers, centre, radius }
    }

    fn holds(&self, p: DVec3) -> bool {
        if (p - self.centre).norm() > self.radius {
            return false;
        }
        let winds = |ray: [f64; 3]| self.winding(p, DVec3::from(ray)) > 0;
        let [first, second] = [winds(RAYS[0]), winds(RAYS[1])];
        if first == second { first } else { winds(RAYS[2]) }
    }

    /// How often the mesh winds around a point, by the faces that a ray leaves and enters it through.
    fn winding(&self, mut p: DVec3, way: DVec3) -> i32 {
        let mut winding = 0;
        while let Some(hit) = self.tree.ray(p, way, 4.0 * self.radius) {
            let [a, b, c] = self.corners[hit.triangle];
            let leaves = (b - a).cross(&(c - a)).dot(&way) > 0.0;
            winding += self.layers[hit.triangle] * if leaves { 1 } else { -1 };
            p += way * (hit.distance + 1e-9);
        }
        winding
    }

    /// Distance (m) from the nearest triangle, if it is less than `best`.
    fn gap(&self, p: DVec3, best: f64) -> f64 {
        if (p - self.centre).norm() > self.radius + best {
            return best;
        }
        let reach = Vec3::repeat(best as f32 * 1.001);
        let near: Vec3 = p.cast();
        let mut least = best;
        self.tree.in_box(near - reach, near + reach, |index| {
            least = least.min((p - closest(p, self.corners[index])).norm());
        });
        least
    }
}

/// Unique triangles, each with how often it is there: those turned round count below 0. Those that cancel are left out.
fn distinct(triangles: &[[u32; 3]]) -> Vec<([u32; 3], i32)> {
    let mut layers: BTreeMap<[u32; 3], i32> = BTreeMap::new();
    for &[a, b, c] in triangles {
        let least = a.min(b).min(c);
        let [_, second, third] = if least == a {
            [a, b, c]
        } else if least == b {
            [b, c, a]
        } else {
            [c, a, b]
        };
        if second < third {
            *layers.entry([least, second, third]).or_default() += 1;
        } else {
            *layers.entry([least, third, second]).or_default() -= 1;
        }
    }
    layers.into_iter().filter(|(_, count)| *count != 0).collect()
}

/// Unit vectors spread evenly: a spiral.
fn directions(count: usize) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let way = |index: usize| {
        let z = 1.0 - (2.0 * index as f64 + 1.0) / count as f64;
        let (sin, cos) = (golden * index as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * cos, across * sin, z)
    };
    (0..count).map(way).collect()
}
