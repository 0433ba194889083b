//! The state of the liquid, and one step of it (thesis 4.1.2, Alg. 4.1).
//!
//! A step is one pass over the rows (`rows/`): fluxes (`viscous_flux.rs`, `fast_films.rs`, `link_step.rs`), their scaling
//! (`transfers/scale.rs`) and transfers (`transfers/whole_units.rs`), on the strips that are wet or beside wet ones, unless these are at
//! rest (`active.rs`, `rest.rs`), with one band of rows for each thread (`rows/bands.rs`, `rows/band_views.rs`). Columns that are full to
//! their ceiling form a separate network, which is solved first (`pressurised/network.rs`, `pressurised/heads.rs`, `transfers/limiter.rs`);
//! then lateral friction, if enabled (`lateral_friction/`). Scalars follow transfers (`transfers/scalars.rs`).

pub(super) mod active;
pub mod fast_films;
mod full;
pub(super) mod lateral_friction;
mod link_flow;
pub mod link_step;
pub(super) mod overflow_edges;
mod pressurised;
pub mod rest;
pub(super) mod rows;
pub mod stop;
pub(super) mod thickening;
mod transfers;
pub mod viscous_flux;

use std::ops::Range;

use super::columns::per_column::{Array, PerColumn};
use super::columns::{Columns, NONE, STRIP, strip_mut};
use super::pipes::cliffs::Cliffs;
use super::pipes::{Links, Pipes};
use super::scalars::amounts::{Account, Amounts, Changes};
use super::scalars::shares::{Levels, MAX_SCALARS};
use crate::shallow::columns::runs::runs;
pub(super) use crate::shallow::solver::full::SLACK;
use crate::shallow::solver::link_flow::LinkFlow;
use active::Active;
use fast_films::{Fast, Films};
use lateral_friction::{LateralFriction, Liquid};
use overflow_edges::OverflowEdges;
use pressurised::network::{Network, State};
use rest::{Bounds, RestSearch};
use rows::StepInputs;
use rows::band_views::Part;
use rows::bands::Bands;
use stop::Stop;
use viscous_flux::Step;

/// Depths and fluxes, by column index.
#[derive(Debug, Clone)]
pub struct Flow {
    /// H (units), padded by a strip: SIMD loads may read past the last index.
    pub(super) depth: PerColumn<i32>,
    /// Flux to the east and to the south (units in a step of `last`).
    pub(super) flux: [PerColumn<f32>; 2],
    /// Remainders of transfers to the east and to the south (units).
    pub(super) remainder: [PerColumn<f32>; 2],
    pub(super) links: LinkFlow,
    pub(super) overflow_edges: OverflowEdges,
    active: Active,
    /// The bands of rows, with an upper bound of the depth in each row.
    pub(super) bands: Bands,
    pub(super) network: Network,
    /// The step length (s) that fluxes refer to.
    pub(super) last: f64,
    pub(super) fast: Fast,
    /// Lateral friction of pipes.
    pub(super) friction: LateralFriction,
    /// Amounts of scalars.
    pub(super) amounts: Amounts,
    /// Whether sleeping is disabled, to compare results with and without it.
    is_sleepless: bool,
}

/// The parts that a restored state replaces.
pub(super) struct Stored<'a> {
    /// Whether each strip is wet or beside a wet one.
    pub active: &'a [bool],
    /// H (units).
    pub depth: &'a mut [i32],
    /// As [`Flow::numbers`].
    pub numbers: [&'a mut [f32]; 4],
    /// Heads above the surface (units) of full columns, by column index.
    pub heads: &'a mut [f32],
    /// The bands of rows, with an upper bound of the depth in each row.
    pub bands: &'a mut Bands,
    /// Flow through links.
    pub links: &'a mut LinkFlow,
    /// Length of the last step (s).
    pub last: &'a mut f64,
    /// Amounts of scalars.
    pub amounts: &'a mut Amounts,
}

impl Stored<'_> {
    /// Clears the active strips of a range; inactive ones are already empty.
    pub fn clear(&mut self, strips: Range<usize>) {
        let first = strips.start;
        for run in runs(&self.active[strips]) {
            let run = (first + run.start) * STRIP..(first + run.end) * STRIP;
            self.depth[run.clone()].fill(0);
            for numbers in &mut self.numbers {
                numbers[run.clone()].fill(0.0);
            }
            self.heads[run.clone()].fill(0.0);
            let amounts = self.amounts.amounts.iter_mut().filter(|amounts| !amounts.is_empty());
            amounts.for_each(|amounts| amounts[run.clone()].fill(0.0));
        }
    }
}

