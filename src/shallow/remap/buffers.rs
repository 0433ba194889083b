//! Buffers of a terrain that moves, and the liquid that waits for room.

use super::band::Band;
use super::carry::Carry;
use super::dirty::Dirty;
use super::held::Held;
use super::layout::Layout;
use super::origins::Origins;
use crate::shallow::columns::stacks::Stacks;
use crate::shallow::pipes::finder::Finder;
use crate::shallow::pipes::links::{Ends, Links};
use crate::shallow::terrain::ground::Ground;

/// Buffers and shapes.
#[derive(Debug, Clone, Default)]
pub struct Remap {
    pub(super) dirty: Dirty,
    pub(super) ground: Ground,
    pub(super) band: Band,
    pub(super) layout: Layout,
    pub(super) origins: Origins,
    pub(super) carry: Carry,
    pub(super) stacks: Stacks,
    pub(super) finder: Finder,
    pub(super) ends: Ends,
    /// New links of the rows that change.
    pub(super) links: Links,
    pub(in crate::shallow) held: Held,
}

impl Remap {
    /// With capacity for `parcels` parcels of waiting liquid, besides those of a moving terrain.
    pub fn new(parcels: usize) -> Self {
        let mut remap = Self::default();
        remap.held.reserve(parcels);
        remap
    }
}
