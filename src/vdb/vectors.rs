//! Sparse grids of vectors of three 32-bit floats: velocities, winds, colours. They are read from and written to files and hosts; the
//! level-set tools accept only floats.

use std::marker::PhantomData;

use cxx::UniquePtr;

use super::bridge::ffi;
use super::grid::is_world_fixed;
use super::leaf::{Leaf, Probe, Vectors, lend};
use super::{FloatGrid, GridClass, call, fail};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::numeric::blocks::{Mask, Origin};

/// A read-only leaf of vectors.
pub type VectorLeaf<'a> = Leaf<'a, Vectors>;
/// The leaf or tile of a grid of vectors at a block position.
pub type VectorProbe<'a> = Probe<'a, Vectors, [f32; 3]>;

/// A sparse grid of vectors with a uniform transform; it owns its memory.
pub struct VectorGrid {
    pub(super) inner: UniquePtr<ffi::VectorGrid>,
}

/// The new contents of a block position of a grid of vectors.
pub enum VectorEdit {
    /// Dense values.
    Dense {
        /// Minimum corner, in voxels.
        origin: Origin,
        /// The 512 values.
        values: Box<Vectors>,
        /// Which of them are active.
        mask: Mask,
    },
    /// One inactive value for all 512 voxels.
    Constant(Origin, [f32; 3]),
}

// SAFETY: the C++ grid has no thread affinity, and nobody else holds its tree.
unsafe impl Send for VectorGrid {}
// SAFETY: `&` methods only read the tree; OpenVDB allows any number of readers.
unsafe impl Sync for VectorGrid {}

impl VectorGrid {
    /// An empty grid of cells of `voxel` m whose value is `background` everywhere.
    ///
    /// # Errors
    /// A cell size that no transform can have.
    pub fn new(voxel: f64, background: [f32; 3]) -> Result<Self> {
        Ok(Self { inner: ffi::make_vector_grid(voxel, background).map_err(fail)? })
    }

    /// A copy that shares no memory.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn deep_copy(&self) -> Result<Self> {
        Ok(Self { inner: ffi::copy_vector_grid(&self.inner).map_err(fail)? })
    }

    /// Edge of a cell (m).
    pub fn voxel_size(&self) -> f64 {
        ffi::vector_voxel_size(&self.inner)
    }

    /// Whether voxel (0, 0, 0) is at the origin and the axes are those of the world.
    pub fn is_world_fixed(&self) -> bool {
        is_world_fixed(self.voxel_size(), |index| ffi::vector_index_to_world(&self.inner, index))
    }

    /// Value where nothing is stored.
    pub fn background(&self) -> [f32; 3] {
        ffi::vector_background(&self.inner)
    }

    /// The meaning of the values.
    pub fn class(&self) -> GridClass {
        GridClass::of(ffi::vector_class(&self.inner))
    }

    /// Sets the meaning of the values.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn set_class(&mut self, class: GridClass) -> Result<()> {
        ffi::set_vector_class(self.inner.pin_mut(), class.number()).map_err(fail)
    }

    /// Translates the whole grid (m).
    ///
    /// # Errors
    /// When memory runs out.
    pub fn shift(&mut self, by: DVec3) -> Result<()> {
        ffi::shift_vectors(self.inner.pin_mut(), by.into()).map_err(fail)
    }

    /// The grid's name in a file.
    pub fn name(&self) -> String {
        ffi::vector_name(&self.inner)
    }

    /// Sets the grid's name.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn set_name(&mut self, name: &str) -> Result<()> {
        ffi::set_vector_name(self.inner.pin_mut(), name).map_err(fail)
    }

    /// Number of active voxels, tiles counted in full.
    pub fn active_voxels(&self) -> u64 {
        ffi::vector_active_voxels(&self.inner)
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        ffi::vector_leaf_count(&self.inner)
    }

    /// Memory of the tree (bytes).
    pub fn memory_bytes(&self) -> u64 {
        ffi::vector_memory_bytes(&self.inner)
    }

    /// Upper bound on the bytes of a .vdb file of this grid.
    pub fn file_bound(&self) -> u64 {
        ffi::vector_file_bound(&self.inner)
    }

    /// Minimum and maximum active voxel, both inclusive; none if no voxel is active.
    pub fn active_bbox(&self) -> Option<([i32; 3], [i32; 3])> {
        let (mut low, mut high) = ([0; 3], [0; 3]);
        ffi::vector_active_bbox(&self.inner, &mut low, &mut high).ok()?.then_some((low, high))
    }

    /// Every leaf, in the tree's order; nothing is copied.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn leaves(&self) -> Result<Vec<VectorLeaf<'_>>> {
        let views = ffi::vector_leaves(&self.inner).map_err(fail)?;
        // SAFETY: the views are of this grid of vectors, which stays borrowed.
        Ok(views.iter().map(|view| unsafe { lend(view, PhantomData) }).collect())
    }

    /// The leaf or tile at each of the given block origins (multiples of 8); nothing is copied.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn probe(&self, origins: &[Origin]) -> Result<Vec<VectorProbe<'_>>> {
        let views = ffi::vector_probe(&self.inner, origins.as_flattened()).map_err(fail)?;
        let lent = views.iter().map(|view| match view.is_leaf {
            // SAFETY: the views are of this grid of vectors, which stays borrowed.
            true => Probe::Leaf(unsafe { lend(view, PhantomData) }),
            false => Probe::Tile { value: view.tile, active: view.tile_active },
        });
        Ok(lent.collect())
    }

    /// Replaces leaves or tiles by blocks. All memory for leaves is allocated before the first is replaced.
    ///
    /// # Errors
    /// When memory runs out, or cancel; the grid is then unchanged.
    pub fn replace_blocks(&mut self, ctx: &Context, edits: &[VectorEdit]) -> Result<()> {
        let (mut origins, mut values, mut masks, mut constants) = (vec![], vec![], vec![], vec![]);
        for edit in edits {
            let (origin, value, mask, constant) = match edit {
                VectorEdit::Dense { origin, values, mask } => {
                    (origin, values.as_ptr() as usize, mask.as_ptr() as usize, &[0.0; 3])
                }
                VectorEdit::Constant(origin, constant) => (origin, 0, 0, constant),
            };
            origins.extend(origin);
            values.push(value);
            masks.push(mask);
            constants.extend(constant);
        }
        let (call, _running) = call(ctx);
        let mut blocks =
            ffi::make_vector_blocks(&call, &origins, &values, &masks, &constants).map_err(fail)?;
        ffi::put_vector_blocks(self.inner.pin_mut(), blocks.pin_mut()).map_err(fail)
    }

    /// Values at world positions (m): trilinear between voxel centres, or those of the voxels that contain the positions. Components of a
    /// staggered grid are sampled on the faces of voxels, where they are located.
    ///
    /// # Errors
    /// Cancel.
    pub fn sample(&self, ctx: &Context, world: &[DVec3], linear: bool) -> Result<Vec<[f32; 3]>> {
        let flat: Vec<f64> = world.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        let mut out = vec![[0.0; 3]; world.len()];
        let (call, _running) = call(ctx);
        ffi::sample_vectors(&self.inner, &call, &flat, linear, out.as_flattened_mut()).map_err(fail)?;
        Ok(out)
    }
}

