//! Normals of wet columns, from the heights of the wet columns that they are linked with on their four sides: central differences,
//! one-sided where there is no such column.

use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, STRIP};
use crate::shallow::surface::quartets::links::LiquidColumns;
use crate::shallow::surface::quartets::strips::Found;

/// The heights at which columns are shown, and the factor from their differences to slopes.
#[derive(Debug, Clone, Copy)]
pub(in crate::shallow::surface) struct Shown<'a> {
    pub liquid: LiquidColumns<'a>,
    /// Height of each index (units).
    pub heights: &'a [i32],
    /// Slope of one unit over two cells.
    pub slope: f32,
}

impl Shown<'_> {
    /// Normal of a wet column: x to the east, y up, z to the south.
    pub fn normal(&self, found: &Found, index: usize) -> [f32; 3] {
        let (columns, liquid) = (self.liquid.columns, self.liquid);
        let (strip, position) = (index / STRIP, index % STRIP);
        let state = &found.states[strip];
        let [west, east, north, south] = if state.in_odd >> position & 1 == 1 {
            let beside = |step| liquid.wet_beside(index, step);
            [beside([-1, 0]), beside([1, 0]), beside([0, -1]), beside([0, 1])]
        } else {
            // Full quartets link it with columns of its own layer.
            let has = |side: usize| state.sides[side] >> position & 1 == 1;
            let across = |side: u32| side as usize * STRIP + position;
            [
                has(0).then(|| index - 1),
                has(1).then_some(index + 1),
                has(2).then(|| across(columns.north(strip))),
                has(3).then(|| across(columns.south(strip))),
            ]
        };
        let own = self.heights[index];
        let slope = |before: Option<usize>, after: Option<usize>| {
            // A one-sided difference spans one cell, not two.
            let scale = if before.is_some() && after.is_some() { 1.0 } else { 2.0 };
            let height = |side: Option<usize>| side.map_or(own, |side| self.heights[side]);
            height(before).wrapping_sub(height(after)) as f32 * self.slope * scale
        };
        upright(slope(west, east), slope(north, south))
    }
}

/// The unit vector along (x, 1, z).
#[inline(always)]
pub(in crate::shallow) fn upright(x: f32, z: f32) -> [f32; 3] {
    let y = 1.0 / ((x * x + z * z) + 1.0).sqrt();
    [x * y, y, z * y]
}

/// Normals of wet columns, each computed once, even if the normals of several dry or extra vertices are averaged from it.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Normals {
    /// By index.
    normals: Vec<[f32; 3]>,
    /// For each strip, the positions whose normal is known.
    known: Vec<u16>,
}

impl Normals {
    /// Resizes to the count of columns; known normals stay if it is the same.
    pub fn reset(&mut self, columns: &Columns) {
        if self.normals.len() != columns.len() {
            self.normals.resize(columns.len(), [0.0; 3]);
            reset(&mut self.known, columns.len() / STRIP, 0);
        }
    }

    /// Clears the normals of a frame.
    pub fn clear(&mut self, found: &Found) {
        for span in &found.spans {
            self.known[span.first..span.first + span.len].fill(0);
        }
    }

    /// Normal of a wet column that is a vertex.
    pub fn of(&mut self, shown: &Shown<'_>, found: &Found, index: usize) -> [f32; 3] {
        if !found.has_means {
            return shown.normal(found, index);
        }
        let (known, bit) = (&mut self.known[index / STRIP], 1 << (index % STRIP));
        if *known & bit == 0 {
            *known |= bit;
            self.normals[index] = shown.normal(found, index);
        }
        self.normals[index]
    }
}
