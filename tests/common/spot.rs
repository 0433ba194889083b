//! `spot_drop` of the test data: a viscous liquid of a real solver, and a detailed mesh at its first frame.

use std::path::{Path, PathBuf};

use frazil::geometry::TriMesh;
use frazil::geometry::points::Values;
use frazil::io::{mesh, particles};
use frazil::surface::Particles;

use super::character::data;

/// Its frames.
pub const FRAMES: i32 = 41;
/// Frames per second.
pub const FPS: f64 = 25.0;
/// The initial distance of its particles (m).
pub const SPACING: f64 = 0.008_620_6;

/// The file of the first frame, if the data is there.
pub fn first() -> Option<PathBuf> {
    data("particles/spot_drop/spot.0001.bgeo")
}

/// The particles of a frame, by the file of any.
pub fn particles_at(file: &Path, frame: i32) -> Particles {
    read(&file.with_file_name(format!("spot.{frame:04}.bgeo")))
}

/// The particles of a file of a cache.
pub fn read(path: &Path) -> Particles {
    let cloud = particles::read(path).expect("particles");
    let ids = match cloud.attribute("id") {
        Some(Values::Long(column)) => (0..cloud.positions.len()).map(|n| column.get(n)).collect(),
        Some(Values::Int(column)) => (0..cloud.positions.len()).map(|n| column.get(n).into()).collect(),
        _ => panic!("the particles have no ids"),
    };
    Particles { ids, positions: cloud.positions, velocities: Vec::new() }
}

/// The sculpted mesh, by the file of any frame.
pub fn sculpted(file: &Path) -> TriMesh {
    mesh::read(&file.with_file_name("spot_detail.ply")).expect("a mesh")
}
