//! What every host of the C interface does: threads and a context on them, calls that must work, arrays as views, answers in two
//! calls.

use std::ffi::{CStr, c_void};
use std::ptr::null_mut;

use frazil::capi::runtime::context::*;
use frazil::capi::runtime::library::{FRZ_ABI_VERSION, frz_last_error};
use frazil::capi::runtime::pool::*;
use frazil::capi::{frz_status, frz_view};

/// A pool, and a context on it.
pub struct Threads {
    pool: *mut frz_pool,
    pub ctx: *mut frz_context,
}

impl Threads {
    pub fn new(count: u32) -> Self {
        let mut threads = Self { pool: null_mut(), ctx: null_mut() };
        // SAFETY: the pointers are valid.
        unsafe {
            works(frz_pool_create(count, &mut threads.pool));
            works(frz_context_create(FRZ_ABI_VERSION, threads.pool, &mut threads.ctx));
        }
        threads
    }

    /// Takes a cancel back.
    pub fn reset(&self) {
        // SAFETY: the context is there until this is dropped.
        unsafe { frz_context_reset(self.ctx) };
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        // SAFETY: what was made on them was destroyed before.
        unsafe {
            frz_context_destroy(self.ctx);
            frz_pool_destroy(self.pool);
        }
    }
}

pub fn works(status: frz_status) {
    // SAFETY: the text ends with a zero.
    let said = unsafe { CStr::from_ptr(frz_last_error()) };
    assert_eq!(status, frz_status::FRZ_OK, "{said:?}");
}

pub fn view<T>(elements: &[T]) -> frz_view {
    frz_view { data: elements.as_ptr().cast(), count: elements.len(), stride: 0 }
}

/// The bytes that a call writes into room (and its size), of which it says first how much it needs.
pub fn written(call: impl Fn(*mut c_void, usize, *mut usize) -> frz_status) -> Vec<u8> {
    let mut size = 0;
    works(call(null_mut(), 0, &mut size));
    let mut out = vec![0u8; size];
    works(call(out.as_mut_ptr().cast(), size, &mut size));
    out.truncate(size);
    out
}
