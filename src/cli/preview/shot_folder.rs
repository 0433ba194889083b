//! The frames of a whole shot: the output folder of `frazil snow` or `frazil surface`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::grids::parts_of_vdb;
use super::parts::{Folder, Part, points_of};
use frazil::geometry::{DVec3, DetailedMesh};
use frazil::io::mesh::{self, extension};
use frazil::render::Camera;
use frazil::scene::run::DoneFrames;
use frazil::scene::{MovingObjects, Rebuild, RebuildGrains, Scene};
use frazil::vdb::{FloatGrid, file};
use frazil::{Context, Error, Result};

/// A shot's folder, read frame by frame.
pub struct ShotFolder {
    folder: PathBuf,
    base: Rebuild,
    grains: RebuildGrains,
    mist: DoneFrames,
    objects: DoneFrames,
    surface: DoneFrames,
    files: [Files; 5],
    /// The moving objects of the scene, if the folder has no files of them.
    moving: Option<MovingObjects>,
    /// The frames that all stages have, ascending; at least one.
    frames: Vec<i32>,
}

/// The file to draw for each frame of a stage.
type Files = BTreeMap<i32, PathBuf>;

/// The stages that are drawn, in this order, each with its readable kinds of files, the best first.
const STAGES: [(&str, &[&str]); 5] = [
    ("base", &["vdb"]),
    ("grains", &["vdb", "ply", "usdc"]),
    ("mist", &["vdb"]),
    ("objects", &["ply", "usdc"]),
    ("surface", &["ply", "usdc"]),
];

/// Index of the moving objects among them.
const OBJECTS: usize = 3;
/// Maximum number of frames at which objects are posed to find their bounds.
const MAX_POSES: usize = 48;

impl ShotFolder {
    /// Opens a folder.
    ///
    /// # Errors
    /// Records that cannot be read; no stage that can be drawn.
    pub fn open(folder: &Path) -> Result<Self> {
        let (base, grains) = (Rebuild::open(folder)?, RebuildGrains::open(folder)?);
        let stored = |stage: usize| DoneFrames::read(folder, STAGES[stage].0);
        let (mist, objects, surface) = (stored(2)?, stored(3)?, stored(4)?);
        let stored = [base.stored(), grains.stored(), &mist, &objects, &surface];
        let files = [0, 1, 2, 3, 4].map(|stage| files_of(folder, stored[stage], STAGES[stage]));
        let frames = frames_of_all(&files);
        if frames.is_empty() {
            let names = STAGES.map(|(name, _)| name).join(", ");
            let what = format!("is not the folder of a shot with frames to draw from its stages ({names})");
            return Err(Error::file(folder, what));
        }
        let moving = (files[OBJECTS].is_empty() && !files[0].is_empty()).then(|| moving_objects(folder));
        let moving = moving.flatten();
        Ok(Self { folder: folder.to_path_buf(), base, grains, mist, objects, surface, files, moving, frames })
    }

