//! Arrays of handles from a host.

use super::guard::Outcome;
use super::handle::{HandleType, Reading, read};
use super::views::frz_view;

/// The handles behind a host's array of pointers, to read.
///
/// # Safety
/// `list` must be NULL or point to `count` pointers, each as for [`read`].
pub(in crate::capi) unsafe fn read_each<'a, N: HandleType>(
    list: *const *const N,
    count: usize,
    name: &str,
) -> Outcome<Vec<Reading<'a, N::Value>>> {
    // SAFETY: guaranteed by the caller.
    let pointers = unsafe { frz_view::packed(list, count).elements::<*const N>(name) }?;
    // SAFETY: as above.
    pointers.iter().map(|&pointer| unsafe { read(pointer) }).collect()
}
