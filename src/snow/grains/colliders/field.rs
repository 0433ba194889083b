//! Contacts between grains and a level set that does not move during the step: the base layer.

use rayon::prelude::*;

use super::touch::{BASE, Touch};
use crate::error::Result;
use crate::numeric::blocks::{DIM, offset};
use crate::snow::grains::solver::blocks::{Block, BlockIndex, EDGE};
use crate::snow::grains::solver::layout::Layout;
use crate::snow::grains::solver::pairs::SKIN;
use crate::snow::grains::solver::rows::{Row, V, dot, norm, scaled};
use crate::vdb::{FloatGrid, Probe};

/// A level set as a collider.
pub struct Field<'a> {
    /// The level set (m).
    pub grid: &'a FloatGrid,
    /// Friction against it.
    pub friction: f32,
}

impl Field<'_> {
    /// The leaves around each block, with a margin (cells); none where no surface is near.
    ///
    /// # Errors
    /// Errors of the grid.
    pub fn windows(
        &self,
        blocks: &[BlockIndex],
        diameter: f64,
        margin: f64,
    ) -> Result<Vec<Option<Window<'_>>>> {
        let cell = self.grid.voxel_size();
        let bounds: Vec<[[i32; 3]; 2]> = blocks
            .par_iter()
            .map(|at| {
                let leaf = |x: f64| (x / DIM as f64).floor() as i32;
                let edge = f64::from(EDGE) * diameter / cell;
                let low = at.map(|at| leaf(f64::from(at) * edge - margin));
                let high = at.map(|at| leaf(f64::from(at + 1) * edge + margin));
                [low, high]
            })
            .collect();
        let windows = Window::all(self.grid, &bounds)?;
        Ok(windows.into_iter().map(|window| window.has_surface().then_some(window)).collect())
    }
}

/// A level set with a cached copy of the values around each block.
pub struct CachedField<'a> {
    field: &'a Field<'a>,
    /// By block; none until it is first needed.
    patches: Vec<Option<Patch>>,
    diameter: f64,
}

impl<'a> CachedField<'a> {
    /// An empty cache, for grains of a diameter (m).
    pub fn new(field: &'a Field<'a>, diameter: f64) -> Self {
        Self { field, patches: Vec::new(), diameter }
    }

    /// Touches of members of the blocks `which` with a surface nearby. `reach` is the distance (diameters) that a grain
    /// at 1 m/s may move.
    ///
    /// # Errors
    /// Errors of the grid.
    pub fn touches(
        &mut self,
        layout: &Layout,
        which: &[u32],
        rows: &[Row],
        reach: f32,
    ) -> Result<Vec<Vec<Touch>>> {
        self.load_patches(layout, which)?;
        let near = which.par_iter().with_max_len(8).map(|&index| {
            let (block, patch) = (&layout.blocks[index as usize], &self.patches[index as usize]);
            let Some(patch) = patch.as_ref().filter(|patch| !patch.values.is_empty()) else {
                return Vec::new();
            };
            let near = |&slot: &u32| self.touch(block, slot, &rows[slot as usize], patch, reach);
            block.members.iter().filter_map(near).collect()
        });
        Ok(near.collect())
    }

    /// Copies the values around blocks that are not in the cache yet.
    fn load_patches(&mut self, layout: &Layout, which: &[u32]) -> Result<()> {
        self.patches.resize_with(layout.blocks.len(), || None);
        let is_new = |index: &&u32| self.patches[**index as usize].is_none();
        let new: Vec<u32> = which.iter().filter(is_new).copied().collect();
        let cell = self.field.grid.voxel_size();
        let blocks: Vec<BlockIndex> = new.iter().map(|&index| layout.blocks[index as usize].at).collect();
        let windows = self.field.windows(&blocks, self.diameter, MARGIN * self.diameter / cell + 2.0)?;
        let (edge, margin) = (f64::from(EDGE) * self.diameter / cell, MARGIN * self.diameter / cell);
        let patch = |(&index, window): (&u32, Option<Window<'_>>)| {
            let Some(window) = window else { return Patch::default() };
            let at = layout.blocks[index as usize].at.map(f64::from);
            let low = at.map(|at| (at * edge - margin).floor() as i32);
            Patch::of(&window, low, at.map(|at| ((at + 1.0) * edge + margin).floor() as i32 + 2))
        };
        let made: Vec<Patch> = new.par_iter().zip(windows).map(patch).collect();
        new.iter().zip(made).for_each(|(&index, patch)| self.patches[index as usize] = Some(patch));
        Ok(())
    }

