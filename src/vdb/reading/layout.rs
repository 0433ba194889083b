//! The structure of a .vdb file, read without OpenVDB: header, metadata, and the positions of the grids.
//!
//! OpenVDB does not detect the end of a file while it reads: it takes missing data for an empty grid, or never returns. A file with offsets
//! to its grids (all files except streams) is checked here first.

use std::io::{Read, Seek, SeekFrom};

use crate::error::fail_if;

/// OpenVDB's magic number, the first bytes of every file.
pub(in crate::vdb) const MAGIC: [u8; 8] = [0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0];
/// Versions of the format whose structure is known here; OpenVDB 10 writes the newest one.
const KNOWN: std::ops::RangeInclusive<u32> = 211..=224;
/// First version with a flag for offsets.
const OFFSETS_FLAG: u32 = 212;
/// First version in which grids can share the tree of another.
const INSTANCES: u32 = 216;
/// First version with an identifier of 36 characters; before it was 16 bytes.
const LONG_UUID: u32 = 218;
/// Versions with one compression flag for the whole file.
const FILE_COMPRESSION: std::ops::Range<u32> = 220..222;
/// First version with compression flags per grid.
const GRID_COMPRESSION: u32 = 222;
/// Longest name that is read (bytes).
const MAX_NAME: u64 = 1 << 16;

/// The structure of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Version of the format.
    pub version: u32,
    /// The grids in the file's order. None if the file has no offsets: a stream, or an unknown version. Only decoding shows whether such a
    /// file is complete.
    pub grids: Option<Vec<GridExtent>>,
}

impl Layout {
    /// Whether the grids follow each other without offsets.
    pub fn is_stream(&self) -> bool {
        self.grids.is_none() && KNOWN.contains(&self.version)
    }
}

/// A grid in its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridExtent {
    /// Its name, without the number that OpenVDB appends to names that are not unique.
    pub name: String,
    /// OpenVDB's name of its type.
    pub value_type: String,
    /// First byte of its metadata.
    pub begin: u64,
    /// First byte of its values; none for a grid that shares the tree of another.
    pub values: Option<u64>,
    /// First byte after it.
    pub end: u64,
}

/// Why a structure cannot be used.
#[derive(Debug)]
pub enum Fault {
    /// The operating system cannot read the file.
    Io(std::io::Error),
    /// Not a .vdb file; the message is appended to the file's name.
    Content(String),
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

fn damaged(what: impl std::fmt::Display) -> Fault {
    Fault::Content(format!("the .vdb file is damaged: {what}"))
}

/// Reads the structure of a file.
///
/// # Errors
/// [`Fault::Content`] for a file that is empty, of another kind, too short for its offsets, or inconsistent.
pub fn read(source: impl Read + Seek) -> Result<Layout, Fault> {
    let mut reader = ForwardReader::new(source)?;
    let (version, has_offsets) = reader.head()?;
    let Some(has_offsets) = has_offsets else { return Ok(Layout { version, grids: None }) };
    reader.metadata(reader.length, "metadata of the file")?;
    let count = reader.u32("number of grids")? as i32;
    fail_if(count < 0, || damaged(format_args!("it says that it holds {count} grids")))?;
    if !has_offsets {
        return Ok(Layout { version, grids: None });
    }
    let mut grids = Vec::new();
    for index in 0..count {
        let grid = reader.grid(version, index)?;
        reader.go_to(grid.end)?;
        grids.push(grid);
    }
    Ok(Layout { version, grids: Some(grids) })
}

/// Reads the metadata of a file: key, OpenVDB's name of the type, and bytes. None if the version is unknown.
///
/// # Errors
/// As [`read`], up to the end of the metadata.
pub fn metadata(source: impl Read + Seek) -> Result<Vec<(String, String, Vec<u8>)>, Fault> {
    const PART: &str = "metadata of the file";
    let mut reader = ForwardReader::new(source)?;
    let mut out = Vec::new();
    if reader.head()?.1.is_some() {
        for _ in 0..reader.u32(PART)? {
            let (key, kind, size) = reader.entry(PART)?;
            reader.expect(size, PART)?;
            let mut bytes = vec![0; size as usize];
            reader.fill(&mut bytes, PART)?;
            out.push((key, kind, bytes));
        }
    }
    Ok(out)
}

/// Reads a file forward, never beyond its end.
struct ForwardReader<R> {
    source: R,
    at: u64,
    length: u64,
}

impl<R: Read + Seek> ForwardReader<R> {
    fn new(mut source: R) -> Result<Self, Fault> {
        let length = source.seek(SeekFrom::End(0))?;
        source.seek(SeekFrom::Start(0))?;
        Ok(Self { source, at: 0, length })
    }

