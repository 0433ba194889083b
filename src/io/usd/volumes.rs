//! Volumes in USD, whose grids are in .vdb files.

use super::file::extent_value;
use super::layer::{Attribute, Prim, Value};
use super::materials::Look;

/// A volume with its .vdb files.
pub struct VolumeFiles {
    /// Name of its prim.
    pub name: &'static str,
    /// Its fields, each a grid of the files.
    pub fields: &'static [Field],
    /// Whether it is for viewing only and not to be rendered.
    pub is_guide: bool,
    /// Its files, ascending by frame.
    pub files: Vec<VolumeFile>,
}

/// A file of a volume.
pub struct VolumeFile {
    /// Its frame.
    pub frame: i32,
    /// Its path, relative to the stage.
    pub path: String,
    /// Whether it is known that no voxel is active.
    pub is_empty: bool,
    /// Minimum and maximum corner of a box around the active voxels (m); none if there are none, or if it is not known.
    pub extent: Option<[[f32; 3]; 2]>,
}

/// A field of a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Its name in shaders.
    pub name: &'static str,
    /// Name of its grid.
    pub grid: &'static str,
    /// Its contents.
    pub holds: Holds,
}

/// The contents of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Holds {
    /// Distances from a surface.
    Distance,
    /// A density; a value of 1 stands for this density (1/m).
    Density(f32),
    /// Other numbers.
    Number,
    /// Vectors.
    Vector,
}

impl Field {
    /// A field with the name of its grid.
    pub const fn of(grid: &'static str, holds: Holds) -> Self {
        Self { name: grid, grid, holds }
    }
}

impl VolumeFiles {
    /// Its material; none if none of its fields is a distance or a density, because there is nothing to see.
    pub(in crate::io) fn look(&self) -> Option<Look> {
        self.fields.iter().find_map(|field| match field.holds {
            Holds::Distance => Some(Look::Snow),
            Holds::Density(_) => Some(Look::Fog),
            Holds::Number | Holds::Vector => None,
        })
    }

    /// Its prim in the shot.
    pub(in crate::io) fn prim(&self) -> Prim {
        let mut volume = Prim::def("Volume", self.name);
        if self.is_guide {
            volume.add(Attribute::token("purpose", "guide"));
        }
        if let Some(look) = self.look() {
            volume.schemas.push(Look::SCHEMA);
            look.bind(&mut volume);
        }
        for Field { name, grid, holds } in self.fields {
            if let Holds::Density(scale) = holds {
                let scale =
                    Attribute::new("float", format!("frazil:{name}_scale")).with(Value::Float(*scale));
                volume.add(Attribute { is_custom: true, ..scale });
            }
            volume.relate(&format!("field:{name}"), format!("/shot/{}/{grid}", self.name));
        }
        volume.children = self.fields.iter().map(|field| self.asset(field)).collect();
        volume
    }

    /// The prim of a field.
    fn asset(&self, Field { grid, holds, .. }: &Field) -> Prim {
        let (class, numbers) = match holds {
            Holds::Distance => (Some("levelSet"), "float"),
            Holds::Density(_) => (Some("fogVolume"), "float"),
            Holds::Number => (None, "float"),
            Holds::Vector => (None, "float3"),
        };
        let token = |name: &str, value: &str| Attribute::new("token", name).with(Value::Token(value.into()));
        let mut asset = Prim::def("OpenVDBAsset", *grid);
        asset.add(token("fieldName", grid));
        asset.add(token("fieldDataType", numbers));
        class.into_iter().for_each(|class| asset.add(token("fieldClass", class)));
        asset.add(Attribute::new("asset", "filePath"));
        asset
    }

    /// The values that vary with time, for a layer below the shot's: programs want many samples in a binary file.
    pub(in crate::io) fn samples(&self) -> Prim {
        let sampled = |class: &str, name: &str, value: &dyn Fn(&VolumeFile) -> Value| {
            let samples = self.files.iter().map(|file| (file.frame, value(file))).collect();
            Attribute { samples, ..Attribute::new(class, name) }
        };
        let mut volume = Prim::over(self.name);
        volume.add(sampled("token", "visibility", &|file| {
            Value::Token(if file.is_empty { "invisible" } else { "inherited" }.into())
        }));
        let extents = self.files.iter().filter(|file| file.is_empty || file.extent.is_some());
        let samples = extents.map(|file| (file.frame, extent_value(file.extent))).collect();
        volume.add(Attribute { samples, ..Attribute::new("float3[]", "extent") });
        let asset = |field: &Field| {
            let mut asset = Prim::over(field.grid);
            asset.add(sampled("asset", "filePath", &|file| Value::Asset(file.path.clone())));
            asset
        };
        volume.children = self.fields.iter().map(asset).collect();
        volume
    }
}
