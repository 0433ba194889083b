//! Advection: values are carried along the flow (semi-Lagrangian: Stam 1999), and MacCormack's correction of the blur that
//! this leaves (Selle, Fedkiw, Kim, Liu and Rossignac 2008), but not where it would leave the range of the values around the place
//! that a value came from: cut off there instead, the mass of thin mist grew by 6 % in ten steps.
//!
//! The path of each cell's centre is traced once (midpoint rule), backward and, for the correction, forward; a face takes the
//! mean of its two cells' paths. All four fields follow these.

use rayon::prelude::*;

use super::tiles::{FACES, Field, NONE, SELF, Tile, Tiles, ZEROS};
use super::window::{MOST, Window, max, min};
use crate::base::blocks::VOXELS;
use crate::base::cpu::dispatch;

/// Largest displacement (cells) of a step; longer ones are cut off.
pub const FARTHEST: f32 = 5.0;

/// How values are carried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// First order: stable, blurs.
    SemiLagrangian,
    /// Second order; no new extremes.
    #[default]
    MacCormack,
    /// Second order where the flow is smooth, without bounds: for measurements of the order.
    Unbounded,
}

/// Where values are placed in their cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// At the centres.
    Centres,
    /// At the lower faces on an axis.
    Faces(usize),
}

/// Displacements (cells) of the cells' centres in a step.
#[derive(Debug, Default)]
pub struct Paths {
    /// To where the air came from.
    pub back: [Field; 3],
    /// To where it goes.
    pub ahead: [Field; 3],
    /// Cells around each tile that its values' paths reach, back and ahead.
    margins: Vec<[u8; 2]>,
}

/// Three windows, one for each component of the velocity.
#[derive(Default)]
struct Scratch([Window; 3]);

impl Paths {
    /// Traces the paths through a velocity (m/s, at lower faces) in a step, `scale` = dt / cell; the air outside all tiles
    /// moves at `ambient`.
    pub fn trace(
        &mut self,
        tiles: &Tiles,
        velocity: &[Field; 3],
        ambient: [f32; 3],
        scale: f32,
        scheme: Scheme,
    ) {
        let reach = reach(tiles, velocity, ambient, scale);
        trace(&mut self.back, tiles, velocity, ambient, -scale, &reach);
        if scheme != Scheme::SemiLagrangian {
            trace(&mut self.ahead, tiles, velocity, ambient, scale, &reach);
        }
        let [back, ahead] = [&self.back, &self.ahead].map(farthest);
        let margins = |near: &[u32; 27]| [margin(&back, near), margin(&ahead, near)];
        self.margins = tiles.neighbours().iter().map(margins).collect();
    }

    /// Carries a field along the paths into `out`; `hat` is room for the first guess. Outside all tiles its value is `outside`.
    pub fn carry(
        &self,
        tiles: &Tiles,
        (field, at, outside): (&Field, At, f32),
        hat: &mut Field,
        out: &mut Field,
        scheme: Scheme,
    ) {
        let first = if scheme == Scheme::SemiLagrangian { &mut *out } else { &mut *hat };
        let is_moved = |slot: usize| !is_still(tiles, slot, at);
        each_tile(first, outside, is_moved, |slot, window, to| {
            let [margin, _] = self.margins[slot].map(usize::from);
            window[0].fill(field, &tiles.neighbours()[slot], margin, outside);
            if at != At::Centres || !window[0].is_zero() {
                carry_tile(tiles, slot, at, &self.back, &window[0], to);
            }
        });
        if scheme == Scheme::SemiLagrangian {
            return;
        }
        let hat = &*hat;
        each_tile(out, outside, is_moved, |slot, window, to| {
            let near = &tiles.neighbours()[slot];
            let [back, ahead] = self.margins[slot].map(usize::from);
            window[0].fill(field, near, back, outside);
            window[1].fill(hat, near, ahead, outside);
            if at != At::Centres || !window[0].is_zero() || !window[1].is_zero() {
                let [old, guess, _] = &*window;
                let bounded = scheme == Scheme::MacCormack;
                correct_tile(tiles, slot, at, self, [old, guess], bounded, to);
            }
        });
    }
}

/// Fills each tile with `outside`; then calls `work` with its slot, windows and values where it is moved.
fn each_tile(
    field: &mut Field,
    outside: f32,
    is_moved: impl Fn(usize) -> bool + Sync,
    work: impl Fn(usize, &mut [Window; 3], &mut Tile) + Sync,
) {
    let tiles = field.par_iter_mut().enumerate().with_min_len(16);
    tiles.for_each_init(Scratch::default, |scratch, (slot, tile)| {
        *tile = [outside; VOXELS];
        if is_moved(slot) {
            work(slot, &mut scratch.0, tile);
        }
    });
}

