//! Materials of a USD stage: what renderers show of a shot before it has been shaded.

use std::fmt::Write;

/// Material of a prim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// Snow with a surface: meshes, level sets, grains. A `UsdPreviewSurface`.
    Snow,
    /// Snow as a density. USD has no volume shader that all renderers support: the material holds the parameters that the renderers' own
    /// shaders need.
    Fog,
    /// Objects that move through the snow. A `UsdPreviewSurface`.
    Object,
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
/// Roughness of a wet surface.
const WET: f64 = 0.05;

impl Look {
    /// Name of its material.
    fn name(self) -> &'static str {
        match self {
            Self::Snow => "snow",
            Self::Fog => "fog",
            Self::Object => "object",
            Self::Water => "water",
            Self::Blood => "blood",
            Self::Paint => "paint",
            Self::Honey => "honey",
        }
    }

    /// The API schema that a prim with a material needs, as an entry of its metadata (in parentheses after its name).
    pub(in crate::io) const SCHEMA: &'static str = "prepend apiSchemas = [\"MaterialBindingAPI\"]";

    /// Binds a material to a prim.
    pub(in crate::io) fn bind(self, out: &mut String, indent: &str) {
        let _ = writeln!(out, "{indent}rel material:binding = </shot/{SCOPE}/{}>", self.name());
    }

    /// Whether its opacity is that of the mesh.
    fn is_liquid(self) -> bool {
        matches!(self, Self::Water | Self::Blood | Self::Paint | Self::Honey)
    }

    /// The source of the shader's opacity, and the shader that reads it.
    fn opacity(self) -> (String, String) {
        let name = self.name();
        let input = format!(
            "float inputs:opacity.connect = </shot/{SCOPE}/{name}/opacity.outputs:result>\n                "
        );
        let reader = "\n            def Shader \"opacity\"\n            {\n                \
                      uniform token info:id = \"UsdPrimvarReader_float\"\n                \
                      float inputs:fallback = 1\n                string inputs:varname = \"displayOpacity\"\n                \
                      float outputs:result\n            }\n";
        (input, reader.into())
    }

    fn define(self, out: &mut String) {
        let name = self.name();
        // Fresh snow reflects nine tenths of the light, blue a little more than red; its grains scatter forward.
        let (colour, roughness) = match self {
            Self::Snow => ("(0.9, 0.92, 0.95)", 0.75),
            Self::Object => ("(0.32, 0.33, 0.36)", 0.5),
            Self::Water => ("(0.05, 0.25, 0.3)", WET),
            Self::Blood => ("(0.3, 0.008, 0.006)", WET),
            Self::Paint => ("(0.05, 0.2, 0.6)", 0.3),
            Self::Honey => ("(0.75, 0.36, 0.03)", WET),
            Self::Fog => {
                let _ = write!(
                    out,
                    "        def Material \"{name}\"\n        {{\n            color3f inputs:albedo = (0.98, 0.985, 0.99)\n            \
                     float inputs:anisotropy = 0.3\n        }}\n"
                );
                return;
            }
        };
        let (opacity, reader) = if self.is_liquid() { self.opacity() } else { Default::default() };
        let _ = write!(
            out,
            "        def Material \"{name}\"\n        {{\n            \
             token outputs:surface.connect = </shot/{SCOPE}/{name}/surface.outputs:surface>\n\n            \
             def Shader \"surface\"\n            {{\n                uniform token info:id = \"UsdPreviewSurface\"\n                \
             color3f inputs:diffuseColor = {colour}\n                float inputs:roughness = {roughness}\n                \
             {opacity}token outputs:surface\n            }}\n{reader}        }}\n"
        );
    }
}

/// Defines the materials of some prims, each once.
pub(in crate::io) fn define(out: &mut String, mut looks: Vec<Look>) {
    looks.sort_unstable();
    looks.dedup();
    if looks.is_empty() {
        return;
    }
    let _ = write!(out, "    def Scope \"{SCOPE}\"\n    {{\n");
    looks.into_iter().for_each(|look| look.define(out));
    out.push_str("    }\n");
}