    /// Refuses to read beyond the end.
    fn expect(&self, count: u64, part: &str) -> Result<(), Fault> {
        if self.length - self.at >= count {
            return Ok(());
        }
        let what = format!("the .vdb file is cut short: it ends at byte {}, in its {part}", self.length);
        Err(Fault::Content(what))
    }

    fn fill(&mut self, out: &mut [u8], part: &str) -> Result<(), Fault> {
        self.expect(out.len() as u64, part)?;
        self.source.read_exact(out)?;
        self.at += out.len() as u64;
        Ok(())
    }

    fn array<const N: usize>(&mut self, part: &str) -> Result<[u8; N], Fault> {
        let mut out = [0; N];
        self.fill(&mut out, part)?;
        Ok(out)
    }

    fn u32(&mut self, part: &str) -> Result<u32, Fault> {
        self.array(part).map(u32::from_le_bytes)
    }

    fn skip(&mut self, count: u64, part: &str) -> Result<(), Fault> {
        self.expect(count, part)?;
        self.go_to(self.at + count)
    }

    /// Moves to a position that is known to lie within the file.
    fn go_to(&mut self, at: u64) -> Result<(), Fault> {
        // A relative seek keeps the buffer.
        self.source.seek_relative(at as i64 - self.at as i64)?;
        self.at = at;
        Ok(())
    }

    fn name(&mut self, part: &str) -> Result<String, Fault> {
        let length = u64::from(self.u32(part)?);
        self.expect(length, part)?;
        fail_if(length > MAX_NAME, || damaged(format_args!("a name of {length} bytes in its {part}")))?;
        let mut text = vec![0; length as usize];
        self.fill(&mut text, part)?;
        Ok(String::from_utf8_lossy(&text).into_owned())
    }

    /// Reads up to the file's metadata: its version, and whether it has offsets; none if the version is unknown.
    fn head(&mut self) -> Result<(u32, Option<bool>), Fault> {
        let start = self.length.min(8) as usize;
        let mut magic = [0; 8];
        self.fill(&mut magic[..start], "header")?;
        match start {
            0 => return Err(Fault::Content("the file is empty".into())),
            _ if magic[..start] != MAGIC[..start] => return Err(Fault::Content("not a .vdb file".into())),
            1..8 => return Err(Fault::Content("the .vdb file is cut short".into())),
            _ => {}
        }
        let version = self.u32("header")?;
        if !KNOWN.contains(&version) {
            return Ok((version, None));
        }
        // The library's version is not used.
        self.skip(8, "header")?;
        let has_offsets = version < OFFSETS_FLAG || self.array::<1>("header")? != [0];
        let identifier = if version < LONG_UUID { 16 } else { 36 };
        self.skip(u64::from(FILE_COMPRESSION.contains(&version)) + identifier, "header")?;
        Ok((version, Some(has_offsets)))
    }

    /// Reads the key, type and size of a metadata entry, whose value follows.
    fn entry(&mut self, part: &str) -> Result<(String, String, u64), Fault> {
        Ok((self.name(part)?, self.name(part)?, self.u32(part)?.into()))
    }

    /// Skips a list of metadata, which must end before `before`.
    fn metadata(&mut self, before: u64, part: &str) -> Result<(), Fault> {
        let count = self.u32(part)?;
        for _ in 0..count {
            let (_, _, size) = self.entry(part)?;
            self.skip(size, part)?;
            fail_if(self.at > before, || damaged(format_args!("the {part} reaches beyond its bounds")))?;
        }
        Ok(())
    }