    /// The corners of the objects' extents in their files, as far as reports have them, or of their poses, over all frames.
    fn bounds_of_objects(&self) -> Result<Option<(DVec3, DVec3)>> {
        let mut all = None::<(DVec3, DVec3)>;
        for frame in &self.frames {
            let contents = self.objects.contents(*frame, STAGES[OBJECTS].0)?.unwrap_or_default();
            for prim in contents.as_object().into_iter().flat_map(|prims| prims.values()) {
                if let Some([low, high]) = corners(&prim["extent_m"]) {
                    all = Some(all.map_or((low, high), |(a, b)| (a.inf(&low), b.sup(&high))));
                }
            }
        }
        if all.is_some() || self.files[0].is_empty() {
            return Ok(all);
        }
        let step = self.frames.len().div_ceil(MAX_POSES);
        let frames: Vec<i32> = self.frames.iter().step_by(step).chain(self.frames.last()).copied().collect();
        if self.files[OBJECTS].is_empty() {
            return self.moving.as_ref().map_or(Ok(None), |moving| moving.bounds(&frames));
        }
        // No report has the extents of .ply files.
        moving_objects(&self.folder).map_or(Ok(None), |moving| moving.bounds(&frames))
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

impl Folder for ShotFolder {
    fn path(&self) -> &Path {
        &self.folder
    }

    fn frames(&self) -> &[i32] {
        &self.frames
    }

    fn stages(&self) -> Vec<&str> {
        let stages = STAGES.iter().zip(&self.files).filter(|(_, files)| !files.is_empty());
        stages.map(|((name, _), _)| *name).collect()
    }

    fn fps(&self) -> Result<f64> {
        let scene = Scene::read(&self.folder.join("scene.toml"));
        let fps = scene.map(|scene| scene.shot().fps);
        fps.map_err(|error| Error::argument(format!("{error}; give the frame rate with --fps")))
    }

    fn read(&mut self, ctx: &Context, frame: i32) -> Result<Vec<Part>> {
        let [base, grains, mist, objects, surface] =
            self.files.each_ref().map(|files| files.get(&frame).cloned());
        let mut parts = Vec::new();
        // Each file is compared with its record before it is read.
        if base.is_some() {
            parts.push(Part::Surface(self.surface(ctx, frame)?));
        }
        match grains {
            Some(path) if extension(&path) == "vdb" => {
                let points = self.grains.points(ctx, frame)?.clone();
                parts.push(Part::Points(path, points));
            }
            Some(path) => {
                let path = self.grains.stored().file_with(frame, STAGES[1].0, &extension(&path))?;
                parts.push(points_of(&path)?);
            }
            None => {}
        }
        if mist.is_some() {
            parts.extend(parts_of_vdb(&self.mist.file(frame, STAGES[2].0)?)?);
        }
        for (stored, (stage, _), file) in
            [(&self.objects, STAGES[3], objects), (&self.surface, STAGES[4], surface)]
        {
            if let Some(file) = file {
                let path = stored.file_with(frame, stage, &extension(&file))?;
                parts.push(Part::Mesh(mesh::read_any(&path)?.into_detailed().without_unused()));
            }
        }
        for mesh in self.moving.iter().map(|moving| moving.at(frame)).collect::<Result<Vec<_>>>()?.concat() {
            parts.push(Part::Mesh(DetailedMesh { mesh, ..DetailedMesh::default() }.without_unused()));
        }
        Ok(parts)
    }

    fn focus(&mut self) -> Option<[DVec3; 2]> {
        // A folder of another system shows all that it has.
        let (low, high) = self.bounds_of_objects().unwrap_or_else(|error| {
            log::warn!("{error}: the picture shows everything");
            None
        })?;
        Some(Camera::surroundings((low, high)).into())
    }
}

/// The moving objects of the scene with snow that a folder has; `None` and a warning if their files cannot be read.
fn moving_objects(folder: &Path) -> Option<MovingObjects> {
    let scene = Scene::read(&folder.join("scene.toml"));
    let moving = scene.and_then(|scene| MovingObjects::read(&scene));
    moving.inspect_err(|error| log::warn!("{error}: the poses of objects are not known")).ok()
}

/// The corners of an extent in a report (m).
fn corners(extent: &serde_json::Value) -> Option<[DVec3; 2]> {
    let corner = |at: usize| {
        let axis = |axis: usize| extent.get(at)?.get(axis)?.as_f64();
        Some(DVec3::new(axis(0)?, axis(1)?, axis(2)?))
    };
    Some([corner(0)?, corner(1)?])
}

/// The files of a stage to draw; a warning if it has none of a readable kind.
fn files_of(folder: &Path, stored: &DoneFrames, (stage, extensions): (&str, &[&str])) -> Files {
    let all = stored.files(stage);
    let mut files = Files::new();
    for (frame, path) in extensions
        .iter()
        .flat_map(|known| all.iter().filter(move |(_, path)| extension(path.as_ref()) == *known))
    {
        files.entry(*frame).or_insert_with(|| folder.join(path));
    }
    if files.is_empty() && !all.is_empty() {
        let read = extensions.join(" and .");
        log::warn!("{}: not drawn, since it has no .{read} files", folder.join(stage).display());
    }
    files
}

/// The frames that all existing stages have.
fn frames_of_all(files: &[Files]) -> Vec<i32> {
    let mut stages = files.iter().filter(|files| !files.is_empty());
    let Some(first) = stages.next() else { return Vec::new() };
    let others: Vec<&Files> = stages.collect();
    let is_in_all = |frame: &&i32| others.iter().all(|files| files.contains_key(frame));
    first.keys().filter(is_in_all).copied().collect()
}
