//! .vdb files: written whole or not at all, the same bytes for the same grids.

use std::path::Path;

use super::bridge::ffi;
use super::grid::{FloatGrid, MetaValue, from_meta, to_meta};
use crate::error::{Error, Result};
use crate::io::hash::Hasher;

/// How values are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Compression {
    /// Not at all.
    None,
    /// Zip: small, slow.
    Zip,
    /// Blosc: fast.
    #[default]
    Blosc,
}

/// How a file is written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WriteOptions {
    /// Codec.
    pub compression: Compression,
    /// 16-bit values: for caches that are only rendered.
    pub half: bool,
    /// Metadata of the file itself.
    pub metadata: Vec<(String, MetaValue)>,
}

/// What a file says of one of its grids.
#[derive(Debug, Clone, PartialEq)]
pub struct GridInfo {
    /// Name.
    pub name: String,
    /// OpenVDB's type name, for instance `Tree_float_5_4_3`.
    pub value_type: String,
    /// Class: "level set", "fog volume", "unknown" ...
    pub class: String,
    /// Edge of a cell along x (m).
    pub voxel: f64,
    /// Active voxels, where the file says.
    pub active_voxels: Option<u64>,
    /// Least and greatest active voxel, where the file says.
    pub bbox: Option<([i32; 3], [i32; 3])>,
    /// Memory when loaded (bytes), where the file says.
    pub memory: Option<u64>,
    /// Whether values are stored in 16 bits.
    pub half: bool,
    /// Codecs.
    pub compression: String,
    /// All metadata.
    pub metadata: Vec<(String, MetaValue)>,
}

/// OpenVDB's magic number, the first bytes of every file.
const MAGIC: [u8; 8] = [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0];
/// Where a file has its random identifier: 36 characters.
const UUID: std::ops::Range<usize> = 21..57;

/// Writes grids to a file; the file is there when it is whole.
///
/// # Errors
/// What OpenVDB or the operating system reports.
pub fn write(path: &Path, grids: &[&FloatGrid], options: &WriteOptions) -> Result<()> {
    crate::io::atomic::write_bytes(path, &to_bytes(grids, options)?)
}

/// The bytes of a .vdb file.
///
/// # Errors
/// What OpenVDB reports.
pub fn to_bytes(grids: &[&FloatGrid], options: &WriteOptions) -> Result<Vec<u8>> {
    let pointers: Vec<usize> =
        grids.iter().map(|grid| std::ptr::from_ref::<ffi::Grid>(&grid.inner) as usize).collect();
    let codec = match options.compression {
        Compression::None => 0,
        Compression::Zip => 1,
        Compression::Blosc => 2,
    };
    let meta: Vec<ffi::Meta> = options.metadata.iter().map(|(key, value)| to_meta(key, value)).collect();
    let bytes = ffi::grids_to_bytes(&pointers, codec, options.half, &meta).map_err(super::fail)?;
    let mut bytes = bytes.as_bytes().to_vec();
    name_by_content(&mut bytes);
    Ok(bytes)
}

/// Replaces the random identifier by one made from the rest of the file.
fn name_by_content(bytes: &mut [u8]) {
    if bytes.len() < UUID.end {
        return;
    }
    let digits = Hasher::default().add(&bytes[..UUID.start]).add(&bytes[UUID.end..]).finish();
    let name = [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..]].join("-");
    bytes[UUID].copy_from_slice(name.as_bytes());
}

/// Letters of OpenVDB's reason that a message repeats.
const LONGEST_REASON: usize = 120;

/// Checks what can be known without OpenVDB: the file is there, not empty, and begins as it should.
fn check_start(path: &Path) -> Result<()> {
    use std::io::Read;
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(|error| Error::io(path, "read", error))?;
    file.take(8).read_to_end(&mut start).map_err(|error| Error::io(path, "read", error))?;
    match start.len() {
        0 => Err(Error::file(path, "the file is empty")),
        _ if start != MAGIC[..start.len()] => Err(Error::file(path, "not a .vdb file")),
        1..8 => Err(Error::file(path, "the .vdb file is cut short")),
        _ => Ok(()),
    }
}

fn text(path: &Path) -> Result<&str> {
    path.to_str().ok_or_else(|| Error::file(path, "the name is not valid UTF-8"))
}

