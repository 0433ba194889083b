//! Scalars of shallow liquid in cells of two sizes.

use super::liquid::frz_shallow_detail;
use crate::capi::ffi::*;
use crate::capi::shallow::calls::informs;
use crate::capi::shallow::scalars::{
    frz_shallow_scalar, frz_shallow_scalar_balance, read_scalars, with_concentrations,
};

/// Sets the scalars that the liquid carries, as frz_shallow_set_scalars does. None of them thickens it.
///
/// scalars: count scalars; NULL with a count of 0: none. After a failure the old ones are kept.
/// count: number of scalars, up to FRZ_SHALLOW_MOST_SCALARS.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_scalars(
    detail: *mut frz_shallow_detail,
    scalars: *const frz_shallow_scalar,
    count: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { Ok(change(detail)?.detail.set_scalars(&read_scalars(scalars, count)?)?) })
}

/// Sets the concentrations of scalars in liquid that frz_shallow_detail_pour and _fill add from now on; initially 0.
///
/// concentrations: double for each scalar, in their order, within its range.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_poured(
    detail: *mut frz_shallow_detail,
    concentrations: frz_view,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; the view is valid.
    guard(|| unsafe {
        let detail = &mut change(detail)?.detail;
        with_concentrations(detail.scalars().len(), &concentrations, |given| detail.set_poured(given))
    })
}

/// Sets the concentrations of scalars in liquid from a source; 0 after frz_shallow_detail_set_flows.
///
/// flow: index of the flow point, from 0.
/// concentrations: double for each scalar, in their order, within its range.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_set_sourced(
    detail: *mut frz_shallow_detail,
    flow: usize,
    concentrations: frz_view,
) -> frz_status {
    // SAFETY: the liquid is NULL or alive; the view is valid.
    guard(|| unsafe {
        let detail = &mut change(detail)?.detail;
        with_concentrations(detail.scalars().len(), &concentrations, |given| detail.set_sourced(flow, given))
    })
}

/// Reports where all of a scalar is, and where it came from.
///
/// scalar: which, counted from 0.
/// balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid in cells of two sizes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_detail_get_scalar_balance(
    detail: *const frz_shallow_detail,
    scalar: u32,
    balance: *mut frz_shallow_scalar_balance,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        informs(balance, || {
            let detail = &read(detail)?.detail;
            let sum =
                detail.scalar_balance(check_index("scalar", scalar as usize, detail.scalars().len())?)?;
            Ok(frz_shallow_scalar_balance::of(sum))
        })
    }
}
