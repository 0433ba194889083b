//! Parameters of grains, in C.

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::geometry::DVec3;
use crate::snow::grains::Params;
use crate::snow::{grain_cohesion, grain_friction};

/// How snow becomes grains and how they behave. All parameters but the radius may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_grains_params {
    /// sizeof(frz_grains_params).
    pub struct_size: u32,
    /// 0, or any of FRZ_GRAINS_FLOOR, FRZ_GRAINS_RESTLESS, FRZ_GRAINS_BOX and FRZ_GRAINS_AIR_BY_DENSITY.
    pub flags: u32,
    /// Radius of a grain (m), 1e-5 to 1; with a base layer 0.02 to 0.5 of its voxel. A third of the voxel gives the look of the thesis;
    /// default 0.01 / 3, for voxels of 1 cm.
    pub radius: f64,
    /// Share of the removed snow that is compressed and becomes no grains, 0 to 1; default 0.75.
    pub compression: f64,
    /// Friction between grains, 0 to 1; default 0.14. As grains do not rotate, a friction of 0.14 already holds a slope of 32 degrees;
    /// grains that attract each other need 0.26. Grains rest on the base layer up to the same slope.
    pub friction: f64,
    /// Force with which grains that almost touch hold each other (weights of a grain), 0 to 1000; default 0.
    pub attraction: f64,
    /// Share of their speed with which grains bounce off, 0 to 1; default 0.
    pub restitution: f64,
    /// Share of its velocity that a grain keeps in a second, 0 to 1; default 0.5.
    pub air: f64,
    /// Gravity along y (m/s2), -1000 to 1000; default -9.81.
    pub gravity: f64,
    /// Height of a level ground (m), -1e6 to 1e6; only with FRZ_GRAINS_FLOOR. Default 0.
    pub floor: f64,
    /// Grains below this height (m) are removed at the end of a step; default -1e6, far below all that grains reach.
    pub lowest: f64,
    /// Minimum corner (m) of a box outside of which grains are removed; only with FRZ_GRAINS_BOX. Default 0.
    pub keep_low: [f64; 3],
    /// Its maximum corner (m); default 0.
    pub keep_high: [f64; 3],
    /// Age (s) at which a grain is removed: the frame number of the step minus that of its birth, times dt. Default 0: never.
    pub lifetime: f64,
    /// Maximum number of grains, 1 to 60000000: a step or frz_grains_emit fails if it would exceed this. Default 20000000.
    pub max_grains: u64,
    /// Seed of the scatter of grains in removed snow; default 0.
    pub seed: u64,
    /// Number of sub-steps of a step, 1 to 1000; default 0: as many as sizes, times and speeds need.
    pub sub_steps: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Distance (m) from objects and fast grains beyond which slow grains rest at once, 1e-5 to 1e5; default 0: grains everywhere must lie
    /// still before they rest. It has no effect with FRZ_GRAINS_RESTLESS.
    pub active_distance: f64,
}

sized32!(frz_grains_params, [active_distance], {
    let params = Params::for_cell(0.01);
    Self { lowest: -FARTHEST, max_grains: params.max_grains as u64, ..params.into() }
});

/// Flag of frz_grains_params: there is a level ground at frz_grains_params.floor.
pub const FRZ_GRAINS_FLOOR: u32 = 1;

/// Flag of frz_grains_params: grains never come to rest.
pub const FRZ_GRAINS_RESTLESS: u32 = 2;

/// Flag of frz_grains_params: grains outside the box from frz_grains_params.keep_low to keep_high are removed.
pub const FRZ_GRAINS_BOX: u32 = 4;

/// Flag of frz_grains_params: the air slows grains with many neighbours less than those of a thin spray.
pub const FRZ_GRAINS_AIR_BY_DENSITY: u32 = 8;

fields_of!(Params <=> frz_grains_params {
    radius, compression, friction, attraction, restitution, air, gravity, seed
});

/// Maximum height of the ground above or below 0 (m).
pub(in crate::capi) const FARTHEST: f64 = 1.0e6;

impl frz_grains_params {
    /// The library's own parameters; an error names a field that is out of range.
    pub(in crate::capi) fn params(&self) -> Outcome<Params> {
        let known = FRZ_GRAINS_FLOOR | FRZ_GRAINS_RESTLESS | FRZ_GRAINS_BOX | FRZ_GRAINS_AIR_BY_DENSITY;
        no_flags(self.flags, known)?;
        let numbers = [
            ("radius", self.radius),
            ("compression", self.compression),
            ("friction", self.friction),
            ("attraction", self.attraction),
            ("air", self.air),
            ("gravity", self.gravity),
            ("restitution", self.restitution),
            ("lowest", self.lowest),
        ];
        numbers.into_iter().try_for_each(|(name, value)| finite(name, value))?;
        within("floor", self.floor, -FARTHEST..=FARTHEST, " m")?;
        within("active_distance", self.active_distance, 0.0..=1.0e5, " m")?;
        within("lifetime", self.lifetime, 0.0..=1.0e9, " s")?;
        let has_box = self.flags & FRZ_GRAINS_BOX != 0;
        within("max_grains", self.max_grains as f64, 1.0..=6.0e7, "")?;
        within("sub_steps", f64::from(self.sub_steps), 0.0..=1000.0, "")?;
        within("reserved", f64::from(self.reserved), 0.0..=0.0, "")?;
        let params = Params {
            air_by_density: self.flags & FRZ_GRAINS_AIR_BY_DENSITY != 0,
            lifetime: Some(self.lifetime).filter(|&lifetime| lifetime > 0.0),
            keep_box: has_box.then(|| [self.keep_low, self.keep_high].map(DVec3::from)),
            rests: self.flags & FRZ_GRAINS_RESTLESS == 0,
            active_distance: Some(self.active_distance).filter(|&distance| distance > 0.0),
            sub_steps: Some(self.sub_steps).filter(|&count| count > 0),
            max_grains: self.max_grains as usize,
            ..self.over(Params::for_cell(0.01))
        };
        params.validate()?;
        Ok(params)
    }
}

/// Fills parameters with the defaults, those of the thesis' look for voxels of 1 cm.
///
/// params: receives the defaults.
/// size: sizeof(frz_grains_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_params_init(params: *mut frz_grains_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have `size` bytes.
    guard(|| unsafe { fill(params, Some(size), frz_grains_params::defaults()) })
}

/// Sets friction and attraction of parameters from measurable properties of snow.
///
/// params: friction and attraction are set, for grains of its radius.
/// repose_angle_deg: slope at which a poured pile comes to rest (degrees), 0 to 42.
/// stands: height of a wall of grains that just stands (m), 0 to 1000. 0: no attraction. The conversion to attraction was measured only for
///     walls of up to 64 diameters.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grains_params_of_snow(
    params: *mut frz_grains_params,
    repose_angle_deg: f64,
    stands: f64,
) -> frz_status {
    // SAFETY: the parameters are NULL or valid.
    guard(|| unsafe {
        within("repose_angle_deg", repose_angle_deg, 0.0..=grain_friction::MAX_REPOSE, " degrees")?;
        within("stands", stands, 0.0..=1000.0, " m")?;
        let to = required(params, "params")?;
        let mut now = given(to.cast_const())?;
        now.params()?;
        now.attraction = grain_cohesion::of_wall(stands, 2.0 * now.radius, repose_angle_deg).min(1000.0);
        now.friction = grain_friction::of_repose(repose_angle_deg, now.attraction > 0.0);
        fill(to, None, now)
    })
}
