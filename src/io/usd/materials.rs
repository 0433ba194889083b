//! Materials of a USD stage: what renderers show of a shot before it has been shaded.

use std::borrow::Cow;

use super::layer::{Attribute, Prim, Value};

/// Material of a prim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// Snow with a surface: meshes, level sets, grains. A `UsdPreviewSurface`.
    Snow,
    /// Snow as a density. USD has no volume shader that all renderers support: the material holds the parameters that the renderers' own
    /// shaders need.
    Fog,
    /// Objects that move. A `UsdPreviewSurface`.
    Object,
    /// Objects of another colour: the diffuse reflection, linear, in 65535ths. A `UsdPreviewSurface`.
    Coloured([u16; 3]),
    /// The terrain under a liquid. A `UsdPreviewSurface`.
    Terrain,
    /// The same with stains, in the colours of `displayColor`: Blender draws a mesh without that primvar black.
    StainedTerrain,
    /// Liquids with a surface, with the opacity of `displayOpacity`. Each is a `UsdPreviewSurface`.
    Water,
    /// See [`Look::Water`].
    Blood,
    /// See [`Look::Water`].
    Paint,
    /// See [`Look::Water`].
    Honey,
}

/// Scope that holds the materials.
const SCOPE: &str = "materials";
/// The number of parts of 1 in [`Look::Coloured`].
const PARTS: f32 = 65535.0;
/// Roughness of a wet surface.
const WET: f32 = 0.05;

impl Look {
    /// Name of its material.
    fn name(self) -> Cow<'static, str> {
        let name = match self {
            Self::Coloured([r, g, b]) => return format!("object_{r:04x}_{g:04x}_{b:04x}").into(),
            Self::Snow => "snow",
            Self::Fog => "fog",
            Self::Object => "object",
            Self::Terrain => "terrain",
            Self::StainedTerrain => "stained_terrain",
            Self::Water => "water",
            Self::Blood => "blood",
            Self::Paint => "paint",
            Self::Honey => "honey",
        };
        name.into()
    }

    /// Objects of a colour (linear, 0 to 1), or of that of objects.
    pub fn of_object(colour: Option<[f32; 3]>) -> Self {
        colour.map_or(Self::Object, |colour| Self::Coloured(colour.map(|part| (part * PARTS).round() as u16)))
    }

    /// The API schema that a prim with a material needs.
    pub(in crate::io) const SCHEMA: &'static str = "MaterialBindingAPI";

    /// Binds a material to a prim.
    pub(in crate::io) fn bind(self, prim: &mut Prim) {
        prim.relate("material:binding", format!("/shot/{SCOPE}/{}", self.name()));
    }

    /// Whether its opacity is that of the mesh.
    fn is_liquid(self) -> bool {
        matches!(self, Self::Water | Self::Blood | Self::Paint | Self::Honey)
    }

    fn define(self) -> Prim {
        let name = self.name();
        let path = format!("/shot/{SCOPE}/{name}");
        let mut material = Prim::def("Material", &*name);
        let roughness = match self {
            Self::Snow => 0.75,
            Self::Object | Self::Coloured(_) => 0.5,
            Self::Terrain | Self::StainedTerrain => 0.8,
            Self::Paint => 0.3,
            Self::Water | Self::Blood | Self::Honey => WET,
            Self::Fog => {
                material.add(Attribute::new("color3f", "inputs:albedo").with(Value::Vector(self.colour())));
                material.add(Attribute::new("float", "inputs:anisotropy").with(Value::Float(0.3)));
                return material;
            }
        };
        material.add(
            Attribute::new("token", "outputs:surface").connected(format!("{path}/surface.outputs:surface")),
        );
        let mut surface = shader("surface", "UsdPreviewSurface");
        let colour = Attribute::new("color3f", "inputs:diffuseColor").with(Value::Vector(self.colour()));
        surface.add(if self == Self::StainedTerrain {
            Attribute { value: None, ..colour.connected(format!("{path}/colour.outputs:result")) }
        } else {
            colour
        });
        surface.add(Attribute::new("float", "inputs:roughness").with(Value::Float(roughness)));
        if self.is_liquid() {
            let opacity = format!("{path}/opacity.outputs:result");
            surface.add(Attribute::new("float", "inputs:opacity").connected(opacity));
        }
        surface.add(Attribute::new("token", "outputs:surface"));
        material.children.push(surface);
        if self.is_liquid() {
            material.children.push(reader("opacity", "float", Value::Float(1.0), "displayOpacity"));
        }
        if self == Self::StainedTerrain {
            material.children.push(reader("colour", "float3", Value::Vector(self.colour()), "displayColor"));
        }
        material
    }

    /// Its colour: the diffuse reflection, linear, or the albedo of a fog.
    pub fn colour(self) -> [f32; 3] {
        // Fresh snow reflects nine tenths of the light, blue a little more than red; its grains scatter forward.
        match self {
            Self::Snow => [0.9, 0.92, 0.95],
            Self::Object => [0.32, 0.33, 0.36],
            Self::Coloured(parts) => parts.map(|part| f32::from(part) / PARTS),
            Self::Terrain | Self::StainedTerrain => [0.5, 0.47, 0.43],
            Self::Water => [0.05, 0.25, 0.3],
            Self::Blood => [0.3, 0.008, 0.006],
            Self::Paint => [0.05, 0.2, 0.6],
            Self::Honey => [0.75, 0.36, 0.03],
            Self::Fog => [0.98, 0.985, 0.99],
        }
    }
}

/// A shader of a type that USD defines.
fn shader(name: &str, id: &str) -> Prim {
    let mut prim = Prim::def("Shader", name);
    prim.add(Attribute::token("info:id", id));
    prim
}

/// A shader that passes on the values of a primvar, or a number where a mesh lacks it.
fn reader(name: &str, class: &'static str, fallback: Value, primvar: &str) -> Prim {
    let mut prim = shader(name, &format!("UsdPrimvarReader_{class}"));
    prim.add(Attribute::new(class, "inputs:fallback").with(fallback));
    prim.add(Attribute::new("string", "inputs:varname").with(Value::Text(primvar.into())));
    prim.add(Attribute::new(class, "outputs:result"));
    prim
}

/// The materials of some prims, each once; none without any.
pub(in crate::io) fn scope(mut looks: Vec<Look>) -> Option<Prim> {
    looks.sort_unstable();
    looks.dedup();
    let mut scope = Prim::def("Scope", SCOPE);
    scope.children = looks.into_iter().map(Look::define).collect();
    (!scope.children.is_empty()).then_some(scope)
}
