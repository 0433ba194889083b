//! What a picture of a liquid shows besides it: the terrain, and what stands or moves on it.

use super::obstacles;
use super::terrain::Terrain;
use crate::base::TriMesh;
use crate::context::Context;
use crate::error::Result;
use crate::io::seen::Seen;
use crate::scene::Scene;

/// The surroundings of a scene's liquid at a frame (m).
pub struct Around {
    /// The terrain.
    pub terrain: TriMesh,
    /// What stands or moves on it, each by itself.
    pub obstacles: Vec<TriMesh>,
}

impl Around {
    /// Reads them.
    ///
    /// # Errors
    /// A scene without a liquid; files that cannot be read; cancel.
    pub fn read(ctx: &Context, scene: &Scene, frame: i32) -> Result<Self> {
        let terrain = Terrain::read(scene.shallow()?, frame, &Seen::default())?.mesh(ctx)?;
        Ok(Self { terrain, obstacles: Self::obstacles(scene, frame)? })
    }

    /// What stands or moves on the terrain at a frame.
    ///
    /// # Errors
    /// As [`Around::read`].
    pub fn obstacles(scene: &Scene, frame: i32) -> Result<Vec<TriMesh>> {
        let of = scene.shallow()?;
        let mut obstacles = obstacles::meshes(of, scene.shot.frames.first, &Seen::default())?;
        obstacles.extend(obstacles::shapes_at(of, frame)?.iter().map(obstacles::drawn));
        Ok(obstacles)
    }

    /// Whether the terrain is another one at each frame.
    pub fn moves(scene: &Scene) -> bool {
        scene.shallow().is_ok_and(|of| of.sequence().is_some())
    }
}
