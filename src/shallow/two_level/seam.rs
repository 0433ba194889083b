//! The pipes between fine and coarse columns, along the edge of the near cells.
//!
//! Each leads from a fine cell across its side to the coarse one beyond. Eq. 4.1 and 4.5 are evaluated over the distance between their
//! middles, 1.5 fine cells, with the cross-section of the fine cell. The coarse surface is evaluated beside the fine cell's middle, a
//! quarter of a coarse cell to the side, with the slope given by the coarse columns along the edge: otherwise a film that runs along the
//! edge would oscillate across it.

use super::FINE_PER_COARSE;
use super::remainders::{Contents, Remainders, add_to_column, of_column};
use crate::numeric::cpu::dispatch;
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::grid::{Cells, TOP};
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::scalars::shares::level;
use crate::shallow::solver::fast_films;
use crate::shallow::solver::viscous_flux::{Step, StepKind, by_kind, flux_of, whole_and_remainder};
use crate::shallow::time_step::Measures;
use crate::shallow::{Shallow, time_step};

/// Distance between the middles of a fine and a coarse cell (fine cells).
const DISTANCE: f32 = 1.5;
/// Keeps scaled transfers slightly below what is available, in 32 bits.
const MARGIN: f32 = 1.0 - 1.0 / (1 << 20) as f32;

/// A pipe.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pipe {
    /// Columns of the fine and of the coarse liquid.
    ends: [u32; 2],
    /// The previous and next coarse columns along the edge, or [`NONE`].
    neighbours: [u32; 2],
    /// Where the fine cell lies along the edge, relative to the middle of the coarse one: -1 before it, 1 after it.
    side: i32,
    /// Direction to the coarse column: along x or z, and -1 or 1.
    axis: usize,
    direction: i32,
    /// See [`openness`].
    open: f32,
    /// Flux out of the fine column (fine units a step).
    flux: f32,
    /// Rounding remainder of the flux.
    remainder: f32,
    /// Whole fine units that move in this step.
    transfer: f32,
}

/// All pipes along the edge.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow) struct Seam {
    pipes: Vec<Pipe>,
    /// The previous pipes.
    old: Vec<Pipe>,
    /// Columns of both liquids at such pipes, in order, each once.
    columns: [Vec<u32>; 2],
    /// For each pipe, the positions of its ends among these columns.
    positions: Vec<[u32; 2]>,
    /// What each of these columns gives and takes (fine units).
    gives: [Vec<f64>; 2],
    takes: [Vec<f64>; 2],
    /// K_min or K_max of each of these columns.
    factors: [Vec<f32>; 2],
    /// For each of these columns, what it takes of each scalar minus what it gives; empty without scalars.
    amounts: [Vec<[i64; MAX_SCALARS]>; 2],
    /// Cell of each coarse column (`Grid::index`).
    cells: Vec<u32>,
    /// Whether any of these columns has a ceiling.
    has_ceilings: bool,
    /// Whether any pipe has a transfer in this step.
    is_moving: bool,
    /// Length of the step that fluxes refer to (s).
    pub last: f64,
}

impl Seam {
    /// Finds the pipes again; those between the same columns keep their flux.
    pub fn find(&mut self, fine: &Shallow, coarse: &Shallow, near: &Cells) {
        std::mem::swap(&mut self.pipes, &mut self.old);
        self.pipes.clear();
        for axis in 0..2 {
            let sides = [(near[axis].start, -1), (near[axis].end - 1, 1)];
            for (across, direction) in sides {
                for along in near[1 - axis].clone() {
                    let cell = if axis == 0 { [across, along] } else { [along, across] };
                    self.join(fine, coarse, cell, axis, direction);
                }
            }
        }
        let key = |pipe: &Pipe| (pipe.axis, pipe.direction, pipe.ends);
        self.pipes.sort_unstable_by_key(key);
        let mut old = self.old.iter().peekable();
        for pipe in &mut self.pipes {
            while old.next_if(|old| key(old) < key(pipe)).is_some() {}
            if let Some(same) = old.next_if(|old| key(old) == key(pipe)) {
                (pipe.flux, pipe.remainder) = (same.flux, same.remainder);
            }
        }
        for end in 0..2 {
            let columns = &mut self.columns[end];
            refill(columns, self.pipes.iter().map(|pipe| pipe.ends[end]));
            columns.sort_unstable();
            columns.dedup();
            for sums in [&mut self.gives[end], &mut self.takes[end]] {
                reset(sums, columns.len(), 0.0);
            }
            self.factors[end].resize(columns.len(), 1.0);
        }
        let cell = |&column: &u32| coarse.columns.grid.index(coarse.columns.cell(column as usize)) as u32;
        let is_open = |(liquid, columns): (&Shallow, &Vec<u32>)| {
            columns.iter().all(|&column| liquid.columns.ceilings()[column as usize] == TOP)
        };
        self.has_ceilings = ![fine, coarse].into_iter().zip(&self.columns).all(is_open);
        refill(&mut self.cells, self.columns[1].iter().map(cell));
        let position =
            |end: usize, column: u32| self.columns[end].partition_point(|&other| other < column) as u32;
        self.positions.clear();
        let positions = self.pipes.iter().map(|pipe| [position(0, pipe.ends[0]), position(1, pipe.ends[1])]);
        self.positions.extend(positions);
        if self.last == 0.0 {
            self.last = 1.0;
        }
    }

