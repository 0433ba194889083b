//! The only door to OpenVDB: float grids, level-set tools and .vdb files.
//!
//! Grids own their trees alone; leaves are lent without copying. Index space is world-fixed: voxel
//! (i, j, k) has its centre at (i, j, k) x voxel size, unless a file brings another transform.

mod bridge;
mod child;
mod decode;
pub mod file;
mod grid;
pub mod guard;
pub mod layout;
mod leaf;
pub mod level_set;
mod mapping;
mod parcel;
pub mod ray;

pub use grid::{FloatGrid, GridClass, MetaValue, Ready, Tile};
pub use leaf::{Leaf, LeafMut, Probe};

use crate::context::{Context, Running};
use crate::error::Error;

/// Exception text of the C++ side's `Cancelled`.
const CANCELLED: &str = "frazil: cancelled";

fn fail(error: cxx::Exception) -> Error {
    match error.what() {
        CANCELLED => Error::Cancelled,
        what => Error::OpenVdb(what.to_string()),
    }
}

/// Threads and cancel flag for a call into C++, which is part of the second answer and must not outlive it.
fn call(ctx: &Context) -> (bridge::ffi::Call, Running) {
    let running = ctx.begin();
    let cancel = running.latch().as_ptr() as usize;
    (bridge::ffi::Call { threads: ctx.pool().threads() as i32, cancel }, running)
}

/// Ends the worker threads that OpenVDB's tools have started in this process; they start again when they are needed.
/// Threads that somebody else in the process uses are left alone. No tool may be at work meanwhile.
pub fn end_workers() {
    bridge::ffi::end_workers();
}

/// A call on the caller's thread that nobody can cancel.
fn alone() -> bridge::ffi::Call {
    bridge::ffi::Call { threads: 1, cancel: 0 }
}
