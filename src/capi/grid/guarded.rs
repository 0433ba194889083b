//! Grids from files that may be damaged, read by another process.

use std::ffi::c_char;

use super::bytes::loads;
use super::sparse::frz_grid;
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;
use crate::vdb::reading::guard::Guard;

/// Reads a grid of floats or of vectors from a .vdb file that may be damaged, as frz_grid_load does, but in another process.
///
/// OpenVDB does not survive every kind of damage: a file with a flipped bit can crash frz_grid_load, and the host with it, or make it run
/// forever. Here the frazil program reads the file, within limits of time and memory that depend on the file's size and the context's
/// memory limit, and passes the grid on in shared memory. Reading takes some 10 % longer, and starting the program 20 to 50 ms. A crash, an
/// infinite loop or excessive memory use is FRZ_ERROR_FILE. A cancel takes effect within 10 ms.
///
/// program: UTF-8; path of the frazil program, of this library's version. FRZ_ERROR_IO if it cannot be started.
/// path: UTF-8.
/// name: as in frz_grid_load.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_load_guarded(
    context: *mut frz_context,
    program: *const c_char,
    path: *const c_char,
    name: *const c_char,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        loads(context, [path, name], out, |ctx, path, name| {
            let guard = Guard {
                program: required_text(program, "program")?.into(),
                memory: ctx.memory_limit(),
                threads: ctx.pool().threads(),
                cancel: ctx.cancel_flags()[1].clone(),
            };
            let grid = ctx.phase("read", || guard.read_any(path, name))?;
            ctx.allow(&path.display().to_string(), grid.borrow().memory_bytes())?;
            Ok(grid)
        })
    }
}
