//! A mesh that was edited by hand takes the place of a tracker's.

use super::edits::Edits;
use super::mesh::{frz_particles, frz_tracker, particles};
use crate::capi::ffi::guard::{frz_status, guard};
use crate::capi::ffi::handle::{change, read};
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::{enter, frz_context};
use crate::mesh_repair::Source;
use crate::surface::Outlook;

/// Puts an edited mesh in the place of the tracker's: an artist's change in the middle of a shot. How far each of its vertices is from
/// the particles' surface is measured anew, and kept from there on. After a failure or a cancel the tracker is as it was.
///
/// The parameters stay. No vertex and no triangle is one from before: frz_tracker_edits answers 1, and frz_tracker_read_edits says that
/// all were made; the positions from before (FRZ_EDIT_BEFORE) are those to which the last step led. States that are saved from then on
/// hold the edited mesh, and still come back with the mesh that the tracker was made with (frz_tracker_create).
///
/// mesh: as frz_tracker_create takes it, with any vertices and faces, in the particles' space; it is copied. Its attribute "detail" of
///     one float says what does not fade, also where the mesh before had none.
/// particles: at the time to which the last step led, or at which the tracker began: the next step begins with them.
///
/// One thread at a time; any number may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_resculpt(
    context: *mut frz_context,
    tracker: *mut frz_tracker,
    mesh: *const frz_mesh,
    particles: *const frz_particles,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let call = enter(context)?;
            let mut follower = change(tracker)?;
            let mesh = read(mesh)?;
            let particles = self::particles(particles)?;
            let lasting = mesh.attribute("detail", 1).unwrap_or_default().to_vec();
            let before = follower.tracker.vertices().to_vec();
            let follower = &mut *follower;
            follower.tracker.resculpt(call.ctx(), &mesh.triangles, lasting, &particles)?;
            let now = &follower.tracker;
            follower.edits = Some(Edits {
                origins: vec![None; now.vertices().len()],
                sources: vec![Source::New; now.triangles().len()],
                before,
            });
            follower.outlook = Outlook::default();
            follower.saved.take();
            Ok(())
        }
    })
}
