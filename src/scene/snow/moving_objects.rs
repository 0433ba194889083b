//! The objects that move through snow, posed for pictures.

use std::sync::Arc;

use super::inputs::motion;
use crate::error::Result;
use crate::geometry::shape::bounds;
use crate::geometry::{DVec3, TriMesh};
use crate::io::records::input_hashes::InputHashes;
use crate::io::usd::to_floats;
use crate::motion::Motion;
use crate::scene::Scene;

/// The moving objects of a scene.
pub struct MovingObjects {
    fps: f64,
    motions: Vec<Box<dyn Motion>>,
}

impl MovingObjects {
    /// Reads their files; of a sequence only the first frame.
    ///
    /// # Errors
    /// A file that is missing or damaged, with its name.
    pub fn read(scene: &Scene) -> Result<Self> {
        let input_hashes = Arc::new(InputHashes::default());
        // Their warnings belong to the run and to `frazil check`.
        let mut warnings = Vec::new();
        let moving = scene.objects.iter().filter(|object| object.role.moves());
        let motions = moving.map(|object| motion(scene, object, &input_hashes, &mut warnings));
        Ok(Self { fps: scene.shot.fps, motions: motions.collect::<Result<_>>()? })
    }

    /// A mesh of each object at a frame, as its file has it.
    ///
    /// # Errors
    /// A pose that cannot be read.
    pub fn at(&self, frame: i32) -> Result<Vec<TriMesh>> {
        let mut pose = Vec::new();
        let meshes = self.motions.iter().map(|motion| {
            motion.drawn_pose(f64::from(frame) / self.fps, &mut pose)?;
            Ok(TriMesh { positions: to_floats(&pose), triangles: motion.drawn().triangles.to_vec() })
        });
        meshes.collect()
    }

    /// The lowest and the highest corner (m) of the objects in some frames; `None` without objects.
    ///
    /// # Errors
    /// A pose that cannot be read.
    pub fn bounds(&self, frames: &[i32]) -> Result<Option<(DVec3, DVec3)>> {
        let (mut pose, mut all) = (Vec::new(), None::<(DVec3, DVec3)>);
        for motion in &self.motions {
            for frame in frames {
                motion.pose(f64::from(*frame) / self.fps, &mut pose)?;
                let (low, high) = bounds(&pose);
                all = Some(all.map_or((low, high), |all| (all.0.inf(&low), all.1.sup(&high))));
            }
        }
        Ok(all)
    }
}
