//! A mesh as `frazil mesh compare` compares it.

use std::path::Path;

use frazil::geometry::{PolygonMesh, TriMesh};
use frazil::motion::{Character, is_gltf};

use crate::cli::options::{Origin, warn_if_far};

/// A mesh in triangles, and its faces as the file has them: non-planar polygons may be triangulated differently in another frame.
pub struct ComparedMesh {
    /// In triangles.
    pub mesh: TriMesh,
    /// As the file has them, without their arrays.
    pub faces: PolygonMesh,
}

impl ComparedMesh {
    /// Reads a file's mesh relative to an origin.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(path: &Path, origin: &Origin) -> frazil::Result<Self> {
        if !is_gltf(path) {
            let read = origin.read(path)?;
            let mesh = TriMesh { triangles: read.triangles(), positions: read.positions.clone() };
            warn_if_far(path, &mesh);
            return Ok(Self { mesh, faces: PolygonMesh { uvs: None, arrays: Vec::new(), ..read } });
        }
        let mesh = Character::at_rest_from(path, origin.at)?;
        warn_if_far(path, &mesh);
        let mut faces = PolygonMesh { positions: mesh.positions.clone(), ..PolygonMesh::default() };
        mesh.triangles.iter().for_each(|triangle| faces.push(*triangle));
        Ok(Self { mesh, faces })
    }

    /// Whether another mesh has the same vertices and faces, regardless of positions.
    pub fn has_faces_of(&self, other: &Self) -> bool {
        self.faces.has_faces_of(&other.faces)
    }
}
