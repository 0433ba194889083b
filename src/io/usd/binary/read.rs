//! Reads a crate: the prims of a layer with their attributes, each with one value. Of samples over time the first is taken, which is the
//! only one in a file of one frame.
//!
//! Nothing in the file is trusted: offsets and counts are checked against its size before anything is allocated.

use std::collections::HashMap;

use super::packing::{decompressed, unpacked};
use super::{ARRAY, END, HEADER, IDENTIFICATION, INLINE, SpecType, Type};
use crate::io::files::source::Parsed;

/// A crate that has been opened. Values are read when they are asked for.
pub(in crate::io) struct Crate<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) tokens: Vec<String>,
    /// Tokens of the strings.
    pub(super) strings: Vec<u32>,
    metadata: Fields,
    prims: Vec<ReadPrim>,
}

/// A prim of a crate.
#[derive(Debug, Default)]
pub(in crate::io) struct ReadPrim {
    /// Its path: `/shot/hero`.
    pub path: String,
    /// Its type: `Mesh`; empty for none.
    pub class: String,
    /// Its attributes, in the order of the file.
    pub attributes: Vec<ReadAttribute>,
}

/// An attribute of a prim.
#[derive(Debug)]
pub(in crate::io) struct ReadAttribute {
    /// Name, with its namespace: `primvars:st`.
    pub name: String,
    /// What a primvar has a value for each of: `vertex`.
    pub interpolation: String,
    /// Its value as the file stores it, if it has any.
    pub(super) value: Option<u64>,
}

/// Names and values.
type Fields = HashMap<String, u64>;

/// The minor versions that are read: arrays have 64-bit counts since 0.7, and the sections that are read here have not changed up to
/// 0.13.
const MINOR_VERSIONS: std::ops::RangeInclusive<u8> = 7..=13;
/// Bytes of a section in the table of contents: a name, an offset and a size.
const ENTRY: usize = 32;

impl ReadPrim {
    /// The attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&ReadAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }
}

impl<'a> Crate<'a> {
    /// Opens a crate.
    ///
    /// # Errors
    /// A file that is no crate, is cut short or damaged, or has another version.
    pub fn open(bytes: &'a [u8]) -> Parsed<Self> {
        if bytes.starts_with(b"#usda") {
            return Err("this is a text file, and USD is read from binary files (.usdc) only".into());
        }
        if !bytes.starts_with(IDENTIFICATION) {
            return Err("this is no binary USD file".into());
        }
        let head = bytes.get(..HEADER).ok_or_else(cut)?;
        let [major, minor] = [head[8], head[9]];
        if major != 0 || !MINOR_VERSIONS.contains(&minor) {
            let [first, last] = [MINOR_VERSIONS.start(), MINOR_VERSIONS.end()];
            return Err(format!(
                "version {major}.{minor} of binary USD is not read: 0.{first} to 0.{last} are"
            ));
        }
        let sections = Sections::find(bytes)?;
        let tokens = tokens(sections.get("TOKENS")?)?;
        let strings = strings(sections.get("STRINGS")?)?;
        let (metadata, prims) = Tree::read(&sections, &tokens)?.into_prims(&tokens)?;
        Ok(Self { bytes, tokens, strings, metadata, prims })
    }

    /// Its prims, each before those below it.
    pub fn prims(&self) -> &[ReadPrim] {
        &self.prims
    }

    /// The value of a key of the layer's metadata, as the file stores it.
    pub(super) fn metadata(&self, key: &str) -> Option<u64> {
        self.metadata.get(key).copied()
    }
}

/// The message about a file that ends early.
pub(super) fn cut() -> String {
    "the file is cut short".into()
}

fn damaged(what: &str) -> String {
    format!("the file is damaged: its {what} are not valid")
}

/// A reader at a position in a section or file.
pub(super) struct Cursor<'a>(pub &'a [u8]);

