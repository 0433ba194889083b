//! Decoding .vdb files in this process. The structure is checked first ([`super::layout`]); damage inside a grid's values
//! is OpenVDB's to notice, which does not survive all of it: see [`super::guard`].

use std::io::{BufReader, Cursor};
use std::path::Path;

use super::bridge::ffi;
use super::file::GridInfo;
use super::grid::{FloatGrid, from_meta};
use super::layout::{self, Fault, Layout};
use crate::error::{Error, Result};

/// OpenVDB's name of a float grid's type; a suffix says that values are stored in 16 bits.
const FLOAT_TYPE: &str = "Tree_float_5_4_3";

/// A result whose error text goes behind the file's name.
type Told<T> = std::result::Result<T, String>;

/// Where the bytes of a file are.
enum Source<'a> {
    /// In a file of this name, whose structure is known to be whole: OpenVDB may skip in it.
    File(&'a str),
    /// In memory: read from the first byte to the last.
    Bytes(Vec<u8>),
}

/// Checks the structure of a file.
///
/// # Errors
/// A file that cannot be read, is no regular file, is cut short or contradicts itself.
pub(super) fn check(path: &Path) -> Result<Layout> {
    let file = crate::io::source::open(path)?;
    layout::read(BufReader::new(file)).map_err(|fault| match fault {
        Fault::Io(error) => Error::io(path, "read", error),
        Fault::Content(what) => Error::file(path, what),
    })
}

fn source(path: &Path) -> Result<Source<'_>> {
    let layout = check(path)?;
    // A stream is read from memory, where its end is noticed.
    if layout.is_stream() {
        return Ok(Source::Bytes(crate::io::source::read(path)?));
    }
    let name = path.to_str().ok_or_else(|| Error::file(path, "the name is not valid UTF-8"))?;
    Ok(Source::File(name))
}

/// What OpenVDB could not read, in our words.
fn cannot_read(error: &cxx::Exception) -> String {
    let what = error.what();
    log::info!("OpenVDB: {}", crate::error::one_line(what));
    let told = |words: &[&str]| words.iter().any(|word| what.contains(word));
    if told(&["bad_alloc", "length_error", "vector::", "basic_string::", "array new length"]) {
        "the .vdb file is damaged, or needs more memory than it may take".into()
    } else if told(&["LookupError", "non-registered", "not registered", "unregistered"]) {
        "the .vdb file is damaged, or holds a kind of grid that frazil does not know".into()
    } else if told(&["no longer supported", "unsupported"]) {
        "the .vdb file is of a version that frazil does not read".into()
    } else {
        "the .vdb file cannot be read, it is cut short or damaged".into()
    }
}

/// As [`super::file::describe`].
pub(super) fn describe(path: &Path) -> Result<Vec<GridInfo>> {
    headers(&source(path)?).map_err(|what| Error::file(path, what))
}

/// As [`super::file::read`].
pub(super) fn read(path: &Path) -> Result<Vec<FloatGrid>> {
    let source = source(path)?;
    let all = || {
        let headers = headers(&source)?;
        if headers.is_empty() {
            return Err("the .vdb file holds no grid".to_string());
        }
        headers.iter().map(|header| load(&source, header)).collect()
    };
    all().map_err(|what| Error::file(path, what))
}

/// As [`super::file::read_named`].
pub(super) fn read_named(path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    named(&source(path)?, name).map_err(|what| Error::file(path, what))
}

/// As [`super::file::from_bytes`]; the error goes behind what the bytes are called.
pub(super) fn from_bytes(bytes: &[u8], name: Option<&str>) -> Told<FloatGrid> {
    layout::read(Cursor::new(bytes)).map_err(|fault| match fault {
        Fault::Io(error) => error.to_string(),
        Fault::Content(what) => what,
    })?;
    let inner = ffi::float_grid_from_bytes(bytes, name.unwrap_or("")).map_err(|error| no_grid(&error))?;
    finite(FloatGrid { inner })
}

/// The C++ side names the grids that are there when the one that is wanted is not.
fn no_grid(error: &cxx::Exception) -> String {
    let what = error.what();
    if what.contains("in the file, which holds") { crate::error::one_line(what) } else { cannot_read(error) }
}

fn headers(source: &Source<'_>) -> Told<Vec<GridInfo>> {
    let headers = match source {
        Source::File(name) => ffi::describe_file(name),
        Source::Bytes(bytes) => ffi::describe_bytes(bytes),
    };
    Ok(headers.map_err(|error| cannot_read(&error))?.into_iter().map(info).collect())
}

fn info(header: ffi::GridHeader) -> GridInfo {
    GridInfo {
        name: header.name,
        value_type: header.value_type,
        class: header.class_name,
        voxel: header.voxel,
        active_voxels: u64::try_from(header.active).ok(),
        bbox: (header.low[0] <= header.high[0]).then_some((header.low, header.high)),
        memory: u64::try_from(header.memory).ok(),
        half: header.half,
        compression: header.compression,
        metadata: header.meta.into_iter().map(from_meta).collect(),
    }
}

fn named(source: &Source<'_>, name: Option<&str>) -> Told<FloatGrid> {
    let headers = headers(source)?;
    let is_float = |header: &&GridInfo| header.value_type.starts_with(FLOAT_TYPE);
    let found = match name {
        Some(name) => headers.iter().find(|header| header.name == name),
        None => headers
            .iter()
            .filter(is_float)
            .find(|header| header.class == "level set")
            .or_else(|| headers.iter().find(is_float)),
    };
    match found {
        Some(header) => load(source, header),
        None => {
            let list: Vec<String> =
                headers.iter().map(|header| format!("\"{}\" ({})", header.name, header.value_type)).collect();
            let wanted = name.map_or("no float grid".to_string(), |name| format!("no grid \"{name}\""));
            let there = if list.is_empty() { "no grid at all".to_string() } else { list.join(", ") };
            Err(format!("{wanted} in the file, which holds {there}"))
        }
    }
}

fn load(source: &Source<'_>, header: &GridInfo) -> Told<FloatGrid> {
    if !header.value_type.starts_with(FLOAT_TYPE) {
        let (name, kind) = (&header.name, &header.value_type);
        return Err(format!("grid \"{name}\" is of type {kind}, but a float grid is needed"));
    }
    let inner = match source {
        Source::File(name) => ffi::read_float_grid(name, &header.name),
        Source::Bytes(bytes) => ffi::float_grid_from_bytes(bytes, &header.name),
    };
    finite(FloatGrid { inner: inner.map_err(|error| cannot_read(&error))? })
}

fn finite(grid: FloatGrid) -> Told<FloatGrid> {
    let leaves = grid.leaves().map_err(|error| error.to_string())?;
    let finite = leaves.iter().all(|leaf| leaf.values.iter().all(|value| value.is_finite()));
    if finite && grid.background().is_finite() {
        return Ok(grid);
    }
    Err(format!("grid \"{}\" has values that are not finite", grid.name()))
}