/// Greatest displacement (cells) in each tile.
fn reach(tiles: &Tiles, velocity: &[Field; 3], ambient: [f32; 3], scale: f32) -> Vec<f32> {
    let around = ambient.into_iter().fold(0.0, |most, speed| max(most, speed.abs()));
    let of_tile = |slot: usize| {
        let tiles = velocity.iter().map(|field| &field[slot]);
        let most = tiles.flatten().fold(around, |most, speed| max(most, speed.abs()));
        min(most * scale, FARTHEST)
    };
    (0..tiles.count()).into_par_iter().with_min_len(16).map(of_tile).collect()
}

/// Cells around a tile that displacements of this length and interpolation reach.
fn cells(reach: f32) -> usize {
    (reach.ceil() as usize + 1).min(MOST)
}

/// Longest displacement (cells) on any axis in each tile.
fn farthest(paths: &[Field; 3]) -> Vec<f32> {
    let [x, y, z] = paths;
    let of_tile = |tile: &Tile| tile.iter().fold(0.0, |most, way| max(most, way.abs()));
    let tiles = x.par_iter().zip(y).zip(z).with_min_len(32);
    tiles.map(|((x, y), z)| max(max(of_tile(x), of_tile(y)), of_tile(z))).collect()
}

/// Cells around a tile that its paths reach: also the lower neighbours', as faces take half of these.
fn margin(farthest: &[f32], near: &[u32; 27]) -> u8 {
    let lower = [SELF, FACES[0], FACES[2], FACES[4]].map(|at| farthest.get(near[at] as usize));
    cells(lower.into_iter().flatten().fold(0.0, |most, way| max(most, *way))) as u8
}

fn trace(
    paths: &mut [Field; 3],
    tiles: &Tiles,
    velocity: &[Field; 3],
    ambient: [f32; 3],
    scale: f32,
    reach: &[f32],
) {
    let [x, y, z] = paths;
    let active = x.par_iter_mut().zip(y).zip(z).enumerate().with_min_len(16);
    active.for_each_init(Scratch::default, |scratch, (slot, ((x, y), z))| {
        let near = &tiles.neighbours()[slot];
        let most = near.iter().filter_map(|near| reach.get(*near as usize)).fold(0.0, |a, b| max(a, *b));
        for (axis, window) in scratch.0.iter_mut().enumerate() {
            // The midpoint lies half as far as the path; faces lie half a cell from centres.
            window.fill(&velocity[axis], near, cells(0.5 * most + 0.5), ambient[axis]);
        }
        trace_tile(&scratch.0, scale, [x, y, z]);
    });
}

fn trace_tile(windows: &[Window; 3], scale: f32, to: [&mut Tile; 3]) {
    dispatch!(trace_rows(windows: &[Window; 3], scale: f32, to: [&mut Tile; 3]))
}

#[inline(always)]
fn trace_rows(windows: &[Window; 3], scale: f32, to: [&mut Tile; 3]) {
    let margin = windows[0].margin();
    for row in 0..64 {
        let [x, y, z] = [margin + (row >> 3), margin + (row & 7), margin];
        let mut middle = [[0.0f32; 8]; 3];
        for lane in 0..8 {
            let low = windows.each_ref().map(|window| window.at(x, y, z + lane));
            let high = [
                windows[0].at(x + 1, y, z + lane),
                windows[1].at(x, y + 1, z + lane),
                windows[2].at(x, y, z + lane + 1),
            ];
            let cell = [x as f32, y as f32, (z + lane) as f32];
            for axis in 0..3 {
                let way = (low[axis] + high[axis]) * (0.5 * scale);
                middle[axis][lane] = cell[axis] + 0.5 * min(max(way, -FARTHEST), FARTHEST);
            }
        }
        for axis in 0..3 {
            let mut place = middle;
            for lane in 0..8 {
                place[axis][lane] += 0.5;
            }
            let speed = windows[axis].sample(&place);
            let out = &mut to[axis][row * 8..][..8];
            for lane in 0..8 {
                out[lane] = min(max(speed[lane] * scale, -FARTHEST), FARTHEST);
            }
        }
    }
}

/// Displacements of a row of values.
#[inline(always)]
fn ways(tiles: &Tiles, slot: usize, at: At, paths: &[Field; 3], row: usize) -> [[f32; 8]; 3] {
    let mut out = [[0.0; 8]; 3];
    for axis in 0..3 {
        let own = paths[axis].get(slot);
        let here: Option<&[f32]> = own.map(|tile| &tile[row * 8..][..8]);
        let At::Faces(across) = at else {
            out[axis].copy_from_slice(here.unwrap_or(&ZEROS[..8]));
            continue;
        };
        let below = tiles.neighbours()[slot][FACES[2 * across]];
        let below = paths[axis].get(below as usize).filter(|_| below != NONE);
        let mut lower = [0.0; 8];
        let (x, y) = (row >> 3, row & 7);
        let has = match across {
            0 => copy(if x > 0 { own } else { below }, (row + 56) % 64, &mut lower),
            1 => copy(if y > 0 { own } else { below }, x * 8 + (y + 7) % 8, &mut lower),
            _ => {
                // The first lane's lower cell lies in the tile below.
                let first = below.map(|tile| tile[row * 8 + 7]);
                let first = first.or(own.map(|tile| tile[row * 8])).unwrap_or(0.0);
                lower[0] = first;
                if let Some(here) = here {
                    lower[1..].copy_from_slice(&here[..7]);
                }
                true
            }
        };
        let here = match here {
            Some(here) => here,
            None => &lower.clone(),
        };
        for lane in 0..8 {
            out[axis][lane] = if has { 0.5 * (lower[lane] + here[lane]) } else { here[lane] };
        }
    }
    out
}

