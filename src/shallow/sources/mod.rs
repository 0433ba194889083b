//! Where liquid enters and leaves: sources, drains, orifices and absorbers, at the end of each step (thesis Alg. 4.1, line 5).
//!
//! Each moves whole units. The volume that its rate requests is shared equally by the columns in its circle. The remainder of the division
//! is pending until the next step, so that a source delivers its rate to within one unit per column. Liquid that does not fit in the
//! columns is pending, too, but no more than one step requests: a source in a full cavity stops, and does not catch up when the cavity
//! opens.

mod pour;

use super::columns::Columns;
use super::scalars::amounts::Account;
use super::scalars::shares::{Levels, MAX_SCALARS};
use super::solver::Flow;
use crate::error::{Error, Result};
use crate::numeric::checks::{check_within, ensure};

/// A source, a drain, an orifice or an absorber.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPoint {
    /// What it does.
    pub kind: Kind,
    /// Its centre (m).
    pub at: [f64; 3],
    /// Acts on the columns whose centres lie within this distance, seen from above (m); on the nearest one if there are none.
    pub radius: f64,
    /// Volume per second (m3/s), 0 or more; 1 ml is 1e-6 m3. For an orifice, the maximum outflow.
    pub rate: f64,
    /// How the rate varies; none: it is constant.
    pub pulse: Option<Pulse>,
}

/// What a [`FlowPoint`] does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Liquid enters.
    Source,
    /// Liquid leaves, as long as its columns have some.
    Drain,
    /// Like a drain, until it has taken this volume (m3), as gauze does.
    Absorber(f64),
    /// A hole in the ground, through which liquid drains under its own weight: Cd a (2 g H)^(1/2) m3/s (Torricelli's law), for the mean
    /// depth H in its circle. The number is Cd a (m2): the hole's area a times its discharge coefficient Cd, 0.6 to 0.65 for a sharp edge.
    Orifice(f64),
}

/// A pulsating rate: rate (1 + share sin(2 pi frequency t)), never below 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulse {
    /// Pulse frequency (Hz), 0 or more.
    pub frequency: f64,
    /// Amplitude as a share of the rate, 0 to 1.
    pub share: f64,
}

/// A flow point with its columns.
#[derive(Debug, Clone, PartialEq)]
struct Placed {
    point: FlowPoint,
    columns: Vec<u32>,
    /// Units requested that have not moved yet.
    pending: f64,
    /// Units moved so far, in or out.
    moved: i64,
    /// Concentrations of the liquid that enters.
    levels: Levels,
}

/// Maximum pending units per column from earlier steps, if a step requests less: remainders of divisions, also where four fine columns take
/// over from a coarse one.
const MAX_PENDING: f64 = 4.0;

/// All flow points.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Flows {
    placed: Vec<Placed>,
    /// Units that entered through all sources so far.
    pub sourced: i64,
    /// Units that left through all drains so far.
    pub drained: i64,
    /// Units that went into all absorbers so far.
    pub absorbed: i64,
}

