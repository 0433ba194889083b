//! Indices for the lines through voxels that are parallel to an axis, in a sparse set of columns of 8 x 8 lines.

/// Lines in a column.
const LINES: usize = 64;
/// Sentinel: no column.
const NONE: u32 = u32::MAX;

/// A sparse set of columns of lines; lines and columns have two coordinates.
pub struct Columns {
    /// Minimum and maximum column.
    low: [i32; 2],
    high: [i32; 2],
    /// For each column from `low` to `high`, its index in `positions`, or [`NONE`].
    indices: Vec<u32>,
    /// The added columns.
    positions: Vec<[i32; 2]>,
}

impl Columns {
    /// An empty set of columns from `low` to `high`.
    pub fn new(low: [i32; 2], high: [i32; 2]) -> Self {
        let size = [0, 1].map(|axis| (i64::from(high[axis]) - i64::from(low[axis]) + 1).max(0) as usize);
        Self { low, high, indices: vec![NONE; size[0] * size[1]], positions: Vec::new() }
    }

    /// Adds a column between `low` and `high`, unless the set contains it.
    pub fn add(&mut self, column: [i32; 2]) {
        let position = self.position(column).expect("the column lies within the bounds");
        if self.indices[position] == NONE {
            self.indices[position] = self.positions.len() as u32;
            self.positions.push(column);
        }
    }

    /// Number of lines.
    pub fn lines(&self) -> usize {
        self.positions.len() * LINES
    }

    /// The index of the line with these coordinates (voxels).
    pub fn line(&self, [p, q]: [i32; 2]) -> Option<usize> {
        let index = self.indices[self.position([p >> 3, q >> 3])?];
        (index != NONE).then(|| index as usize * LINES + ((p & 7) << 3 | (q & 7)) as usize)
    }

    /// The indices of the lines with coordinates (voxels) from `first` to `last`.
    pub fn between(&self, first: [i32; 2], last: [i32; 2]) -> impl Iterator<Item = usize> + '_ {
        let range =
            move |axis: usize| first[axis].max(self.low[axis] * 8)..=last[axis].min(self.high[axis] * 8 + 7);
        range(0).flat_map(move |p| range(1).filter_map(move |q| self.line([p, q])))
    }

    /// The coordinates of a line.
    pub fn coordinates(&self, line: usize) -> [i32; 2] {
        let ([p, q], inner) = (self.positions[line / LINES], (line % LINES) as i32);
        [p * 8 + (inner >> 3), q * 8 + (inner & 7)]
    }

    fn position(&self, column: [i32; 2]) -> Option<usize> {
        let within = (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&column[axis]));
        let [i, j, width] =
            [column[0] - self.low[0], column[1] - self.low[1], self.high[1] - self.low[1] + 1].map(i64::from);
        within.then(|| (i * width + j) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_added_columns_are_indexed_on_both_sides_of_zero() {
        let mut columns = Columns::new([-2, -1], [0, 1]);
        for column in [[0, 1], [-2, -1], [0, 1]] {
            columns.add(column);
        }
        assert_eq!(columns.lines(), 128);
        assert_eq!((columns.line([0, 8]), columns.line([7, 15])), (Some(0), Some(63)));
        assert_eq!((columns.line([-16, -8]), columns.line([-15, -7])), (Some(64), Some(73)));
        assert_eq!(
            (columns.line([-8, 0]), columns.line([8, 8]), columns.line([-17, -8])),
            (None, None, None)
        );
        assert_eq!(columns.between([-100, 6], [1, 9]).collect::<Vec<_>>(), [0, 1, 8, 9]);
        for line in 0..128 {
            assert_eq!(columns.line(columns.coordinates(line)), Some(line));
        }
    }
}
