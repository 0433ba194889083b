//! Writes vertices into the caller's buffers: in order, and without reading them.

use std::ops::Range;

use super::frame::{Frame, Vertex};
use super::normals::{Normals, Shown, upright};
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{NONE, STRIP, strip_of};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::quartets::links::LiquidColumns;
use crate::shallow::surface::quartets::strips::{Found, Span};
use crate::shallow::surface::rim::boundary::{Stencil, Wall, walls_of};
use crate::shallow::surface::rim::skirt_vertex::SkirtVertex;
use crate::shallow::surface::{Depths, Layout, Target};

/// A run starts within a strip if it has at least `LONG` columns there. Up to `SHORT` adjacent columns are written one by one.
const LONG: u32 = 8;
const SHORT: u32 = 2;

/// Source data of the vertices.
pub(in crate::shallow::surface) struct Vertices<'a> {
    shown: Shown<'a>,
    found: &'a Found,
    walls: &'a [Wall],
    velocity: &'a [[f32; 2]],
    carried: [&'a [f32]; MAX_SCALARS],
    wants_normals: bool,
    frame: Frame,
    /// The caller's units per metre.
    scale: f32,
    /// How far skirt vertices are below the ground (units).
    skirt_sink: i32,
}

/// Consecutive wet columns of a span, each linked by full quartets with wet ones on all sides.
#[derive(Clone, Copy)]
struct Run {
    /// First index.
    first: usize,
    /// Count of indices.
    len: usize,
}

impl<'a> Vertices<'a> {
    pub fn new(
        liquid: LiquidColumns<'a>,
        found: &'a Found,
        walls: &'a [Wall],
        shown: &'a [i32],
        depths: &Depths<'a>,
        layout: &Layout,
        wants_normals: bool,
    ) -> Self {
        let (grid, heights) = (&liquid.columns.grid, &liquid.columns.heights);
        let slope = (0.5 * heights.unit / grid.cell) as f32;
        Self {
            shown: Shown { liquid, heights: shown, slope },
            found,
            walls,
            velocity: depths.velocity,
            carried: depths.carried,
            wants_normals,
            frame: Frame::of(liquid.columns, layout),
            scale: layout.scale as f32,
            skirt_sink: (layout.least_depth / heights.unit).min(f64::from(i32::MAX / 2)) as i32,
        }
    }

    /// Writes all vertices.
    pub fn write(&self, normals: &mut Normals, stencil: &mut Stencil, target: &mut Target<'_>) {
        let vertices = self;
        dispatch!(write_spans(
            vertices: &Vertices<'_>,
            normals: &mut Normals,
            stencil: &mut Stencil,
            target: &mut Target<'_>
        ))
    }

    /// Concentrations in a column.
    #[inline(always)]
    fn carried(&self, index: usize) -> [f32; MAX_SCALARS] {
        self.carried.map(|numbers| numbers.get(index).copied().unwrap_or_default())
    }

    /// A vertex at cell (x, z) with the mean of the stencil's columns, at a height of at most `max_height` (units).
    fn mean(&self, [x, z]: [usize; 2], max_height: i32, normals: &mut Normals, stencil: &Stencil) -> Vertex {
        let mean = stencil.mean_height(|index| self.shown.heights[index]);
        let height = self.frame.height(mean.min(f64::from(max_height)) as f32);
        let mut normal = [0.0, 1.0, 0.0];
        if self.wants_normals {
            let [x, y, z] = stencil.sum(|index| normals.of(&self.shown, self.found, index));
            let length = ((x * x + z * z) + y * y).sqrt();
            if length > 0.0 {
                normal = [x / length, y / length, z / length];
            }
        }
        let mut velocity = [0.0; 2];
        if !self.velocity.is_empty() {
            velocity = stencil.sum(|index| self.velocity[index]).map(|sum| sum / stencil.len().max(1) as f32);
        }
        let mut carried = [0.0; MAX_SCALARS];
        if self.carried.iter().any(|numbers| !numbers.is_empty()) {
            carried = stencil.sum(|index| self.carried(index)).map(|sum| sum / stencil.len().max(1) as f32);
        }
        let position = [self.frame.centre(0, x as i32), height, self.frame.centre(1, z as i32)];
        Vertex { position, normal, velocity, carried, depth: 0, layer: 0, column: NONE }
    }

    /// The vertex of a column.
    fn vertex(&self, index: usize, normals: &mut Normals, stencil: &mut Stencil) -> Vertex {
        let liquid = self.shown.liquid;
        let ([x, z], layer) = (liquid.columns.cell(index), liquid.columns.layer(index) as u32);
        if !liquid.is_wet(index) {
            let mut walls = walls_of(self.walls, index as u32);
            match walls.find(|&wall| self.walls[wall].is_own) {
                Some(own) => stencil.take_wall(liquid, &self.walls[own]),
                None => stencil.take_linked(liquid, index),
            }
            // At most the column's own height, or the rim would hover over ground that falls away.
            let mean = self.mean([x, z], self.shown.heights[index], normals, stencil);
            return Vertex { layer, column: index as u32, ..mean };
        }
        let height = self.frame.height(self.shown.heights[index] as f32);
        Vertex {
            position: [self.frame.centre(0, x as i32), height, self.frame.centre(1, z as i32)],
            normal: if self.wants_normals {
                normals.of(&self.shown, self.found, index)
            } else {
                [0.0, 1.0, 0.0]
            },
            velocity: self.velocity.get(index).copied().unwrap_or_default(),
            carried: self.carried(index),
            depth: liquid.depth[index],
            layer,
            column: index as u32,
        }
    }

