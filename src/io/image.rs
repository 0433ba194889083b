//! Greyscale images in PNG files: heights, masks.

use std::io::Cursor;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::files::caught::caught;
use crate::error::{Error, Result, fail_if};

/// Maximum size (bytes) of an image when unpacked: 16,384 x 16,384 pixels with four channels of 16 bits.
const MAX_BYTES: usize = 1 << 31;

/// A greyscale image.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyImage {
    /// Count of pixels across and down.
    pub size: [usize; 2],
    /// Values row by row from the top: 0 is black and 1 is white.
    pub values: Vec<f32>,
    /// Number of grey levels that its file can hold.
    pub levels: u32,
}

/// Reads a greyscale image from the bytes of a .png file: of 1 to 16 bits, or in colour if all pixels are grey; opacity is ignored.
///
/// # Errors
/// A file that is not a PNG, is cut short or damaged, is over 2 GB when unpacked, or has colours.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<GreyImage> {
    fail_if(bytes.is_empty(), || Error::file(path, "the file is empty"))?;
    caught(path, || decode(bytes).map_err(|what| Error::file(path, what)))
}

fn decode(bytes: &[u8]) -> std::result::Result<GreyImage, String> {
    let wrong = |error: png::DecodingError| format!("is not an image that can be read: {error}");
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: MAX_BYTES });
    // Palettes and depths below 8 bits are expanded to 8 bits.
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(wrong)?;
    let levels = 1 << (reader.info().bit_depth as u32).min(16);
    let room = reader.output_buffer_size().filter(|room| *room <= MAX_BYTES);
    let mut pixels = vec![0; room.ok_or("is an image of over 2 GB")?];
    let frame = reader.next_frame(&mut pixels).map_err(wrong)?;
    let pixels = &pixels[..frame.buffer_size()];
    let channels = match frame.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err("has a palette that was not expanded".into()),
    };
    let size = [frame.width as usize, frame.height as usize];
    let values = match frame.bit_depth {
        BitDepth::Sixteen => {
            let numbers = pixels.as_chunks::<2>().0.iter().map(|pair| u16::from_be_bytes(*pair));
            greys(&numbers.collect::<Vec<u16>>(), channels, size, |value| f32::from(value) / 65535.0)
        }
        _ => greys(pixels, channels, size, |value| f32::from(value) / 255.0),
    }?;
    Ok(GreyImage { size, values, levels })
}

/// The grey values of pixels with this many channels.
fn greys<T: Copy + PartialEq>(
    numbers: &[T],
    channels: usize,
    [width, _]: [usize; 2],
    grey: impl Fn(T) -> f32,
) -> std::result::Result<Vec<f32>, String> {
    let is_grey = |pixel: &[T]| channels < 3 || (pixel[0] == pixel[1] && pixel[1] == pixel[2]);
    if let Some(index) = numbers.chunks_exact(channels).position(|pixel| !is_grey(pixel)) {
        let (x, y) = (index % width, index / width);
        return Err(format!("has colours, for instance at pixel ({x}, {y}): heights are greys"));
    }
    Ok(numbers.chunks_exact(channels).map(|pixel| grey(pixel[0])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(color: ColorType, depth: BitDepth, size: [u32; 2], data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    }

    fn read(bytes: &[u8]) -> std::result::Result<GreyImage, String> {
        parse(Path::new("h.png"), bytes).map_err(|error| error.to_string())
    }

    #[test]
    fn greys_of_every_depth_are_from_0_to_1() {
        let eight = read(&png(ColorType::Grayscale, BitDepth::Eight, [3, 1], &[0, 51, 255])).unwrap();
        assert_eq!((eight.size, eight.values, eight.levels), ([3, 1], vec![0.0, 0.2, 1.0], 256));
        let sixteen = png(ColorType::Grayscale, BitDepth::Sixteen, [1, 2], &[255, 255, 0x33, 0x33]);
        let sixteen = read(&sixteen).unwrap();
        assert_eq!((sixteen.size, sixteen.values, sixteen.levels), ([1, 2], vec![1.0, 0.2], 65536));
        let one = read(&png(ColorType::Grayscale, BitDepth::One, [2, 1], &[0b0100_0000])).unwrap();
        assert_eq!((one.values, one.levels), (vec![0.0, 1.0], 2));
        let colour = read(&png(ColorType::Rgba, BitDepth::Eight, [1, 1], &[51, 51, 51, 7])).unwrap();
        assert_eq!(colour.values, [0.2]);
    }

    #[test]
    fn what_is_no_grey_image_is_a_sentence() {
        let colours = png(ColorType::Rgb, BitDepth::Eight, [2, 1], &[9, 9, 9, 1, 2, 3]);
        assert_eq!(
            read(&colours).unwrap_err(),
            "h.png: has colours, for instance at pixel (1, 0): heights are greys"
        );
        let grey = png(ColorType::Grayscale, BitDepth::Eight, [64, 64], &[7; 4096]);
        for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n", b"v 0 0 0", &grey[..grey.len() / 2]] {
            assert!(read(bytes).unwrap_err().starts_with("h.png: "));
        }
    }

    #[test]
    fn damaged_files_are_a_sentence_or_an_image() {
        let data: Vec<u8> = (0..1024).map(|at| (at * at % 251) as u8).collect();
        let whole = [
            png(ColorType::Grayscale, BitDepth::Eight, [32, 32], &data),
            png(ColorType::GrayscaleAlpha, BitDepth::Sixteen, [16, 16], &data),
        ];
        let mut state = 7u64;
        let mut below = |count: usize| {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(0x1405_7b7e_f767_814f);
            (state >> 33) as usize % count
        };
        for round in 0..10_000 {
            let mut bytes = whole[round % 2].clone();
            for _ in 0..=below(3) {
                let at = below(bytes.len());
                bytes[at] = below(256) as u8;
            }
            if below(4) == 0 {
                bytes.truncate(below(bytes.len()));
            }
            match read(&bytes) {
                Ok(grey) => assert_eq!(grey.values.len(), grey.size[0] * grey.size[1]),
                Err(what) => assert!(what.starts_with("h.png: "), "{what}"),
            }
        }
    }
}
