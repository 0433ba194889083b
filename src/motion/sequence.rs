//! A mesh per frame: vertices move straight from frame to frame.

use std::sync::{Arc, Mutex, OnceLock};

use super::drawn::Faces;
use super::{Drawn, Motion, between};
use crate::error::{Error, Result};
use crate::geometry::{DVec3, PolygonMesh, Vec3};
use crate::io::files::sequence::Pattern;
use crate::io::mesh;
use crate::io::records::input_hashes::InputHashes;

/// Frames kept in memory: the two around the current time.
const KEPT: usize = 2;

/// A sequence of mesh files with the same faces, read on demand.
pub struct MeshSequence {
    pattern: Pattern,
    first: i32,
    last: i32,
    fps: f64,
    /// Shot frame = file frame + offset.
    offset: f64,
    /// Polygons of the first frame, with their texture coordinates: all frames have these faces.
    polygons: PolygonMesh,
    faces: Faces,
    /// Contents of the files when they were read.
    input_hashes: Arc<InputHashes>,
    /// Subtracted from positions as they are read (the files' unit).
    origin: DVec3,
    /// Whether the frame after the last exists and can be read: the velocities ahead at the last frame need it.
    continues: OnceLock<bool>,
    kept: Mutex<Vec<(i32, Arc<Vec<Vec3>>)>>,
}

impl MeshSequence {
    /// Frames `first..=last` of a pattern at `fps` frames per second, `offset` frames late; constant before and after.
    ///
    /// # Errors
    /// A frame that is missing (named), or a first frame that cannot be read.
    pub fn open(pattern: Pattern, first: i32, last: i32, fps: f64, offset: f64) -> Result<Self> {
        Self::open_with_hashes(pattern, first, last, fps, offset, Arc::default(), DVec3::zeros())
    }

    /// As [`MeshSequence::open`]; `input_hashes` records the contents of the files when they were read; `origin` (the files' unit and axes) is
    /// subtracted from positions.
    ///
    /// # Errors
    /// As [`MeshSequence::open`]; later, from a pose, a file that has changed.
    pub fn open_with_hashes(
        pattern: Pattern,
        first: i32,
        last: i32,
        fps: f64,
        offset: f64,
        input_hashes: Arc<InputHashes>,
        origin: DVec3,
    ) -> Result<Self> {
        if let Some(missing) = (first..=last).map(|frame| pattern.path(frame)).find(|path| !path.is_file()) {
            return Err(Error::file(missing, "the frame is missing from the sequence"));
        }
        let first_path = pattern.path(first);
        let mut polygons = mesh::parse_polygons_from(&first_path, &input_hashes.read(&first_path)?, origin)?;
        let (faces, positions) = Faces::new(polygons.clone());
        polygons.uvs = None;
        let kept = Mutex::new(vec![(first, Arc::new(positions))]);
        let continues = OnceLock::new();
        Ok(Self { pattern, first, last, fps, offset, polygons, faces, input_hashes, origin, continues, kept })
    }

    fn frame(&self, frame: i32) -> Result<Arc<Vec<Vec3>>> {
        let known = |kept: &[(i32, Arc<Vec<Vec3>>)]| {
            kept.iter().find(|(number, _)| *number == frame).map(|(_, positions)| positions.clone())
        };
        if let Some(positions) = known(&self.kept.lock().expect("no panic while it is locked")) {
            return Ok(positions);
        }
        // Read without holding the lock: several frames may be read at once.
        let positions = Arc::new(self.read(frame)?);
        let mut kept = self.kept.lock().expect("no panic while it is locked");
        if known(&kept).is_none() {
            kept.push((frame, positions.clone()));
            if kept.len() > KEPT {
                kept.remove(0);
            }
        }
        Ok(positions)
    }

    fn read(&self, frame: i32) -> Result<Vec<Vec3>> {
        let path = self.pattern.path(frame);
        let mesh = mesh::parse_polygons_from(&path, &self.input_hashes.read(&path)?, self.origin)?;
        if !mesh.has_faces_of(&self.polygons) {
            let count = |of: &PolygonMesh| [of.positions.len(), of.ends.len()];
            let ([vertices, faces], [own, own_faces]) = (count(&self.polygons), count(&mesh));
            let first = self.pattern.path(self.first);
            let what = format!(
                "has {own} vertices and {own_faces} faces, not those of {} ({vertices} and {faces}): a sequence must keep its faces",
                first.display()
            );
            return Err(Error::file(path, what));
        }
        Ok(mesh.positions)
    }

    /// Last frame with a pose.
    fn end(&self) -> i32 {
        let continues = self.continues.get_or_init(|| {
            let Some(next) = self.last.checked_add(1).filter(|next| self.pattern.path(*next).is_file())
            else {
                return false;
            };
            let read = self.frame(next);
            if let Err(error) = &read {
                log::warn!("{error}; the last frame has the velocities of the one before");
            }
            read.is_ok()
        });
        self.last + i32::from(*continues)
    }
}

impl Motion for MeshSequence {
    fn triangles(&self) -> &[[u32; 3]] {
        self.faces.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.faces.used.count
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.drawn_pose(time, out)?;
        self.faces.used.keep(out);
        Ok(())
    }

    fn drawn(&self) -> Drawn<'_> {
        self.faces.drawn()
    }

    fn drawn_pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let frame = time * self.fps - self.offset;
        // The frame after the last is read only when it is needed.
        let last = if frame > f64::from(self.last) + 1e-6 { self.end() } else { self.last };
        let frame = frame.clamp(f64::from(self.first), f64::from(last));
        // Times come from integer frames divided by fps: rounding must not require a neighbour.
        let frame = if (frame - frame.round()).abs() < 1e-6 { frame.round() } else { frame };
        let (below, part) = (frame.floor() as i32, frame - frame.floor());
        let a = self.frame(below)?;
        let b = if part == 0.0 { a.clone() } else { self.frame(below + 1)? };
        between(&a, &b, part, out);
        Ok(())
    }

    fn ends_before(&self, time: f64) -> bool {
        let frame = time * self.fps - self.offset;
        frame > f64::from(self.last) && frame > f64::from(self.end())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let file = |time: f64| time * self.fps - self.offset;
        let first = (file(from) + 1e-6).floor() as i64 + 1;
        let last = (file(to) - 1e-6).ceil() as i64 - 1;
        let within = first.max(i64::from(self.first))..=last.min(i64::from(self.last));
        within.map(|frame| (frame as f64 + self.offset) / self.fps).collect()
    }
}
