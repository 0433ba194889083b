//! Which voxels of a block lie inside the volume, and where that changes from one voxel to the next.

use super::winding::Lines;
use crate::base::blocks::Mask;

/// The voxels inside the volume, of a block and one further on each side: bit z + 1 of `[x + 1][y + 1]`.
pub struct Signs([[u16; 10]; 10]);

impl Signs {
    /// Which voxels of a block, and around it, the chain winds around.
    pub fn new(lines: &Lines, corner: [i32; 3]) -> Self {
        let mut columns = [[0; 10]; 10];
        for (x, row) in (-1..).zip(&mut columns) {
            for (y, bits) in (-1..).zip(row) {
                let line = lines.line(corner[0] + x, corner[1] + y);
                let mut next = line.partition_point(|(height, _)| *height < f64::from(corner[2] - 1));
                for z in -1..9 {
                    while next < line.len() && line[next].0 < f64::from(corner[2] + z) {
                        next += 1;
                    }
                    let solid = next > 0 && line[next - 1].1 >= 1;
                    *bits |= u16::from(solid) << (z + 1);
                }
            }
        }
        Self(columns)
    }

    /// Those of the block.
    pub fn inside(&self) -> Mask {
        let row = |x: usize, y: usize| u64::from(self.0[x + 1][y + 1] >> 1 & 0xff) << (8 * y);
        std::array::from_fn(|x| (0..8).fold(0, |bits, y| bits | row(x, y)))
    }

    /// Calls `see` with each voxel of the block whose neighbour along an axis, above or not, is on the other side.
    pub fn each_change(&self, mut see: impl FnMut(usize, usize, bool)) {
        for (x, y) in (1..9).flat_map(|x| (1..9).map(move |y| (x, y))) {
            let own = self.0[x][y];
            let changes = [
                (self.0[x - 1][y] ^ own, 0, false),
                (self.0[x + 1][y] ^ own, 0, true),
                (self.0[x][y - 1] ^ own, 1, false),
                (self.0[x][y + 1] ^ own, 1, true),
                (own << 1 ^ own, 2, false),
                (own >> 1 ^ own, 2, true),
            ];
            for (bits, axis, above) in changes {
                let mut bits = bits >> 1 & 0xff;
                while bits != 0 {
                    let z = bits.trailing_zeros() as usize;
                    see((x - 1) << 6 | (y - 1) << 3 | z, axis, above);
                    bits &= bits - 1;
                }
            }
        }
    }
}

/// The voxel beside one of a block along an axis, above or below; none in another block.
pub fn beside(voxel: usize, axis: usize, above: bool) -> Option<usize> {
    let shift = 6 - 3 * axis;
    match (voxel >> shift & 7, above) {
        (7, true) | (0, false) => None,
        (_, true) => Some(voxel + (1 << shift)),
        (_, false) => Some(voxel - (1 << shift)),
    }
}