    /// Adds the pipes between the columns of a fine cell and those of the coarse cell across one of its sides.
    fn join(&mut self, fine: &Shallow, coarse: &Shallow, cell: [usize; 2], axis: usize, direction: i32) {
        let size = fine.columns.grid.size;
        let beyond = cell[axis].wrapping_add_signed(direction as isize);
        if beyond >= size[axis] {
            return;
        }
        let mut other = cell.map(|at| at / 2);
        other[axis] = beyond / 2;
        let side = if cell[1 - axis].is_multiple_of(2) { -1 } else { 1 };
        for i in fine.columns.of_cell(cell) {
            for j in coarse.columns.of_cell(other) {
                let bottom = fine.columns.bases()[i].max(coarse.columns.bases()[j]);
                if bottom >= fine.columns.ceilings()[i].min(coarse.columns.ceilings()[j]) {
                    continue;
                }
                let layer = coarse.columns.layer(j);
                let neighbours = [-1, 1].map(|step| {
                    let mut cell = other;
                    cell[1 - axis] = cell[1 - axis].wrapping_add_signed(step);
                    let column = coarse.columns.column(cell, layer);
                    let column = column.filter(|&column| coarse.columns.overlap(j, column));
                    column.map_or(NONE, |column| column as u32)
                });
                self.pipes.push(Pipe {
                    ends: [i as u32, j as u32],
                    neighbours,
                    side,
                    axis,
                    direction,
                    open: openness(fine, coarse, [i, j], neighbours),
                    flux: 0.0,
                    remainder: 0.0,
                    transfer: 0.0,
                });
            }
        }
    }

    /// Flux of the pipe of a fine column across a side (fine units a step); 0 if there is none.
    pub fn flux(&self, column: usize, axis: usize, direction: i32) -> f32 {
        self.find_pipe(column, axis, direction).map_or(0.0, |pipe| self.pipes[pipe].flux)
    }

    /// Sets the flux that [`Seam::flux`] returns, if there is a pipe.
    pub fn set_flux(&mut self, column: usize, axis: usize, direction: i32, flux: f32) {
        if let Some(pipe) = self.find_pipe(column, axis, direction) {
            self.pipes[pipe].flux = flux;
        }
    }

