//! What is drawn: files, sequences and whole shots, read frame by frame.

use std::path::{Path, PathBuf};

use frazil::base::{Points, TriMesh};
use frazil::io::sequence::Pattern;
use frazil::motion::{Character, Play, is_gltf};
#[cfg(feature = "vdb")]
use frazil::vdb::FloatGrid;
use frazil::{Context, Error, Result, io};

#[cfg(feature = "vdb")]
use super::shot::Shot;
#[cfg(feature = "vdb")]
use crate::cli::vdb::model::{self, Content};

/// A part of a picture, as it was read.
pub enum Part {
    /// A mesh.
    Mesh(TriMesh),
    /// Points, and where they came from.
    Points(PathBuf, Points),
    /// A level set.
    #[cfg(feature = "vdb")]
    Surface(FloatGrid),
    /// A fog volume, and its file.
    #[cfg(feature = "vdb")]
    Fog(PathBuf, FloatGrid),
}

/// Something to draw.
enum Source {
    File(PathBuf),
    Sequence(Pattern),
    #[cfg(feature = "vdb")]
    Shot(Box<Shot>),
}

/// How characters are posed.
pub struct Posing {
    /// Their clip; none: their only one.
    pub clip: Option<String>,
    /// Frames a second, where the user said so.
    pub fps: Option<f64>,
}

/// Everything that is drawn.
pub struct Sources {
    all: Vec<Source>,
    clip: Option<String>,
    fps: f64,
}

impl Sources {
    /// Opens files, patterns of sequences and folders of shots.
    ///
    /// # Errors
    /// A folder whose records cannot be read.
    pub fn open(paths: &[PathBuf], posing: Posing) -> Result<Self> {
        let all: Vec<Source> = paths.iter().map(|path| Source::open(path)).collect::<Result<_>>()?;
        let mut sources = Self { all, clip: posing.clip, fps: 24.0 };
        sources.fps = match (posing.fps, sources.fps_of_shot()) {
            (Some(fps), _) | (None, Some(Ok(fps))) => fps,
            (None, Some(Err(error))) => {
                let said = error.to_string();
                return Err(Error::argument(format!("{said}; --fps says how many frames a second there are")));
            }
            (None, None) => sources.fps,
        };
        Ok(sources)
    }

    /// Frames a second: what the user said, else those of the first shot, else 24.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    #[cfg(feature = "vdb")]
    fn fps_of_shot(&self) -> Option<Result<f64>> {
        self.all.iter().find_map(|source| match source {
            Source::Shot(shot) => Some(shot.fps()),
            _ => None,
        })
    }

    #[cfg(not(feature = "vdb"))]
    fn fps_of_shot(&self) -> Option<Result<f64>> {
        None
    }

    /// Refuses frames of which a sequence or a shot has nothing, frames between whole ones, and no frame where one is
    /// needed.
    ///
    /// # Errors
    /// Which.
    pub fn refuse_missing(&self, frames: &[Option<f64>]) -> Result<()> {
        for frame in frames {
            for source in &self.all {
                source.refuse_missing(*frame)?;
            }
        }
        Ok(())
    }

    /// Whether something of it depends on the frame.
    pub fn moves(&self) -> bool {
        self.all.iter().any(|source| !matches!(source, Source::File(path) if !is_gltf(path)))
    }

    /// The files that are given by name, those of sequences at a frame.
    pub fn files(&self, frame: Option<f64>) -> Vec<PathBuf> {
        let file = |source: &Source| match source {
            Source::File(path) => Some(path.clone()),
            Source::Sequence(pattern) => frame.map(|frame| pattern.path(frame as i32)),
            #[cfg(feature = "vdb")]
            Source::Shot(_) => None,
        };
        self.all.iter().filter_map(file).collect()
    }

