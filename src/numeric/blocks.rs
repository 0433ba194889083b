//! Blocks of 8 x 8 x 8 voxels: OpenVDB's leaf layout, so that a block and a leaf are the same bytes.

/// Voxels along a block's edge.
pub const DIM: usize = 8;
/// Voxels in a block.
pub const VOXELS: usize = DIM * DIM * DIM;

/// Voxel coordinates of a block's minimum corner: a multiple of 8 on each axis.
pub type Origin = [i32; 3];
/// Values of a block; voxel (x, y, z) lies at `x << 6 | y << 3 | z`.
pub type Values = [f32; VOXELS];
/// Active voxels of a block: bit `y << 3 | z` of word `x`.
pub type Mask = [u64; DIM];

/// Offset of voxel (x, y, z), each in 0..8, inside a block.
#[inline]
pub const fn offset(x: usize, y: usize, z: usize) -> usize {
    x << 6 | y << 3 | z
}

/// Origin of the block that contains a voxel.
#[inline]
pub const fn origin_of(voxel: [i32; 3]) -> Origin {
    [voxel[0] & !7, voxel[1] & !7, voxel[2] & !7]
}

/// A block of values with its own memory.
#[derive(Clone, PartialEq)]
pub struct Block {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    /// The 512 values.
    pub values: Box<Values>,
    /// Which of them are active.
    pub mask: Mask,
}

impl Block {
    /// A block of a level set, from distances (m) clamped to `background`: the voxels nearer than that are active.
    pub fn of_band(origin: Origin, values: Box<Values>, background: f32) -> Self {
        let mut mask = [0; DIM];
        for (index, value) in values.iter().enumerate() {
            mask[index >> 6] |= u64::from(value.abs() < background) << (index & 63);
        }
        Self { origin, values, mask }
    }

    /// As [`Block::of_band`], from distances in cells of `cell` m.
    pub fn of_cells(origin: Origin, mut cells: Box<Values>, cell: f32, background: f32) -> Self {
        cells.iter_mut().for_each(|value| *value = (*value * cell).clamp(-background, background));
        Self::of_band(origin, cells, background)
    }
}

/// New contents of a grid at the position of a block: dense values, or one value for all 512 voxels.
#[derive(Clone, PartialEq)]
pub enum BlockEdit {
    /// Dense values.
    Dense(Block),
    /// One inactive value: the inside or the outside of a level set.
    Constant(Origin, f32),
}

impl BlockEdit {
    /// Minimum corner, in voxels.
    pub fn origin(&self) -> Origin {
        match self {
            Self::Dense(block) => block.origin,
            Self::Constant(origin, _) => *origin,
        }
    }
}