#[inline(always)]
fn copy(tile: Option<&Tile>, row: usize, to: &mut [f32; 8]) -> bool {
    if let Some(tile) = tile {
        to.copy_from_slice(&tile[row * 8..][..8]);
    }
    tile.is_some()
}

/// Whether the flow moves nothing of a tile: one of the rim that is not above cells.
fn is_still(tiles: &Tiles, slot: usize, at: At) -> bool {
    let below = |axis: usize| tiles.neighbours()[slot][FACES[2 * axis]] as usize;
    slot >= tiles.active() && !matches!(at, At::Faces(axis) if below(axis) < tiles.active())
}

/// Whether a row of a tile has faces or cells that the flow moves, and how many from its beginning.
#[inline(always)]
fn live(tiles: &Tiles, slot: usize, at: At, row: usize) -> usize {
    if slot < tiles.active() {
        return 8;
    }
    let At::Faces(axis) = at else { return 0 };
    if tiles.neighbours()[slot][FACES[2 * axis]] as usize >= tiles.active() {
        return 0;
    }
    match axis {
        0 => 8 * usize::from(row >> 3 == 0),
        1 => 8 * usize::from(row & 7 == 0),
        _ => 1,
    }
}

/// Places in a window of a row's cells, moved by displacements.
#[inline(always)]
fn places(window: &Window, row: usize, ways: &[[f32; 8]; 3]) -> [[f32; 8]; 3] {
    let margin = window.margin();
    let mut place = *ways;
    for lane in 0..8 {
        place[0][lane] += (margin + (row >> 3)) as f32;
        place[1][lane] += (margin + (row & 7)) as f32;
        place[2][lane] += (margin + lane) as f32;
    }
    place
}

fn carry_tile(tiles: &Tiles, slot: usize, at: At, back: &[Field; 3], window: &Window, to: &mut Tile) {
    dispatch!(carry_rows(tiles: &Tiles, slot: usize, at: At, back: &[Field; 3], window: &Window, to: &mut Tile))
}

#[inline(always)]
fn carry_rows(tiles: &Tiles, slot: usize, at: At, back: &[Field; 3], window: &Window, to: &mut Tile) {
    for row in 0..64 {
        let live = live(tiles, slot, at, row);
        if live > 0 {
            let ways = ways(tiles, slot, at, back, row);
            let values = window.sample(&places(window, row, &ways));
            to[row * 8..][..live].copy_from_slice(&values[..live]);
        }
    }
}

fn correct_tile(
    tiles: &Tiles,
    slot: usize,
    at: At,
    paths: &Paths,
    windows: [&Window; 2],
    bounded: bool,
    to: &mut Tile,
) {
    dispatch!(correct_rows(
        tiles: &Tiles,
        slot: usize,
        at: At,
        paths: &Paths,
        windows: [&Window; 2],
        bounded: bool,
        to: &mut Tile
    ))
}

#[inline(always)]
fn correct_rows(
    tiles: &Tiles,
    slot: usize,
    at: At,
    paths: &Paths,
    [old, guess]: [&Window; 2],
    bounded: bool,
    to: &mut Tile,
) {
    for row in 0..64 {
        let live = live(tiles, slot, at, row);
        if live == 0 {
            continue;
        }
        let ahead = guess.sample(&places(guess, row, &ways(tiles, slot, at, &paths.ahead, row)));
        let back = places(old, row, &ways(tiles, slot, at, &paths.back, row));
        let (x, y) = (row >> 3, row & 7);
        let mut values = [0.0; 8];
        for lane in 0..8 {
            let here = |window: &Window| {
                let margin = window.margin();
                window.at(margin + x, margin + y, margin + lane)
            };
            values[lane] = here(guess) + 0.5 * (here(old) - ahead[lane]);
        }
        if bounded {
            let [first, low, high] = old.sample_bounded(&back);
            for lane in 0..8 {
                let holds = low[lane] <= values[lane] && values[lane] <= high[lane];
                values[lane] = if holds { values[lane] } else { first[lane] };
            }
        }
        to[row * 8..][..live].copy_from_slice(&values[..live]);
    }
}