impl Flow {
    /// The initial state: all columns dry, no flow.
    pub fn new(columns: &Columns, pipes: &Pipes) -> Self {
        let none = |array| PerColumn::new(array, columns.len(), 0.0);
        Self {
            depth: PerColumn::new(Array::Depth, columns.len() + STRIP, 0),
            flux: [none(Array::FluxEast), none(Array::FluxSouth)],
            remainder: [none(Array::RemainderEast), none(Array::RemainderSouth)],
            links: LinkFlow::new(&pipes.links),
            overflow_edges: OverflowEdges::default(),
            active: Active::new(columns, &pipes.links),
            bands: Bands::new(columns, pipes.links.max_pipes),
            network: Network::new(columns.len(), columns.grid.size[1]),
            last: 1.0,
            fast: Fast::new(columns.len() + STRIP, columns.grid.size[1]),
            friction: LateralFriction::default(),
            amounts: Amounts::none(),
            is_sleepless: false,
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let pipes: usize = self.flux.iter().chain(&self.remainder).map(PerColumn::bytes).sum();
        let links = [&self.links.flux, &self.links.remainder, &self.links.transfer];
        let links: usize = links.iter().map(|numbers| size_of_val(&numbers[..])).sum();
        self.depth.bytes()
            + pipes
            + links
            + self.active.bytes()
            + self.bands.bytes()
            + self.network.bytes()
            + self.fast.bytes()
            + self.friction.bytes()
            + self.amounts.bytes()
    }

    /// H of every column index (units).
    pub fn depths(&self) -> &[i32] {
        &self.depth[..self.depth.len() - STRIP]
    }

    /// Whether each strip is wet or beside a wet one: all others have neither liquid nor flow.
    pub(super) fn active(&self) -> &[bool] {
        &self.active.active
    }

    /// Fluxes (units in a step of `last`) and remainders of transfers (units), each to the east and to the south, by column index.
    pub(super) fn numbers(&self) -> [&[f32]; 4] {
        let ([east, south], [remainder_east, remainder_south]) = (&self.flux, &self.remainder);
        [east, south, remainder_east, remainder_south]
    }

    /// All parts that a restored state replaces; [`Flow::wake`] must follow.
    pub(super) fn stored(&mut self) -> Stored<'_> {
        let ([east, south], [remainder_east, remainder_south]) = (&mut self.flux, &mut self.remainder);
        Stored {
            active: &self.active.active,
            depth: &mut self.depth,
            numbers: [east, south, remainder_east, remainder_south],
            heads: self.network.excess_heads_mut(),
            bands: &mut self.bands,
            links: &mut self.links,
            last: &mut self.last,
            amounts: &mut self.amounts,
        }
    }

    /// Makes the strips of `runs` (in ascending order) active, and besides them only strips beside liquid. Call it after changing what
    /// [`Stored`] refers to.
    pub(super) fn wake(&mut self, columns: &Columns, runs: impl Iterator<Item = Range<usize>> + Clone) {
        self.active.reset(columns, &self.depth, runs);
    }

    /// Units of liquid in all columns.
    pub fn units(&self) -> i64 {
        self.depth.iter().map(|&depth| i64::from(depth)).sum()
    }

    /// Replaces the scalars; all amounts are 0.
    pub(super) fn set_scalars(&mut self, columns: &Columns, amounts: Amounts) {
        self.bands.set_scalar_count(columns, amounts.count());
        self.links.set_scalar_count(amounts.count());
        self.amounts = amounts;
        self.active.wake_all();
    }

    /// As [`Flow::change_depth`]; added liquid has these concentrations, removed liquid takes its scalars along.
    pub(super) fn add(
        &mut self,
        columns: &Columns,
        index: usize,
        units: i64,
        levels: &Levels,
        account: Account,
    ) -> i64 {
        let before = i64::from(self.depth[index]);
        let added = self.change_depth(columns, index, units);
        if added != 0 {
            self.amounts.add(index, before, added, levels, account);
        }
        added
    }

    /// Adds to or subtracts from the depth of a column, within 0 and its ceiling; returns the change.
    pub(super) fn change_depth(&mut self, columns: &Columns, index: usize, units: i64) -> i64 {
        let room = i64::from(columns.ceilings()[index]) - i64::from(columns.bases()[index]);
        let before = i64::from(self.depth[index]);
        let after = (before + units).clamp(0, room.max(0));
        self.depth[index] = after as i32;
        self.bands.deepen(columns.cell(index)[1], after as i32);
        let strip = index / STRIP;
        if after > 0 && !self.active.wet[strip] || after != before && !self.active.moving[strip] {
            self.active.wake(columns, strip);
        }
        after - before
    }

