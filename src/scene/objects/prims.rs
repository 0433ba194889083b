//! The prims of moving objects: one for each object, or one for each node and colour of a glTF file.

use crate::geometry::mesh::compact;
use crate::geometry::{Uvs, Vec3};
use crate::io::usd::materials::Look;
use crate::io::usd::{MeshFrame, MeshPrim, Shading, prim_name};
use crate::motion::{Drawn, Parts};
use crate::scene::Scene;

/// A prim of an object: the part of its mesh that does not change from frame to frame.
pub struct ObjectPrim {
    /// Its name, unique among all.
    pub name: String,
    look: Look,
    /// Its vertices among the drawn ones of the object.
    vertices: Vec<u32>,
    /// Triangles over these vertices.
    triangles: Vec<[u32; 3]>,
    uvs: Option<Uvs>,
}

impl ObjectPrim {
    /// Its values of the vertices, from those of the object.
    pub fn gather(&self, of_object: &[Vec3]) -> Vec<Vec3> {
        self.vertices.iter().map(|&vertex| of_object[vertex as usize]).collect()
    }

    /// Its prim in the shot.
    pub fn mesh(&self) -> MeshPrim<'_> {
        MeshPrim {
            name: self.name.clone(),
            look: self.look,
            moves: true,
            uvs: self.uvs.as_ref(),
            primvars: Vec::new(),
            shading: Shading::Creased,
        }
    }

    /// Its mesh at a frame, with the positions (m) and velocities (m/s) of its vertices.
    pub fn frame<'a>(&'a self, points: &'a [Vec3], velocities: &'a [Vec3]) -> MeshFrame<'a> {
        MeshFrame {
            name: &self.name,
            points,
            velocities,
            triangles: &self.triangles,
            uvs: self.uvs.as_ref(),
            arrays: &[],
            shading: Shading::Creased,
        }
    }
}

/// The prims of each moving object of a scene; `drawn` has their meshes, in the scene's order.
pub fn prims_of<'a>(scene: &Scene, drawn: impl Iterator<Item = Drawn<'a>>) -> Vec<Vec<ObjectPrim>> {
    let objects = object_names(scene);
    let mut names = objects.clone();
    let of_object = |(drawn, object): (Drawn<'_>, String)| match drawn.parts {
        Some(parts) => prims_of_parts(&drawn, parts, &object, &mut names),
        None => vec![ObjectPrim {
            name: object,
            look: Look::Object,
            // All vertices of the file, in its order.
            vertices: (0..drawn.vertices as u32).collect(),
            triangles: drawn.triangles.to_vec(),
            uvs: drawn.uvs.cloned(),
        }],
    };
    drawn.zip(objects).map(of_object).collect()
}

/// A prim for each part that has triangles: named after the object if it is the only one, else after the object and the part.
fn prims_of_parts(drawn: &Drawn, parts: &Parts, object: &str, names: &mut Vec<String>) -> Vec<ObjectPrim> {
    let mut triangles_of: Vec<Vec<usize>> = vec![Vec::new(); parts.list.len()];
    parts.of_triangles.iter().enumerate().for_each(|(at, &part)| triangles_of[part as usize].push(at));
    let shown = parts.list.iter().zip(triangles_of).filter(|(_, triangles)| !triangles.is_empty());
    let is_only = shown.clone().count() == 1;
    let prim = |(part, own): (&crate::motion::Part, Vec<usize>)| {
        let triangles: Vec<[u32; 3]> = own.iter().map(|&at| drawn.triangles[at]).collect();
        let (vertices, triangles) = compact(drawn.vertices, &triangles);
        let name = match is_only {
            true => object.to_string(),
            false => unique(&format!("{object}_{}", prim_name(&part.name)), names),
        };
        let uvs = drawn.uvs.map(|uvs| uvs.of_part(&vertices, &own));
        ObjectPrim { name, look: Look::of_object(part.colour), vertices, triangles, uvs }
    };
    shown.map(prim).collect()
}

/// Names of the moving objects, each unique: those of their files.
fn object_names(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for object in scene.objects.iter().filter(|object| object.role.moves()) {
        let stem = object.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stem = stem.split(['%', '#', '$']).next().unwrap_or("").trim_end_matches(['.', '_']);
        unique(&prim_name(stem), &mut names);
    }
    names
}

/// A name that is not taken yet: itself, or with a number. It is taken from now on.
fn unique(name: &str, taken: &mut Vec<String>) -> String {
    let count = taken.iter().filter(|known| *known == name || known.starts_with(&format!("{name}_"))).count();
    let numbered = |number: usize| if number == 1 { name.to_string() } else { format!("{name}_{number}") };
    // The numbered name may already belong to another file.
    let free = (count + 1..).map(numbered).find(|name| !taken.contains(name)).unwrap_or_default();
    taken.push(free.clone());
    free
}
