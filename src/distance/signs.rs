//! Which voxels of a block lie inside the volume, and where the sign changes between neighbours.

use super::winding::Lines;
use crate::numeric::blocks::{Mask, offset};

/// The bits of a line's ten voxels.
const LINE: u16 = (1 << 10) - 1;
/// The bits of the eight voxels in the block.
const OWN: u16 = LINE >> 1 & !1;

/// The voxels inside the volume, for a block and one voxel more on each side: bit z + 1 of `[x + 1][y + 1]`.
pub struct Signs([[u16; 10]; 10]);

impl Signs {
    /// Which voxels of the block at `corner` and around it are inside.
    pub fn new(lines: &Lines, corner: [i32; 3]) -> Self {
        let mut columns = [[0; 10]; 10];
        for (x, row) in (-1..).zip(&mut columns) {
            for (y, bits) in (-1..).zip(row) {
                *bits = inside(lines.line(corner[0] + x, corner[1] + y), corner[2] - 1);
            }
        }
        Self(columns)
    }

    /// The inside voxels of the block.
    pub fn inside(&self) -> Mask {
        let row = |x: usize, y: usize| u64::from(self.0[x + 1][y + 1] >> 1 & 0xff) << (8 * y);
        std::array::from_fn(|x| (0..8).fold(0, |bits, y| bits | row(x, y)))
    }

    /// Calls `see` with each voxel of the block that has a neighbour of opposite sign along an axis.
    pub fn each_change(&self, mut see: impl FnMut(usize)) {
        for (x, y) in (1..9).flat_map(|x| (1..9).map(move |y| (x, y))) {
            let own = self.0[x][y];
            let around = [self.0[x - 1][y], self.0[x + 1][y], self.0[x][y - 1], self.0[x][y + 1]];
            let beside = around.into_iter().fold(0, |changes, other| changes | own ^ other);
            let mut bits = (beside | own << 1 ^ own | own >> 1 ^ own) & OWN;
            while bits != 0 {
                see(offset(x - 1, y - 1, bits.trailing_zeros() as usize - 1));
                bits &= bits - 1;
            }
        }
    }
}

/// Which of the ten voxels of a line are inside: one bit each, from height `first` upward.
fn inside(line: &[(f64, i32)], first: i32) -> u16 {
    let first = f64::from(first);
    let above = line.partition_point(|(height, _)| *height < first);
    let mut is_inside = above > 0 && line[above - 1].1 >= 1;
    let mut bits = if is_inside { LINE } else { 0 };
    for (height, winding) in &line[above..] {
        let next = (*height - first) as usize + 1;
        if next >= 10 {
            break;
        }
        if (*winding >= 1) != is_inside {
            is_inside = !is_inside;
            bits ^= LINE & (LINE << next);
        }
    }
    bits
}