    /// Writes a skirt vertex.
    pub fn put_skirt_vertex(&self, at: usize, skirt_vertex: &SkirtVertex, target: &mut Target<'_>) {
        let columns = self.shown.liquid.columns;
        let index = skirt_vertex.column as usize;
        let [x, z] = columns.cell(index);
        let [along, across] = skirt_vertex.offset();
        let rise = skirt_vertex.rise * self.scale / self.frame.unit;
        let ground = columns.bases()[index].wrapping_sub(self.skirt_sink) as f32 + rise;
        let height = self.frame.height(ground.max(columns.unders()[index] as f32));
        let fall = self.frame.height(self.shown.heights[index] as f32) - height;
        let width = (along * along + across * across).sqrt();
        let mut normal = [0.0, 1.0, 0.0];
        if width > 0.0 {
            let (out, up) = (fall / width, self.frame.cell * width);
            let length = ((along * along + across * across) * (out * out) + up * up).sqrt();
            normal = [along * out / length, up / length, across * out / length];
        }
        let vertex = Vertex {
            position: [
                self.frame.centre(0, x as i32) + along * self.frame.cell,
                height,
                self.frame.centre(1, z as i32) + across * self.frame.cell,
            ],
            normal,
            velocity: self.velocity.get(index).copied().unwrap_or_default(),
            carried: self.carried(index),
            depth: 0,
            layer: columns.layer(index) as u32,
            column: NONE,
        };
        self.frame.put(at, &vertex, target);
    }

    /// Writes the vertices of a run with wet columns on all sides, starting at `at`.
    #[inline(always)]
    fn put_inner(&self, span: &Span, run: Run, at: usize, target: &mut Target<'_>) {
        let (heights, Run { first, len }) = (self.shown.heights, run);
        let step = first - span.first * STRIP;
        if let Some(out) = &mut target.normals {
            let (north, south) = (span.north as usize * STRIP + step, span.south as usize * STRIP + step);
            let row = |first: usize| heights[first..][..len].iter();
            let across = row(first - 1).zip(row(first + 1));
            let along = row(north).zip(row(south));
            for ((out, (west, east)), (north, south)) in
                vectors(out, at, len).iter_mut().zip(across).zip(along)
            {
                let slope = |before: &i32, after: &i32| before.wrapping_sub(*after) as f32 * self.shown.slope;
                let [x, y, z] = upright(slope(west, east), slope(north, south));
                *out = self.frame.order(x, y, z * self.frame.sign);
            }
        }
        self.put_run(span, run, at, target);
    }

    /// Writes the vertices of some positions of a strip, with or without wet columns on their sides, starting at `at`.
    #[inline(always)]
    fn put_outer(
        &self,
        span: &Span,
        strip: usize,
        positions: Range<usize>,
        at: usize,
        target: &mut Target<'_>,
    ) {
        let run = Run { first: strip * STRIP + positions.start, len: positions.len() };
        if let Some(out) = &mut target.normals {
            let normals = self.outer_normals(span, strip);
            vectors(out, at, run.len).copy_from_slice(&normals[positions]);
        }
        self.put_run(span, run, at, target);
    }

    /// Normals of a strip's columns, from the columns that full quartets link on their sides, if any.
    #[inline(always)]
    fn outer_normals(&self, span: &Span, strip: usize) -> [[f32; 3]; STRIP] {
        let (heights, slope, sides) = (self.shown.heights, self.shown.slope, self.found.states[strip].sides);
        let (own, first) = (strip_of(heights, strip), strip * STRIP);
        let mut line = [0; STRIP + 2];
        line[1..=STRIP].copy_from_slice(own);
        line[0] = first.checked_sub(1).map_or(0, |before| heights[before]);
        line[STRIP + 1] = heights.get(first + STRIP).copied().unwrap_or(0);
        let beside =
            |row: u32| if row == NONE { own } else { strip_of(heights, row as usize + strip - span.first) };
        let (north, south) = (beside(span.north), beside(span.south));
        let mut normals = [[0.0; 3]; STRIP];
        for x in 0..STRIP {
            let has = |side: usize| sides[side] >> x & 1 == 1;
            let slope = |[before, after]: [i32; 2], has: [bool; 2]| {
                let [before, after] =
                    [if has[0] { before } else { own[x] }, if has[1] { after } else { own[x] }];
                let cells = if has[0] & has[1] { 1.0 } else { 2.0 };
                before.wrapping_sub(after) as f32 * slope * cells
            };
            let along = slope([line[x], line[x + 2]], [has(0), has(1)]);
            let [x_up, y, z] = upright(along, slope([north[x], south[x]], [has(2), has(3)]));
            normals[x] = self.frame.order(x_up, y, z * self.frame.sign);
        }
        normals
    }

