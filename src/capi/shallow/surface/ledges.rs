//! Ledges of shallow liquid: where the ground ends, and the surface comes down to its edge.

use super::frz_shallow_size;
use super::prepared::FoundLedges;
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;
use crate::capi::shallow::calls::changes;
use crate::capi::shallow::ground::Terrain;
use crate::capi::shallow::handle::{ShallowHandle, frz_shallow};

/// Finds the ledges, where the ground ends, as at the edges of shelves and of holes, for surfaces with FRZ_SHALLOW_SKIRTED. With the mesh
/// that the liquid was created with, the edge is located between the centres of cells; on other ground the surface extends by half a cell.
/// A real-time call (see frz_shallow): it visits all triangles once. Call it again after frz_shallow_update_terrain or
/// frz_shallow_set_bodies have moved something, before the next such surface.
///
/// size: receives the maximum that this adds to frz_shallow_surface_bound, all zeroes after a failure; may be NULL. Its struct_size is set
///     by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_find_ledges(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, shallow, size, |_, liquid| {
            let ShallowHandle {
                shallow,
                surroundings,
                found_ledges: FoundLedges { ledges, silhouette, is_current },
                ..
            } = liquid;
            let columns = shallow.columns();
            *is_current = false;
            match &surroundings.terrain {
                Terrain::Mesh(mesh) => silhouette.fit(ledges, columns, &mesh.positions, &mesh.triangles)?,
                _ => ledges.find(columns),
            }
            *is_current = true;
            Ok(ledges.bound())
        })
    }
}
