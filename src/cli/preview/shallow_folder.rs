//! The frames of a liquid on a terrain: the output folder of `frazil shallow`, with the terrain and the obstacles of its scene.

use std::path::{Path, PathBuf};

use crate::cli::preview::parts::{Folder, LiquidLook, Part};
use frazil::geometry::TriMesh;
use frazil::io::mesh::{self, extension};
use frazil::scene::Scene;
use frazil::scene::run::DoneFrames;
use frazil::scene::shallow::Surroundings;
use frazil::{Context, Error, Result};

/// The stage, and the kind of its files.
const LIQUID: &str = "liquid";
/// The kind of the files of a stained terrain.
const TERRAIN: &str = "terrain";

/// An output folder of `frazil shallow`, read frame by frame.
pub struct ShallowFolder {
    folder: PathBuf,
    liquid: DoneFrames,
    /// The scene; none if it cannot be read: the liquid is then drawn alone.
    scene: Option<Scene>,
    /// The terrain, if it is the same in all frames and was read.
    terrain: Option<TriMesh>,
    /// The existing frames, ascending; at least one.
    frames: Vec<i32>,
}

/// The extensions of files that can be drawn, the best first.
const DRAWN: [&str; 2] = ["ply", "usdc"];

/// The files of a kind that can be drawn: their frames and extensions.
fn drawn(stored: &DoneFrames, kind: &str) -> Vec<(i32, &'static str)> {
    let known = |path: &str| DRAWN.into_iter().find(|known| *known == extension(path.as_ref()));
    stored.files(kind).into_iter().filter_map(|(frame, path)| Some((frame, known(&path)?))).collect()
}

/// The extension of the file of a kind to draw at a frame.
fn drawn_at(stored: &DoneFrames, kind: &str, frame: i32) -> Option<&'static str> {
    let all = drawn(stored, kind);
    DRAWN.into_iter().find(|known| all.contains(&(frame, known)))
}

impl ShallowFolder {
    /// Opens a folder; none if it has no frames of a liquid.
    ///
    /// # Errors
    /// Records that cannot be read.
    pub fn open(folder: &Path) -> Result<Option<Self>> {
        let liquid = DoneFrames::read(folder, LIQUID)?;
        let mut frames: Vec<i32> = drawn(&liquid, LIQUID).into_iter().map(|(frame, _)| frame).collect();
        frames.sort_unstable();
        frames.dedup();
        if frames.is_empty() {
            return Ok(None);
        }
        let scene = match Scene::read(&folder.join("scene.toml")) {
            Ok(scene) => Some(scene),
            Err(error) => {
                log::warn!("{error}: the liquid is drawn without its terrain");
                None
            }
        };
        Ok(Some(Self { folder: folder.to_path_buf(), liquid, scene, terrain: None, frames }))
    }

    /// The terrain, and the objects on it; a warning if they cannot be read.
    fn around(&mut self, ctx: &Context, frame: i32, look: LiquidLook) -> Vec<Part> {
        let Some(scene) = &self.scene else { return Vec::new() };
        let around = match self.terrain.clone() {
            Some(terrain) => Surroundings::with_terrain(terrain, scene, frame),
            None => Surroundings::read(ctx, scene, frame),
        };
        match around {
            Ok(Surroundings { terrain, mut obstacles, meshes }) => {
                if !Surroundings::moves(scene) {
                    self.terrain = Some(terrain.clone());
                }
                let tools = obstacles.split_off(meshes).into_iter().map(Part::Obstacle);
                let parts = std::iter::once(Part::Ground(terrain, Vec::new(), look));
                parts.chain(obstacles.into_iter().map(Part::StaticMesh)).chain(tools).collect()
            }
            Err(error) => {
                log::warn!("{error}: the liquid is drawn without its terrain");
                self.scene = None;
                Vec::new()
            }
        }
    }
}

impl Folder for ShallowFolder {
    fn path(&self) -> &Path {
        &self.folder
    }

    fn frames(&self) -> &[i32] {
        &self.frames
    }

    fn stages(&self) -> Vec<&str> {
        vec![LIQUID]
    }

    fn fps(&self) -> Result<f64> {
        let fps = self.scene.as_ref().map(|scene| scene.shot().fps);
        fps.ok_or_else(|| {
            let what = "has no scene.toml that can be read: give the frame rate with --fps";
            Error::file(&self.folder, what)
        })
    }

    fn read(&mut self, ctx: &Context, frame: i32) -> Result<Vec<Part>> {
        let look = self.scene.as_ref().and_then(|scene| scene.shallow().ok());
        let look = LiquidLook::of(look.map_or("", |liquid| &*liquid.look));
        let mut parts = self.around(ctx, frame, look);
        if let Some(kind) = drawn_at(&self.liquid, TERRAIN, frame) {
            let stained = mesh::read_detailed(&self.liquid.file_with(frame, TERRAIN, kind)?)?;
            let stains = stained.of_vertices("stain").unwrap_or_default();
            parts.retain(|part| !matches!(part, Part::Ground(..)));
            parts.push(Part::Ground(stained.mesh, stains, look));
        }
        let kind = drawn_at(&self.liquid, LIQUID, frame).unwrap_or(DRAWN[0]);
        let path = self.liquid.file_with(frame, LIQUID, kind)?;
        // A file without faces is not a mesh.
        let report = self.liquid.report(frame)?;
        let is_dry = report.is_some_and(|report| report["triangles"].as_u64() == Some(0));
        if !is_dry {
            parts.push(Part::Liquid(mesh::read_detailed(&path)?.without_unused(), look));
        }
        Ok(parts)
    }
}
