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

/// Width (pixels) and grey of the line between two pictures.
const LINE_WIDTH: u32 = 2;
const LINE_GREY: u8 = 24;

impl Picture {
    /// This picture and another to its right, with a dark line of 2 pixels between them.
    ///
    /// # Errors
    /// Heights that differ.
    pub fn beside(&self, right: &Self) -> Result<Self> {
        let (a, b) = (self.size, right.size);
        if a.height != b.height {
            return Err(Error::argument(format!(
                "pictures of {} and {} rows do not go together",
                a.height, b.height
            )));
        }
        let row = |picture: &Self, y: u32| {
            let bytes = 3 * picture.size.width as usize;
            picture.rgb[y as usize * bytes..][..bytes].to_vec()
        };
        let line = vec![LINE_GREY; 3 * LINE_WIDTH as usize];
        let rgb = (0..a.height).flat_map(|y| [row(self, y), line.clone(), row(right, y)].concat()).collect();
        Ok(Self { size: Size { width: a.width + LINE_WIDTH + b.width, height: a.height }, rgb })
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_one_height_go_beside_each_other() {
        let uniform = |width, height, grey| {
            let size = Size { width, height };
            Picture { size, rgb: vec![grey; 3 * (width * height) as usize] }
        };
        let both = uniform(1, 2, 100).beside(&uniform(2, 2, 200)).unwrap();
        assert_eq!(both.size, Size { width: 5, height: 2 });
        let row: Vec<u8> =
            [100, LINE_GREY, LINE_GREY, 200, 200].into_iter().flat_map(|grey| [grey; 3]).collect();
        assert_eq!(both.rgb, row.repeat(2));
        assert!(uniform(1, 2, 0).beside(&uniform(1, 3, 0)).is_err());
    }
}
