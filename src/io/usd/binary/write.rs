//! Writes a layer as a crate.

use std::collections::HashMap;

use super::packing::{Integer, ToBytes, put_compressed, put_packed};
use super::{ARRAY, END, HEADER, IDENTIFICATION, INLINE, PACKED, SpecType, Type};
use crate::error::{Error, Result};
use crate::io::usd::layer::{Attribute, Layer, Prim, Property, Specifier, Value};

/// The bytes of a layer.
///
/// # Errors
/// `Internal`: what only the layers that are written as text may have: relationships, API schemas, connections, dictionaries.
pub(in crate::io) fn bytes(layer: Layer) -> Result<Vec<u8>> {
    let mut out = Writer::default();
    out.heap.resize(HEADER, 0);
    // Names of attributes are stored as negative indices, so none may be the first.
    out.token("");
    let mut fields = Vec::new();
    for (key, entry) in layer.metadata {
        fields.push((key, out.value(entry)?));
    }
    fields.push(("primChildren", out.names(layer.prims.iter().map(|prim| &prim.name[..]))));
    let root = out.spec(SpecType::PseudoRoot, fields);
    let mut children = Vec::new();
    for prim in layer.prims {
        children.push(out.prim(prim)?);
    }
    let root = Node { name: 0, is_property: false, path: root, children };
    Ok(out.finish(&root))
}

/// The version that is written.
const VERSION: [u8; 8] = [0, 8, 0, 0, 0, 0, 0, 0];
/// Arrays with fewer numbers are not packed.
const MIN_PACKED: usize = 16;
/// Tables of floats are no longer.
const MAX_TABLE: usize = 1023;

/// A prim or attribute in the tree of paths.
struct Node {
    /// Token of its name.
    name: u32,
    is_property: bool,
    /// Index of its path.
    path: u32,
    children: Vec<Node>,
}

/// What has been gathered of a crate.
#[derive(Default)]
struct Writer {
    /// The file so far: the header and the values.
    heap: Vec<u8>,
    tokens: Vec<String>,
    token_indices: HashMap<String, u32>,
    /// Tokens of the strings.
    strings: Vec<u32>,
    /// Tokens of names, with values.
    fields: Vec<(u32, u64)>,
    /// Fields of the field sets, each ended by [`END`].
    field_sets: Vec<u32>,
    /// First field and type of each spec; its path has the same index.
    specs: Vec<(u32, SpecType)>,
}

impl Writer {
    fn token(&mut self, text: &str) -> u32 {
        if let Some(index) = self.token_indices.get(text) {
            return *index;
        }
        let index = self.tokens.len() as u32;
        self.tokens.push(text.into());
        self.token_indices.insert(text.into(), index);
        index
    }

    /// Adds a spec with its fields; returns the index of its path.
    fn spec(&mut self, spec_type: SpecType, fields: Vec<(&str, u64)>) -> u32 {
        let first = self.field_sets.len() as u32;
        for (name, value) in fields {
            let name = self.token(name);
            self.field_sets.push(self.fields.len() as u32);
            self.fields.push((name, value));
        }
        self.field_sets.push(END);
        self.specs.push((first, spec_type));
        self.specs.len() as u32 - 1
    }

    fn prim(&mut self, prim: Prim) -> Result<Node> {
        let Prim { specifier, class, name, metadata, schemas, properties, children } = prim;
        ensure_none(schemas.is_empty(), "API schemas")?;
        let specifier = match specifier {
            Specifier::Def => 0,
            Specifier::Over => 1,
        };
        let mut fields = vec![("specifier", inline(Type::Specifier, specifier))];
        if !class.is_empty() {
            fields.push(("typeName", inline(Type::Token, self.token(class).into())));
        }
        for (key, entry) in metadata {
            fields.push((key, self.value(entry)?));
        }
        if !properties.is_empty() {
            fields.push(("properties", self.names(properties.iter().map(Property::name))));
        }
        if !children.is_empty() {
            fields.push(("primChildren", self.names(children.iter().map(|child| &child.name[..]))));
        }
        let path = self.spec(SpecType::Prim, fields);
        let mut nodes = Vec::new();
        for property in properties {
            let Property::Attribute(attribute) = property else { return Err(unwritten("relationships")) };
            nodes.push(self.attribute(attribute)?);
        }
        for child in children {
            nodes.push(self.prim(child)?);
        }
        Ok(Node { name: self.token(&name), is_property: false, path, children: nodes })
    }

