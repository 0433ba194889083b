//! Bodies far from the snow: the exact arithmetic of a sweep reaches 131,072 cells from the centre of the snow.
//!
//! Motion beyond that does not change the snow: only the parts of a step in which a body may touch it are swept.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::sweep::{Body, Lattice, REACH, UNITS, Window, too_far};

/// Fractions of an interval at which poses are sampled; no steady rotation looks the same at all of them.
const MOMENTS: [f64; 12] = [0.0, 0.07, 0.19, 0.26, 0.38, 0.45, 0.57, 0.64, 0.76, 0.83, 0.95, 1.0];
/// Maximum number of times that an interval between two breaks of a motion is halved.
const MAX_HALVINGS: u32 = 16;

/// The extent of the snow, against which the motion of bodies is tested.
pub struct Reach {
    lattice: Lattice,
    /// Relative to the lattice's origin voxel (cells).
    low: DVec3,
    high: DVec3,
}

impl Reach {
    /// For a sweep that is clipped to a window.
    pub(super) fn new(lattice: Lattice, window: &Window) -> Self {
        let cells = |p: [i32; 3]| DVec3::from(p.map(|value| f64::from(value) / f64::from(UNITS)));
        Self { lattice, low: cells(window.min), high: cells(window.max) }
    }

    /// For snow between two corners (m) with cells of `cell` m.
    ///
    /// # Errors
    /// Snow that is too far from the world's origin.
    pub fn of_snow(cell: f64, low: DVec3, high: DVec3) -> Result<Self> {
        let lattice = Lattice::near(cell, (low + high) * 0.5)?;
        // The maximum reach of noise and the band.
        let margin = DVec3::repeat(64.0);
        Ok(Self { lattice, low: lattice.to_cells(low) - margin, high: lattice.to_cells(high) + margin })
    }

    /// The parts of `from..=to` (s), in order, in which a body may touch the snow; the whole interval if the body stays in range.
    ///
    /// # Errors
    /// A body, named, that touches the snow while a part of it is out of range; a pose that cannot be computed; cancel.
    pub fn spans(&self, ctx: &Context, body: &Body, from: f64, to: f64) -> Result<Vec<(f64, f64)>> {
        let mut ends = vec![from];
        ends.extend(body.motion().breaks(from, to));
        ends.push(to);
        let mut out: Vec<(f64, f64)> = Vec::new();
        for pair in ends.windows(2) {
            self.parts(ctx, body, (pair[0], pair[1]), MAX_HALVINGS, &mut out)?;
        }
        Ok(out)
    }

    /// Adds the parts of an interval, merged with the preceding ones where they meet.
    fn parts(
        &self,
        ctx: &Context,
        body: &Body,
        (from, to): (f64, f64),
        halvings: u32,
        out: &mut Vec<(f64, f64)>,
    ) -> Result<()> {
        let (mut pose, mut before) = (Vec::new(), Vec::new());
        let (mut low, mut high) = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
        let mut moved = 0.0f64;
        let moments: &[f64] = if from == to { &MOMENTS[..1] } else { &MOMENTS };
        for part in moments {
            ctx.check()?;
            body.motion().pose(from + (to - from) * part, &mut pose)?;
            pose.iter_mut().for_each(|position| *position = self.lattice.to_cells(*position));
            for (position, before) in pose.iter().zip(&before) {
                let step: DVec3 = position - before;
                moved = moved.max(step.norm());
            }
            (low, high) = pose
                .iter()
                .fold((low, high), |(low, high), position| (low.inf(position), high.sup(position)));
            std::mem::swap(&mut pose, &mut before);
        }
        // Between two samples a vertex is assumed to stay within `moved`, the largest step between samples, of their box.
        let misses =
            (0..3).any(|axis| low[axis] - moved > self.high[axis] || high[axis] + moved < self.low[axis]);
        let farthest = low.abs().sup(&high.abs()).max();
        // A vertex that is not finite is reported by later checks.
        if misses && farthest.is_finite() {
            return Ok(());
        }
        if !farthest.is_finite() || farthest + moved < REACH || (from == to && farthest < REACH) {
            match out.last_mut() {
                Some(last) if last.1 == from => last.1 = to,
                _ => out.push((from, to)),
            }
            return Ok(());
        }
        let middle = 0.5 * (from + to);
        if halvings == 0 || middle <= from || middle >= to {
            return Err(self.too_far(body, farthest));
        }
        self.parts(ctx, body, (from, middle), halvings - 1, out)?;
        self.parts(ctx, body, (middle, to), halvings - 1, out)
    }

    fn too_far(&self, body: &Body, farthest: f64) -> Error {
        let cell = self.lattice.voxel;
        let what = format!("{} touches the snow while a part of it lies", body.name().unwrap_or("a body"),);
        Error::argument(too_far(&what, farthest * cell, "the snow's middle", cell))
    }
}
