//! Ledges of shallow liquid: where its surface ends over nothing, and comes down to the ground's edge.

use super::frz_shallow_size;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::change;
use crate::capi::ffi::views::fill;
use crate::capi::runtime::context::{enter_light, frz_context};
use crate::capi::shallow::liquid::{Spill, frz_shallow};
use crate::capi::shallow::terrain::Terrain;
use crate::shallow::surface::Counts;
use crate::shallow::surface::rim::ledges::Ledges;

/// Ledges of a liquid.
#[derive(Default)]
pub(in crate::capi) struct Ledged {
    ledges: Ledges,
    /// Whether they are of the ground as it is.
    pub is_current: bool,
}

impl Ledged {
    /// The ledges of a surface that may want them, or the failure of one that does where there are none.
    pub(in crate::capi) fn wanted(&self, is_skirted: bool, when: &str) -> Outcome<Option<&Ledges>> {
        if is_skirted && !self.is_current {
            return Err(Failure::argument(format!(
                "FRZ_SHALLOW_SKIRTED: frz_shallow_find_ledges has found no ledges {when}"
            )));
        }
        Ok(is_skirted.then_some(&self.ledges))
    }

    /// Takes those of another, if they are of its ground as it is.
    pub(in crate::capi) fn copy_from(&mut self, other: &Self) {
        self.is_current = other.is_current;
        if self.is_current {
            self.ledges.copy_from(&other.ledges);
        }
    }
}

/// Finds where the ground ends over nothing, as at the edges of shelves and of holes, for surfaces with FRZ_SHALLOW_SKIRTED. With the mesh that the liquid
/// was made with it finds where between the middles of cells that is; on other ground the surface goes on for half a cell. In real time (frz_shallow): it
/// looks at all triangles once; after frz_shallow_update_terrain or _set_bodies have moved something it is called again, before the next such surface.
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
            let Spill { shallow, terrain, ledged: Ledged { ledges, is_current }, .. } = &mut *spill;
            let columns = shallow.columns();
            *is_current = false;
            match terrain {
                Terrain::Mesh(mesh) => ledges.fit(columns, &mesh.positions, &mesh.triangles)?,
                _ => ledges.find(columns),
            }
            *is_current = true;
            let most = ledges.bound();
            if size.is_null() { Ok(()) } else { fill(size, None, most.into()) }
        }
    })
}
