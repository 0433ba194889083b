//! The terrain and the obstacles in USD: what never changes in one file of the shot, and the terrain in a file for each frame if it moves or
//! is stained, or the obstacles with keys.

use super::colours::{linear, srgb};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{MeshArray, TriMesh, Vec3};
use crate::io::mesh;
use crate::io::usd::materials::Look;
use crate::io::usd::{self, MeshFrame, MeshPrim, Shading, StillMeshes, primvars};
use crate::scene::Scene;
use crate::scene::shallow::inputs::obstacles;
use crate::scene::shallow::surroundings::Surroundings;
use crate::shallow::terrain::shapes::Shape;

/// Kind of the files of a terrain that changes.
pub(super) const TERRAIN: &str = "terrain";
/// Kind of the files of obstacles with keys.
pub(super) const OBSTACLES: &str = "obstacles";
/// The prim of what never changes.
pub(super) const SURROUNDINGS: &str = "surroundings";

/// The terrain at a frame, with the stain of each of its vertices if it has any.
pub struct TerrainFrame {
    pub mesh: TriMesh,
    pub stains: Option<Vec<f32>>,
}

impl TerrainFrame {
    /// The bytes of its .ply file.
    pub fn ply(&self, look: Look) -> Vec<u8> {
        let arrays = self.stains.as_deref().map_or(Vec::new(), |stains| stain_arrays(stains, look, srgb));
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        mesh::ply_bytes(&self.mesh, &mesh::Carried { arrays: &arrays, ..mesh::Carried::default() })
    }

    /// Its USD file at a frame.
    pub fn usd(&self, frame: i32, fps: f64, look: Look) -> usd::File {
        let arrays = self.stains.as_deref().map_or(Vec::new(), |stains| stain_arrays(stains, look, linear));
        let arrays: Vec<&MeshArray> = arrays.iter().collect();
        let mesh = still(TERRAIN, &self.mesh, &arrays);
        usd::clip(TERRAIN, frame, fps, usd::Units::OWN, &[mesh])
    }
}

/// The value of each stain, and the colour of the terrain under it.
fn stain_arrays(stains: &[f32], look: Look, coloured: fn(&[[f32; 3]]) -> [MeshArray; 3]) -> Vec<MeshArray> {
    let values = stains.iter().map(|stain| f64::from(*stain)).collect();
    let stain = MeshArray { name: "stain".into(), on: On::Vertices, number: Number::F32, values };
    let [ground, stained] = [Look::Terrain.colour(), look.colour()];
    let mixed = |stain: &f32| [0, 1, 2].map(|axis| ground[axis] + (stained[axis] - ground[axis]) * stain);
    let colours: Vec<[f32; 3]> = stains.iter().map(mixed).collect();
    std::iter::once(stain).chain(coloured(&colours)).collect()
}

/// The terrain's prim in the shot.
pub(super) fn terrain_prims<'a>(is_stained: bool, look: Look) -> Vec<MeshPrim<'a>> {
    let arrays = if is_stained { stain_arrays(&[], look, linear) } else { Vec::new() };
    let primvars = primvars::primvars(&arrays.iter().collect::<Vec<&MeshArray>>());
    let (name, shading) = (TERRAIN.into(), Shading::Creased);
    let look = if is_stained { Look::StainedTerrain } else { Look::Terrain };
    vec![MeshPrim { name, look, moves: false, uvs: None, primvars, shading }]
}

/// The prims of obstacles with keys in the shot.
pub(super) fn obstacle_prims<'a>(count: usize) -> Vec<MeshPrim<'a>> {
    let prim = |number: usize| MeshPrim {
        name: obstacle_name(number),
        look: Look::Object,
        moves: false,
        uvs: None,
        primvars: Vec::new(),
        shading: Shading::Creased,
    };
    (1..=count).map(prim).collect()
}

fn obstacle_name(number: usize) -> String {
    format!("obstacle_{number}")
}

/// The obstacles with keys at a frame.
pub(super) fn obstacles_file(shapes: &[Shape], frame: i32, fps: f64) -> usd::File {
    let meshes: Vec<TriMesh> = shapes.iter().map(obstacles::shape_mesh).collect();
    let names: Vec<String> = (1..=meshes.len()).map(obstacle_name).collect();
    let frames: Vec<MeshFrame<'_>> =
        names.iter().zip(&meshes).map(|(name, mesh)| still(name, mesh, &[])).collect();
    usd::clip(OBSTACLES, frame, fps, usd::Units::OWN, &frames)
}

/// What never changes: the terrain, unless it has files of its own, and meshes that stand on it; none if there is nothing.
///
/// # Errors
/// Files that can no longer be read; cancel.
pub(super) fn still_meshes(ctx: &Context, scene: &Scene, has_terrain: bool) -> Result<Option<StillMeshes>> {
    let first = scene.shot.frames.first;
    let Surroundings { terrain, mut obstacles, meshes } = match has_terrain {
        true => Surroundings::read(ctx, scene, first)?,
        false => Surroundings::with_terrain(TriMesh::default(), scene, first)?,
    };
    obstacles.truncate(meshes);
    let terrain = has_terrain.then(|| (TERRAIN.to_string(), terrain, Look::Terrain));
    let of_files = (1..).zip(obstacles).map(|(number, mesh)| (format!("mesh_{number}"), mesh, Look::Object));
    let all: Vec<(String, TriMesh, Look)> = terrain.into_iter().chain(of_files).collect();
    if all.is_empty() {
        return Ok(None);
    }
    let frames: Vec<MeshFrame<'_>> = all.iter().map(|(name, mesh, _)| still(name, mesh, &[])).collect();
    let file = usd::clip(SURROUNDINGS, first, scene.shot.fps, usd::Units::OWN, &frames);
    let bytes = file.bytes(usd::Format::Binary)?;
    let looks = all.iter().map(|(name, _, look)| (name.clone(), *look)).collect();
    Ok(Some(StillMeshes { kind: SURROUNDINGS, bytes, looks }))
}

/// A mesh without velocities.
fn still<'a>(name: &'a str, mesh: &'a TriMesh, arrays: &'a [&'a MeshArray]) -> MeshFrame<'a> {
    const NONE: &[Vec3] = &[];
    MeshFrame {
        name,
        points: &mesh.positions,
        velocities: NONE,
        triangles: &mesh.triangles,
        uvs: None,
        arrays,
        shading: Shading::Creased,
    }
}
