//! Sparse grids of 32-bit floats.

use std::marker::PhantomData;

use cxx::UniquePtr;

use super::bridge::ffi;
use super::leaf::{Leaf, LeafMut, Probe, lend, lend_mut};
use super::{call, fail, uncancellable_call};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{BlockEdit, Origin};

/// The meaning of a grid's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GridClass {
    /// Not specified.
    Unknown,
    /// Signed distances (m), negative inside.
    LevelSet,
    /// A density.
    Fog,
    /// Vectors whose components are located at the centres of voxel faces.
    Staggered,
}

impl GridClass {
    /// The class with OpenVDB's number.
    pub(super) fn of(number: i32) -> Self {
        match number {
            1 => Self::LevelSet,
            2 => Self::Fog,
            3 => Self::Staggered,
            _ => Self::Unknown,
        }
    }

    /// OpenVDB's number.
    pub(super) fn number(self) -> i32 {
        match self {
            Self::Unknown => 0,
            Self::LevelSet => 1,
            Self::Fog => 2,
            Self::Staggered => 3,
        }
    }
}

/// A metadata value.
#[derive(Debug, Clone, PartialEq)]
pub enum MetaValue {
    /// Text.
    Text(String),
    /// A 32-bit float.
    Float(f32),
    /// A 64-bit float.
    Double(f64),
    /// An integer.
    Int(i64),
    /// A boolean.
    Bool(bool),
    /// Another type, as text; it can be read but not set.
    Other(String, String),
}

/// A sparse grid of floats with a uniform transform; it owns its memory.
pub struct FloatGrid {
    pub(super) inner: UniquePtr<ffi::Grid>,
}

/// Voxels along the edge of a tile, by its level in the tree.
const EDGES: [i32; 4] = [1, 8, 128, 4096];

/// One value for a cube of voxels, of a leaf's size or larger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    /// Voxels along an edge: 8, 128 or 4096.
    pub edge: i32,
    /// The value.
    pub value: f32,
    /// Whether it is active.
    pub active: bool,
}

/// Blocks copied into leaves, ready to be put into a grid without further allocation of leaves.
pub struct PreparedBlocks(UniquePtr<ffi::Blocks>);

impl PreparedBlocks {
    /// Copies blocks into leaves.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn new(ctx: &Context, edits: &[BlockEdit]) -> Result<Self> {
        let origins: Vec<Origin> = edits.iter().map(BlockEdit::origin).collect();
        let parts = edits.iter().map(|edit| match edit {
            BlockEdit::Dense(block) => (block.values.as_ptr() as usize, block.mask.as_ptr() as usize, 0.0),
            BlockEdit::Constant(_, constant) => (0, 0, *constant),
        });
        let (mut values, mut masks, mut constants) = (Vec::new(), Vec::new(), Vec::new());
        for (value, mask, constant) in parts {
            values.push(value);
            masks.push(mask);
            constants.push(constant);
        }
        let (mut call, _running) = call(ctx);
        // The commit of an edit cannot be cancelled.
        call.cancel = 0;
        let blocks = ffi::make_blocks(&call, origins.as_flattened(), &values, &masks, &constants);
        Ok(Self(blocks.map_err(fail)?))
    }
}

// SAFETY: the C++ grid has no thread affinity, and nobody else holds its tree.
unsafe impl Send for FloatGrid {}
// SAFETY: `&` methods only read the tree; OpenVDB allows any number of readers.
unsafe impl Sync for FloatGrid {}

impl FloatGrid {
    /// An empty grid of cells of `voxel` m whose value is `background` everywhere.
    ///
    /// # Errors
    /// What OpenVDB reports, for instance a cell size of 0.
    pub fn new(voxel: f64, background: f32) -> Result<Self> {
        Ok(Self { inner: ffi::make_grid(voxel, background, false).map_err(fail)? })
    }

