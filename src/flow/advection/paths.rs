//! Paths of the air in a step: displacements of the cells' centres back to where the air came from and ahead to where it goes.

use rayon::prelude::*;

use super::scheme::AdvectionStep;
use crate::context::Context;
use crate::error::Result;
use crate::flow::tiles::{FACES, Field, Tile, Tiles};
use crate::flow::window::{Span, Window, max, min};
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::Lanes;

/// Maximum displacement (cells) in a step; longer ones are clamped.
pub const FARTHEST: f32 = 5.0;

/// Where values are located in their cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Location {
    /// At the centres.
    Centres,
    /// At the lower faces on an axis.
    Faces(usize),
}

/// Minimum and maximum displacement (cells) on each axis.
pub type Extent = [[f32; 2]; 3];

/// Displacements (cells) of the active cells' centres in a step.
pub struct Paths<'a> {
    pub tiles: &'a Tiles,
    /// To where the air came from.
    pub back: [&'a [Tile]; 3],
    /// To where it goes.
    pub ahead: [&'a [Tile]; 3],
    /// Extents of each tile's paths, back and ahead.
    pub extents: Vec<[Extent; 2]>,
}

impl Paths<'_> {
    /// The values of a tile that the flow moves: all of an active tile, and in the rim the upper faces of active cells.
    pub fn live(&self, slot: usize, at: Location) -> Option<Live> {
        if slot < self.tiles.active() {
            return Some(Live { layer: None });
        }
        match at {
            Location::Faces(axis) if self.below(slot, axis) < self.tiles.active() => {
                Some(Live { layer: Some(axis) })
            }
            _ => None,
        }
    }

    fn below(&self, slot: usize, axis: usize) -> usize {
        self.tiles.neighbours()[slot][FACES[2 * axis]] as usize
    }

    /// The cells that the backward paths of a tile's values reach.
    pub fn back_span(&self, slot: usize, at: Location) -> Span {
        self.span(slot, at, 0)
    }

    /// The cells that the forward paths of a tile's values reach.
    pub fn ahead_span(&self, slot: usize, at: Location) -> Span {
        self.span(slot, at, 1)
    }

    fn span(&self, slot: usize, at: Location, side: usize) -> Span {
        let below = match at {
            Location::Centres => None,
            Location::Faces(axis) => self.extents.get(self.below(slot, axis)),
        };
        let both = [self.extents.get(slot), below].into_iter().flatten().map(|extents| extents[side]);
        let mut displacements = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
        for extent in both {
            for (displacement, [min_displacement, max_displacement]) in displacements.iter_mut().zip(extent) {
                *displacement =
                    [min(min_displacement, displacement[0]), max(max_displacement, displacement[1])];
            }
        }
        let mut cells = [8; 3];
        if let (Location::Faces(axis), true) = (at, slot >= self.tiles.active()) {
            cells[axis] = 1;
        }
        Span::moved(cells, &displacements)
    }

    /// The displacements of a tile's values.
    pub fn displacements<'a>(&self, slot: usize, at: Location, paths: &[&'a [Tile]; 3]) -> Displacements<'a> {
        let tile = |slot: usize| {
            let [x, y, z] = paths.map(|field| field.get(slot));
            Some([x?, y?, z?])
        };
        let below = match at {
            Location::Centres => None,
            Location::Faces(axis) => tile(self.below(slot, axis)),
        };
        Displacements { at, own: tile(slot), below }
    }
}

/// The values of a tile that the flow moves.
pub struct Live {
    /// The axis on which only the first layer moves; none: all values move.
    layer: Option<usize>,
}

impl Live {
    /// The rows that move.
    #[inline(always)]
    pub fn rows(&self) -> impl Iterator<Item = usize> {
        let (last, step) = match self.layer {
            Some(0) => (8, 1),
            Some(1) => (64, 8),
            _ => (64, 1),
        };
        (0..last).step_by(step)
    }

    /// Whether all values move.
    pub fn is_whole(&self) -> bool {
        self.layer.is_none()
    }

    /// How many values of a row move.
    #[inline(always)]
    pub fn lanes(&self) -> usize {
        if self.layer == Some(2) { 1 } else { 8 }
    }
}

/// The displacements of a tile's values: of its cells, or of faces, which take the mean of the two cells beside them, or the value of the
/// only active one.
pub struct Displacements<'a> {
    at: Location,
    own: Option<[&'a Tile; 3]>,
    below: Option<[&'a Tile; 3]>,
}

impl Displacements<'_> {
    /// The displacements of a row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> [Lanes; 3] {
        let step = match self.at {
            Location::Centres => return rows_of(self.own, row),
            Location::Faces(2) => return self.along_rows(row),
            Location::Faces(1) => 1,
            Location::Faces(_) => 8,
        };
        let is_first = if step == 8 { row < 8 } else { row & 7 == 0 };
        let (lower, at) = if is_first { (self.below, row + 7 * step) } else { (self.own, row - step) };
        match (self.own, lower) {
            (Some(_), Some(_)) => means(rows_of(self.own, row), rows_of(lower, at)),
            (Some(_), None) => rows_of(self.own, row),
            _ => rows_of(lower, at),
        }
    }

    /// The displacements of a row of faces on z.
    #[inline(always)]
    fn along_rows(&self, row: usize) -> [Lanes; 3] {
        let below = rows_of(self.below, row).map(|values| values.0[7]);
        if self.own.is_none() {
            return below.map(Lanes::all);
        }
        let own = rows_of(self.own, row);
        let mut lower = own;
        for axis in 0..3 {
            let first = if self.below.is_some() { below[axis] } else { own[axis].0[0] };
            lower[axis] = own[axis].shift_up(first);
        }
        means(own, lower)
    }
}

