//! Things that move: a fixed set of triangles whose vertices have a position at every time.

mod drawn;
mod gait;
mod gltf;
mod morph;
mod poses;
mod rigid;
mod sequence;
mod space;

pub use drawn::{Drawn, missing_uvs};
pub use gait::{Gait, gait};
pub use gltf::{Character, Contents, Play};
pub use morph::Morph;
pub use poses::{Poses, between, span};
pub use rigid::{Key, Keys, Placed, Rigid};
pub use sequence::MeshSequence;
pub use space::{Space, Up};

use std::path::Path;

use crate::error::Result;
use crate::geometry::DVec3;
use crate::io::mesh::extension;

/// Whether a file is a glTF character, by its name.
pub fn is_gltf(path: &Path) -> bool {
    matches!(extension(path).as_str(), "glb" | "gltf")
}

/// A mesh in motion. The triangles never change; only the vertices move.
pub trait Motion: Send + Sync {
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    fn triangles(&self) -> &[[u32; 3]];

    /// Number of vertices.
    fn vertex_count(&self) -> usize;

    /// Writes the vertices' world positions (m) at `time` (s) into `out` (cleared first; its memory is kept).
    ///
    /// # Errors
    /// What a file read on demand reports.
    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()>;

    /// As [`Motion::pose`], but in the unit and around the origin in which the vertices were read, before anything turned or moved them:
    /// the rounding of these coordinates is known ([`crate::geometry::mesh::weld`]).
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn pose_as_read(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.pose(time, out)
    }

    /// The mesh as its file has it, to write. [`Motion::triangles`], which sweep the snow, may join vertices that always move
    /// together, and omit vertices without a triangle.
    fn drawn(&self) -> Drawn<'_> {
        Drawn { vertices: self.vertex_count(), triangles: self.triangles(), uvs: None }
    }

    /// As [`Motion::pose`], for the vertices of [`Motion::drawn`].
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.pose(time, out)
    }

    /// Writes the mean velocities (m/s) of the drawn vertices from `time` to `time + step` (s) into `out` (cleared first).
    /// `step` may be negative, not 0.
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn velocities(&self, time: f64, step: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let mut before = Vec::new();
        self.drawn_pose(time, &mut before)?;
        self.drawn_pose(time + step, out)?;
        out.iter_mut().zip(&before).for_each(|(after, before)| *after = (*after - before) / step);
        Ok(())
    }

    /// Whether the motion's own data end before a time (s), so that it rests from then on.
    fn ends_before(&self, _time: f64) -> bool {
        false
    }

    /// As [`Motion::velocities`] over the coming `step` (s, above 0) or, where the motion's own data end sooner, over the
    /// step before, so that velocities do not drop to 0 at the last frame.
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn velocities_ahead(&self, time: f64, step: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let ends = self.ends_before(time + 0.999 * step);
        self.velocities(time, if ends { -step } else { step }, out)
    }

    /// Times inside (from, to) where the direction of motion jumps: keys, frames of a sequence. Ascending.
    fn breaks(&self, from: f64, to: f64) -> Vec<f64>;

    /// Upper bound on the rotation (radians) of any part between two times, where the motion is given by rotations; 0 where
    /// vertices move straight, or along arcs of less than half a turn between two breaks.
    fn turning(&self, _from: f64, _to: f64) -> f64 {
        0.0
    }

    /// Whether vertices that always move together are already one vertex; others that coincide at some time are not welded.
    fn keeps_its_welds(&self) -> bool {
        false
    }
}