    fn attribute(&mut self, attribute: Attribute) -> Result<Node> {
        ensure_none(attribute.connection.is_none(), "connections")?;
        let mut fields = vec![("typeName", inline(Type::Token, self.token(&attribute.class).into()))];
        if attribute.is_custom {
            fields.push(("custom", inline(Type::Bool, 1)));
        }
        if attribute.is_uniform {
            fields.push(("variability", inline(Type::Variability, 1)));
        }
        if let Some(interpolation) = attribute.interpolation {
            fields.push(("interpolation", inline(Type::Token, self.token(interpolation).into())));
        }
        if let Some(at_all_times) = attribute.value {
            fields.push(("default", self.value(at_all_times)?));
        }
        if !attribute.samples.is_empty() {
            fields.push(("timeSamples", self.samples(attribute.samples)?));
        }
        let path = self.spec(SpecType::Attribute, fields);
        Ok(Node { name: self.token(&attribute.name), is_property: true, path, children: Vec::new() })
    }

    /// Names of children.
    fn names<'a>(&mut self, names: impl Iterator<Item = &'a str>) -> u64 {
        let tokens: Vec<u32> = names.map(|name| self.token(name)).collect();
        let offset = self.put(&(tokens.len() as u64).to_le_bytes());
        tokens.iter().for_each(|token| _ = self.put(&token.to_le_bytes()));
        stored(Type::TokenVector, offset)
    }

    /// Puts bytes on the heap; returns their offset.
    fn put(&mut self, bytes: &[u8]) -> u64 {
        let offset = self.heap.len() as u64;
        self.heap.extend_from_slice(bytes);
        offset
    }

    fn samples(&mut self, samples: Vec<(i32, Value)>) -> Result<u64> {
        // First the distance to the value of the times, which are before it; then the distance to the values, which follow at once.
        let offset = self.put(&[0; 8]);
        let (frames, values): (Vec<i32>, Vec<Value>) = samples.into_iter().unzip();
        let times = self.array(Type::Double, &frames.into_iter().map(f64::from).collect::<Vec<f64>>());
        let times_offset = self.put(&times.to_le_bytes());
        self.put(&8u64.to_le_bytes());
        self.put(&(values.len() as u64).to_le_bytes());
        let first = self.put(&vec![0; 8 * values.len()]) as usize;
        for (number, value) in values.into_iter().enumerate() {
            let value = self.value(value)?.to_le_bytes();
            self.heap[first + 8 * number..][..8].copy_from_slice(&value);
        }
        self.heap[offset as usize..][..8].copy_from_slice(&(times_offset - offset).to_le_bytes());
        Ok(stored(Type::TimeSamples, offset))
    }

    fn value(&mut self, value: Value) -> Result<u64> {
        Ok(match value {
            Value::Float(value) => inline(Type::Float, value.to_bits().into()),
            Value::Double(value) => stored(Type::Double, self.put(&value.to_le_bytes())),
            Value::Token(text) => inline(Type::Token, self.token(&text).into()),
            Value::Text(text) => {
                let token = self.token(&text);
                self.strings.push(token);
                inline(Type::Text, self.strings.len() as u64 - 1)
            }
            Value::Asset(path) => inline(Type::Asset, self.token(&path).into()),
            Value::Vector(parts) => stored(Type::Float3, self.put(&parts.map(f32::to_le_bytes).concat())),
            Value::Bools(values) => self.array(Type::Bool, &values),
            Value::Ints(values) => self.integers(Type::Int, &values),
            Value::Uints(values) => self.integers(Type::Uint, &values),
            Value::Longs(values) => self.integers(Type::Int64, &values),
            Value::Floats(values) => self.floats(&values),
            Value::Doubles(values) => self.array(Type::Double, &values),
            Value::Pairs(values) => self.array(Type::Float2, &values),
            Value::DoublePairs(values) => self.array(Type::Double2, &values),
            Value::Vectors(values) => self.array(Type::Float3, &values),
            Value::DoubleVectors(values) => self.array(Type::Double3, &values),
            Value::IntVectors(values) => self.array(Type::Int3, &values),
            Value::Assets(_) => return Err(unwritten("arrays of assets")),
            Value::Dictionary(_) => return Err(unwritten("dictionaries")),
        })
    }

    fn array<T: ToBytes>(&mut self, class: Type, values: &[T]) -> u64 {
        if values.is_empty() {
            return stored(class, 0) | ARRAY;
        }
        let offset = self.put(&(values.len() as u64).to_le_bytes());
        self.heap.reserve(size_of_val(values));
        values.iter().for_each(|value| value.put(&mut self.heap));
        stored(class, offset) | ARRAY
    }

    fn integers<T: Integer>(&mut self, class: Type, values: &[T]) -> u64 {
        if values.len() < MIN_PACKED {
            return self.array(class, values);
        }
        let offset = self.put(&(values.len() as u64).to_le_bytes());
        put_packed(&mut self.heap, values);
        stored(class, offset) | ARRAY | PACKED
    }

    /// Floats of which few differ, such as widths that are all the same, as a table of these and an index for each.
    fn floats(&mut self, values: &[f32]) -> u64 {
        let max = (values.len() / 4).min(MAX_TABLE);
        let (mut table, mut indices, mut known) =
            (Vec::new(), Vec::with_capacity(values.len()), HashMap::new());
        for value in values {
            let index = *known.entry(value.to_bits()).or_insert_with(|| {
                table.push(*value);
                table.len() as u32 - 1
            });
            if table.len() > max {
                return self.array(Type::Float, values);
            }
            indices.push(index);
        }
        if values.len() < MIN_PACKED {
            return self.array(Type::Float, values);
        }
        let offset = self.put(&(values.len() as u64).to_le_bytes());
        self.heap.push(b't');
        (table.len() as u32).put(&mut self.heap);
        table.iter().for_each(|value| value.put(&mut self.heap));
        put_packed(&mut self.heap, &indices);
        stored(Type::Float, offset) | ARRAY | PACKED
    }

    /// The file, whose paths are those below `root`.
    fn finish(self, root: &Node) -> Vec<u8> {
        let Self { heap: mut out, tokens, strings, fields, field_sets, specs, .. } = self;
        let mut contents: Vec<(&str, [u64; 2])> = Vec::new();
        let mut section = |out: &mut Vec<u8>, name, write: &dyn Fn(&mut Vec<u8>)| {
            let start = out.len() as u64;
            write(out);
            contents.push((name, [start, out.len() as u64 - start]));
        };
        section(&mut out, "TOKENS", &|out| {
            let words: Vec<u8> = tokens.iter().flat_map(|token| token.bytes().chain([0])).collect();
            [tokens.len(), words.len()].iter().for_each(|count| (*count as u64).put(out));
            put_compressed(out, &words);
        });
        section(&mut out, "STRINGS", &|out| {
            (strings.len() as u64).put(out);
            strings.iter().for_each(|token| token.put(out));
        });
        section(&mut out, "FIELDS", &|out| {
            (fields.len() as u64).put(out);
            put_packed(out, &fields.iter().map(|(name, _)| *name).collect::<Vec<u32>>());
            put_compressed(
                out,
                &fields.iter().flat_map(|(_, value)| value.to_le_bytes()).collect::<Vec<u8>>(),
            );
        });
        section(&mut out, "FIELDSETS", &|out| {
            (field_sets.len() as u64).put(out);
            put_packed(out, &field_sets);
        });
        section(&mut out, "PATHS", &|out| {
            let mut tree = PathTree::default();
            tree.add(root, false);
            let count = tree.paths.len() as u64;
            [count, count].iter().for_each(|count| count.put(out));
            put_packed(out, &tree.paths);
            put_packed(out, &tree.names);
            put_packed(out, &tree.jumps);
        });
        section(&mut out, "SPECS", &|out| {
            (specs.len() as u64).put(out);
            put_packed(out, &(0..specs.len() as u32).collect::<Vec<u32>>());
            put_packed(out, &specs.iter().map(|(field_set, _)| *field_set).collect::<Vec<u32>>());
            put_packed(out, &specs.iter().map(|(_, kind)| *kind as u32).collect::<Vec<u32>>());
        });
        let contents_at = out.len() as u64;
        (contents.len() as u64).put(&mut out);
        for (name, extent) in contents {
            let mut padded = [0; 16];
            padded[..name.len()].copy_from_slice(name.as_bytes());
            out.extend_from_slice(&padded);
            extent.put(&mut out);
        }
        let header = [*IDENTIFICATION, VERSION, contents_at.to_le_bytes()].concat();
        out[..header.len()].copy_from_slice(&header);
        out
    }
}

