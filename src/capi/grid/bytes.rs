//! Grids as .vdb files, on disk and in memory.

use std::ffi::{c_char, c_void};
use std::path::Path;

use super::sparse::{Grid, frz_grid};
use crate::capi::ffi::saved::write_bytes;
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, enter, frz_context};
use crate::context::Context;
use crate::vdb::write_options::{Compression, WriteOptions};
use crate::vdb::{AnyGrid, GridRef, file};

/// Compression of the values of a .vdb file.
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

/// Flag of frz_grid_save and frz_grid_to_bytes: values are stored in 16 bits, for files that are only rendered.
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

/// The grids of a host's array, whose names must differ.
///
/// # Safety
/// `grids` must be NULL or point to `count` pointers to grids.
unsafe fn read_grids<'a>(grids: *const *const frz_grid, count: usize) -> Outcome<Vec<Reading<'a, Grid>>> {
    // SAFETY: guaranteed by the caller.
    let grids = unsafe { read_each(grids, count, "grids") }?;
    refuse(grids.is_empty(), || "grids: the list is empty")?;
    let mut names: Vec<String> = grids.iter().map(|grid| grid.any().name()).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::argument(format!("grids: two of them are named \"{}\"", twice[0])));
    }
    Ok(grids)
}

/// The body of an interface function that reads a grid from a file.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn loads(
    context: *mut frz_context,
    [path, name]: [*const c_char; 2],
    out: *mut *mut frz_grid,
    load: impl FnOnce(&Context, &Path, Option<&str>) -> Outcome<AnyGrid>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    unsafe {
        creates(context, out, |ctx| {
            let path = Path::new(required_text(path, "path")?);
            load(ctx, path, text(name, "name")?)
        })
    }
}

/// Reads a grid of floats or of vectors from a .vdb file. A cancel takes effect before and after the work, not during it.
///
/// path: UTF-8.
/// name: which grid; NULL for the first level set, else the first grid of floats, else the first of vectors. If there is no such grid
///     FRZ_ERROR_FILE lists the existing ones; if its type is not supported FRZ_ERROR_FILE names the type.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe { loads(context, [path, name], out, load) }
}

/// Writes grids into one .vdb file. The file appears only when complete: it is written under a temporary name first. A cancel takes effect
/// before the writing begins, not during it.
///
/// grids: count pointers to grids with different names.
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let call = enter(context)?;
        let ctx = call.ctx();
        let path = Path::new(required_text(path, "path")?);
        let options = options(compression, flags)?;
        let grids = read_grids(grids, count)?;
        let list: Vec<GridRef<'_>> = grids.iter().map(|grid| grid.any()).collect();
        Ok(ctx.phase_in_place("write", || file::write_any(path, &list, &options))?)
    })
}

/// Reads a grid of floats or of vectors from the bytes of a .vdb file.
///
/// The bytes must come from a .vdb file: OpenVDB does not survive every kind of damage. Bytes that cannot be used are FRZ_ERROR_FILE. A
/// cancel takes effect before and after the work, not during it.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            ctx.allow("a grid from bytes", size as u64)?;
            let bytes = frz_view::packed(bytes, size).elements::<u8>("bytes")?;
            let name = text(name, "name")?;
            Ok(ctx.phase("read", || file::any_from_bytes(&bytes, name))?)
        })
    }
}

/// Writes grids as the bytes of one .vdb file; equal grids give equal bytes. A cancel takes effect before and after the work, not during
/// it.
///
/// grids: count pointers to grids with different names.
/// compression: a frz_compression.
/// flags: 0 or FRZ_HALF, which is refused for numbers over 65,504.
/// dst: room for capacity bytes. NULL: only an upper bound of the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
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
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(size);
        let call = enter(context)?;
        let ctx = call.ctx();
        let options = options(compression, flags)?;
        let grids = read_grids(grids, count)?;
        let list: Vec<GridRef<'_>> = grids.iter().map(|grid| grid.any()).collect();
        let bound = || list.iter().map(|grid| grid.file_bound() as usize).sum();
        let bytes = || Ok(ctx.phase("write", || file::any_to_bytes(&list, &options))?);
        write_bytes(dst, capacity, size, bound, bytes)
    })
}
