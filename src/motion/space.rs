//! A motion whose file has another unit or upward axis.

use super::Motion;
use crate::base::DVec3;
use crate::error::Result;

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

/// A motion brought into metres, Y up.
pub struct InSpace {
    inner: Box<dyn Motion>,
    space: Space,
}

impl InSpace {
    /// `inner`, which moves in `space`.
    pub fn new(inner: Box<dyn Motion>, space: Space) -> Self {
        Self { inner, space }
    }
}

impl Motion for InSpace {
    fn triangles(&self) -> &[[u32; 3]] {
        self.inner.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.inner.vertex_count()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.inner.pose(time, out)?;
        if self.space != Space::OWN {
            out.iter_mut().for_each(|p| *p = self.space.place(*p));
        }
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.inner.breaks(from, to)
    }
}
