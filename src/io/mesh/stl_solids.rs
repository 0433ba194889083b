//! Solids of an .stl file, joined to one mesh.

use std::collections::HashMap;

use crate::geometry::{PolygonMesh, Vec3};

/// Bytes of a binary file before its triangles.
pub(in crate::io) const HEADER: usize = 84;

/// A mesh whose corners are joined if they have the same position.
#[derive(Default)]
pub(in crate::io) struct Joined {
    pub mesh: PolygonMesh,
    pub known: HashMap<[u32; 3], u32>,
}

impl Joined {
    /// The vertex at a position.
    pub fn corner(&mut self, position: [f32; 3]) -> u32 {
        // Adding zero turns -0 into 0.
        let position = position.map(|value| value + 0.0);
        let positions = &mut self.mesh.positions;
        *self.known.entry(position.map(f32::to_bits)).or_insert_with(|| {
            positions.push(Vec3::from(position));
            positions.len() as u32 - 1
        })
    }
}
