//! The parts of a picture, and folders that they are read from.

use std::path::{Path, PathBuf};

use frazil::geometry::{DVec3, DetailedMesh, Points, TriMesh};
#[cfg(feature = "vdb")]
use frazil::vdb::FloatGrid;
use frazil::{Context, Error, Result, io};

/// A part of a picture, as read.
pub enum Part {
    /// A mesh with its arrays.
    Mesh(DetailedMesh),
    /// The surface of a liquid, with its opacities `alpha`, and the kind of liquid.
    Liquid(DetailedMesh, LiquidLook),
    /// The ground below a liquid, with the stains on its vertices, 0 to 1, and the liquid that left them; stains are optional.
    Ground(TriMesh, Vec<f64>, LiquidLook),
    /// A moving solid in a liquid: a tool or an obstacle.
    Obstacle(TriMesh),
    /// An obstacle from a mesh file, which does not move; drawn as linen.
    StaticMesh(TriMesh),
    /// Points, and the file that they came from.
    Points(PathBuf, Points),
    /// A level set.
    #[cfg(feature = "vdb")]
    Surface(FloatGrid),
    /// A fog volume, and its file.
    #[cfg(feature = "vdb")]
    Fog(PathBuf, FloatGrid),
}

/// The output folder of a shot, read frame by frame.
pub trait Folder: Send {
    /// Its path.
    fn path(&self) -> &Path;

    /// The frames that all of its stages have, ascending; at least one.
    fn frames(&self) -> &[i32];

    /// The names of its stages.
    fn stages(&self) -> Vec<&str>;

    /// Its frame rate, from its scene.
    ///
    /// # Errors
    /// A scene that cannot be read.
    fn fps(&self) -> Result<f64>;

    /// Reads the contents of a frame. If frames are read in ascending order, each needs only one file of each stage.
    ///
    /// # Errors
    /// A file that cannot be read or that differs from what was written; cancel.
    fn read(&mut self, ctx: &Context, frame: i32) -> Result<Vec<Part>>;

    /// The lowest and the highest corner (m) of what a picture should show, over the whole shot; `None` if that is everything.
    fn focus(&mut self) -> Option<[DVec3; 2]> {
        None
    }

    /// Refuses a frame that one of its stages lacks.
    ///
    /// # Errors
    /// Lists the frames that exist.
    fn refuse_missing(&self, frame: i32) -> Result<()> {
        let frames = self.frames();
        if frames.binary_search(&frame).is_ok() {
            return Ok(());
        }
        let (count, first, last) = (frames.len(), frames[0], frames[frames.len() - 1]);
        let what = format!(
            "frame {frame} does not exist: the folder holds {count} frames, {first} to {last}, of {}",
            self.stages().join(" and ")
        );
        Err(Error::file(self.path(), what))
    }
}

/// The look of a liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidLook {
    pub name: &'static str,
    /// Linear red, green, blue.
    pub colour: [f32; 3],
    /// The depth that absorbs 63 % of the light (m).
    pub depth: f64,
}

impl LiquidLook {
    pub const WATER: Self = Self { name: "water", colour: [0.02, 0.16, 0.20], depth: 0.05 };
    pub const BLOOD: Self = Self { name: "blood", colour: [0.30, 0.008, 0.006], depth: 0.0004 };
    const PAINT: Self = Self { name: "paint", colour: [0.05, 0.20, 0.60], depth: 0.0002 };
    const HONEY: Self = Self { name: "honey", colour: [0.70, 0.32, 0.02], depth: 0.012 };
    pub const MILK: Self = Self { name: "milk", colour: [0.86, 0.84, 0.78], depth: 0.0004 };
    const COFFEE: Self = Self { name: "coffee", colour: [0.045, 0.013, 0.004], depth: 0.0012 };
    /// The looks of dyes.
    pub const DYES: [Self; 5] = [Self::BLOOD, Self::PAINT, Self::HONEY, Self::MILK, Self::COFFEE];

    /// The look of a scene's `liquid`: water, paint or honey; blood for any other name.
    pub fn of(name: &str) -> Self {
        let known = [Self::WATER, Self::PAINT, Self::HONEY].into_iter().find(|known| known.name == name);
        known.unwrap_or(Self::BLOOD)
    }
}

/// Reads points of a file other than .vdb.
///
/// # Errors
/// A file that cannot be read.
pub fn points_of(path: &Path) -> Result<Part> {
    let data = io::particles::read(path)?;
    let voxel = data.voxel_size.unwrap_or(0.01);
    let points = data.into_points(Some(voxel)).map_err(|error| Error::file(path, error.to_string()))?;
    Ok(Part::Points(path.to_path_buf(), points))
}