/// Paths in the order of the tree: a path, then those below it.
#[derive(Default)]
struct PathTree {
    paths: Vec<u32>,
    /// Tokens of the last names; negative for attributes.
    names: Vec<i32>,
    /// Distance to the next path with the same parent; 0 if it follows at once, -1 if there is none but one below, -2 without either.
    jumps: Vec<i32>,
}

impl PathTree {
    fn add(&mut self, node: &Node, has_next: bool) {
        let at = self.paths.len();
        self.paths.push(node.path);
        self.names.push(if node.is_property { -(node.name as i32) } else { node.name as i32 });
        self.jumps.push(0);
        for (number, child) in node.children.iter().enumerate() {
            self.add(child, number + 1 < node.children.len());
        }
        let distance = (self.paths.len() - at) as i32;
        self.jumps[at] = match (node.children.is_empty(), has_next) {
            (false, true) => distance,
            (false, false) => -1,
            (true, true) => 0,
            (true, false) => -2,
        };
    }
}

/// A value that is stored in itself.
fn inline(class: Type, bits: u64) -> u64 {
    INLINE | (class as u64) << 48 | bits
}

/// A value at an offset in the file.
fn stored(class: Type, offset: u64) -> u64 {
    (class as u64) << 48 | offset
}

fn unwritten(what: &str) -> Error {
    Error::Internal(format!("USD: {what} in a binary layer"))
}

