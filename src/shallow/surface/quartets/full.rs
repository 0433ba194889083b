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
    let arrays = [liquid.depth, columns.bases(), columns.ceilings(), columns.unders()];
    // No position follows the last strip: its arrays are padded.
    let last = columns.strips().len().saturating_sub(1);
    let mut ends = [[0; STRIP + 1]; 4];
    for (end, numbers) in ends.iter_mut().zip(arrays) {
        end[..STRIP].copy_from_slice(numbers.last_chunk::<STRIP>().unwrap_or(&[0; STRIP]));
    }
    for at in 0..found.spans.len() {
        let span = found.spans[at];
        let (first, end) = (span.first, span.len - 1);
        let none = found.states.len() - 1;
        let corners = Corners::of(columns, found, &span);
        let [mut west, mut north_west] = [corners.west, corners.north_west].map(|slot| found.states[slot]);
        let mut wet = found.states[first].wet;
        let mut wet_south = found.states[found.slot(neighbour(span.south))].wet;
        for step in 0..span.len {
            let strip = first + step;
            let wet_east = found.states[if step == end { corners.east } else { strip + 1 }].wet;
            let mut wet_south_east = 0;
            let (mut full, mut turned) = (0, 0);
            if let Some(south) = neighbour(span.south).map(|south| south + step) {
                wet_south_east = found.states[if step == end { corners.south_east } else { south + 1 }].wet;
                let wets = [wet, from_east(wet, wet_east), wet_south, from_east(wet_south, wet_south_east)];
                let any = wets[0] | wets[1] | wets[2] | wets[3];
                if any != 0 {
                    let windows_south = if south == last {
                        windows(ends.each_ref().map(|end| end.as_slice()), 0)
                    } else {
                        windows(arrays, south)
                    };
                    let [linked, max] = compare(windows(arrays, strip), windows_south);
                    full = linked & any;
                    if step == end && (corners.east == none || corners.south_east == none) {
                        full &= 0x7fff;
                    }
                    turned = full & choose(wets, max);
                    found.full_triangles += 2 * count(full) as usize;
                }
            }
            let north = found.states[neighbour(span.north).map_or(none, |north| north + step)];
            let covered =
                [full, from_west(full, west.full), north.full, from_west(north.full, north_west.full)];
            let state = &mut found.states[strip];
            (state.full, state.turned) = (full, turned);
            state.used = covered[0] | covered[1] | covered[2] | covered[3];
            state.sides = [
                (covered[1] | covered[3]) & from_west(wet, west.wet),
                (covered[0] | covered[2]) & from_east(wet, wet_east),
                (covered[2] | covered[3]) & north.wet,
                (covered[0] | covered[1]) & wet_south,
            ];
            west = State { wet, full, ..west };
            north_west = north;
            if wet & !(covered[0] & covered[1] & covered[2] & covered[3]) != 0 {
                add_odd(columns, found, strip, covered);
            }
            (wet, wet_south) = (wet_east, wet_south_east);
        }
    }
}

/// Indices in `states` of strips at the ends of a span, in its own row and in those to the north and south.
struct Corners {
    west: usize,
    east: usize,
    north_west: usize,
    south_east: usize,
}

impl Corners {
    fn of(columns: &Columns, found: &Found, span: &Span) -> Self {
        let end = span.len - 1;
        Self {
            west: found.slot(columns.west(span.first)),
            east: found.slot(columns.east(span.first + end)),
            north_west: found.slot(neighbour(span.north).and_then(|north| columns.west(north))),
            south_east: found.slot(neighbour(span.south).and_then(|south| columns.east(south + end))),
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
