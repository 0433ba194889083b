//! What every host of the C interface does: threads and a context on them, calls that must work, arrays as views, answers in two
//! calls.

use std::ffi::{CStr, c_void};
use std::ptr::null_mut;
use std::sync::OnceLock;
use std::time::Instant;

use frazil::capi::level_set::body::{frz_body, frz_body_init};
use frazil::capi::mesh::triangles::*;
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

/// A struct of zeroes that begins with its size.
pub fn sized<T>() -> T {
    // SAFETY: structs of the interface are numbers and pointers, of which zero is a value.
    let mut out: T = unsafe { std::mem::zeroed() };
    // SAFETY: they begin with their size.
    unsafe { (&raw mut out).cast::<u32>().write(size_of::<T>() as u32) };
    out
}

/// A struct with the defaults that a function fills in.
pub fn defaults<T>(init: unsafe extern "C" fn(*mut T, usize) -> frz_status) -> T {
    let mut out = sized();
    // SAFETY: the struct is there, and has this size.
    works(unsafe { init(&mut out, size_of::<T>()) });
    out
}

/// A body that goes from one pose to another; both, and the triangles, must outlive it.
pub fn body_between([from, to]: [&[[f32; 3]]; 2], triangles: &[[u32; 3]]) -> frz_body {
    let mut body = defaults(frz_body_init);
    body.id = 1;
    (body.positions, body.positions_end) = (view(from), view(to));
    body.indices = view(triangles.as_flattened());
    body
}

/// The handle that a call makes, which is to be destroyed.
pub fn made<T>(make: impl FnOnce(*mut *mut T) -> frz_status) -> *mut T {
    let mut out = null_mut();
    works(make(&mut out));
    out
}

/// A mesh, which is to be destroyed.
pub fn mesh(ctx: *mut frz_context, positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> *mut frz_mesh {
    let mut desc: frz_mesh_desc = sized();
    (desc.positions, desc.indices) = (view(positions), view(triangles.as_flattened()));
    // SAFETY: the pointers are valid.
    made(|mesh| unsafe { frz_mesh_create(ctx, &desc, mesh) })
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

/// Microseconds since the first call, on the wall.
pub fn clock() -> u64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_micros() as u64
}
