//! Probes: how much liquid is in a box or on a layer, and how deep and fast it is at a point.

use std::ops::Range;

use super::snapshot::Snapshot;
use crate::error::{Error, Result};
use crate::numeric::checks::{check_room, ensure};
use crate::shallow::columns::grid::Grid;
use crate::shallow::columns::{Columns, STRIP};
use crate::shallow::scalars::check_scalar;
use crate::shallow::system::Shallow;

/// Read access to the liquid of a [`Shallow`] or a [`Snapshot`]. Nothing here allocates.
#[derive(Clone, Copy)]
pub struct View<'a> {
    columns: &'a Columns,
    depth: &'a [i32],
    active: &'a [bool],
    source: Source<'a>,
}

/// Where velocities and concentrations come from.
#[derive(Clone, Copy)]
enum Source<'a> {
    Snapshot(&'a Snapshot),
    Live(&'a Shallow),
}

/// The liquid in a column.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reading {
    /// Index of the column.
    pub column: usize,
    /// Its layer.
    pub layer: usize,
    /// Depth (m); 0 where it is dry.
    pub depth: f64,
    /// Height of the surface (m); where it is dry, of the ground.
    pub height: f64,
    /// Mean velocity over the depth (m/s), along x and z.
    pub velocity: [f32; 2],
    /// Velocity at the surface (m/s): 1.5 times the mean (thesis Eq. 4.4).
    pub surface_velocity: [f32; 2],
}

impl Shallow {
    /// The current liquid, for reading.
    pub fn view(&self) -> View<'_> {
        let (columns, depth, active) = (&self.columns, self.flow.depths(), self.flow.active());
        View { columns, depth, active, source: Source::Live(self) }
    }
}

impl Snapshot {
    /// The liquid of the snapshot, for reading.
    pub fn view(&self) -> View<'_> {
        let source = Source::Snapshot(self);
        View { columns: self.columns(), depth: self.depths(), active: self.active(), source }
    }
}