    /// Flux and rounding remainder of each pipe, in order: the part of a saved state that describes the edge.
    pub fn numbers(&self) -> impl ExactSizeIterator<Item = [f32; 2]> + '_ {
        self.pipes.iter().map(|pipe| [pipe.flux, pipe.remainder])
    }

    /// Restores what [`Seam::numbers`] returned, and the length of the last step.
    pub fn set_numbers(&mut self, last: f64, numbers: impl Iterator<Item = [f32; 2]>) {
        self.last = last;
        for (pipe, [flux, remainder]) in self.pipes.iter_mut().zip(numbers) {
            (pipe.flux, pipe.remainder) = (flux, remainder);
        }
    }

    fn find_pipe(&self, column: usize, axis: usize, direction: i32) -> Option<usize> {
        let wanted = (axis, direction, column as u32);
        let key = |pipe: &Pipe| (pipe.axis, pipe.direction, pipe.ends[0]);
        let pipe = self.pipes.partition_point(|pipe| key(pipe) < wanted);
        self.pipes.get(pipe).filter(|pipe| key(pipe) == wanted).map(|_| pipe)
    }

    /// Finds the fluxes of a step of `length` (s), from the surfaces before the step, as for all other pipes: with later surfaces, waves
    /// would grow.
    pub fn begin_step(&mut self, fine: &Shallow, coarse: &Shallow, measures: &Measures, length: f64) {
        let step = time_step::step(&fine.params, measures, length, self.last);
        let step = Step { drive: step.drive / DISTANCE, ..step };
        self.last = length;
        let (seam, step) = (&mut *self, &step);
        self.is_moving = by_kind!(step, K =>
            dispatch!(Seam::drive::<K>(seam: &mut Seam, step: &Step, fine: &Shallow, coarse: &Shallow) -> bool));
    }

    /// Makes the transfers across the edge, limited to the liquid and the room that the step has left in the columns.
    pub fn end_step(&mut self, fine: &mut Shallow, coarse: &mut Shallow, remainders: &mut Remainders) {
        if !self.is_moving {
            return;
        }
        for gives in [true, false] {
            if (gives || self.has_ceilings) && self.find_factors(gives, fine, coarse) {
                self.scale(gives);
            }
        }
        self.move_units(fine, coarse, remainders);
    }

    /// Finds all fluxes and transfers; returns whether there is a transfer.
    #[inline(always)]
    fn drive<K: StepKind>(&mut self, step: &Step, fine: &Shallow, coarse: &Shallow) -> bool {
        let (bases, coarse_bases) = (fine.columns.bases(), coarse.columns.bases());
        let (depths, coarse_depths) = (fine.flow.depths(), coarse.flow.depths());
        let Self { pipes, positions, gives, takes, .. } = self;
        let mut any = false;
        for (pipe, position) in pipes.iter_mut().zip(positions) {
            let [i, j] = pipe.ends.map(|end| end as usize);
            let depth = [depths[i], coarse_depths[j]];
            if depth == [0; 2] {
                (pipe.flux, pipe.remainder, pipe.transfer) = (0.0, 0.0, 0.0);
                continue;
            }
            let eta = coarse_bases[j] + depth[1];
            let beside = |end: u32| {
                let end = end as usize;
                (end != NONE as usize && coarse_depths[end] > 0)
                    .then(|| i64::from(coarse_bases[end] + coarse_depths[end]))
            };
            // Eight times the rise over a quarter of a coarse cell to the side.
            let rise =
                if depth[1] == 0 { 0 } else { rise(i64::from(eta), pipe.neighbours.map(beside)) as i32 };
            // The tilt of gravity is per cell.
            let tilt = (DISTANCE * step.tilt[pipe.axis] as f32) as i32 * pipe.direction;
            let fall = bases[i] + depth[0] - eta - (pipe.side * rise) / 8 + tilt;
            let depth = depth.map(|depth| depth as f32);
            let light = if K::VISCOUS && !K::WHOLE { fast_films::light(step, depth, pipe.flux) } else { 1.0 };
            let flux = flux_of::<K>(step, fall, depth, pipe.flux, pipe.open, light);
            pipe.flux = step.rest_if_slow::<K>(fall, depth, flux);
            [pipe.transfer, pipe.remainder] = whole_and_remainder(pipe.flux, pipe.remainder);
            if pipe.transfer != 0.0 {
                any = true;
                add(gives, takes, position, pipe.transfer);
            }
        }
        any
    }

    /// Finds K_min of the columns that give, or K_max of those that take, ignoring their outflow; returns whether one is below 1.
    fn find_factors(&mut self, gives: bool, fine: &Shallow, coarse: &Shallow) -> bool {
        let Self { gives: given, takes: taken, factors, columns, .. } = self;
        let sums = if gives { given } else { taken };
        let mut any = false;
        factors.iter_mut().for_each(|factors| factors.fill(1.0));
        for (end, liquid) in [fine, coarse].into_iter().enumerate() {
            let fine_units = if end == 0 { 1.0 } else { FINE_PER_COARSE as f64 };
            for ((&sum, factor), &column) in sums[end].iter().zip(&mut factors[end]).zip(&columns[end]) {
                let column = column as usize;
                let depth = liquid.flow.depths()[column];
                let room = liquid.columns.ceilings()[column] - liquid.columns.bases()[column] - depth;
                // With its remainder, a coarse column may take up to a unit more than it is given.
                let available = if gives { depth } else { room - 1 };
                let available = fine_units * f64::from(available.max(0));
                // This is rare.
                if sum > available {
                    (*factor, any) = ((available / sum) as f32 * MARGIN, true);
                }
            }
        }
        any
    }

    /// Multiplies transfers by the factors of the columns that give, or of those that take.
    fn scale(&mut self, gives: bool) {
        let Self { pipes, positions, gives: given, takes: taken, factors, .. } = self;
        given.iter_mut().chain(&mut *taken).for_each(|sums| sums.fill(0.0));
        for (pipe, positions) in pipes.iter_mut().zip(positions) {
            let end = usize::from((pipe.transfer > 0.0) != gives);
            let factor = factors[end][positions[end] as usize];
            if factor < 1.0 {
                pipe.transfer = (pipe.transfer * factor).trunc();
                pipe.flux *= factor;
            }
            add(given, taken, positions, pipe.transfer);
        }
    }

    /// Moves whole fine units with what they carry; a remainder of less than a coarse unit waits in its cell.
    fn move_units(&mut self, fine: &mut Shallow, coarse: &mut Shallow, remainders: &mut Remainders) {
        self.find_amounts(fine, coarse);
        let Self { gives, takes, columns, cells, amounts, .. } = self;
        let net = |end: usize, position: usize| Contents {
            units: (takes[end][position] - gives[end][position]) as i64,
            amounts: amounts[end].get(position).copied().unwrap_or_default(),
        };
        for (position, &column) in columns[0].iter().enumerate() {
            add_to_column(fine, column as usize, &net(0, position));
        }
        for (position, (&column, &cell)) in columns[1].iter().zip(&*cells).enumerate() {
            let net = net(1, position);
            if net != Contents::default() {
                // All of the column, with the remainder of its cell.
                let own = of_column(coarse, column as usize);
                let now = remainders.take_whole_units(cell as usize, &own.in_fine().plus(&net));
                add_to_column(coarse, column as usize, &now.minus(&own));
            }
        }
        for liquid in [fine, coarse] {
            liquid.remap.held.unite();
        }
        self.gives.iter_mut().chain(&mut self.takes).for_each(|sums| sums.fill(0.0));
    }

    /// Finds how much of each scalar every column takes (minus what it gives): a pipe moves it at the concentration of the donor.
    fn find_amounts(&mut self, fine: &Shallow, coarse: &Shallow) {
        let Self { pipes, positions, columns, amounts, .. } = self;
        let count = fine.flow.amounts.count();
        for (amounts, columns) in amounts.iter_mut().zip(columns) {
            reset(amounts, if count > 0 { columns.len() } else { 0 }, [0; MAX_SCALARS]);
        }
        if count == 0 {
            return;
        }
        for (pipe, positions) in pipes.iter().zip(positions).filter(|(pipe, _)| pipe.transfer != 0.0) {
            let end = usize::from(pipe.transfer < 0.0);
            let (liquid, column) = ([fine, coarse][end], pipe.ends[end] as usize);
            let (depth, units) = (liquid.flow.depths()[column], f64::from(pipe.transfer.abs()));
            let carried = liquid.flow.amounts.amounts.iter().take(count);
            for (at, own) in carried.enumerate() {
                let moved = (level(own[column], depth) * units).round_ties_even() as i64;
                amounts[end][positions[end] as usize][at] -= moved;
                amounts[1 - end][positions[1 - end] as usize][at] += moved;
            }
        }
    }
}

