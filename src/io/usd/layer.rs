//! A USD layer: prims with attributes and relationships. It is described once, and written as text or as a binary *crate*.
//!
//! Words are USD's own: a *prim* is a node of the scene, a *layer* is a file of prims, a *def* makes a prim and an *over* adds to one
//! that another layer makes, a *token* is a word with a meaning, an *asset* is the path of a file.

use std::collections::BTreeMap;

/// A layer.
pub(in crate::io) struct Layer {
    /// Its metadata, in the order of writing.
    pub metadata: Vec<(&'static str, Value)>,
    /// The prims at its root.
    pub prims: Vec<Prim>,
}

/// A prim.
pub(in crate::io) struct Prim {
    pub specifier: Specifier,
    /// Its type; empty for none, as that of an `over`.
    pub class: &'static str,
    pub name: String,
    /// Its metadata without API schemas.
    pub metadata: Vec<(&'static str, Value)>,
    /// The API schemas that are applied to it.
    pub schemas: Vec<&'static str>,
    pub properties: Vec<Property>,
    pub children: Vec<Prim>,
}

/// Whether a layer makes a prim or adds to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::io) enum Specifier {
    Def,
    Over,
}

/// A property of a prim.
pub(in crate::io) enum Property {
    Attribute(Attribute),
    /// A name and the path of the prim that it leads to.
    Relationship(String, String),
}

/// An attribute.
pub(in crate::io) struct Attribute {
    /// Type: `point3f[]`.
    pub class: String,
    /// Name, with its namespace: `primvars:st`.
    pub name: String,
    /// Whether it never varies with time.
    pub is_uniform: bool,
    /// Whether no schema of USD has it.
    pub is_custom: bool,
    /// The value at all times without samples.
    pub value: Option<Value>,
    /// Values at frames, ascending.
    pub samples: Vec<(i32, Value)>,
    /// What a primvar has a value for each of: `vertex`.
    pub interpolation: Option<&'static str>,
    /// The output that it is connected to.
    pub connection: Option<String>,
}

/// A value. Arrays end with `s`.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::io) enum Value {
    Float(f32),
    Double(f64),
    Token(String),
    Text(String),
    Asset(String),
    Vector([f32; 3]),
    Bools(Vec<bool>),
    Ints(Vec<i32>),
    Uints(Vec<u32>),
    Longs(Vec<i64>),
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Pairs(Vec<[f32; 2]>),
    DoublePairs(Vec<[f64; 2]>),
    Vectors(Vec<[f32; 3]>),
    DoubleVectors(Vec<[f64; 3]>),
    IntVectors(Vec<[i32; 3]>),
    Assets(Vec<String>),
    Dictionary(BTreeMap<&'static str, Value>),
}

impl Layer {
    /// A layer with one prim at its root, which is the default one.
    pub fn new(root: Prim, metadata: Vec<(&'static str, Value)>) -> Self {
        let default = ("defaultPrim", Value::Token(root.name.clone()));
        Self { metadata: std::iter::once(default).chain(metadata).collect(), prims: vec![root] }
    }
}

impl Prim {
    /// A new prim.
    pub fn def(class: &'static str, name: impl Into<String>) -> Self {
        Self {
            specifier: Specifier::Def,
            class,
            name: name.into(),
            metadata: Vec::new(),
            schemas: Vec::new(),
            properties: Vec::new(),
            children: Vec::new(),
        }
    }

    /// An addition to the prim of this name.
    pub fn over(name: impl Into<String>) -> Self {
        Self { specifier: Specifier::Over, ..Self::def("", name) }
    }

    /// Adds an attribute.
    pub fn add(&mut self, attribute: Attribute) {
        self.properties.push(Property::Attribute(attribute));
    }

    /// Adds a relationship to a prim.
    pub fn relate(&mut self, name: &str, to: String) {
        self.properties.push(Property::Relationship(name.into(), to));
    }
}

impl Property {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Attribute(attribute) => &attribute.name,
            Self::Relationship(name, _) => name,
        }
    }
}

impl Attribute {
    /// An attribute without a value.
    pub fn new(class: impl Into<String>, name: impl Into<String>) -> Self {
        Self {
            class: class.into(),
            name: name.into(),
            is_uniform: false,
            is_custom: false,
            value: None,
            samples: Vec::new(),
            interpolation: None,
            connection: None,
        }
    }

    /// A token that never varies with time.
    pub fn token(name: &str, value: &str) -> Self {
        Self { is_uniform: true, ..Self::new("token", name).with(Value::Token(value.into())) }
    }

    /// With a value at all times.
    pub fn with(self, value: Value) -> Self {
        Self { value: Some(value), ..self }
    }

    /// With a value at a frame.
    pub fn at(mut self, frame: i32, value: Value) -> Self {
        self.samples.push((frame, value));
        self
    }

    /// With an interpolation.
    pub fn interpolated(self, interpolation: &'static str) -> Self {
        Self { interpolation: Some(interpolation), ..self }
    }

    /// Connected to an output.
    pub fn connected(self, output: String) -> Self {
        Self { connection: Some(output), ..self }
    }
}
