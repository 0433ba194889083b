//! The file: its buffers, and the numbers that its accessors point at.

use std::path::Path;

use gltf::accessor::{DataType, Dimensions};
use gltf::json::validation::Checked;
use gltf::{Accessor, Document};

use super::uri;
use crate::error::{Error, Result, one_line};
use crate::io::hash::Hasher;
use crate::io::source;

/// A parsed file with its binary data.
pub(super) struct File {
    pub document: Document,
    buffers: Vec<Vec<u8>>,
    /// Hash of the file and of its buffers.
    pub content: String,
}

impl File {
    /// Reads a .gltf or .glb file and the buffers that it names; textures are not touched.
    ///
    /// # Errors
    /// A file that is missing, cut short or malformed; a buffer that is missing (named); an extension that is
    /// required and unknown.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = source::read(path)?;
        check_length(&bytes).map_err(|what| Error::file(path, what))?;
        let (document, blob) =
            parse(&bytes).map_err(|error| Error::file(path, format!("not a whole glTF file ({error})")))?;
        let known = ["KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_unlit"];
        if let Some(needed) = document.extensions_required().find(|name| !known.contains(name)) {
            return Err(Error::file(
                path,
                format!("needs the glTF extension {needed}, which frazil does not read"),
            ));
        }
        let folder = path.parent().unwrap_or(Path::new("."));
        // Each by itself, so that the message can name the one at fault.
        let mut blob = blob;
        let buffers = document.buffers().map(|buffer| {
            let name = match buffer.source() {
                gltf::buffer::Source::Uri(uri) if !uri.starts_with("data:") => {
                    format!("\"{}\"", one_line(uri))
                }
                _ => (buffer.index() + 1).to_string(),
            };
            let wrong = |what: String| Error::file(path, format!("buffer {name} {what}"));
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
        Ok(Self { document, buffers, content: content.finish() })
    }

    /// The elements of an accessor as rows of `N` numbers; normalised integers become 0..=1 or -1..=1.
    ///
    /// # Errors
    /// Another number of components; data that lies beyond its buffer; a number that is not finite.
    pub fn rows<const N: usize>(&self, accessor: &Accessor) -> std::result::Result<Vec<[f32; N]>, String> {
        let place = format!("accessor {}", accessor.index());
        if components(accessor.dimensions()) != N {
            return Err(format!("{place} has not {N} components"));
        }
        let scale = |value: f64| match (accessor.normalized(), accessor.data_type()) {
            (true, DataType::I8) => (value / 127.0).max(-1.0),
            (true, DataType::U8) => value / 255.0,
            (true, DataType::I16) => (value / 32767.0).max(-1.0),
            (true, DataType::U16) => value / 65535.0,
            _ => value,
        };
        let row = |values: [f64; N]| values.map(|value| scale(value) as f32);
        let beyond = || format!("{place} reaches beyond its buffer");
        let mut rows: Vec<[f32; N]> = match accessor.view() {
            Some(view) => self
                .numbers::<N>(&view, accessor.offset(), accessor.count(), accessor.data_type())
                .ok_or_else(beyond)?
                .into_iter()
                .map(row)
                .collect(),
            // Zeros that no data stands for: as many as there are vertices, and each of those has bytes somewhere.
            None if accessor.count() > self.buffers.iter().map(Vec::len).sum() => return Err(beyond()),
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
                *rows.get_mut(index as usize).ok_or_else(beyond)? = row(values);
            }
        }
        if rows.as_flattened().iter().any(|value| !value.is_finite()) {
            return Err(format!("{place} has numbers that are not finite"));
        }
        Ok(rows)
    }

    /// The whole numbers of an accessor in rows of `N`: indices, joints.
    ///
    /// # Errors
    /// As [`File::rows`].
    pub fn indices<const N: usize>(&self, accessor: &Accessor) -> std::result::Result<Vec<[u32; N]>, String> {
        let place = format!("accessor {}", accessor.index());
        if components(accessor.dimensions()) != N {
            return Err(format!("{place} has not {N} components"));
        }
        let numbers = accessor.view().and_then(|view| {
            self.numbers::<N>(&view, accessor.offset(), accessor.count(), accessor.data_type())
        });
        let numbers = numbers.ok_or_else(|| format!("{place} reaches beyond its buffer"))?;
        Ok(numbers.into_iter().map(|row| row.map(|value| value as u32)).collect())
    }

    /// Reads packed or strided numbers; none when they lie beyond the data.
    fn numbers<const N: usize>(
        &self,
        view: &gltf::buffer::View,
        offset: usize,
        count: usize,
        kind: DataType,
    ) -> Option<Vec<[f64; N]>> {
        // Nothing is made of the numbers once readers are to stop.
        if count == 0 || source::is_stopped() {
            return Some(Vec::new());
        }
        let size = kind.size();
        let stride = view.stride().unwrap_or(size * N);
        // Rows that overlap could be any number of them.
        if stride < size * N {
            return None;
        }
        let buffer = self.buffers.get(view.buffer().index())?;
        let data = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?;
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

/// Reads the JSON and checks that what it names is there.
fn parse(bytes: &[u8]) -> std::result::Result<(Document, Option<Vec<u8>>), String> {
    let said = |error: gltf::Error| one_line(&error.to_string());
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(bytes).map_err(said)?;
    let mut root = document.into_json();
    // The check below looks at the bounds of positions before it knows that they are there, and insists on them;
    // nothing here needs the bounds.
    for attribute in root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values())
    {
        let accessor = root.accessors.get_mut(attribute.value()).ok_or("an attribute names no accessor")?;
        accessor.min = Some(vec![0.0; 3].into());
        accessor.max = Some(vec![0.0; 3].into());
    }
    let (nodes, accessors) = (root.nodes.len(), root.accessors.len());
    for animation in &mut root.animations {
        // Extensions animate other properties than a node's: they move no vertex.
        animation.channels.retain(|channel| matches!(channel.target.path, Checked::Valid(_)));
        let samplers = animation.samplers.len();
        if animation.channels.iter().any(|channel| channel.sampler.value() >= samplers) {
            return Err("a channel names no sampler".into());
        }
        if animation.channels.iter().any(|channel| channel.target.node.value() >= nodes) {
            return Err("a channel names no node".into());
        }
        let keys = animation.samplers.iter().flat_map(|sampler| [sampler.input, sampler.output]);
        if keys.into_iter().any(|accessor| accessor.value() >= accessors) {
            return Err("the sampler of an animation names no accessor".into());
        }
    }
    let targets =
        root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.targets.iter().flatten());
    let mut named = targets.flat_map(|target| [target.positions, target.normals, target.tangents]).flatten();
    if named.any(|accessor| accessor.value() >= accessors) {
        return Err("a morph target names no accessor".into());
    }
    Ok((Document::from_json(root).map_err(said)?, blob))
}

/// A .glb says its own length.
fn check_length(bytes: &[u8]) -> std::result::Result<(), String> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if bytes.starts_with(b"glTF") {
        let told = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
        if told.is_none_or(|told| bytes.len() < told) {
            return Err(format!("the .glb file is cut short at {} bytes", bytes.len()));
        }
        // A header of 12 bytes, and one of 8 for the JSON that must follow.
        if told.is_some_and(|told| told < 20) {
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
