//! .vdb files: written atomically, with the same bytes for the same grids.

pub use super::grid_info::GridInfo;
pub use super::write_options::{Compression, WriteOptions};
use std::path::Path;

use super::bridge::ffi;
use super::distances;
use super::grid::{FloatGrid, GridClass, MetaValue, to_meta};
use super::reading::{decode, guard, layout};
use super::vectors::{AnyGrid, GridRef};
use super::write_options::{codec_number, named_by_content};
use crate::context::Context;
use crate::error::{Error, Result};

/// Writes grids to a file, atomically.
///
/// # Errors
/// As [`to_bytes`], or what the operating system reports.
pub fn write(path: &Path, grids: &[&FloatGrid], options: &WriteOptions) -> Result<()> {
    crate::io::files::atomic::write_bytes(path, &to_bytes(grids, options)?)
}

/// As [`write()`], for grids of any kind.
///
/// # Errors
/// As [`write()`].
pub fn write_any(path: &Path, grids: &[GridRef<'_>], options: &WriteOptions) -> Result<()> {
    crate::io::files::atomic::write_bytes(path, &any_to_bytes(grids, options)?)
}

/// The bytes of a .vdb file.
///
/// # Errors
/// When memory runs out; numbers outside the 16-bit range if 16 bits are requested (the grid is named).
pub fn to_bytes(grids: &[&FloatGrid], options: &WriteOptions) -> Result<Vec<u8>> {
    let grids: Vec<GridRef<'_>> = grids.iter().map(|grid| GridRef::Floats(grid)).collect();
    any_to_bytes(&grids, options)
}

/// As [`to_bytes`], for grids of any kind.
///
/// # Errors
/// As [`to_bytes`].
pub fn any_to_bytes(grids: &[GridRef<'_>], options: &WriteOptions) -> Result<Vec<u8>> {
    let (pointers, vectors): (Vec<usize>, Vec<bool>) = grids.iter().map(GridRef::address).unzip();
    for (grid, (&address, &vectors)) in grids.iter().zip(pointers.iter().zip(&vectors)) {
        if options.half && !ffi::fits_half(address, vectors).map_err(super::fail)? {
            let name = grid.name();
            return Err(Error::argument(format!(
                "grid {name:?} has numbers over 65,504, which 16 bits do not hold"
            )));
        }
    }
    let codec = codec_number(options.compression);
    let meta: Vec<ffi::Meta> = options.metadata.iter().map(|(key, value)| to_meta(key, value)).collect();
    let bytes = ffi::grids_to_bytes(&pointers, &vectors, codec, options.half, &meta).map_err(super::fail)?;
    Ok(named_by_content(&bytes))
}

/// Descriptions of a file's grids, of any type, sorted by name; values are not read, except in a stream, which has no offsets to its grids.
///
/// In a program that called [`guard::install`], files that are not its own are decoded by another process.
///
/// # Errors
/// A file that is missing, empty, cut short or damaged.
pub fn describe(path: &Path) -> Result<Vec<GridInfo>> {
    guard::of(path).map_or_else(|| decode::describe(path), |guard| guard.describe(path))
}

/// The metadata of the file itself, as [`WriteOptions::metadata`] sets it; read without OpenVDB. None if the file's version is newer than
/// this library knows.
///
/// # Errors
/// A file that is missing, cut short or of another kind.
pub fn metadata(path: &Path) -> Result<Vec<(String, MetaValue)>> {
    let open = || layout::metadata(std::io::BufReader::new(std::fs::File::open(path)?));
    let all = open().map_err(|fault| match fault {
        layout::Fault::Io(error) => Error::io(path, "read", error),
        layout::Fault::Content(what) => Error::file(path, what),
    })?;
    let value = |kind: String, bytes: Vec<u8>| {
        let all = &bytes[..];
        match (&kind[..], bytes.len()) {
            ("string", _) => MetaValue::Text(String::from_utf8_lossy(all).into_owned()),
            ("int32", 4) => MetaValue::Int(i32::from_le_bytes(all.try_into().unwrap_or_default()).into()),
            ("int64", 8) => MetaValue::Int(i64::from_le_bytes(all.try_into().unwrap_or_default())),
            ("double", 8) => MetaValue::Double(f64::from_le_bytes(all.try_into().unwrap_or_default())),
            ("float", 4) => MetaValue::Float(f32::from_le_bytes(all.try_into().unwrap_or_default())),
            ("bool", 1) => MetaValue::Bool(all != [0]),
            _ => MetaValue::Other(kind, String::new()),
        }
    };
    Ok(all.into_iter().map(|(key, kind, bytes)| (key, value(kind, bytes))).collect())
}

/// Every grid of a file, sorted by name; all must be float grids.
///
/// # Errors
/// As [`describe`]; a grid of another type (named); no grid at all.
pub fn read(path: &Path) -> Result<Vec<FloatGrid>> {
    guard::of(path).map_or_else(|| decode::read(path), |guard| guard.read(path))
}

/// As [`read`], always in this process: for files whose content is known by its hash.
///
/// # Errors
/// As [`read`].
pub fn read_own(path: &Path) -> Result<Vec<FloatGrid>> {
    decode::read(path)
}

/// The float grid of that name; without a name, the first level set, or else the first float grid.
///
/// # Errors
/// As [`describe`]; no such grid (the file's grids are named); values that are not finite.
pub fn read_named(path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    guard::of(path).map_or_else(|| decode::read_named(path, name), |guard| guard.read_named(path, name))
}

/// The float grid with that index in the list of [`describe`]: this can read each of several grids with one name.
///
/// # Errors
/// As [`read_named`].
pub fn read_nth(path: &Path, index: usize) -> Result<FloatGrid> {
    guard::of(path).map_or_else(|| decode::read_nth(path, index), |guard| guard.read_nth(path, index))
}

/// A level set of a file, found as by [`read_named`], with distances in metres: see [`distances::mended`]. Faults of its values are logged,
/// and so is the fact that several grids have its name, in which case the first is read.
///
/// # Errors
/// As [`read_named`]; a grid that is not a level set, or whose cells are not cubes; cancel.
pub fn read_level_set(ctx: &Context, path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    let grid = read_named(path, name)?;
    let name = grid.name();
    if grid.class() != GridClass::LevelSet {
        return Err(Error::file(path, format!("grid \"{name}\" is not a level set")));
    }
    if !grid.is_uniform() {
        return Err(Error::file(path, format!("grid \"{name}\" has cells that are not cubes")));
    }
    let count = describe(path)?.iter().filter(|grid| grid.name == name).count();
    if count > 1 {
        log::warn!("{}: has {count} grids \"{name}\": the first is read", path.display());
    }
    let (grid, what) = distances::mended(ctx, grid)?;
    if let Some(what) = what {
        log::warn!("{}: grid \"{name}\" {what}", path.display());
    }
    Ok(grid)
}

/// As [`read_named`], always in this process: for files whose content is known by its hash.
///
/// # Errors
/// As [`read_named`].
pub fn read_own_named(path: &Path, name: &str) -> Result<FloatGrid> {
    decode::read_named(path, Some(name))
}

/// The grid of that name, of floats or vectors; without a name, the first level set, or else the first float grid, or else the first vector
/// grid.
///
/// # Errors
/// As [`read_named`].
pub fn read_any(path: &Path, name: Option<&str>) -> Result<AnyGrid> {
    guard::of(path).map_or_else(|| decode::read_any(path, name), |guard| guard.read_any(path, name))
}

/// As [`read_named`], from the bytes of a .vdb file.
///
/// # Errors
/// [`Error::Bytes`]: bytes of another kind, cut short or damaged; no such grid; values that are not finite.
pub fn from_bytes(bytes: &[u8], name: Option<&str>) -> Result<FloatGrid> {
    check_magic(bytes)?;
    decode::from_bytes(bytes, name).map_err(unreadable)
}

/// As [`read_any`], from the bytes of a .vdb file.
///
/// # Errors
/// As [`from_bytes`].
pub fn any_from_bytes(bytes: &[u8], name: Option<&str>) -> Result<AnyGrid> {
    check_magic(bytes)?;
    decode::any_from_bytes(bytes, name).map_err(unreadable)
}

fn check_magic(bytes: &[u8]) -> Result<()> {
    if bytes.starts_with(&layout::MAGIC) {
        return Ok(());
    }
    Err(Error::Bytes("these are not the bytes of a .vdb file".into()))
}

fn unreadable(what: String) -> Error {
    Error::Bytes(format!("the bytes of the .vdb file cannot be read ({what})"))
}
