//! How a mesh follows particles, in C's terms.

use crate::capi::ffi::guard::{Outcome, frz_status, guard};
use crate::capi::ffi::views::{Sized32, fill, finite, meaning, within};
use crate::capi::mesh::triangles::no_flags;
use crate::surface::{Params, Weighting};

/// How particles carry vertices.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_weighting {
    /// By affine maps: exact where the liquid turns and stretches.
    FRZ_TRACKER_AFFINE = 0,
    /// By their mean, as in the thesis: it lags behind.
    FRZ_TRACKER_MEAN = 1,
}

/// Where a mesh that is rebuilt is matched to the topology of the liquid.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_match {
    /// Where vertices are flagged, and at drops that it does not cover.
    FRZ_TRACKER_MATCH_FLAGGED = 0,
    /// All over it in every step: also at bubbles, and where it differs from the liquid between vertices by more than the detail
    /// around. It takes longer.
    FRZ_TRACKER_MATCH_EVERY = 1,
}

use frz_tracker_match::*;
use frz_tracker_weighting::*;

const WEIGHTINGS: [(u32, Weighting); 2] =
    [(FRZ_TRACKER_AFFINE as u32, Weighting::Affine), (FRZ_TRACKER_MEAN as u32, Weighting::Mean)];

/// Numbers of frz_tracker_match, with [`Params::every`].
const MATCHES: [(u32, bool); 2] =
    [(FRZ_TRACKER_MATCH_FLAGGED as u32, false), (FRZ_TRACKER_MATCH_EVERY as u32, true)];

/// How a mesh follows particles. All of it but the spacing, the cell and whether it is rebuilt may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_tracker_params {
    /// sizeof(frz_tracker_params).
    pub struct_size: u32,
    /// 0.
    pub flags: u32,
    /// Initial distance r between particles (m), 1e-9 to 1e6: see frz_particles_spacing. No usual one: it must be set.
    pub spacing: f64,
    /// Edge of a cell of the particles' surface (r), 0.125 to 2; 0.5 is usual.
    pub cell: f64,
    /// Vertices that would be moved farther (r) to keep their detail are flagged, 0.001 to 100: the liquid has merged or split
    /// there. 0.5 is usual.
    pub change: f64,
    /// Time (s) in which half of the detail fades, above 0; infinite, as is usual: it stays. It stays anyway where the mesh's attribute
    /// "detail" of one float is 1, and fades as fast as this says where that is 0. A vertex that a step makes has the mean of those of
    /// its neighbours that were there, 0 without any.
    pub half_life: f64,
    /// How much detail fades where the mesh is strained: to exp(-fade) of it while lengths change by a factor of e, 0 to 1000; 0,
    /// as is usual: not at all.
    pub fade: f64,
    /// A frz_tracker_weighting; FRZ_TRACKER_AFFINE is usual.
    pub weighting: u32,
    /// 0.
    pub reserved: u32,
    /// 1: where the liquid merges or splits the mesh is rebuilt, and merges or splits with it; where it is stretched or squeezed, edges
    /// are divided or go. It must be closed, a 2-manifold by its indices. 0, as is usual: the mesh keeps the vertices and the faces
    /// that it was made with, or was given by frz_tracker_resculpt, and is flagged where it no longer fits. With 1 any step may change both (frz_tracker_report.changed): a
    /// host has to read the triangles anew, and to take its own arrays along (frz_tracker_read_edits), which one that knows nothing of
    /// it does not do.
    pub rebuild: u32,
    /// A frz_tracker_match; FRZ_TRACKER_MATCH_FLAGGED is usual. Without rebuild it does nothing.
    pub r#match: u32,
    /// Least count of particles in a part of a mesh that is rebuilt, up to 1000000; those up to half a spacing outside count where any is
    /// inside. Parts with fewer are taken away, and drops with fewer get no mesh; a mesh of one part stays. 1 is usual: only parts without any go. 0 is as 1.
    pub min_drop: u32,
    /// 0.
    pub reserved3: u32,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_tracker_params {
    const SIZES: &'static [usize] = &[
        std::mem::offset_of!(frz_tracker_params, rebuild),
        std::mem::offset_of!(frz_tracker_params, min_drop),
        size_of::<Self>(),
    ];
    const NAME: &'static str = "frz_tracker_params";
}

impl frz_tracker_params {
    pub(in crate::capi) fn defaults() -> Self {
        let defaults = Params::for_spacing(0.0);
        Self {
            struct_size: 0,
            flags: 0,
            spacing: defaults.spacing,
            cell: defaults.cell,
            change: defaults.change,
            half_life: defaults.half_life,
            fade: defaults.fade,
            weighting: FRZ_TRACKER_AFFINE as u32,
            reserved: 0,
            rebuild: u32::from(defaults.rebuild),
            r#match: FRZ_TRACKER_MATCH_FLAGGED as u32,
            min_drop: defaults.min_drop as u32,
            reserved3: 0,
        }
    }

    /// The library's own parameters; what is out of range is named.
    pub(in crate::capi) fn params(&self) -> Outcome<Params> {
        no_flags(self.flags, 0)?;
        within("reserved", f64::from(self.reserved), 0.0..=0.0, "")?;
        within("rebuild", f64::from(self.rebuild), 0.0..=1.0, "")?;
        within("reserved3", f64::from(self.reserved3), 0.0..=0.0, "")?;
        let numbers = [self.spacing, self.cell, self.change, self.fade];
        for (name, value) in ["spacing", "cell", "change", "fade"].into_iter().zip(numbers) {
            finite(name, value)?;
        }
        let weighting = meaning("weighting", "frz_tracker_weighting", self.weighting, &WEIGHTINGS)?;
        let every = meaning("match", "frz_tracker_match", self.r#match, &MATCHES)?;
        let params = Params {
            spacing: self.spacing,
            cell: self.cell,
            change: self.change,
            weighting,
            half_life: self.half_life,
            fade: self.fade,
            rebuild: self.rebuild == 1,
            every,
            min_drop: self.min_drop as usize,
        };
        params.validate()?;
        Ok(params)
    }
}

/// Fills parameters with the usual values; the spacing must be set.
///
/// params: receives them.
/// size: sizeof(frz_tracker_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_params_init(params: *mut frz_tracker_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have so many bytes.
    guard(|| unsafe { fill(params, Some(size), frz_tracker_params::defaults()) })
}
