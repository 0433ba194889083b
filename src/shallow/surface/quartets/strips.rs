//! State of strips in a frame, one bit per position.

use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE, STRIP};

/// State of a strip, one bit per position.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::shallow::surface) struct State {
    /// Wet columns.
    pub wet: u16,
    /// Full quartets of this layer, at their north-west column.
    pub full: u16,
    /// Of these, the ones divided from north-east to south-west.
    pub turned: u16,
    /// Wet columns in an odd quartet.
    pub in_odd: u16,
    /// Columns that full quartets link with a wet one of the same layer to the west, east, north and south.
    pub sides: [u16; 4],
    /// Columns that are walls.
    pub walls: u16,
    /// Columns that are vertices.
    pub used: u16,
    /// Number of the first of these vertices; the others follow.
    pub first: u32,
}

/// A run of 16 cells along x, one bit per quartet.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::shallow::surface) struct Block {
    /// Odd quartets.
    pub odd: u16,
    /// Odd quartets in which a surface ends at a wall.
    pub walled: u16,
    /// As `odd`, but including quartets that turned out to have no triangle.
    pub searched: u16,
}

/// Strips that are consecutive along x, as are those to the north and to the south of them.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::surface) struct Span {
    /// First strip.
    pub first: usize,
    /// Count of strips.
    pub len: usize,
    /// First strip to the north, or [`NONE`].
    pub north: u32,
    /// First strip to the south, or [`NONE`].
    pub south: u32,
}

/// A set of indices.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Bits(Vec<u64>);

impl Bits {
    /// Clears the set, for indices below `count`.
    pub fn reset(&mut self, count: usize) {
        reset(&mut self.0, count.div_ceil(64), 0);
    }

    #[inline(always)]
    pub fn set(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    pub fn has(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 == 1
    }

    /// Adds the indices before and after each; the last is below `count`.
    pub fn widen(&mut self, count: usize) {
        let mut before = 0;
        for word in 0..self.0.len() {
            let own = self.0[word];
            let next = self.0.get(word + 1).map_or(0, |next| next << 63);
            self.0[word] |= own >> 1 | own << 1 | next | before >> 63;
            before = own;
        }
        if let Some(last) = self.0.last_mut().filter(|_| !count.is_multiple_of(64)) {
            *last &= (1 << (count % 64)) - 1;
        }
    }

    /// Its indices, ascending.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().enumerate().flat_map(|(word, &bits)| positions(bits).map(move |bit| word * 64 + bit))
    }

    /// Finds the spans of a set of strips.
    pub fn find_spans(&self, columns: &Columns, out: &mut Vec<Span>) {
        let follows = |first: u32, count: usize, other: u32| match first {
            NONE => other == NONE,
            first => other == first + count as u32,
        };
        out.clear();
        for strip in self.iter() {
            let (north, south) = (columns.north(strip), columns.south(strip));
            if let Some(span) = out.last_mut()
                && span.first + span.len == strip
                && follows(span.north, span.len, north)
                && follows(span.south, span.len, south)
                && columns.east(strip - 1).is_some()
            {
                span.len += 1;
                continue;
            }
            out.push(Span { first: strip, len: 1, north, south });
        }
    }
}

/// Positions of the set bits, from the lowest.
#[inline(always)]
pub(in crate::shallow::surface) fn positions(bits: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut bits: u64 = bits.into();
    std::iter::from_fn(move || {
        let position = bits.trailing_zeros() as usize;
        bits &= bits.wrapping_sub(1);
        (position < 64).then_some(position)
    })
}

/// What the search for groups has found: the state of all strips and blocks.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Found {
    /// One per strip, and after the last an empty one, for no strip.
    pub states: Vec<State>,
    /// Row by row.
    pub blocks: Vec<Block>,
    /// Count of blocks in a row.
    pub across: usize,
    /// Strips to search: those with a wet column, those around them, and others with vertices or walls.
    pub candidates: Bits,
    /// The same, as spans.
    pub spans: Vec<Span>,
    /// Whether strips were added to `candidates` since the spans were found.
    is_stale: bool,
    /// Blocks with odd quartets.
    pub odd: Bits,
    /// Count of triangles of full quartets.
    pub full_triangles: usize,
    /// Whether a vertex (dry or extra) is the mean of others.
    pub has_means: bool,
}

