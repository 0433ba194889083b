//! Liquid whose viscosity depends on what it carries: blood that clots with age, and that irrigation thins.
//!
//! What holds a pipe back is 3 nu / H^2 over its openness (Eq. 4.5): more viscosity is less openness. Each frame begins with the concentrations of its columns; the
//! steps of the frame then have the openness that these leave.

use super::Flow;
use super::active::runs;
use crate::error::{Error, Result};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::per_column::{Array, PerColumn};
use crate::shallow::columns::{Columns, NONE, STRIP, strip_mut, strip_of};
use crate::shallow::pipes::{Links, Pipes};
use crate::shallow::scalars::check_scalar;
use crate::shallow::scalars::shares::{LEVELS, level};

/// How viscosity depends on a scalar: it is the liquid's up to `from`, and `times` that from `to` on; between them it grows with the concentration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thickening {
    /// Which scalar: an age, of blood that clots; a dye, of what is mixed.
    pub scalar: usize,
    /// Concentration up to which it is the liquid's, in the scalar's own measure.
    pub from: f64,
    /// Concentration from which on it is `times` that; it may be the lesser one.
    pub to: f64,
    /// 1e-6 to 1e9.
    pub times: f64,
}

impl Thickening {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        let Self { from, to, times, .. } = *self;
        if !(from.is_finite() && to.is_finite() && from != to) {
            return Err(Error::argument(format!(
                "thickening.from = {from} and thickening.to = {to} are not finite and apart"
            )));
        }
        if !(1e-6..=1e9).contains(&times) {
            return Err(Error::argument(format!("thickening.times = {times} is not within 1e-6 to 1e9")));
        }
        Ok(())
    }
}

/// The openness of pipes in a frame, where the liquid thickens; else empty.
#[derive(Debug, Clone)]
pub(in crate::shallow) struct Thick {
    /// As in [`Pipes`]; the pipes' own while a frame lasts.
    east: PerColumn<f32>,
    south: PerColumn<f32>,
    links: Vec<f32>,
    /// Viscosity of each column, over the liquid's; padded by a strip, as depths are.
    times: PerColumn<f32>,
}

impl Thick {
    /// No room yet.
    pub fn none() -> Self {
        Self {
            east: PerColumn::new(Array::OpenEast, 0, 0.0),
            south: PerColumn::new(Array::OpenSouth, 0, 0.0),
            links: Vec::new(),
            times: PerColumn::new(Array::Light, 0, 0.0),
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let arrays = [&self.east, &self.south, &self.times];
        arrays.into_iter().map(PerColumn::bytes).sum::<usize>() + size_of_val(&self.links[..])
    }

    /// Puts the openness that the liquid leaves in place of the pipes' own.
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
        self.find_times(law, flow);
        self.east.copy_from_slice(&pipes.east);
        self.south.copy_from_slice(&pipes.south);
        for strip in runs(flow.active()).flatten() {
            let (depth, times) = (*strip_of(&flow.depth, strip), *strip_of(&self.times, strip));
            let beside = |to: usize| Ends {
                depth: [depth, numbers_from(&flow.depth, to)],
                times: [times, numbers_from(&self.times, to)],
            };
            let east = beside(strip * STRIP + 1);
            close(&east, strip_mut(&mut self.east, strip));
            if let Some(south) = Some(columns.south(strip)).filter(|south| *south != NONE) {
                close(&beside(south as usize * STRIP), strip_mut(&mut self.south, strip));
            }
        }
        for link in 0..pipes.links.len() {
            let (from, to) = (pipes.links.from[link] as usize, pipes.links.to[link]);
            let to = if to == NONE { from } else { to as usize };
            let mean =
                mean([from, to].map(|end| flow.depth[end] as f32), [from, to].map(|end| self.times[end]));
            self.links[link] = pipes.links.open[link] / mean;
        }
        self.change_positions(pipes);
        Ok(())
    }

    /// Puts the pipes' own openness back.
    pub fn end(&mut self, pipes: &mut Pipes) {
        self.change_positions(pipes);
    }

    fn change_positions(&mut self, pipes: &mut Pipes) {
        std::mem::swap(&mut self.east, &mut pipes.east);
        std::mem::swap(&mut self.south, &mut pipes.south);
        std::mem::swap(&mut self.links, &mut pipes.links.open);
    }

    /// Makes room.
    fn fit(&mut self, columns: &Columns, links: &Links) {
        let len = columns.len();
        for (numbers, len) in [(&mut self.east, len), (&mut self.south, len), (&mut self.times, len + STRIP)]
        {
            let old = numbers.len();
            if old != len {
                numbers.resize_part(0..old, len, 1.0);
            }
        }
        self.links.resize(links.len(), 0.0);
    }

    /// Finds the viscosity of the columns.
    fn find_times(&mut self, law: &Thickening, flow: &Flow) {
        let amounts = &flow.amounts;
        let range = amounts.scalars[law.scalar].range / LEVELS;
        // Levels over `from`, and what a level adds.
        let (from, each) = (law.from / range, range / (law.to - law.from));
        let line = Line { from, each, rise: (law.times - 1.0) as f32 };
        for run in runs(flow.active()) {
            let run = run.start * STRIP..run.end * STRIP;
            let (amount, depth) = (&amounts.amounts[law.scalar][run.clone()], &flow.depth[run.clone()]);
            line.find(amount, depth, &mut self.times[run]);
        }
    }
}

/// Viscosity over the liquid's, of a level: 1 + rise (level - from) each, the part between 0 and 1.
#[derive(Debug, Clone, Copy)]
struct Line {
    from: f64,
    each: f64,
    rise: f32,
}

impl Line {
    fn find(self, amount: &[f64], depth: &[i32], out: &mut [f32]) {
        let line = self;
        dispatch!(body(line: Line, amount: &[f64], depth: &[i32], out: &mut [f32]));

        #[inline(always)]
        fn body(line: Line, amount: &[f64], depth: &[i32], out: &mut [f32]) {
            for ((out, amount), depth) in out.iter_mut().zip(amount).zip(depth) {
                let part = ((level(*amount, *depth) - line.from) * line.each) as f32;
                let part = if part > 0.0 { part } else { 0.0 };
                *out = 1.0 + line.rise * if part < 1.0 { part } else { 1.0 };
            }
        }
    }
}

/// Depths (units) and viscosities of the columns at both ends of a strip's pipes.
struct Ends {
    depth: [[i32; STRIP]; 2],
    times: [[f32; STRIP]; 2],
}

/// A strip's numbers from an index on; where the array ends, none are left for what is not there.
fn numbers_from<T: Copy + Default>(numbers: &[T], first: usize) -> [T; STRIP] {
    let mut out = [T::default(); STRIP];
    let end = numbers.len().min(first + STRIP);
    out[..end - first].copy_from_slice(&numbers[first..end]);
    out
}

/// Makes pipes less open, by the mean viscosity at their ends.
#[inline(always)]
fn close(ends: &Ends, open: &mut [f32; STRIP]) {
    for (x, open) in open.iter_mut().enumerate() {
        let depth = [ends.depth[0][x] as f32, ends.depth[1][x] as f32];
        *open /= mean(depth, [ends.times[0][x], ends.times[1][x]]);
    }
}

/// The mean of two viscosities by the depths that have them; the same from both ends, and 1 where all is dry.
#[inline(always)]
fn mean(depth: [f32; 2], times: [f32; 2]) -> f32 {
    let all = depth[0] + depth[1];
    if all > 0.0 { (depth[0] * times[0] + depth[1] * times[1]) / all } else { 1.0 }
}
