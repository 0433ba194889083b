//! The frames that a folder holds: which are done, and the layer as it was after one of them.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::context::Context;
use crate::error::{Error, Result};
use crate::io::manifest::{Keeps, Manifest};
use crate::snow::base_layer::Grids;
use crate::vdb::file;

/// The stage whose frames they are.
pub(super) const STAGE: &str = "base";

/// The frames of a folder that are done.
pub struct Stored {
    folder: PathBuf,
    done: BTreeMap<i32, Manifest>,
}

impl Stored {
    /// Reads the records of a folder; frames whose files are not there with their lengths are not done, and a folder
    /// without records has none.
    ///
    /// # Errors
    /// A folder that cannot be read; a record that is damaged or of a newer version.
    pub fn read(folder: &Path) -> Result<Self> {
        let state = folder.join("state");
        let mut done = BTreeMap::new();
        let entries = match std::fs::read_dir(&state) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self { folder: folder.to_path_buf(), done });
            }
            other => other.map_err(|error| Error::io(&state, "read", error))?,
        };
        for entry in entries {
            let name = entry.map_err(|error| Error::io(&state, "read", error))?.file_name();
            let number = name.to_str().and_then(|name| name.strip_prefix("base.")?.strip_suffix(".json"));
            let Some(frame) = number.and_then(|number| number.parse::<i32>().ok()) else { continue };
            let Some(manifest) = Manifest::read(folder, STAGE, frame)? else { continue };
            if manifest.files_are_there(folder) {
                done.insert(frame, manifest);
            }
        }
        Ok(Self { folder: folder.to_path_buf(), done })
    }

    /// Where they are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether a frame is done.
    pub fn is_done(&self, frame: i32) -> bool {
        self.done.contains_key(&frame)
    }

    /// The frames that are done, ascending.
    pub fn frames(&self) -> impl Iterator<Item = i32> + '_ {
        self.done.keys().copied()
    }

    /// The record of a frame that is done.
    pub(super) fn manifest(&self, frame: i32) -> Option<&Manifest> {
        self.done.get(&frame)
    }

    /// Adds a frame that was written.
    pub(super) fn add(&mut self, manifest: Manifest) {
        self.done.insert(manifest.frame, manifest);
    }

    /// The files of a kind, ascending by frame, with their paths from the folder.
    pub fn files(&self, kind: &str) -> Vec<(i32, String)> {
        let of_frame = |(frame, manifest): (&i32, &Manifest)| -> Vec<(i32, String)> {
            manifest.files_of(kind).map(|written| (*frame, written.path.clone())).collect()
        };
        self.done.iter().flat_map(of_frame).collect()
    }

    /// Leaves out the frames from one on, as if they were not done; they stay where they are.
    pub(super) fn leave_out_from(&mut self, from: i32) -> Vec<Manifest> {
        self.done.split_off(&from).into_values().collect()
    }

    /// Leaves out a frame.
    pub(super) fn leave_out(&mut self, frame: i32) {
        self.done.remove(&frame);
    }

    /// Removes a frame that was left out: first what says that it is done, then its files.
    ///
    /// # Errors
    /// What the operating system reports.
    pub(super) fn remove(&self, manifest: &Manifest) -> Result<()> {
        let files = manifest.files.iter().map(|file| self.folder.join(&file.path));
        let state = state_path(&self.folder, manifest.frame);
        let record = Manifest::path(&self.folder, STAGE, manifest.frame);
        for path in std::iter::once(record).chain(files).chain([state]) {
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::io(path, "remove", error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The latest frame in a range after which the layer can be had.
    pub fn latest_layer(&self, frames: RangeInclusive<i32>) -> Option<i32> {
        if frames.is_empty() {
            return None;
        }
        let (mut latest, mut before) = (None, None);
        for (&frame, manifest) in self.done.range(..=frames.end()) {
            let loads = match manifest.keeps {
                Keeps::Whole => true,
                Keeps::Changes => before == Some(frame - 1),
                Keeps::State => manifest.state.as_ref().is_some_and(|state| state.is_there(&self.folder)),
            };
            if loads {
                before = Some(frame);
                latest = before.filter(|frame| frames.contains(frame)).or(latest);
            }
        }
        latest
    }

    /// The layer after a frame: from its own file, or from the last whole one and the changes since.
    ///
    /// # Errors
    /// A frame that is not there; a file that is not what was written.
    pub fn layer(&self, ctx: &Context, frame: i32) -> Result<Grids> {
        let whole = (0..)
            .map(|back| frame - back)
            .find(|&f| self.done.get(&f).is_none_or(|manifest| manifest.keeps != Keeps::Changes));
        let whole = whole.filter(|whole| self.is_done(*whole));
        let whole = whole.ok_or_else(|| {
            Error::file(&self.folder, format!("frame {frame} cannot be had from its files"))
        })?;
        let mut grids = self.grids(whole)?;
        for later in whole + 1..=frame {
            self.follow(ctx, &mut grids, later)?;
        }
        Ok(grids)
    }

    /// Takes a layer from the frame before to a frame that keeps its changes.
    fn follow(&self, ctx: &Context, grids: &mut Grids, frame: i32) -> Result<()> {
        ctx.check()?;
        grids.apply_delta(ctx, &self.grids(frame)?)
    }

    fn grids(&self, frame: i32) -> Result<Grids> {
        let missing = || Error::file(&self.folder, format!("frame {frame} is not there"));
        let manifest = self.done.get(&frame).ok_or_else(missing)?;
        let written = match manifest.keeps {
            Keeps::State => manifest.state.as_ref(),
            Keeps::Whole | Keeps::Changes => manifest.files_of("base").next(),
        };
        let written = written.ok_or_else(missing)?;
        let path = self.folder.join(&written.path);
        if let Some(fault) = written.fault(&self.folder) {
            return Err(Error::file(path, format!("{fault}: remove it, and it is made again")));
        }
        read_grids(&path)
    }
}

/// The whole layers of a cache, one frame after another.
pub struct Rebuild {
    stored: Stored,
    at: Option<(i32, Grids)>,
}

impl Rebuild {
    /// Opens a cache.
    ///
    /// # Errors
    /// As [`Stored::read`].
    pub fn open(folder: &Path) -> Result<Self> {
        Ok(Self { stored: Stored::read(folder)?, at: None })
    }

    /// The frames that are there.
    pub fn stored(&self) -> &Stored {
        &self.stored
    }

    /// The layer after a frame; frames in ascending order cost one file each.
    ///
    /// # Errors
    /// As [`Stored::layer`].
    pub fn layer(&mut self, ctx: &Context, frame: i32) -> Result<&Grids> {
        let keeps = self.stored.manifest(frame).map(|manifest| manifest.keeps);
        let grids = match self.at.take() {
            Some((before, mut grids)) if before == frame - 1 && keeps == Some(Keeps::Changes) => {
                self.stored.follow(ctx, &mut grids, frame)?;
                grids
            }
            _ => self.stored.layer(ctx, frame)?,
        };
        Ok(&self.at.insert((frame, grids)).1)
    }
}

/// The exact layer after a frame whose own files cannot be gone on from.
pub(super) fn state_path(folder: &Path, frame: i32) -> PathBuf {
    folder.join("state").join(format!("{STAGE}.{frame:04}.vdb"))
}

fn read_grids(path: &Path) -> Result<Grids> {
    Grids::from_named(file::read_own(path)?).map_err(|error| match error {
        Error::Argument(what) => Error::file(path, what),
        other => other,
    })
}