impl FlowPoint {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        let [x, y, z] = self.at;
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(Error::argument(format!("at = ({x}, {y}, {z}) is not finite")));
        }
        let positive = |name: &str, value: f64| {
            let holds = value >= 0.0 && value.is_finite();
            ensure(holds, format_args!("{name} = {value} is not 0 or more"))
        };
        positive("radius", self.radius)?;
        positive("rate", self.rate)?;
        match self.kind {
            Kind::Absorber(capacity) => positive("capacity", capacity)?,
            Kind::Orifice(opening) => positive("opening", opening)?,
            Kind::Source | Kind::Drain => {}
        }
        let Some(pulse) = self.pulse else { return Ok(()) };
        positive("pulse.frequency", pulse.frequency)?;
        check_within("pulse.share", pulse.share, "", 0.0..=1.0)
    }

    fn rate_at(&self, time: f64) -> f64 {
        let swing =
            |pulse: Pulse| pulse.share * libm::sin(std::f64::consts::TAU * (pulse.frequency * time).fract());
        (self.rate * (1.0 + self.pulse.map_or(0.0, swing))).max(0.0)
    }

    /// The columns that it acts on.
    ///
    /// # Errors
    /// `Argument`: as [`Flows::set`].
    pub(super) fn columns(&self, columns: &Columns) -> Result<Vec<u32>> {
        self.validate()?;
        let mut found = Vec::new();
        self.find_columns(columns, &mut found);
        if found.is_empty() { Err(self.nowhere(columns)) } else { Ok(found) }
    }

    /// The error for a point without a column. It names the nearest ground.
    fn nowhere(&self, columns: &Columns) -> Error {
        let [x, y, z] = self.at;
        let ground = self.nearest_ground(columns).map(|at| at.map(|part| (part * 1e6).round() / 1e6));
        let ground =
            ground.map_or(String::new(), |[x, y, z]| format!("; the nearest ground is at ({x}, {y}, {z})"));
        Error::argument(format!(
            "at ({x}, {y}, {z}) there is only solid, or it lies outside of the domain{ground}"
        ))
    }

    /// The base of the column that is nearest to it (m); `None` without columns.
    fn nearest_ground(&self, columns: &Columns) -> Option<[f64; 3]> {
        let ground = |index: usize| {
            let [x, z] = columns.grid.centre(columns.cell(index));
            [x, columns.heights.metres(columns.bases()[index]), z]
        };
        let distance = |at: &[f64; 3]| (0..3).map(|axis| (at[axis] - self.at[axis]).powi(2)).sum::<f64>();
        columns.indices().map(ground).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// Lists the columns in its circle: in each cell the one that contains the centre, or is nearest to it.
    fn find_columns(&self, columns: &Columns, found: &mut Vec<u32>) {
        let grid = &columns.grid;
        let [x, y, z] = self.at;
        let reach = self.radius.max(2.0 * grid.cell);
        let nearest = |cell: [usize; 2]| {
            let (index, distance) = columns.nearest(cell, y)?;
            (distance <= reach).then_some(index as u32)
        };
        found.clear();
        let mut has_cells = false;
        for cell in grid.in_circle([x, z], self.radius) {
            has_cells = true;
            found.extend(nearest(cell));
        }
        if !has_cells {
            // A point at a vertex on the terrain's border may lie slightly outside, as vertices are rounded to 32 bits.
            let within = |axis: usize, at: f64| {
                let (low, size) = (grid.origin[axis], grid.size[axis] as f64 * grid.cell);
                let inside = at.clamp(low, low + size * (1.0 - 1e-12));
                if (at - inside).abs() < 1e-3 * grid.cell { inside } else { at }
            };
            found.extend(grid.cell_at([within(0, x), within(1, z)]).and_then(nearest));
        }
    }
}

impl Flows {
    /// Replaces the flow points; what the previous ones have moved stays in the sums. `which` names a point in an error.
    ///
    /// # Errors
    /// `Argument`: a number out of range, or a point that has no column within its radius, or within two cells if that is more: it lies
    /// inside solid, or outside the domain.
    pub fn set(
        &mut self,
        columns: &Columns,
        points: &[FlowPoint],
        which: impl Fn(usize) -> String,
    ) -> Result<()> {
        let placed = placed(columns, points, &which)?;
        if let Some(at) = placed.iter().position(|placed| placed.columns.is_empty()) {
            return Err(Error::argument(format!("{}: {}", which(at), points[at].nowhere(columns))));
        }
        self.placed = placed;
        Ok(())
    }

    /// As [`Flows::set`], but a point without a column rests until it has one.
    ///
    /// # Errors
    /// `Argument`: a number out of range.
    pub(super) fn set_resting(
        &mut self,
        columns: &Columns,
        points: &[FlowPoint],
        which: impl Fn(usize) -> String,
    ) -> Result<()> {
        self.placed = placed(columns, points, &which)?;
        Ok(())
    }

    /// Whether a point has no column now.
    pub(super) fn is_resting(&self, point: usize) -> bool {
        self.placed[point].columns.is_empty()
    }

    /// Moves a point, and finds its columns again.
    pub(super) fn move_to(&mut self, columns: &Columns, point: usize, at: [f64; 3]) {
        let placed = &mut self.placed[point];
        placed.point.at = at;
        placed.point.find_columns(columns, &mut placed.columns);
    }

    /// Takes a point's columns away; returns its pending and its moved units, and clears them.
    pub(super) fn deactivate(&mut self, point: usize) -> (f64, i64) {
        let placed = &mut self.placed[point];
        placed.columns.clear();
        (std::mem::take(&mut placed.pending), std::mem::take(&mut placed.moved))
    }

    /// Pending and moved units of a point.
    pub(super) fn pending_and_moved(&self, point: usize) -> (f64, i64) {
        (self.placed[point].pending, self.placed[point].moved)
    }

    /// Gives a flow point another rate (m3/s); its pending and moved units stay.
    ///
    /// # Errors
    /// `Argument`: there is no such point, or the rate is negative or not finite.
    pub fn set_rate(&mut self, point: usize, rate: f64) -> Result<()> {
        let placed = self.placed_mut(point)?;
        let changed = FlowPoint { rate, ..placed.point.clone() };
        changed.validate()?;
        placed.point = changed;
        Ok(())
    }

    /// Sets the concentrations of what enters through a source.
    ///
    /// # Errors
    /// `Argument`: there is no such point.
    pub(super) fn set_levels(&mut self, point: usize, levels: Levels) -> Result<()> {
        self.placed_mut(point)?.levels = levels;
        Ok(())
    }

