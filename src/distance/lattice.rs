//! Fixed-point coordinates: exact predicates on the voxel lattice require integers.

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::Origin;

/// Fixed-point units in a cell; rounding to them moves a vertex by at most 1/8192 cell on each axis.
pub const UNITS: i32 = 4096;

/// A position in units of 1/4096 cell from the lattice's origin voxel.
pub type Fixed = [i32; 3];

/// Maximum coordinate, in units: products of two differences then fit in 64 bits.
const LIMIT: f64 = (1 << 29) as f64;
/// Maximum coordinate, in cells from the lattice's origin voxel.
pub const REACH: f64 = LIMIT / UNITS as f64;

/// Voxel lattice that is fixed in the world (the centre of voxel (i, j, k) is at (i, j, k) x cell), with an origin voxel near the region of
/// interest, so that coordinates are small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Cell size (m).
    pub voxel: f64,
    /// The voxel whose centre is the origin of the fixed-point coordinates; multiples of 8.
    pub origin: [i32; 3],
}

/// `value.floor()` as an integer: the baseline instruction set has no rounding instruction, so `floor` would be a function call.
pub fn floor(value: f64) -> i32 {
    let cut = value as i32;
    cut.saturating_sub(i32::from(value < f64::from(cut)))
}

impl Lattice {
    /// A lattice whose origin voxel is the first of the block that contains a world position (m).
    ///
    /// # Errors
    /// When the position is so far from the world's origin that voxel indices overflow.
    pub fn near(voxel: f64, position: DVec3) -> Result<Self> {
        let mut origin = [0; 3];
        for axis in 0..3 {
            let cell = (position[axis] / voxel).round();
            if cell.is_nan() || cell.abs() > f64::from(i32::MAX / 2) {
                return Err(Error::argument(format!(
                    "a position of {} m is too far from the origin for cells of {voxel} m",
                    position[axis]
                )));
            }
            origin[axis] = (cell as i32) & !7;
        }
        Ok(Self { voxel, origin })
    }

    /// The origin (in voxels of the grid) of a block given in blocks from the lattice's origin voxel.
    pub fn block_origin(&self, block: [i32; 3]) -> Origin {
        [0, 1, 2].map(|axis| self.origin[axis] + block[axis] * 8)
    }

    /// World position (m) to index space: cells from the origin voxel.
    pub fn to_cells(&self, world: DVec3) -> DVec3 {
        DVec3::new(
            world.x / self.voxel - f64::from(self.origin[0]),
            world.y / self.voxel - f64::from(self.origin[1]),
            world.z / self.voxel - f64::from(self.origin[2]),
        )
    }

    /// Rounds cells from the origin voxel to fixed point.
    ///
    /// # Errors
    /// When a coordinate is not finite or lies farther than 131,072 cells from the origin voxel.
    pub fn fix(&self, cells: DVec3) -> Result<Fixed> {
        let scaled = cells * f64::from(UNITS);
        if !(scaled.x.abs() < LIMIT && scaled.y.abs() < LIMIT && scaled.z.abs() < LIMIT) {
            let far = cells.amax() * self.voxel;
            return Err(Error::argument(too_far("a vertex lies", far, "the local origin", self.voxel)));
        }
        Ok([scaled.x.round() as i32, scaled.y.round() as i32, scaled.z.round() as i32])
    }
}

/// The message for something (`what`, such as "a vertex lies") that is `far` m from `from`, out of range for cells of `voxel` m.
pub fn too_far(what: &str, far: f64, from: &str, voxel: f64) -> String {
    let reach = REACH * voxel;
    format!("{what} {far:.0} m from {from}, farther than {reach:.0} m, the reach of cells of {voxel} m")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_rounds_down_on_both_sides_of_zero() {
        for value in [-3.0, -2.5, -1e-9, 0.0, 1e-9, 2.5, 7.0, -1e12, 1e12, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(floor(value), value.floor() as i32, "{value}");
        }
    }
}
