//! Solids in the flow: how much of each face is open, and how fast the covered part moves.

use super::tiles::{NONE, Tile, Tiles};

/// Faces of a tile that touches solids.
#[derive(Debug, Clone)]
pub struct Faces {
    /// Open fraction (0..=1) of the lower faces of each cell, on each axis.
    pub open: [Tile; 3],
    /// Speed (m/s), along the axis, of the solid that covers the rest of the face.
    pub speed: [Tile; 3],
}

impl Faces {
    /// Uncovered faces.
    pub fn open() -> Self {
        Self { open: [[1.0; 512]; 3], speed: [[0.0; 512]; 3] }
    }
}

/// Open fractions and speeds for tiles near solids; all faces of other tiles are open.
#[derive(Debug, Clone, Default)]
pub struct Solids {
    slots: Vec<u32>,
    faces: Vec<Faces>,
}

impl Solids {
    /// No solids.
    pub fn none(tiles: &Tiles) -> Self {
        Self { slots: vec![NONE; tiles.count()], faces: Vec::new() }
    }

    /// The faces of some tiles (slots of the active tiles and of the rim).
    pub fn new(tiles: &Tiles, faces: Vec<(u32, Faces)>) -> Self {
        let mut solids = Self::none(tiles);
        for (slot, faces) in faces {
            solids.slots[slot as usize] = solids.faces.len() as u32;
            solids.faces.push(faces);
        }
        solids
    }

    /// The faces of a tile; none: all are open.
    pub fn faces(&self, slot: usize) -> Option<&Faces> {
        self.faces.get(*self.slots.get(slot)? as usize)
    }

    /// Largest speed (m/s) of a covered face on any axis.
    pub fn fastest(&self) -> f32 {
        let covered = self.faces.iter().flat_map(|faces| {
            let pairs = faces.open.iter().flatten().zip(faces.speed.iter().flatten());
            pairs.filter(|(open, _)| **open < 1.0)
        });
        covered.fold(0.0, |max, (_, speed)| super::window::max(max, speed.abs()))
    }

    /// Whether there are no solids.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }
}