fn ensure_none(is_none: bool, what: &str) -> Result<()> {
    if is_none { Ok(()) } else { Err(unwritten(what)) }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use openusd::sdf::{self, AbstractData};
    use openusd::usdc::CrateData;

    use super::*;

    /// Values of every kind, with those that the library `openusd` reads.
    fn values() -> Vec<(Value, sdf::Value)> {
        let long: Vec<i32> = (0..1000).map(|n| n * n % 77 - 7).chain([i32::MIN, i32::MAX, 0]).collect();
        let longs: Vec<i64> = (0..100).map(|n| (n << 40) - 3).chain([i64::MIN, i64::MAX]).collect();
        let wide: Vec<u32> = (0..40).map(|n| n * 100_000_007).chain([u32::MAX]).collect();
        let vectors: Vec<[f32; 3]> = (0..50).map(|n| [n as f32, 0.5, -1.0]).collect();
        vec![
            (Value::Token("inherited".into()), sdf::Value::Token("inherited".into())),
            (Value::Float(-0.5), sdf::Value::Float(-0.5)),
            (Value::Double(0.1), sdf::Value::Double(0.1)),
            (Value::Text("displayOpacity".into()), sdf::Value::String("displayOpacity".into())),
            (Value::Asset("./a.vdb".into()), sdf::Value::AssetPath("./a.vdb".to_string().into())),
            (Value::Vector([0.1, -2.0, 3e20]), sdf::Value::Vec3f([0.1, -2.0, 3e20].into())),
            (Value::Bools(vec![true, false]), sdf::Value::BoolVec(vec![true, false])),
            (Value::Ints(vec![3, -3, 3, i32::MIN]), sdf::Value::IntVec(vec![3, -3, 3, i32::MIN])),
            (Value::Ints(long.clone()), sdf::Value::IntVec(long)),
            (Value::Ints(vec![3; 20]), sdf::Value::IntVec(vec![3; 20])),
            (Value::Uints(wide.clone()), sdf::Value::UintVec(wide)),
            (Value::Longs(longs.clone()), sdf::Value::Int64Vec(longs)),
            (Value::Floats(vec![0.1, -0.0]), sdf::Value::FloatVec(vec![0.1, -0.0])),
            (Value::Floats([0.5, 0.1].repeat(20)), sdf::Value::FloatVec([0.5, 0.1].repeat(20))),
            (Value::Doubles(vec![-1e300]), sdf::Value::DoubleVec(vec![-1e300])),
            (Value::Pairs(vec![[0.5, -0.25]]), sdf::Value::Vec2fVec(vec![[0.5, -0.25].into()])),
            (
                Value::Vectors(vectors.clone()),
                sdf::Value::Vec3fVec(vectors.into_iter().map(Into::into).collect()),
            ),
            (Value::IntVectors(vec![[1, -2, 3]]), sdf::Value::Vec3iVec(vec![[1, -2, 3].into()])),
        ]
    }

    fn layer() -> Layer {
        let mut root = Prim::def("Xform", "shot");
        for name in ["hero", "other"] {
            let mut mesh = Prim::def("Mesh", name);
            mesh.add(Attribute::token("subdivisionScheme", "none"));
            for (at, (value, _)) in values().into_iter().enumerate() {
                mesh.add(Attribute::new("any", format!("primvars:a{at}")).at(7, value.clone()).at(9, value));
            }
            root.children.push(mesh);
        }
        Layer::new(root, vec![("upAxis", Value::Token("Y".into()))])
    }

    #[test]
    fn every_value_is_read_back_and_the_bytes_are_the_same_each_time() {
        let bytes = super::bytes(layer()).unwrap();
        assert_eq!(bytes, super::bytes(layer()).unwrap());
        let data = CrateData::open(Cursor::new(bytes), true).unwrap();
        let field =
            |path: &str, key: &str| data.get_field(&sdf::Path::new(path).unwrap(), key).unwrap().into_owned();
        for name in ["hero", "other"] {
            for (at, (_, wanted)) in values().into_iter().enumerate() {
                let samples = field(&format!("/shot/{name}.primvars:a{at}"), "timeSamples");
                assert_eq!(
                    samples,
                    sdf::Value::TimeSamples(vec![(7.0, wanted.clone()), (9.0, wanted)]),
                    "{at}"
                );
            }
        }
        assert_eq!(field("/", "defaultPrim"), sdf::Value::Token("shot".into()));
        assert_eq!(data.spec_paths().len(), 2 + 2 * (2 + values().len()));
    }

    /// What OpenUSD requires and the library `openusd` does not: see `crateDataTypes.h` and `MinCompressedArraySize` in `crateFile.cpp`.
    #[test]
    fn children_are_vectors_and_arrays_are_packed_from_16_integers_on() {
        let mut writer = Writer::default();
        let children = writer.names(["hero", "other"].into_iter());
        assert_eq!((children >> 48 & 0xFF, children & (ARRAY | INLINE | PACKED)), (41, 0));
        for (count, is_packed) in [(4, false), (15, false), (16, true)] {
            let values = writer.integers(Type::Int, &vec![7; count]);
            assert_eq!((values & ARRAY != 0, values & PACKED != 0), (true, is_packed), "{count}");
        }
    }

    #[test]
    fn what_is_only_written_as_text_is_an_error() {
        let mut prim = Prim::def("Mesh", "hero");
        prim.relate("material:binding", "/shot/materials/snow".into());
        let error = super::bytes(Layer::new(prim, Vec::new())).unwrap_err().to_string();
        assert!(error.contains("relationships"), "{error}");
    }
}