/// A grid of any kind that can be read from files.
pub enum AnyGrid {
    /// Of floats.
    Floats(FloatGrid),
    /// Of vectors.
    Vectors(VectorGrid),
}

/// A grid of any kind, for writing.
#[derive(Clone, Copy)]
pub enum GridRef<'a> {
    /// Of floats.
    Floats(&'a FloatGrid),
    /// Of vectors.
    Vectors(&'a VectorGrid),
}

impl AnyGrid {
    /// The grid, if it is one of floats.
    pub(super) fn floats(self) -> Option<FloatGrid> {
        match self {
            Self::Floats(grid) => Some(grid),
            Self::Vectors(_) => None,
        }
    }

    /// A grid found in a file.
    pub(super) fn of(found: ffi::Found) -> Option<Self> {
        if !found.floats.is_null() {
            return Some(Self::Floats(FloatGrid { inner: found.floats }));
        }
        (!found.vectors.is_null()).then(|| Self::Vectors(VectorGrid { inner: found.vectors }))
    }

    /// A reference to the grid, for writing.
    pub fn borrow(&self) -> GridRef<'_> {
        match self {
            Self::Floats(grid) => GridRef::Floats(grid),
            Self::Vectors(grid) => GridRef::Vectors(grid),
        }
    }

    /// Whether all values in leaves, and the background, are finite.
    ///
    /// # Errors
    /// When memory runs out.
    pub(super) fn is_finite(&self) -> Result<bool> {
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        Ok(match self {
            Self::Floats(grid) => {
                finite(&[grid.background()]) && grid.leaves()?.iter().all(|leaf| finite(leaf.values))
            }
            Self::Vectors(grid) => {
                let leaves = grid.leaves()?;
                finite(&grid.background()) && leaves.iter().all(|leaf| finite(leaf.values.as_flattened()))
            }
        })
    }
}

/// Methods that both kinds of grid have.
macro_rules! of_both {
    ($($(#[$text:meta])* $name:ident -> $type:ty;)*) => {
        $($(#[$text])* pub fn $name(&self) -> $type {
            match self {
                Self::Floats(grid) => grid.$name(),
                Self::Vectors(grid) => grid.$name(),
            }
        })*
    };
}

impl GridRef<'_> {
    of_both! {
        /// Edge of a cell (m).
        voxel_size -> f64;
        /// Whether voxel (0, 0, 0) is at the origin and the axes are those of the world.
        is_world_fixed -> bool;
        /// The meaning of the values.
        class -> GridClass;
        /// The grid's name in a file.
        name -> String;
        /// Number of active voxels, including all those of tiles.
        active_voxels -> u64;
        /// Number of leaves.
        leaf_count -> usize;
        /// Memory of the tree (bytes).
        memory_bytes -> u64;
        /// Upper bound on the bytes of a .vdb file of this grid.
        file_bound -> u64;
        /// Minimum and maximum active voxel, both inclusive; none if no voxel is active.
        active_bbox -> Option<([i32; 3], [i32; 3])>;
    }

    /// A copy that shares no memory.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn deep_copy(&self) -> Result<AnyGrid> {
        Ok(match self {
            Self::Floats(grid) => AnyGrid::Floats(grid.deep_copy()?),
            Self::Vectors(grid) => AnyGrid::Vectors(grid.deep_copy()?),
        })
    }

    /// Its address on the C++ side, and whether it is a vector grid.
    pub(super) fn address(&self) -> (usize, bool) {
        match self {
            Self::Floats(grid) => (std::ptr::from_ref::<ffi::Grid>(&grid.inner) as usize, false),
            Self::Vectors(grid) => (std::ptr::from_ref::<ffi::VectorGrid>(&grid.inner) as usize, true),
        }
    }
}
