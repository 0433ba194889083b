//! USD as text (.usda): the output of a shot for any program that reads USD, written without a library.

pub mod materials;
pub mod points;
pub mod primvars;
mod text;

use std::fmt::Write;
pub(super) use text::list;
pub use text::prim_name;

use materials::Look;

use crate::geometry::mesh::attributes::Number;
use crate::geometry::{DVec3, MeshArray, Points, TriMesh, Uvs, Vec3};
use crate::io::mesh::Carried;
use primvars::Primvar;

/// A moving mesh at one frame.
pub struct MeshFrame<'a> {
    /// Name of its prim: see [`prim_name`].
    pub name: &'a str,
    /// Positions (m).
    pub points: &'a [Vec3],
    /// Velocities (m/s) over the coming frame (those of liquid on a terrain: at this frame), one per point; empty if the mesh has none,
    /// like that of the base layer.
    pub velocities: &'a [Vec3],
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
    /// Their texture coordinates.
    pub uvs: Option<&'a Uvs>,
    /// Other arrays (those of corners have three values for each triangle), written as primvars: see [`primvars`].
    pub arrays: &'a [&'a MeshArray],
}

impl<'a> MeshFrame<'a> {
    /// A mesh with what it carries.
    pub fn of(name: &'a str, mesh: &'a TriMesh, carried: &Carried<'a>) -> Self {
        let Carried { velocities, uvs, arrays } = *carried;
        Self { name, points: &mesh.positions, velocities, triangles: &mesh.triangles, uvs, arrays }
    }
}

/// The part of a moving mesh that does not change from frame to frame.
pub struct MeshPrim<'a> {
    /// Name of its prim: see [`prim_name`].
    pub name: String,
    /// Its material.
    pub look: Look,
    /// Whether its frames may have velocities.
    pub moves: bool,
    /// The texture coordinates of its frames, if any.
    pub uvs: Option<&'a Uvs>,
    /// The primvars of its frames.
    pub primvars: Vec<Primvar>,
}

