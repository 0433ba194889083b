//! A range of frames: `1001-1120`, or one frame: `7`.

use std::fmt;
use std::str::FromStr;

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

    /// The frames in order.
    pub fn iter(&self) -> std::ops::RangeInclusive<i32> {
        self.first..=self.last
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || format!("\"{text}\" is no range of frames such as \"1001-1120\"");
        let number = |text: &str| text.trim().parse::<i32>().map_err(|_| refused());
        // A minus at the start is a sign.
        let (first, last) = match text.char_indices().skip(1).find(|(_, letter)| *letter == '-') {
            None => (number(text)?, number(text)?),
            Some((at, _)) => (number(&text[..at])?, number(&text[at + 1..])?),
        };
        if last < first {
            return Err(format!("the range of frames \"{text}\" ends before it starts"));
        }
        if i64::from(last) - i64::from(first) >= 10_000_000 {
            return Err(format!("the range of frames \"{text}\" has more than 10000000 frames"));
        }
        Ok(Self { first, last })
    }
}

impl fmt::Display for Frames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}", self.first, self.last)
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
        for wrong in ["", "-", "a-b", "3-1", "1-", "1-2-3", "1001-99999999999"] {
            assert!(wrong.parse::<Frames>().is_err(), "{wrong}");
        }
    }
}