impl<'a> Cursor<'a> {
    /// A cursor at an offset.
    pub fn at(bytes: &'a [u8], offset: u64) -> Parsed<Self> {
        usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..)).map(Self).ok_or_else(cut)
    }

    /// The next bytes.
    pub fn take(&mut self, count: u64) -> Parsed<&'a [u8]> {
        let count = usize::try_from(count).map_err(|_| cut())?;
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(cut)?;
        self.0 = rest;
        Ok(taken)
    }

    pub fn u64(&mut self) -> Parsed<u64> {
        Ok(u64::from_le_bytes(*self.take(8)?.first_chunk().ok_or_else(cut)?))
    }

    pub fn u32(&mut self) -> Parsed<u32> {
        Ok(u32::from_le_bytes(*self.take(4)?.first_chunk().ok_or_else(cut)?))
    }

    /// A count of things that are stored, compressed, in the rest.
    pub fn count(&mut self) -> Parsed<usize> {
        usize::try_from(self.u64()?).map_err(|_| cut())
    }

    /// The bytes that follow after their own count.
    pub fn counted(&mut self) -> Parsed<&'a [u8]> {
        let count = self.u64()?;
        self.take(count)
    }
}

/// The sections of a file by name.
struct Sections<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Sections<'a> {
    fn find(bytes: &'a [u8]) -> Parsed<Self> {
        let mut contents = Cursor::at(bytes, Cursor(&bytes[16..]).u64()?)?;
        let count = contents.count()?;
        let entries = contents.take(count.saturating_mul(ENTRY) as u64)?;
        let section = |entry: &'a [u8]| {
            let (name, mut extent) = (&entry[..16], Cursor(&entry[16..]));
            let (offset, size) = (extent.u64()?, extent.u64()?);
            let name = &name[..name.iter().position(|byte| *byte == 0).unwrap_or(16)];
            Ok((name, Cursor::at(bytes, offset)?.take(size)?))
        };
        entries.chunks_exact(ENTRY).map(section).collect::<Parsed<_>>().map(Self)
    }

    fn get(&self, name: &str) -> Parsed<Cursor<'a>> {
        let found = self.0.iter().find(|(other, _)| *other == name.as_bytes());
        found.map(|(_, bytes)| Cursor(bytes)).ok_or_else(|| format!("the file has no section {name}"))
    }
}

fn tokens(mut section: Cursor<'_>) -> Parsed<Vec<String>> {
    let (count, size) = (section.count()?, section.count()?);
    let words = decompressed(section.counted()?, size)?;
    let Some((0, words)) = words.split_last() else {
        return if count == 0 { Ok(Vec::new()) } else { Err(damaged("words")) };
    };
    let tokens: Vec<String> =
        words.split(|byte| *byte == 0).map(|word| String::from_utf8_lossy(word).into_owned()).collect();
    if tokens.len() == count { Ok(tokens) } else { Err(damaged("words")) }
}

fn strings(mut section: Cursor<'_>) -> Parsed<Vec<u32>> {
    let count = section.u64()?;
    let bytes = section.take(count.saturating_mul(4))?;
    Ok(bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect())
}

/// The sections that describe the tree of prims and attributes.
struct Tree {
    /// Tokens of names, with values.
    fields: Vec<(u32, u64)>,
    /// Fields of the field sets, each ended by [`END`].
    field_sets: Vec<u32>,
    /// The paths in the order of the tree.
    nodes: Vec<Node>,
    /// Of each path: its first field and its type.
    specs: HashMap<u32, (u32, u32)>,
}

/// A path.
struct Node {
    /// Its number.
    path: u32,
    /// Position of its parent in the tree; none for the root.
    parent: Option<usize>,
    /// Token of its last name.
    name: u32,
}

impl Tree {
    fn read(sections: &Sections<'_>, tokens: &[String]) -> Parsed<Self> {
        let mut section = sections.get("FIELDS")?;
        let count = section.count()?;
        let names: Vec<u32> = unpacked(section.counted()?, count)?;
        let values = decompressed(section.counted()?, count.saturating_mul(8))?;
        let values = values.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
        let fields: Vec<(u32, u64)> = names.into_iter().zip(values).collect();

        let mut section = sections.get("FIELDSETS")?;
        let count = section.count()?;
        let field_sets = unpacked(section.counted()?, count)?;

        let mut section = sections.get("SPECS")?;
        let count = section.count()?;
        let mut columns = || unpacked::<u32>(section.counted()?, count);
        let [paths, first_fields, kinds] = [columns()?, columns()?, columns()?];
        let specs = paths.into_iter().zip(first_fields.into_iter().zip(kinds)).collect();

        Ok(Self { fields, field_sets, nodes: nodes(sections.get("PATHS")?, tokens.len())?, specs })
    }

