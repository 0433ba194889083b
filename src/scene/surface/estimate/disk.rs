//! Estimates the disk space of a mesh that follows a liquid.

use crate::geometry::mesh::attributes::On;
use crate::geometry::{DetailedMesh, MeshArray};
use crate::scene::surface::Files;

/// Bytes of a 32-bit float in text, with its separators.
const TEXT: u64 = 12;
/// Bytes around an index in text.
const AROUND_INDEX: u64 = 2;
/// Bytes of a vertex in the exact state: its position in 64 bits, the distance that it keeps, its flag. Positions hardly compress.
const STATE_PER_VERTEX: u64 = 3 * 8 + 4 + 1;
/// Additional bytes if the mesh is rebuilt: its displacement since a reference.
const DRIFT_PER_VERTEX: u64 = 3 * 4;
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
    /// Estimates the files of a mesh, which is rebuilt or not.
    pub fn of(output: Files, is_rebuilt: bool, detail: &DetailedMesh) -> Self {
        let [vertices, triangles] = counts(detail);
        let (positions, corners) = detail.uvs.as_ref().map_or((0, 0), |uvs| {
            (uvs.coordinates.len() as u64, uvs.corners.as_ref().map_or(0, |corners| corners.len() as u64))
        });
        let index = u64::from(vertices.max(positions).max(1).ilog10()) + 1 + AROUND_INDEX;
        // In .obj files every corner has an index of its texture coordinates, if there are any.
        let named = if positions > 0 { 6 * triangles } else { 3 * triangles };
        let obj = TEXT * (3 * vertices + 2 * positions) + index * named;
        // Positions, velocities and arrays; each face also has its count of corners.
        let own: usize = detail.arrays.iter().map(|array| array.values.len()).sum();
        let if_asked = |is_asked: bool, bytes: u64| if is_asked { bytes } else { 0 };
        let delta = if_asked(output.delta, vertices);
        let flagged = if_asked(output.flagged, vertices);
        let rebuilt = if_asked(output.rebuilt, triangles);
        let usd = TEXT * (6 * vertices + 2 * positions + own as u64 + delta)
            + index * (3 * triangles + corners)
            + (1 + AROUND_INDEX) * (triangles + flagged + rebuilt);
        Self {
            ply: if_asked(output.ply, ply(output, detail)),
            obj: if_asked(output.obj, obj),
            usd: if_asked(output.usd, usd),
            state: (STATE_PER_VERTEX + if_asked(is_rebuilt, DRIFT_PER_VERTEX)) * vertices,
        }
    }

    /// Bytes of the largest file except the state: they are written one after the other.
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
    let of_face = u64::from(output.rebuilt);
    // Lists begin with a byte for their length: three indices, and with seams the six coordinates of corners.
    let uvs = detail.uvs.as_ref().map_or(0, |uvs| match uvs.corners {
        Some(_) => (1 + 6 * 4) * triangles,
        None => 2 * 4 * vertices,
    });
    let own = |array: &MeshArray| {
        let lists = if array.on == On::Corners { triangles } else { 0 };
        (array.values.len() * array.number.size()) as u64 + lists
    };
    let own: u64 = detail.arrays.iter().map(own).sum();
    (3 * 4 + attributes) * vertices + (1 + 3 * 4 + of_face) * triangles + uvs + own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{TriMesh, Uvs, Vec3};
    use crate::io::mesh::{Carried, ply_bytes};

    #[test]
    fn a_ply_file_is_as_large_as_said_but_for_its_header() {
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
