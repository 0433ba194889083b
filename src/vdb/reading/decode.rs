//! Decoding of .vdb files in this process. The structure is checked first ([`super::layout`]); damage inside a grid's values is left to
//! OpenVDB, which does not survive every kind of it: see [`super::guard`].

use std::io::{BufReader, Cursor};
use std::path::Path;

use cxx::UniquePtr;

use super::layout::{self, Fault, Layout};
use crate::error::{Error, Result};
use crate::geometry::Points;
use crate::vdb::bridge::ffi;
use crate::vdb::grid::{FloatGrid, from_meta};
use crate::vdb::grid_info::GridInfo;
use crate::vdb::point_arrays;
use crate::vdb::refusal::cannot_read;
use crate::vdb::vectors::AnyGrid;

/// OpenVDB's names of the grid types that can be read; a suffix means that values are stored in 16 bits.
const FLOAT_TYPE: &str = "Tree_float_5_4_3";
const VECTOR_TYPE: &str = "Tree_vec3s_5_4_3";
const POINT_TYPE: &str = "Tree_ptdataidx32_5_4_3";

/// The kinds of grids that a caller accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kinds {
    Floats,
    FloatsAndVectors,
    Points,
}

impl Kinds {
    /// Their name in messages.
    fn description(self) -> &'static str {
        match self {
            Self::Floats => "floats",
            Self::FloatsAndVectors => "floats or vectors of floats",
            Self::Points => "points",
        }
    }

    /// Whether a grid is one of them.
    fn accepts(self, header: &GridInfo) -> bool {
        let types: &[&str] = match self {
            Self::Floats => &[FLOAT_TYPE],
            Self::FloatsAndVectors => &[FLOAT_TYPE, VECTOR_TYPE],
            Self::Points => &[POINT_TYPE],
        };
        types.iter().any(|known| header.value_type.starts_with(known))
    }
}

/// The type of a grid's values, for messages.
fn kind_of(header: &GridInfo) -> &str {
    let known = [
        ("Tree_float", "floats"),
        ("Tree_vec3s", "vectors of floats"),
        ("Tree_double", "64-bit floats"),
        ("Tree_vec3d", "vectors of 64-bit floats"),
        ("Tree_int32", "whole numbers"),
        ("Tree_int64", "64-bit whole numbers"),
        ("Tree_vec3i", "vectors of whole numbers"),
        ("Tree_bool", "booleans"),
        ("Tree_mask", "voxels without values"),
        ("Tree_ptdataidx", "points"),
    ];
    let found = known.iter().find(|(start, _)| header.value_type.starts_with(start));
    found.map_or(header.value_type.as_str(), |(_, description)| description)
}

/// A result whose error message is appended to the file's name.
type Decoded<T> = std::result::Result<T, String>;

/// Where the grids of a file are.
enum Source<'a> {
    /// In a file of this name whose structure has been checked, so that OpenVDB may seek in it.
    File(&'a str),
    /// In memory: the bytes were read sequentially.
    Stored(UniquePtr<ffi::Stored>),
}

/// Checks the structure of a file.
///
/// # Errors
/// A file that cannot be read, is not a regular file, is cut short or contradicts itself.
pub(in crate::vdb) fn check(path: &Path) -> Result<Layout> {
    let file = crate::io::files::source::open(path)?;
    layout::read(BufReader::new(file)).map_err(|fault| match fault {
        Fault::Io(error) => Error::io(path, "read", error),
        Fault::Content(what) => Error::file(path, what),
    })
}

fn source(path: &Path) -> Result<Source<'_>> {
    let layout = check(path)?;
    // A stream is read from memory, where its end is detected.
    if layout.is_stream() {
        let stored = stored(&crate::io::files::source::read(path)?);
        return stored.map_err(|what| Error::file(path, what));
    }
    let name = path.to_str().ok_or_else(|| Error::file(path, "the name is not valid UTF-8"))?;
    Ok(Source::File(name))
}

fn stored(bytes: &[u8]) -> Decoded<Source<'static>> {
    ffi::read_bytes(bytes).map(Source::Stored).map_err(|error| cannot_read(&error))
}

/// As [`crate::vdb::file::describe`].
pub(in crate::vdb) fn describe(path: &Path) -> Result<Vec<GridInfo>> {
    headers(&source(path)?).map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::file::read`].
pub(in crate::vdb) fn read(path: &Path) -> Result<Vec<FloatGrid>> {
    let mut source = source(path)?;
    let mut all = || {
        let headers = headers(&source)?;
        if headers.is_empty() {
            return Err("the .vdb file holds no grid".to_string());
        }
        let load = |at| {
            let chosen = nth(headers.clone(), at).ok_or(WRONG_TYPE)?;
            floats(load(&mut source, &chosen, Kinds::Floats)?)
        };
        (0..headers.len()).map(load).collect()
    };
    all().map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::file::read_named`].
pub(in crate::vdb) fn read_named(path: &Path, name: Option<&str>) -> Result<FloatGrid> {
    let found = named(source(path)?, name, Kinds::Floats).and_then(floats);
    found.map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::file::read_nth`].
pub(in crate::vdb) fn read_nth(path: &Path, index: usize) -> Result<FloatGrid> {
    let read = |mut source: Source<'_>| {
        let chosen = nth(headers(&source)?, index);
        let chosen = chosen.ok_or_else(|| format!("the .vdb file holds no {} grids", index + 1))?;
        floats(load(&mut source, &chosen, Kinds::Floats)?)
    };
    read(source(path)?).map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::file::read_any`].
