//! The file: its buffers, and the numbers of its accessors.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use gltf::accessor::{DataType, Dimensions};
use gltf::{Accessor, Document};

use super::json::{self, Instancing};
use super::nodes::{Local, rotation};
use super::{meshopt, uri};
use crate::error::{Error, Result, one_line};
use crate::geometry::DVec3;
use crate::io::files::hash::Hasher;
use crate::io::files::source;

/// A parsed file with its binary data.
pub(super) struct File {
    pub document: Document,
    buffers: Vec<Vec<u8>>,
    /// The data of compressed buffer views, by their index.
    decoded: HashMap<usize, Vec<u8>>,
    instances: HashMap<usize, Instancing>,
    /// Accessors of zeros, which have no data.
    zeros: HashSet<usize>,
    /// Base colours of primitives (linear), by the indices of mesh and primitive.
    pub base_colours: HashMap<(usize, usize), [f32; 3]>,
    /// Whether it has materials, of which only base colours are read.
    pub has_materials: bool,
    /// Hash of the file and of its buffers.
    pub content: String,
}

impl File {
    /// Reads a .gltf or .glb file and its buffers; textures are ignored.
    ///
    /// # Errors
    /// A file that is missing, truncated or malformed; a buffer that is missing (named); a required extension that is unknown.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = source::read(path)?;
        check_length(&bytes).map_err(|what| Error::file(path, what))?;
        let parsed = json::parse(&bytes).map_err(|what| Error::file(path, what))?;
        let json::Parsed {
            document,
            blob,
            compressed,
            fallbacks,
            instances,
            zeros,
            base_colours,
            has_materials,
        } = parsed;
        let folder = path.parent().unwrap_or(Path::new("."));
        // One by one, so that the message can name the buffer at fault.
        let mut blob = blob;
        let buffers = document.buffers().map(|buffer| {
            let name = match buffer.source() {
                gltf::buffer::Source::Uri(uri) if !uri.starts_with("data:") => {
                    format!("\"{}\"", one_line(uri))
                }
                _ => (buffer.index() + 1).to_string(),
            };
            let wrong = |what: String| Error::file(path, format!("buffer {name} {what}"));
            if fallbacks.contains(&buffer.index()) {
                return Ok(Vec::new());
            }
            let data = uri::read(&buffer, folder, &mut blob)?.map_err(wrong)?;
            if data.len() < buffer.length() {
                return Err(wrong(format!("has {} bytes, not {}", data.len(), buffer.length())));
            }
            Ok(data)
        });
        let buffers = buffers.collect::<Result<Vec<_>>>()?;
        let mut content = Hasher::default();
        content.add(&bytes);
        buffers.iter().for_each(|buffer| {
            content.add(buffer);
        });
        let mut decoded = HashMap::new();
        for (view, found) in compressed {
            let wrong = |what: String| Error::file(path, format!("compressed buffer view {view} {what}"));
            let end = found.offset.saturating_add(found.length);
            let data = buffers.get(found.buffer).and_then(|buffer| buffer.get(found.offset..end));
            let data = data.ok_or_else(|| wrong("reaches beyond its buffer".into()))?;
            decoded.insert(view, meshopt::decode(&found, data).map_err(wrong)?);
        }
        let content = content.finish();
        Ok(Self { document, buffers, decoded, instances, zeros, base_colours, has_materials, content })
    }

    /// The elements of an accessor as rows of `N` numbers; normalised integers become 0..=1 or -1..=1.
    ///
    /// # Errors
    /// A different number of components; data beyond its buffer; a number that is not finite.
    pub fn rows<const N: usize>(&self, accessor: &Accessor) -> std::result::Result<Vec<[f32; N]>, String> {
        let scale = |value: f64| match (accessor.normalized(), accessor.data_type()) {
            (true, DataType::I8) => (value / 127.0).max(-1.0),
            (true, DataType::U8) => value / 255.0,
            (true, DataType::I16) => (value / 32767.0).max(-1.0),
            (true, DataType::U16) => value / 65535.0,
            _ => value,
        };
        let rows = self.values::<N>(accessor)?.into_iter();
        let rows: Vec<[f32; N]> = rows.map(|values| values.map(|value| scale(value) as f32)).collect();
        if rows.as_flattened().iter().any(|value| !value.is_finite()) {
            return Err(format!("accessor {} has numbers that are not finite", accessor.index()));
        }
        Ok(rows)
    }

    /// The integers of an accessor in rows of `N`: indices, joints.
    ///
    /// # Errors
    /// As [`File::rows`].
    pub fn indices<const N: usize>(&self, accessor: &Accessor) -> std::result::Result<Vec<[u32; N]>, String> {
        let rows = self.values::<N>(accessor)?.into_iter();
        Ok(rows.map(|row| row.map(|value| value as u32)).collect())
    }

    /// The transforms of the copies of a node's mesh, relative to the node; `None` if it is drawn once.
    ///
    /// # Errors
    /// As [`File::rows`]; transforms of different counts.
    pub fn instances(&self, node: usize) -> std::result::Result<Option<Vec<Local>>, String> {
        let Some(found) = self.instances.get(&node) else { return Ok(None) };
        let accessor = |index: usize| {
            self.document.accessors().nth(index).ok_or("instances refer to an accessor that does not exist")
        };
        let triples = |index: Option<usize>| -> std::result::Result<_, String> {
            index.map(|index| self.rows::<3>(&accessor(index)?)).transpose()
        };
        let (translations, scales) = (triples(found.translation)?, triples(found.scale)?);
        let rotations = found.rotation.map(|index| self.rows::<4>(&accessor(index)?)).transpose()?;
        let counts = [
            translations.as_ref().map(Vec::len),
            rotations.as_ref().map(Vec::len),
            scales.as_ref().map(Vec::len),
        ];
        let mut counts = counts.into_iter().flatten();
        let count = counts.next().unwrap_or(1);
        if counts.any(|other| other != count) {
            return Err(format!("the instances of node {node} have transforms of different counts"));
        }
        let vector = |rows: &Option<Vec<[f32; 3]>>, at: usize, default: f64| {
            rows.as_ref().map_or(DVec3::repeat(default), |rows| DVec3::from(rows[at].map(f64::from)))
        };
        let turn =
            |at: usize| rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |rows| rows[at].map(f64::from));
        let local = |at: usize| Local {
            translation: vector(&translations, at, 0.0),
            rotation: rotation(turn(at)),
            scale: vector(&scales, at, 1.0),
            weights: Vec::new(),
        };
        Ok(Some((0..count).map(local).collect()))
    }

    /// The elements of an accessor as they are stored, with the replacements of a sparse accessor.
    fn values<const N: usize>(&self, accessor: &Accessor) -> std::result::Result<Vec<[f64; N]>, String> {
        let name = format!("accessor {}", accessor.index());
        if components(accessor.dimensions()) != N {
            return Err(format!("{name} does not have {N} components"));
        }
        let beyond = || format!("{name} reaches beyond its buffer");
        let view = accessor.view().filter(|_| !self.zeros.contains(&accessor.index()));
        let mut rows = match view {
            Some(view) => self
                .numbers::<N>(&view, accessor.offset(), accessor.count(), accessor.data_type())
                .ok_or_else(beyond)?,
            // Zeros without data: at most one for each vertex, and every vertex has bytes somewhere.
            None if accessor.count() > self.bytes() => return Err(beyond()),
            None => vec![[0.0; N]; accessor.count()],
        };
        if let Some(sparse) = accessor.sparse() {
            let kind = match sparse.indices().index_type() {
                gltf::accessor::sparse::IndexType::U8 => DataType::U8,
                gltf::accessor::sparse::IndexType::U16 => DataType::U16,
                gltf::accessor::sparse::IndexType::U32 => DataType::U32,
            };
            let (indices, values) = (sparse.indices(), sparse.values());
            let at = self.numbers::<1>(&indices.view(), indices.offset(), sparse.count(), kind);
            let new =
                self.numbers::<N>(&values.view(), values.offset(), sparse.count(), accessor.data_type());
            for ([index], values) in at.ok_or_else(beyond)?.into_iter().zip(new.ok_or_else(beyond)?) {
                *rows.get_mut(index as usize).ok_or_else(beyond)? = values;
            }
        }
        Ok(rows)
    }

    /// Bytes of all buffers and of the decompressed data.
    fn bytes(&self) -> usize {
        self.buffers.iter().chain(self.decoded.values()).map(Vec::len).sum()
    }

    /// The bytes of a buffer view; `None` if they lie beyond the data.
    fn data(&self, view: &gltf::buffer::View) -> Option<&[u8]> {
        if let Some(decoded) = self.decoded.get(&view.index()) {
            return Some(decoded);
        }
        let buffer = self.buffers.get(view.buffer().index())?;
        buffer.get(view.offset()..view.offset().checked_add(view.length())?)
    }

    /// Reads packed or strided numbers; `None` if they lie beyond the data.
    fn numbers<const N: usize>(
        &self,
        view: &gltf::buffer::View,
        offset: usize,
        count: usize,
        kind: DataType,
    ) -> Option<Vec<[f64; N]>> {
        // Skips the work after a cancel.
        if count == 0 || source::is_stopped() {
            return Some(Vec::new());
        }
        let size = kind.size();
        let stride = view.stride().unwrap_or(size * N);
        // Overlapping rows would let a few bytes hold any number of elements.
        if stride < size * N {
            return None;
        }
        let data = self.data(view)?;
        let length = stride.checked_mul(count - 1)?.checked_add(size * N)?;
        let data = data.get(offset..offset.checked_add(length)?)?;
        let number = |at: usize| -> f64 {
            let raw = &data[at..at + size];
            match kind {
                DataType::I8 => f64::from(raw[0] as i8),
                DataType::U8 => f64::from(raw[0]),
                DataType::I16 => f64::from(i16::from_le_bytes([raw[0], raw[1]])),
                DataType::U16 => f64::from(u16::from_le_bytes([raw[0], raw[1]])),
                DataType::U32 => f64::from(u32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]])),
                DataType::F32 => f64::from(f32::from_le_bytes([raw[0], raw[1], raw[2], raw[3]])),
            }
        };
        let row = |index: usize| std::array::from_fn(|column| number(index * stride + column * size));
        Some((0..count).map(row).collect())
    }
}

/// A .glb states its own length.
fn check_length(bytes: &[u8]) -> std::result::Result<(), String> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if bytes.starts_with(b"glTF") {
        let stated = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
        if stated.is_none_or(|stated| bytes.len() < stated) {
            return Err(format!("the .glb file is cut short at {} bytes", bytes.len()));
        }
        // A header of 12 bytes, and one of 8 for the JSON that must follow.
        if stated.is_some_and(|stated| stated < 20) {
            return Err("the .glb file is damaged: it says that it is shorter than its own header".into());
        }
    }
    Ok(())
}

fn components(dimensions: Dimensions) -> usize {
    match dimensions {
        Dimensions::Scalar => 1,
        Dimensions::Vec2 => 2,
        Dimensions::Vec3 => 3,
        Dimensions::Vec4 | Dimensions::Mat2 => 4,
        Dimensions::Mat3 => 9,
        Dimensions::Mat4 => 16,
    }
}
