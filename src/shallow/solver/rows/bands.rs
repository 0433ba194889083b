//! Multithreaded steps: each thread works on a band of rows.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::band_views::{BEYOND, BandView, Part, RowCopies};
use super::buffers::RowBuffers;
use super::filling::Filling;
use super::{StepInputs, StepResults};
use crate::shallow::columns::{Columns, STRIP, strip_of};
use crate::shallow::solver::full::SLACK;
use crate::shallow::solver::transfers::scale;
use crate::shallow::solver::viscous_flux::Step;

/// Minimum columns for a step to be divided among threads: with fewer, starting the threads takes longer than they save.
pub const MIN_COLUMNS: usize = 100_000;
/// Minimum rows of a band, to limit the work that neighbouring bands both do.
const MIN_ROWS: usize = 32;

/// A band of rows and its buffers.
#[derive(Debug, Clone)]
struct Band {
    rows: Range<usize>,
    buffers: RowBuffers,
    before: RowCopies,
    behind: RowCopies,
    results: StepResults,
}

/// The bands of a domain.
#[derive(Debug, Clone)]
pub struct Bands {
    list: Vec<Band>,
    /// Minimum height between base and ceiling in each row (units).
    clearance: Vec<i32>,
    /// Upper bound of the depth in each row (units).
    deepest: Vec<i32>,
    /// Whether columns of each row might fill up to their ceiling in this step.
    may_fill: Vec<bool>,
    /// Lower bound of the room of the columns of each row (units).
    room: Vec<f32>,
    /// Whether each row might have full columns.
    may_be_full: Vec<bool>,
    /// Bound of a column's inflow, in multiples of the maximum of its own depth and those beside it.
    inflow_bound: i64,
    /// Count of scalars that the liquid carries.
    scalars: usize,
}

impl Bands {
    /// One band, over columns that have at most `pipes` pipes each.
    pub fn new(columns: &Columns, pipes: usize) -> Self {
        let count = columns.grid.size[1];
        let mut bands = Self {
            list: Vec::new(),
            clearance: (0..count).map(|row| clearance(columns, row)).collect(),
            deepest: vec![0; count],
            may_fill: vec![false; count],
            room: vec![0.0; count],
            may_be_full: vec![false; count],
            inflow_bound: pipes as i64 + 1,
            scalars: 0,
        };
        bands.divide(columns, 1);
        bands
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let woken = |band: &Band| band.results.woken.capacity() * size_of::<u32>();
        let bands: usize = self.list.iter().map(|band| band.buffers.bytes() + woken(band)).sum();
        bands
            + size_of_val(&self.clearance[..])
            + size_of_val(&self.deepest[..])
            + size_of_val(&self.room[..])
            + 2 * self.may_fill.len()
    }

    /// Divides the rows into a band for each thread, with about equally many strips, unless they already are.
    pub fn divide(&mut self, columns: &Columns, threads: usize) {
        let rows = columns.grid.size[1];
        let wanted = if columns.len() < MIN_COLUMNS { 1 } else { threads.min(rows / MIN_ROWS).max(1) };
        if self.list.len() == wanted {
            return;
        }
        let strips = columns.strips().len();
        let (mut start, scalars) = (0, self.scalars);
        let band = |number: usize| {
            let end = if number + 1 == wanted {
                rows
            } else {
                // Ends where its share of the strips does, but leaves each band the minimum count of rows.
                let before = strips * (number + 1) / wanted;
                let reserved = (wanted - 1 - number) * MIN_ROWS;
                let even = (0..rows).find(|&row| columns.row(row).end >= before).unwrap_or(rows);
                even.clamp(start + MIN_ROWS, rows - reserved)
            };
            let rows = start..end;
            start = end;
            Band {
                rows,
                buffers: RowBuffers::new(columns, scalars),
                before: RowCopies::default(),
                behind: RowCopies::default(),
                results: StepResults { woken: Vec::with_capacity(strips), ..StepResults::default() },
            }
        };
        self.list = (0..wanted).map(band).collect();
    }

    /// Makes buffers for liquid with `scalars` scalars.
    pub fn set_scalar_count(&mut self, columns: &Columns, scalars: usize) {
        let threads = self.list.len();
        self.scalars = scalars;
        self.list.clear();
        self.divide(columns, threads);
    }

    /// Updates what is known of rows whose columns have changed.
    pub fn refit(&mut self, columns: &Columns, pipes: usize, rows: Range<usize>, depth: &[i32]) {
        self.inflow_bound = pipes as i64 + 1;
        for row in rows.clone() {
            self.clearance[row] = clearance(columns, row);
            let depths = &depth[super::band_views::indices(columns, &(row..row + 1))];
            self.deepest[row] = depths.iter().copied().max().unwrap_or(0);
        }
        for band in &mut self.list {
            band.buffers.widen(columns, rows.clone());
            band.results.woken.reserve(columns.strips().len());
        }
    }

    /// Records that a column of a row has this depth (units).
    pub fn deepen(&mut self, row: usize, depth: i32) {
        self.deepest[row] = self.deepest[row].max(depth);
    }

