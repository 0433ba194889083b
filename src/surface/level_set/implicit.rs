//! Where the implicit function of the particles is evaluated: in patches of 4 x 4 x 4 nodes around its zeros, and nowhere else.
//!
//! Patches near particles are evaluated, except those deep among particles, which are inside. Where the surface leaves the evaluated
//! patches, the next patch is evaluated too, until the surface closes.

use std::collections::HashMap;

use rayon::prelude::*;

use super::SUPPORT;
use super::kernel::{Near, values};
use crate::context::Context;
use crate::error::{Error, Result, fail_if};
use crate::geometry::coords::between;
use crate::geometry::{Coord, DVec3};
use crate::numeric::lanes::LANES;
use crate::surface::particles::grid::Cells;

/// Nodes along the edge of a patch.
pub const SIDE: i32 = 4;
/// Nodes of a patch; node (x, y, z) lies at `x << 4 | y << 2 | z`.
pub const NODES: usize = 64;
/// A cube of two spacings is full from this many particles on; in a liquid it holds 8.
const FULL: u32 = 4;
/// Bytes of an evaluated patch: its values, while they are computed and afterwards, and its entries in lists and tables.
const BYTES: usize = 2 * 4 * NODES + 100;
/// What needs the memory, for messages.
const WHAT: &str = "the particles' surface (larger cells need less)";
/// Tolerance for rounding of coordinates (spacings).
const SLACK: f64 = 1e-6;

/// The implicit function of particles at the nodes around its zeros, in cells; negative inside.
#[derive(Debug)]
pub struct Implicit {
    /// Edge of a cell (m); node (i, j, k) lies at (i, j, k) cells.
    cell: f64,
    /// Evaluated patches, ascending within each pass of the evaluation; passes follow each other.
    patches: Vec<Coord>,
    values: Vec<[f32; NODES]>,
    /// Known states of patches; all others are outside.
    states: HashMap<Coord, State>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Inside,
    /// With its index.
    Evaluated(u32),
}

impl Implicit {
    /// Evaluates the function of particles at positions (m), whose spacing is `spacing` (m), on cells of `cell` (m).
    ///
    /// # Errors
    /// A spacing that is not positive, a cell that is not within 1/8 to 2 spacings; particles too far apart; more memory than the context
    /// allows; cancel.
    pub fn new(ctx: &Context, positions: &[DVec3], spacing: f64, cell: f64) -> Result<Self> {
        fail_if(!(spacing > 0.0 && spacing.is_finite()), || {
            Error::argument(format!("the spacing of particles must be above 0, not {spacing} m"))
        })?;
        fail_if(!(0.125..=2.0).contains(&(cell / spacing)), || {
            Error::argument(format!("a cell of {cell} m is not within 1/8 to 2 spacings of {spacing} m"))
        })?;
        let cells = Cells::new(positions, 2.0 * spacing, |_| 0)?;
        let mut implicit = Self { cell, patches: Vec::new(), values: Vec::new(), states: HashMap::new() };
        let around = Around { cells: &cells, spacing, cell };
        let (near, full) = around.patches();
        implicit.states.extend(full.into_iter().map(|patch| (patch, State::Inside)));
        let mut due = near;
        while !due.is_empty() {
            ctx.allow(WHAT, ((implicit.patches.len() + due.len()) * BYTES) as u64)?;
            let new: Vec<[f32; NODES]> = due
                .par_iter()
                .with_min_len(8)
                .map_init(Scratch::default, |scratch, patch| {
                    ctx.check()?;
                    Ok(around.evaluate(*patch, scratch))
                })
                .collect::<Result<_>>()?;
            let first = implicit.patches.len() as u32;
            implicit.states.extend(due.iter().zip(first..).map(|(patch, at)| (*patch, State::Evaluated(at))));
            implicit.patches.extend(due);
            implicit.values.extend(new);
            due = implicit.open_sides(first as usize);
        }
        Ok(implicit)
    }

    /// Edge of a cell (m).
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// Evaluated patches.
    pub fn patches(&self) -> &[Coord] {
        &self.patches
    }

    /// The index of an evaluated patch.
    pub fn find(&self, patch: Coord) -> Option<usize> {
        match self.states.get(&patch) {
            Some(State::Evaluated(at)) => Some(*at as usize),
            _ => None,
        }
    }

    /// The values of an evaluated patch (cells).
    pub fn values(&self, index: usize) -> &[f32; NODES] {
        &self.values[index]
    }

    /// Whether a patch that was not evaluated lies inside.
    pub fn is_inside(&self, patch: Coord) -> bool {
        self.states.get(&patch) == Some(&State::Inside)
    }

    /// The neighbours, ascending, into which the surface continues from the patches with index `first` or above.
    fn open_sides(&self, first: usize) -> Vec<Coord> {
        let sides = |index: usize| {
            let (patch, values) = (self.patches[index], &self.values[index]);
            (0..6).filter_map(move |side| {
                let (axis, is_upper) = (side >> 1, side & 1 == 1);
                let mut beside = patch;
                beside[axis] += if is_upper { 1 } else { -1 };
                let is_inside = match self.states.get(&beside) {
                    Some(State::Evaluated(_)) => return None,
                    Some(State::Inside) => true,
                    None => false,
                };
                let layer = if is_upper { SIDE as usize - 1 } else { 0 };
                let on_side = |node: &usize| node >> (4 - 2 * axis) & 3 == layer;
                (0..NODES).filter(on_side).any(|node| (values[node] < 0.0) != is_inside).then_some(beside)
            })
        };
        let mut out: Vec<Coord> = (first..self.patches.len()).flat_map(sides).collect();
        out.sort_unstable();
        out.dedup();
        out
    }
}