    /// Distance (diameters) from the surface to a member of the block with this index; none if no surface is near the block.
    pub fn distance(&self, index: usize, at: BlockIndex, position: V) -> Option<f32> {
        let patch = self.patches.get(index)?.as_ref().filter(|patch| !patch.values.is_empty())?;
        Some(patch.sample(self.voxel(at, position)).0 / self.diameter as f32)
    }

    /// A position in a block, in voxels.
    fn voxel(&self, at: BlockIndex, position: V) -> [f64; 3] {
        let scale = self.diameter / self.field.grid.voxel_size();
        [0, 1, 2].map(|axis| (f64::from(at[axis]) * f64::from(EDGE) + f64::from(position[axis])) * scale)
    }

    fn touch(&self, block: &Block, slot: u32, row: &Row, patch: &Patch, reach: f32) -> Option<Touch> {
        let near = 0.5 + SKIN + norm(row.velocity) * reach;
        if patch.min / self.diameter as f32 > near {
            return None;
        }
        let (distance, gradient) = patch.sample(self.voxel(block.at, row.position));
        let distance = distance / self.diameter as f32;
        if distance > near {
            return None;
        }
        let slope = norm(gradient);
        // Deep in the level set the gradient is 0: the touch has no plane and only records that the grain is inside.
        let normal = if slope < 1.0e-6 { [0.0; 3] } else { scaled(gradient, 1.0 / slope) };
        Some(Touch {
            grain: slot,
            collider: BASE,
            normal,
            offset: dot(normal, row.position) - (distance - 0.5),
            friction: self.field.friction,
            ..Touch::default()
        })
    }
}

/// Margin around a block (diameters) for grains that have left it since it was sorted.
const MARGIN: f64 = 1.0;

/// Values of a level set around a block; empty where no surface is near.
#[derive(Default)]
struct Patch {
    /// Minimum voxel index along each axis.
    low: [i32; 3],
    /// Number of voxels along each axis.
    size: [usize; 3],
    values: Vec<f32>,
    min: f32,
}

impl Patch {
    /// Values of the voxels from `low` up to `end`, exclusive.
    fn of(window: &Window<'_>, low: [i32; 3], end: [i32; 3]) -> Self {
        let size = [0, 1, 2].map(|axis| (end[axis] - low[axis]) as usize);
        let mut values = Vec::with_capacity(size.iter().product());
        window.copy(low, end, &mut values);
        let min = values.iter().copied().fold(f32::INFINITY, f32::min);
        Self { low, size, values, min }
    }

    /// Value, and gradient per voxel, at a position (voxels).
    fn sample(&self, at: [f64; 3]) -> (f32, V) {
        let low = at.map(|x| x.floor() as i32);
        let index = |axis: usize| {
            [0, 1]
                .map(|step| (low[axis] + step - self.low[axis]).clamp(0, self.size[axis] as i32 - 1) as usize)
        };
        let [xs, ys, zs] = [index(0), index(1), index(2)];
        interpolated(at, low, |x, y, z| self.values[(xs[x] * self.size[1] + ys[y]) * self.size[2] + zs[z]])
    }
}

/// A box of adjacent leaves of a level set.
pub struct Window<'a> {
    /// Minimum leaf index along each axis.
    low: [i32; 3],
    /// Number of leaves along each axis.
    size: [usize; 3],
    probes: Vec<Probe<'a>>,
}

