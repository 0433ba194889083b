//! A USD file: its format, units and contents.

use super::layer::{Attribute, Layer, Value};
use super::{binary, text};
use crate::error::Result;
use crate::geometry::Vec3;

/// Extension of binary files; those of frames were text in frazil 0.1.
pub const BINARY: &str = "usdc";

/// How a layer is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// For people: .usda.
    Text,
    /// For programs: .usdc and .usd.
    Binary,
}

impl Format {
    /// The format of files with an extension in lower case; none if they are not USD.
    pub fn of(extension: &str) -> Option<Self> {
        match extension {
            "usda" => Some(Self::Text),
            "usdc" | "usd" => Some(Self::Binary),
            _ => None,
        }
    }

    pub(super) fn bytes(self, layer: Layer) -> Result<Vec<u8>> {
        match self {
            Self::Text => Ok(text::text(&layer).into_bytes()),
            Self::Binary => binary::bytes(layer),
        }
    }
}

/// A layer with a summary of its contents.
pub struct File {
    pub(super) layer: Layer,
    pub(super) contents: ContentsByName,
}

/// Contents of prims or grids, with their names.
pub type ContentsByName = Vec<(String, Contents)>;

/// The contents of a prim or a grid at a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Contents {
    /// Count of points, if it has any kind of points.
    pub points: Option<usize>,
    /// Count of faces, if it is a mesh.
    pub faces: Option<usize>,
    /// Minimum and maximum corner of a box around it (m); none if it is empty.
    pub extent: Option<[[f32; 3]; 2]>,
}

impl File {
    /// The contents of its prims.
    pub fn contents(&self) -> &ContentsByName {
        &self.contents
    }

    /// Its bytes.
    ///
    /// # Errors
    /// A layer that cannot be written in the format.
    pub fn bytes(self, format: Format) -> Result<Vec<u8>> {
        format.bytes(self.layer)
    }
}

/// Unit and up axis of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Metres per unit.
    pub metres: f64,
    /// Whether Z is up; otherwise Y.
    pub z_up: bool,
}

impl Units {
    /// Metres, Y up.
    pub const OWN: Self = Self { metres: 1.0, z_up: false };

    /// Metadata of a layer with frames at a rate.
    pub(super) fn metadata(self, first: i32, last: i32, fps: f64) -> Vec<(&'static str, Value)> {
        let axis = if self.z_up { "Z" } else { "Y" };
        vec![
            ("startTimeCode", Value::Double(first.into())),
            ("endTimeCode", Value::Double(last.into())),
            ("timeCodesPerSecond", Value::Double(fps)),
            ("metersPerUnit", Value::Double(self.metres)),
            ("upAxis", Value::Token(axis.into())),
        ]
    }

    /// Metadata of a layer with one frame.
    pub(super) fn metadata_of_frame(self, frame: i32, fps: f64) -> Vec<(&'static str, Value)> {
        self.metadata(frame, frame, fps)
    }
}

impl Attribute {
    /// An attribute with this type and name.
    pub(super) fn declared((class, name): (&str, &str)) -> Self {
        Self::new(class, name)
    }
}

/// The corners of the box around some boxes, given by their corners.
pub(super) fn bounds(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Option<[[f32; 3]; 2]> {
    let (low, high) = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
    Some([low.into(), high.into()])
}

/// The value of an extent; of nothing it is the range that USD takes for empty.
pub(super) fn extent_value(extent: Option<[[f32; 3]; 2]>) -> Value {
    Value::Vectors(extent.unwrap_or([[f32::MAX; 3], [-f32::MAX; 3]]).to_vec())
}
