//! Grids as .vdb files, on disk and in memory.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::sparse::{Grid, frz_grid};
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{Reading, clear, read};
use crate::capi::ffi::views::{Plain, frz_view, meaning, required_text, text, write_bytes};
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, enter, frz_context};
use crate::context::Context;
use crate::vdb::file::{self, Compression, WriteOptions};
use crate::vdb::{AnyGrid, GridRef};

/// How the values of a .vdb file are packed.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_compression {
    /// Blosc: fast.
    FRZ_COMPRESSION_BLOSC = 0,
    /// Zip: small, slow.
    FRZ_COMPRESSION_ZIP = 1,
    /// None.
    FRZ_COMPRESSION_NONE = 2,
}

/// Flag of frz_grid_save and frz_grid_to_bytes: values in 16 bits, for files that are only rendered.
pub const FRZ_HALF: u32 = 1;

fn options(compression: u32, flags: u32) -> Outcome<WriteOptions> {
    no_flags(flags, FRZ_HALF)?;
    let known = [
        (frz_compression::FRZ_COMPRESSION_BLOSC as u32, Compression::Blosc),
        (frz_compression::FRZ_COMPRESSION_ZIP as u32, Compression::Zip),
        (frz_compression::FRZ_COMPRESSION_NONE as u32, Compression::None),
    ];
    let compression = meaning("compression", "frz_compression", compression, &known)?;
    Ok(WriteOptions { compression, half: flags & FRZ_HALF != 0, ..WriteOptions::default() })
}

/// A pointer to a grid, as an element of an array.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Pointer(*const frz_grid);

// SAFETY: a pointer, which is followed only as a handle.
unsafe impl Plain for Pointer {}

/// # Safety
/// `grids` must be NULL or `count` pointers to grids.
unsafe fn several<'a>(grids: *const *const frz_grid, count: usize) -> Outcome<Vec<Reading<'a, Grid>>> {
    let view = frz_view { data: grids.cast(), count, stride: 0 };
    // SAFETY: the caller's promise.
    let grids = unsafe { view.elements::<Pointer>("grids") }?;
    if grids.is_empty() {
        return Err(Failure::argument("grids: there is none"));
    }
    // SAFETY: as above.
    let grids: Vec<Reading<'a, Grid>> =
        grids.iter().map(|grid| unsafe { read(grid.0) }).collect::<Outcome<_>>()?;
    let mut names: Vec<String> = grids.iter().map(|grid| grid.any().name()).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::argument(format!("grids: two of them are named \"{}\"", twice[0])));
    }
    Ok(grids)
}

/// A function of the interface that reads a grid from a file.
///
/// # Safety
/// The pointers must be NULL or the caller's.
pub(in crate::capi) unsafe fn loads(
    context: *mut frz_context,
    [path, name]: [*const c_char; 2],
    out: *mut *mut frz_grid,
    load: impl FnOnce(&Context, &Path, Option<&str>) -> Outcome<AnyGrid>,
) -> frz_status {
    // SAFETY: the caller's promise.
    unsafe {
        creates(context, out, |ctx| {
            let path = Path::new(required_text(path, "path")?);
            Ok(Grid::Own(load(ctx, path, text(name, "name")?)?))
        })
    }
}

/// Reads a grid of floats or of vectors from a .vdb file. A cancel is heeded before and after the work, not within.
///
/// path: UTF-8.
/// name: which grid; NULL for the first level set, else the first grid of floats, else the first of vectors.
///     FRZ_ERROR_FILE names those that there are when it is not found, and the type when it is another.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_load(
    context: *mut frz_context,
    path: *const c_char,
    name: *const c_char,
    out: *mut *mut frz_grid,
) -> frz_status {
    let load = |ctx: &Context, path: &Path, name: Option<&str>| {
        Ok(ctx.phase("read", || {
            let memory = file::describe(path)?.iter().filter_map(|grid| grid.memory).max();
            ctx.allow(&path.display().to_string(), memory.unwrap_or(0))?;
            file::read_any(path, name)
        })?)
    };
    // SAFETY: the pointers are NULL or the caller's.
    unsafe { loads(context, [path, name], out, load) }
}

/// Writes grids into one .vdb file. The file appears only when complete: it is written under another name first. A cancel is
/// heeded before it is begun, not within.
///
/// grids: count pointers to grids of different names.
/// path: UTF-8; an existing file is replaced.
/// compression: a frz_compression.
/// flags: 0 or FRZ_HALF, which is refused for numbers over 65,504.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_save(
    context: *mut frz_context,
    grids: *const *const frz_grid,
    count: usize,
    path: *const c_char,
    compression: u32,
    flags: u32,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let call = enter(context)?;
            let ctx = call.ctx();
            let path = Path::new(required_text(path, "path")?);
            let options = options(compression, flags)?;
            let grids = several(grids, count)?;
            let list: Vec<GridRef<'_>> = grids.iter().map(|grid| grid.any()).collect();
            Ok(ctx.phase_in_place("write", || file::write_any(path, &list, &options))?)
        }
    })
}

/// Reads a grid of floats or of vectors from the bytes of a .vdb file.
///
/// Bytes must come from a .vdb file: OpenVDB does not survive every kind of damage. What cannot be used is
/// FRZ_ERROR_FILE. A cancel is heeded before and after the work, not within.
///
/// bytes: size bytes.
/// name: as in frz_grid_load.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_from_bytes(
    context: *mut frz_context,
    bytes: *const c_void,
    size: usize,
    name: *const c_char,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        creates(context, out, |ctx| {
            ctx.allow("a grid from bytes", size as u64)?;
            let bytes = frz_view { data: bytes, count: size, stride: 0 }.elements::<u8>("bytes")?;
            let name = text(name, "name")?;
            Ok(Grid::Own(ctx.phase("read", || file::any_from_bytes(&bytes, name))?))
        })
    }
}

/// Writes grids as the bytes of one .vdb file, the same bytes for the same grids. A cancel is heeded before and after the
/// work, not within.
///
/// grids: count pointers to grids of different names.
/// compression: a frz_compression.
/// flags: 0 or FRZ_HALF, which is refused for numbers over 65,504.
/// dst: room for capacity bytes. NULL: size receives a number that certainly suffices, and nothing is written.
/// capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
/// size: receives the bytes that were written, or are needed; 0 after other failures.
///
/// Any number of threads may read a grid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_grid_to_bytes(
    context: *mut frz_context,
    grids: *const *const frz_grid,
    count: usize,
    compression: u32,
    flags: u32,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(size);
            let call = enter(context)?;
            let ctx = call.ctx();
            let options = options(compression, flags)?;
            let grids = several(grids, count)?;
            let list: Vec<GridRef<'_>> = grids.iter().map(|grid| grid.any()).collect();
            let bound = || list.iter().map(|grid| grid.file_bound() as usize).sum();
            let bytes = || Ok(ctx.phase("write", || file::any_to_bytes(&list, &options))?);
            write_bytes(dst, capacity, size, bound, bytes)
        }
    })
}
