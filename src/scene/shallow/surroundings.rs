//! What a picture of a liquid shows besides it: the terrain, and what stands or moves on it.

use super::inputs::obstacles;
use super::inputs::terrain::Terrain;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::io::records::input_hashes::Seen;
use crate::scene::Scene;

/// The surroundings of a scene's liquid at a frame (m).
pub struct Around {
    /// The terrain.
    pub terrain: TriMesh,
    /// What stands or moves on it, each by itself; first the meshes of files.
    pub obstacles: Vec<TriMesh>,
    /// How many meshes of files there are.
    pub meshes: usize,
}

impl Around {
    /// Reads them.
    ///
    /// # Errors
    /// A scene without a liquid; files that cannot be read; cancel.
    pub fn read(ctx: &Context, scene: &Scene, frame: i32) -> Result<Self> {
        let terrain = Terrain::read(scene.shallow()?, frame, &Seen::default())?.mesh(ctx)?;
        Self::with_terrain(terrain, scene, frame)
    }

    /// As [`Around::read`], where the terrain is known.
    ///
    /// # Errors
    /// As there.
    pub fn with_terrain(terrain: TriMesh, scene: &Scene, frame: i32) -> Result<Self> {
        let of = scene.shallow()?;
        let mut obstacles = obstacles::meshes(of, scene.shot.frames.first, &Seen::default())?;
        let meshes = obstacles.len();
        obstacles.extend(obstacles::shapes_at(of, frame)?.iter().map(obstacles::drawn));
        Ok(Self { terrain, obstacles, meshes })
    }

    /// Whether the terrain is another one at each frame.
    pub fn moves(scene: &Scene) -> bool {
        scene.shallow().is_ok_and(|of| of.sequence().is_some())
    }
}
