//! Writes triangles into the caller's buffers: in order, and without reading them.

use std::ops::Range;

use crate::numeric::cpu::dispatch;
use crate::shallow::columns::STRIP;
use crate::shallow::surface::Indices;
use crate::shallow::surface::quartets::links::LiquidColumns;
use crate::shallow::surface::quartets::odd::{Search, each_odd_triangle};
use crate::shallow::surface::quartets::strips::{Found, neighbour};
use crate::shallow::surface::rim::boundary::Wall;

/// Index count of a pair of triangles.
const PAIR: usize = 6;

/// An index type: 16 or 32 bits.
trait Index: Copy {
    fn from_vertex(vertex: u32) -> Self;
}

impl Index for u16 {
    #[inline(always)]
    fn from_vertex(vertex: u32) -> Self {
        vertex as u16
    }
}

impl Index for u32 {
    #[inline(always)]
    fn from_vertex(vertex: u32) -> Self {
        vertex
    }
}

/// The triangles of 16 quartets side by side. Their vertices are a + position in the north and c + position in the south. Index n is
/// a + `add[n]` at a corner in the north, where `south[n]` is 0, and c + `add[n]` in the south, where all bits of `south[n]` are set.
/// `turned[n]` is the bit of the quartet if the corner changes between north and south when the quartet is divided from north-east to
/// south-west; else 0.
struct Pattern {
    add: [u32; PAIR * STRIP],
    south: [u32; PAIR * STRIP],
    turned: [u32; PAIR * STRIP],
}

/// Counter-clockwise and clockwise: the second and third corners of each triangle are swapped.
static PATTERNS: [Pattern; 2] = [
    // North-west, south-west, south-east (turned: north-east); north-east, north-west (turned: south-west), south-east.
    Pattern::new([0, 0, 1, 1, 0, 1], [0, 1, 1, 0, 0, 1], [0, 0, 1, 0, 1, 0]),
    Pattern::new([0, 1, 0, 1, 1, 0], [0, 1, 1, 0, 1, 0], [0, 1, 0, 0, 0, 1]),
];

impl Pattern {
    const fn new(add: [u32; PAIR], south: [u32; PAIR], turned: [u32; PAIR]) -> Self {
        let zeros = [0; PAIR * STRIP];
        let mut out = Self { add: zeros, south: zeros, turned: zeros };
        let mut at = 0;
        while at < PAIR * STRIP {
            let (position, corner) = ((at / PAIR) as u32, at % PAIR);
            out.add[at] = position + add[corner];
            out.south[at] = 0u32.wrapping_sub(south[corner]);
            out.turned[at] = turned[corner] << position;
            at += 1;
        }
        out
    }

    /// Writes the `part` of the indices.
    #[inline(always)]
    fn put<I: Index>(&self, a: u32, c: u32, turned: u32, part: Range<usize>, out: &mut [I]) {
        let down = c.wrapping_sub(a);
        let (add, south, turn) = (&self.add[part.clone()], &self.south[part.clone()], &self.turned[part]);
        for (((out, add), south), turn) in out.iter_mut().zip(add).zip(south).zip(turn) {
            let is_turned = if turned & *turn != 0 { u32::MAX } else { 0 };
            *out = I::from_vertex(a.wrapping_add(*add).wrapping_add(down & (south ^ is_turned)));
        }
    }
}

/// Writes all triangles except those of skirts; `flipped`: clockwise seen from above. Returns the index count.
pub(in crate::shallow::surface) fn write_triangles(
    liquid: LiquidColumns<'_>,
    found: &Found,
    walls: &[Wall],
    search: &Search,
    flipped: bool,
    out: &mut Indices<'_>,
) -> usize {
    match out {
        Indices::None => 0,
        Indices::U16(out) => {
            let done = dispatch!(write_full::<u16>(found: &Found, flipped: bool, out: &mut [u16]) -> usize);
            done + write_odd(liquid, found, walls, search, flipped, &mut out[done..])
        }
        Indices::U32(out) => {
            let done = dispatch!(write_full::<u32>(found: &Found, flipped: bool, out: &mut [u32]) -> usize);
            done + write_odd(liquid, found, walls, search, flipped, &mut out[done..])
        }
    }
}

