//! Finds which columns are wet and which quartets are full or odd. Most quartets are full, which comparisons of whole strips detect.

use super::links::LiquidColumns;
use super::strips::{Found, Span, State, count, neighbour};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{Columns, STRIP};

/// Finds the wet columns, and the strips whose quartets may have one.
pub(in crate::shallow::surface) fn find_wet(
    liquid: LiquidColumns<'_>,
    active: Option<&[bool]>,
    found: &mut Found,
) {
    dispatch!(find_wet_strips(liquid: LiquidColumns<'_>, active: Option<&[bool]>, found: &mut Found))
}

#[inline(always)]
fn find_wet_strips(liquid: LiquidColumns<'_>, active: Option<&[bool]>, found: &mut Found) {
    let columns = liquid.columns;
    for (strip, depth) in liquid.depth.as_chunks::<STRIP>().0.iter().enumerate() {
        if active.is_some_and(|active| !active[strip]) {
            continue;
        }
        let mut wet = 0;
        for (position, depth) in depth.iter().enumerate() {
            wet |= if *depth > 0 { 1 << position } else { 0u32 };
        }
        if wet != 0 {
            found.states[strip].wet = wet as u16;
            found.candidates.set(strip);
            for side in [columns.north(strip), columns.south(strip)].into_iter().filter_map(neighbour) {
                found.candidates.set(side);
            }
        }
    }
    found.find_spans(columns);
}

/// Depth, base, ceiling and underside: each at 16 positions, and at the 16 positions one cell to the east.
type Windows<'a> = [[&'a [i32; STRIP]; 2]; 4];

/// Finds the quartets that are linked as a whole (the highest of their heights is below the lowest ceiling, the lowest not below the
/// highest underside), and those whose sum of heights is larger at the ends of the diagonal from north-east to south-west.
#[inline(always)]
fn compare([depth, base, ceiling, under]: Windows<'_>, south: Windows<'_>) -> [u16; 2] {
    let [depth_s, base_s, ceiling_s, under_s] = south;
    let (mut linked, mut max) = (0u32, 0u32);
    for position in 0..STRIP {
        let north = |at: usize| base[at][position].wrapping_add(depth[at][position].max(0));
        let south = |at: usize| base_s[at][position].wrapping_add(depth_s[at][position].max(0));
        let [a, b, c, d] = [north(0), north(1), south(0), south(1)];
        let least = |[n, n_east]: [&[i32; STRIP]; 2], [s, s_east]: [&[i32; STRIP]; 2]| {
            n[position].min(n_east[position]).min(s[position].min(s_east[position]))
        };
        let most = |[n, n_east]: [&[i32; STRIP]; 2], [s, s_east]: [&[i32; STRIP]; 2]| {
            n[position].max(n_east[position]).max(s[position].max(s_east[position]))
        };
        let highest = a.max(b).max(c.max(d));
        let lowest = a.min(b).min(c.min(d));
        let is_linked = (lowest >= most(under, under_s)) & (highest < least(ceiling, ceiling_s));
        linked |= if is_linked { 1 << position } else { 0 };
        // a + d < b + c, without overflow.
        max |= if a.wrapping_sub(b) < c.wrapping_sub(d) { 1 << position } else { 0 };
    }
    [linked as u16, max as u16]
}

