//! A finished picture and its PNG file.

use super::camera::Size;
use crate::error::{Error, Result};
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
    /// Writes a PNG file atomically.
    ///
    /// # Errors
    /// As [`Picture::png`]; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let bytes = self.png().map_err(|error| Error::file(path, error.to_string()))?;
        crate::io::files::atomic::write_bytes(path, &bytes)
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// No pixels, or a byte count that does not match the size.
    pub fn png(&self) -> Result<Vec<u8>> {
        self.encoded().map_err(|error| Error::argument(format!("a picture cannot be made a PNG: {error}")))
    }

    fn encoded(&self) -> std::result::Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.size.width, self.size.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(bytes)
    }
}
