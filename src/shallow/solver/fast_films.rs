//! Fast films: they outrun waves, and their inertia is reduced.
//!
//! In a film on a slope a disturbance travels at three times the liquid's velocity u. Where waves are slower, at c, the liquid's inertia
//! lets each bump grow: roll waves. In real liquid, which advects its momentum and has surface tension, they grow far more slowly, if at
//! all. A pipe between wet columns where 3 u > c is *fast*: its inertia is divided so that (c dt / dx)^2 is [`FAST_WAVES`]. The discharge
//! of a steady film does not depend on its inertia. Which pipes are fast is found at the start of each frame, from the state alone. Where
//! a disturbance would travel further than a cell in a step, and grow, the flux of a fast pipe is limited.

use std::ops::Range;

use super::active::Active;
use super::viscous_flux::{Step, max, min};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::per_column::{Array, PerColumn};
use crate::shallow::columns::{NONE, STRIP, resize_part, strip_from, strip_of};

/// (c dt / dx)^2 of a fast pipe: below 1/2, the bound of stability.
pub const FAST_WAVES: f32 = 0.35;
/// Maximum inertia divisor: films so shallow that they would need more do not stay fast for long.
const MAX_LIGHT: f32 = 16.0;
/// Minimum inertia divisor of a fast pipe: once packed, it must differ from 1, which all other pipes have.
const MIN_LIGHT: f32 = 1.0 + 1.0 / 128.0;

/// Inertia divisors of a column whose pipes are not fast (`packed`).
pub const NORMAL: u32 = 0x3f80_3f80;

/// Where inertia is reduced.
#[derive(Debug, Clone)]
pub struct Fast {
    /// Inertia divisors of the pipes of each column, to the east and to the south ([`packed`]); only valid in rows that have fast pipes.
    pub(super) light: PerColumn<u32>,
    /// Whether each strip has fast pipes; only valid in rows that have some.
    pub(super) strips: Vec<bool>,
    rows: Vec<bool>,
}

/// The liquid that is searched for fast films.
#[derive(Clone, Copy)]
pub struct Films<'a> {
    /// Active strips.
    pub active: &'a Active,
    /// H (units).
    pub depth: &'a [i32],
    /// Fluxes to the east and to the south (units in the last step).
    pub flux: [&'a [f32]; 2],
    /// g unit dt^2 / dx^2 of the last step (1 / units).
    pub drive: f32,
}

/// A span of a row and the columns to the south of it; the depths have one more element than the fluxes: the column to the east.
#[derive(Clone, Copy)]
struct FilmSpan<'a> {
    depth: &'a [i32],
    south_depth: &'a [i32],
    flux: [&'a [f32]; 2],
}

impl Fast {
    /// Nothing is fast.
    pub fn new(columns: usize, rows: usize) -> Self {
        let light = PerColumn::new(Array::Light, columns, packed(1.0, 1.0));
        Self { light, strips: vec![false; columns / STRIP], rows: vec![false; rows] }
    }

    /// Changes the count of indices of a part of the columns.
    pub fn resize_part(&mut self, part: Range<usize>, len: usize) {
        self.rows.fill(false);
        resize_part(&mut self.strips, part.start / STRIP..part.end / STRIP, len / STRIP, false);
        self.light.resize_part(part, len, packed(1.0, 1.0));
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.light.bytes() + self.strips.len() + self.rows.len()
    }

    /// Whether a row has fast pipes.
    pub fn row(&self, row: usize) -> bool {
        self.rows[row]
    }

    /// Marks nothing as fast: there is no viscosity.
    pub fn clear(&mut self) {
        self.rows.fill(false);
    }

    /// Finds the rows with fast pipes. Returns the smallest power of two, in cells, that no disturbance exceeds in a step `step` times as
    /// long as the last one, or `max_cells` if that is less.
    pub fn find(&mut self, films: &Films, step: f32, max_cells: u32) -> u32 {
        let rows = &mut self.rows[..];
        dispatch!(find_rows(rows: &mut [bool], films: &Films, step: f32, max_cells: u32) -> u32)
    }

