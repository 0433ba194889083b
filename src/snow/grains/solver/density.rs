//! Drag by local density (proposed in thesis section 3.8), optional: a lone grain in a thin spray feels the full drag of the
//! air, a grain with neighbours less, and a surrounded grain none.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::layout::Layout;
use super::rest::NEAR;
use super::rows::{Row, norm, sub};

/// Count of neighbours that shelter a grain from the air completely: about as many as in a settled heap.
pub const SURROUNDED: usize = 6;

/// Share of the velocity that air removes in a sub-step, by the number of neighbours. `air` is the share that a lone grain keeps in a
/// second (beta), `dt` the sub-step (s): the drag coefficient, -ln(beta), is multiplied by the share of missing neighbours.
pub fn air_by_neighbours(air: f64, dt: f64) -> [f32; SURROUNDED + 1] {
    let mut all = [0.0; SURROUNDED + 1];
    for (count, removed) in all.iter_mut().enumerate() {
        let missing = (SURROUNDED - count) as f64 / SURROUNDED as f64;
        *removed = (1.0 - libm::pow(air, dt * missing)) as f32;
    }
    all
}

impl Layout {
    /// Counts the neighbours of each grain among its pairs: those within a tenth of a diameter, at most [`SURROUNDED`]. A
    /// resting grain counts as surrounded: it feels no air until it moves, and then moves among others.
    pub fn count_neighbours(&mut self, rows: &[Row]) {
        let counts: Vec<AtomicU32> = rows.par_iter().map(|_| AtomicU32::new(0)).collect();
        // Integer sums do not depend on the order.
        self.batches.par_iter().flatten_iter().for_each(|batch| {
            let (others, shift) = (batch.others(), batch.shift());
            for lane in batch.lanes() {
                let [owner, other] = [batch.owners[lane], others[lane]].map(|slot| slot as usize);
                let apart =
                    sub(sub(rows[owner].position, shift.map(|shift| shift.0[lane])), rows[other].position);
                if norm(apart) < 1.0 + NEAR {
                    for slot in [owner, other] {
                        counts[slot].fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
        });
        let count = |(count, row): (AtomicU32, &Row)| {
            if row.rests() { SURROUNDED as u8 } else { count.into_inner().min(SURROUNDED as u32) as u8 }
        };
        self.neighbours = counts.into_par_iter().zip(rows).map(count).collect();
    }
}