    /// An empty level set with a narrow band of `half_width` cells on each side.
    ///
    /// # Errors
    /// As [`FloatGrid::new`].
    pub fn level_set(voxel: f64, half_width: f32) -> Result<Self> {
        Ok(Self { inner: ffi::make_grid(voxel, half_width * voxel as f32, true).map_err(fail)? })
    }

    /// A grid with cells of `voxel` m that consists of tiles of at least a leaf's size, and is `background` elsewhere.
    ///
    /// # Errors
    /// A tile of one voxel; as [`FloatGrid::new`].
    pub fn of_tiles(voxel: f64, background: f32, tiles: &[Tile]) -> Result<Self> {
        let stored = |tile: &Tile| {
            let [x, y, z] = tile.origin;
            let level = EDGES.iter().position(|edge| *edge == tile.edge).filter(|level| *level > 0);
            let level =
                level.ok_or_else(|| Error::argument(format!("no tile is {} voxels wide", tile.edge)))?;
            Ok(ffi::Tile { x, y, z, level: level as u32, active: tile.active, value: [tile.value; 3] })
        };
        let tiles: Vec<ffi::Tile> = tiles.iter().map(stored).collect::<Result<_>>()?;
        let head = ffi::grid_head(&Self::new(voxel, background)?.inner).map_err(fail)?;
        Ok(Self { inner: ffi::assemble(head.as_bytes(), background, &tiles).map_err(fail)? })
    }

