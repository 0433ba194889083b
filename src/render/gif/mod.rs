//! GIF files: flipbooks that any browser plays.

pub(in crate::render) mod palette;

use std::io::{Error, Result, Write};

use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};

use super::camera::Size;
use palette::Palette;

/// Minimum time of a frame (1/100 s): most programs show shorter ones for a tenth of a second.
const MIN_DELAY: u16 = 2;

/// A GIF file that is written frame by frame; it loops forever.
pub struct Gif<'a, W: Write> {
    encoder: Encoder<W>,
    size: [u16; 2],
    palette: &'a Palette,
    /// The frame before, as indices; empty before the first.
    before: Vec<u8>,
}

impl<'a, W: Write> Gif<'a, W> {
    /// Begins a file.
    ///
    /// # Errors
    /// A size of more than 65,535 pixels along an edge; errors of `out`.
    pub fn new(out: W, size: Size, palette: &'a Palette) -> Result<Self> {
        let edge = |pixels: u32| {
            u16::try_from(pixels).map_err(|_| Error::other("a GIF has at most 65,535 pixels along an edge"))
        };
        let edges = [edge(size.width)?, edge(size.height)?];
        // The colour after the palette's marks unchanged pixels.
        let colours: Vec<u8> = palette.colours().iter().copied().chain([[0; 3]]).flatten().collect();
        let mut encoder = Encoder::new(out, edges[0], edges[1], &colours).map_err(io_error)?;
        encoder.set_repeat(Repeat::Infinite).map_err(io_error)?;
        Ok(Self { encoder, size: edges, palette, before: Vec::new() })
    }

    /// Adds a frame by the indices of its colours ([`Palette::indices`]), shown for `delay` hundredths of a second.
    ///
    /// # Errors
    /// A number of pixels that differs from the file's; errors of the file.
    pub fn add(&mut self, indices: Vec<u8>, delay: u16) -> Result<()> {
        let [width, height] = self.size.map(usize::from);
        if indices.len() != width * height {
            return Err(Error::other("a frame of a GIF has a different size from the others"));
        }
        let unchanged = self.palette.colours().len() as u8;
        let is_first = self.before.is_empty();
        let [left, top, right, bottom] =
            if is_first { [0, 0, width, height] } else { changed_box(&self.before, &indices, width) };
        let rows = (top..bottom).flat_map(|y| (left..right).map(move |x| y * width + x));
        let pixel =
            |at: usize| if !is_first && self.before[at] == indices[at] { unchanged } else { indices[at] };
        let frame = Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: (!is_first).then_some(unchanged),
            left: left as u16,
            top: top as u16,
            width: (right - left) as u16,
            height: (bottom - top) as u16,
            buffer: rows.map(pixel).collect::<Vec<u8>>().into(),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(io_error)?;
        self.before = indices;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn finish(self) -> Result<()> {
        self.encoder.into_inner().map(drop).map_err(io_error)
    }
}

fn io_error(error: EncodingError) -> Error {
    match error {
        EncodingError::Io(error) => error,
        other => Error::other(other.to_string()),
    }
}

/// The box of the differences between two frames (left, top, right, bottom; the last two exclusive); at least one pixel.
fn changed_box(before: &[u8], after: &[u8], width: usize) -> [usize; 4] {
    let mut edges = [width, usize::MAX, 0, 0];
    for (y, (old, new)) in before.chunks(width).zip(after.chunks(width)).enumerate() {
        let is_other = |x: &usize| old[*x] != new[*x];
        if let Some(first) = (0..width).find(is_other) {
            let last = (0..width).rfind(is_other).unwrap_or(first);
            edges = [edges[0].min(first), edges[1].min(y), edges[2].max(last + 1), y + 1];
        }
    }
    if edges[3] == 0 { [0, 0, 1, 1] } else { edges }
}

/// The delay (1/100 s) of each of some frames of a shot, so that they play at `fps` frames of the shot per second, even if frames between
/// them are left out. Start times are rounded, not delays, so that the error does not add up. The last frame has the delay of the one
/// before it. Delays are at least 2, as many programs do not play shorter ones.
pub fn delays(frames: &[i32], fps: f64) -> Vec<u16> {
    let gap = |pair: &[i32]| i64::from(pair[1]) - i64::from(pair[0]);
    let gaps: Vec<i64> = frames.windows(2).map(gap).collect();
    let all = gaps.iter().chain([gaps.last().unwrap_or(&1)]);
    let start_time = |count: i64| (count as f64 * 100.0 / fps).round();
    let mut at = 0;
    let delay = |gap: &i64| {
        let begin = start_time(at);
        at += gap;
        (start_time(at) - begin).clamp(f64::from(MIN_DELAY), f64::from(u16::MAX)) as u16
    };
    all.take(frames.len()).map(delay).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up_to_the_time_of_the_shot() {
        assert_eq!(delays(&[1, 2, 3, 4, 5, 6], 24.0), [4, 4, 5, 4, 4, 4]);
        for fps in [12.0, 23.976, 24.0, 25.0, 30.0, 48.0] {
            let frames: Vec<i32> = (1001..1301).collect();
            let sum: u32 = delays(&frames, fps).iter().map(|delay| u32::from(*delay)).sum();
            assert!((f64::from(sum) - 300.0 * 100.0 / fps).abs() <= 0.5, "{fps}: {sum}");
        }
        // Every fifth frame is shown five times as long, to cover those left out.
        assert_eq!(delays(&[-5, 0, 5], 25.0), [20, 20, 20]);
        assert_eq!(delays(&[1, 2, 12], 25.0), [4, 40, 40]);
        assert_eq!(delays(&[7], 25.0), [4]);
        assert_eq!(delays(&[1, 2], 1000.0), [2, 2]);
        assert!(delays(&[], 25.0).is_empty());
    }

    #[test]
    fn only_what_changes_is_written() {
        let before = [0u8; 12];
        let mut after = before;
        (after[5], after[10]) = (1, 2);
        assert_eq!(changed_box(&before, &after, 4), [1, 1, 3, 3]);
        assert_eq!(changed_box(&before, &before, 4), [0, 0, 1, 1]);
    }
}