/// Adds a transfer to the sums of both ends: integers, so that the order does not matter.
fn add(gives: &mut [Vec<f64>; 2], takes: &mut [Vec<f64>; 2], positions: &[u32; 2], transfer: f32) {
    let [fine, coarse] = positions.map(|position| position as usize);
    let units = f64::from(transfer.abs());
    if transfer > 0.0 {
        gives[0][fine] += units;
        takes[1][coarse] += units;
    } else {
        gives[1][coarse] += units;
        takes[0][fine] += units;
    }
}

/// The rise of a surface from the column before a given one to the column after it; if only one of the two is wet, twice the rise on its
/// side.
pub(super) fn rise(own: i64, sides: [Option<i64>; 2]) -> i64 {
    match sides {
        [Some(before), Some(after)] => after - before,
        [Some(before), None] => 2 * (own - before),
        [None, Some(after)] => 2 * (after - own),
        [None, None] => 0,
    }
}

/// 1 / (1 + slope^2)^2 of the ground between both columns, as for all other pipes; slopes are clamped to 60 degrees.
fn openness(fine: &Shallow, coarse: &Shallow, [i, j]: [usize; 2], neighbours: [u32; 2]) -> f32 {
    let bases = |columns: &Columns, column: usize| f64::from(columns.bases()[column]);
    let cell = fine.columns.grid.cell / fine.columns.heights.unit;
    let across = match neighbours.map(|end| (end != NONE).then(|| bases(&coarse.columns, end as usize))) {
        [Some(before), Some(after)] => (after - before) / (4.0 * cell),
        [Some(before), None] => (bases(&coarse.columns, j) - before) / (2.0 * cell),
        [None, Some(after)] => (after - bases(&coarse.columns, j)) / (2.0 * cell),
        [None, None] => 0.0,
    };
    let down = (bases(&fine.columns, i) - bases(&coarse.columns, j)) / (f64::from(DISTANCE) * cell);
    let square = (down * down + across * across).min(3.0);
    (1.0 / ((1.0 + square) * (1.0 + square))) as f32
}
