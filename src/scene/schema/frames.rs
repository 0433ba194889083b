//! Ranges of frames: `1001-1120`, or one frame: `7`; and choices of frames: `1-100x2`, `1,5,9`.

use std::fmt;
use std::str::FromStr;

/// Maximum number of frames of a shot.
const MAX_FRAMES: i64 = 10_000_000;

/// Maximum absolute frame number.
const MAX_FRAME_NUMBER: i32 = 1_000_000_000;

/// First and last frame of a shot, both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frames {
    /// The first.
    pub first: i32,
    /// The last, not before the first.
    pub last: i32,
}

impl Frames {
    /// Number of frames, at least 1.
    pub fn count(&self) -> usize {
        (i64::from(self.last) - i64::from(self.first) + 1) as usize
    }

    /// Whether it contains a frame.
    pub fn contains(&self, frame: i32) -> bool {
        self.iter().contains(&frame)
    }

    /// The frames in order.
    pub fn iter(&self) -> std::ops::RangeInclusive<i32> {
        self.first..=self.last
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || format!("\"{text}\" is not a range of frames such as \"1001-1120\"");
        let within = |frame: &i32| (-MAX_FRAME_NUMBER..=MAX_FRAME_NUMBER).contains(frame);
        let number = |text: &str| text.trim().parse::<i32>().ok().filter(within).ok_or_else(refused);
        // A leading minus is a sign.
        let (first, last) = match text.char_indices().skip(1).find(|(_, letter)| *letter == '-') {
            None => (number(text)?, number(text)?),
            Some((at, _)) => (number(&text[..at])?, number(&text[at + 1..])?),
        };
        if last < first {
            return Err(format!("the range of frames \"{text}\" ends before it starts"));
        }
        if i64::from(last) - i64::from(first) >= MAX_FRAMES {
            return Err(format!("the range of frames \"{text}\" has more than {MAX_FRAMES} frames"));
        }
        Ok(Self { first, last })
    }
}

impl fmt::Display for Frames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.first, self.last)
    }
}

/// A choice of a shot's frames: ranges, each with a step, joined by commas.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameChoice {
    /// Ascending, each once; empty only in [`FrameChoice::none`].
    frames: Vec<i32>,
}

impl FrameChoice {
    /// The smallest frame.
    pub fn first(&self) -> i32 {
        self.frames[0]
    }

    /// The largest frame.
    pub fn last(&self) -> i32 {
        self.frames[self.frames.len() - 1]
    }

    /// The frames, ascending.
    pub fn iter(&self) -> impl Iterator<Item = i32> + '_ {
        self.frames.iter().copied()
    }

    /// Number of frames.
    pub fn count(&self) -> usize {
        self.frames.len()
    }

    /// Whether it contains a frame.
    pub fn contains(&self, frame: i32) -> bool {
        self.frames.binary_search(&frame).is_ok()
    }

    /// No frames: [`FrameChoice::first`] and [`FrameChoice::last`] must not be called.
    pub(in crate::scene) fn none() -> Self {
        Self { frames: Vec::new() }
    }
}

impl From<Frames> for FrameChoice {
    fn from(frames: Frames) -> Self {
        Self { frames: frames.iter().collect() }
    }
}

impl FromStr for FrameChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused =
            || format!("\"{text}\" is not a choice of frames such as \"1-100\", \"1-100x2\" or \"1,5,9\"");
        let mut frames = Vec::new();
        for part in text.split(',') {
            let (range, step) = match part.split_once('x') {
                Some((range, step)) => (range, step.trim().parse().map_err(|_| refused())?),
                None => (part, 1),
            };
            let range: Frames = range.trim().parse()?;
            if step == 0 {
                return Err(refused());
            }
            frames.extend(range.iter().step_by(step));
            if frames.len() as i64 > 2 * MAX_FRAMES {
                return Err(format!("\"{text}\" lists more than {} frames", 2 * MAX_FRAMES));
            }
        }
        frames.sort_unstable();
        frames.dedup();
        Ok(Self { frames })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_written() {
        assert_eq!("1001-1120".parse(), Ok(Frames { first: 1001, last: 1120 }));
        assert_eq!("7".parse(), Ok(Frames { first: 7, last: 7 }));
        assert_eq!("-5--2".parse(), Ok(Frames { first: -5, last: -2 }));
        assert_eq!("-5-2".parse(), Ok(Frames { first: -5, last: 2 }));
        assert_eq!(Frames { first: 1, last: 3 }.to_string(), "1-3");
        for wrong in
            ["", "-", "a-b", "3-1", "1-", "1-2-3", "1001-99999999999", "2147483640-2147483647", "-2147483648"]
        {
            assert!(wrong.parse::<Frames>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn choices_have_steps_and_commas() {
        let frames = |text: &str| text.parse::<FrameChoice>().unwrap().frames;
        assert_eq!(frames("1-7x3"), [1, 4, 7]);
        assert_eq!(frames("9, 1,5"), [1, 5, 9]);
        assert_eq!(frames("1-3,2-4,-2--1"), [-2, -1, 1, 2, 3, 4]);
        for wrong in ["", "1,", "1-9x0", "1-9x", "1-9x-2", "x2", "9-1x2"] {
            assert!(wrong.parse::<FrameChoice>().is_err(), "{wrong}");
        }
    }
}
