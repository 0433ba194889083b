//! Meshes in USD: a layer of one frame, and what its prims have in common from frame to frame.

use std::borrow::Cow;

use super::file::{Contents, File, Units, bounds, extent_value};
use super::layer::{Attribute, Layer, Prim, Value};
use super::materials::Look;
use super::primvars::{self, Faces, Primvar};
use crate::geometry::mesh::normals;
use crate::geometry::{MeshArray, TriMesh, Uvs, Vec3};
use crate::io::mesh::ply_write::Carried;

/// A moving mesh at one frame.
pub struct MeshFrame<'a> {
    /// Name of its prim: see [`super::prim_name`].
    pub name: &'a str,
    /// Positions (m).
    pub points: &'a [Vec3],
    /// Velocities (m/s) over the coming frame (those of liquid on a terrain: at this frame), one per point; empty if the mesh has none,
    /// like that of the base layer.
    pub velocities: &'a [Vec3],
    /// Triangles. Those without an area are not written.
    pub triangles: &'a [[u32; 3]],
    /// Their texture coordinates.
    pub uvs: Option<&'a Uvs>,
    /// Other arrays (those of corners have three values for each triangle), written as primvars: see [`primvars`].
    pub arrays: &'a [&'a MeshArray],
    /// How its surface is shaded.
    pub shading: Shading,
}

/// The points of a mesh. Those of no face are at a point of a face: they are not visible, and in USD all points are within the extent, so
/// that a stray one would make it useless.
fn points_of_faces<'a>(points: &'a [Vec3], triangles: &[[u32; 3]]) -> Cow<'a, [Vec3]> {
    let mut is_used = vec![false; points.len()];
    triangles.as_flattened().iter().for_each(|vertex| is_used[*vertex as usize] = true);
    match is_used.iter().position(|is_used| *is_used) {
        Some(first) if is_used.contains(&false) => {
            let moved =
                points.iter().zip(is_used).map(|(p, is_used)| if is_used { *p } else { points[first] });
            Cow::Owned(moved.collect())
        }
        _ => Cow::Borrowed(points),
    }
}

/// How a surface is shaded, by the normals that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// Smooth everywhere: liquid, snow. A normal for each vertex.
    Smooth,
    /// Smooth but for edges where faces meet at more than 40 degrees, as objects are. A normal for each corner.
    Creased,
}

/// Edges between triangles whose normals differ by more are sharp (degrees).
const CREASE: f64 = 40.0;

impl<'a> MeshFrame<'a> {
    /// A mesh with the data that it carries.
    pub fn of(name: &'a str, mesh: &'a TriMesh, carried: &Carried<'a>, shading: Shading) -> Self {
        let Carried { velocities, uvs, arrays } = *carried;
        let (points, triangles) = (&mesh.positions[..], &mesh.triangles[..]);
        Self { name, points, velocities, triangles, uvs, arrays, shading }
    }

    /// Its attributes at a frame, and their contents.
    fn attributes(&self, frame: i32) -> (Vec<Attribute>, Contents) {
        let kept = self.faces_with_area();
        let faces = kept.as_deref().map_or(Faces::All, Faces::Only);
        let triangles = faces.of_faces(self.triangles);
        let (points, triangle_count) = (points_of_faces(self.points, &triangles), triangles.len());
        let extent = bounds(points.iter().map(|point| (*point, *point)));
        let shown = if triangles.is_empty() { "invisible" } else { "inherited" };
        let corners = triangles.as_flattened().iter().map(|vertex| *vertex as i32);
        let values = [
            Value::Token(shown.into()),
            extent_value(extent),
            Value::Ints(vec![3; triangle_count]),
            Value::Ints(corners.collect()),
            rows(&points),
            rows(self.velocities),
        ];
        let moves = self.velocities.len() == self.points.len();
        let own = DECLARED.into_iter().zip(values).filter(|((_, name), _)| moves || *name != VELOCITIES);
        let own = own.map(|(declared, value)| Attribute::declared(declared).at(frame, value));
        let uvs = self.uvs.into_iter().flat_map(|uvs| uv_attributes(uvs, faces, frame));
        let normals = self.normals(&triangles, frame);
        let primvars = primvars::attributes(self.arrays, faces, frame);
        let out = own.chain(uvs).chain(normals).chain(primvars).collect();
        (out, Contents { points: Some(self.points.len()), faces: Some(triangle_count), extent })
    }

