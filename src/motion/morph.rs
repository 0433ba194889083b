//! One mesh that morphs into another.

use super::{Motion, between};
use crate::error::{Error, Result};
use crate::geometry::mesh::used;
use crate::geometry::{DVec3, TriMesh, Vec3};

/// Vertices that move straight from one mesh's positions to another's.
pub struct Morph {
    from: TriMesh,
    to: Vec<Vec3>,
}

impl Morph {
    /// Moves from `from` at 0 s to the positions `to` (m) at 1 s; it rests before and after.
    ///
    /// # Errors
    /// A different number of positions than `from` has vertices.
    pub fn new(from: TriMesh, to: Vec<Vec3>) -> Result<Self> {
        if from.positions.len() != to.len() {
            return Err(Error::argument(format!(
                "a mesh of {} vertices cannot become one of {}",
                from.positions.len(),
                to.len()
            )));
        }
        // Vertices that no triangle uses sweep nothing.
        let Some(used) = used(to.len(), &from.triangles) else { return Ok(Self { from, to }) };
        let to = used.iter().map(|&vertex| to[vertex as usize]).collect();
        Ok(Self { from: from.without_unused(), to })
    }
}

impl Motion for Morph {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.from.triangles
    }

    fn vertex_count(&self) -> usize {
        self.to.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        between(&self.from.positions, &self.to, time.clamp(0.0, 1.0), out);
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        [0.0, 1.0].into_iter().filter(|&time| time > from && time < to).collect()
    }
}