    /// The fields that begin at an index of the field sets.
    fn fields(&self, first: u32, tokens: &[String]) -> Parsed<Fields> {
        let set = self.field_sets.get(first as usize..).ok_or_else(|| damaged("fields"))?;
        let field = |index: &u32| {
            let (name, value) = self.fields.get(*index as usize)?;
            Some((tokens.get(*name as usize)?.clone(), *value))
        };
        let set = set.iter().take_while(|index| **index != END).map(field);
        set.collect::<Option<_>>().ok_or_else(|| damaged("fields"))
    }

    /// The layer's metadata, and its prims with their attributes.
    fn into_prims(self, tokens: &[String]) -> Parsed<(Fields, Vec<ReadPrim>)> {
        let (mut metadata, mut prims) = (Fields::new(), Vec::<ReadPrim>::new());
        // For each path that is a prim, its position in `prims`.
        let mut positions: Vec<Option<usize>> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let above = node.parent.and_then(|parent| positions[parent]);
            let mut position = None;
            let spec = self.specs.get(&node.path).filter(|(_, kind)| SpecType::of(*kind).is_some());
            if let Some((first, kind)) = spec {
                let fields = self.fields(*first, tokens)?;
                let word = |key: &str| inlined_token(fields.get(key).copied(), tokens).unwrap_or_default();
                let name = &tokens[node.name as usize];
                match (SpecType::of(*kind), above) {
                    (Some(SpecType::PseudoRoot), _) => metadata = fields,
                    (Some(SpecType::Attribute), Some(prim)) => prims[prim].attributes.push(ReadAttribute {
                        name: name.clone(),
                        interpolation: word("interpolation"),
                        value: fields.get("timeSamples").or(fields.get("default")).copied(),
                    }),
                    (Some(SpecType::Prim), _) => {
                        position = Some(prims.len());
                        let parent = above.map_or("", |prim| &prims[prim].path);
                        let path = format!("{parent}/{name}");
                        prims.push(ReadPrim { path, class: word("typeName"), attributes: Vec::new() });
                    }
                    _ => {}
                }
            }
            positions.push(position);
        }
        Ok((metadata, prims))
    }
}

/// The token that a value holds in itself.
pub(super) fn inlined_token(value: Option<u64>, tokens: &[String]) -> Option<String> {
    let value = value.filter(|value| value & (INLINE | ARRAY) == INLINE)?;
    (Type::of(value) == Some(Type::Token)).then(|| tokens.get(value as u32 as usize).cloned()).flatten()
}

/// The paths, in the order of the tree.
fn nodes(mut section: Cursor<'_>, tokens: usize) -> Parsed<Vec<Node>> {
    let invalid = || damaged("paths");
    section.count()?;
    let count = section.count()?;
    let paths: Vec<u32> = unpacked(section.counted()?, count)?;
    let names: Vec<i32> = unpacked(section.counted()?, count)?;
    let jumps: Vec<i32> = unpacked(section.counted()?, count)?;
    let mut nodes = Vec::with_capacity(count);
    // Positions of siblings that follow what is below a path, with their parents.
    let mut later: Vec<(usize, Option<usize>)> = Vec::new();
    let (mut at, mut parent) = (0, None);
    // Each path is visited once, in its order: a sibling comes right after what is below the one before it.
    while nodes.len() < count {
        if at != nodes.len() || names[at].unsigned_abs() as usize >= tokens {
            return Err(invalid());
        }
        nodes.push(Node { path: paths[at], parent, name: names[at].unsigned_abs() });
        let jump = jumps[at];
        if jump > 0 {
            later.push((at + jump as usize, parent));
        }
        match jump {
            1.. | -1 => parent = Some(at),
            0 => {}
            _ => match later.pop() {
                Some((next, above)) => {
                    parent = above;
                    at = next;
                    continue;
                }
                None => break,
            },
        }
        at += 1;
    }
    if nodes.len() == count && later.is_empty() { Ok(nodes) } else { Err(invalid()) }
}
