//! Obstacles of a scene, frame by frame.

use nalgebra::Rotation3;

use crate::error::Result;
use crate::geometry::{DVec3, TriMesh, Vec3};
use crate::io::records::input_hashes::InputHashes;
use crate::motion::{Key, Keys};
use crate::scene::KeyPose;
use crate::scene::shallow::{Obstacle, ObstacleShape, Shallow};
use crate::shallow::terrain::shapes::Shape;

use super::terrain::read_mesh;

impl Obstacle {
    /// Rotation and position (m) at a frame.
    fn pose(&self, frame: i32) -> Result<(Rotation3<f64>, DVec3)> {
        let key = |pose: &KeyPose| Key {
            time: pose.frame,
            at: DVec3::from(pose.at),
            turn: DVec3::from(pose.turn_deg.map(f64::to_radians)),
        };
        let keys = Keys::new(self.keys.iter().map(key).collect())?.with_ease(self.ease);
        Ok(keys.at(f64::from(frame)))
    }

    /// Its shape at a frame; `None` for a mesh.
    fn shape(&self, frame: i32) -> Result<Option<Shape>> {
        let (turn, at) = self.pose(frame)?;
        Ok(match self.shape {
            ObstacleShape::Sphere(radius) => Some(Shape::Sphere { centre: at, radius }),
            ObstacleShape::Capsule(radius, length) => {
                let half = turn * DVec3::new(0.0, 0.5 * length, 0.0);
                Some(Shape::Capsule { ends: [at - half, at + half], radius })
            }
            ObstacleShape::Cuboid(size) => {
                let axes = [DVec3::x(), DVec3::y(), DVec3::z()].map(|axis| turn * axis);
                Some(Shape::Cuboid { centre: at, axes, half: size.map(|length| 0.5 * length) })
            }
            ObstacleShape::Mesh(..) => None,
        })
    }

    /// Its mesh in its pose at the first frame, which it keeps (m); `None` for a shape.
    ///
    /// # Errors
    /// A file that cannot be read.
    fn mesh(&self, first: i32, input_hashes: &InputHashes) -> Result<Option<TriMesh>> {
        let ObstacleShape::Mesh(path, space) = &self.shape else { return Ok(None) };
        let mut mesh = read_mesh(path, *space, input_hashes)?;
        let (turn, at) = self.pose(first)?;
        mesh.positions
            .iter_mut()
            .for_each(|position| *position = (turn * position.cast::<f64>() + at).cast());
        Ok(Some(mesh))
    }
}

/// The shapes of a scene at a frame, in the file's order.
///
/// # Errors
/// None for a scene that was read.
pub(in crate::scene::shallow) fn shapes_at(setup: &Shallow, frame: i32) -> Result<Vec<Shape>> {
    setup.obstacles.iter().filter_map(|obstacle| obstacle.shape(frame).transpose()).collect()
}

/// The obstacles that are meshes, in the file's order (m).
///
/// # Errors
/// A file that cannot be read.
pub(in crate::scene::shallow) fn meshes(
    setup: &Shallow,
    first: i32,
    input_hashes: &InputHashes,
) -> Result<Vec<TriMesh>> {
    setup.obstacles.iter().filter_map(|obstacle| obstacle.mesh(first, input_hashes).transpose()).collect()
}

/// Points of each ring of a sphere's mesh, and rings from its bottom to its middle.
const RING_POINTS: usize = 32;
const RINGS: usize = 8;

/// A shape as triangles, for rendering.
pub(in crate::scene::shallow) fn shape_mesh(shape: &Shape) -> TriMesh {
    match shape {
        Shape::Sphere { centre, radius } => capsule_mesh([*centre; 2], *radius),
        Shape::Capsule { ends, radius } => capsule_mesh(*ends, *radius),
        Shape::Cuboid { centre, axes, half } => {
            let mut mesh = TriMesh::cuboid([-1.0; 3], [1.0; 3]);
            for position in &mut mesh.positions {
                let own = position.cast::<f64>();
                let by = |axis: usize| axes[axis] * (own[axis] * half[axis]);
                *position = (centre + by(0) + by(1) + by(2)).cast();
            }
            mesh
        }
    }
}

/// A capsule: two hemispheres, and the cylinder between.
fn capsule_mesh([from, to]: [DVec3; 2], radius: f64) -> TriMesh {
    let up = (to - from).try_normalize(0.0).unwrap_or_else(DVec3::y);
    let helper = if up.x.abs() < 0.7 { DVec3::x() } else { DVec3::z() };
    let side = helper.cross(&up).normalize();
    let other = up.cross(&side);
    let mut positions: Vec<Vec3> = Vec::new();
    for ring in 0..2 * RINGS {
        let end = usize::from(ring >= RINGS);
        // The middle ring occurs twice: at both ends.
        let tilt = (ring - end) as f64 / (2 * RINGS - 2) as f64 * std::f64::consts::PI;
        let (wide, high) = (radius * libm::sin(tilt), -radius * libm::cos(tilt));
        for point in 0..RING_POINTS {
            let angle = point as f64 / RING_POINTS as f64 * std::f64::consts::TAU;
            let off = side * (wide * libm::cos(angle)) + other * (wide * libm::sin(angle)) + up * high;
            positions.push(([from, to][end] + off).cast());
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..2 * RINGS - 1 {
        for point in 0..RING_POINTS {
            let at = |ring: usize, point: usize| (ring * RING_POINTS + point % RING_POINTS) as u32;
            let [a, b, c, d] =
                [at(ring, point), at(ring + 1, point), at(ring + 1, point + 1), at(ring, point + 1)];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    TriMesh { positions, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mesh_of_a_shape_is_as_large_as_the_shape() {
        let ends = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(1.0, 2.0, 5.0)];
        let mesh = shape_mesh(&Shape::Capsule { ends, radius: 0.5 });
        let whole = std::f64::consts::PI * (0.25 * 2.0 + 4.0 / 3.0 * 0.125);
        assert!((mesh.volume() / whole - 1.0).abs() < 0.03, "{} is not {whole}", mesh.volume());
        let ball = shape_mesh(&Shape::Sphere { centre: ends[0], radius: 1.0 });
        assert!((ball.volume() / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.03, "{}", ball.volume());
        let half = [1.0, 2.0, 0.5];
        let turned = [DVec3::y(), -DVec3::x(), DVec3::z()];
        let cuboid = shape_mesh(&Shape::Cuboid { centre: ends[0], axes: turned, half });
        assert!((cuboid.volume() - 8.0).abs() < 1e-6, "{}", cuboid.volume());
    }

    #[test]
    fn shapes_go_along_their_keys() {
        let key = |frame, at, turn_deg| KeyPose { frame, at, turn_deg };
        let keys = vec![key(1.0, [0.0; 3], [0.0; 3]), key(3.0, [2.0, 0.0, 0.0], [0.0, 0.0, 180.0])];
        let obstacle = Obstacle { shape: ObstacleShape::Capsule(0.1, 2.0), keys, ease: false };
        let Some(Shape::Capsule { ends, .. }) = obstacle.shape(2).unwrap() else { panic!() };
        assert!((ends[0] - DVec3::new(2.0, 0.0, 0.0)).norm() < 1e-12, "{ends:?}");
        assert!((ends[1] - DVec3::new(0.0, 0.0, 0.0)).norm() < 1e-12, "{ends:?}");
    }
}
