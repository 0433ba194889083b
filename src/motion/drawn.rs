//! Moving meshes as their files have them: every vertex in the file's order, and texture coordinates.

use crate::geometry::mesh::{renumbered, used};
use crate::geometry::{DVec3, PolygonMesh, Uvs, Vec3};

/// A moving mesh as it is written.
#[derive(Debug, Clone, Copy)]
pub struct Drawn<'a> {
    /// Number of vertices.
    pub vertices: usize,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Texture coordinates, where the file has any.
    pub uvs: Option<&'a Uvs>,
    /// The parts that it consists of; `None` if the file has no such division.
    pub parts: Option<&'a Parts>,
}

/// A division of triangles into parts with names and colours.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Parts {
    /// The parts, in the file's order.
    pub list: Vec<Part>,
    /// For each triangle, the index of its part.
    pub of_triangles: Vec<u32>,
}

/// A part of a mesh: what a node of a glTF file shows in one colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the node.
    pub name: String,
    /// Base colour (linear), where the file has one without a texture.
    pub colour: Option<[f32; 3]>,
}

/// The faces of a file, and those of its vertices that sweep the snow.
pub(super) struct Faces {
    vertices: usize,
    triangles: Vec<[u32; 3]>,
    uvs: Option<Uvs>,
    pub used: Used,
}

impl Faces {
    /// Faces and vertices of polygons; indices must be in range.
    pub fn new(polygons: PolygonMesh) -> (Self, Vec<Vec3>) {
        let (mesh, uvs) = polygons.into_textured();
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles);
        let used = Used::of(vertices, &triangles);
        (Self { vertices, triangles, uvs, used }, mesh.positions)
    }

    /// The mesh as it is written.
    pub fn drawn(&self) -> Drawn<'_> {
        Drawn { vertices: self.vertices, triangles: &self.triangles, uvs: self.uvs.as_ref(), parts: None }
    }

    /// Triangles over the vertices that they use.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.used.triangles(&self.triangles)
    }
}

/// The vertices that triangles use: only these are posed.
pub(super) struct Used {
    /// Number of these vertices.
    pub count: usize,
    /// These vertices, and the triangles over them; `None` if triangles use all.
    own: Option<(Vec<u32>, Vec<[u32; 3]>)>,
}

impl Used {
    /// The vertices out of `count` that triangles use.
    pub fn of(count: usize, triangles: &[[u32; 3]]) -> Self {
        let Some(used) = used(count, triangles) else { return Self { count, own: None } };
        let triangles = renumbered(triangles, &used);
        Self { count: used.len(), own: Some((used, triangles)) }
    }

    /// The triangles over these vertices; `all` are those over all vertices.
    pub fn triangles<'a>(&'a self, all: &'a [[u32; 3]]) -> &'a [[u32; 3]] {
        self.own.as_ref().map_or(all, |(_, own)| own)
    }

    /// Keeps only the positions of these vertices.
    pub fn keep(&self, positions: &mut Vec<DVec3>) {
        if let Some((used, _)) = &self.own {
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
