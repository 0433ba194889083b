//! Finds the wet columns at the vertices of a mesh.

use crate::geometry::Vec3;
use crate::numeric::lists::reset;
use crate::shallow::columns::runs::runs;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_of};
use crate::shallow::solver::Flow;

/// A strip with wet columns.
#[derive(Debug, Clone, Copy)]
struct WetStrip {
    strip: u32,
    /// A bit for each wet column.
    bits: u16,
    /// Position of the next strip over the same cells, or [`NONE`].
    next: u32,
}

/// The wet columns of a liquid.
#[derive(Debug, Clone, Default)]
pub(super) struct WetColumns {
    strips: Vec<WetStrip>,
    /// For each 16 cells of a row, the position of the first strip over them, or [`NONE`].
    first: Vec<u32>,
}

impl WetColumns {
    /// Finds the columns that are deeper than a film (units).
    pub fn find(&mut self, columns: &Columns, flow: &Flow, film: i32) {
        let blocks = columns.grid.size[0].div_ceil(STRIP);
        self.strips.clear();
        reset(&mut self.first, blocks * columns.grid.size[1], NONE);
        for strip in runs(flow.active()).flatten() {
            let depths = strip_of(&flow.depth, strip);
            let bits = (0..STRIP).fold(0, |bits, x| bits | u16::from(depths[x] > film) << x);
            if bits == 0 {
                continue;
            }
            let position = columns.strips()[strip];
            let first = &mut self.first[position.row as usize * blocks + position.at as usize];
            self.strips.push(WetStrip { strip: strip as u32, bits, next: *first });
            *first = self.strips.len() as u32 - 1;
        }
    }

    /// Whether no column is wet.
    pub fn is_empty(&self) -> bool {
        self.strips.is_empty()
    }

    /// The column that wets a position: it is in the position's cell, and its range from base to surface is within a cell's edge of the
    /// position's height. Of several, the nearest; of two equally near, the lower one.
    #[inline(always)]
    pub fn column_at(&self, columns: &Columns, depth: &[i32], position: &Vec3) -> Option<usize> {
        let position = position.cast::<f64>();
        let [x, z] = columns.grid.cell_at([position.x, position.z])?;
        let blocks = columns.grid.size[0].div_ceil(STRIP);
        let mut at = self.first[z * blocks + x / STRIP];
        if at == NONE {
            return None;
        }
        let heights = &columns.heights;
        let height = (position.y - heights.low) / heights.unit;
        let (mut nearest, mut min_distance) = (None, columns.grid.cell / heights.unit);
        while at != NONE {
            let WetStrip { strip, bits, next } = self.strips[at as usize];
            at = next;
            if bits >> (x % STRIP) & 1 == 1 {
                let column = strip as usize * STRIP + x % STRIP;
                let base = f64::from(columns.bases()[column]);
                let distance = (base - height).max(height - (base + f64::from(depth[column]))).max(0.0);
                // The strips of a block are in order, from the highest layer down.
                if distance <= min_distance {
                    (nearest, min_distance) = (Some(column), distance);
                }
            }
        }
        nearest
    }
}
