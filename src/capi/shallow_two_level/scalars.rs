//! Scalars of shallow liquid in cells of two sizes.

use super::liquid::frz_shallow_detail;
use crate::capi::ffi::guard::{frz_status, guard};
use crate::capi::ffi::handle::{change, read};
use crate::capi::ffi::views::{fill, frz_view};
use crate::capi::shallow::scalars::{
    check_scalar, frz_shallow_scalar, frz_shallow_scalar_balance, of_scalars, read_scalars,
};
use crate::shallow::ScalarBalance;

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
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            let mut spread = change(detail)?;
            let given = read_scalars(scalars, count)?;
            Ok(spread.detail.set_scalars(&given)?)
        }
    })
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
    guard(|| {
        // SAFETY: the liquid is NULL or alive; the view is valid.
        unsafe {
            let mut spread = change(detail)?;
            let given = of_scalars(spread.detail.scalars().len(), &concentrations)?;
            Ok(spread.detail.set_poured(&given[..concentrations.count])?)
        }
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
    guard(|| {
        // SAFETY: the liquid is NULL or alive; the view is valid.
        unsafe {
            let mut spread = change(detail)?;
            let given = of_scalars(spread.detail.scalars().len(), &concentrations)?;
            Ok(spread.detail.set_sourced(flow, &given[..concentrations.count])?)
        }
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
    guard(|| {
        // SAFETY: the pointers are NULL or valid.
        unsafe {
            fill(balance, None, ScalarBalance::default().into())?;
            let spread = read(detail)?;
            let scalar = check_scalar(spread.detail.fine(), scalar)?;
            fill(balance, None, spread.detail.scalar_balance(scalar)?.into())
        }
    })
}
