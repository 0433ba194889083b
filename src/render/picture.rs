//! A finished picture and its PNG file.

use super::camera::Size;
use crate::error::{Error, Result};
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use std::path::Path;

/// 8-bit red, green, blue, row by row from the upper left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width and height.
    pub size: Size,
    /// `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Writes a PNG file, whole or not at all.
    ///
    /// # Errors
    /// What the system refuses.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut bytes = Vec::new();
        PngEncoder::new(&mut bytes)
            .write_image(&self.rgb, self.size.width, self.size.height, image::ExtendedColorType::Rgb8)
            .map_err(|error| Error::file(path, format!("cannot be made a PNG: {error}")))?;
        crate::io::atomic::write_bytes(path, &bytes)
    }
}