pub(in crate::vdb) fn read_any(path: &Path, name: Option<&str>) -> Result<AnyGrid> {
    named(source(path)?, name, Kinds::FloatsAndVectors).map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::points::read`], with the attributes that were omitted.
pub(in crate::vdb) fn read_points(path: &Path, name: Option<&str>) -> Result<(Points, Vec<String>)> {
    let mut source = source(path)?;
    let read = choose(&source, name, Kinds::Points).and_then(|chosen| {
        let grid = found(&mut source, &chosen, Kinds::Points)?.points;
        if grid.is_null() { Err(WRONG_TYPE.to_string()) } else { point_arrays::of_grid(&grid) }
    });
    read.map_err(|what| Error::file(path, what))
}

/// As [`crate::vdb::file::from_bytes`]; the error message is appended to the name of the bytes.
pub(in crate::vdb) fn from_bytes(bytes: &[u8], name: Option<&str>) -> Decoded<FloatGrid> {
    named(checked(bytes)?, name, Kinds::Floats).and_then(floats)
}

/// As [`crate::vdb::file::any_from_bytes`]; the error message is appended to the name of the bytes.
pub(in crate::vdb) fn any_from_bytes(bytes: &[u8], name: Option<&str>) -> Decoded<AnyGrid> {
    named(checked(bytes)?, name, Kinds::FloatsAndVectors)
}

/// The grids in bytes whose structure has been checked.
fn checked(bytes: &[u8]) -> Decoded<Source<'static>> {
    layout::read(Cursor::new(bytes)).map_err(|fault| match fault {
        Fault::Io(error) => error.to_string(),
        Fault::Content(what) => what,
    })?;
    stored(bytes)
}

fn headers(source: &Source<'_>) -> Decoded<Vec<GridInfo>> {
    let headers = match source {
        Source::File(name) => ffi::describe_file(name),
        Source::Stored(stored) => ffi::describe_stored(stored),
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

fn named(mut source: Source<'_>, name: Option<&str>, kinds: Kinds) -> Decoded<AnyGrid> {
    let chosen = choose(&source, name, kinds)?;
    load(&mut source, &chosen, kinds)
}

/// A grid of a file: its index, its description, and a name that is unique in the file.
type Chosen = (usize, GridInfo, String);

/// The grid with this index. Of several grids with one name OpenVDB lists the first, then the others in lexical order of the suffixes that
/// it has written: [1], [10], [2]; unnamed grids are numbered from [0].
fn nth(mut headers: Vec<GridInfo>, at: usize) -> Option<Chosen> {
    let name = headers.get(at)?.name.clone();
    let of_name = |headers: &[GridInfo]| headers.iter().filter(|header| header.name == name).count();
    let (before, all) = (of_name(&headers[..at]), of_name(&headers));
    let first = usize::from(!name.is_empty());
    let mut numbers: Vec<String> = (first..all).map(|number| number.to_string()).collect();
    numbers.sort();
    let unique = match before.checked_sub(first) {
        Some(position) if all > 1 => format!("{name}[{}]", numbers.get(position)?),
        _ => name,
    };
    Some((at, headers.swap_remove(at), unique))
}

/// The grid of that name, or the first one of the accepted kinds.
fn choose(source: &Source<'_>, name: Option<&str>, kinds: Kinds) -> Decoded<Chosen> {
    let headers = headers(source)?;
    let first = |wanted: &dyn Fn(&GridInfo) -> bool| headers.iter().position(wanted);
    let floats = |header: &GridInfo| kinds != Kinds::Points && Kinds::Floats.accepts(header);
    let found = match name {
        Some(name) => first(&|header| header.name == name),
        None => first(&|header| floats(header) && header.class == "level set")
            .or_else(|| first(&floats))
            .or_else(|| first(&|header| kinds.accepts(header))),
    };
    match found {
        Some(at) => nth(headers, at).ok_or_else(|| WRONG_TYPE.to_string()),
        None => {
            let list: Vec<String> =
                headers.iter().map(|header| format!("\"{}\" ({})", header.name, kind_of(header))).collect();
            let wanted = name
                .map_or(format!("no grid of {}", kinds.description()), |name| format!("no grid \"{name}\""));
            let held = if list.is_empty() { "no grid at all".to_string() } else { list.join(", ") };
            Err(format!("{wanted} in the file, which holds {held}"))
        }
    }
}

/// A grid of a file.
fn load(source: &mut Source<'_>, chosen: &Chosen, kinds: Kinds) -> Decoded<AnyGrid> {
    let grid = AnyGrid::of(found(source, chosen, kinds)?).ok_or(WRONG_TYPE)?;
    if grid.is_finite().map_err(|error| error.to_string())? {
        return Ok(grid);
    }
    Err(format!("grid \"{}\" has values that are not finite", grid.borrow().name()))
}

/// A grid of a file, as OpenVDB reads it.
fn found(source: &mut Source<'_>, (at, header, unique): &Chosen, kinds: Kinds) -> Decoded<ffi::Found> {
    if !kinds.accepts(header) {
        let (name, kind, wanted) = (&header.name, kind_of(header), kinds.description());
        return Err(format!("grid \"{name}\" holds {kind}, but {wanted} are needed"));
    }
    let found = match source {
        Source::File(name) => ffi::read_grid(name, unique),
        Source::Stored(stored) => ffi::take_stored(stored.pin_mut(), *at),
    };
    found.map_err(|error| cannot_read(&error))
}

/// The error for a grid whose type differs from the one that the file states.
const WRONG_TYPE: &str = "the .vdb file is damaged: a grid is not of the type that the file says";

fn floats(grid: AnyGrid) -> Decoded<FloatGrid> {
    grid.floats().ok_or_else(|| WRONG_TYPE.to_string())
}