    /// A copy that shares no memory.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn deep_copy(&self) -> Result<Self> {
        Ok(Self { inner: ffi::copy_grid(&self.inner).map_err(fail)? })
    }

    /// Edge of a cell (m).
    pub fn voxel_size(&self) -> f64 {
        ffi::voxel_size(&self.inner)
    }

    /// Whether the transform is only a rotation, a translation and one scale for all axes.
    pub fn is_uniform(&self) -> bool {
        ffi::is_uniform(&self.inner)
    }

    /// Whether voxel (0, 0, 0) is at the origin and the axes are those of the world, as in our own grids.
    pub fn is_world_fixed(&self) -> bool {
        is_world_fixed(self.voxel_size(), |index| ffi::index_to_world(&self.inner, index))
    }

    /// World position (m) of a point in index space.
    pub fn index_to_world(&self, index: DVec3) -> DVec3 {
        ffi::index_to_world(&self.inner, index.into()).into()
    }

    /// Index-space position of a world point (m).
    pub fn world_to_index(&self, world: DVec3) -> DVec3 {
        ffi::world_to_index(&self.inner, world.into()).into()
    }

    /// Value where nothing is stored.
    pub fn background(&self) -> f32 {
        ffi::background(&self.inner)
    }

    /// The meaning of the values.
    pub fn class(&self) -> GridClass {
        GridClass::of(ffi::grid_class(&self.inner))
    }

    /// Sets the meaning of the values.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn set_class(&mut self, class: GridClass) -> Result<()> {
        ffi::set_grid_class(self.inner.pin_mut(), class.number()).map_err(fail)
    }

    /// Translates the whole grid (m).
    ///
    /// # Errors
    /// When memory runs out.
    pub fn shift(&mut self, by: DVec3) -> Result<()> {
        ffi::shift(self.inner.pin_mut(), by.into()).map_err(fail)
    }

    /// The grid's name in a file.
    pub fn name(&self) -> String {
        ffi::name(&self.inner)
    }

    /// Sets the grid's name.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn set_name(&mut self, name: &str) -> Result<()> {
        ffi::set_name(self.inner.pin_mut(), name).map_err(fail)
    }

    /// All metadata, by key.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn metadata(&self) -> Result<Vec<(String, MetaValue)>> {
        Ok(ffi::metadata(&self.inner).map_err(fail)?.into_iter().map(from_meta).collect())
    }

    /// Sets or replaces a metadata entry.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn set_metadata(&mut self, key: &str, value: MetaValue) -> Result<()> {
        ffi::set_metadata(self.inner.pin_mut(), &to_meta(key, &value)).map_err(fail)
    }

    /// Number of active voxels, including all those of tiles.
    pub fn active_voxels(&self) -> u64 {
        ffi::active_voxels(&self.inner)
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        ffi::leaf_count(&self.inner)
    }

    /// Memory of the tree (bytes).
    pub fn memory_bytes(&self) -> u64 {
        ffi::memory_bytes(&self.inner)
    }

    /// Minimum and maximum active voxel, both inclusive; none if no voxel is active.
    pub fn active_bbox(&self) -> Option<([i32; 3], [i32; 3])> {
        let (mut low, mut high) = ([0; 3], [0; 3]);
        ffi::active_bbox(&self.inner, &mut low, &mut high).ok()?.then_some((low, high))
    }

    /// Heights (m) between which all active voxels lie, including one neighbour of each: below and above there are only tiles. An infinite
    /// range if no voxel is active.
    pub fn heights(&self) -> [f64; 2] {
        let Some((low, high)) = self.active_bbox() else { return [f64::NEG_INFINITY, f64::INFINITY] };
        let ends = |axis: usize| [f64::from(low[axis]) - 1.0, f64::from(high[axis]) + 1.0];
        let corners = (0..8).map(|corner| {
            let index = [0, 1, 2].map(|axis| ends(axis)[corner >> axis & 1]);
            self.index_to_world(DVec3::from(index)).y
        });
        corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)])
    }

    /// Every leaf, in the tree's order; nothing is copied.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn leaves(&self) -> Result<Vec<Leaf<'_>>> {
        let views = ffi::leaves(&self.inner).map_err(fail)?;
        // SAFETY: the views are of this grid, which stays borrowed.
        Ok(views.iter().map(|view| unsafe { lend(view, PhantomData) }).collect())
    }

    /// Every leaf, for modification; nothing is copied.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn leaves_mut(&mut self) -> Result<Vec<LeafMut<'_>>> {
        let views = ffi::leaves(&self.inner).map_err(fail)?;
        // SAFETY: the views are of this grid, which stays borrowed mutably; each leaf occurs once.
        Ok(views.iter().map(|view| unsafe { lend_mut(view, PhantomData) }).collect())
    }

    /// Every tile except inactive background.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn tiles(&self) -> Result<Vec<Tile>> {
        let tile = |tile: ffi::Tile| Tile {
            origin: [tile.x, tile.y, tile.z],
            edge: EDGES[(tile.level as usize).min(3)],
            value: tile.value[0],
            active: tile.active,
        };
        Ok(ffi::tiles(&self.inner).map_err(fail)?.into_iter().map(tile).collect())
    }

    /// The leaf or tile at each of the given block origins (multiples of 8); nothing is copied.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn probe(&self, origins: &[Origin]) -> Result<Vec<Probe<'_>>> {
        let views = ffi::probe(&self.inner, origins.as_flattened()).map_err(fail)?;
        let lent = views.iter().map(|view| match view.is_leaf {
            // SAFETY: the views are of this grid, which stays borrowed.
            true => Probe::Leaf(unsafe { lend(view, PhantomData) }),
            false => Probe::Tile { value: view.tile[0], active: view.tile_active },
        });
        Ok(lent.collect())
    }

    /// Replaces leaves or tiles by blocks. All memory for leaves is allocated before the first is replaced.
    ///
    /// # Errors
    /// When memory runs out; the grid is then unchanged.
    pub fn replace_blocks(&mut self, ctx: &Context, edits: &[BlockEdit]) -> Result<()> {
        self.put(PreparedBlocks::new(ctx, edits)?)
    }

    /// Replaces leaves or tiles by blocks.
    ///
    /// # Errors
    /// When memory for the nodes above leaves runs out.
    pub fn put(&mut self, mut blocks: PreparedBlocks) -> Result<()> {
        ffi::put_blocks(self.inner.pin_mut(), blocks.0.pin_mut()).map_err(fail)
    }

    /// Upper bound on the bytes of a .vdb file of this grid.
    pub fn file_bound(&self) -> u64 {
        ffi::file_bound(&self.inner)
    }

    /// Value of a voxel.
    pub fn value(&self, [x, y, z]: [i32; 3]) -> f32 {
        ffi::value_at(&self.inner, x, y, z)
    }

    /// Values at world positions (m), trilinear between voxel centres; `out` is cleared first.
    ///
    /// # Errors
    /// Cancel.
    pub fn sample_linear(&self, ctx: &Context, world: &[DVec3], out: &mut Vec<f32>) -> Result<()> {
        self.sample(ctx, world, true, out)
    }

    /// Values of the voxels that contain world positions (m); `out` is cleared first.
    ///
    /// # Errors
    /// Cancel.
    pub fn sample_nearest(&self, ctx: &Context, world: &[DVec3], out: &mut Vec<f32>) -> Result<()> {
        self.sample(ctx, world, false, out)
    }

    fn sample(&self, ctx: &Context, world: &[DVec3], linear: bool, out: &mut Vec<f32>) -> Result<()> {
        let flat: Vec<f64> = world.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        out.clear();
        out.resize(world.len(), 0.0);
        let (call, _running) = call(ctx);
        ffi::sample(&self.inner, &call, &flat, linear, out).map_err(fail)
    }

    /// Replaces leaves and nodes of uniform value (within `tolerance`) by tiles.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn prune(&mut self, tolerance: f32) -> Result<()> {
        ffi::prune(self.inner.pin_mut(), &uncancellable_call(), false, tolerance).map_err(fail)
    }

    /// Replaces inactive parts of a level set by inside and outside tiles.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn prune_level_set(&mut self) -> Result<()> {
        ffi::prune(self.inner.pin_mut(), &uncancellable_call(), true, 0.0).map_err(fail)
    }

    /// Gives everything outside the band the sign of the adjacent band.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn flood_fill(&mut self) -> Result<()> {
        ffi::flood_fill(self.inner.pin_mut(), &uncancellable_call()).map_err(fail)
    }

    /// Activates the voxels that share a face with an active one; their values do not change.
    ///
    /// # Errors
    /// What OpenVDB reports.
    pub(super) fn dilate(&mut self) -> Result<()> {
        ffi::dilate(self.inner.pin_mut(), &uncancellable_call()).map_err(fail)
    }
}

