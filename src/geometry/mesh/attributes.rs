//! Arrays of numbers that a mesh carries besides its positions and texture coordinates: colours, masks and whatever else its file
//! holds.

use super::used;
use crate::geometry::{TriMesh, Uvs};

/// The type of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 8-bit integers.
    I8,
    /// Unsigned 8-bit integers.
    U8,
    /// 16-bit integers.
    I16,
    /// Unsigned 16-bit integers.
    U16,
    /// 32-bit integers.
    I32,
    /// Unsigned 32-bit integers.
    U32,
    /// 32-bit floats.
    F32,
    /// 64-bit floats.
    F64,
}

impl Number {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Whether its numbers are floats.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

/// The elements that an array has numbers for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum On {
    /// Every vertex.
    Vertices,
    /// Every corner of a face: an array with seams.
    Corners,
    /// Every face.
    Faces,
}

impl On {
    /// Length of an array of a mesh with these numbers of vertices and triangles.
    pub fn count(self, vertices: usize, faces: usize) -> usize {
        match self {
            Self::Vertices => vertices,
            Self::Corners => 3 * faces,
            Self::Faces => faces,
        }
    }
}

/// An array of numbers; each component of a vector or colour is an array of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshArray {
    /// Name, as in the file.
    pub name: String,
    /// The elements that it has numbers for.
    pub on: On,
    /// Type of the numbers in the file.
    pub number: Number,
    /// The numbers: 64 bits hold every type.
    pub values: Vec<f64>,
}

/// A triangle mesh with everything that it carries.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DetailedMesh {
    /// Positions (m) and triangles.
    pub mesh: TriMesh,
    /// Texture coordinates.
    pub uvs: Option<Uvs>,
    /// Other arrays; those of corners have three numbers for each triangle.
    pub arrays: Vec<MeshArray>,
}

impl DetailedMesh {
    /// A mesh without vertices or faces, but with arrays of the same names.
    pub fn emptied(&self) -> Self {
        let uvs = self.uvs.as_ref().map(|uvs| Uvs {
            coordinates: Vec::new(),
            corners: uvs.corners.as_ref().map(|_| Vec::new()),
            missing: 0,
        });
        let arrays = self.arrays.iter().map(|array| array.with(Vec::new()));
        Self { mesh: TriMesh::default(), uvs, arrays: arrays.collect() }
    }

    /// The mesh without the vertices that no triangle uses, and without their numbers; the others keep their order.
    pub fn without_unused(self) -> Self {
        let Some(used) = used(self.mesh.positions.len(), &self.mesh.triangles) else { return self };
        let kept = |array: MeshArray| match array.on {
            On::Vertices => {
                let values = used.iter().map(|&vertex| array.values[vertex as usize]).collect();
                MeshArray { values, ..array }
            }
            On::Corners | On::Faces => array,
        };
        let uvs = self.uvs.map(|uvs| match uvs.corners {
            Some(_) => uvs,
            None => Uvs {
                coordinates: used.iter().map(|&vertex| uvs.coordinates[vertex as usize]).collect(),
                ..uvs
            },
        });
        let arrays = self.arrays.into_iter().map(kept).collect();
        Self { mesh: self.mesh.without_unused(), uvs, arrays }
    }

    /// The per-vertex values of the array with this name; for a vector with the components NAMEx, NAMEy and NAMEz, its lengths.
    pub fn of_vertices(&self, name: &str) -> Option<Vec<f64>> {
        let find = |name: &str| {
            self.arrays
                .iter()
                .find(|array| array.on == On::Vertices && array.name == name)
                .map(|array| &array.values)
        };
        if let Some(values) = find(name) {
            return Some(values.clone());
        }
        let [x, y, z] = ["x", "y", "z"].map(|axis| find(&format!("{name}{axis}")));
        let parts = x?.iter().zip(y?).zip(z?);
        Some(parts.map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect())
    }
}

impl MeshArray {
    /// The same array with other numbers.
    pub fn with(&self, values: Vec<f64>) -> Self {
        Self { name: self.name.clone(), on: self.on, number: self.number, values }
    }

    /// Converts an array of a polygon mesh to one of triangles made from its polygons: for each triangle, `corners` holds the indices of
    /// its corners among the polygons' corners, and `faces` its polygon.
    pub(in crate::geometry) fn of_triangles(self, corners: &[[usize; 3]], faces: &[usize]) -> Self {
        let values = match self.on {
            On::Vertices => self.values,
            On::Corners => corners.as_flattened().iter().map(|&corner| self.values[corner]).collect(),
            On::Faces => faces.iter().map(|&face| self.values[face]).collect(),
        };
        Self { values, ..self }
    }
}