    /// Upper bound of the depth (units).
    pub fn deepest(&self) -> i32 {
        self.deepest.iter().copied().max().unwrap_or(0)
    }

    /// Upper bound of the depth in each row (units).
    pub(in crate::shallow) fn row_depths(&self) -> &[i32] {
        &self.deepest
    }

    /// As [`Bands::row_depths`], to restore them.
    pub(in crate::shallow) fn row_depths_mut(&mut self) -> &mut [i32] {
        &mut self.deepest
    }

    /// The rows found by [`Bands::find_filling`].
    pub fn filling(&self) -> Filling<'_> {
        Filling { may_fill: &self.may_fill, may_be_full: &self.may_be_full }
    }

    /// Finds the rows with columns that might fill up; returns whether there is one.
    pub fn find_filling(&mut self) -> bool {
        let mut any = false;
        for row in 0..self.deepest.len() {
            let around = row.saturating_sub(1)..(row + 2).min(self.deepest.len());
            let deepest = self.deepest[around].iter().copied().max().unwrap_or(0);
            self.may_fill[row] = self.inflow_bound * i64::from(deepest) > i64::from(self.clearance[row]);
            self.room[row] = scale::room(0, self.clearance[row], self.deepest[row]);
            self.may_be_full[row] = self.deepest[row] >= self.clearance[row] - self.clearance[row] / SLACK;
            any |= self.may_fill[row];
        }
        any
    }

    /// One step; sets the rows of `inputs` that may fill.
    pub fn step(&mut self, step: &Step, inputs: &StepInputs, liquid: Part) {
        let Self { list, deepest, may_fill, room, .. } = self;
        let inputs = StepInputs { may_fill, room, ..*inputs };
        let (columns, links) = (inputs.columns, &inputs.pipes.links);
        let rows = columns.grid.size[1];
        for band in &mut *list {
            let Range { start, end } = band.rows;
            band.before.take(columns, links, start.saturating_sub(BEYOND)..start, &liquid);
            band.behind.take(columns, links, end..(end + BEYOND).min(rows), &liquid);
        }
        run(list, step, &inputs, liquid, deepest);
    }

    /// Whether a step is divided.
    pub fn is_divided(&self) -> bool {
        self.list.len() > 1
    }

    /// The results of the bands, in order.
    pub fn results(&mut self) -> impl Iterator<Item = &mut StepResults> {
        self.list.iter_mut().map(|band| &mut band.results)
    }
}

/// Runs bands in parallel.
fn run(bands: &mut [Band], step: &Step, inputs: &StepInputs, liquid: Part, deepest: &mut [i32]) {
    match bands {
        [] => {}
        [band] => {
            let (columns, links) = (inputs.columns, &inputs.pipes.links);
            let (before, behind) = (band.before.part(columns, links), band.behind.part(columns, links));
            let mut view = BandView::new(band.rows.clone(), before, liquid, behind);
            band.buffers.step(step, inputs, &mut view, deepest, &mut band.results);
        }
        _ => {
            let (first, others) = bands.split_at_mut(bands.len() / 2);
            let (row, start) = (others[0].rows.start, first[0].rows.start);
            let [low, high] = liquid.split(inputs.columns, &inputs.pipes.links, row);
            let (deepest_low, deepest_high) = deepest.split_at_mut(row - start);
            rayon::join(
                || run(first, step, inputs, low, deepest_low),
                || run(others, step, inputs, high, deepest_high),
            );
        }
    }
}

/// Runs the steps of a frame while the other threads of the pool stay awake for their bands: waking a thread takes longer than one band of
/// a step. If no thread is free, the frame's own thread does all the work.
pub fn with_spinning_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let done = AtomicBool::new(false);
    let ended = &done;
    let work = move || {
        // Also set if the work panics.
        let _end = SetOnDrop(ended);
        work()
    };
    rayon::join(work, || spin_until_done(threads.saturating_sub(1), ended)).0
}

/// Runs jobs of the pool on `threads` threads until the frame is done.
fn spin_until_done(threads: usize, ended: &AtomicBool) {
    let wait = || {
        while !ended.load(Ordering::Acquire) {
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                std::hint::spin_loop();
            }
        }
    };
    if threads > 1 {
        rayon::join(wait, || spin_until_done(threads - 1, ended));
    } else {
        wait();
    }
}

/// Sets a flag when it is dropped.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// Minimum height between base and ceiling of a row's columns (units).
fn clearance(columns: &Columns, row: usize) -> i32 {
    let mut clearance = i32::MAX;
    for strip in columns.row(row) {
        let present = columns.present(strip);
        let (base, ceiling) = (strip_of(columns.bases(), strip), strip_of(columns.ceilings(), strip));
        for x in 0..STRIP {
            // A column without any room is a wall.
            let is_room = present >> x & 1 == 1 && ceiling[x] > base[x];
            let room = if is_room { ceiling[x] - base[x] } else { i32::MAX };
            clearance = clearance.min(room);
        }
    }
    clearance
}