/// A volume with its .vdb files.
pub struct VolumeFiles {
    /// Name of its prim.
    pub name: &'static str,
    /// Its fields, each a grid of the files.
    pub fields: &'static [Field],
    /// Whether it is for viewing only and not to be rendered.
    pub is_guide: bool,
    /// Frames with their files, relative to the .usda file.
    pub files: Vec<(i32, String)>,
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

/// Frames of a stage, and their rate.
#[derive(Debug, Clone, Copy)]
pub struct StageTime {
    /// First frame.
    pub first: i32,
    /// Last frame.
    pub last: i32,
    /// Frames per second.
    pub fps: f64,
}

/// A quoted and escaped string.
pub(super) fn quoted(text: &str) -> String {
    let escaped: String = text
        .chars()
        .flat_map(|letter| match letter {
            '"' | '\\' => vec!['\\', letter],
            '\n' => vec!['\\', 'n'],
            _ => vec![letter],
        })
        .collect();
    format!("\"{escaped}\"")
}

/// An asset path between `@` delimiters.
fn asset(path: &str) -> String {
    // Triple @ delimiters allow an @ inside.
    if path.contains('@') { format!("@@@{path}@@@") } else { format!("@{path}@") }
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

    pub(super) fn head(self) -> String {
        let axis = if self.z_up { "Z" } else { "Y" };
        format!("    metersPerUnit = {}\n    upAxis = \"{axis}\"\n", self.metres)
    }
}

/// A stage with the shot's volumes, and with value clips for the parts that have one .usda file per frame.
pub fn stage(comment: &str, time: StageTime, volumes: &[VolumeFiles], clips: &[Clips]) -> String {
    let mut out = String::new();
    let StageTime { first, last, fps } = time;
    let _ = write!(
        out,
        "#usda 1.0\n(\n    {}\n    defaultPrim = \"shot\"\n    startTimeCode = {first}\n    endTimeCode = {last}\n    \
         timeCodesPerSecond = {fps}\n    framesPerSecond = {fps}\n{})\n\ndef Xform \"shot\"\n{{\n",
        quoted(comment),
        Units::OWN.head()
    );
    let volumes: Vec<&VolumeFiles> = volumes.iter().filter(|volume| !volume.files.is_empty()).collect();
    let of_volumes = volumes.iter().filter_map(|volume| volume.look());
    materials::define(&mut out, of_volumes.chain(clips.iter().flat_map(Clips::looks)).collect());
    volumes.iter().for_each(|volume| write_volume(&mut out, volume));
    clips.iter().for_each(|clips| write_clips(&mut out, clips));
    out.push_str("}\n");
    out
}

impl VolumeFiles {
    /// Its material; none if none of its fields is a distance or a density, because there is nothing to see.
    fn look(&self) -> Option<Look> {
        self.fields.iter().find_map(|field| match field.holds {
            Holds::Distance => Some(Look::Snow),
            Holds::Density(_) => Some(Look::Fog),
            Holds::Number | Holds::Vector => None,
        })
    }
}

fn write_volume(out: &mut String, volume: &VolumeFiles) {
    let look = volume.look();
    let schema = look.map_or(String::new(), |_| format!(" (\n        {}\n    )", Look::SCHEMA));
    let _ = writeln!(out, "    def Volume \"{}\"{schema}\n    {{", volume.name);
    if volume.is_guide {
        out.push_str("        uniform token purpose = \"guide\"\n");
    }
    if let Some(look) = look {
        look.bind(out, "        ");
    }
    for Field { name, grid, holds } in volume.fields {
        if let Holds::Density(scale) = holds {
            let _ = writeln!(out, "        custom float frazil:{name}_scale = {scale}");
        }
        let _ = writeln!(out, "        rel field:{name} = </shot/{}/{grid}>", volume.name);
    }
    for Field { grid, holds, .. } in volume.fields {
        let (class, numbers) = match holds {
            Holds::Distance => ("\n            token fieldClass = \"levelSet\"", "float"),
            Holds::Density(_) => ("\n            token fieldClass = \"fogVolume\"", "float"),
            Holds::Number => ("", "float"),
            Holds::Vector => ("", "float3"),
        };
        let _ = write!(
            out,
            "\n        def OpenVDBAsset \"{grid}\"\n        {{\n            token fieldName = \"{grid}\"\n            \
             token fieldDataType = \"{numbers}\"{class}\n            asset filePath.timeSamples = {{\n"
        );
        for (frame, file) in &volume.files {
            let _ = writeln!(out, "                {frame}: {},", asset(file));
        }
        out.push_str("            }\n        }\n");
    }
    out.push_str("    }\n");
}

/// A set of files, one per frame.
pub struct Clips<'a> {
    /// Folder and kind: `./objects/objects.0001.usda` for `objects`.
    pub kind: &'static str,
    /// The existing frames, ascending.
    pub frames: Vec<i32>,
    /// Their contents.
    pub prims: ClipPrims<'a>,
}

/// The contents of a clip's files that all frames have in common.
pub enum ClipPrims<'a> {
    /// Moving meshes, under a prim of the kind's name.
    Meshes(Vec<MeshPrim<'a>>),
    /// A `Points` prim with the kind's name, as [`points::frame`] writes it; the points here only tell which attributes it declares.
    Points(Points),
}

impl<'a> Clips<'a> {
    /// No frames yet.
    pub fn new(kind: &'static str, prims: ClipPrims<'a>) -> Self {
        Self { kind, frames: Vec::new(), prims }
    }

    /// The materials of its prims.
    fn looks(&self) -> Vec<Look> {
        match &self.prims {
            ClipPrims::Meshes(meshes) => meshes.iter().map(|mesh| mesh.look).collect(),
            ClipPrims::Points(_) => vec![Look::Snow],
        }
    }
}