impl Found {
    /// Clears the previous frame.
    pub fn reset(&mut self, columns: &Columns) {
        let [nx, nz] = columns.grid.size;
        let (strips, across) = (columns.strips().len(), nx.div_ceil(STRIP));
        let Self { states, blocks, spans, odd, .. } = self;
        if states.len() == strips + 1 && blocks.len() == across * nz {
            spans.iter().for_each(|span| states[span.first..span.first + span.len].fill(State::default()));
            odd.iter().for_each(|block| blocks[block] = Block::default());
        } else {
            reset(states, strips + 1, State::default());
            reset(blocks, across * nz, Block::default());
        }
        spans.clear();
        spans.reserve(strips);
        self.candidates.reset(strips);
        self.odd.reset(across * nz);
        self.across = across;
        self.full_triangles = 0;
        self.is_stale = false;
    }

    /// Adds the strips around those with wet columns to `candidates`, and finds the spans.
    pub fn find_spans(&mut self, columns: &Columns) {
        // Consecutive strips are not always side by side: a few strips too many are searched.
        self.candidates.widen(columns.strips().len());
        self.candidates.find_spans(columns, &mut self.spans);
    }

    /// Index of a neighbouring strip in `states`.
    #[inline(always)]
    pub fn slot(&self, strip: Option<usize>) -> usize {
        strip.unwrap_or(self.states.len() - 1)
    }

    /// Makes a column a vertex.
    pub fn add_vertex(&mut self, index: usize) {
        self.state_of(index / STRIP).used |= 1 << (index % STRIP);
    }

    /// Makes a column a wall.
    pub fn add_wall(&mut self, index: usize) {
        self.state_of(index / STRIP).walls |= 1 << (index % STRIP);
    }

    fn state_of(&mut self, strip: usize) -> &mut State {
        if !self.candidates.has(strip) {
            self.candidates.set(strip);
            self.is_stale = true;
        }
        &mut self.states[strip]
    }

    /// Numbers the vertices in order of their columns and returns their count.
    pub fn number(&mut self, columns: &Columns) -> u32 {
        if self.is_stale {
            self.candidates.find_spans(columns, &mut self.spans);
        }
        let (mut next, mut dry) = (0, 0);
        for span in &self.spans {
            for state in &mut self.states[span.first..span.first + span.len] {
                state.first = next;
                next += count(state.used);
                dry |= state.used & !state.wet;
            }
        }
        self.has_means = dry != 0;
        next
    }

    /// The vertex of a column that has one.
    #[inline(always)]
    pub fn vertex(&self, strip: usize, position: usize) -> u32 {
        let state = &self.states[strip];
        state.first + count(state.used & ((1 << position) - 1))
    }
}

/// Count of set bits. They are usually the lowest ones, which is faster where there is no popcount instruction.
#[inline(always)]
pub(in crate::shallow::surface) fn count(bits: u16) -> u32 {
    let ones = bits.trailing_ones();
    if u32::from(bits) == (1 << ones) - 1 { ones } else { bits.count_ones() }
}

/// A neighbouring strip, or none for [`NONE`].
#[inline(always)]
pub(in crate::shallow::surface) fn neighbour(strip: u32) -> Option<usize> {
    (strip != NONE).then_some(strip as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};
    use crate::shallow::terrain::Solids;

    #[test]
    fn sets_widen_across_words_and_not_beyond_their_end() {
        let mut bits = Bits::default();
        bits.reset(130);
        [0, 63, 129].into_iter().for_each(|index| bits.set(index));
        bits.widen(130);
        assert_eq!(bits.iter().collect::<Vec<_>>(), [0, 1, 62, 63, 64, 128, 129]);
        assert!(bits.has(128) && !bits.has(127));
    }

    #[test]
    fn spans_end_where_a_neighbour_is_missing() {
        // Three strips in a row; in the last of three rows the middle one is missing.
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [48, 3] };
        let solid = |cell: usize| {
            if cell >= 96 && (16..32).contains(&(cell % 48)) { vec![] } else { vec![[BOTTOMLESS, 9]] }
        };
        let columns =
            Columns::new(&Solids::new(grid, Heights::between(0.0, 1.0).unwrap(), (0..144).map(solid)));
        let mut bits = Bits::default();
        bits.reset(8);
        (0..8).for_each(|strip| bits.set(strip));
        let mut spans = Vec::new();
        bits.find_spans(&columns, &mut spans);
        let found: Vec<_> = spans.iter().map(|span| (span.first, span.len, span.north, span.south)).collect();
        let expected =
            [(0, 3, NONE, 3), (3, 1, 0, 6), (4, 1, 1, NONE), (5, 1, 2, 7), (6, 1, 3, NONE), (7, 1, 5, NONE)];
        assert_eq!(found, expected);
    }

    #[test]
    fn bits_are_counted() {
        for bits in [0, 1, 3, 0x7fff, 0xffff, 0xfffe, 0x8001, 0x0ff0] {
            assert_eq!(count(bits), bits.count_ones(), "{bits:#x}");
        }
    }
}
