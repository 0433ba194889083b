//! Reads the grains of a frame from the files of the stage `grains`: from .vdb files, complete or with the changes of a frame, or from USD.

use std::path::Path;

use super::grain_files::{BEFORE_HASH, GONE, NAME, apply_changes, hash_of, ids_of, ordered, previous_record};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::points::{Points, Values};
use crate::io::particles::{self, ParticleData};
use crate::io::usd::BINARY;
use crate::scene::run::DoneFrames;
use crate::vdb::changes::CHANGES_SINCE_KEY;
use crate::vdb::file::{self, WriteOptions};
use crate::vdb::{MetaValue, points};

/// Reads complete grains from a cache, frame by frame.
pub struct RebuildGrains {
    stored: DoneFrames,
    reader: GrainReader,
}

impl RebuildGrains {
    /// Opens a cache.
    ///
    /// # Errors
    /// As [`DoneFrames::read`].
    pub fn open(folder: &Path) -> Result<Self> {
        Ok(Self { stored: DoneFrames::read(folder, NAME)?, reader: GrainReader::default() })
    }

    /// The stored frames.
    pub fn stored(&self) -> &DoneFrames {
        &self.stored
    }

    /// The bytes of a frame's file as `grains_mode = "full"` writes it, except for the hash of the settings in its metadata.
    /// If frames ascend from call to call, none is read twice.
    ///
    /// # Errors
    /// A frame that does not exist; a file that was changed since it was written; cancel.
    pub fn bytes(&mut self, ctx: &Context, frame: i32, options: &WriteOptions) -> Result<Vec<u8>> {
        let (points, mut metadata) = self.reader.points(ctx, &self.stored, frame)?;
        metadata.retain(|(key, _)| {
            key.starts_with("frazil:") && ![CHANGES_SINCE_KEY, GONE, BEFORE_HASH].contains(&&key[..])
        });
        points::to_bytes(ctx, NAME, points, &WriteOptions { metadata, ..options.clone() })
    }

    /// The grains after a frame, sorted by identity. If frames ascend from call to call, none is read twice.
    ///
    /// # Errors
    /// As [`RebuildGrains::bytes`].
    pub fn points(&mut self, ctx: &Context, frame: i32) -> Result<&Points> {
        Ok(self.reader.points(ctx, &self.stored, frame)?.0)
    }
}

/// Reads complete grains frame by frame, and keeps the last ones, so that the next frame reads only its changes.
#[derive(Default)]
pub(in crate::scene::snow) struct GrainReader {
    last: Option<(i32, Points)>,
}

/// Metadata of a file.
type Metadata = Vec<(String, MetaValue)>;

impl GrainReader {
    /// The grains after a frame, sorted by identity, with the metadata of its file. If frames ascend from call to call, none is read
    /// twice.
    ///
    /// # Errors
    /// A frame that does not exist; a file that was changed since it was written; cancel.
    pub fn points(&mut self, ctx: &Context, stored: &DoneFrames, frame: i32) -> Result<(&Points, Metadata)> {
        let (mut later, mut metadata, mut at) = (Vec::new(), None, frame);
        let mut points = loop {
            ctx.check()?;
            if let Some((_, points)) = self.last.take_if(|(last, _)| *last == at && at < frame) {
                break points;
            }
            let (points, file_metadata) = read(stored, at)?;
            let record = previous_record(at, &file_metadata).map_err(|error| in_frame(stored, at, error))?;
            metadata.get_or_insert(file_metadata);
            match record {
                None => break points,
                Some((gone, before_hash)) => later.push((at, points, gone, before_hash)),
            }
            at -= 1;
        };
        for (at, changed, gone, before_hash) in later.into_iter().rev() {
            if before_hash.is_some_and(|before_hash| before_hash != hash_of(&points)) {
                return Err(in_frame(stored, at, Error::argument("holds changes of other grains")));
            }
            points = apply_changes(points, changed, &gone).map_err(|error| in_frame(stored, at, error))?;
        }
        Ok((&self.last.insert((frame, points)).1, metadata.unwrap_or_default()))
    }

    /// The grains after a frame as other stages read them, sorted by identity: with positions in 32 bits, as USD has them, so that it does
    /// not matter which files hold them.
    ///
    /// # Errors
    /// As [`GrainReader::points`]; a frame with neither a .vdb nor a binary USD file.
    pub fn particles(&mut self, ctx: &Context, stored: &DoneFrames, frame: i32) -> Result<ParticleData> {
        if !stored.has_file(frame, NAME, "vdb") {
            return read_usd(stored, frame);
        }
        let (points, _) = self.points(ctx, stored, frame)?;
        let rounded = |point: usize| points.position(point).cast::<f32>().cast::<f64>();
        Ok(ParticleData {
            positions: (0..points.count()).map(rounded).collect(),
            attributes: points.attributes.clone(),
            voxel_size: Some(points.voxel_size),
        })
    }
}

fn in_frame(stored: &DoneFrames, frame: i32, error: Error) -> Error {
    error.in_file_at(stored.folder(), format!("frame {frame} of grains "))
}

/// The points of a frame's file, with its metadata.
fn read(stored: &DoneFrames, frame: i32) -> Result<(Points, Metadata)> {
    let path = stored.file_with(frame, NAME, "vdb")?;
    let points = ordered(points::read_own(&path, None)?);
    check_ids(&path, points.count(), points.attribute("id"))?;
    Ok((points, file::metadata(&path)?))
}

/// The grains of a frame's USD file.
fn read_usd(stored: &DoneFrames, frame: i32) -> Result<ParticleData> {
    let path = stored.file_with(frame, NAME, BINARY)?;
    let grains = particles::read(&path)?;
    check_ids(&path, grains.positions.len(), grains.attribute("id"))?;
    Ok(grains)
}

/// Fails unless `count` grains of a file have identities that ascend.
fn check_ids(path: &Path, count: usize, ids: Option<&Values>) -> Result<()> {
    let ids = ids_of(count, ids);
    if ids.len() != count || !ids.is_sorted_by(|one, next| one < next) {
        return Err(Error::file(path, "has grains that share an identity or have none (id)"));
    }
    Ok(())
}