impl View<'_> {
    /// Volume of liquid (m3; 1 ml is 1e-6) in the box between two corners (m), low and high: in columns of cells whose centres lie inside
    /// or on its sides, the liquid between both heights. Corners may be infinite.
    ///
    /// # Errors
    /// `Argument`: a number is NaN, or a low one is above a high one.
    pub fn volume(&self, low: [f64; 3], high: [f64; 3]) -> Result<f64> {
        check_box(low, high)?;
        Ok(self.cubic_metres(self.units_within(low, high)))
    }

    /// As [`View::volume`], for boxes of two corners each.
    ///
    /// # Errors
    /// As [`View::volume`], naming the box; `Argument` also if there is not one output for each box. In all cases nothing is written.
    pub fn volumes(&self, boxes: &[[[f64; 3]; 2]], out: &mut [f64]) -> Result<()> {
        check_room(out.len(), "volumes", boxes.len(), "boxes")?;
        for (at, [low, high]) in boxes.iter().enumerate() {
            check_box(*low, *high).map_err(|error| Error::argument(format!("box {at}: {error}")))?;
        }
        for ([low, high], out) in boxes.iter().zip(out) {
            *out = self.cubic_metres(self.units_within(*low, *high));
        }
        Ok(())
    }

    /// The mean concentration of a scalar over the liquid in a box, as in [`View::volume`], in the scalar's own unit: each column is
    /// weighted by its liquid in the box. 0 if there is no liquid.
    ///
    /// # Errors
    /// As [`View::volume`]; `Argument` also if there is no such scalar.
    pub fn mean_concentration(&self, scalar: usize, low: [f64; 3], high: [f64; 3]) -> Result<f64> {
        check_scalar(scalar, self.scalars())?;
        check_box(low, high)?;
        let (mut units, mut sum) = (0, 0.0);
        self.each_within(low, high, |column, overlap| {
            units += overlap;
            sum += overlap as f64 * f64::from(self.concentration(scalar, column));
        });
        Ok(if units > 0 { sum / units as f64 } else { 0.0 })
    }

    /// Volume of liquid on a layer (m3).
    pub fn layer_volume(&self, layer: usize) -> f64 {
        let strips = self.columns.strips().iter().zip(self.active).zip(self.depth.as_chunks::<STRIP>().0);
        let own = strips.filter(|((strip, active), _)| **active && strip.layer as usize == layer);
        self.cubic_metres(own.map(|(_, depth)| sum(depth)).sum())
    }

    /// Count of layers: the maximum number of columns in a cell.
    pub fn layers(&self) -> usize {
        self.columns.layers()
    }

    /// The column at a point (m): in the cell of the point, the column that contains the point between ground and ceiling, else the nearest
    /// one, or the lower of two equally near. None outside the domain, and where the ground has a hole.
    pub fn at(&self, point: [f64; 3]) -> Option<Reading> {
        let [x, y, z] = point;
        let heights = &self.columns.heights;
        let cell = self.columns.grid.cell_at([x, z]).filter(|_| !y.is_nan())?;
        let y = heights.round(y);
        let distance = |index: &usize| {
            let (base, ceiling) = (self.columns.bases()[*index], self.columns.ceilings()[*index]);
            (base - y).max(y - ceiling).max(0)
        };
        let column = self.columns.of_cell(cell).min_by_key(distance)?;
        let (base, depth) = (self.columns.bases()[column], self.depth[column]);
        let velocity = self.velocity(column);
        Some(Reading {
            column,
            layer: self.columns.layer(column),
            depth: heights.length(f64::from(depth)),
            height: heights.metres(base + depth),
            velocity,
            surface_velocity: velocity.map(|mean| 1.5 * mean),
        })
    }

    /// As [`View::at`], for each point.
    ///
    /// # Errors
    /// `Argument`: there is not one output for each; nothing is written.
    pub fn read(&self, points: &[[f64; 3]], out: &mut [Option<Reading>]) -> Result<()> {
        check_room(out.len(), "readings", points.len(), "points")?;
        out.iter_mut().zip(points).for_each(|(out, point)| *out = self.at(*point));
        Ok(())
    }

    fn velocity(&self, column: usize) -> [f32; 2] {
        match self.source {
            Source::Snapshot(snapshot) => snapshot.velocities()[column],
            Source::Live(shallow) => shallow.velocity(column),
        }
    }

    fn scalars(&self) -> usize {
        match self.source {
            Source::Snapshot(snapshot) => {
                (0..).take_while(|&at| !snapshot.concentrations(at).is_empty()).count()
            }
            Source::Live(shallow) => shallow.scalars().len(),
        }
    }

    /// The concentration of an existing scalar in a column.
    fn concentration(&self, scalar: usize, column: usize) -> f32 {
        match self.source {
            Source::Snapshot(snapshot) => snapshot.concentrations(scalar)[column],
            Source::Live(shallow) => shallow.concentration(scalar, column),
        }
    }

    fn cubic_metres(&self, units: i64) -> f64 {
        let cell = self.columns.grid.cell;
        units as f64 * (cell * cell * self.columns.heights.unit)
    }

    /// Units of liquid in a box: integers, whose sum does not depend on the order.
    fn units_within(&self, low: [f64; 3], high: [f64; 3]) -> i64 {
        let mut units = 0;
        self.each_within(low, high, |_, overlap| units += overlap);
        units
    }

    /// Calls `visit` with each column of a box in active strips, and with the units of its liquid that lie in the box. Heights of the box
    /// are rounded to units.
    #[inline(always)]
    fn each_within(&self, low: [f64; 3], high: [f64; 3], mut visit: impl FnMut(usize, i64)) {
        let columns = self.columns;
        let [across, rows] = [0, 2].map(|axis| cells(&columns.grid, axis / 2, low[axis], high[axis]));
        let [floor, top] = [low[1], high[1]].map(|height| columns.heights.round(height));
        for strip in rows.flat_map(|row| columns.row(row)).filter(|&strip| self.active[strip]) {
            let first = columns.strips()[strip].at as usize * STRIP;
            let [from, to] = [across.start, across.end].map(|x| x.clamp(first, first + STRIP) - first);
            let own = strip * STRIP + from..strip * STRIP + to;
            let ends = columns.bases()[own.clone()].iter().zip(&self.depth[own.clone()]);
            for (column, (base, depth)) in own.zip(ends) {
                visit(column, i64::from(((base + depth).min(top) - (*base).max(floor)).max(0)));
            }
        }
    }
}

/// The cells along an axis (0: x, 1: z) whose centres lie between two positions (m).
fn cells(grid: &Grid, axis: usize, low: f64, high: f64) -> Range<usize> {
    let first = |is_before: &dyn Fn(f64) -> bool| {
        let (mut start, mut end) = (0, grid.size[axis]);
        while start < end {
            let middle = (start + end) / 2;
            if is_before(grid.centre([middle; 2])[axis]) { start = middle + 1 } else { end = middle }
        }
        start
    };
    first(&|centre| centre < low)..first(&|centre| centre <= high)
}

fn sum(depth: &[i32; STRIP]) -> i64 {
    depth.iter().map(|depth| i64::from(*depth)).sum()
}

fn check_box(low: [f64; 3], high: [f64; 3]) -> Result<()> {
    // Also fails if a number is NaN.
    let has_inside = low.iter().zip(&high).all(|(low, high)| low <= high);
    ensure(has_inside, format_args!("a box from {low:?} to {high:?} m has no inside"))
}
