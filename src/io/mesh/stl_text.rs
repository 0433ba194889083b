//! Text STL: any number of solids, one after another.
//!
//! Words are separated by blanks and line ends of any kind and may have any case; names of solids may have any encoding; `#` starts a
//! comment. Normals are ignored, whatever they are. A facet may have more than three corners. The last solid may lack its `endsolid`; the
//! caller then warns that the file may be cut short.

use super::stl_solids::Joined;
use crate::error::fail_if;
use crate::geometry::PolygonMesh;
use crate::io::files::text::Words;
use crate::io::files::{source, text};

/// Facets between two checks of the stop flag.
const PIECE: usize = 1 << 14;
/// Words between `facet` and `outer`: `normal` and three numbers.
const NORMAL: usize = 4;

/// Whether a file, without its byte order mark, begins like a text STL.
pub(in crate::io) fn is_text_stl(bytes: &[u8]) -> bool {
    // A binary file may begin with any word, but its triangle count is followed by a zero byte, which no text contains.
    let head = &bytes[..bytes.len().min(super::stl_solids::HEADER)];
    let first = Words::new(bytes).next();
    !head.contains(&0) && first.is_some_and(|word| is(word, "solid") || is(word, "facet"))
}

fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

/// Reads the facets of all solids, minus an origin; also returns a warning about the file, if any.
pub(in crate::io) fn parse(bytes: &[u8], origin: [f64; 3]) -> Result<(PolygonMesh, Option<String>), String> {
    let mut reader = Reader { words: Words::new(bytes), origin, joined: Joined::default(), facets: 0 };
    let mut is_open = false;
    while let Some(word) = reader.words.next() {
        if is(word, "facet") {
            source::check_every(reader.facets, PIECE)?;
            reader.facet()?;
            is_open = true;
        } else if is(word, "solid") {
            reader.name();
            is_open = true;
        } else if reader.ends(word, "solid") {
            reader.name();
            is_open = false;
        } else {
            return Err(reader.unexpected(word, "\"facet\", \"solid\" or \"endsolid\""));
        }
    }
    let warning = is_open.then(|| "has no \"endsolid\" at its end: it may be cut short".to_string());
    Ok((reader.joined.mesh, warning))
}

struct Reader<'a> {
    words: Words<'a>,
    origin: [f64; 3],
    joined: Joined,
    facets: usize,
}

impl<'a> Reader<'a> {
    /// Skips the name after `solid` or `endsolid`: the rest of the line, up to a facet that begins in it.
    fn name(&mut self) {
        let name = self.words.rest_of_line();
        let lower = name.to_ascii_lowercase();
        let facet = lower.windows(FACET.len()).position(|window| window == FACET);
        if let Some(begin) = facet.filter(|&begin| begin > 0 && lower[begin - 1].is_ascii_whitespace()) {
            self.words.step_back(name.len() - begin);
        }
    }

    /// Whether a word, alone or with the next, is `end` and a keyword; the next word is then consumed.
    fn ends(&mut self, word: &[u8], keyword: &str) -> bool {
        let is_next = |next: &[u8]| is(next, keyword);
        if is(word, "end") && self.words.peek().is_some_and(is_next) {
            self.words.next();
            return true;
        }
        word.split_at_checked(3).is_some_and(|(end, rest)| is(end, "end") && is(rest, keyword))
    }

    fn next(&mut self) -> Result<&'a [u8], String> {
        let facet = self.facets + 1;
        self.words.next().ok_or_else(|| format!("the .stl file ends in triangle {facet}"))
    }

    fn unexpected(&self, word: &[u8], wanted: &str) -> String {
        format!("line {}: \"{}\" where {wanted} is expected", self.words.line, text::shown(word))
    }

    /// Reads the rest of a facet after its first word.
    fn facet(&mut self) -> Result<(), String> {
        let mut word = self.next()?;
        for _ in 0..NORMAL {
            if is(word, "outer") {
                break;
            }
            word = self.next()?;
        }
        fail_if(!is(word, "outer"), || self.unexpected(word, "\"outer loop\""))?;
        let word = self.next()?;
        fail_if(!is(word, "loop"), || self.unexpected(word, "\"loop\""))?;
        let begin = self.joined.mesh.corners.len();
        loop {
            let word = self.next()?;
            if is(word, "vertex") {
                let position = self.vertex()?;
                let corner = self.joined.corner(position);
                self.joined.mesh.corners.push(corner);
            } else if self.ends(word, "loop") {
                break;
            } else {
                return Err(self.unexpected(word, "\"vertex\" or \"endloop\""));
            }
        }
        let word = self.next()?;
        fail_if(!self.ends(word, "facet"), || self.unexpected(word, "\"endfacet\""))?;
        let mesh = &mut self.joined.mesh;
        let count = mesh.corners.len() - begin;
        fail_if(count < 3, || format!("line {}: a facet of {count} corners", self.words.line))?;
        mesh.ends.push(mesh.corners.len() as u32);
        self.facets += 1;
        Ok(())
    }

    fn vertex(&mut self) -> Result<[f32; 3], String> {
        let mut position = [0.0; 3];
        for (axis, value) in position.iter_mut().enumerate() {
            let word = self.next()?;
            let line = self.words.line;
            let read = text::coordinate(word, self.origin[axis]);
            *value = read.ok_or_else(|| format!("line {line}: {}", text::not_a_number(word)))?;
            if !value.is_finite() {
                return Err(format!("line {line}: \"{}\" is not a finite number", text::shown(word)));
            }
        }
        Ok(position)
    }
}

/// The start of a facet, in lower case.
const FACET: &[u8] = b"facet normal";
