//! Films that outrun waves, and whose inertia therefore counts less.
//!
//! In a film on a slope a disturbance travels at 3 u. Where waves are slower, at c, the liquid's inertia lets each bump grow: roll waves, which
//! liquid that carries its momentum along, and has surface tension, grows far more slowly if at all. A pipe between wet columns where
//! 3 u > c is *fast*: its inertia counts so much less that (c dt / dx)^2 is [`FAST_WAVES`]. What a steady film carries does not depend on its
//! inertia. Which pipes are fast is found at the start of each frame, from the state alone.

use std::ops::Range;

use super::active::Active;
use super::flux::{Step, greater, lesser};
use crate::base::cpu::dispatch;
use crate::shallow::columns::{Columns, NONE, resize_part};

/// (c dt / dx)^2 of a fast pipe: below 1/2, the bound of stability.
pub const FAST_WAVES: f32 = 0.35;
/// Inertia counts at most so many times less: what is shallower than that is never fast for long.
const LIGHTEST: f32 = 16.0;

/// Where inertia counts less.
#[derive(Debug, Clone)]
pub struct Fast {
    /// How many times less, in the pipes to the east and to the south; of rows that have fast pipes.
    light: [Vec<f32>; 2],
    rows: Vec<bool>,
}

/// What is fast is found in.
#[derive(Clone, Copy)]
pub struct Films<'a> {
    /// Columns.
    pub columns: &'a Columns,
    /// Strips that are worked on.
    pub active: &'a Active,
    /// H (units).
    pub depth: &'a [i32],
    /// Fluxes to the east and to the south (units in the last step).
    pub flux: [&'a [f32]; 2],
    /// g unit dt^2 / dx^2 of the last step (1 / units).
    pub drive: f32,
}

/// A span of a row and those to the south of it; the depths have one more than the fluxes: the column to the east.
#[derive(Clone, Copy)]
struct Span<'a> {
    depth: &'a [i32],
    south_depth: &'a [i32],
    flux: [&'a [f32]; 2],
}

impl Fast {
    /// Nothing is fast.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self { light: [vec![1.0; columns], vec![1.0; columns]], rows: vec![false; rows] }
    }

    /// Gives a part of the columns another count of indices.
    pub fn resize_part(&mut self, part: Range<usize>, len: usize) {
        self.rows.fill(false);
        self.light.iter_mut().for_each(|light| resize_part(light, part.clone(), len, 1.0));
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.light.iter().map(|light| size_of_val(&light[..])).sum::<usize>() + self.rows.len()
    }

    /// Whether a row has fast pipes.
    pub fn row(&self, row: usize) -> bool {
        self.rows[row]
    }

    /// How many times less inertia counts, in the pipes to the east and to the south of all columns.
    pub fn light(&self) -> [&[f32]; 2] {
        self.light.each_ref().map(Vec::as_slice)
    }

    /// Nothing is fast: there is no viscosity.
    pub fn clear(&mut self) {
        self.rows.fill(false);
    }

    /// Finds the rows with fast pipes; returns how far a disturbance goes at most in a step as long as the last one (cells).
    pub fn find(&mut self, films: &Films) -> f32 {
        let rows = &mut self.rows[..];
        dispatch!(find_rows(rows: &mut [bool], films: &Films) -> f32)
    }

    /// Finds how much less inertia counts in the fast pipes of those rows, for steps like one.
    pub fn lighten(&mut self, films: &Films, step: &Step) {
        let fast = self;
        dispatch!(lighten_rows(fast: &mut Fast, films: &Films, step: &Step))
    }
}

#[inline(always)]
fn find_rows(rows: &mut [bool], films: &Films) -> f32 {
    let mut farthest = 0;
    for (row, is_fast) in rows.iter_mut().enumerate() {
        *is_fast = false;
        for (_, span) in films.row(row) {
            if span.may_be_fast(films.drive) {
                let way = span.farthest(films.drive);
                *is_fast |= way > 0;
                farthest = farthest.max(way);
            }
        }
    }
    f32::from_bits(farthest as u32)
}

