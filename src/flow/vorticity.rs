//! Vorticity confinement: restores the small eddies that advection damps (Steinhoff and Underhill 1994; Fedkiw, Stam and Jensen 2001,
//! section 3): an acceleration gain h (N x w), where w is the vorticity and N points to its maximum.

use rayon::prelude::*;

use super::Flow;
use super::tiles::{FACES, Tile};
use super::window::{Span, Window};
use crate::context::Context;
use crate::error::Result;

/// Margins (cells) around a tile in which velocities at centres, and vorticities, are computed.
const CENTRES: usize = 3;
const CURLS: usize = 2;
/// Minimum difference of the vorticity, times a cell (m/s), across two cells: below it the direction to the maximum is undefined.
const MIN_DIFFERENCE: f32 = 1.0e-6;

/// Vectors in a cube of cells: a tile and a margin.
struct Cube {
    margin: usize,
    values: Vec<[f32; 3]>,
}

impl Cube {
    fn new(margin: usize, of: impl Fn([usize; 3]) -> [f32; 3]) -> Self {
        let size = 8 + 2 * margin;
        let at = |index: usize| [index / (size * size), index / size % size, index % size];
        Self { margin, values: (0..size.pow(3)).map(|index| of(at(index))).collect() }
    }

    /// The vector at a cell given in the coordinates of a cube with another margin, `by` cells further along an axis.
    fn at(&self, cell: [usize; 3], margin: usize, axis: usize, by: isize) -> [f32; 3] {
        let size = 8 + 2 * self.margin;
        let mut at = cell.map(|x| x + self.margin - margin);
        at[axis] = at[axis].wrapping_add_signed(by);
        self.values[(at[0] * size + at[1]) * size + at[2]]
    }
}

impl Flow {
    /// Confines vorticity: `gain` is the strength (1/s) times the length of the step (s).
    ///
    /// # Errors
    /// Cancel.
    pub fn confine(&mut self, ctx: &Context, gain: f32) -> Result<()> {
        let Self { tiles, velocity, ambient, .. } = self;
        let near = tiles.neighbours();
        let pushes: Result<Vec<[Tile; 3]>> = (0..tiles.active())
            .into_par_iter()
            .map_init(<[Window; 3]>::default, |windows, slot| {
                ctx.check()?;
                for (axis, window) in windows.iter_mut().enumerate() {
                    let span = Span::around(CENTRES as i32 + 1);
                    window.fill(&velocity[axis], &near[slot], &span, ambient[axis]);
                }
                Ok(pushes(windows, gain))
            })
            .collect();
        let pushes = pushes?;
        for (axis, field) in velocity.iter_mut().enumerate() {
            // The rim has the upper faces of the last active cells.
            field.par_iter_mut().enumerate().for_each(|(slot, faces)| {
                let (own, below) = (pushes.get(slot), pushes.get(near[slot][FACES[2 * axis]] as usize));
                if own.is_none() && below.is_none() {
                    return;
                }
                let read = |push: Option<&[Tile; 3]>, cell: usize| push.map_or(0.0, |push| push[axis][cell]);
                let step = 64 >> (3 * axis);
                for (cell, face) in faces.iter_mut().enumerate() {
                    let lower = match cell / step % 8 {
                        0 => read(below, cell + 7 * step),
                        _ => read(own, cell - step),
                    };
                    *face += 0.5 * (lower + read(own, cell));
                }
            });
        }
        Ok(())
    }
}

/// Change of velocity (m/s) of each cell of a tile.
fn pushes(windows: &[Window; 3], gain: f32) -> [Tile; 3] {
    let centre = |cell: [usize; 3]| {
        std::array::from_fn(|axis| {
            let low = cell.map(|x| x as i32 - CENTRES as i32);
            let mut high = low;
            high[axis] += 1;
            let value = |at: [i32; 3]| windows[axis].at(at[0], at[1], at[2]);
            0.5 * (value(low) + value(high))
        })
    };
    let centres = Cube::new(CENTRES, centre);
    // Curl times the edge of a cell.
    let curls = Cube::new(CURLS, |cell| {
        let slope = |component: usize, axis: usize| {
            let [ahead, back] = [1, -1].map(|by| centres.at(cell, CURLS, axis, by)[component]);
            0.5 * (ahead - back)
        };
        [slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1)]
    });
    let length = |vector: [f32; 3]| vector.iter().map(|x| x * x).sum::<f32>().sqrt();
    let mut out = [[0.0; 512]; 3];
    for index in 0..512 {
        let cell = [index >> 6, index >> 3 & 7, index & 7];
        let toward: [f32; 3] = std::array::from_fn(|axis| {
            let [ahead, back] = [1, -1].map(|by| length(curls.at(cell, 0, axis, by)));
            ahead - back
        });
        let steep = length(toward);
        if steep < MIN_DIFFERENCE {
            continue;
        }
        let n = toward.map(|x| x / steep);
        let w = curls.at(cell, 0, 0, 0);
        let cross = [n[1] * w[2] - n[2] * w[1], n[2] * w[0] - n[0] * w[2], n[0] * w[1] - n[1] * w[0]];
        for (axis, out) in out.iter_mut().enumerate() {
            out[index] = gain * cross[axis];
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tiles::{Coord, padded};

    /// Air that rotates around the z axis, with an angular velocity that decreases with the distance from it.
    fn column() -> Flow {
        let mut flow = Flow::new(0.1, [0.0; 3]).unwrap();
        flow.resize(&padded(&[[0, 0, 0]], 2));
        let (tiles, velocity, _) = flow.fields();
        for (slot, coord) in tiles.coords().to_vec().into_iter().enumerate() {
            for cell in 0..512usize {
                let at = |axis: usize, half: f32| {
                    (coord[axis] * 8) as f32 + (cell >> (6 - 3 * axis) & 7) as f32 + half - 4.0
                };
                let speed = |x: f32, y: f32| 1.0 / (1.0 + 0.1 * (x * x + y * y));
                let (x, y) = (at(0, 0.0), at(1, 0.5));
                velocity[0][slot][cell] = -y * speed(x, y);
                let (x, y) = (at(0, 0.5), at(1, 0.0));
                velocity[1][slot][cell] = x * speed(x, y);
            }
        }
        flow
    }

    #[test]
    fn a_vortex_turns_faster_and_air_at_rest_stays_so() {
        let energy = |flow: &Flow, coord: Coord| {
            let slot = flow.tiles().find(coord).unwrap() as usize;
            flow.velocity().iter().flat_map(|field| field[slot]).map(|x| x * x).sum::<f32>()
        };
        let ctx = Context::new(crate::context::Pool::new(1).unwrap());
        let mut flow = column();
        let before = energy(&flow, [0, 0, 0]);
        flow.confine(&ctx, 0.2).unwrap();
        let after = energy(&flow, [0, 0, 0]);
        assert!(after > 1.02 * before, "{before} {after}");
        let mut still = Flow::new(0.1, [1.0, 0.0, 0.0]).unwrap();
        still.resize(&padded(&[[0, 0, 0]], 1));
        still.confine(&ctx, 0.2).unwrap();
        assert!(still.velocity()[0].iter().flatten().all(|x| *x == 1.0));
    }
}