#[inline(always)]
fn rows_of(tiles: Option<[&Tile; 3]>, row: usize) -> [Lanes; 3] {
    let Some(tiles) = tiles else { return [Lanes::all(0.0); 3] };
    tiles.map(|tile| Lanes(crate::flow::pressure::stencil::row_of(tile, row)))
}

#[inline(always)]
fn means(a: [Lanes; 3], b: [Lanes; 3]) -> [Lanes; 3] {
    [0, 1, 2].map(|axis| Lanes::all(0.5) * (a[axis] + b[axis]))
}

/// Traces the paths back and ahead through a velocity (m/s, at lower faces) in a step. Returns the extents of each tile's paths.
///
/// # Errors
/// Cancel.
pub fn trace(
    ctx: &Context,
    tiles: &Tiles,
    velocity: &[Field; 3],
    &AdvectionStep { ambient, scale, .. }: &AdvectionStep<'_>,
    [back, ahead]: [&mut [&mut [Tile]; 3]; 2],
) -> Result<Vec<[Extent; 2]>> {
    let reach = reach(tiles, velocity, ambient, scale);
    let ([a, b, c], [d, e, f]) = (back, ahead);
    let six = (
        a.par_iter_mut(),
        b.par_iter_mut(),
        c.par_iter_mut(),
        d.par_iter_mut(),
        e.par_iter_mut(),
        f.par_iter_mut(),
    );
    let active = six.into_par_iter().enumerate().with_min_len(16);
    let each = active.map_init(<[Window; 3]>::default, |windows, (slot, (a, b, c, d, e, f))| {
        ctx.check()?;
        let near = &tiles.neighbours()[slot];
        // A cell's velocity is the mean of its two faces' on each axis; half the displacement reaches half as far.
        let max_displacement: [f32; 3] = std::array::from_fn(|axis| {
            let above = reach.get(near[FACES[2 * axis + 1]] as usize).map_or(0.0, |reach| reach[axis]);
            0.5 * max(reach[slot][axis], above)
        });
        for (axis, window) in windows.iter_mut().enumerate() {
            let mut displacements =
                max_displacement.map(|max_displacement| [-max_displacement, max_displacement]);
            // Faces lie half a cell from centres; the upper ones are read too.
            displacements[axis] = [-max_displacement[axis], max_displacement[axis] + 0.5];
            window.fill(&velocity[axis], near, &Span::moved([8; 3], &displacements), ambient[axis]);
        }
        let mut to = [a, b, c, d, e, f];
        trace_tile(windows, scale, &mut to);
        let extent = |side: usize| [0, 1, 2].map(|axis| extent_of(to[3 * side + axis]));
        Ok([extent(0), extent(1)])
    });
    each.collect()
}

/// Maximum displacement (cells) on each axis in each tile.
fn reach(tiles: &Tiles, velocity: &[Field; 3], ambient: [f32; 3], scale: f32) -> Vec<[f32; 3]> {
    let of_tile = |slot: usize| {
        [0, 1, 2].map(|axis| {
            let [min_displacement, max_displacement] = extent_of(&velocity[axis][slot]);
            let max_displacement = max(max(max_displacement, -min_displacement), ambient[axis].abs());
            min(max_displacement * scale, FARTHEST)
        })
    };
    (0..tiles.count()).into_par_iter().with_min_len(16).map(of_tile).collect()
}

/// The minimum and maximum of a tile.
fn extent_of(tile: &Tile) -> [f32; 2] {
    dispatch!(extent_of_rows(tile: &Tile) -> [f32; 2])
}

#[inline(always)]
fn extent_of_rows(tile: &Tile) -> [f32; 2] {
    let (mut low, mut high) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
    for row in tile.chunks_exact(8) {
        for lane in 0..8 {
            low[lane] = min(row[lane], low[lane]);
            high[lane] = max(row[lane], high[lane]);
        }
    }
    [low.into_iter().fold(f32::INFINITY, min), high.into_iter().fold(f32::NEG_INFINITY, max)]
}

fn trace_tile(windows: &[Window; 3], scale: f32, to: &mut [&mut Tile; 6]) {
    dispatch!(trace_rows(windows: &[Window; 3], scale: f32, to: &mut [&mut Tile; 6]))
}

#[inline(always)]
fn trace_rows(windows: &[Window; 3], scale: f32, to: &mut [&mut Tile; 6]) {
    let max_displacement = Lanes::all(FARTHEST);
    let min_displacement = Lanes::all(-FARTHEST);
    for row in 0..64 {
        let (x, y) = (row >> 3, row & 7);
        let low = windows.each_ref().map(|window| window.row(x, y, 0));
        let high = [windows[0].row(x + 1, y, 0), windows[1].row(x, y + 1, 0), windows[2].row(x, y, 1)];
        let half = [0, 1, 2].map(|axis| {
            let displacement = (low[axis] + high[axis]) * Lanes::all(0.5 * scale);
            Lanes::all(0.5) * displacement.max(min_displacement).min(max_displacement)
        });
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let middle = half.map(|displacement| displacement * Lanes::all(sign));
            for axis in 0..3 {
                // A cell's centre is half a cell above its lower face.
                let speed = windows[axis].sample_between(row, &middle, axis);
                let displacement =
                    (Lanes::all(sign * scale) * speed).max(min_displacement).min(max_displacement);
                to[3 * side + axis][row * 8..][..8].copy_from_slice(&displacement.0);
            }
        }
    }
}