    fn placed_mut(&mut self, point: usize) -> Result<&mut Placed> {
        let count = self.placed.len();
        let none = || Error::argument(format!("there is no flow point {point} among {count}"));
        self.placed.get_mut(point).ok_or_else(none)
    }

    /// Sets all concentrations of sources to 0.
    pub(super) fn clear_levels(&mut self) {
        self.placed.iter_mut().for_each(|placed| placed.levels = [0; MAX_SCALARS]);
    }

    /// Finds the columns of all points again, after the terrain has moved. A point without one rests until it has one.
    pub(super) fn find_again(&mut self, columns: &Columns) {
        for placed in &mut self.placed {
            placed.point.find_columns(columns, &mut placed.columns);
        }
    }

    /// Units that a flow point has moved since it was set.
    pub fn moved(&self, point: usize) -> i64 {
        self.placed[point].moved
    }

    /// Kind, pending units and moved units of each flow point, in order: their part of a saved state.
    pub(super) fn progress(&self) -> impl ExactSizeIterator<Item = (Kind, f64, i64)> + '_ {
        self.placed.iter().map(|placed| (placed.point.kind, placed.pending, placed.moved))
    }

    /// Sets the pending and moved units of a flow point.
    pub(super) fn set_progress(&mut self, point: usize, pending: f64, moved: i64) {
        let placed = &mut self.placed[point];
        (placed.pending, placed.moved) = (pending, moved);
    }

    /// Moves what the points request in a step of `dt` that begins at `time` (s), under `gravity` (m/s2).
    pub fn step(&mut self, columns: &Columns, flow: &mut Flow, gravity: f64, time: f64, dt: f64) {
        let volume = columns.grid.cell * columns.grid.cell * columns.heights.unit;
        for placed in &mut self.placed {
            let sum = match placed.point.kind {
                Kind::Source => &mut self.sourced,
                Kind::Drain | Kind::Orifice(_) => &mut self.drained,
                Kind::Absorber(_) => &mut self.absorbed,
            };
            let rate = placed.rate(columns, flow, gravity, time + 0.5 * dt);
            *sum += placed.step(columns, flow, rate * dt / volume, volume);
        }
    }
}

/// Points with their columns; a point may have none.
fn placed(columns: &Columns, points: &[FlowPoint], which: &impl Fn(usize) -> String) -> Result<Vec<Placed>> {
    let position = |(at, point): (usize, &FlowPoint)| {
        point.validate().map_err(|error| Error::argument(format!("{}: {error}", which(at))))?;
        let mut found = Vec::new();
        point.find_columns(columns, &mut found);
        Ok(Placed { point: point.clone(), columns: found, pending: 0.0, moved: 0, levels: [0; MAX_SCALARS] })
    };
    points.iter().enumerate().map(position).collect()
}

impl Placed {
    /// The rate that the point requests (m3/s).
    fn rate(&self, columns: &Columns, flow: &Flow, gravity: f64, time: f64) -> f64 {
        let rate = self.point.rate_at(time);
        let Kind::Orifice(opening) = self.point.kind else { return rate };
        let depth: i64 = self.columns.iter().map(|&column| i64::from(flow.depths()[column as usize])).sum();
        let depth = depth as f64 * columns.heights.unit / self.columns.len().max(1) as f64;
        (opening * (2.0 * gravity * depth).sqrt()).min(rate)
    }

    /// Moves the requested units, each of a `volume` (m3), and pending ones; returns the units moved.
    fn step(&mut self, columns: &Columns, flow: &mut Flow, requested: f64, volume: f64) -> i64 {
        if self.columns.is_empty() {
            return 0;
        }
        let count = self.columns.len() as f64;
        // Of the liquid that has found no room so far, no more than a step requests (or `MAX_PENDING` per column) comes later.
        self.pending = self.pending.min(requested.max(MAX_PENDING * count)) + requested;
        let mut share = (self.pending / count).floor().min(1e18) as i64;
        if let Kind::Absorber(capacity) = self.point.kind {
            let left = ((capacity / volume - self.moved as f64) / count).floor();
            share = share.min(left.clamp(0.0, 1e18) as i64);
        }
        let sign = if self.point.kind == Kind::Source { 1 } else { -1 };
        let account = match self.point.kind {
            Kind::Source => Account::Sourced,
            Kind::Drain | Kind::Orifice(_) => Account::Drained,
            Kind::Absorber(_) => Account::Absorbed,
        };
        let add = |&column: &u32| flow.add(columns, column as usize, sign * share, &self.levels, account);
        let moved = sign * self.columns.iter().map(add).sum::<i64>();
        self.moved += moved;
        self.pending -= moved as f64;
        if sign < 0 {
            // A drain that found too little does not catch up later.
            self.pending = self.pending.min(count);
        }
        moved
    }
}
