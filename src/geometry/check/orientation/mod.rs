//! Turns closed parts of a mesh outward, in the same way for everything that takes meshes.
//!
//! A part is a set of triangles that edges connect, with vertices at the same position joined. Parts that are closed by their indices
//! remain separate parts, whatever they touch. Doubled triangles count once. Triangles of a closed part that disagree on which side is out
//! are made to agree. Closed parts whose outermost corners lie in no other part are turned outward, so that cavities stay cavities; a solid
//! with cavities whose whole surface is inside out is turned together with them. A correct mesh is unchanged. Open sheets are unchanged
//! too: which side is out is decided where they are used.

mod nesting;
mod outcome;
mod pieces;

use super::edges::{edge_uses, imbalance, is_same_edge, parts_of};
use super::topology::collapsed;
use crate::geometry::mesh::weld::Weld;
use crate::geometry::{DVec3, DetailedMesh, TriMesh};
use outcome::Fate;
pub use outcome::{Closing, Doubts, Orientation};
use pieces::Pieces;

impl Orientation {
    /// The orientation of triangles over vertices at positions (m), which must be finite; `same` names the vertex that each one is joined
    /// with: itself if no earlier one is the same.
    pub fn of(positions: &[DVec3], triangles: &[[u32; 3]], same: &[u32], closing: Closing) -> Self {
        let joined = triangles.iter().map(|corners| corners.map(|vertex| same[vertex as usize]));
        let (named, numbers): (Vec<[u32; 3]>, Vec<u32>) =
            joined.zip(0u32..).filter(|(corners, _)| !collapsed(*corners)).unzip();
        let uses = edge_uses(positions.len(), &named);
        let is_regular = uses.chunk_by(is_same_edge).all(|run| match run {
            [_] => true,
            [_, _] => imbalance(&named, run) == 0,
            _ => false,
        });
        let mut out = Self::default();
        let mut pieces = Pieces::new(positions, named, numbers);
        if is_regular {
            pieces.set_parts(parts_of(pieces.count(), &uses), &uses);
        } else {
            out.fates = vec![Fate::Stays; triangles.len()];
            pieces.find_parts(triangles, closing, &mut out);
        }
        pieces.turn_outward(closing, triangles.len(), &mut out);
        if out.fates.iter().all(|fate| *fate == Fate::Stays) {
            out.fates.clear();
        }
        out
    }

    /// As [`Orientation::of`], for a mesh as it was read: vertices that are one corner ([`Weld`]) are joined.
    pub fn of_mesh(mesh: &TriMesh, closing: Closing) -> Self {
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
        let corners = Weld::of(&positions, &mesh.triangles).firsts;
        Self::of(&positions, &mesh.triangles, &corners, closing)
    }

    /// Whether all triangles stay as they are.
    pub fn is_unchanged(&self) -> bool {
        self.fates.is_empty()
    }

    /// Whether any triangle is left out as a duplicate.
    pub fn leaves_out(&self) -> bool {
        self.fates.contains(&Fate::LeftOut)
    }

    /// Whether a triangle is flipped.
    pub fn is_turned(&self, triangle: usize) -> bool {
        self.fates.get(triangle) == Some(&Fate::Turned)
    }

    /// Whether a triangle belongs to an open part.
    pub fn is_open(&self, triangle: usize) -> bool {
        self.open.get(triangle) == Some(&true)
    }

    /// Whether there is an open part.
    pub fn has_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Signed volume of the closed parts (m3), before and after they were turned.
    pub fn volumes(&self) -> [f64; 2] {
        self.volumes
    }

    /// Flips all triangles of open parts.
    pub fn turn_open(&mut self) {
        if self.fates.is_empty() {
            self.fates = vec![Fate::Stays; self.open.len()];
        }
        for (fate, _) in self.fates.iter_mut().zip(&self.open).filter(|(_, is_open)| **is_open) {
            *fate = match fate {
                Fate::Stays => Fate::Turned,
                Fate::Turned => Fate::Stays,
                Fate::LeftOut => Fate::LeftOut,
            };
        }
    }

    /// The corrected triangles; a flipped triangle keeps its first corner.
    pub fn applied(&self, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        if self.fates.is_empty() {
            return triangles.to_vec();
        }
        let with_fate = triangles.iter().zip(&self.fates).filter(|(_, fate)| **fate != Fate::LeftOut);
        with_fate
            .map(|(&[a, b, c], fate)| if *fate == Fate::Turned { [a, c, b] } else { [a, b, c] })
            .collect()
    }

    /// Whether it can belong to a mesh with this number of triangles.
    pub fn fits(&self, triangles: usize) -> bool {
        self.fates.is_empty() || self.fates.len() == triangles
    }

    /// A mesh with its triangles, and the data of their corners, corrected.
    pub fn applied_to_detailed(&self, mesh: DetailedMesh) -> DetailedMesh {
        if self.fates.is_empty() {
            return mesh;
        }
        let faces: Vec<usize> = (0..self.fates.len()).filter(|at| self.fates[*at] != Fate::LeftOut).collect();
        let of_face = |face: &usize| {
            let [a, b, c] = [0, 1, 2].map(|corner| 3 * face + corner);
            if self.is_turned(*face) { [a, c, b] } else { [a, b, c] }
        };
        let corners: Vec<[usize; 3]> = faces.iter().map(of_face).collect();
        DetailedMesh {
            mesh: self.applied_to(mesh.mesh),
            uvs: mesh.uvs.map(|uvs| uvs.of_triangles(&corners)),
            arrays: mesh.arrays.into_iter().map(|array| array.of_triangles(&corners, &faces)).collect(),
        }
    }

    /// The mesh with its triangles corrected.
    pub fn applied_to(&self, mut mesh: TriMesh) -> TriMesh {
        if !self.fates.is_empty() {
            mesh.triangles = self.applied(&mesh.triangles);
        }
        mesh
    }

    /// What remains ambiguous, in a sentence without the mesh's name; `None` if nothing does.
    pub fn warning(&self) -> Option<String> {
        self.doubts.described()
    }
}

impl Doubts {
    fn described(&self) -> Option<String> {
        let counted = |count: usize, one: &str, several: &str| {
            (count > 0).then(|| if count == 1 { format!("1 {one}") } else { format!("{count} {several}") })
        };
        let what: Vec<String> = [
            counted(
                self.one_sided,
                "part has one side only (inconsistently oriented edges)",
                "parts have one side only (inconsistently oriented edges)",
            ),
            counted(
                self.non_manifold_edges,
                "non-manifold edge has more than two triangles that do not agree",
                "non-manifold edges have more than two triangles that do not agree",
            ),
            counted(
                self.nested,
                "part is inside out and so are parts within it, which are taken for cavities",
                "parts are inside out and so are parts within them, which are taken for cavities",
            ),
        ]
        .into_iter()
        .flatten()
        .collect();
        (!what.is_empty()).then(|| {
            format!(
                "which side is out cannot be decided everywhere: {}; `frazil mesh check` lists the faults, `frazil mesh repair` mends them",
                what.join(", ")
            )
        })
    }
}
