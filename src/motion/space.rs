//! The unit and upward axis of a file.

use crate::base::DVec3;

/// The upward axis of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Up {
    /// As frazil, Houdini, Maya.
    Y,
    /// As Blender, 3ds Max.
    Z,
}

/// How a file's space becomes metres with Y up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// Metres in the file's unit.
    pub scale: f64,
    /// The file's upward axis.
    pub up: Up,
}

impl Space {
    /// Metres, Y up.
    pub const OWN: Self = Self { scale: 1.0, up: Up::Y };

    /// A position of the file in metres, Y up.
    pub fn place(&self, p: DVec3) -> DVec3 {
        let p = p * self.scale;
        match self.up {
            Up::Y => p,
            Up::Z => DVec3::new(p.x, p.z, -p.y),
        }
    }
}
