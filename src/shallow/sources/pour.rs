//! Pours of a host, and what it reads and sets at single flow points.

use super::{FlowPoint, Kind};
use crate::error::Result;
use crate::shallow::system::Shallow;

impl Shallow {
    /// Pours a volume (m3; negative: removes it) in equal shares into the columns that a source at this position (m) would act on. Each
    /// column stays between dry and full; returns the volume that came in (m3).
    ///
    /// # Errors
    /// `Argument`: as [`Shallow::set_flows`] for a source there.
    pub fn pour_at(&mut self, at: [f64; 3], radius: f64, volume: f64) -> Result<f64> {
        let point = FlowPoint { kind: Kind::Source, at, radius, rate: 0.0, pulse: None };
        let found = point.columns(&self.columns)?;
        let cell = self.columns.grid.cell;
        let share = volume / (found.len() as f64 * cell * cell);
        Ok(found.iter().map(|&column| self.pour(column as usize, share)).sum::<f64>() * (cell * cell))
    }

    /// What a flow point has moved since it was set (m3), in or out.
    pub fn moved(&self, point: usize) -> f64 {
        let cell = self.columns.grid.cell;
        self.flow_points.moved(point) as f64 * (cell * cell * self.columns.heights.unit)
    }

    /// Moves a flow point with the terrain that it lies on; what it has moved, and what is pending, stays. Where it finds no column it
    /// rests until it does.
    pub fn move_flow(&mut self, point: usize, at: [f64; 3]) {
        self.flow_points.move_to(&self.columns, point, at);
    }

    /// As [`Shallow::set_flows`], after the terrain has moved since the points were first set: a point that finds no column rests until it
    /// does.
    ///
    /// # Errors
    /// `Argument`: a number out of range.
    pub fn set_flows_resting(&mut self, points: &[FlowPoint], which: impl Fn(usize) -> String) -> Result<()> {
        self.flow_points.set_resting(&self.columns, points, which)
    }

    /// Whether a flow point rests, as it lies inside solid or outside of the domain.
    pub fn is_resting(&self, point: usize) -> bool {
        self.flow_points.is_resting(point)
    }

    /// Gives a flow point another rate (m3/s), as a valve does. What it has moved, and what an absorber holds, stays.
    ///
    /// # Errors
    /// As [`Flows::set_rate`](super::Flows::set_rate).
    pub fn set_rate(&mut self, point: usize, rate: f64) -> Result<()> {
        self.flow_points.set_rate(point, rate)
    }
}
