//! Moving objects: a fixed set of triangles whose vertices have a position at every time.

mod drawn;
mod gait;
mod gltf;
mod morph;
mod poses;
mod rigid;
mod sequence;
mod space;

pub use drawn::{Drawn, Part, Parts, missing_uvs};
pub use gait::{Gait, gait};
pub use gltf::{Character, Contents, Play};
pub use morph::Morph;
pub use poses::{Poses, between};
pub use rigid::{Key, Keys, Placed, Rigid};
pub use sequence::MeshSequence;
pub use space::{Space, Up};

use std::path::Path;

use crate::error::Result;
use crate::geometry::{DVec3, TriMesh};
use crate::io::mesh::extension;

/// Whether a file is a glTF character, by its extension.
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
    /// Errors of a file that is read on demand.
    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()>;

    /// As [`Motion::pose`], but in the unit and around the origin in which the vertices were read, before any transform: the rounding of
    /// these coordinates is known ([`crate::geometry::mesh::weld`]).
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn pose_as_read(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.pose(time, out)
    }

    /// The mesh as its file has it, for output. [`Motion::triangles`], which sweep the snow, may join vertices that always move together,
    /// and omit vertices without a triangle.
    fn drawn(&self) -> Drawn<'_> {
        Drawn { vertices: self.vertex_count(), triangles: self.triangles(), uvs: None, parts: None }
    }

    /// As [`Motion::pose`], for the vertices of [`Motion::drawn`].
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.pose(time, out)
    }

    /// The mesh of [`Motion::triangles`] at `time` (s), with positions as in [`Motion::pose`].
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn mesh_at(&self, time: f64) -> Result<TriMesh> {
        let mut pose = Vec::new();
        self.pose(time, &mut pose)?;
        let positions = pose.iter().map(|position| position.cast()).collect();
        Ok(TriMesh { positions, triangles: self.triangles().to_vec() })
    }

    /// Writes the mean velocities (m/s) of the drawn vertices from `time` to `time + step` (s) into `out` (cleared first).
    /// `step` may be negative, but not 0.
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

    /// Whether the motion's data end before a time (s), so that it rests from then on.
    fn ends_before(&self, _time: f64) -> bool {
        false
    }

    /// As [`Motion::velocities`] over the coming `step` (s, above 0), or over the step before `time` if the motion's data end within the
    /// coming one, so that velocities do not drop to 0 at the last frame.
    ///
    /// # Errors
    /// As [`Motion::pose`].
    fn velocities_ahead(&self, time: f64, step: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let ends = self.ends_before(time + 0.999 * step);
        self.velocities(time, if ends { -step } else { step }, out)
    }

    /// Times inside (from, to) where the velocity jumps: keys, frames of a sequence. Ascending.
    fn breaks(&self, from: f64, to: f64) -> Vec<f64>;

    /// Upper bound on the rotation (radians) of any part between two times, if the motion is given by rotations; 0 if vertices move
    /// straight, or along arcs of less than half a turn between two breaks.
    fn turning(&self, _from: f64, _to: f64) -> f64 {
        0.0
    }

    /// Whether vertices that always move together are already one vertex; others that merely coincide at some time are not welded.
    fn is_welded(&self) -> bool {
        false
    }
}