    /// Reads the description of a grid, and checks that its parts lie within the file.
    fn grid(&mut self, version: u32, index: i32) -> Result<GridExtent, Fault> {
        let part = format!("description of grid {}", index + 1);
        let unique = self.name(&part)?;
        let name = unique.split('\u{1e}').next().unwrap_or_default().to_string();
        let value_type = self.name(&part)?;
        let shared = version >= INSTANCES && !self.name(&part)?.is_empty();
        let mut offset = || self.array(&part).map(i64::from_le_bytes);
        let (begin, values, end) = (offset()?, offset()?, offset()?);
        let parts =
            if shared { vec![self.at as i64, begin, end] } else { vec![self.at as i64, begin, values, end] };
        if parts.windows(2).any(|pair| pair[1] < pair[0]) {
            return Err(damaged(format_args!("the parts of grid \"{name}\" do not follow each other")));
        }
        let (begin, end) = (begin as u64, end as u64);
        if end > self.length {
            let what = format!(
                "the .vdb file is cut short: grid \"{name}\" ends at byte {end}, but the file has {} bytes",
                self.length
            );
            return Err(Fault::Content(what));
        }
        let values = (!shared).then_some(values as u64);
        if version >= INSTANCES {
            self.go_to(begin)?;
            let part = format!("metadata of grid \"{name}\"");
            if version >= GRID_COMPRESSION {
                self.skip(4, &part)?;
            }
            self.metadata(values.unwrap_or(end), &part)?;
        }
        Ok(GridExtent { name, value_type, begin, values, end })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// A file of one grid without a tree, as versions of the format write it.
    fn file(version: u32, offsets: bool) -> Vec<u8> {
        let text = |bytes: &mut Vec<u8>, text: &str| {
            bytes.extend((text.len() as u32).to_le_bytes());
            bytes.extend(text.as_bytes());
        };
        let mut bytes = MAGIC.to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend([0; 8]);
        if version >= OFFSETS_FLAG {
            bytes.push(offsets.into());
        }
        if FILE_COMPRESSION.contains(&version) {
            bytes.push(1);
        }
        bytes.extend(vec![b'0'; if version < LONG_UUID { 16 } else { 36 }]);
        bytes.extend(1u32.to_le_bytes());
        text(&mut bytes, "creator");
        text(&mut bytes, "string");
        text(&mut bytes, "test");
        bytes.extend(1u32.to_le_bytes());
        text(&mut bytes, "ball\u{1e}1");
        text(&mut bytes, "Tree_float_5_4_3");
        if version >= INSTANCES {
            text(&mut bytes, "");
        }
        let begin = bytes.len() as i64 + 24;
        let positions = if offsets { [begin, begin + 20, begin + 50] } else { [0; 3] };
        bytes.extend(positions.iter().flat_map(|position| position.to_le_bytes()));
        bytes.extend([0; 50]);
        bytes
    }

    #[test]
    fn metadata_is_read_in_the_order_of_the_file() {
        for version in [211, 224] {
            let bytes = file(version, true);
            let all = metadata(Cursor::new(&bytes)).unwrap();
            assert_eq!(all, [("creator".to_string(), "string".to_string(), b"test".to_vec())]);
        }
        let bytes = file(224, true);
        (0..80).for_each(|length| assert!(metadata(Cursor::new(&bytes[..length])).is_err(), "{length}"));
    }

    #[test]
    fn every_known_version_is_read_and_cut_anywhere_it_is_refused() {
        for version in KNOWN {
            let bytes = file(version, true);
            let layout = read(Cursor::new(&bytes)).unwrap();
            let grids = layout.grids.unwrap();
            assert_eq!((grids[0].name.as_str(), grids[0].end), ("ball", bytes.len() as u64), "{version}");
            for length in 0..bytes.len() {
                let fault = read(Cursor::new(&bytes[..length])).unwrap_err();
                assert!(matches!(fault, Fault::Content(_)), "{version} cut at {length}");
            }
        }
    }

    #[test]
    fn a_stream_and_a_newer_version_have_no_known_grids() {
        assert_eq!(read(Cursor::new(file(224, false))).unwrap().grids, None);
        assert_eq!(read(Cursor::new(file(225, true))).unwrap(), Layout { version: 225, grids: None });
    }

    #[test]
    fn offsets_that_contradict_each_other_are_refused() {
        let bytes = file(224, true);
        let at = bytes.len() - 50 - 24;
        for (offset, value) in [(0, 0i64), (0, i64::MAX), (8, 1), (16, -1), (16, i64::MAX), (16, 10)] {
            let mut wrong = bytes.clone();
            wrong[at + offset..at + offset + 8].copy_from_slice(&value.to_le_bytes());
            assert!(matches!(read(Cursor::new(wrong)), Err(Fault::Content(_))), "{offset} {value}");
        }
    }
}