    /// Writes everything but the normals of a run, starting at vertex `at`.
    #[inline(always)]
    fn put_run(&self, span: &Span, run: Run, at: usize, target: &mut Target<'_>) {
        let (heights, depths) = (self.shown.heights, self.shown.liquid.depth);
        let strip = self.shown.liquid.columns.strips()[span.first];
        let Run { first, len } = run;
        let step = first - span.first * STRIP;
        let depth = &depths[first..][..len];
        if let Some(out) = &mut target.positions {
            let z = self.frame.centre(1, strip.row as i32) * self.frame.sign;
            let cells = (strip.at as usize * STRIP + step) as i32..;
            let out = vectors(out, at, len);
            for ((out, height), cell) in out.iter_mut().zip(&heights[first..][..len]).zip(cells) {
                *out = self.frame.order(self.frame.centre(0, cell), self.frame.height(*height as f32), z);
            }
        }
        if let Some(out) = &mut target.velocities {
            for (out, [u, w]) in vectors(out, at, len).iter_mut().zip(&self.velocity[first..][..len]) {
                *out = self.frame.order(u * self.frame.speed, 0.0, w * self.frame.speed * self.frame.sign);
            }
        }
        if let Some(out) = &mut target.depths {
            for (out, depth) in out[at..][..len].iter_mut().zip(depth) {
                *out = *depth as f32 * self.frame.unit;
            }
        }
        if let Some(out) = &mut target.opacities {
            for (out, depth) in out[at..][..len].iter_mut().zip(depth) {
                *out = (*depth as f32 * self.frame.opacity).min(1.0);
            }
        }
        for (out, carried) in target.carried.iter_mut().zip(&self.carried) {
            if let Some(out) = out {
                out[at..][..len].copy_from_slice(&carried[first..][..len]);
            }
        }
        if let Some(out) = &mut target.layers {
            out[at..][..len].fill(strip.layer);
        }
        if let Some(out) = &mut target.columns {
            for (out, index) in out[at..][..len].iter_mut().zip(first as u32..) {
                *out = index;
            }
        }
    }
}

/// The vectors of `count` vertices, starting at `at`.
#[inline(always)]
fn vectors(out: &mut [f32], at: usize, count: usize) -> &mut [[f32; 3]] {
    out[3 * at..][..3 * count].as_chunks_mut().0
}

#[inline(always)]
fn write_spans(
    vertices: &Vertices<'_>,
    normals: &mut Normals,
    stencil: &mut Stencil,
    target: &mut Target<'_>,
) {
    let found = vertices.found;
    let mut next = 0;
    for span in &found.spans {
        let mut run = Run { first: 0, len: 0 };
        for strip in span.first..span.first + span.len {
            let state = &found.states[strip];
            let [west, east, north, south] = state.sides;
            let plain = state.wet & west & east & north & south & !state.in_odd;
            let first = strip * STRIP;
            if plain == u16::MAX {
                run = Run { first: if run.len == 0 { first } else { run.first }, len: run.len + STRIP };
                continue;
            }
            // How many of the first columns continue the previous run, and how many of the last ones start a new run.
            let first_columns = if run.len > 0 { plain.trailing_ones() } else { 0 };
            let last_columns = plain.leading_ones();
            let last_columns = if last_columns < LONG { 0 } else { last_columns };
            run.len += first_columns as usize;
            if run.len > 0 {
                vertices.put_inner(span, run, next, target);
                next += run.len;
            }
            let between = u16::MAX << first_columns & (u32::from(u16::MAX) >> last_columns) as u16;
            // Columns that need not be written one by one.
            let smooth = state.used & state.wet & !state.in_odd & between;
            let mut left = state.used & between;
            while left != 0 {
                let position = left.trailing_zeros();
                let len = (smooth >> position).trailing_ones();
                if len <= SHORT {
                    let vertex = vertices.vertex(first + position as usize, normals, stencil);
                    vertices.frame.put(next, &vertex, target);
                    next += 1;
                    left &= left - 1;
                    continue;
                }
                let end = position + len;
                vertices.put_outer(span, strip, position as usize..end as usize, next, target);
                next += len as usize;
                left &= u16::MAX.checked_shl(end).unwrap_or(0);
            }
            run = Run { first: first + STRIP - last_columns as usize, len: last_columns as usize };
        }
        if run.len > 0 {
            vertices.put_inner(span, run, next, target);
            next += run.len;
        }
    }
    let columns = vertices.shown.liquid.columns;
    for wall in vertices.walls.iter().filter(|wall| wall.vertex != NONE) {
        stencil.take_wall(vertices.shown.liquid, wall);
        let members = wall.members.iter().filter(|member| **member != NONE);
        let layer = members.map(|&member| columns.layer(member as usize) as u32).min().unwrap_or(0);
        let mean = vertices.mean(columns.cell(wall.column as usize), i32::MAX, normals, stencil);
        vertices.frame.put(next, &Vertex { layer, ..mean }, target);
        next += 1;
    }
}
