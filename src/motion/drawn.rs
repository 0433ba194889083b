//! Moving meshes as their files have them: every vertex in the file's order, and texture coordinates.

use crate::geometry::mesh::{renumbered, used};
use crate::geometry::{PolygonMesh, Uvs, Vec3};

/// A moving mesh as it is written.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// Number of vertices.
    pub vertices: usize,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Texture coordinates, where the file has any.
    pub uvs: Option<&'a Uvs>,
}

/// The faces of a file, and those of its vertices that sweep the snow.
pub(super) struct Faces {
    vertices: usize,
    triangles: Vec<[u32; 3]>,
    uvs: Option<Uvs>,
    /// The vertices that triangles use, and the triangles over these; `None` if they use all.
    moving: Option<(Vec<u32>, Vec<[u32; 3]>)>,
}

impl Faces {
    /// Faces and vertices of polygons; indices must be in range.
    pub fn new(polygons: PolygonMesh) -> (Self, Vec<Vec3>) {
        let (mesh, uvs) = polygons.into_textured();
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles);
        let moving = used(vertices, &triangles).map(|used| {
            let own = renumbered(&triangles, &used);
            (used, own)
        });
        (Self { vertices, triangles, uvs, moving }, mesh.positions)
    }

    /// The mesh as it is written.
    pub fn drawn(&self) -> Drawn<'_> {
        Drawn { vertices: self.vertices, triangles: &self.triangles, uvs: self.uvs.as_ref() }
    }

    /// Triangles over the vertices that they use.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.moving.as_ref().map_or(&self.triangles, |(_, own)| own)
    }

    /// Number of vertices that triangles use.
    pub fn count(&self) -> usize {
        self.moving.as_ref().map_or(self.vertices, |(used, _)| used.len())
    }

    /// Keeps only the positions of vertices that triangles use.
    pub fn keep_moving<T: Copy>(&self, positions: &mut Vec<T>) {
        if let Some((used, _)) = &self.moving {
            // Indices ascend: no position is overwritten before it is read.
            used.iter().enumerate().for_each(|(to, &from)| positions[to] = positions[from as usize]);
            positions.truncate(used.len());
        }
    }
}

/// The warning for corners without texture coordinates.
pub fn missing_uvs(name: &str, count: usize) -> String {
    format!("{name}: {count} corners or vertices have no UVs: they are written as 0, 0")
}
