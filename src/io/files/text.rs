//! Text in mesh and particle files: byte order marks, lines with any line ends, words, and numbers.

use std::str::FromStr;

use crate::error::one_line;

/// Byte order marks of UTF-8, and of UTF-16 in both byte orders.
const UTF_8: &[u8] = b"\xef\xbb\xbf";
const UTF_16: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];
/// Maximum number of characters of a word that a message quotes.
const MAX_QUOTED: usize = 40;

/// The bytes after a byte order mark, which some programs write.
///
/// # Errors
/// The mark of UTF-16, which no reader supports.
pub(in crate::io) fn without_mark(bytes: &[u8]) -> Result<&[u8], String> {
    if UTF_16.iter().any(|mark| bytes.starts_with(mark)) {
        return Err("the file is text in UTF-16: save it as plain text (ASCII or UTF-8)".into());
    }
    Ok(bytes.strip_prefix(UTF_8).unwrap_or(bytes))
}

/// The lines of a text. They end with a line feed, a carriage return, or both, even mixed within one file.
pub(in crate::io) struct Lines<'a> {
    rest: Option<&'a [u8]>,
    number: usize,
}

/// The lines of a text, each with its number from 1.
pub(in crate::io) fn lines(bytes: &[u8]) -> Lines<'_> {
    Lines { rest: Some(bytes), number: 0 }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.rest?;
        self.number += 1;
        let Some(end) = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r') else {
            self.rest = None;
            return Some((self.number, rest));
        };
        let length = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        self.rest = Some(&rest[end + length..]);
        Some((self.number, &rest[..end]))
    }
}

/// The words of a text, separated by blanks and line ends; a word that begins with `#` starts a comment.
pub(in crate::io) struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Number of the line of the last word, from 1.
    pub line: usize,
}

impl<'a> Words<'a> {
    /// The words of a whole text.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1 }
    }

    /// Bytes until the next one that is, or is not, white space.
    fn length(&self, is_space: bool) -> usize {
        let rest = &self.bytes[self.at..];
        rest.iter().position(|byte| byte.is_ascii_whitespace() == is_space).unwrap_or(rest.len())
    }

    /// The next word.
    pub fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            self.skip_blanks();
            let length = self.length(true);
            let word = &self.bytes[self.at..self.at + length];
            if !word.starts_with(b"#") {
                self.at += length;
                return (length > 0).then_some(word);
            }
            self.rest_of_line();
        }
    }

    /// The next word, without consuming it.
    pub fn peek(&self) -> Option<&'a [u8]> {
        Self { bytes: self.bytes, at: self.at, line: self.line }.next()
    }

    fn skip_blanks(&mut self) {
        let length = self.length(false);
        let blanks = &self.bytes[self.at..self.at + length];
        let is_end = |&n: &usize| {
            blanks[n] == b'\n' || blanks[n] == b'\r' && self.bytes.get(self.at + n + 1) != Some(&b'\n')
        };
        self.line += (0..length).filter(is_end).count();
        self.at += length;
    }

    /// Consumes the rest of the line of the last word, without the line end.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    /// Steps back by `bytes`, within the line.
    pub fn step_back(&mut self, bytes: usize) {
        self.at -= bytes;
    }
}

/// A number in Rust's syntax, or with Fortran's `D` before the exponent.
pub(in crate::io) fn number<T: FromStr>(word: &[u8]) -> Option<T> {
    let text = std::str::from_utf8(word).ok()?;
    let of_fortran = || text.contains(['d', 'D']).then(|| text.replace(['d', 'D'], "e"))?.parse().ok();
    text.parse().ok().or_else(of_fortran)
}

/// A coordinate relative to an origin. Without one it is parsed as 32 bits: via 64 bits, some numbers would be rounded twice.
pub(in crate::io) fn coordinate(word: &[u8], origin: f64) -> Option<f32> {
    if origin == 0.0 { number(word) } else { number::<f64>(word).map(|value| (value - origin) as f32) }
}

/// The message for a word that is not the expected number.
pub(in crate::io) fn not_a_number(word: &[u8]) -> String {
    let shown = shown(word);
    if has_decimal_comma(word) {
        return format!("\"{shown}\" has a decimal comma: numbers need decimal points");
    }
    format!("\"{shown}\" is not a number")
}

/// Whether a word is a number with a decimal comma.
pub(in crate::io) fn has_decimal_comma(word: &[u8]) -> bool {
    let commas = word.iter().filter(|&&byte| byte == b',').count();
    let with_point: Vec<u8> = word.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect();
    commas == 1 && !word.contains(&b'.') && number::<f64>(&with_point).is_some()
}

/// A word as a message quotes it.
pub(in crate::io) fn shown(word: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(word).chars().take(MAX_QUOTED).collect();
    one_line(&text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_end_is_recognised() {
        let found: Vec<(usize, &[u8])> = lines(b"a\nb\r\nc\rd\r\r\n\ne").collect();
        let texts = ["a", "b", "c", "d", "", "", "e"];
        assert_eq!(
            found,
            texts.iter().enumerate().map(|(n, text)| (n + 1, text.as_bytes())).collect::<Vec<_>>()
        );
        assert_eq!(lines(b"a\r").collect::<Vec<_>>(), [(1, &b"a"[..]), (2, b"")]);
    }

    #[test]
    fn words_know_their_lines_and_skip_comments() {
        let mut words = Words::new(b" a b\r\n# c d\rd\n\n\re f # g");
        let mut found = Vec::new();
        while let Some(word) = words.next() {
            found.push((std::str::from_utf8(word).unwrap(), words.line));
        }
        assert_eq!(found, [("a", 1), ("b", 1), ("d", 3), ("e", 6), ("f", 6)]);
    }

    #[test]
    fn numbers_may_be_fortrans_and_commas_are_named() {
        assert_eq!(number::<f64>(b"1.5D+02"), Some(150.0));
        assert_eq!(number::<f32>(b"-2d-1"), Some(-0.2));
        for word in [&b"d"[..], b"D1", b"1d", b"x", b"0,5", b""] {
            assert_eq!(number::<f64>(word), None, "{}", shown(word));
        }
        assert_eq!(coordinate(b"5000000.125", 5e6), Some(0.125));
        assert!(not_a_number(b"-0,5e3").contains("decimal comma"));
        for word in [&b"1,2,3"[..], b"1.0,2", b",", b"a,b"] {
            assert!(not_a_number(word).ends_with("is not a number"), "{}", shown(word));
        }
    }

    #[test]
    fn marks_are_skipped_or_refused() {
        assert_eq!(without_mark(b"\xef\xbb\xbfv"), Ok(&b"v"[..]));
        assert_eq!(without_mark(b"v"), Ok(&b"v"[..]));
        assert!(without_mark(b"\xff\xfev\0").is_err() && without_mark(b"\xfe\xff\0v").is_err());
    }
}
