//! Leaves lent by a grid: the same memory, as Rust arrays.

use std::marker::PhantomData;

use super::bridge::ffi::LeafView;
use crate::numeric::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};

/// A read-only leaf, of floats by default.
#[derive(Clone, Copy)]
pub struct Leaf<'a, V = Values> {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    /// The 512 values.
    pub values: &'a V,
    /// Which of them are active.
    pub mask: &'a Mask,
}

/// Values of a leaf of vectors; voxel (x, y, z) lies at `x << 6 | y << 3 | z`.
pub type Vectors = [[f32; 3]; VOXELS];

/// Values of a leaf, in the type of its grid.
///
/// # Safety
/// They must be floats without padding, exactly as many as a leaf of such a grid has.
pub unsafe trait LeafValues: Copy {}
// SAFETY: a leaf of a grid of floats has 512 of them.
unsafe impl LeafValues for Values {}
// SAFETY: a leaf of a grid of vectors has 512 times three floats.
unsafe impl LeafValues for Vectors {}

impl<'a, V: LeafValues> Leaf<'a, V> {
    /// The bytes of its values.
    pub(super) fn value_bytes(&self) -> &'a [u8] {
        // SAFETY: every byte of a float can be read; the array stays borrowed.
        unsafe { std::slice::from_raw_parts(std::ptr::from_ref(self.values).cast(), size_of::<V>()) }
    }

    /// The bytes of its mask.
    pub(super) fn mask_bytes(&self) -> &'a [u8] {
        // SAFETY: every byte of an integer can be read; the array stays borrowed.
        unsafe { std::slice::from_raw_parts(self.mask.as_ptr().cast(), size_of::<Mask>()) }
    }
}

impl Leaf<'_> {
    /// A copy with its own memory.
    pub fn to_block(&self) -> Block {
        Block { origin: self.origin, values: Box::new(*self.values), mask: *self.mask }
    }
}

/// A mutable leaf; no two of them share memory.
pub struct LeafMut<'a> {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    /// The 512 values.
    pub values: &'a mut Values,
    /// Which of them are active.
    pub mask: &'a mut Mask,
}

/// The leaf or tile of a grid at a block position.
#[derive(Clone, Copy)]
pub enum Probe<'a, V = Values, T = f32> {
    /// A leaf.
    Leaf(Leaf<'a, V>),
    /// One value for the whole block.
    Tile {
        /// The value.
        value: T,
        /// Whether it is active.
        active: bool,
    },
}

impl Probe<'_> {
    /// A copy of the block at `origin` with its own memory; a tile becomes an inactive value.
    pub fn to_edit(&self, origin: Origin) -> BlockEdit {
        match self {
            Self::Leaf(leaf) => BlockEdit::Dense(leaf.to_block()),
            Self::Tile { value, .. } => BlockEdit::Constant(origin, *value),
        }
    }
}

/// Lends the leaf that a view points to.
///
/// # Safety
/// The view must come from a grid with such values that is borrowed for `'a` and not changed during it.
pub(super) unsafe fn lend<'a, V: LeafValues>(view: &LeafView, _grid: PhantomData<&'a ()>) -> Leaf<'a, V> {
    Leaf {
        origin: [view.x, view.y, view.z],
        // SAFETY: the caller keeps the grid borrowed; the C++ side asserts the leaf's layout.
        values: unsafe { &*(view.values as *const V) },
        // SAFETY: as above.
        mask: unsafe { &*(view.mask as *const Mask) },
    }
}

/// Lends the leaf that a view points to, mutably.
///
/// # Safety
/// As [`lend`], with the grid borrowed mutably, and each leaf lent once.
pub(super) unsafe fn lend_mut<'a>(view: &LeafView, _grid: PhantomData<&'a mut ()>) -> LeafMut<'a> {
    LeafMut {
        origin: [view.x, view.y, view.z],
        // SAFETY: the caller holds the grid mutably and lends each leaf once.
        values: unsafe { &mut *(view.values as *mut Values) },
        // SAFETY: as above.
        mask: unsafe { &mut *(view.mask as *mut Mask) },
    }
}