    /// Changes the number of indices in the range `part` to `len`; the values in this range are then unspecified.
    pub(super) fn resize_part(&mut self, part: Range<usize>, len: usize) {
        self.depth.resize_part(part.clone(), len, 0);
        for numbers in self.flux.iter_mut().chain(&mut self.remainder) {
            numbers.resize_part(part.clone(), len, 0.0);
        }
        self.amounts.resize_part(part.clone(), len);
        self.fast.resize_part(part.clone(), len);
        self.network.resize_part(part, len);
    }

    /// Updates what depends on the columns of `rows`, and, unless the links join the same columns as before, what depends on the links.
    pub(super) fn refit(
        &mut self,
        columns: &Columns,
        pipes: &Pipes,
        rows: Range<usize>,
        has_same_links: bool,
    ) {
        self.bands.refit(columns, pipes.links.max_pipes, rows.clone(), &self.depth);
        self.friction.fit(columns);
        let links = (!has_same_links).then_some(&pipes.links);
        self.active.refit(columns, links, rows.clone(), &self.depth);
        let Self { flux, remainder, network, active, .. } = self;
        for strip in columns.row(rows.start).start..columns.row(rows.end - 1).end {
            if !active.active[strip] {
                flux.iter_mut().chain(&mut *remainder).for_each(|flow| strip_mut(flow, strip).fill(0.0));
                network.clear_heads(strip * STRIP..(strip + 1) * STRIP);
            }
        }
    }

    /// Begins a frame: deactivates strips where all is dry, and lets those at rest sleep.
    pub fn begin_frame(&mut self, columns: &Columns, pipes: &Pipes, bounds: Bounds) {
        self.friction.begin_frame();
        let [east, south] = &mut self.flux;
        let [remainder_east, remainder_south] = &mut self.remainder;
        self.active.deactivate_dry(columns, &self.depth, |dry| {
            for numbers in [&mut *east, &mut *south, &mut *remainder_east, &mut *remainder_south] {
                numbers[dry.clone()].fill(0.0);
            }
            self.network.clear_heads(dry);
        });
        let Self { depth, links, network, active, .. } = self;
        let numbers = [&**east, south, remainder_east, remainder_south];
        let search =
            RestSearch { columns, pipes, depth, numbers, links, heads: network.excess_heads(), bounds };
        if bounds.rest_drop > 0 && !self.is_sleepless && !self.amounts.has_laws() {
            active.fall_asleep(&search);
        }
    }

    /// Wakes all strips: something other than the liquid has changed.
    pub fn wake_all(&mut self) {
        self.active.wake_all();
    }

    /// Sets whether sleeping is disabled.
    pub fn set_sleepless(&mut self, is_sleepless: bool) {
        self.is_sleepless = is_sleepless;
        self.active.wake_all();
    }

    /// Finds fast films. Returns the smallest power of two, in cells, that no disturbance in them exceeds in a step `step` times as long as
    /// the last one, or `max_cells` if that is less. `drive` is g unit dt^2 / dx^2 of the last step (1 / units).
    pub fn find_fast_films(&mut self, columns: &Columns, drive: f64, step: f64, max_cells: u32) -> u32 {
        self.active.refresh(columns, &self.depth);
        let Self { fast, active, depth, flux: [east, south], .. } = self;
        let films = Films { active, depth, flux: [east, south], drive: drive as f32 };
        fast.find(&films, step as f32, max_cells)
    }

    /// Reduces the inertia of fast films for steps like `step`.
    pub fn reduce_inertia(&mut self, drive: f64, step: &Step) {
        let Self { fast, active, depth, flux: [east, south], .. } = self;
        fast.reduce_inertia(&Films { active, depth, flux: [east, south], drive: drive as f32 }, step);
    }

    /// Finds the overflow edges of the next step: the links that liquid falls freely from.
    pub(super) fn find_overflow_edges(&mut self, columns: &Columns, links: &Links, cliffs: Cliffs) {
        self.overflow_edges.find(columns, links, cliffs, &self.depth);
    }

