//! A box of blocks, and sets of its blocks.

use super::Face;
use super::lattice::{Fixed, UNITS, floor};
use crate::error::{Error, Result};
use crate::geometry::coords::is_between;

/// Maximum number of blocks of a region: a `u32` for each then takes 1 GiB.
const MAX_BLOCKS: u64 = 1 << 28;

/// A box of blocks of 8^3 voxels; coordinates count blocks from the lattice's origin voxel.
pub struct Region {
    /// Minimum block.
    pub low: [i32; 3],
    /// Maximum block.
    pub high: [i32; 3],
}

impl Region {
    /// Blocks within `margin` cells of the faces, inside the voxel box `low..=high` grown by `margin`.
    ///
    /// # Errors
    /// When the box spans more than 2^28 blocks.
    pub fn around(faces: &[Face], margin: f32, low: [i32; 3], high: [i32; 3]) -> Result<Self> {
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for face in faces {
            let (low, high) = extent(&face.v);
            for axis in 0..3 {
                min[axis] = min[axis].min(low[axis]);
                max[axis] = max[axis].max(high[axis]);
            }
        }
        let mut region = Self {
            low: [0, 1, 2].map(|a| block_of(min[a] - margin).max(block_of(low[a] as f32 - margin))),
            high: [0, 1, 2].map(|a| block_of(max[a] + margin).min(block_of(high[a] as f32 + margin))),
        };
        if (0..3).any(|axis| region.low[axis] > region.high[axis]) {
            region = Self { low: [0; 3], high: [-1; 3] };
        }
        let blocks = region.size().iter().map(|&size| size as u64).product::<u64>();
        if blocks > MAX_BLOCKS {
            let what = "the region that the objects sweep (make the cell larger or the motion shorter)";
            return Err(Error::Memory { what: what.into(), needed: blocks * 4, limit: MAX_BLOCKS * 4 });
        }
        Ok(region)
    }

    fn size(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| (self.high[axis] - self.low[axis] + 1).max(0) as usize)
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        self.size().iter().product()
    }

    /// Whether a block lies in the region.
    pub fn holds(&self, block: [i32; 3]) -> bool {
        is_between(block, self.low, self.high)
    }

    /// Index of a block of the region.
    pub fn index(&self, block: [i32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| (block[axis] - self.low[axis]) as usize);
        let [_, ny, nz] = self.size();
        (x * ny + y) * nz + z
    }

    /// The block with this index.
    pub fn block(&self, index: usize) -> [i32; 3] {
        let [_, ny, nz] = self.size();
        let at = [index / (ny * nz), index / nz % ny, index % nz];
        [0, 1, 2].map(|axis| self.low[axis] + at[axis] as i32)
    }

    /// The region's blocks that a box (cells) touches when grown by `margin` cells: minimum and maximum.
    pub fn touched(&self, (low, high): ([f32; 3], [f32; 3]), margin: f32) -> ([i32; 3], [i32; 3]) {
        (
            [0, 1, 2].map(|a| block_of(low[a] - margin).max(self.low[a])),
            [0, 1, 2].map(|a| block_of(high[a] + margin).min(self.high[a])),
        )
    }

    /// Marks every block within `steps` blocks of a marked one.
    pub fn dilated(&self, marked: &[bool], steps: i32) -> Vec<bool> {
        let [nx, ny, nz] = self.size();
        let strides = [(nx, ny * nz), (ny, nz), (nz, 1)];
        let mut current = marked.to_vec();
        for (count, stride) in strides {
            let mut next = vec![false; current.len()];
            for index in (0..current.len()).filter(|&index| current[index]) {
                let at = (index / stride % count) as i32;
                let (first, last) = ((at - steps).max(0), (at + steps).min(count as i32 - 1));
                (first..=last)
                    .for_each(|to| next[index + to as usize * stride - at as usize * stride] = true);
            }
            current = next;
        }
        current
    }
}

/// Bounding box of a face (cells from the origin voxel).
pub fn extent(v: &[Fixed; 3]) -> ([f32; 3], [f32; 3]) {
    let cell = |value: i32| value as f32 / UNITS as f32;
    let low = [0, 1, 2].map(|a| cell(v[0][a].min(v[1][a]).min(v[2][a])));
    let high = [0, 1, 2].map(|a| cell(v[0][a].max(v[1][a]).max(v[2][a])));
    (low, high)
}

/// Block of a coordinate (cells); saturates.
fn block_of(cells: f32) -> i32 {
    floor(f64::from(cells) / 8.0)
}
