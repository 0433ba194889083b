//! Minimum heights of shallow liquid: how far its films are raised so that the ground's mesh does not show through them.

use super::prepared::FoundHeights;
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{enter_light, frz_context};
use crate::capi::shallow::ground::{Terrain, cells_in};
use crate::capi::shallow::handle::{ShallowHandle, frz_shallow};
use crate::shallow::surface::heights::minimum_heights::{Distance, Fitted};

/// Distances between a thin film and the ground's mesh, in edges of a cell, each finite and 0 or more.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_distance {
    /// sizeof(frz_shallow_distance).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Minimum height of the surface over wet ground; default 0.05.
    pub least: f64,
    /// Height of the surface over the mesh's vertices; default 0.01.
    pub margin: f64,
    /// Depth of the surface's rim below the mesh's vertices and below dry ground; default 0.1. More than the margin.
    pub rim: f64,
}

sized32!(frz_shallow_distance, [], Distance::default().into());

fields_of!(Distance <=> frz_shallow_distance { least, margin, rim });

/// Counts of the mesh's vertices that face up, among those that a call visited.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_fitted {
    /// sizeof(frz_shallow_fitted), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// All of them.
    pub upward: u64,
    /// Vertices more than a cell above the surrounding ground, which may show through the surface.
    pub discarded: u64,
    /// Of the others, those so close to a ceiling that the surface cannot cover them.
    pub capped: u64,
}

sized32!(frz_shallow_fitted);

fields_of!(Fitted => frz_shallow_fitted { upward, discarded, capped });

/// Finds the minimum heights of all columns, or of those that have changed, from the mesh that the liquid was created with, for surfaces
/// with FRZ_SHALLOW_LIFTED (a real-time call: see frz_shallow). They change what is shown, not the flow. It visits all triangles once. Call
/// it again after frz_shallow_update_terrain or frz_shallow_set_bodies have moved something, before the next such surface.
///
/// distance: NULL for the defaults. If it differs from that of the last call, pass NULL for bounds.
/// bounds: double[4], minimum x, minimum z, maximum x and maximum z (m) of all triangles and bodies that have moved since the last call, at
///     their old and their new positions. NULL, and the first time: all columns.
/// fitted: receives counts of the vertices, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_find_lifts(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    distance: *const frz_shallow_distance,
    bounds: *const f64,
    fitted: *mut frz_shallow_fitted,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        reports(fitted, || {
            let distance = given_or_defaults(distance)?;
            no_flags(distance.flags, 0)?;
            let _call = enter_light(context)?;
            let ShallowHandle {
                shallow,
                surroundings,
                found_heights: FoundHeights { heights, is_current },
                ..
            } = &mut *change(shallow)?;
            let cells = cells_in(&shallow.columns().grid, bounds)?;
            let Terrain::Mesh(mesh) = &surroundings.terrain else {
                return Err(Failure::argument(
                    "the liquid was not made with a mesh: it needs no minimum heights",
                ));
            };
            let (columns, distance) = (shallow.columns(), distance.over(Distance::default()));
            let (positions, triangles) = (&mesh.positions, &mesh.triangles);
            let found = if heights.least().is_empty() {
                heights.reserve(columns.strips().len(), positions.len());
                heights.find(columns, positions, triangles, distance)?
            } else {
                heights.update(columns, positions, triangles, distance, cells)?
            };
            *is_current = true;
            Ok(found)
        })
    })
}