    /// One step of `dt` (s). Returns the counts of rows in which K_min and K_max were not 1, and in which fast films were limited. Runs on
    /// the threads of the surrounding pool, if [`Flow::divide`] has divided it.
    pub fn step(&mut self, columns: &Columns, pipes: &Pipes, step: &Step, dt: f64, stop: &Stop) -> [u32; 3] {
        self.active.refresh(columns, &self.depth);
        if self.active.all_rest() && self.network.is_empty() {
            self.bands.row_depths_mut().copy_from_slice(&self.active.asleep_depths);
            self.last = dt;
            return [0; 3];
        }
        self.friction.begin_step(step, &pipes.links, columns, self.bands.row_depths());
        if self.bands.find_filling() || !self.network.is_empty() {
            self.solve_network(columns, pipes, step, stop);
            for strip in self.network.strips() {
                self.active.stir(columns, strip);
            }
            self.active.refresh(columns, &self.depth);
        }
        self.solve_lateral_friction(columns, pipes, step);
        self.amounts.begin_step(dt);
        if !self.network.is_empty() {
            self.move_network_scalars();
        }
        let law_effects = self.amounts.law_effects();
        let inputs = StepInputs {
            columns,
            pipes,
            active: &self.active,
            network: &self.network,
            fast: &self.fast,
            friction: &self.friction,
            overflow_edges: &self.overflow_edges,
            may_rest: step.rest_drop > 0,
            may_fill: &[],
            room: &[],
            law_effects: &law_effects,
        };
        let [flux, remainder] =
            [&mut self.flux, &mut self.remainder].map(|both| both.each_mut().map(|numbers| &mut numbers[..]));
        let amounts = self.amounts.amounts.each_mut().map(|amounts| &mut amounts[..]);
        let liquid = Part::new(&mut self.depth, flux, remainder, &mut self.links, amounts);
        self.bands.step(step, &inputs, liquid);
        self.network.store_fluxes(
            &mut self.flux,
            &mut self.remainder,
            &mut self.links,
            &mut self.overflow_edges,
        );
        let mut scaled = [0; 3];
        for results in self.bands.results() {
            scaled = [0, 1, 2].map(|which| scaled[which] + results.scaled[which]);
            self.links.lost += results.outside.lost;
            self.links.gained += results.outside.gained;
            for strip in results.woken.drain(..) {
                self.active.wake(columns, strip as usize);
            }
            self.amounts.add_changes(&results.scalar_changes);
            (results.scaled, results.outside, results.scalar_changes) = Default::default();
        }
        if self.active.any_asleep {
            self.wake_linked(columns, &pipes.links);
        }
        self.last = dt;
        scaled
    }

    /// Divides steps among this many threads, if that is faster; returns whether they are divided.
    pub fn divide(&mut self, columns: &Columns, threads: usize) -> bool {
        self.bands.divide(columns, threads);
        self.bands.is_divided()
    }

    /// Wakes strips between which the step's links moved liquid.
    fn wake_linked(&mut self, columns: &Columns, links: &Links) {
        for link in (0..links.len()).filter(|&link| self.links.transfer[link] != 0.0) {
            for end in [links.from[link], links.to[link]].into_iter().filter(|&end| end != NONE) {
                self.active.stir(columns, end as usize / STRIP);
            }
        }
    }

    /// Moves the scalars of transfers between full columns.
    fn move_network_scalars(&mut self) {
        let Amounts { amounts, party_levels, scalars, .. } = &mut self.amounts;
        let mut changes = [Changes::default(); MAX_SCALARS];
        let each = amounts.iter_mut().zip(&mut self.links.fallen).zip(&mut changes);
        for ((amounts, fallen), changes) in each.take(scalars.len()) {
            self.network.move_scalars(
                &self.depth,
                (&self.overflow_edges, fallen),
                amounts,
                party_levels,
                changes,
            );
        }
        self.amounts.add_changes(&changes);
    }

    /// Count of columns in the strips that a step works on, and an upper bound of those that are full.
    pub(super) fn work(&mut self, columns: &Columns) -> [usize; 2] {
        let wet = STRIP * self.active.count();
        if !self.bands.find_filling() {
            return [wet, self.network.len()];
        }
        let may_be_full = self.bands.filling().may_be_full;
        let rows = (0..may_be_full.len()).filter(|&row| may_be_full[row]);
        let full = rows.map(|row| STRIP * columns.row(row).len()).sum::<usize>();
        [wet, full.min(wet).max(self.network.len())]
    }

    /// Solves for the fluxes of pipes with lateral friction.
    fn solve_lateral_friction(&mut self, columns: &Columns, pipes: &Pipes, step: &Step) {
        let [east, south] = &self.flux;
        let liquid = Liquid {
            columns,
            pipes,
            active: &self.active,
            fast: &self.fast,
            network: &self.network,
            depth: &self.depth,
            flux: [east, south],
            row_depths: self.bands.row_depths(),
            is_divided: self.bands.is_divided(),
        };
        self.friction.find(step, &liquid);
    }

    /// Computes the flow through full columns.
    fn solve_network(&mut self, columns: &Columns, pipes: &Pipes, step: &Step, stop: &Stop) {
        let ([east, south], [remainder_east, remainder_south]) = (&self.flux, &self.remainder);
        let state = State {
            step,
            columns,
            pipes,
            depth: &self.depth,
            flux: [east, south],
            remainder: [remainder_east, remainder_south],
            links: &self.links,
            overflow_edges: &self.overflow_edges,
            friction: &self.friction,
        };
        self.network.find(self.bands.filling(), &state, stop);
    }
}
