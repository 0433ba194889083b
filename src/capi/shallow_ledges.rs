//! Ledges of shallow liquid: where its surface ends over nothing, and comes down to the ground's edge.

use std::sync::Arc;

use super::context::{enter_light, frz_context};
use super::guard::{Failure, Outcome, frz_status, guard};
use super::handle::change;
use super::shallow::frz_shallow;
use super::shallow_surface::frz_shallow_size;
use super::shallow_terrain::Terrain;
use super::views::fill;
use crate::shallow::surface::Counts;
use crate::shallow::surface::ledges::Ledges;

/// The failure of a surface for which there are no ledges.
pub(super) fn no_ledges(when: &str) -> Failure {
    Failure::argument(format!("FRZ_SHALLOW_SKIRTED: frz_shallow_find_ledges has found no ledges {when}"))
}

/// The ledges of a surface that wants them, or none.
pub(super) fn wanted<'a>(
    is_skirted: bool,
    ledges: &'a Option<Arc<Ledges>>,
    when: &str,
) -> Outcome<Option<&'a Ledges>> {
    match ledges {
        Some(ledges) if is_skirted => Ok(Some(ledges)),
        None if is_skirted => Err(no_ledges(when)),
        _ => Ok(None),
    }
}

/// Finds where the ground ends over nothing, as at the edges of shelves and of holes, for surfaces with FRZ_SHALLOW_SKIRTED. With the mesh that the liquid
/// was made with it finds where between the middles of cells that is; on other ground the surface goes on for half a cell. It looks at all of the
/// ground, some milliseconds long, and allocates: once for ground that rests, and again after frz_shallow_update_terrain or _set_bodies have moved
/// something, before the next such surface.
///
/// size: receives the most that this adds to frz_shallow_surface_bound, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_find_ledges(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    size: *mut frz_shallow_size,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            if !size.is_null() {
                fill(size, None, Counts::default().into())?;
            }
            let _call = enter_light(context)?;
            let mut spill = change(shallow)?;
            let (columns, mut ledges) = (spill.shallow.columns(), Ledges::default());
            match &spill.terrain {
                Terrain::Mesh(mesh) => ledges.fit(columns, &mesh.positions, &mesh.triangles)?,
                _ => ledges.find(columns),
            }
            let most = ledges.bound();
            spill.ledges = Some(Arc::new(ledges));
            if size.is_null() { Ok(()) } else { fill(size, None, most.into()) }
        }
    })
}
