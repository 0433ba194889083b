//! Thickening: the viscosity depends on a scalar, as that of blood that clots with age and is diluted by irrigation.
//!
//! The drag of a pipe is 3 nu / H^2 over its openness (Eq. 4.5): a higher viscosity acts like a lower openness. Each frame starts from the
//! concentrations of its columns and uses the resulting openness in all its steps.

use super::Flow;
use crate::error::Result;
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::per_column::{Array, PerColumn};
use crate::shallow::columns::runs::runs;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_mut, strip_of};
use crate::shallow::params::Thickening;
use crate::shallow::pipes::{Links, Pipes};
use crate::shallow::scalars::check_scalar;
use crate::shallow::scalars::shares::{LEVELS, level};

/// The openness of pipes in a frame, if viscosity depends on a scalar; otherwise empty.
#[derive(Debug, Clone)]
pub(in crate::shallow) struct ThickenedPipes {
    /// As in [`Pipes`]; holds the pipes' own openness during a frame.
    east: PerColumn<f32>,
    south: PerColumn<f32>,
    links: Vec<f32>,
    /// Viscosity of each column, relative to the liquid's; padded by a strip, as depths are.
    viscosity: PerColumn<f32>,
}

impl ThickenedPipes {
    /// Without buffers.
    pub fn none() -> Self {
        Self {
            east: PerColumn::new(Array::OpenEast, 0, 0.0),
            south: PerColumn::new(Array::OpenSouth, 0, 0.0),
            links: Vec::new(),
            viscosity: PerColumn::new(Array::Light, 0, 0.0),
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let arrays = [&self.east, &self.south, &self.viscosity];
        arrays.into_iter().map(PerColumn::bytes).sum::<usize>() + size_of_val(&self.links[..])
    }

    /// Replaces the pipes' own openness by one that includes the viscosity.
    ///
    /// # Errors
    /// `Argument`: there is no such scalar.
    pub fn begin(
        &mut self,
        law: &Thickening,
        columns: &Columns,
        flow: &Flow,
        pipes: &mut Pipes,
    ) -> Result<()> {
        check_scalar(law.scalar, flow.amounts.count())?;
        self.fit(columns, &pipes.links);
        self.find_relative_viscosity(law, flow);
        self.east.copy_from_slice(&pipes.east);
        self.south.copy_from_slice(&pipes.south);
        for strip in runs(flow.active()).flatten() {
            let (depth, viscosity) = (*strip_of(&flow.depth, strip), *strip_of(&self.viscosity, strip));
            let beside = |to: usize| Ends {
                depth: [depth, numbers_from(&flow.depth, to)],
                viscosity: [viscosity, numbers_from(&self.viscosity, to)],
            };
            let east = beside(strip * STRIP + 1);
            divide_by_viscosity(&east, strip_mut(&mut self.east, strip));
            if let Some(south) = Some(columns.south(strip)).filter(|south| *south != NONE) {
                divide_by_viscosity(&beside(south as usize * STRIP), strip_mut(&mut self.south, strip));
            }
        }
        for link in 0..pipes.links.len() {
            let (from, to) = (pipes.links.from[link] as usize, pipes.links.to[link]);
            let to = if to == NONE { from } else { to as usize };
            let mean =
                mean([from, to].map(|end| flow.depth[end] as f32), [from, to].map(|end| self.viscosity[end]));
            self.links[link] = pipes.links.open[link] / mean;
        }
        self.swap_openness(pipes);
        Ok(())
    }

    /// Restores the pipes' own openness.
    pub fn end(&mut self, pipes: &mut Pipes) {
        self.swap_openness(pipes);
    }

    /// Exchanges the openness of the pipes with that stored here.
    fn swap_openness(&mut self, pipes: &mut Pipes) {
        std::mem::swap(&mut self.east, &mut pipes.east);
        std::mem::swap(&mut self.south, &mut pipes.south);
        std::mem::swap(&mut self.links, &mut pipes.links.open);
    }

    /// Resizes the buffers.
    fn fit(&mut self, columns: &Columns, links: &Links) {
        let len = columns.len();
        for (numbers, len) in
            [(&mut self.east, len), (&mut self.south, len), (&mut self.viscosity, len + STRIP)]
        {
            let old = numbers.len();
            if old != len {
                numbers.resize_part(0..old, len, 1.0);
            }
        }
        self.links.resize(links.len(), 0.0);
    }

    /// Finds the relative viscosity of the columns.
    fn find_relative_viscosity(&mut self, law: &Thickening, flow: &Flow) {
        let amounts = &flow.amounts;
        let range = amounts.scalars[law.scalar].range / LEVELS;
        // The level at which viscosity begins to change, and the part of the change per level.
        let (from, per_level) = (law.from / range, range / (law.to - law.from));
        let line = Line { from, per_level, rise: (law.times - 1.0) as f32 };
        for run in runs(flow.active()) {
            let run = run.start * STRIP..run.end * STRIP;
            let (amount, depth) = (&amounts.amounts[law.scalar][run.clone()], &flow.depth[run.clone()]);
            line.find(amount, depth, &mut self.viscosity[run]);
        }
    }
}

/// Relative viscosity at a level: 1 + rise * clamp((level - from) * per_level, 0, 1).
#[derive(Debug, Clone, Copy)]
struct Line {
    from: f64,
    per_level: f64,
    rise: f32,
}

impl Line {
    fn find(self, amount: &[f64], depth: &[i32], out: &mut [f32]) {
        let line = self;
        dispatch!(body(line: Line, amount: &[f64], depth: &[i32], out: &mut [f32]));

        #[inline(always)]
        fn body(line: Line, amount: &[f64], depth: &[i32], out: &mut [f32]) {
            for ((out, amount), depth) in out.iter_mut().zip(amount).zip(depth) {
                let part = ((level(*amount, *depth) - line.from) * line.per_level) as f32;
                let part = if part > 0.0 { part } else { 0.0 };
                *out = 1.0 + line.rise * if part < 1.0 { part } else { 1.0 };
            }
        }
    }
}

/// Depths (units) and relative viscosities of the columns at both ends of a strip's pipes.
struct Ends {
    depth: [[i32; STRIP]; 2],
    viscosity: [[f32; STRIP]; 2],
}

/// 16 numbers from an index on; defaults after the end of the array.
fn numbers_from<T: Copy + Default>(numbers: &[T], first: usize) -> [T; STRIP] {
    let mut out = [T::default(); STRIP];
    let end = numbers.len().min(first + STRIP);
    out[..end - first].copy_from_slice(&numbers[first..end]);
    out
}

/// Divides the openness of pipes by the mean viscosity at their ends.
#[inline(always)]
fn divide_by_viscosity(ends: &Ends, open: &mut [f32; STRIP]) {
    for (x, open) in open.iter_mut().enumerate() {
        let depth = [ends.depth[0][x] as f32, ends.depth[1][x] as f32];
        *open /= mean(depth, [ends.viscosity[0][x], ends.viscosity[1][x]]);
    }
}

/// The mean of two viscosities, weighted by depth; the same from either end, and 1 where all is dry.
#[inline(always)]
fn mean(depth: [f32; 2], viscosity: [f32; 2]) -> f32 {
    let all = depth[0] + depth[1];
    if all > 0.0 { (depth[0] * viscosity[0] + depth[1] * viscosity[1]) / all } else { 1.0 }
}
