//! Tricubic interpolation of signed distances (Catmull-Rom splines on each axis), with its gradient.

use super::band::Distances;
use crate::geometry::{Coord, DVec3};

/// Samples distances at one position after another; nodes are cached while positions stay in a cell.
pub struct Sampler<'a> {
    distances: &'a Distances,
    /// The cell whose nodes are cached.
    cell: Coord,
    /// Block of the last cell, and its slot.
    block: (Coord, Option<usize>),
    /// Distances at the 4 x 4 x 4 nodes around the cell.
    nodes: [[[f32; 4]; 4]; 4],
}

/// Weights of four nodes, and their derivatives, at a fraction 0..1 of the distance from the second to the third.
fn weights(t: f32) -> [[f32; 4]; 2] {
    let (t2, t3) = (t * t, t * t * t);
    [
        [
            0.5 * (2.0 * t2 - t3 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (4.0 * t2 - 3.0 * t3 + t),
            0.5 * (t3 - t2),
        ],
        [
            0.5 * (4.0 * t - 3.0 * t2 - 1.0),
            0.5 * (9.0 * t2 - 10.0 * t),
            0.5 * (8.0 * t - 9.0 * t2 + 1.0),
            0.5 * (3.0 * t2 - 2.0 * t),
        ],
    ]
}

fn dot(values: &[f32; 4], weights: &[f32; 4]) -> f32 {
    (values[0] * weights[0] + values[1] * weights[1]) + (values[2] * weights[2] + values[3] * weights[3])
}

impl<'a> Sampler<'a> {
    /// Reads these distances.
    pub fn new(distances: &'a Distances) -> Self {
        let nowhere = [i32::MAX; 3];
        Self { distances, cell: nowhere, block: (nowhere, None), nodes: [[[0.0; 4]; 4]; 4] }
    }

    /// Distance and gradient (cells) at a position (cells); none outside the band's blocks.
    pub fn at(&mut self, position: DVec3) -> Option<(f32, [f32; 3])> {
        let cell = [0, 1, 2].map(|axis| position[axis].floor() as i32);
        if cell != self.cell {
            self.cell = cell;
            let block = cell.map(|x| x >> 3);
            if block != self.block.0 {
                self.block = (block, self.distances.find(block));
            }
            self.gather();
        }
        self.block.1?;
        let part = [0, 1, 2].map(|axis| (position[axis] - f64::from(cell[axis])) as f32);
        let [[wx, dx], [wy, dy], [wz, dz]] = part.map(weights);
        // Along z, then y, then x.
        let mut planes = [[0.0f32; 4]; 3];
        for x in 0..4 {
            let mut rows = [[0.0f32; 4]; 2];
            for y in 0..4 {
                rows[0][y] = dot(&self.nodes[x][y], &wz);
                rows[1][y] = dot(&self.nodes[x][y], &dz);
            }
            planes[0][x] = dot(&rows[0], &wy);
            planes[1][x] = dot(&rows[0], &dy);
            planes[2][x] = dot(&rows[1], &wy);
        }
        Some((dot(&planes[0], &wx), [dot(&planes[0], &dx), dot(&planes[1], &wx), dot(&planes[2], &wx)]))
    }

    fn gather(&mut self) {
        let Some(slot) = self.block.1 else { return };
        let around = self.distances.around(slot);
        // Where there is no block, the distance is the reach, with the sign of the cell's own first node.
        let own = self.distances.values(slot)
            [((self.cell[0] & 7) << 6 | (self.cell[1] & 7) << 3 | (self.cell[2] & 7)) as usize];
        let far = self.distances.reach_in(self.block.0).copysign(own);
        for x in 0..4 {
            for y in 0..4 {
                for z in 0..4 {
                    let at = [x, y, z].map(|x| x as i32);
                    let node = [0, 1, 2].map(|axis| (self.cell[axis] & 7) + at[axis] - 1);
                    let near =
                        (((node[0] >> 3) + 1) * 9 + ((node[1] >> 3) + 1) * 3 + (node[2] >> 3) + 1) as usize;
                    let index = ((node[0] & 7) << 6 | (node[1] & 7) << 3 | (node[2] & 7)) as usize;
                    self.nodes[x][y][z] = match around[near] {
                        Distances::NONE => far,
                        slot => self.distances.values(slot as usize)[index],
                    };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::weights;

    #[test]
    fn weights_keep_lines_and_their_slope() {
        for t in [0.0, 0.25, 0.9] {
            let [w, d] = weights(t);
            let line = [-1.0, 0.0, 1.0, 2.0];
            let sum = |w: &[f32; 4]| line.iter().zip(w).map(|(x, w)| x * w).sum::<f32>();
            assert!((sum(&w) - t).abs() < 1e-6 && (sum(&d) - 1.0).abs() < 1e-6);
            assert!(d.iter().sum::<f32>().abs() < 1e-6);
        }
    }
}
