//! A mesh a frame: vertices move straight from frame to frame.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use super::Motion;
use crate::base::{DVec3, PolygonMesh, Vec3};
use crate::error::{Error, Result};
use crate::io::mesh;
use crate::io::sequence::Pattern;

/// Frames kept in memory: the two around the time that is asked for.
const KEPT: usize = 2;

/// A sequence of mesh files with the same faces, read when they are needed.
pub struct MeshSequence {
    pattern: Pattern,
    first: i32,
    last: i32,
    fps: f64,
    /// Shot frame = file frame + offset.
    offset: f64,
    /// Polygons of the first frame, and their triangles: those of all frames.
    polygons: PolygonMesh,
    triangles: Vec<[u32; 3]>,
    first_path: PathBuf,
    kept: Mutex<Vec<(i32, Arc<Vec<Vec3>>)>>,
}

impl MeshSequence {
    /// Frames `first..=last` of a pattern at `fps` frames a second, `offset` frames late; it rests before and after.
    ///
    /// # Errors
    /// A frame that is missing (named), or a first frame that cannot be read.
    pub fn open(pattern: Pattern, first: i32, last: i32, fps: f64, offset: f64) -> Result<Self> {
        if let Some(missing) = (first..=last).map(|frame| pattern.path(frame)).find(|path| !path.is_file()) {
            return Err(Error::file(missing, "the frame is missing from the sequence"));
        }
        let first_path = pattern.path(first);
        let polygons = mesh::read_polygons(&first_path)?;
        let triangles = polygons.triangles();
        let kept = Mutex::new(vec![(first, Arc::new(polygons.positions.clone()))]);
        Ok(Self { pattern, first, last, fps, offset, polygons, triangles, first_path, kept })
    }

    fn frame(&self, frame: i32) -> Result<Arc<Vec<Vec3>>> {
        let known = |kept: &[(i32, Arc<Vec<Vec3>>)]| {
            kept.iter().find(|(number, _)| *number == frame).map(|(_, positions)| positions.clone())
        };
        if let Some(positions) = known(&self.kept.lock().expect("nobody panics with this lock")) {
            return Ok(positions);
        }
        // Not with the lock held: several frames may be read at once.
        let positions = Arc::new(self.read(frame)?);
        let mut kept = self.kept.lock().expect("nobody panics with this lock");
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
        let mesh = mesh::read_polygons(&path)?;
        if !mesh.has_faces_of(&self.polygons) {
            return Err(Error::file(
                path,
                format!(
                    "has {} vertices and {} faces, not those of {} ({} and {}): a sequence must keep its faces",
                    mesh.positions.len(),
                    mesh.ends.len(),
                    self.first_path.display(),
                    self.polygons.positions.len(),
                    self.polygons.ends.len()
                ),
            ));
        }
        Ok(mesh.positions)
    }
}

impl Motion for MeshSequence {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn vertex_count(&self) -> usize {
        self.polygons.positions.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let frame = (time * self.fps - self.offset).clamp(f64::from(self.first), f64::from(self.last));
        // Times come from whole frames divided by fps: rounding must not ask for a neighbour.
        let frame = if (frame - frame.round()).abs() < 1e-6 { frame.round() } else { frame };
        let (below, part) = (frame.floor() as i32, frame - frame.floor());
        let a = self.frame(below)?;
        out.clear();
        if part == 0.0 {
            out.extend(a.iter().map(|p| p.cast::<f64>()));
        } else {
            let b = self.frame(below + 1)?;
            let between = a.iter().zip(b.iter());
            out.extend(between.map(|(p, q)| p.cast::<f64>().lerp(&q.cast(), part)));
        }
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        let file = |time: f64| time * self.fps - self.offset;
        let first = (file(from) + 1e-6).floor() as i64 + 1;
        let last = (file(to) - 1e-6).ceil() as i64 - 1;
        let within = first.max(i64::from(self.first))..=last.min(i64::from(self.last));
        within.map(|frame| (frame as f64 + self.offset) / self.fps).collect()
    }
}
