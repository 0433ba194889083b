//! The inputs of a picture: files, sequences and whole shots, read frame by frame.

use std::path::{Path, PathBuf};

use frazil::geometry::{DVec3, DetailedMesh, TriMesh};
use frazil::io::files::sequence::Pattern;
use frazil::motion::{Character, Play, is_gltf};
use frazil::{Context, Error, Result, io};

#[cfg(feature = "vdb")]
use super::grids::parts_of_vdb;
use super::parts::{Folder, Part, points_of};
use super::shallow_folder::ShallowFolder;
#[cfg(feature = "vdb")]
use super::shot_folder::ShotFolder;

/// An input to draw.
enum Source {
    File(PathBuf),
    Sequence(Pattern),
    Folder(Box<dyn Folder>),
}

/// All inputs of a picture.
pub struct Sources {
    all: Vec<Source>,
    clip: Option<String>,
    /// The user's frame rate.
    fps: Option<f64>,
}

/// Frame rate (frames per second) if neither the user nor a shot gives one.
const DEFAULT_FPS: f64 = 24.0;

impl Sources {
    /// Opens files, patterns of sequences and folders of shots. Characters play `clip`, or without it their only clip.
    ///
    /// # Errors
    /// A folder that is not a shot's, or whose records cannot be read.
    pub fn open(paths: &[PathBuf], clip: Option<String>, fps: Option<f64>) -> Result<Self> {
        let all = paths.iter().map(|path| Source::open(path)).collect::<Result<_>>()?;
        Ok(Self { all, clip, fps })
    }

    /// Frames per second: as the user gives it, else as in the first shot, else 24.
    ///
    /// # Errors
    /// A shot's scene that cannot be read.
    pub fn fps(&self) -> Result<f64> {
        match self.fps {
            Some(fps) => Ok(fps),
            None => Ok(self.all.iter().find_map(Source::fps).transpose()?.unwrap_or(DEFAULT_FPS)),
        }
    }

    /// The frames that all of the shots hold, ascending; none without a shot.
    pub fn frames(&self) -> Option<Vec<i32>> {
        let shots = self.all.iter().filter_map(Source::frames);
        shots.reduce(|mut all, other| {
            all.retain(|frame| other.contains(frame));
            all
        })
    }

    /// The lowest and the highest corner (m) of what a picture of the shots should show; `None` if that is everything, as in a picture with
    /// anything else.
    pub fn focus(&mut self) -> Option<[DVec3; 2]> {
        let of_source = |source: &mut Source| match source {
            Source::Folder(folder) => folder.focus(),
            _ => None,
        };
        let all: Option<Vec<_>> = self.all.iter_mut().map(of_source).collect();
        all?.into_iter().reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])])
    }

    /// Whether any input depends on the frame.
    pub fn moves(&self) -> bool {
        self.all.iter().any(|source| !matches!(source, Source::File(path) if !is_gltf(path)))
    }

    /// Whether there is a character.
    pub fn has_characters(&self) -> bool {
        self.all.iter().any(|source| matches!(source, Source::File(path) if is_gltf(path)))
    }

    /// Refuses a frame that a sequence or a shot does not have; refuses `None` if there is a sequence or a shot.
    ///
    /// # Errors
    /// Names what is missing.
    pub fn refuse_missing(&self, frame: Option<f64>) -> Result<()> {
        self.all.iter().try_for_each(|source| source.refuse_missing(frame))
    }

    /// As [`Sources::refuse_missing`], for shots alone: a sequence may have gaps.
    ///
    /// # Errors
    /// Names what is missing.
    pub fn refuse_missing_in_shots(&self, frame: Option<f64>) -> Result<()> {
        let shots = self.all.iter().filter(|source| !matches!(source, Source::Sequence(_)));
        shots.into_iter().try_for_each(|source| source.refuse_missing(frame))
    }

    /// Reads the inputs at a frame. If frames are read in ascending order, each frame of a shot needs only one file of each stage.
    ///
    /// # Errors
    /// A file that cannot be read; cancel.
    pub fn read(&mut self, ctx: &Context, frame: Option<f64>) -> Result<Vec<Part>> {
        let mut parts = Vec::new();
        let fps = if self.has_characters() { self.fps()? } else { DEFAULT_FPS };
        for source in &mut self.all {
            match source {
                Source::File(path) => parts.extend(read_file(path, self.clip.as_deref(), frame, fps)?),
                Source::Sequence(pattern) => {
                    let path = pattern.path(whole_frame(frame, &pattern.path(0))?);
                    parts.extend(read_file(&path, None, None, fps)?);
                }
                Source::Folder(folder) => {
                    let frame = whole_frame(frame, folder.path())?;
                    parts.extend(folder.read(ctx, frame)?);
                }
            }
        }
        Ok(parts)
    }
}

