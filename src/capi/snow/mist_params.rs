//! Parameters of mist, in C.

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::snow::mist::Params;

/// How grains raise mist and how it behaves. All parameters but the cell and the wind may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_mist_params {
    /// sizeof(frz_mist_params).
    pub struct_size: u32,
    /// 0, FRZ_MIST_FALLING, FRZ_MIST_FLOOR or both.
    pub flags: u32,
    /// Edge of a cell of air (m), 1e-5 to 100; 4/3 of the base layer's voxel gives the thesis' look.
    pub cell: f64,
    /// Speed (m/s) above which grains raise mist, 0 to 1000; default 2.
    pub from_speed: f64,
    /// Gravity on the air where there is mist, along y (m/s2), -1000 to 1000; default -2.
    pub gravity: f64,
    /// Time (s) in which half of the mist dissipates, above 0; infinite: it stays. Default 1.
    pub half_life: f64,
    /// Velocity of the air (m/s), each component -1000 to 1000; default 0.
    pub wind: [f64; 3],
    /// Acceleration by eddies (m/s2, root mean square), 0 to 1000; default 0: none.
    pub turbulence: f64,
    /// Size of the eddies (m), at least 8 cells; default 24 cells.
    pub turbulence_size: f64,
    /// Strength with which small eddies are kept alive (1/s), 0 to 100; default 0: not at all.
    pub confinement: f64,
    /// Maximum share of the density of new mist that noise removes, 0 to 1; default 0.3.
    pub noise: f64,
    /// Size of that noise (m), at least a cell; default 4 cells.
    pub noise_size: f64,
    /// Height of a level ground (m), -1e6 to 1e6; only with FRZ_MIST_FLOOR. Default 0.
    pub floor: f64,
    /// Seed of the noise and eddies; default 0.
    pub seed: i32,
    /// Width (tiles of 8 cells) of the air that is computed around the mist, 1 to 64; default 1.
    pub padding: u32,
}

sized32!(frz_mist_params, [], Params::for_cell(0.01 * 4.0 / 3.0).into());

/// Flag of frz_mist_params: falling grains raise mist too.
pub const FRZ_MIST_FALLING: u32 = 1;

/// Flag of frz_mist_params: there is a level ground at frz_mist_params.floor.
pub const FRZ_MIST_FLOOR: u32 = 2;

fields_of!(Params <=> frz_mist_params {
    cell, from_speed, gravity, half_life, wind, turbulence, turbulence_size, confinement, noise, noise_size, seed, padding
});

/// Maximum height of the ground above or below 0 (m).
const FARTHEST: f64 = 1.0e6;

impl frz_mist_params {
    /// The library's own parameters; an error names a field that is out of range.
    pub(in crate::capi) fn params(&self) -> Outcome<Params> {
        no_flags(self.flags, FRZ_MIST_FALLING | FRZ_MIST_FLOOR)?;
        finite("cell", self.cell)?;
        within("floor", self.floor, -FARTHEST..=FARTHEST, " m")?;
        let params = self.over(Params::for_cell(self.cell));
        let params = Params { falling: self.flags & FRZ_MIST_FALLING != 0, ..params };
        params.validate()?;
        Ok(params)
    }

    /// Height of the level ground (m), if there is one.
    pub(in crate::capi) fn ground(&self) -> Option<f64> {
        Some(self.floor).filter(|_| self.flags & FRZ_MIST_FLOOR != 0)
    }
}

/// Fills parameters with the defaults, those of the thesis' look for voxels of 1 cm. If you change cell, change turbulence_size and
/// noise_size too.
///
/// params: receives the defaults.
/// size: sizeof(frz_mist_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_params_init(params: *mut frz_mist_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have `size` bytes.
    guard(|| unsafe { fill(params, Some(size), frz_mist_params::defaults()) })
}
