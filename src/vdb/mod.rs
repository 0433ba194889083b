//! The only door to OpenVDB: grids of floats and of vectors, level-set tools and .vdb files.
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
mod refusal;
mod vectors;

pub use grid::{FloatGrid, GridClass, MetaValue, Ready, Tile};
pub use leaf::{Leaf, LeafMut, Probe, Vectors};
pub use vectors::{AnyGrid, GridRef, VectorEdit, VectorGrid, VectorLeaf, VectorProbe};

use crate::context::{Context, Running};
use crate::error::Error;

fn fail(error: cxx::Exception) -> Error {
    refusal::told(error.what())
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
