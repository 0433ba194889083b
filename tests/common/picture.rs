//! What a PNG file shows.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Red, green and blue of each pixel, row by row from the upper left.
#[derive(Debug, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    pub fn open(path: &Path) -> Self {
        let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((frame.color_type, frame.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
        let (width, height) = (frame.width as usize, frame.height as usize);
        let pixels: Vec<[u8; 3]> = bytes.chunks_exact(3).map(|pixel| pixel.try_into().unwrap()).collect();
        assert_eq!(pixels.len(), width * height);
        Self { width, height, pixels }
    }

    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }
}