#[inline(always)]
fn lighten_rows(fast: &mut Fast, films: &Films, step: &Step) {
    let Fast { light: [light_east, light_south], rows } = fast;
    for row in (0..rows.len()).filter(|&row| rows[row]) {
        for (first, Span { depth, south_depth, flux: [east, south] }) in films.row(row) {
            let count = east.len();
            let (light_east, light_south) =
                (&mut light_east[first..first + count], &mut light_south[first..first + count]);
            let (depth, south_depth, south) = (&depth[..count + 1], &south_depth[..count], &south[..count]);
            for x in 0..count {
                let own = depth[x] as f32;
                let light = |depth: [f32; 2], flux: f32| light_of(films.drive, step, depth, flux);
                light_east[x] = light([own, depth[x + 1] as f32], east[x]);
                light_south[x] = light([own, south_depth[x] as f32], south[x]);
            }
        }
    }
}

impl<'a> Films<'a> {
    /// The spans of a row, by their first column.
    #[inline(always)]
    fn row(self, row: usize) -> impl Iterator<Item = (usize, Span<'a>)> {
        self.active.row(row).iter().map(move |span| {
            let (first, len) = (span.first as usize, span.len as usize);
            let south = if span.south == NONE { first } else { span.south as usize };
            let part = Span {
                depth: &self.depth[first..=first + len],
                south_depth: &self.depth[south..south + len],
                flux: self.flux.map(|flux| &flux[first..first + len]),
            };
            (first, part)
        })
    }
}

impl Span<'_> {
    /// Whether one of its pipes could be fast: its greatest flux, if it were through the shallowest.
    #[inline(always)]
    fn may_be_fast(&self, drive: f32) -> bool {
        let [east, south] = self.flux;
        let count = east.len();
        let (depth, south_depth, south) =
            (&self.depth[..count + 1], &self.south_depth[..count], &south[..count]);
        // Dry columns, behind all others here, have no fast pipes.
        let behind = |depth: i32| (depth as u32).wrapping_sub(1);
        let (mut greatest, mut shallowest) = (0, behind(depth[count]));
        for x in 0..count {
            // Numbers over 0 are in the order of their bits, and the greatest of integers is found for whole vectors at once.
            let [east, south] = [east[x], south[x]].map(|flux| flux.abs().to_bits() as i32);
            greatest = greatest.max(east.max(south));
            shallowest = shallowest.min(behind(depth[x]).min(behind(south_depth[x])));
        }
        is_fast(drive, shallowest as f32 + 1.0, f32::from_bits(greatest as u32))
    }

    /// How far a disturbance goes at most in the fast pipes in the last step (bits of a number of cells); 0: there is none.
    #[inline(always)]
    fn farthest(&self, drive: f32) -> i32 {
        let [east, south] = self.flux;
        let count = east.len();
        let (depth, south_depth, south) =
            (&self.depth[..count + 1], &self.south_depth[..count], &south[..count]);
        let mut farthest = 0;
        for x in 0..count {
            let own = depth[x] as f32;
            let east = way(drive, [own, depth[x + 1] as f32], east[x]).to_bits() as i32;
            let south = way(drive, [own, south_depth[x] as f32], south[x]).to_bits() as i32;
            farthest = farthest.max(east.max(south));
        }
        farthest
    }
}

/// Whether liquid in a section outruns waves.
#[inline(always)]
fn is_fast(drive: f32, section: f32, flux: f32) -> bool {
    9.0 * flux * flux > drive * section * section * section
}

/// How far a disturbance goes in a step (cells), where the pipe is fast; else 0.
#[inline(always)]
fn way(drive: f32, depth: [f32; 2], flux: f32) -> f32 {
    let giver = if flux > 0.0 { depth[0] } else { depth[1] };
    let is_wet = lesser(depth[0], depth[1]) > 0.0;
    let is_fast = is_fast(drive, 0.5 * (depth[0] + depth[1]), flux);
    if is_wet && is_fast { 3.0 * flux.abs() / greater(giver, 1.0) } else { 0.0 }
}

/// How many times less the inertia of a pipe counts in a step; `drive` is the last step's, in which the flux is.
#[inline(always)]
fn light_of(drive: f32, step: &Step, depth: [f32; 2], flux: f32) -> f32 {
    let mean = 0.5 * (depth[0] + depth[1]);
    let is_wet = lesser(depth[0], depth[1]) > 0.0;
    let light = lesser(step.lighter / greater(lesser(mean, step.section), 1.0), LIGHTEST);
    if is_wet && is_fast(drive, mean, flux) { greater(light, 1.0) } else { 1.0 }
}

/// As the others, of a link, whose flux is in the last step's measure, about as long as this one.
#[inline(always)]
pub fn light(step: &Step, depth: [f32; 2], flux: f32) -> f32 {
    light_of(step.drive, step, depth, flux)
}
