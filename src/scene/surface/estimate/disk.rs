//! Estimates the disk space of a mesh that follows a liquid.

use crate::geometry::mesh::attributes::On;
use crate::geometry::{DetailedMesh, MeshArray};
use crate::scene::surface::Files;

/// Bytes of a 32-bit float in text, with its separators.
const TEXT: u64 = 12;
/// Bytes of an index in text besides its digits.
const INDEX_OVERHEAD: u64 = 2;
/// Bytes of a vertex in a USD file: position, velocity and normal; and of an index, packed.
const USD_PER_VERTEX: u64 = 3 * 12;
const USD_PER_INDEX: u64 = 2;
/// Bytes of a vertex in the exact state: its position in 64 bits, the distance that it keeps, its flag. Positions hardly compress.
const STATE_PER_VERTEX: u64 = 3 * 8 + 4 + 1;
/// Additional bytes of a vertex if the mesh is rebuilt: its displacement since a reference.
const DISPLACEMENT_PER_VERTEX: u64 = 3 * 4;
/// Bytes of a frame's report and record; parts that the mesh does not cover, of which up to a hundred are listed, add to that.
const RECORDS: u64 = 6000;

/// Bytes of a frame's files; 0: not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::scene::surface) struct FrameSize {
    ply: u64,
    obj: u64,
    usd: u64,
    /// The exact state, stored for every frame.
    state: u64,
}

impl FrameSize {
    /// Estimates the files of a mesh with its data; `is_rebuilt`: whether it may be rebuilt.
    pub fn of(output: Files, is_rebuilt: bool, detail: &DetailedMesh) -> Self {
        let [vertices, triangles] = counts(detail);
        let (coordinates, corners) = detail.uvs.as_ref().map_or((0, 0), |uvs| {
            (uvs.coordinates.len() as u64, uvs.corners.as_ref().map_or(0, |corners| corners.len() as u64))
        });
        let index = u64::from(vertices.max(coordinates).max(1).ilog10()) + 1 + INDEX_OVERHEAD;
        // In .obj files every corner has an index of its texture coordinates, if there are any.
        let indices = if coordinates > 0 { 6 * triangles } else { 3 * triangles };
        let obj = TEXT * (3 * vertices + 2 * coordinates) + index * indices;
        let array_bytes: usize =
            detail.arrays.iter().map(|array| array.values.len() * array.number.size().max(4)).sum();
        let if_written = |is_written: bool, bytes: u64| if is_written { bytes } else { 0 };
        let delta = if_written(output.delta, vertices);
        // Flags pack to next to nothing.
        let usd = USD_PER_VERTEX * vertices
            + 4 * (2 * coordinates + delta)
            + USD_PER_INDEX * (3 * triangles + corners)
            + array_bytes as u64;
        Self {
            ply: if_written(output.ply, ply(output, detail)),
            obj: if_written(output.obj, obj),
            usd: if_written(output.usd, usd),
            state: (STATE_PER_VERTEX + if_written(is_rebuilt, DISPLACEMENT_PER_VERTEX)) * vertices,
        }
    }

    /// Bytes of the largest file except the state. Files are written one after the other, so only one is in memory.
    pub fn largest(&self) -> u64 {
        self.ply.max(self.obj).max(self.usd)
    }

    /// Bytes of all, with report and record.
    pub fn sum(&self) -> u64 {
        self.ply + self.obj + self.usd + self.state + RECORDS
    }
}

/// Counts of vertices and triangles.
fn counts(detail: &DetailedMesh) -> [u64; 2] {
    [detail.mesh.positions.len(), detail.mesh.triangles.len()].map(|count| count as u64)
}

/// Bytes of a .ply file, which is binary, without its header.
fn ply(output: Files, detail: &DetailedMesh) -> u64 {
    let [vertices, triangles] = counts(detail);
    let attributes =
        12 * u64::from(output.velocities) + 4 * u64::from(output.delta) + u64::from(output.flagged);
    let face_attributes = u64::from(output.rebuilt);
    // Lists begin with a byte for their length: three indices, and with seams the six coordinates of corners.
    let uvs = detail.uvs.as_ref().map_or(0, |uvs| match uvs.corners {
        Some(_) => (1 + 6 * 4) * triangles,
        None => 2 * 4 * vertices,
    });
    let array_bytes = |array: &MeshArray| {
        let lists = if array.on == On::Corners { triangles } else { 0 };
        (array.values.len() * array.number.size()) as u64 + lists
    };
    let arrays: u64 = detail.arrays.iter().map(array_bytes).sum();
    (3 * 4 + attributes) * vertices + (1 + 3 * 4 + face_attributes) * triangles + uvs + arrays
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{TriMesh, Uvs, Vec3};
    use crate::io::mesh::{Carried, ply_bytes};

    #[test]
    fn a_ply_file_has_the_estimated_size_besides_its_header() {
        let mesh = TriMesh {
            positions: (0..4).map(|n| Vec3::repeat(n as f32)).collect(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let uvs = Uvs { coordinates: vec![[0.5; 2]; 6], corners: Some((0..6).collect()), missing: 0 };
        let array = |name: &str, on, count: usize| MeshArray {
            name: name.into(),
            on,
            number: crate::geometry::mesh::attributes::Number::F64,
            values: vec![1.0; count],
        };
        let arrays =
            vec![array("mask", On::Vertices, 4), array("part", On::Faces, 2), array("wet", On::Corners, 6)];
        let detail = DetailedMesh { mesh, uvs: Some(uvs), arrays };
        let plain = Files {
            ply: true,
            obj: false,
            usd: false,
            velocities: false,
            delta: false,
            flagged: false,
            rebuilt: false,
        };
        let arrays: Vec<&MeshArray> = detail.arrays.iter().collect();
        let carried = Carried { velocities: &[], uvs: detail.uvs.as_ref(), arrays: &arrays };
        let bytes = ply_bytes(&detail.mesh, &carried);
        let end = b"end_header\n";
        let header = bytes.windows(end.len()).position(|part| part == end).unwrap() + end.len();
        assert_eq!(FrameSize::of(plain, true, &detail).ply, (bytes.len() - header) as u64);
        let moving = Files { velocities: true, delta: true, flagged: true, rebuilt: true, ..plain };
        let more = 4 * (12 + 4 + 1) + 2;
        assert_eq!(FrameSize::of(moving, true, &detail).ply, (bytes.len() - header) as u64 + more);
    }
}