/// Writes the triangles of full quartets and returns the index count.
#[inline(always)]
fn write_full<I: Index>(found: &Found, flipped: bool, out: &mut [I]) -> usize {
    let pattern = &PATTERNS[usize::from(flipped)];
    let mut at = 0;
    for span in &found.spans {
        let Some(south) = neighbour(span.south) else { continue };
        for step in 0..span.len {
            let (strip, south) = (span.first + step, south + step);
            let (full, turned) = (found.states[strip].full, u32::from(found.states[strip].turned));
            if full == u16::MAX {
                let (a, c) = (found.states[strip].first, found.states[south].first);
                if let Some(out) = out[at..].first_chunk_mut::<{ PAIR * STRIP }>() {
                    pattern.put(a, c, turned, 0..PAIR * STRIP, out);
                }
                at += PAIR * STRIP;
                continue;
            }
            for run in runs(full) {
                // The vertices of each row are consecutive.
                let (a, c) = (found.vertex(strip, run.start), found.vertex(south, run.start));
                let (a, c) = (a.wrapping_sub(run.start as u32), c.wrapping_sub(run.start as u32));
                let out = &mut out[at..][..PAIR * run.len()];
                at += out.len();
                pattern.put(a, c, turned, PAIR * run.start..PAIR * run.end, out);
            }
        }
    }
    at
}

/// Runs of set positions.
#[inline(always)]
fn runs(positions: u16) -> impl Iterator<Item = Range<usize>> {
    let mut left = u32::from(positions);
    std::iter::from_fn(move || {
        let low = left.trailing_zeros();
        let run = left.checked_shr(low)?.trailing_ones();
        left &= left + (1 << low);
        Some(low as usize..(low + run) as usize)
    })
}

/// Writes the triangles of odd quartets and returns the index count.
fn write_odd<I: Index>(
    liquid: LiquidColumns<'_>,
    found: &Found,
    walls: &[Wall],
    search: &Search,
    flipped: bool,
    out: &mut [I],
) -> usize {
    let mut count = 0;
    let mut out = out.as_chunks_mut::<3>().0.iter_mut();
    let vertex = |id: u32| match (id as usize).checked_sub(liquid.columns.len()) {
        Some(extra) => walls[extra].vertex,
        None => found.vertex(id as usize / STRIP, id as usize % STRIP),
    };
    each_odd_triangle(found, search, |corners| {
        let [a, b, c] = corners.map(|id| I::from_vertex(vertex(id)));
        if let Some(out) = out.next() {
            *out = if flipped { [a, c, b] } else { [a, b, c] };
            count += 3;
        }
    });
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_two_triangles_that_face_up_or_down() {
        let (a, c, turned) = (100u32, 1000u32, 0b1010_0000_0000_0110u32);
        for flipped in [false, true] {
            let mut out = [0u32; PAIR * STRIP];
            PATTERNS[usize::from(flipped)].put(a, c, turned, 0..PAIR * STRIP, &mut out);
            for (position, pair) in (0u32..).zip(out.as_chunks::<PAIR>().0) {
                let [nw, sw] = [a + position, c + position];
                let [ne, se] = [nw + 1, sw + 1];
                let up = if turned >> position & 1 == 1 {
                    [[nw, sw, ne], [ne, sw, se]]
                } else {
                    [[nw, sw, se], [ne, nw, se]]
                };
                let expected = if flipped { up.map(|[a, b, c]| [a, c, b]) } else { up };
                assert_eq!(pair[..], expected.concat(), "{position}");
            }
        }
    }

    #[test]
    fn runs_follow_each_other() {
        let all = |positions| runs(positions).collect::<Vec<Range<usize>>>();
        assert!(all(0).is_empty());
        assert_eq!(all(0xffff).first(), Some(&(0..16)));
        assert_eq!(all(0b1100_0000_0001_0110), [1..3, 4..5, 14..16]);
    }
}
