//! Lateral friction: of pipes at walls, and between liquids that flow side by side at different speeds.
//!
//! With a velocity of u phi(z / H), where phi is the profile of a wide film, the momentum along a pipe, weighted by phi and integrated over
//! the depth (Galerkin), gives
//!
//! du/dt = g S - k nu u / H^2 + 6/5 nu d2u/dy2
//!
//! with k = 3 below a free surface, and 12 below a ceiling; 6/5 is the mean of phi^2, and u is 0 at a wall. The discharge of a closed
//! square duct is 0.7 % below the exact value (White, *Viscous Fluid Flow*, 3-3.3), that of a channel as deep as it is wide 2.8 % below;
//! flatter ones are closer.
//!
//! Differences in y (across the pipe) are between a pipe and those beside it; a wall lies half a cell from it. The surroundings of a pipe
//! (`surroundings.rs`) are the mean of those of the columns at its ends, so that they are the same from either end. All pipes beside each
//! other form a line along x or z, which is solved at once (`lines.rs`): neither viscosity nor depth limits the step. Films thinner than a
//! sixteenth of a cell have no lateral friction. Where a row and the next one have only such films, nothing is computed.

mod buffers;
mod flooded;
mod lines;
mod surroundings;

pub use buffers::LateralFriction;
use buffers::Numbers;
use std::ops::Range;

use super::active::Active;
use super::fast_films::Fast;
use super::pressurised::network::Network;
use super::viscous_flux::Step;
use crate::numeric::lists::{refill, reset, split_each};
use crate::shallow::columns::grid::TOP;
use crate::shallow::columns::{Columns, STRIP, strip_of};
use crate::shallow::pipes::{Links, Pipes};

/// Steps of a frame after which the surroundings of columns are found again.
const STEPS: u32 = 8;
/// Minimum columns for strips to be divided among threads.
const MIN_COLUMNS: usize = 64 * STRIP;

/// The liquid whose friction is computed.
#[derive(Clone, Copy)]
pub struct Liquid<'a> {
    pub columns: &'a Columns,
    pub pipes: &'a Pipes,
    pub active: &'a Active,
    pub fast: &'a Fast,
    pub network: &'a Network,
    /// H (units), padded by a strip: SIMD loads may read past the last index.
    pub depth: &'a [i32],
    /// Fluxes to the east and to the south (units in the last step).
    pub flux: [&'a [f32]; 2],
    /// Upper bound of the depth of each row (units).
    pub row_depths: &'a [i32],
    /// Whether the work is divided among threads.
    pub is_divided: bool,
}

impl LateralFriction {
    /// Allocates memory for the friction of these columns.
    pub fn enable(&mut self, columns: &Columns) {
        self.is_on = true;
        self.fit(columns);
    }

