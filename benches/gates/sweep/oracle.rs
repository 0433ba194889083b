//! Exact answers by other means than the library's.

use frazil::geometry::{DVec3, TriMesh};
use nalgebra::Rotation3;

use crate::bins::Bins;

/// A box that moves rigidly, as in the keys of a motion.
pub struct MovingBox {
    /// Half the edges (m).
    pub half: DVec3,
    /// Position at 0 and at 1 (m).
    pub at: [DVec3; 2],
    /// Angles about x, y, z at 0 and at 1 (radians).
    pub turn: [DVec3; 2],
}

impl MovingBox {
    /// Inverse rotation and position at `poses` times.
    pub fn poses(&self, poses: usize) -> Vec<(Rotation3<f64>, DVec3)> {
        let pose = |index: usize| {
            let t = index as f64 / (poses - 1) as f64;
            let turn = self.turn[0].lerp(&self.turn[1], t);
            (Rotation3::from_euler_angles(turn.x, turn.y, turn.z).inverse(), self.at[0].lerp(&self.at[1], t))
        };
        (0..poses).map(pose).collect()
    }

    /// Least signed distance of a point over the poses (m): exact outside their union.
    pub fn distance(&self, poses: &[(Rotation3<f64>, DVec3)], p: DVec3) -> f64 {
        poses.iter().map(|(back, at)| self.box_distance(back * (p - at))).fold(f64::INFINITY, f64::min)
    }

    fn box_distance(&self, p: DVec3) -> f64 {
        let q = p.abs() - self.half;
        q.sup(&DVec3::zeros()).norm() + q.max().min(0.0)
    }

    /// Depth (m) of a point inside what the box sweeps without turning: that is convex, its faces are the box's
    /// and those that the box's edges sweep.
    pub fn depth(&self, p: DVec3) -> f64 {
        let rotation = Rotation3::from_euler_angles(self.turn[0].x, self.turn[0].y, self.turn[0].z);
        let axes = [0, 1, 2].map(|axis| rotation.matrix().column(axis).into_owned());
        let way = self.at[1] - self.at[0];
        let middle = (self.at[0] + self.at[1]) / 2.0;
        let swept = axes.iter().filter_map(|axis| axis.cross(&way).try_normalize(1e-12));
        let depth = |normal: DVec3| {
            let box_reach: f64 = (0..3).map(|axis| self.half[axis] * normal.dot(&axes[axis]).abs()).sum();
            box_reach + normal.dot(&way).abs() / 2.0 - normal.dot(&(p - middle)).abs()
        };
        axes.into_iter().chain(swept).map(depth).fold(f64::INFINITY, f64::min)
    }
}

/// Signed distance (m) of a point from a ball of some radius that moved straight from `a` to `b`.
pub fn capsule(p: DVec3, a: DVec3, b: DVec3, radius: f64) -> f64 {
    let way = b - a;
    let t = ((p - a).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
    (p - a - way * t).norm() - radius
}

/// Vertices whose surroundings (3 cells) are smooth: no normal differs by more than 8 degrees.
pub fn away_from_creases(mesh: &TriMesh, near: impl Fn(DVec3) -> bool, reach: f64) -> Vec<DVec3> {
    let mut normals = vec![DVec3::zeros(); mesh.positions.len()];
    let mut flat: Vec<(DVec3, DVec3)> = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(triangle);
        if !near(a) {
            continue;
        }
        let area = (b - a).cross(&(c - a));
        if let Some(normal) = area.try_normalize(1e-18) {
            flat.push(((a + b + c) / 3.0, normal));
            mesh.triangles[triangle].iter().for_each(|&index| normals[index as usize] += area);
        }
    }
    let (middles, flat): (Vec<DVec3>, Vec<DVec3>) = flat.into_iter().unzip();
    let bins = Bins::new(&middles, reach);
    let smooth = |p: DVec3, normal: DVec3| {
        let mut is_smooth = true;
        bins.near(&p, |index| is_smooth &= flat[index].dot(&normal) > 0.99);
        is_smooth
    };
    let pairs = mesh.positions.iter().zip(&normals);
    pairs
        .filter_map(|(p, normal)| Some((p.cast::<f64>(), normal.try_normalize(1e-18)?)))
        .filter(|(p, normal)| smooth(*p, *normal))
        .map(|(p, _)| p)
        .collect()
}
