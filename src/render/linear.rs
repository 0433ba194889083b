//! Pictures for compositing, and their OpenEXR files.

use std::io::Cursor;

use exr::meta::attribute::Text;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, SmallVec, WritableImage, f16,
};

use super::camera::Size;
use crate::error::{Error, Result};

/// A picture of linear light without a background, row by row from the upper left.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPicture {
    /// Width and height.
    pub size: Size,
    /// `width * height` pixels.
    pub pixels: Vec<LinearPixel>,
}

/// A pixel of a [`LinearPicture`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearPixel {
    /// Red, green, blue, 0 or more, with the primaries of sRGB, multiplied by the opacity; a white surface that faces the sun has about 2.
    pub light: [f32; 3],
    /// Opacity, 0 to 1: the share of the background that is hidden.
    pub alpha: f32,
    /// Depth along the view direction of the nearest surface or point in the pixel (m), infinity without any. Fog has no depth.
    pub depth: f32,
}

impl LinearPixel {
    /// Nothing.
    pub const EMPTY: Self = Self { light: [0.0; 3], alpha: 0.0, depth: f32::INFINITY };
}

impl LinearPicture {
    /// Memory of a pixel, of its channels while they are packed, and of the file (bytes).
    pub(super) const BYTES_PER_PIXEL: u64 = 20 + 12 + 12;

    /// The bytes of an OpenEXR file: channels R, G, B and A in 16 bits, Z in 32, scan lines packed without loss (ZIP). They are the same
    /// with any number of threads.
    ///
    /// # Errors
    /// A pixel count that does not match the size.
    pub fn exr(&self) -> Result<Vec<u8>> {
        let refused = |what: String| Error::argument(format!("a picture cannot be made an EXR: {what}"));
        let Size { width, height } = self.size;
        let size = (width as usize, height as usize);
        if self.pixels.is_empty() || self.pixels.len() != size.0 * size.1 {
            return Err(refused(format!("{} pixels are not {width}x{height}", self.pixels.len())));
        }
        let half = |value: fn(&LinearPixel) -> f32| {
            FlatSamples::F16(self.pixels.iter().map(|pixel| f16::from_f32(value(pixel))).collect())
        };
        let depths = FlatSamples::F32(self.pixels.iter().map(|pixel| pixel.depth).collect());
        let channels = [
            ("R", half(|pixel| pixel.light[0])),
            ("G", half(|pixel| pixel.light[1])),
            ("B", half(|pixel| pixel.light[2])),
            ("A", half(|pixel| pixel.alpha)),
            ("Z", depths),
        ];
        let channels = channels.into_iter().map(|(name, samples)| AnyChannel::new(name, samples));
        let channels = AnyChannels::sort(channels.collect::<SmallVec<[_; 4]>>());
        let attributes = LayerAttributes {
            software_name: Some(Text::from(concat!("frazil ", env!("CARGO_PKG_VERSION")))),
            ..LayerAttributes::default()
        };
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let mut bytes = Cursor::new(Vec::new());
        let image = Image::from_layer(Layer::new(size, attributes, encoding, channels));
        image.write().non_parallel().to_buffered(&mut bytes).map_err(|error| refused(error.to_string()))?;
        Ok(bytes.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_of_another_size_is_refused() {
        let size = Size { width: 2, height: 3 };
        let error = LinearPicture { size, pixels: vec![LinearPixel::EMPTY; 5] }.exr().unwrap_err();
        assert_eq!(error.to_string(), "a picture cannot be made an EXR: 5 pixels are not 2x3");
        let bytes = LinearPicture { size, pixels: vec![LinearPixel::EMPTY; 6] }.exr().unwrap();
        assert_eq!(bytes[..4], [0x76, 0x2f, 0x31, 0x01]);
    }
}