/// OpenVDB's own words.
fn reason(error: &cxx::Exception) -> String {
    let what = error.what();
    // OpenVDB's texts begin with the exception's name.
    let what = what.split_once(": ").map_or(what, |(_, rest)| rest);
    // A damaged name can be long and anything but text.
    what.chars()
        .filter(|letter| !letter.is_control())
        .take(LONGEST_REASON)
        .collect::<String>()
        .trim()
        .to_string()
}

fn cannot_read(path: &Path, error: &cxx::Exception) -> Error {
    let what = reason(error);
    let reason = if what.is_empty() { String::new() } else { format!(" ({what})") };
    Error::file(path, format!("the .vdb file cannot be read, it is cut short or damaged{reason}"))
}

/// What a file says of its grids, of any type, in the order of their names; values are not read.
///
/// # Errors
/// A missing, empty, cut or damaged file.
pub fn describe(path: &Path) -> Result<Vec<GridInfo>> {
    check_start(path)?;
    let headers = ffi::describe_file(text(path)?).map_err(|error| cannot_read(path, &error))?;
    Ok(headers.into_iter().map(info).collect())
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

/// OpenVDB's name of a float grid's type; a suffix says that values are stored in 16 bits.
const FLOAT_TYPE: &str = "Tree_float_5_4_3";

/// Every grid of a file, in the order of their names; all must be float grids.
///
/// # Errors
/// As [`describe`]; a grid of another type (named); no grid at all.
pub fn read(path: &Path) -> Result<Vec<FloatGrid>> {
    let headers = describe(path)?;
    if headers.is_empty() {
        return Err(Error::file(path, "the .vdb file holds no grid"));
    }
    headers.iter().map(|header| load(path, header)).collect()
}

/// The float grid of that name; without a name the first level set, else the first float grid.
///
/// # Errors
/// As [`describe`]; no such grid (the file's grids are named); values that are not finite.
pub fn read_named(path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    let headers = describe(path)?;
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
        Some(header) => load(path, header),
        None => {
            let list: Vec<String> =
                headers.iter().map(|header| format!("\"{}\" ({})", header.name, header.value_type)).collect();
            let wanted = name.map_or("no float grid".to_string(), |name| format!("no grid \"{name}\""));
            let there = if list.is_empty() { "no grid at all".to_string() } else { list.join(", ") };
            Err(Error::file(path, format!("{wanted} in the file, which holds {there}")))
        }
    }
}

fn load(path: &Path, header: &GridInfo) -> Result<FloatGrid> {
    if !header.value_type.starts_with(FLOAT_TYPE) {
        return Err(Error::file(
            path,
            format!("grid \"{}\" is of type {}, but a float grid is needed", header.name, header.value_type),
        ));
    }
    let inner = ffi::read_float_grid(text(path)?, &header.name).map_err(|error| cannot_read(path, &error))?;
    let grid = FloatGrid { inner };
    if !is_finite(&grid)? {
        return Err(Error::file(path, format!("grid \"{}\" has values that are not finite", header.name)));
    }
    Ok(grid)
}

fn is_finite(grid: &FloatGrid) -> Result<bool> {
    let finite = grid.leaves()?.iter().all(|leaf| leaf.values.iter().all(|value| value.is_finite()));
    Ok(finite && grid.background().is_finite())
}

/// The float grid of that name out of the bytes of a .vdb file; without a name the first level set, else the first
/// float grid.
///
/// # Errors
/// Bytes of another kind, cut short or damaged; no such grid; values that are not finite.
pub fn from_bytes(bytes: &[u8], name: Option<&str>) -> Result<FloatGrid> {
    if !bytes.starts_with(&MAGIC) {
        return Err(Error::argument("these are not the bytes of a .vdb file"));
    }
    let inner = ffi::float_grid_from_bytes(bytes, name.unwrap_or("")).map_err(|error| {
        Error::argument(format!("the bytes of the .vdb file cannot be read ({})", reason(&error)))
    })?;
    let grid = FloatGrid { inner };
    if !is_finite(&grid)? {
        return Err(Error::argument(format!("grid \"{}\" has values that are not finite", grid.name())));
    }
    Ok(grid)
}
