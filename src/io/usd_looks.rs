//! Materials of a USD stage: what renderers show of a shot before anybody has shaded it.

use std::fmt::Write;

/// What a prim is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// Snow with a surface: meshes, level sets, grains. A `UsdPreviewSurface`.
    Snow,
    /// Snow as a density. USD has no shader of volumes that all renderers know: the material holds the numbers that theirs take.
    Fog,
    /// What moves through the snow. A `UsdPreviewSurface`.
    Object,
}

/// Where materials are.
const SCOPE: &str = "materials";

impl Look {
    /// Name of its material.
    fn name(self) -> &'static str {
        match self {
            Self::Snow => "snow",
            Self::Fog => "fog",
            Self::Object => "object",
        }
    }

    /// The schema of a prim that has a material, for what stands in brackets behind the prim's name.
    pub(super) const SCHEMA: &'static str = "prepend apiSchemas = [\"MaterialBindingAPI\"]";

    /// Gives a prim its material.
    pub(super) fn bind(self, out: &mut String, indent: &str) {
        let _ = writeln!(out, "{indent}rel material:binding = </shot/{SCOPE}/{}>", self.name());
    }

    fn define(self, out: &mut String) {
        let name = self.name();
        // Fresh snow reflects nine tenths of the light, blue a little more than red; its grains scatter forward.
        let (colour, roughness) = match self {
            Self::Snow => ("(0.9, 0.92, 0.95)", 0.75),
            Self::Object => ("(0.32, 0.33, 0.36)", 0.5),
            Self::Fog => {
                let _ = write!(
                    out,
                    "        def Material \"{name}\"\n        {{\n            color3f inputs:albedo = (0.98, 0.985, 0.99)\n            \
                     float inputs:anisotropy = 0.3\n        }}\n"
                );
                return;
            }
        };
        let _ = write!(
            out,
            "        def Material \"{name}\"\n        {{\n            \
             token outputs:surface.connect = </shot/{SCOPE}/{name}/surface.outputs:surface>\n\n            \
             def Shader \"surface\"\n            {{\n                uniform token info:id = \"UsdPreviewSurface\"\n                \
             color3f inputs:diffuseColor = {colour}\n                float inputs:roughness = {roughness}\n                \
             token outputs:surface\n            }}\n        }}\n"
        );
    }
}

/// Defines the materials of some prims, each once.
pub(super) fn define(out: &mut String, mut looks: Vec<Look>) {
    looks.sort_unstable();
    looks.dedup();
    if looks.is_empty() {
        return;
    }
    let _ = write!(out, "    def Scope \"{SCOPE}\"\n    {{\n");
    looks.into_iter().for_each(|look| look.define(out));
    out.push_str("    }\n");
}
