//! Function bodies that real-time calls share: they change an object, or report numbers.

use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter_light, frz_context};
use crate::context::Context;

/// The body of an interface function that changes an object in real time, and reports what it did unless `report` is NULL.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn changes<N: HandleType, T: Sized32, R: Into<T>>(
    context: *mut frz_context,
    object: *mut N,
    report: *mut T,
    work: impl FnOnce(&Context, &mut N::Value) -> Outcome<R>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        reports(report, || {
            let call = enter_light(context)?;
            work(call.ctx(), &mut *change(object)?)
        })
    })
}

/// The body of an interface function that fills a struct with properties of an object; all zeroes after a failure.
///
/// # Safety
/// The pointer must be NULL or valid.
pub(in crate::capi) unsafe fn informs<T: Sized32, R: Into<T>>(
    info: *mut T,
    work: impl FnOnce() -> Outcome<R>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe { reports(required(info, T::NAME)?, work) })
}

/// Runs the work of a call and writes the number that it returns to the host unless the pointer is NULL; 0 after a failure.
///
/// # Safety
/// `out` must be NULL or point to memory for a number.
pub(in crate::capi) unsafe fn answer_some(out: *mut f64, work: impl FnOnce() -> Outcome<f64>) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        write_some(out, 0.0);
        write_some(out, work()?);
    }
    Ok(())
}
