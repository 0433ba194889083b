//! Names of frame sequences: `body.%04d.obj`, `body.####.obj`, `body.$F4.obj`.

use std::path::{Path, PathBuf};

/// A name with a place for the frame number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// Finds the frame number's place in a name; none when the name is of one file.
    pub fn parse(path: &Path) -> Option<Self> {
        let text = path.to_str()?;
        let part = |start: usize, end: usize, digits: usize| {
            Some(Self { before: text[..start].into(), digits, after: text[end..].into() })
        };
        if let Some(start) = text.rfind('%') {
            let end = start + text[start..].find('d')? + 1;
            let width = &text[start + 1..end - 1];
            let digits = if width.is_empty() { 1 } else { width.parse().ok()? };
            return part(start, end, digits);
        }
        if let Some(start) = text.rfind("$F") {
            let length = text[start + 2..].bytes().take_while(u8::is_ascii_digit).count();
            return part(start, start + 2 + length, text[start + 2..start + 2 + length].parse().unwrap_or(1));
        }
        let end = text.rfind('#')? + 1;
        let start = text[..end].trim_end_matches('#').len();
        part(start, end, end - start)
    }

    /// The file of a frame.
    pub fn path(&self, frame: i32) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let number = frame.unsigned_abs();
        format!("{}{sign}{number:0width$}{}", self.before, self.after, width = self.digits).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_spellings_name_the_same_file() {
        for name in ["a/b.%04d.obj", "a/b.####.obj", "a/b.$F4.obj"] {
            assert_eq!(Pattern::parse(name.as_ref()).unwrap().path(12), PathBuf::from("a/b.0012.obj"));
        }
        assert_eq!(Pattern::parse("b.%d.obj".as_ref()).unwrap().path(-3), PathBuf::from("b.-3.obj"));
        assert!(Pattern::parse("boot.obj".as_ref()).is_none());
    }
}
