//! Positions in cubes: which ones are near another.

use std::collections::HashMap;

use frazil::geometry::DVec3;

/// Positions in cubes of an edge (m).
pub struct Bins<'a> {
    edge: f64,
    positions: &'a [DVec3],
    bins: HashMap<[i64; 3], Vec<usize>>,
}

impl<'a> Bins<'a> {
    pub fn new(positions: &'a [DVec3], edge: f64) -> Self {
        let mut bins: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (at, position) in positions.iter().enumerate() {
            bins.entry(bin(position, edge)).or_default().push(at);
        }
        Self { edge, positions, bins }
    }

    /// Calls `see` with those within an edge of a position, in a fixed order.
    pub fn near(&self, position: &DVec3, mut see: impl FnMut(usize)) {
        let [x, y, z] = bin(position, self.edge);
        for n in 0..27 {
            let at = [x + n / 9 - 1, y + n / 3 % 3 - 1, z + n % 3 - 1];
            for other in self.bins.get(&at).into_iter().flatten() {
                if (self.positions[*other] - position).norm() <= self.edge {
                    see(*other);
                }
            }
        }
    }
}

fn bin(position: &DVec3, edge: f64) -> [i64; 3] {
    [0, 1, 2].map(|axis| (position[axis] / edge).floor() as i64)
}