/// Finds the full quartets and their vertices, and the odd quartets.
pub(in crate::shallow::surface) fn find_full(liquid: LiquidColumns<'_>, found: &mut Found) {
    dispatch!(find_full_spans(liquid: LiquidColumns<'_>, found: &mut Found))
}

#[inline(always)]
fn find_full_spans(liquid: LiquidColumns<'_>, found: &mut Found) {
    let columns = liquid.columns;
    let heights = PaddedHeights::of(liquid);
    for at in 0..found.spans.len() {
        let span = found.spans[at];
        let ends = Ends::of(columns, found, &span);
        let [mut west, mut north_west] = [ends.west, ends.north_west].map(|slot| found.states[slot]);
        let mut wet = [span.first, found.slot(neighbour(span.south))].map(|slot| found.states[slot].wet);
        for step in 0..span.len {
            let strip = span.first + step;
            let south = neighbour(span.south).map(|south| south + step);
            let north = found.states[neighbour(span.north).map_or(ends.none, |north| north + step)];
            let wet_east = ends.slots_to_the_east(&span, step).map(|slot| found.states[slot].wet);
            let [full, turned] = south.map_or([0; 2], |south| {
                let corners =
                    [wet[0], from_east(wet[0], wet_east[0]), wet[1], from_east(wet[1], wet_east[1])];
                heights.full_quartets([strip, south], corners, ends.whole_quartets(&span, step))
            });
            found.full_triangles += 2 * count(full) as usize;
            let covered =
                [full, from_west(full, west.full), north.full, from_west(north.full, north_west.full)];
            let state = &mut found.states[strip];
            (state.full, state.turned) = (full, turned);
            state.used = covered[0] | covered[1] | covered[2] | covered[3];
            state.sides = [
                (covered[1] | covered[3]) & from_west(wet[0], west.wet),
                (covered[0] | covered[2]) & from_east(wet[0], wet_east[0]),
                (covered[2] | covered[3]) & north.wet,
                (covered[0] | covered[1]) & wet[1],
            ];
            if wet[0] & !(covered[0] & covered[1] & covered[2] & covered[3]) != 0 {
                add_odd(columns, found, strip, covered);
            }
            west = State { wet: wet[0], full, ..west };
            (north_west, wet) = (north, wet_east);
        }
    }
}

/// Depths, bases, ceilings and undersides, where the last strip too is followed by a position.
struct PaddedHeights<'a> {
    arrays: [&'a [i32]; 4],
    last: usize,
    /// The last strip's.
    ends: [[i32; STRIP + 1]; 4],
}

impl<'a> PaddedHeights<'a> {
    fn of(liquid: LiquidColumns<'a>) -> Self {
        let columns = liquid.columns;
        let arrays = [liquid.depth, columns.bases(), columns.ceilings(), columns.unders()];
        let mut ends = [[0; STRIP + 1]; 4];
        for (end, numbers) in ends.iter_mut().zip(arrays) {
            end[..STRIP].copy_from_slice(numbers.last_chunk::<STRIP>().unwrap_or(&[0; STRIP]));
        }
        Self { arrays, last: columns.strips().len().saturating_sub(1), ends }
    }

    /// The full quartets between a strip and the one to the south, and which of these are divided from north-east to south-west. `wet`:
    /// the wet corners of each quartet (north-west, north-east, south-west, south-east); `whole`: the quartets with four columns.
    #[inline(always)]
    fn full_quartets(&self, [strip, south]: [usize; 2], wet: [u16; 4], whole: u16) -> [u16; 2] {
        let any = wet[0] | wet[1] | wet[2] | wet[3];
        if any == 0 {
            return [0; 2];
        }
        // The strip itself is not the last one: the one to the south comes later.
        let windows_south = if south == self.last {
            windows(self.ends.each_ref().map(|end| end.as_slice()), 0)
        } else {
            windows(self.arrays, south)
        };
        let [linked, max] = compare(windows(self.arrays, strip), windows_south);
        let full = linked & any & whole;
        [full, full & choose(wet, max)]
    }
}

/// Indices in `states` of strips at the ends of a span, in its own row and in those to the north and south.
struct Ends {
    west: usize,
    east: usize,
    north_west: usize,
    south_east: usize,
    /// The first to the south.
    south: Option<usize>,
    /// That of no strip.
    none: usize,
}

impl Ends {
    fn of(columns: &Columns, found: &Found, span: &Span) -> Self {
        let end = span.len - 1;
        Self {
            west: found.slot(columns.west(span.first)),
            east: found.slot(columns.east(span.first + end)),
            north_west: found.slot(neighbour(span.north).and_then(|north| columns.west(north))),
            south_east: found.slot(neighbour(span.south).and_then(|south| columns.east(south + end))),
            south: neighbour(span.south),
            none: found.states.len() - 1,
        }
    }

    /// The quartets of the strip at `step` with columns to the east: all but one at the end of a layer.
    #[inline(always)]
    fn whole_quartets(&self, span: &Span, step: usize) -> u16 {
        let lacks_east = self.east == self.none || self.south_east == self.none;
        if step + 1 == span.len && lacks_east { u16::MAX >> 1 } else { u16::MAX }
    }

    /// The strip to the east of the one at `step`, and the one to the south of that.
    #[inline(always)]
    fn slots_to_the_east(&self, span: &Span, step: usize) -> [usize; 2] {
        if step + 1 == span.len {
            [self.east, self.south_east]
        } else {
            [span.first + step + 1, self.south.map_or(self.none, |south| south + step + 1)]
        }
    }
}

/// Each position of a strip gets the value of the position to the east; the last one gets that of the first position of the strip to the
/// east.
#[inline(always)]
fn from_east(own: u16, east: u16) -> u16 {
    own >> 1 | east << 15
}

/// Each position of a strip gets the value of the position to the west.
#[inline(always)]
fn from_west(own: u16, west: u16) -> u16 {
    own << 1 | west >> 15
}

/// The windows of a strip; the next strip follows to the east of its last position.
#[inline(always)]
fn windows(arrays: [&[i32]; 4], strip: usize) -> Windows<'_> {
    let [a, b, c, d] = arrays;
    [window(a, strip), window(b, strip), window(c, strip), window(d, strip)]
}

#[inline(always)]
fn window(numbers: &[i32], strip: usize) -> [&[i32; STRIP]; 2] {
    let window: &[i32; STRIP + 1] = numbers[strip * STRIP..].first_chunk().expect("a strip follows");
    [window.first_chunk().expect("16 of 17"), window.last_chunk().expect("16 of 17")]
}

/// The quartets to divide from north-east to south-west, given the wet corners, and the quartets (`max`) where the sum of heights is larger
/// along that diagonal.
#[inline(always)]
fn choose([a, b, c, d]: [u16; 4], max: u16) -> u16 {
    if a & b & c & d == u16::MAX {
        return max;
    }
    // Whether the ends of the diagonals from north-west and from north-east are both wet or both dry.
    let (from_west_end, from_east_end) = (!(a ^ d), !(b ^ c));
    let all_alike = !(a ^ b);
    let both = from_west_end & from_east_end & (all_alike & max | !all_alike & b);
    let neither = !from_west_end & !from_east_end & max;
    from_east_end & !from_west_end | both | neither
}

/// Marks the odd quartets around a strip's wet columns. `covered`: the columns whose quartet to the south-east, south-west, north-east and
/// north-west is full.
fn add_odd(columns: &Columns, found: &mut Found, strip: usize, covered: [u16; 4]) {
    let position = columns.strips()[strip];
    let (row, at) = (position.row as usize, position.at as usize);
    let [nx, nz] = columns.grid.size;
    let wet = found.states[strip].wet;
    // Columns with a cell to the east and to the west.
    let has_east =
        if (at + 1) * STRIP >= nx { ((1u32 << (nx - 1 - at * STRIP)) - 1) as u16 } else { u16::MAX };
    let has_west = if at == 0 { u16::MAX << 1 } else { u16::MAX };
    let (mut here, mut before) = ([0; 2], [0; 2]);
    if row + 1 < nz {
        here = [wet & has_east & !covered[0], wet & has_west & !covered[1]];
    }
    if row > 0 {
        before = [wet & has_east & !covered[2], wet & has_west & !covered[3]];
    }
    found.states[strip].in_odd = here[0] | here[1] | before[0] | before[1];
    let mut add = |block: usize, odd: u16| {
        if odd != 0 {
            found.blocks[block].odd |= odd;
            found.odd.set(block);
        }
    };
    let block = row * found.across + at;
    add(block, here[0] | here[1] >> 1);
    if here[1] & 1 != 0 {
        add(block - 1, 1 << 15);
    }
    if row > 0 {
        add(block - found.across, before[0] | before[1] >> 1);
        if before[1] & 1 != 0 {
            add(block - found.across - 1, 1 << 15);
        }
    }
}