    /// The normals of some of its triangles at a frame.
    fn normals(&self, triangles: &[[u32; 3]], frame: i32) -> impl Iterator<Item = Attribute> {
        let (units, indices) = match self.shading {
            Shading::Smooth => (normals::smooth(self.points, triangles), Vec::new()),
            Shading::Creased => normals::creased(self.points, triangles, libm::cos(CREASE.to_radians())),
        };
        // A point of no face has none, and USD wants a direction.
        let unit = |normal: Vec3| if normal == Vec3::zeros() { Vec3::y() } else { normal };
        let units: Vec<Vec3> = units.into_iter().map(unit).collect();
        let indices = Value::Ints(indices.into_iter().map(|index| index as i32).collect());
        let attributes = self.shading.attributes().into_iter().flatten();
        attributes.zip([rows(&units), indices]).map(move |(attribute, value)| attribute.at(frame, value))
    }

    /// The faces that have an area; none if all have.
    fn faces_with_area(&self) -> Option<Vec<usize>> {
        let has_area = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|vertex| self.points[vertex as usize].cast::<f64>());
            (b - a).cross(&(c - a)).norm_squared() > 0.0
        };
        let all = self.triangles.iter().all(|triangle| has_area(*triangle));
        let kept = || (0..self.triangles.len()).filter(|face| has_area(self.triangles[*face])).collect();
        (!all).then(kept)
    }
}

impl Shading {
    /// The normals and, for each corner, the index of its own.
    fn attributes(self) -> [Option<Attribute>; 2] {
        let normals =
            |name, interpolation| Some(Attribute::new("normal3f[]", name).interpolated(interpolation));
        match self {
            Self::Smooth => [normals("normals", "vertex"), None],
            Self::Creased => {
                // Only primvars may have indices.
                let indices = Attribute::new("int[]", "primvars:normals:indices");
                [normals("primvars:normals", "faceVarying"), Some(indices)]
            }
        }
    }
}

/// The part of a moving mesh that does not change from frame to frame.
pub struct MeshPrim<'a> {
    /// Name of its prim: see [`super::prim_name`].
    pub name: String,
    /// Its material.
    pub look: Look,
    /// Whether its frames may have velocities.
    pub moves: bool,
    /// The texture coordinates of its frames, if any.
    pub uvs: Option<&'a Uvs>,
    /// The primvars of its frames.
    pub primvars: Vec<Primvar>,
    /// How its frames are shaded.
    pub shading: Shading,
}

impl MeshPrim<'_> {
    /// Its prim in the shot, whose values are in the clips.
    pub(in crate::io) fn defined(&self) -> Prim {
        let mut prim = Prim::def("Mesh", &*self.name);
        prim.schemas.push(Look::SCHEMA);
        prim.add(Attribute::token("subdivisionScheme", "none"));
        self.look.bind(&mut prim);
        self.interpolated().for_each(|attribute| prim.add(attribute));
        prim
    }

    /// The attributes that vary from frame to frame, for the manifest of the clips.
    pub(in crate::io) fn varying(&self) -> Prim {
        let mut prim = Prim::over(&*self.name);
        let declared = DECLARED.into_iter().filter(|(_, name)| self.moves || *name != VELOCITIES);
        declared
            .map(Attribute::declared)
            .chain(self.interpolated())
            .for_each(|attribute| prim.add(attribute));
        prim
    }

    /// The attributes that have an interpolation.
    fn interpolated(&self) -> impl Iterator<Item = Attribute> {
        let st = self.uvs.into_iter().flat_map(texture_coordinates).flatten();
        let normals = self.shading.attributes().into_iter().flatten();
        st.chain(normals).chain(self.primvars.iter().map(Primvar::attribute))
    }
}

/// Attributes of a mesh that change from frame to frame. A mesh without faces is invisible.
const DECLARED: [(&str, &str); 6] = [
    ("token", "visibility"),
    ("float3[]", "extent"),
    ("int[]", "faceVertexCounts"),
    ("int[]", "faceVertexIndices"),
    ("point3f[]", "points"),
    ("vector3f[]", VELOCITIES),
];

