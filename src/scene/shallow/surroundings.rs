//! Surroundings for a picture of a liquid: the terrain, and the obstacles on it.

use super::inputs::obstacles;
use super::inputs::terrain::Terrain;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::io::records::input_hashes::InputHashes;
use crate::scene::Scene;

/// The surroundings of a scene's liquid at a frame (m).
pub struct Surroundings {
    /// The terrain.
    pub terrain: TriMesh,
    /// A mesh for each obstacle; those from files come first.
    pub obstacles: Vec<TriMesh>,
    /// Number of meshes from files.
    pub meshes: usize,
}

impl Surroundings {
    /// Reads the surroundings.
    ///
    /// # Errors
    /// A scene without a liquid; files that cannot be read; cancel.
    pub fn read(ctx: &Context, scene: &Scene, frame: i32) -> Result<Self> {
        let terrain = Terrain::read(scene.shallow()?, frame, &InputHashes::default())?.mesh(ctx)?;
        Self::with_terrain(terrain, scene, frame)
    }

    /// As [`Surroundings::read`], with a given terrain.
    ///
    /// # Errors
    /// As there.
    pub fn with_terrain(terrain: TriMesh, scene: &Scene, frame: i32) -> Result<Self> {
        let setup = scene.shallow()?;
        let mut obstacles = obstacles::meshes(setup, scene.shot.frames.first, &InputHashes::default())?;
        let meshes = obstacles.len();
        obstacles.extend(obstacles::shapes_at(setup, frame)?.iter().map(obstacles::shape_mesh));
        Ok(Self { terrain, obstacles, meshes })
    }

    /// Whether the terrain changes from frame to frame.
    pub fn moves(scene: &Scene) -> bool {
        scene.shallow().is_ok_and(|setup| setup.sequence().is_some())
    }
}
