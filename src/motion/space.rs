//! The unit and upward axis of a file.

use crate::geometry::DVec3;
use crate::geometry::points::Values;
use crate::io::particles::ParticleData;

/// The upward axis of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// As in frazil, Houdini, Maya.
    Y,
    /// As in Blender, 3ds Max.
    Z,
}

/// Conversion of a file's space to metres with Y up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// Metres per unit of the file.
    pub scale: f64,
    /// The file's upward axis.
    pub up: Up,
    /// A position in the file's unit and axes that becomes the origin: coordinates of a map projection are so large that 32 bits would
    /// round them.
    pub origin: DVec3,
}

impl Space {
    /// Metres, Y up.
    pub const OWN: Self = Self { scale: 1.0, up: Up::Y, origin: DVec3::new(0.0, 0.0, 0.0) };

    /// The space of positions read minus the origin, as [`crate::io::mesh::parse_polygons_from`] does.
    pub fn without_origin(self) -> Self {
        Self { origin: DVec3::zeros(), ..self }
    }

    /// Whether vectors of the file, such as velocities, are already in metres with Y up.
    pub fn keeps_vectors(&self) -> bool {
        self.without_origin() == Self::OWN
    }

    /// A position of the file in metres, Y up.
    pub fn position(&self, p: DVec3) -> DVec3 {
        self.vector(p - self.origin)
    }

    /// A vector of the file, such as a velocity, in metres, Y up.
    pub fn vector(&self, p: DVec3) -> DVec3 {
        let p = p * self.scale;
        match self.up {
            Up::Y => p,
            Up::Z => DVec3::new(p.x, p.z, -p.y),
        }
    }

    /// Converts points of the file to metres, Y up: positions, voxels, the vectors `v`, `vel`, `velocity` and `rest`, and the radius
    /// `pscale`. Other attributes stay as they are.
    pub fn convert(&self, cloud: &mut ParticleData) {
        if *self == Self::OWN {
            return;
        }
        cloud.positions.iter_mut().for_each(|position| *position = self.position(*position));
        cloud.voxel_size = cloud.voxel_size.map(|size| size * self.scale);
        for attribute in &mut cloud.attributes {
            match (attribute.name.as_str(), &mut attribute.values) {
                (name @ ("v" | "vel" | "velocity" | "rest"), Values::Vector(column)) => {
                    let space = if name == "rest" { *self } else { self.without_origin() };
                    for vector in column.stored_mut() {
                        *vector = space.position(DVec3::from(vector.map(f64::from))).cast::<f32>().into();
                    }
                }
                ("pscale", Values::Float(column)) => {
                    let larger = |radius: &mut f32| *radius = (f64::from(*radius) * self.scale) as f32;
                    column.stored_mut().iter_mut().for_each(larger);
                }
                _ => {}
            }
        }
    }
}