fn write_clips(out: &mut String, clips: &Clips) {
    let kind = clips.kind;
    let (class, schema) = match &clips.prims {
        ClipPrims::Points(_) => ("Points", format!("        {}\n", Look::SCHEMA)),
        ClipPrims::Meshes(_) => ("Xform", String::new()),
    };
    let file = |frame: &i32| asset(&format!("./{kind}/{kind}.{frame:04}.usda"));
    let files: Vec<String> = clips.frames.iter().map(file).collect();
    let pairs = |pair: &dyn Fn(usize, i32) -> String| {
        let pairs: Vec<String> =
            clips.frames.iter().enumerate().map(|(clip, frame)| pair(clip, *frame)).collect();
        pairs.join(", ")
    };
    let _ = write!(
        out,
        "    def {class} \"{kind}\" (\n{schema}        clips = {{\n            dictionary default = {{\n                \
         asset[] assetPaths = [{}]\n                asset manifestAssetPath = @./{kind}/{kind}.manifest.usda@\n                \
         string primPath = \"/{kind}\"\n                double2[] active = [{}]\n                double2[] times = [{}]\n            \
         }}\n        }}\n    )\n    {{\n",
        files.join(", "),
        pairs(&|clip, frame| format!("({frame}, {clip})")),
        pairs(&|_, frame| format!("({frame}, {frame})")),
    );
    match &clips.prims {
        ClipPrims::Meshes(meshes) => define_meshes(out, meshes),
        ClipPrims::Points(points) => {
            // Viewports show grains only when asked for the render purpose.
            out.push_str("        uniform token purpose = \"render\"\n");
            Look::Snow.bind(out, "        ");
            out.push_str(&points::declared(points, "        "));
        }
    }
    out.push_str("    }\n");
}

fn define_meshes(out: &mut String, meshes: &[MeshPrim]) {
    for MeshPrim { name, look, uvs, primvars, .. } in meshes {
        let _ = writeln!(
            out,
            "        def Mesh \"{name}\" (\n            {}\n        )\n        {{\n            \
             uniform token subdivisionScheme = \"none\"",
            Look::SCHEMA
        );
        look.bind(out, "            ");
        declare_uvs(out, "            ", *uvs);
        primvars::declare(out, "            ", primvars);
        out.push_str("        }\n");
    }
}

/// Attributes of a mesh that change from frame to frame.
const ATTRIBUTES: [(&str, &str); 5] = [
    ("float3[]", "extent"),
    ("int[]", "faceVertexCounts"),
    ("int[]", "faceVertexIndices"),
    ("point3f[]", "points"),
    ("vector3f[]", VELOCITIES),
];

const VELOCITIES: &str = "velocities";

/// Texture coordinates: the values and, if there are seams, an index for each corner.
const TEXCOORDS: &str = "texCoord2f[] primvars:st";
const TEXCOORD_INDICES: &str = "int[] primvars:st:indices";

/// Declares the interpolation of texture coordinates whose values are elsewhere: per vertex, or per corner of faces.
fn declare_uvs(out: &mut String, indent: &str, uvs: Option<&Uvs>) {
    let Some(uvs) = uvs else { return };
    let interpolation = if uvs.corners.is_some() { "faceVarying" } else { "vertex" };
    let _ =
        write!(out, "{indent}{TEXCOORDS} (\n{indent}    interpolation = \"{interpolation}\"\n{indent})\n");
    if uvs.corners.is_some() {
        let _ = writeln!(out, "{indent}{TEXCOORD_INDICES}");
    }
}

/// The clip manifest, which USD requires.
pub fn clip_manifest(kind: &str, prims: &ClipPrims) -> String {
    let mut out = format!("#usda 1.0\n(\n    defaultPrim = \"{kind}\"\n)\n\nover \"{kind}\"\n{{\n");
    let meshes = match prims {
        ClipPrims::Meshes(meshes) => &meshes[..],
        ClipPrims::Points(points) => {
            out.push_str(&points::declared(points, "    "));
            &[]
        }
    };
    for MeshPrim { name, uvs, primvars, moves, .. } in meshes {
        let _ = writeln!(out, "    over \"{name}\"\n    {{");
        for (class, attribute) in
            ATTRIBUTES.iter().filter(|(_, attribute)| *moves || *attribute != VELOCITIES)
        {
            let _ = writeln!(out, "        {class} {attribute}");
        }
        declare_uvs(&mut out, "        ", *uvs);
        primvars::declare(&mut out, "        ", primvars);
        out.push_str("    }\n");
    }
    out.push_str("}\n");
    out
}

