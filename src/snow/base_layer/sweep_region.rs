//! The region in which a sweep can change the snow: its distances are computed only there.

use rayon::prelude::*;

use crate::error::Result;
use crate::numeric::blocks::{Mask, Origin};
use crate::vdb::{FloatGrid, Probe};

/// Voxels of each block with a value below the background: those farther outside cannot lose snow. With `rim`, also their neighbours along
/// the axes, for derivatives.
pub fn snow_masks(surface: &FloatGrid, blocks: &[Origin], rim: bool) -> Result<Vec<Mask>> {
    let background = surface.background();
    let own = |probe: &Probe<'_>| -> Mask {
        match probe {
            Probe::Leaf(leaf) => std::array::from_fn(|x| {
                let row = &leaf.values[x * 64..x * 64 + 64];
                row.iter().enumerate().fold(0, |bits, (i, value)| bits | u64::from(*value < background) << i)
            }),
            Probe::Tile { value, .. } => [if *value < background { u64::MAX } else { 0 }; 8],
        }
    };
    if !rim {
        return Ok(surface.probe(blocks)?.par_iter().map(own).collect());
    }
    // Each block, then its neighbours below and above along each axis.
    let around = |origin: &Origin| {
        let beside = |axis: usize, step: i32| {
            let mut position = *origin;
            position[axis] += step;
            position
        };
        [*origin, beside(0, -8), beside(0, 8), beside(1, -8), beside(1, 8), beside(2, -8), beside(2, 8)]
    };
    let origins: Vec<Origin> = blocks.iter().flat_map(around).collect();
    let probes = surface.probe(&origins)?;
    Ok(probes.par_chunks(7).map(|probes| dilated(&std::array::from_fn(|i| own(&probes[i])))).collect())
}

/// Bits of z = 0 in a plane of constant x.
const LOW_Z: u64 = 0x0101_0101_0101_0101;
/// Bits of y = 0 in a plane of constant x.
const LOW_Y: u64 = 0xff;

/// A block's mask dilated by one voxel along each axis, including voxels of its six neighbours.
fn dilated([own, below_x, above_x, below_y, above_y, below_z, above_z]: &[Mask; 7]) -> Mask {
    std::array::from_fn(|x| {
        let bits = own[x];
        let along_x =
            (if x > 0 { own[x - 1] } else { below_x[7] }) | (if x < 7 { own[x + 1] } else { above_x[0] });
        let along_y = bits << 8 | bits >> 8 | below_y[x] >> 56 & LOW_Y | (above_y[x] & LOW_Y) << 56;
        let along_z = bits << 1 & !LOW_Z
            | bits >> 1 & !(LOW_Z << 7)
            | below_z[x] >> 7 & LOW_Z
            | (above_z[x] & LOW_Z) << 7;
        bits | along_x | along_y | along_z
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::blocks::offset;

    #[test]
    fn a_mask_grows_by_one_voxel_across_blocks() {
        let voxel = |x: usize, y: usize, z: usize| {
            let mut mask: Mask = [0; 8];
            let at = offset(x, y, z);
            mask[at >> 6] = 1 << (at & 63);
            mask
        };
        let grown = dilated(&[
            voxel(3, 0, 7),
            voxel(7, 1, 1),
            voxel(0, 2, 2),
            voxel(4, 7, 4),
            voxel(5, 0, 5),
            voxel(6, 6, 7),
            voxel(1, 3, 0),
        ]);
        let expected = [
            (3, 0, 7),
            (2, 0, 7),
            (4, 0, 7),
            (3, 1, 7),
            (3, 0, 6),
            (0, 1, 1),
            (7, 2, 2),
            (4, 0, 4),
            (5, 7, 5),
            (6, 6, 0),
            (1, 3, 7),
        ];
        let mut mask: Mask = [0; 8];
        for (x, y, z) in expected {
            let single = voxel(x, y, z);
            (0..8).for_each(|x| mask[x] |= single[x]);
        }
        assert_eq!(grown, mask);
    }
}
