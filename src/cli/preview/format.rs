//! The file formats of single pictures.

use std::path::Path;

use frazil::io::files::atomic;
use frazil::io::mesh::extension;

/// The file format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// As it looks on a screen, in 8 bits.
    Png,
    /// For compositing: linear light, opacity, depth.
    Exr,
}

impl PictureFormat {
    /// The format by a file's name; a device or a pipe gets a PNG. `None` for other names.
    pub fn of(path: &Path) -> Option<Self> {
        match extension(path).as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            _ if atomic::is_stream(path) => Some(Self::Png),
            _ => None,
        }
    }
}