impl Source {
    fn open(path: &Path) -> Result<Self> {
        if path.is_dir() {
            if let Some(folder) = ShallowFolder::open(path)? {
                return Ok(Self::Folder(Box::new(folder)));
            }
            #[cfg(feature = "vdb")]
            return Ok(Self::Folder(Box::new(ShotFolder::open(path)?)));
            #[cfg(not(feature = "vdb"))]
            return crate::cli::needs_openvdb(path);
        }
        if let Some(pattern) = Pattern::parse(path) {
            return Ok(Self::Sequence(pattern));
        }
        // Before options are found to be idle for such a file, which may be meant as a folder.
        std::fs::metadata(path).map_err(|error| Error::io(path, "read", error))?;
        Ok(Self::File(path.to_path_buf()))
    }

    /// Frames per second of a shot; none for other inputs.
    fn fps(&self) -> Option<Result<f64>> {
        if let Self::Folder(folder) = self { Some(folder.fps()) } else { None }
    }

    /// The frames of a shot; none for other inputs.
    fn frames(&self) -> Option<Vec<i32>> {
        if let Self::Folder(folder) = self { Some(folder.frames().to_vec()) } else { None }
    }

    fn refuse_missing(&self, frame: Option<f64>) -> Result<()> {
        match self {
            Self::File(_) => Ok(()),
            Self::Sequence(pattern) => {
                let path = pattern.path(whole_frame(frame, &pattern.path(0))?);
                if path.is_file() { Ok(()) } else { Err(Error::file(path, "does not exist")) }
            }
            Self::Folder(folder) => folder.refuse_missing(whole_frame(frame, folder.path())?),
        }
    }
}

/// The frame number for an input that has whole frames only.
fn whole_frame(frame: Option<f64>, name: &Path) -> Result<i32> {
    match frame {
        Some(frame) if frame.fract() == 0.0 && frame.abs() <= 1.0e9 => Ok(frame as i32),
        Some(frame) => Err(Error::file(name, format!("has whole frames only, and --frame is {frame}"))),
        None => Err(Error::file(
            name,
            "holds many frames: choose one with --frame N, or several with --frames A-B",
        )),
    }
}

/// Reads a file; a character is posed by its clip if a clip or a frame is given.
fn read_file(path: &Path, clip: Option<&str>, frame: Option<f64>, fps: f64) -> Result<Vec<Part>> {
    let without_data = |mesh: TriMesh| DetailedMesh { mesh, ..DetailedMesh::default() };
    let mesh = match io::mesh::extension(path).as_str() {
        #[cfg(feature = "vdb")]
        "vdb" => return parts_of_vdb(path),
        #[cfg(not(feature = "vdb"))]
        "vdb" => return crate::cli::needs_openvdb(path),
        _ if io::particles::holds_points(path)? => return Ok(vec![points_of(path)?]),
        _ if is_gltf(path) && clip.is_none() && frame.is_none() => without_data(Character::at_rest(path)?),
        _ if is_gltf(path) => {
            let play = Play { clip: clip.map(String::from), ..Play::default() };
            without_data(Character::posed(path, play, (frame.unwrap_or(1.0) - 1.0) / fps)?)
        }
        _ => io::mesh::read_any(path)?.into_detailed().without_unused(),
    };
    Ok(vec![Part::Mesh(mesh)])
}
