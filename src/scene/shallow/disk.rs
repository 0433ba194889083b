//! How much space the files of a liquid on a terrain need at most: when all of it is wet.

use super::Files;

/// Bytes of a 32-bit float in a text, with what stands around it, and of an index.
const TEXT: u64 = 12;
const INDEX: u64 = 8;
/// Bytes of a column in the exact state, before it is packed.
const STATE: u64 = 20;
/// Bytes of a voxel of a leaf, of which there are some two for each column.
const VOXEL: u64 = 2 * 4;
/// Bytes of a frame's report and record.
const RECORDS: u64 = 3000;

/// Bytes of a frame's files at most, with this many columns.
pub(super) fn frame(output: Files, columns: u64) -> u64 {
    let if_asked = |is_asked: bool, bytes: u64| if is_asked { bytes } else { 0 };
    let arrays = if_asked(output.depth, 4) + if_asked(output.alpha, 4) + if_asked(output.layer, 2);
    let vertex = 12 + if_asked(output.velocities, 12) + arrays;
    // Two triangles a vertex, each with a byte that counts.
    let ply = vertex + 2 * 13;
    let numbers = 6 + u64::from(output.depth) + u64::from(output.alpha) + u64::from(output.layer);
    let usd = TEXT * numbers + 2 * 3 * INDEX + 2 * 3;
    let each = if_asked(output.ply, ply) + if_asked(output.usd, usd) + if_asked(output.vdb, VOXEL) + STATE;
    columns * each + RECORDS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{TriMesh, Vec3};
    use crate::io::mesh::{Carried, ply_bytes};
    use crate::scene::shallow::mesh::Drawn;

    #[test]
    fn a_ply_file_is_as_large_as_said_but_for_its_header() {
        let output = Files {
            ply: true,
            usd: false,
            vdb: false,
            velocities: true,
            depth: true,
            layer: true,
            alpha: true,
        };
        let count = 1000;
        let drawn = Drawn {
            mesh: TriMesh { positions: vec![Vec3::zeros(); count], triangles: vec![[0, 1, 2]; 2 * count] },
            velocities: vec![Vec3::zeros(); count],
            depths: vec![0.0; count],
            alpha: vec![0.0; count],
            layers: vec![0; count],
        };
        let arrays = drawn.arrays(output);
        let carried =
            Carried { velocities: &drawn.velocities, uvs: None, arrays: &arrays.iter().collect::<Vec<_>>() };
        let bytes = ply_bytes(&drawn.mesh, &carried).len() as u64;
        let said = frame(output, count as u64) - STATE * count as u64 - RECORDS;
        assert!(bytes > said && bytes < said + 500, "{bytes} bytes, {said} said");
    }
}