/// The meshes of one frame; opened on its own, the file shows these meshes.
pub fn clip(kind: &str, frame: i32, fps: f64, units: Units, meshes: &[MeshFrame]) -> String {
    let mut out = format!(
        "#usda 1.0\n(\n    defaultPrim = \"{kind}\"\n    startTimeCode = {frame}\n    endTimeCode = {frame}\n    \
         timeCodesPerSecond = {fps}\n{})\n\ndef Xform \"{kind}\"\n{{\n",
        units.head()
    );
    for mesh in meshes {
        let _ = writeln!(
            out,
            "    def Mesh \"{}\"\n    {{\n        uniform token subdivisionScheme = \"none\"",
            mesh.name
        );
        let zero = (Vec3::zeros(), Vec3::zeros());
        // Points that belong to no face are not visible.
        let corners = mesh.triangles.as_flattened().iter().map(|&vertex| mesh.points[vertex as usize]);
        let bounds = corners.map(|p| (p, p)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let (low, high) = bounds.unwrap_or(zero);
        let values = [
            list([low, high].iter(), row),
            list(mesh.triangles.iter(), |out, _| out.push('3')),
            list(mesh.triangles.iter(), |out, [a, b, c]| {
                let _ = write!(out, "{a}, {b}, {c}");
            }),
            list(mesh.points.iter(), row),
            list(mesh.velocities.iter(), row),
        ];
        let moves = mesh.velocities.len() == mesh.points.len();
        let written = ATTRIBUTES.iter().zip(values);
        for ((class, attribute), value) in written.filter(|((_, name), _)| moves || *name != VELOCITIES) {
            let _ = writeln!(out, "        {class} {attribute}.timeSamples = {{ {frame}: {value} }}");
        }
        declare_uvs(&mut out, "        ", mesh.uvs);
        if let Some(uvs) = mesh.uvs {
            let coordinates = list(uvs.coordinates.iter(), |out, [u, v]| {
                let _ = write!(out, "({u}, {v})");
            });
            let _ = writeln!(out, "        {TEXCOORDS}.timeSamples = {{ {frame}: {coordinates} }}");
            if let Some(corners) = &uvs.corners {
                let indices = list(corners.iter(), |out, index| {
                    let _ = write!(out, "{index}");
                });
                let _ = writeln!(out, "        {TEXCOORD_INDICES}.timeSamples = {{ {frame}: {indices} }}");
            }
        }
        primvars::write(&mut out, "        ", frame, mesh.arrays);
        out.push_str("    }\n");
    }
    out.push_str("}\n");
    out
}

fn row(out: &mut String, p: &Vec3) {
    vector(out, (*p).into());
}

/// Three numbers in USD's syntax.
pub(super) fn vector(out: &mut String, parts: [f32; 3]) {
    for (part, before) in parts.into_iter().zip(["(", ", ", ", "]) {
        out.push_str(before);
        primvars::number(out, Number::F32, part.into());
    }
    out.push(')');
}

/// Positions as 32-bit floats.
pub fn to_floats(positions: &[DVec3]) -> Vec<Vec3> {
    positions.iter().map(|position| position.cast()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_what_usd_allows() {
        assert_eq!(prim_name("hero.v02"), "hero_v02");
        assert_eq!(prim_name("2nd man"), "_2nd_man");
        assert_eq!(prim_name(""), "_");
        assert_eq!(quoted("a\"b\\"), "\"a\\\"b\\\\\"");
        assert_eq!(asset("a@b.vdb"), "@@@a@b.vdb@@@");
    }
}
