//! Arrays of numbers that a mesh carries besides its positions and texture coordinates: colours, masks, whatever its file has.

use super::used;
use crate::geometry::{TriMesh, Uvs};

/// The type of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 8-bit integers.
    I8,
    /// 8-bit integers without a sign.
    U8,
    /// 16-bit integers.
    I16,
    /// 16-bit integers without a sign.
    U16,
    /// 32-bit integers.
    I32,
    /// 32-bit integers without a sign.
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

/// What has one number each.
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
    /// How many numbers an array of a mesh of so many vertices and triangles has.
    pub fn count(self, vertices: usize, faces: usize) -> usize {
        match self {
            Self::Vertices => vertices,
            Self::Corners => 3 * faces,
            Self::Faces => faces,
        }
    }
}

/// An array of numbers; of vectors and colours each component is one.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshArray {
    /// Name, as in the file.
    pub name: String,
    /// What has one number each.
    pub on: On,
    /// Type of the numbers in the file.
    pub number: Number,
    /// The numbers: 64 bits hold those of every type.
    pub values: Vec<f64>,
}

/// A mesh in triangles with all that it carries.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DetailedMesh {
    /// Positions (m) and triangles.
    pub mesh: TriMesh,
    /// Texture coordinates.
    pub uvs: Option<Uvs>,
    /// Other arrays; of corners three for each triangle.
    pub arrays: Vec<MeshArray>,
}

impl DetailedMesh {
    /// A mesh without vertices and faces that carries arrays of the same names.
    pub fn emptied(&self) -> Self {
        let uvs = self.uvs.as_ref().map(|uvs| Uvs {
            positions: Vec::new(),
            corners: uvs.corners.as_ref().map(|_| Vec::new()),
            missing: 0,
        });
        let arrays = self.arrays.iter().map(|array| {
            let (name, on, number) = (array.name.clone(), array.on, array.number);
            MeshArray { name, on, number, values: Vec::new() }
        });
        Self { mesh: TriMesh::default(), uvs, arrays: arrays.collect() }
    }

    /// The mesh without the vertices that no triangle names, and without their numbers; the others keep their order.
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
            None => {
                Uvs { positions: used.iter().map(|&vertex| uvs.positions[vertex as usize]).collect(), ..uvs }
            }
        });
        let arrays = self.arrays.into_iter().map(kept).collect();
        Self { mesh: self.mesh.without_unused(), uvs, arrays }
    }

    /// The numbers of the vertices in an array of this name; of one of vectors with parts NAMEx, NAMEy and NAMEz their lengths.
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
    /// The same for triangles: `corners` are theirs among those of the faces, `faces` the faces that they are of.
    pub(in crate::geometry) fn of_triangles(self, corners: &[[usize; 3]], faces: &[usize]) -> Self {
        let values = match self.on {
            On::Vertices => self.values,
            On::Corners => corners.as_flattened().iter().map(|&corner| self.values[corner]).collect(),
            On::Faces => faces.iter().map(|&face| self.values[face]).collect(),
        };
        Self { values, ..self }
    }
}