    /// Reads what is drawn at a frame; a shot's frames in ascending order cost one file each.
    ///
    /// # Errors
    /// A file that cannot be read; cancel.
    #[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "shots are put together by threads"))]
    pub fn read(&mut self, ctx: &Context, frame: Option<f64>) -> Result<Vec<Part>> {
        let mut parts = Vec::new();
        for source in &mut self.all {
            match source {
                Source::File(path) => parts.push(of_file(path, self.clip.as_deref(), frame, self.fps)?),
                Source::Sequence(pattern) => {
                    let path = pattern.path(whole(frame, || pattern.path(0))?);
                    parts.push(of_file(&path, None, None, self.fps)?);
                }
                #[cfg(feature = "vdb")]
                Source::Shot(shot) => {
                    let frame = whole(frame, || shot.folder().to_path_buf())?;
                    parts.extend(shot.read(ctx, frame)?);
                }
            }
        }
        Ok(parts)
    }
}

impl Source {
    fn open(path: &Path) -> Result<Self> {
        if path.is_dir() {
            #[cfg(feature = "vdb")]
            return Ok(Self::Shot(Box::new(Shot::open(path)?)));
            #[cfg(not(feature = "vdb"))]
            return crate::cli::needs_openvdb(path);
        }
        Ok(Pattern::parse(path).map_or_else(|| Self::File(path.to_path_buf()), Self::Sequence))
    }

    fn refuse_missing(&self, frame: Option<f64>) -> Result<()> {
        match self {
            Self::File(_) => Ok(()),
            Self::Sequence(pattern) => {
                let frame = whole(frame, || pattern.path(0))?;
                let path = pattern.path(frame);
                if path.is_file() {
                    return Ok(());
                }
                Err(Error::file(path, format!("frame {frame} is not there")))
            }
            #[cfg(feature = "vdb")]
            Self::Shot(shot) => {
                let frame = whole(frame, || shot.folder().to_path_buf())?;
                if shot.has(frame) {
                    return Ok(());
                }
                let there = shot.there().map_or("it holds no frames".to_string(), |there| format!("it holds {there}"));
                Err(Error::file(shot.folder(), format!("frame {frame} is not there: {there}")))
            }
        }
    }
}

/// The frame of something that has whole frames only.
fn whole(frame: Option<f64>, name: impl Fn() -> PathBuf) -> Result<i32> {
    match frame {
        Some(frame) if frame.fract() == 0.0 && frame.abs() <= 1.0e9 => Ok(frame as i32),
        Some(frame) => Err(Error::file(name(), format!("has whole frames only, and --frame is {frame}"))),
        None => Err(Error::file(name(), "has many frames: choose one with --frame N, or several with --frames A-B")),
    }
}

/// Reads a file; a character is posed by its clip if a clip or a frame is given.
fn of_file(path: &Path, clip: Option<&str>, frame: Option<f64>, fps: f64) -> Result<Part> {
    let mesh = match io::mesh::extension(path).as_str() {
        #[cfg(feature = "vdb")]
        "vdb" => return of_vdb(path),
        #[cfg(not(feature = "vdb"))]
        "vdb" => return crate::cli::needs_openvdb(path),
        "ply" if io::points_ply::holds_points(path)? => return points_of_ply(path),
        _ if is_gltf(path) && clip.is_none() && frame.is_none() => Character::at_rest(path)?,
        _ if is_gltf(path) => {
            let play = Play { clip: clip.map(String::from), ..Play::default() };
            Character::posed(path, play, (frame.unwrap_or(1.0) - 1.0) / fps)?
        }
        _ => io::mesh::read(path)?.without_unused(),
    };
    Ok(Part::Mesh(mesh))
}

/// Reads points.
///
/// # Errors
/// A file that cannot be read.
pub fn points_of_ply(path: &Path) -> Result<Part> {
    let cloud = io::points_ply::read(path)?;
    let voxel = cloud.voxel_size.unwrap_or(0.01);
    let points = cloud.into_points(Some(voxel)).map_err(|error| Error::file(path, error.to_string()))?;
    Ok(Part::Points(path.to_path_buf(), points))
}

/// Reads a .vdb file.
///
/// # Errors
/// A file that cannot be read, or that holds nothing to draw.
#[cfg(feature = "vdb")]
pub fn of_vdb(path: &Path) -> Result<Part> {
    Ok(match model::read(path)? {
        Content::Surface(grid) => Part::Surface(grid),
        Content::Fog(grid) => Part::Fog(path.to_path_buf(), grid),
        Content::Points(points) => Part::Points(path.to_path_buf(), points),
    })
}
