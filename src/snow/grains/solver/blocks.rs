//! Blocks of 8 x 8 x 8 diameters, in which grains are sorted.

use crate::snow::grains::colliders::touch::Touch;

/// Edge of a block (diameters). At least twice the reach of a contact.
pub const EDGE: f32 = 8.0;

/// Count of cells along a block's edge; a cell is wider than the reach of a contact.
pub const CELLS: usize = 6;

/// Count of cells of a block.
pub const ALL_CELLS: usize = CELLS * CELLS * CELLS;

/// Sentinel: no index.
pub const NONE: u32 = u32::MAX;

/// Index of a block along each axis.
pub type BlockIndex = [i32; 3];

/// The block of a grain.
#[derive(Clone, Copy)]
pub struct Home {
    /// Index of the block; [`NONE`] if the grain has left the range of blocks.
    pub block: u32,
    /// Index among the block's members.
    pub rank: u32,
}

/// A block of grains and their state in a step.
pub struct Block {
    /// Its index.
    pub at: BlockIndex,
    /// The blocks around it, and itself in the middle, ordered by x, y, z; [`NONE`] where there is none.
    pub near: [u32; 27],
    /// Slots of its grains, sorted by cell, within a cell by identity.
    pub members: Vec<u32>,
    /// Index of the first member of each cell (ordered by y, x, z), then the count of members.
    pub starts: [u32; ALL_CELLS + 1],
    /// Anchors of the members (diameters), by axis; padded with infinity.
    pub anchors: [Vec<f32>; 3],
    /// Maximum gap (diameters) between the anchors of two members that form a pair.
    pub skin: f32,
    /// Touches of members, sorted by slot and collider.
    pub touches: Vec<Touch>,
    /// Distance (diameters) that meshes may travel from the start of the step before one can touch a member.
    pub travel_limit: f32,
    /// Whether a member is awake.
    pub is_awake: bool,
    /// Whether contacts of its members can matter: it or a neighbour is awake.
    pub is_reached: bool,
    /// Whether a member is so far from its anchor that pairs must be found again.
    pub has_strayed: bool,
    /// Whether its members or anchors changed in this sub-step.
    pub is_changed: bool,
    /// Whether they have changed since the start of the step.
    pub has_ever_changed: bool,
    /// Whether its touches are out of date.
    pub lacks_touches: bool,
    /// Whether its touches are to be found again in this sub-step.
    pub is_due: bool,
    /// Whether its pairs are out of date.
    pub lacks_pairs: bool,
    /// Whether its pairs were found in this step.
    pub has_found_pairs: bool,
}
