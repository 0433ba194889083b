//! Parameters of a tracker, in C.

use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::surface::{Params, Weighting};

/// How particles carry vertices.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_weighting {
    /// By affine maps: exact where the liquid rotates and stretches.
    FRZ_TRACKER_AFFINE = 0,
    /// By their mean, as in the thesis: it lags behind.
    FRZ_TRACKER_MEAN = 1,
}

/// Where a mesh that is rebuilt is matched to the topology of the liquid.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_match {
    /// Where vertices are flagged, and at drops that the mesh does not cover.
    FRZ_TRACKER_MATCH_FLAGGED = 0,
    /// Everywhere in every step: also at bubbles, and where the mesh differs from the liquid between vertices by more than the surrounding
    /// detail. Slower.
    FRZ_TRACKER_MATCH_EVERY = 1,
}

use frz_tracker_match::*;
use frz_tracker_weighting::*;

const WEIGHTINGS: [(u32, Weighting); 2] =
    [(FRZ_TRACKER_AFFINE as u32, Weighting::Affine), (FRZ_TRACKER_MEAN as u32, Weighting::Mean)];

/// Numbers of frz_tracker_match, with [`Params::every`].
const MATCHES: [(u32, bool); 2] =
    [(FRZ_TRACKER_MATCH_FLAGGED as u32, false), (FRZ_TRACKER_MATCH_EVERY as u32, true)];

/// Parameters of a tracker. All but spacing, cell and rebuild may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_tracker_params {
    /// sizeof(frz_tracker_params).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Initial distance r between particles (m), 1e-9 to 1e6: see frz_particles_spacing. No default: it must be set.
    pub spacing: f64,
    /// Edge of a cell of the particles' surface (r), 0.125 to 2; default 0.5.
    pub cell: f64,
    /// Vertices that would be moved farther than this (r) to keep their detail are flagged, 0.001 to 100; default 0.5. The liquid has
    /// merged or split there.
    pub change: f64,
    /// Time (s) in which half of the detail fades, above 0; default infinite: it does not fade. Where the mesh's attribute "detail", of one
    /// float, is 1, detail never fades; where the attribute is 0, detail fades at this rate. A new vertex takes the mean of this attribute
    /// over those of its neighbours that existed before, 0 without any.
    pub half_life: f64,
    /// How much detail fades where the mesh is strained, 0 to 1000: a change of lengths by a factor of e leaves exp(-fade) of the detail.
    /// Default 0: it does not fade.
    pub fade: f64,
    /// A frz_tracker_weighting; default FRZ_TRACKER_AFFINE.
    pub weighting: u32,
    /// Must be 0.
    pub reserved: u32,
    /// 1: where the liquid merges or splits, the mesh is rebuilt and merges or splits with it; where it is stretched or compressed, edges
    /// are split or collapsed. The mesh must be closed, a 2-manifold by its indices. 0, the default: the mesh keeps the vertices and faces
    /// that it was created with, or was given by frz_tracker_resculpt, and is flagged where it no longer fits. With 1 any step may change
    /// both (frz_tracker_report.changed): the host must then read the triangles again and carry its own arrays along
    /// (frz_tracker_read_edits). A host that does not do this leaves it at 0.
    pub rebuild: u32,
    /// A frz_tracker_match; default FRZ_TRACKER_MATCH_FLAGGED. No effect without rebuild.
    pub r#match: u32,
    /// Minimum number of particles in a part of a rebuilt mesh, up to 1000000; default 1. Particles up to half a spacing outside a part
    /// count if any is inside it. Parts with fewer are removed, and drops with fewer get no mesh; a mesh of one part stays. 1 removes only
    /// parts without particles. 0 means 1.
    pub min_drop: u32,
    /// Must be 0.
    pub reserved3: u32,
}

sized32!(frz_tracker_params, [rebuild, min_drop], {
    let (weighting, r#match) = (FRZ_TRACKER_AFFINE as u32, FRZ_TRACKER_MATCH_FLAGGED as u32);
    let params = Params::for_spacing(0.0);
    Self { weighting, r#match, rebuild: u32::from(params.rebuild), ..params.into() }
});

fields_of!(Params <=> frz_tracker_params { spacing, cell, change, half_life, fade, min_drop });

impl frz_tracker_params {
    /// The library's own parameters; an error names a field that is out of range.
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
        let params = self.over(Params::for_spacing(self.spacing));
        let params = Params { weighting, rebuild: self.rebuild == 1, every, ..params };
        params.validate()?;
        Ok(params)
    }
}

/// Fills parameters with the defaults; spacing must be set.
///
/// params: receives the defaults.
/// size: sizeof(frz_tracker_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_params_init(params: *mut frz_tracker_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have `size` bytes.
    guard(|| unsafe { fill(params, Some(size), frz_tracker_params::defaults()) })
}