    /// Finds the inertia divisors of the fast pipes of those rows, for steps like `step`.
    pub fn reduce_inertia(&mut self, films: &Films, step: &Step) {
        let fast = self;
        dispatch!(reduce_inertia_rows(fast: &mut Fast, films: &Films, step: &Step))
    }
}

#[inline(always)]
fn find_rows(rows: &mut [bool], films: &Films, step: f32, max_cells: u32) -> u32 {
    let mut cells = 1;
    for (row, is_fast) in rows.iter_mut().enumerate() {
        // Rows that were fast mostly still are.
        let was_fast = std::mem::take(is_fast);
        for (_, span) in films.row(row) {
            if was_fast || span.may_be_fast(films.drive) {
                if cells < max_cells {
                    let [any, mut farther] = span.find::<true>(films.drive, step / cells as f32);
                    *is_fast |= any;
                    while farther && cells < max_cells {
                        cells *= 2;
                        farther = span.find::<true>(films.drive, step / cells as f32)[1];
                    }
                } else if !*is_fast {
                    [*is_fast, _] = span.find::<false>(films.drive, 0.0);
                }
            }
        }
    }
    cells
}

#[inline(always)]
fn reduce_inertia_rows(fast: &mut Fast, films: &Films, step: &Step) {
    let Fast { light, strips: is_fast, rows } = fast;
    for row in (0..rows.len()).filter(|&row| rows[row]) {
        // Includes strips that wake up during this frame.
        let strips = films.active.strips(row);
        light[strips.start * STRIP..strips.end * STRIP].fill(packed(1.0, 1.0));
        is_fast[strips].fill(false);
        for (first, span) in films.row(row) {
            let light = &mut light[first..first + span.flux[0].len()];
            for (at, light) in light.as_chunks_mut().0.iter_mut().enumerate() {
                is_fast[first / STRIP + at] = reduce_inertia_strip(&span.strip(at), films.drive, step, light);
            }
        }
    }
}

#[inline(always)]
fn reduce_inertia_strip(strip: &Strip, drive: f32, step: &Step, light: &mut [u32; STRIP]) -> bool {
    let mut any = 0;
    let Strip { depth, east_depth, south_depth, flux: [east, south] } = strip;
    for x in 0..STRIP {
        let [own, to_east, to_south] = [depth[x], east_depth[x], south_depth[x]].map(|depth| depth as f32);
        let east = light_of(drive, step, [own, to_east], east[x]);
        light[x] = packed(east, light_of(drive, step, [own, to_south], south[x]));
        any |= light[x] ^ NORMAL;
    }
    any != 0
}

/// A strip of a span.
struct Strip<'a> {
    depth: &'a [i32; STRIP],
    east_depth: &'a [i32; STRIP],
    south_depth: &'a [i32; STRIP],
    flux: [&'a [f32; STRIP]; 2],
}

impl<'a> Films<'a> {
    /// The spans of a row, by their first column.
    #[inline(always)]
    fn row(self, row: usize) -> impl Iterator<Item = (usize, FilmSpan<'a>)> {
        self.active.row(row).iter().map(move |span| {
            let (first, len) = (span.first as usize, span.len as usize);
            let south = if span.south == NONE { first } else { span.south as usize };
            let part = FilmSpan {
                depth: &self.depth[first..=first + len],
                south_depth: &self.depth[south..south + len],
                flux: self.flux.map(|flux| &flux[first..first + len]),
            };
            (first, part)
        })
    }
}

impl<'a> FilmSpan<'a> {
    /// Count of its strips.
    #[inline(always)]
    fn strips(&self) -> usize {
        self.flux[0].len() / STRIP
    }

