//! A copy of the liquid for a renderer: another thread may read it while the next frame is computed.

use std::ops::Range;

use crate::error::Result;
use crate::numeric::checks::check_room;
use crate::numeric::cpu::dispatch;
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::runs::{fill_runs, runs};
use crate::shallow::columns::{Columns, NONE, STRIP};
use crate::shallow::free_fall::Droplet;
use crate::shallow::scalars::{MAX_SCALARS, find_concentrations};
use crate::shallow::solver::Flow;
use crate::shallow::system::Shallow;

/// The liquid after a frame.
///
/// A host that draws in another thread has two of them: after each frame, the one just taken and the one being drawn are swapped.
#[derive(Debug)]
pub struct Snapshot {
    /// Identity number of the columns.
    terrain: u64,
    columns: Columns,
    depth: Vec<i32>,
    velocity: Vec<[f32; 2]>,
    active: Vec<bool>,
    drops: Vec<Droplet>,
    /// One per scalar; empty for those that do not exist.
    concentrations: [Vec<f32>; MAX_SCALARS],
    time: f64,
}

impl Snapshot {
    /// A copy of the current liquid.
    pub fn new(shallow: &Shallow) -> Self {
        let (columns, len) = (shallow.columns.clone(), shallow.columns.len());
        let mut snapshot = Self {
            terrain: shallow.identity.number,
            active: vec![false; columns.strips().len()],
            columns,
            depth: vec![0; len],
            velocity: vec![[0.0; 2]; len],
            drops: Vec::with_capacity(shallow.params.falls.map_or(0, |falls| falls.max_packets)),
            concentrations: Default::default(),
            time: 0.0,
        };
        snapshot.take(shallow);
        snapshot
    }

    /// Replaces the contents by the current state of a liquid, not necessarily the same one as before. Copies only strips that have or had
    /// liquid, and the columns if the terrain has changed. Allocates nothing, unless there are more columns than ever before.
    pub fn take(&mut self, shallow: &Shallow) {
        if self.terrain != shallow.identity.number {
            self.terrain = shallow.identity.number;
            self.columns.clone_from(&shallow.columns);
            reset(&mut self.active, self.columns.strips().len(), false);
            reset(&mut self.depth, self.columns.len(), 0);
            reset(&mut self.velocity, self.columns.len(), [0.0; 2]);
            self.concentrations.iter_mut().for_each(Vec::clear);
        }
        let amounts = &shallow.flow.amounts;
        for (scalar, concentrations) in self.concentrations.iter_mut().enumerate() {
            let len = if scalar < amounts.count() { self.columns.len() } else { 0 };
            concentrations.resize(len, 0.0);
        }
        let mut end = 0;
        for run in runs(shallow.flow.active()) {
            self.clear(end..run.start);
            end = run.end;
            let indices = run.start * STRIP..run.end * STRIP;
            self.depth[indices.clone()].copy_from_slice(&shallow.flow.depth[indices.clone()]);
            find_velocities(shallow, run, &mut self.velocity[indices.clone()]);
            for (scalar, out) in self.concentrations.iter_mut().enumerate().take(amounts.count()) {
                let (depth, out) = (&self.depth[indices.clone()], &mut out[indices.clone()]);
                find_concentrations(amounts, scalar, depth, indices.start, out);
            }
        }
        self.clear(end..self.active.len());
        self.active.copy_from_slice(shallow.flow.active());
        refill(&mut self.drops, shallow.drops());
        self.time = shallow.time;
    }

    /// Clears the active strips of a range.
    fn clear(&mut self, strips: Range<usize>) {
        let first = strips.start;
        for run in runs(&self.active[strips]) {
            let run = (first + run.start) * STRIP..(first + run.end) * STRIP;
            self.depth[run.clone()].fill(0);
            self.velocity[run.clone()].fill([0.0; 2]);
            let carried = self.concentrations.iter_mut().filter(|numbers| !numbers.is_empty());
            carried.for_each(|numbers| numbers[run.clone()].fill(0.0));
        }
    }

    /// The columns.
    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// Depth of every column index (units).
    pub fn depths(&self) -> &[i32] {
        &self.depth
    }

    /// As [`Shallow::velocity`], for every column index: the mean velocity over its depth (m/s), along x and z.
    pub fn velocities(&self) -> &[[f32; 2]] {
        &self.velocity
    }

    /// Concentrations of a scalar by column index, in the scalar's own unit, as [`Shallow::concentration`]; empty if there is no such
    /// scalar.
    pub fn concentrations(&self, scalar: usize) -> &[f32] {
        self.concentrations.get(scalar).map_or(&[], |numbers| &numbers[..])
    }

    /// Whether each strip of columns may have liquid.
    pub fn active(&self) -> &[bool] {
        &self.active
    }

    /// As [`Shallow::drops`].
    pub fn drops(&self) -> &[Droplet] {
        &self.drops
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        self.time
    }
}

impl Shallow {
    /// Whether each strip of columns may have liquid.
    pub fn active(&self) -> &[bool] {
        self.flow.active()
    }

    /// As [`Shallow::velocity`], for every column index: the mean velocity over its depth (m/s), along x and z.
    ///
    /// # Errors
    /// `Argument`: there is not one output for each index.
    pub fn velocities(&self, out: &mut [[f32; 2]]) -> Result<()> {
        check_room(out.len(), "velocities", self.columns.len(), "indices")?;
        fill_runs(self.flow.active(), out, |strips, out| find_velocities(self, strips, out));
        Ok(())
    }
}

/// Mean velocities in a run of strips.
fn find_velocities(shallow: &Shallow, run: Range<usize>, out: &mut [[f32; 2]]) {
    let (columns, flow) = (&shallow.columns, &shallow.flow);
    dispatch!(body(columns: &Columns, flow: &Flow, run: Range<usize>, out: &mut [[f32; 2]]));

    #[inline(always)]
    fn body(columns: &Columns, flow: &Flow, run: Range<usize>, out: &mut [[f32; 2]]) {
        // As for a single column: the mean of the fluxes on both sides.
        let scale = (0.5 * columns.grid.cell / flow.last) as f32;
        let [east, south] = [&flow.flux[0], &flow.flux[1]].map(|numbers| numbers.as_chunks::<STRIP>().0);
        let depth = flow.depth.as_chunks::<STRIP>().0;
        for (strip, out) in run.zip(out.as_chunks_mut::<STRIP>().0) {
            let mut west = [0.0; STRIP];
            west[1..].copy_from_slice(&east[strip][..STRIP - 1]);
            west[0] = columns.west(strip).map_or(0.0, |before| east[before][STRIP - 1]);
            let north = match columns.north(strip) {
                NONE => &[0.0; STRIP],
                north => &south[north as usize],
            };
            for position in 0..STRIP {
                let depth = depth[strip][position];
                let each = if depth > 0 { scale / depth as f32 } else { 0.0 };
                // Adding 0 removes the sign of -0, so that the result is the same seen from the other side.
                let mean = |before: f32, after: f32| (after + before) * each + 0.0;
                out[position] = [
                    mean(west[position], east[strip][position]),
                    mean(north[position], south[strip][position]),
                ];
            }
        }
    }
}
