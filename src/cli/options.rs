//! Options that several commands share, and the syntax of their values.

use frazil::Result;
use frazil::geometry::mesh::weld::Weld;
use frazil::geometry::mesh::{BY_OPTION, coarse_warning};
use frazil::geometry::{DVec3, PolygonMesh, TriMesh};
use frazil::io::files::sequence::Pattern;
use frazil::motion::{Space, Up};
use frazil::render::Size;
use frazil::scene::{FrameChoice, Frames};
use std::path::{Path, PathBuf};

use super::session::Failure;

/// Conversion of a file's space to metres with Y up.
#[derive(clap::Args)]
pub struct MeshSpace {
    /// Factor from the file's unit to metres.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = positive)]
    pub scale: f64,
    /// The file's upward axis.
    #[arg(long, value_name = "AXIS", default_value = "y")]
    pub up: Axis,
    #[command(flatten)]
    pub origin: Origin,
}

/// The origin that is subtracted from a file's coordinates.
#[derive(clap::Args)]
pub struct Origin {
    /// A position in the file's unit and axes that becomes the origin; it is subtracted in 64 bits.
    #[arg(id = "origin", long = "origin", value_name = "X,Y,Z", default_value = "0,0,0", value_parser = triple, allow_hyphen_values = true)]
    pub at: DVec3,
}

/// An upward axis.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Axis {
    /// As in frazil, Houdini, Maya.
    Y,
    /// As in Blender, 3ds Max.
    Z,
}

impl MeshSpace {
    /// As the library's [`Space`].
    pub fn space(&self) -> Space {
        let up = match self.up {
            Axis::Y => Up::Y,
            Axis::Z => Up::Z,
        };
        Space { scale: self.scale, up, origin: self.origin.at }
    }

    /// Reads a mesh and converts it to metres, Y up.
    pub fn read(&self, path: &Path) -> Result<TriMesh> {
        let mut mesh = self.origin.read(path)?.into_triangles();
        self.convert(&mut mesh);
        Ok(mesh)
    }

    /// Converts a mesh that was read relative to the origin to metres, Y up.
    pub fn convert(&self, mesh: &mut TriMesh) {
        let space = self.space();
        if space.scale != 1.0 {
            join_corners(mesh);
        }
        mesh.positions.iter_mut().for_each(|position| *position = space.vector(position.cast()).cast());
    }
}

impl Origin {
    /// Reads the polygons of a mesh relative to the origin.
    pub fn read(&self, path: &Path) -> Result<PolygonMesh> {
        frazil::io::mesh::read_polygons_from(path, self.at)
    }
}

/// Warns about a mesh, as it was read, whose coordinates are too large for 32 bits.
pub fn warn_if_far(path: &Path, mesh: &TriMesh) {
    if mesh.positions.is_empty() {
        return;
    }
    if let Some(what) = coarse_warning(&path.display().to_string(), mesh, BY_OPTION) {
        log::warn!("{what}");
    }
}

/// Moves the vertices of a corner to one position. This must precede scaling, which adds rounding errors.
pub fn join_corners(mesh: &mut TriMesh) {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    Weld::of(&positions, &mesh.triangles).unify(&mut mesh.positions);
}

/// Warns about ambiguous corners of a file's mesh.
#[cfg(feature = "vdb")]
pub fn warn_of_corners(path: &Path, mesh: &TriMesh) {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    if let Some(what) = Weld::of(&positions, &mesh.triangles).warning() {
        log::warn!("{}: {what}", path.display());
    }
}

/// The file of a frame: a single file is that of all frames.
pub fn frame_path(path: &Path, frame: i32) -> PathBuf {
    Pattern::parse(path).map_or_else(|| path.to_path_buf(), |pattern| pattern.path(frame))
}

/// Frame 1, the default if no frames are chosen.
pub fn one_frame() -> FrameChoice {
    FrameChoice::from(Frames { first: 1, last: 1 })
}

/// The error for a sequence whose frames are not chosen.
pub fn needs_frames(sequence: &Path) -> Failure {
    Failure::of_file(sequence, "a sequence needs --frames A-B")
}

/// Refuses to write several frames to one file instead of a pattern such as `example`.
pub fn refuse_one_file(path: &Path, frames: &FrameChoice, example: &str) -> std::result::Result<(), Failure> {
    if Pattern::parse(path).is_some() || frames.count() <= 1 {
        return Ok(());
    }
    Err(Failure::of_file(path, format!("several frames need a pattern such as {example}")))
}

/// A picture's size: `1280x720`.
pub fn size(text: &str) -> std::result::Result<Size, String> {
    let wrong = || "write a size such as 1280x720, at most 16384 pixels each way".to_string();
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let pixels = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=16_384).contains(n)).ok_or_else(wrong);
    Ok(Size { width: pixels(width)?, height: pixels(height)? })
}

/// A positive length or factor.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("it must be a number above 0".to_string()),
    }
}

/// A finite number.
pub fn finite(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("it must be a finite number".to_string()),
    }
}

/// `X,Y,Z`.
pub fn triple(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| finite(part.trim()).ok()).collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(DVec3::new(*x, *y, *z)),
        _ => Err("write three numbers, X,Y,Z".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_three_numbers() {
        assert_eq!(triple("1,-2, 0.5"), Ok(DVec3::new(1.0, -2.0, 0.5)));
        assert!(triple("1,2").is_err());
        assert!(triple("1,2,nan").is_err());
    }
}