const VELOCITIES: &str = "velocities";

fn rows(vectors: &[Vec3]) -> Value {
    Value::Vectors(vectors.iter().map(|vector| (*vector).into()).collect())
}

/// Texture coordinates at a frame.
fn uv_attributes(uvs: &Uvs, faces: Faces<'_>, frame: i32) -> impl Iterator<Item = Attribute> {
    let indices = uvs.corners.as_deref().map_or(Vec::new(), |corners| faces.of_corners(corners));
    let indices = Value::Ints(indices.into_iter().map(|index| index as i32).collect());
    let values = [Value::Pairs(uvs.coordinates.clone()), indices];
    let attributes = texture_coordinates(uvs).into_iter().flatten();
    attributes.zip(values).map(move |(attribute, value)| attribute.at(frame, value))
}

/// Texture coordinates: the values, per vertex or per corner of faces, and, if there are seams, an index for each corner.
fn texture_coordinates(uvs: &Uvs) -> [Option<Attribute>; 2] {
    const NAME: &str = "primvars:st";
    let interpolation = if uvs.corners.is_some() { "faceVarying" } else { "vertex" };
    let values = Attribute::new("texCoord2f[]", NAME).interpolated(interpolation);
    let seams = uvs.corners.as_ref().map(|_| Attribute::new("int[]", format!("{NAME}:indices")));
    [Some(values), seams]
}

/// The meshes of one frame; opened on its own, the file shows these meshes.
pub fn clip(kind: &str, frame: i32, fps: f64, units: Units, meshes: &[MeshFrame]) -> File {
    let (mut root, mut contents) = (Prim::def("Xform", kind), Vec::new());
    for mesh in meshes {
        let mut prim = Prim::def("Mesh", mesh.name);
        prim.add(Attribute::token("subdivisionScheme", "none"));
        let (attributes, held) = mesh.attributes(frame);
        attributes.into_iter().for_each(|attribute| prim.add(attribute));
        root.children.push(prim);
        contents.push((mesh.name.to_string(), held));
    }
    File { layer: Layer::new(root, units.metadata_of_frame(frame, fps)), contents }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::attributes::{Number, On};

    #[test]
    fn faces_without_an_area_are_not_written_nor_are_their_values() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]].map(Vec3::from);
        let triangles = [[0, 1, 3], [0, 1, 2], [2, 2, 0]];
        let array = |name: &str, on, values: &[f64]| MeshArray {
            name: name.into(),
            on,
            number: Number::F32,
            values: values.to_vec(),
        };
        let (face, corner) = (
            array("face", On::Faces, &[1.0, 2.0, 3.0]),
            array("corner", On::Corners, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
        );
        let uvs = Uvs { coordinates: vec![[0.0, 0.0]; 9], corners: Some((0..9).collect()), missing: 0 };
        let mesh = MeshFrame {
            name: "mesh",
            points: &points,
            velocities: &[],
            triangles: &triangles,
            uvs: Some(&uvs),
            arrays: &[&face, &corner],
            shading: Shading::Creased,
        };
        let value = |name: &str| {
            let found = mesh.attributes(1).0.into_iter().find(|attribute| attribute.name == name);
            found.unwrap().samples.swap_remove(0).1
        };
        assert_eq!(value("faceVertexCounts"), Value::Ints(vec![3]));
        assert_eq!(value("faceVertexIndices"), Value::Ints(vec![0, 1, 2]));
        assert_eq!(value("primvars:face"), Value::Floats(vec![2.0]));
        assert_eq!(value("primvars:corner"), Value::Floats(vec![3.0, 4.0, 5.0]));
        assert_eq!(value("primvars:st:indices"), Value::Ints(vec![3, 4, 5]));
        assert_eq!(value("primvars:normals:indices"), Value::Ints(vec![0, 0, 0]));
        assert_eq!(value("extent"), Value::Vectors(vec![[0.0; 3], [1.0, 1.0, 0.0]]));
        let none = MeshFrame {
            shading: Shading::Smooth,
            triangles: &triangles[..1],
            arrays: &[],
            uvs: None,
            ..mesh
        };
        let visibility = none.attributes(1).0.swap_remove(0);
        assert_eq!(visibility.samples, [(1, Value::Token("invisible".into()))]);
    }
}