    /// Adapts to changed columns.
    pub fn fit(&mut self, columns: &Columns) {
        if !self.is_on {
            return;
        }
        let (strips, len) = (columns.strips().len(), columns.len());
        self.age = 0;
        reset(&mut self.rows, columns.grid.size[1], false);
        self.strips.clear();
        self.strips.reserve(strips);
        reset(&mut self.has_surroundings, strips, false);
        reset(&mut self.linked, strips, [0; 4]);
        let has_roof = |strip| strip_of(columns.ceilings(), strip).iter().any(|&ceiling| ceiling < TOP);
        refill(&mut self.roofed, (0..strips).map(has_roof));
        if self.len != len {
            self.len = len;
            for (position, numbers) in self.surroundings.iter_mut().flatten().enumerate() {
                numbers.fit(position, len);
            }
            self.lines.fit(columns);
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let numbers = self.surroundings.iter().flatten().map(|numbers| size_of_val(&numbers.list[..]));
        numbers.sum::<usize>() + self.lines.bytes() + self.rows.len() + 14 * self.has_surroundings.len()
    }

    /// Begins a frame.
    pub fn begin_frame(&mut self) {
        self.age = 0;
    }

    /// Whether the fluxes of a row's pipes are solved with lateral friction.
    #[inline(always)]
    pub fn includes_row(&self, row: usize) -> bool {
        self.is_on && self.rows[row]
    }

    /// Fluxes of rows with lateral friction, to the east and to the south (units in this step).
    pub fn solved(&self) -> [&[f32]; 2] {
        self.lines.solved()
    }

    /// Begins a step; every few steps finds where pipes may have lateral friction.
    pub fn begin_step(&mut self, step: &Step, links: &Links, columns: &Columns, row_depths: &[i32]) {
        if !self.is_on {
            return;
        }
        if step.lateral == 0.0 {
            self.rows.fill(false);
            return;
        }
        if self.age.is_multiple_of(STEPS) {
            let is_deep = |row: usize| {
                row_depths.get(row).is_some_and(|&deepest| surroundings::has_friction(step, deepest))
            };
            for (row, has) in self.rows.iter_mut().enumerate() {
                *has = is_deep(row) || is_deep(row + 1);
            }
            self.mark_links(links, columns);
        }
    }

    /// Computes the fluxes of all pipes with lateral friction; those of the network are already known.
    pub fn find(&mut self, step: &Step, liquid: &Liquid) {
        if !self.is_on || step.lateral == 0.0 {
            return;
        }
        let is_outdated = self.age.is_multiple_of(STEPS);
        self.age += 1;
        if is_outdated {
            self.has_surroundings.fill(false);
        }
        self.strips.clear();
        let active = &liquid.active.active;
        for row in (0..self.rows.len()).filter(|&row| self.rows[row]) {
            let strips = liquid.active.strips(row).filter(|&strip| active[strip]);
            self.strips.extend(strips.map(|strip| strip as u32));
        }
        if self.strips.is_empty() {
            return;
        }
        if is_outdated {
            self.find_surroundings(step, liquid);
        }
        for &strip in &self.strips {
            let strip = strip as usize;
            if !std::mem::replace(&mut self.has_surroundings[strip], true) && !is_outdated {
                // It was dry when the surroundings were found.
                for numbers in self.surroundings.iter_mut().flatten() {
                    numbers.all_mut()[strip * STRIP..][..STRIP].fill(0.0);
                }
            }
        }
        let Self { strips, has_surroundings, surroundings, lines, .. } = self;
        lines.solve(step, liquid, strips, has_surroundings, surroundings);
    }

    /// Marks the positions of strips from which links lead over a side: there is no wall.
    fn mark_links(&mut self, links: &Links, columns: &Columns) {
        if self.has_links {
            self.linked.fill([0; 4]);
        }
        self.has_links = !links.is_empty();
        for link in 0..links.len() {
            let (from, to, side) = (links.from[link] as usize, links.to[link] as usize, links.sides[link]);
            self.linked[from / STRIP][side as usize] |= 1 << (from % STRIP);
            if to < columns.len() {
                self.linked[to / STRIP][side.opposite() as usize] |= 1 << (to % STRIP);
            }
        }
    }

    fn find_surroundings(&mut self, step: &Step, liquid: &Liquid) {
        let Self { strips, roofed, linked, surroundings, .. } = self;
        let around = surroundings::Around { columns: liquid.columns, depth: liquid.depth, roofed, linked };
        let len = liquid.columns.len();
        let work = |range: Range<usize>, out: [&mut [f32]; 6]| {
            surroundings::find(step, &around, within(strips, &range), range.start, out);
        };
        spread(liquid.is_divided, 0..len / STRIP, numbers_of(surroundings, len), &work);
    }
}

/// The first `len` numbers of six lists.
fn numbers_of(lists: &mut [[Numbers; 3]; 2], len: usize) -> [&mut [f32]; 6] {
    let [[a, b, c], [d, e, f]] =
        lists.each_mut().map(|axis| axis.each_mut().map(|numbers| &mut numbers.all_mut()[..len]));
    [a, b, c, d, e, f]
}

/// Those strips of a sorted list that are within a range.
fn within<'a>(strips: &'a [u32], range: &Range<usize>) -> &'a [u32] {
    let at = |end: usize| strips.partition_point(|&strip| (strip as usize) < end);
    &strips[at(range.start)..at(range.end)]
}

/// Calls `work` with ranges of strips and their parts of lists, on several threads if `is_divided`.
fn spread<const N: usize>(
    is_divided: bool,
    strips: Range<usize>,
    out: [&mut [f32]; N],
    work: &(impl Fn(Range<usize>, [&mut [f32]; N]) + Sync),
) {
    if !is_divided || strips.len() * STRIP <= MIN_COLUMNS {
        return work(strips, out);
    }
    let half = strips.len() / 2;
    let middle = strips.start + half;
    let [before, behind] = split_each(out, half * STRIP);
    rayon::join(
        || spread(true, strips.start..middle, before, work),
        || spread(true, middle..strips.end, behind, work),
    );
}
