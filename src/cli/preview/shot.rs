//! The frames of a whole shot: the output folder of `frazil snow`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use frazil::io::mesh::extension;
use frazil::io::points_ply;
use frazil::scene::shot::Stored;
use frazil::scene::{Rebuild, RebuildGrains, Scene};
use frazil::vdb::FloatGrid;
use frazil::vdb::file;
use frazil::{Context, Error, Result, io};

use super::sources::{Part, of_vdb, points_of_ply};

/// A shot's folder, read frame by frame.
pub struct Shot {
    folder: PathBuf,
    base: Rebuild,
    grains: RebuildGrains,
    /// The frames that have files of the base, and those of grains with their extensions.
    of_base: Vec<i32>,
    of_grains: BTreeMap<i32, Vec<String>>,
}

impl Shot {
    /// Opens a folder.
    ///
    /// # Errors
    /// Records that cannot be read.
    pub fn open(folder: &Path) -> Result<Self> {
        let (base, grains) = (Rebuild::open(folder)?, RebuildGrains::open(folder)?);
        let frames = |stored: &Stored, kind: &str| stored.files(kind).into_iter();
        let of_base = frames(base.stored(), "base").map(|(frame, _)| frame).collect();
        let mut of_grains: BTreeMap<i32, Vec<String>> = BTreeMap::new();
        for (frame, path) in frames(grains.stored(), "grains") {
            of_grains.entry(frame).or_default().push(extension(path.as_ref()));
        }
        Ok(Self { folder: folder.to_path_buf(), base, grains, of_base, of_grains })
    }

    /// Where it is.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its frames a second, from its scene.
    ///
    /// # Errors
    /// No scene.toml, or one that cannot be read.
    pub fn fps(&self) -> Result<f64> {
        Ok(Scene::read(&self.folder.join("scene.toml"))?.shot().fps)
    }

    /// Whether there is something to draw of a frame.
    pub fn has(&self, frame: i32) -> bool {
        self.has_base(frame) || self.grains_as(frame).is_some() || self.loose(frame).iter().any(|path| path.is_file())
    }

    /// The frames of which records say that they are done, in words; none without any.
    pub fn there(&self) -> Option<String> {
        let first = self.of_base.first().into_iter().chain(self.of_grains.keys().next()).min()?;
        let last = self.of_base.last().into_iter().chain(self.of_grains.keys().next_back()).max()?;
        Some(format!("frames within {first} to {last}"))
    }

    fn has_base(&self, frame: i32) -> bool {
        self.of_base.binary_search(&frame).is_ok()
    }

    /// The kind of file that has the grains of a frame.
    fn grains_as(&self, frame: i32) -> Option<&str> {
        let there = self.of_grains.get(&frame)?;
        ["vdb", "ply"].into_iter().find(|known| there.iter().any(|extension| extension == known))
    }

    /// The files of a frame that stand for themselves: mist and objects.
    fn loose(&self, frame: i32) -> [PathBuf; 2] {
        [format!("mist/mist.{frame:04}.vdb"), format!("objects/objects.{frame:04}.ply")]
            .map(|name| self.folder.join(name))
    }

    /// What there is of a frame; frames in ascending order cost one file each.
    ///
    /// # Errors
    /// A file that cannot be read or that is not what was written; cancel.
    pub fn read(&mut self, ctx: &Context, frame: i32) -> Result<Vec<Part>> {
        let mut parts = Vec::new();
        if self.has_base(frame) {
            parts.push(Part::Surface(self.surface(ctx, frame)?));
        }
        match self.grains_as(frame) {
            Some("vdb") => {
                let points = self.grains.points(ctx, frame)?.clone();
                parts.push(Part::Points(self.folder.join("grains"), points));
            }
            Some(_) => {
                let path = self.folder.join(format!("grains/grains.{frame:04}.ply"));
                parts.push(points_of_ply(&path)?);
            }
            None => {}
        }
        let [mist, objects] = self.loose(frame);
        if mist.is_file() {
            parts.push(of_vdb(&mist)?);
        }
        if objects.is_file() {
            parts.push(Part::Mesh(io::mesh::read(&objects)?.without_unused()));
        }
        Ok(parts)
    }

    /// The surface of the snow after a frame.
    fn surface(&mut self, ctx: &Context, frame: i32) -> Result<FloatGrid> {
        if self.base.stored().keeps_changes(frame) {
            return self.base.layer(ctx, frame)?.surface.deep_copy();
        }
        // Whole, though perhaps in 16 bits, from which no run could resume.
        let path = self.base.stored().file(frame, "base")?;
        let surface = file::read_own(&path)?.into_iter().find(|grid| grid.name() == "surface");
        surface.ok_or_else(|| Error::file(path, "has no grid \"surface\""))
    }
}
