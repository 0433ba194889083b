//! Replacing a tracker's mesh by one that was edited by hand.

use super::handle::{Edits, frz_tracker};
use super::mesh::{frz_particles, particles};
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::{enter, frz_context};
use crate::mesh_repair::Source;
use crate::surface::Outlook;

/// Replaces the tracker's mesh by an edited one: an artist's change in the middle of a shot. The distance of each new vertex from the
/// particles' surface is measured now, and kept from then on. After a failure or a cancel the tracker is as it was.
///
/// The parameters stay. All vertices and triangles count as new: frz_tracker_edits reports 1, and FRZ_EDIT_BEFORE holds the positions to
/// which the last step moved the previous vertices. States saved from then on hold the edited mesh, but are still restored with the mesh
/// that the tracker was created with (frz_tracker_create).
///
/// mesh: as for frz_tracker_create, with any vertices and faces, in the particles' space; it is copied. Its attribute "detail", of one
///     float, says where detail does not fade, even if the previous mesh had no such attribute.
/// particles: those at the end of the last step, or those that the tracker was created with: the next step begins with them.
///
/// One thread at a time; any number may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_resculpt(
    context: *mut frz_context,
    tracker: *mut frz_tracker,
    mesh: *const frz_mesh,
    particles: *const frz_particles,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let mut handle = change(tracker)?;
        let mesh = read(mesh)?;
        let particles = self::particles(particles)?;
        let detail_retention = mesh.attribute("detail", 1).unwrap_or_default().to_vec();
        let before = handle.tracker.vertices().to_vec();
        let handle = &mut *handle;
        handle.tracker.resculpt(call.ctx(), &mesh.triangles, detail_retention, &particles)?;
        let now = &handle.tracker;
        handle.edits = Some(Edits {
            origins: vec![None; now.vertices().len()],
            sources: vec![Source::New; now.triangles().len()],
            before,
        });
        handle.outlook = Outlook::default();
        handle.saved.take();
        Ok(())
    })
}
