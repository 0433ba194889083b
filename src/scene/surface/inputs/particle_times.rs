//! The particles of a sequence at the frames of a shot: the sequence may start later, and run faster or slower.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::geometry::points::Values;
use crate::io::files::source;
use crate::io::mesh::extension;
use crate::io::particles::{self, ParticleData};
use crate::io::records::input_hashes::InputHashes;
use crate::scene::Shot;
use crate::scene::surface::Surface;
use crate::surface::{Particles, interpolate};
use crate::vdb::changes::{changes_since, partial};
use crate::vdb::points;

/// Names of velocities and of ids in files, in lower case.
const VELOCITIES: [&str; 4] = ["v", "vel", "velocity", "velocities"];
const IDS: [&str; 4] = ["id", "ids", "particle_id", "particleid"];

/// The points of a particle file, in its own space.
///
/// # Errors
/// A file that cannot be read, or that holds only the changes since another frame.
pub fn read_points(path: &Path, input_hashes: &InputHashes) -> Result<ParticleData> {
    if extension(path) != "vdb" {
        return particles::parse(path, &input_hashes.read(path)?);
    }
    source::open(path)?;
    input_hashes.read_with(path, || match changes_since(path)? {
        Some(since) => Err(Error::file(path, partial(since))),
        None => Ok(points::read(path, None)?.into()),
    })
}

/// The particles of a file (m, m/s).
///
/// # Errors
/// As [`read_points`]; values that are not finite, two particles with the same id.
pub(in crate::scene::surface) fn read(
    path: &Path,
    surface: &Surface,
    input_hashes: &InputHashes,
) -> Result<Particles> {
    let data = read_points(path, input_hashes)?;
    let named = |names: &'static [&str]| {
        let is_named = |name: &str| names.contains(&&*name.to_lowercase());
        data.attributes
            .iter()
            .filter(move |attribute| is_named(&attribute.name))
            .map(|attribute| &attribute.values)
    };
    let (count, space) = (data.positions.len(), surface.space);
    let converted = |speed: [f32; 3]| space.vector(DVec3::from(speed.map(f64::from))).cast::<f32>().into();
    let velocities = named(&VELOCITIES).find_map(|values| match values {
        Values::Vector(column) => Some((0..count).map(|point| converted(column.get(point))).collect()),
        _ => None,
    });
    let ids = named(&IDS).find_map(|values| match values {
        Values::Long(column) => Some((0..count).map(|point| column.get(point)).collect()),
        Values::Int(column) => Some((0..count).map(|point| column.get(point).into()).collect()),
        _ => None,
    });
    let positions = data.positions.iter().map(|position| space.position(*position)).collect();
    let (velocities, ids) = (velocities.unwrap_or_default(), ids.unwrap_or_default());
    let particles = Particles { positions, velocities, ids };
    particles.validate().map_err(|error| Error::file(path, error.to_string()))?;
    Ok(particles)
}

/// The particles of a shot, read on demand.
pub(in crate::scene::surface) struct Liquid<'a> {
    surface: &'a Surface,
    shot: Shot,
    input_hashes: &'a InputHashes,
    /// The particles of the files that were read last, with the files' numbers.
    cache: Vec<(i32, Arc<Particles>)>,
}

/// Maximum count of files in memory: those before and after two frames.
pub(in crate::scene::surface) const CACHED_FILES: usize = 4;

impl<'a> Liquid<'a> {
    pub fn new(surface: &'a Surface, shot: Shot, input_hashes: &'a InputHashes) -> Self {
        Self { surface, shot, input_hashes, cache: Vec::new() }
    }

    /// The times (frames of the sequence) at which the steps from the previous frame to this one begin and end. Every file in between ends
    /// a step, so that no motion is skipped.
    pub fn step_times(&self, frame: i32) -> Vec<f64> {
        let time = |frame: i32| self.surface.time(self.shot.frames, frame);
        let (from, to) = (time(frame - 1), time(frame));
        let between = (from.floor() as i32 + 1..to.ceil() as i32).map(f64::from);
        std::iter::once(from).chain(between).chain([to]).collect()
    }

    /// Time between two frames of the sequence (s).
    pub fn file_time(&self) -> f64 {
        1.0 / self.shot.fps
    }

    /// The particles at a time (frames of the sequence).
    ///
    /// # Errors
    /// A file that cannot be read; a time between two files that have neither ids nor velocities.
    pub fn at(&mut self, time: f64) -> Result<Arc<Particles>> {
        let (below, share) = (time.floor(), time - time.floor());
        let from = self.file(below as i32)?;
        if share == 0.0 {
            return Ok(from);
        }
        let to = self.file(below as i32 + 1)?;
        interpolate(&from, &to, self.file_time(), share)
            .map(Arc::new)
            .map_err(|error| self.with_path(below, error))
    }

    /// Adds to an error the file of the particles at a time.
    pub fn with_path(&self, time: f64, error: Error) -> Error {
        error.in_file(self.path(time.floor() as i32))
    }

    fn path(&self, file: i32) -> PathBuf {
        self.surface.files(f64::from(file), f64::from(file)).swap_remove(0)
    }

    fn file(&mut self, file: i32) -> Result<Arc<Particles>> {
        if let Some((_, particles)) = self.cache.iter().find(|(number, _)| *number == file) {
            return Ok(particles.clone());
        }
        let particles = Arc::new(read(&self.path(file), self.surface, self.input_hashes)?);
        if self.cache.len() == CACHED_FILES {
            self.cache.remove(0);
        }
        self.cache.push((file, particles.clone()));
        Ok(particles)
    }
}