    #[inline(always)]
    fn strip(&self, at: usize) -> Strip<'a> {
        Strip {
            depth: strip_of(self.depth, at),
            east_depth: strip_from(self.depth, at * STRIP + 1),
            south_depth: strip_of(self.south_depth, at),
            flux: self.flux.map(|flux| strip_of(flux, at)),
        }
    }

    /// Whether one of its pipes could be fast: tests the largest flux with the smallest depth.
    #[inline(always)]
    fn may_be_fast(&self, drive: f32) -> bool {
        // Maps dry columns, which have no fast pipes, to the maximum.
        let less_one = |depth: i32| (depth as u32).wrapping_sub(1);
        let (mut max_flux, mut min_depth) = ([0; STRIP], [u32::MAX; STRIP]);
        for at in 0..self.strips() {
            let Strip { depth, south_depth, flux: [east, south], .. } = self.strip(at);
            for x in 0..STRIP {
                // Positive floats order like their bits, and a maximum of integers vectorises.
                let [east, south] = [east[x], south[x]].map(|flux| flux.abs().to_bits() as i32);
                max_flux[x] = max_flux[x].max(east.max(south));
                min_depth[x] = min_depth[x].min(less_one(depth[x]).min(less_one(south_depth[x])));
            }
        }
        let last = less_one(self.depth[self.flux[0].len()]);
        let min_depth = min_depth.into_iter().fold(last, u32::min) as f32 + 1.0;
        let max_flux = max_flux.into_iter().fold(0, i32::max);
        is_fast(drive, [min_depth; 2], f32::from_bits(max_flux as u32))
    }

    /// Whether one of its pipes is fast; with `TRAVEL`, also whether a disturbance in a fast pipe travels further than a cell in a step
    /// `step` times as long as the last one.
    #[inline(always)]
    fn find<const TRAVEL: bool>(&self, drive: f32, step: f32) -> [bool; 2] {
        let (mut any, mut farther) = ([0; STRIP], [0; STRIP]);
        for at in 0..self.strips() {
            let Strip { depth, east_depth, south_depth, flux: [east, south] } = self.strip(at);
            for x in 0..STRIP {
                let [own, to_east, to_south] =
                    [depth[x], east_depth[x], south_depth[x]].map(|depth| depth as f32);
                for (depth, flux) in [([own, to_east], east[x]), ([own, to_south], south[x])] {
                    let is_fast = i32::from(is_fast(drive, depth, flux));
                    any[x] |= is_fast;
                    if TRAVEL {
                        let donor = if flux > 0.0 { depth[0] } else { depth[1] };
                        farther[x] |= is_fast & i32::from(3.0 * step * flux.abs() > donor);
                    }
                }
            }
        }
        [any, farther].map(|found| found != [0; STRIP])
    }
}

/// Whether the liquid of a pipe between wet columns outruns waves.
#[inline(always)]
fn is_fast(drive: f32, depth: [f32; 2], flux: f32) -> bool {
    let mean = 0.5 * (depth[0] + depth[1]);
    (9.0 * flux * flux > drive * mean * mean * mean) & (min(depth[0], depth[1]) > 0.0)
}

/// The inertia divisor of a pipe in a step; `drive` is that of the last step, which the flux refers to.
#[inline(always)]
fn light_of(drive: f32, step: &Step, depth: [f32; 2], flux: f32) -> f32 {
    let section = min(0.5 * (depth[0] + depth[1]), step.section);
    let light = min(step.light_depth / max(section, 1.0), MAX_LIGHT);
    if is_fast(drive, depth, flux) { max(light, MIN_LIGHT) } else { 1.0 }
}

/// As `light_of`, for a link: its flux refers to the last step, which is about as long as this one.
#[inline(always)]
pub fn light(step: &Step, depth: [f32; 2], flux: f32) -> f32 {
    light_of(step.drive, step, depth, flux)
}

/// Packs two inertia divisors, each truncated to its upper 16 bits: the discharge of a steady film does not depend on them.
#[inline(always)]
fn packed(east: f32, south: f32) -> u32 {
    east.to_bits() >> 16 | south.to_bits() & 0xffff_0000
}
