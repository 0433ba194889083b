//! The only access to OpenVDB: grids of floats and vectors, points, level-set tools and .vdb files.
//!
//! Each grid owns its tree; leaves are lent without copying. Index space is world-fixed: the centre of voxel (i, j, k) is at (i, j, k) x
//! voxel size, unless a file has another transform.

mod bridge;
pub mod changes;
pub mod distances;
pub mod file;
mod grid;
pub(crate) mod grid_info;
mod leaf;
pub mod level_set;
mod point_arrays;
pub mod points;
pub mod reading;
mod refusal;
mod vectors;
pub(crate) mod write_options;

pub use grid::{FloatGrid, GridClass, MetaValue, PreparedBlocks, Tile};
pub use leaf::{Leaf, LeafMut, Probe, Vectors};
pub use vectors::{AnyGrid, GridRef, VectorEdit, VectorGrid, VectorLeaf, VectorProbe};

use crate::context::{Context, Running};
use crate::error::Error;

/// Metadata of a fog volume: the density (1/m) that a value of 1 stands for; the values are not multiplied by it.
pub const DENSITY_SCALE_KEY: &str = "frazil:density_scale";

fn fail(error: cxx::Exception) -> Error {
    refusal::error_of(error.what())
}

/// Threads and cancel flag for a call into C++; the second value must outlive the call.
fn call(ctx: &Context) -> (bridge::ffi::Call, Running) {
    let running = ctx.begin();
    let cancel = running.latch().as_ptr() as usize;
    (bridge::ffi::Call { threads: ctx.pool().threads() as i32, cancel }, running)
}

/// Ends the worker threads that OpenVDB's tools have started in this process; they restart when needed. Threads that other users of TBB in
/// the process hold are kept. No tool may run at the same time.
pub fn end_workers() {
    bridge::ffi::end_workers();
}

/// A call on the caller's thread that cannot be cancelled.
fn uncancellable_call() -> bridge::ffi::Call {
    bridge::ffi::Call { threads: 1, cancel: 0 }
}