/// Whether a map from index space maps voxel (i, j, k) to (i, j, k) times the voxel size.
pub(super) fn is_world_fixed(voxel: f64, at: impl Fn([f64; 3]) -> [f64; 3]) -> bool {
    let expected = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let off = |index: [f64; 3]| (DVec3::from(at(index)) - DVec3::from(index) * voxel).norm();
    expected.into_iter().all(|index| off(index) < 1e-9 * voxel.max(1e-9))
}

pub(super) fn from_meta(meta: ffi::Meta) -> (String, MetaValue) {
    let value = match meta.kind.as_str() {
        "string" => MetaValue::Text(meta.text),
        "float" => MetaValue::Float(meta.number as f32),
        "double" => MetaValue::Double(meta.number),
        "int32" | "int64" => MetaValue::Int(meta.integer),
        "bool" => MetaValue::Bool(meta.integer != 0),
        _ => MetaValue::Other(meta.kind, meta.text),
    };
    (meta.key, value)
}

pub(super) fn to_meta(key: &str, value: &MetaValue) -> ffi::Meta {
    let (kind, text, number, integer) = match value {
        MetaValue::Text(text) | MetaValue::Other(_, text) => ("string", text.clone(), 0.0, 0),
        MetaValue::Float(number) => ("float", String::new(), f64::from(*number), 0),
        MetaValue::Double(number) => ("double", String::new(), *number, 0),
        MetaValue::Int(integer) => ("int64", String::new(), 0.0, *integer),
        MetaValue::Bool(yes) => ("bool", String::new(), 0.0, i64::from(*yes)),
    };
    ffi::Meta { key: key.into(), kind: kind.into(), text, number, integer }
}