impl<'a> Window<'a> {
    /// A window for each pair of a minimum and a maximum leaf index.
    ///
    /// # Errors
    /// Errors of the grid.
    pub fn all(grid: &'a FloatGrid, bounds: &[[[i32; 3]; 2]]) -> Result<Vec<Self>> {
        let origins = |[low, high]: &[[i32; 3]; 2]| {
            let [low, high] = [*low, *high];
            let rows = (low[0]..=high[0]).flat_map(move |x| (low[1]..=high[1]).map(move |y| [x, y]));
            rows.flat_map(move |[x, y]| {
                (low[2]..=high[2]).map(move |z| [x, y, z].map(|leaf| leaf * DIM as i32))
            })
        };
        let all: Vec<[i32; 3]> = bounds.iter().flat_map(origins).collect();
        let mut probes = grid.probe(&all)?.into_iter();
        let window = |[low, high]: &[[i32; 3]; 2]| {
            let size = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1) as usize);
            Window { low: *low, size, probes: probes.by_ref().take(size.iter().product()).collect() }
        };
        Ok(bounds.iter().map(window).collect())
    }

    fn has_surface(&self) -> bool {
        self.probes.iter().any(|probe| matches!(probe, Probe::Leaf(_)))
    }

    /// Whether a part of the window may be inside the level set.
    pub fn has_inside(&self) -> bool {
        let may = |probe: &Probe<'_>| match probe {
            Probe::Leaf(_) => true,
            Probe::Tile { value, .. } => *value < 0.0,
        };
        self.probes.iter().any(may)
    }

    /// The block that holds a voxel, or the nearest one in the window, and the voxel's offset in its block.
    fn find(&self, voxel: [i32; 3]) -> (&Probe<'a>, usize) {
        let leaf = [0, 1, 2]
            .map(|axis| ((voxel[axis] >> 3) - self.low[axis]).clamp(0, self.size[axis] as i32 - 1) as usize);
        let [x, y, z] = voxel.map(|at| (at & 7) as usize);
        (&self.probes[(leaf[0] * self.size[1] + leaf[1]) * self.size[2] + leaf[2]], offset(x, y, z))
    }

    fn value(&self, voxel: [i32; 3]) -> f32 {
        match self.find(voxel) {
            (Probe::Leaf(leaf), offset) => leaf.values[offset],
            (Probe::Tile { value, .. }, _) => *value,
        }
    }

    /// Appends the values of the voxels from `low` up to `end`, exclusive; z varies fastest.
    pub fn copy(&self, low: [i32; 3], end: [i32; 3], out: &mut Vec<f32>) {
        for (x, y) in (low[0]..end[0]).flat_map(|x| (low[1]..end[1]).map(move |y| (x, y))) {
            let mut z = low[2];
            while z < end[2] {
                let next = ((z | 7) + 1).min(end[2]);
                let count = (next - z) as usize;
                match self.find([x, y, z]) {
                    (Probe::Leaf(leaf), offset) => out.extend_from_slice(&leaf.values[offset..][..count]),
                    (Probe::Tile { value, .. }, _) => out.extend(std::iter::repeat_n(*value, count)),
                }
                z = next;
            }
        }
    }

    /// Value, and gradient per voxel, at a position (voxels).
    pub fn sample(&self, at: [f64; 3]) -> (f32, V) {
        let low = at.map(|x| x.floor() as i32);
        let step = |step: usize| step as i32;
        interpolated(at, low, |x, y, z| self.value([low[0] + step(x), low[1] + step(y), low[2] + step(z)]))
    }
}

/// Value, and gradient per voxel, at a position (voxels): trilinear interpolation. `corner` returns the value of the voxel
/// `low` plus 0 or 1 along each axis.
#[inline(always)]
fn interpolated(at: [f64; 3], low: [i32; 3], corner: impl Fn(usize, usize, usize) -> f32) -> (f32, V) {
    let [u, v, w] = [0, 1, 2].map(|axis| (at[axis] - f64::from(low[axis])) as f32);
    let along = |x: usize, y: usize| {
        let (a, b) = (corner(x, y, 0), corner(x, y, 1));
        (a + (b - a) * w, b - a)
    };
    let [(a, az), (b, bz), (c, cz), (d, dz)] = [along(0, 0), along(0, 1), along(1, 0), along(1, 1)];
    let (front, back) = (a + (b - a) * v, c + (d - c) * v);
    let mix = |low: f32, high: f32, t: f32| low + (high - low) * t;
    let gradient = [back - front, mix(b - a, d - c, u), mix(mix(az, bz, v), mix(cz, dz, v), u)];
    (mix(front, back, u), gradient)
}
