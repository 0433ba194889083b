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
    /// The extension of the files that are drawn.
    extension: &'static str,
    /// The existing frames, ascending; at least one.
    frames: Vec<i32>,
}

/// The extensions of files that can be drawn, the best first.
const DRAWN: [&str; 2] = ["ply", "usdc"];

impl ShallowFolder {
    /// Opens a folder; none if it has no frames of a liquid.
    ///
    /// # Errors
    /// Records that cannot be read.
    pub fn open(folder: &Path) -> Result<Option<Self>> {
        let liquid = DoneFrames::read(folder, LIQUID)?;
        let all = liquid.files(LIQUID);
        let frames_of = |kind: &'static str| {
            let files = all.iter().filter(|(_, path)| extension(path.as_ref()) == kind);
            let frames: Vec<i32> = files.map(|(frame, _)| *frame).collect();
            (!frames.is_empty()).then_some((kind, frames))
        };
        // A folder whose kind of files was changed has frames of both: the kind with the most is drawn.
        let drawn = DRAWN.into_iter().rev().filter_map(frames_of).max_by_key(|(_, frames)| frames.len());
        let Some((extension, frames)) = drawn else { return Ok(None) };
        let scene = match Scene::read(&folder.join("scene.toml")) {
            Ok(scene) => Some(scene),
            Err(error) => {
                log::warn!("{error}: the liquid is drawn without its terrain");
                None
            }
        };
        Ok(Some(Self { folder: folder.to_path_buf(), liquid, scene, terrain: None, extension, frames }))
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
        let of_terrain: Vec<String> = self
            .liquid
            .files(TERRAIN)
            .into_iter()
            .filter(|(at, _)| *at == frame)
            .map(|(_, path)| extension(path.as_ref()))
            .collect();
        if let Some(kind) = DRAWN.into_iter().find(|kind| of_terrain.iter().any(|other| other == kind)) {
            let stained = mesh::read_detailed(&self.liquid.file_with(frame, TERRAIN, kind)?)?;
            let stains = stained.of_vertices("stain").unwrap_or_default();
            parts.retain(|part| !matches!(part, Part::Ground(..)));
            parts.push(Part::Ground(stained.mesh, stains, look));
        }
        let path = self.liquid.file_with(frame, LIQUID, self.extension)?;
        // A file without faces is not a mesh.
        let report = self.liquid.report(frame)?;
        let is_dry = report.is_some_and(|report| report["triangles"].as_u64() == Some(0));
        if !is_dry {
            parts.push(Part::Liquid(mesh::read_detailed(&path)?.without_unused(), look));
        }
        Ok(parts)
    }
}