/// Scratch buffers of one thread.
#[derive(Default)]
struct Scratch {
    of_patch: Near,
    of_group: Near,
}

/// Particles around patches.
struct Around<'a> {
    cells: &'a Cells,
    /// m.
    spacing: f64,
    /// m.
    cell: f64,
}

impl Around<'_> {
    /// Edge of a patch (m).
    fn edge(&self) -> f64 {
        f64::from(SIDE) * self.cell
    }

    /// The minimum and maximum coordinates of the cells, with edges of `unit` (m), within a margin (m) of a patch's nodes.
    fn extent(&self, patch: Coord, margin: f64, unit: f64) -> [Coord; 2] {
        let low = patch.map(|at| f64::from(at) * self.edge());
        let high = low.map(|at| at + self.edge() - self.cell + margin);
        let slack = SLACK * self.spacing;
        [
            low.map(|at| ((at - margin + slack) / unit).floor() as i32),
            high.map(|at| ((at - slack) / unit).floor() as i32),
        ]
    }

    /// The patches within a spacing of particles: those that must be evaluated, and those that are full, both ascending.
    fn patches(&self) -> (Vec<Coord>, Vec<Coord>) {
        let edge = self.cells.edge();
        let mut near: Vec<Coord> = self
            .cells
            .coords()
            .flat_map(|cell| {
                let low = cell.map(|at| ((f64::from(at) * edge - self.spacing) / self.edge()).floor() as i32);
                let high =
                    cell.map(|at| ((f64::from(at + 1) * edge + self.spacing) / self.edge()).floor() as i32);
                between(low, high)
            })
            .collect();
        near.par_sort_unstable();
        near.dedup();
        let full: Vec<bool> = near
            .par_iter()
            .with_min_len(16)
            .map_init(Vec::new, |counts, patch| self.is_full(*patch, counts))
            .collect();
        let (mut open, mut inside) = (Vec::new(), Vec::new());
        for (patch, is_full) in near.into_iter().zip(full) {
            if is_full { inside.push(patch) } else { open.push(patch) }
        }
        (open, inside)
    }

    /// Whether the surface cannot be within a spacing of a patch: each cube of two spacings holds enough particles.
    fn is_full(&self, patch: Coord, counts: &mut Vec<u32>) -> bool {
        let [low, high] = self.extent(patch, self.spacing, self.spacing);
        let size = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1) as usize);
        counts.clear();
        counts.resize(size.iter().product(), 0);
        let position = |at: [usize; 3]| (at[0] * size[1] + at[1]) * size[2] + at[2];
        self.cells.counts(low.map(|x| x >> 1), high.map(|x| x >> 1), |octant, count| {
            let at = [0, 1, 2].map(|axis| octant[axis].wrapping_sub(low[axis]) as usize);
            if (0..3).all(|axis| at[axis] < size[axis]) {
                counts[position(at)] = u32::from(count);
            }
        });
        let window = |x: usize, y: usize, z: usize| -> u32 {
            (0..8).map(|n| counts[position([x + (n >> 2), y + (n >> 1 & 1), z + (n & 1)])]).sum()
        };
        let on = |axis: usize| 0..size[axis] - 1;
        on(0).all(|x| on(1).all(|y| on(2).all(|z| window(x, y, z) >= FULL)))
    }

    /// The function at the nodes of a patch (cells).
    fn evaluate(&self, patch: Coord, scratch: &mut Scratch) -> [f32; NODES] {
        let Scratch { of_patch, of_group } = scratch;
        let radius = SUPPORT * self.spacing;
        let [low, high] = self.extent(patch, radius, self.cells.edge());
        let from = low;
        // Offsets are in edges of the particle grid's cells. `scale` and `shift` turn them into cells of the function, relative to the
        // patch's first node.
        let scale = self.cells.edge() / self.cell;
        let shift = [0, 1, 2].map(|axis| {
            ((f64::from(from[axis]) * self.cells.edge() - f64::from(patch[axis]) * self.edge()) / self.cell)
                as f32
        });
        let (scale, radius) = (scale as f32, (radius / self.cell) as f32);
        of_patch.positions.clear();
        self.cells.near(low, high, from, |_, offset| {
            let position = [0, 1, 2].map(|axis| offset[axis] * scale + shift[axis]);
            if is_near(position, [0.0; 3], (SIDE - 1) as f32, radius) {
                of_patch.positions.push(position);
            }
        });
        let mut out = [0.0; NODES];
        for group in 0..8 {
            let first = [group >> 2, group >> 1 & 1, group & 1].map(|half| 2 * half);
            let corner = first.map(|x| x as f32);
            of_group.positions.clear();
            of_group.positions.extend(
                of_patch.positions.iter().filter(|position| is_near(**position, corner, 1.0, radius)),
            );
            let part = |axis: usize| -> [f32; LANES] {
                std::array::from_fn(|lane| corner[axis] + (lane >> (2 - axis) & 1) as f32)
            };
            let phi = values(of_group, &[part(0), part(1), part(2)], (self.spacing / self.cell) as f32);
            for lane in 0..LANES {
                let at = [0, 1, 2].map(|axis| first[axis] + (lane >> (2 - axis) & 1));
                out[at[0] << 4 | at[1] << 2 | at[2]] = phi[lane];
            }
        }
        out
    }
}

/// Whether a position is within a radius of a cube at `corner`.
fn is_near(position: [f32; 3], corner: [f32; 3], edge: f32, radius: f32) -> bool {
    let mut square = 0.0;
    for axis in 0..3 {
        let at = position[axis] - corner[axis];
        let off = at - at.clamp(0.0, edge);
        square += off * off;
    }
    square < radius * radius
}
