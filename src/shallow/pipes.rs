//! Pipes between columns (thesis 4.1.1): where they are open, how steep the ground below them is, and those that leave the domain.
//!
//! A pipe joins two columns of adjacent cells whose [b, max] overlap. Those between columns of one layer are *regular*: each column owns
//! the one to its east and the one to its south, so that they are arrays beside the columns. All others are *links*, in a list: between
//! layers, and to the outside.
//!
//! The thesis derives viscosity for level ground. On ground of slope S a film of vertical depth H is thinner by cos, and driven along the slope: its
//! discharge is that of level ground over (1 + S^2)^2, which `openness` gives.

use super::columns::{Columns, NONE, STRIP};
use super::grid::BOTTOMLESS;

/// What lies beyond the border of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Border {
    /// A wall.
    #[default]
    Closed,
    /// Nothing: liquid flows off as the ground near the border leads it, and is counted as lost.
    Open,
    /// Liquid at rest, at the level that it has at the border at first: waves leave, and do not come back. What goes out and in is counted.
    Absorbing,
}

/// Slopes are taken as at most this steep (60 degrees): a step of the ground is no slope, and liquid falls over its edge.
const STEEPEST: f64 = 3.0;

/// The pipes that are not regular, by owner's row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Links {
    /// The column that gives where the flux is positive.
    pub from: Vec<u32>,
    /// The other column, or [`NONE`]: the outside.
    pub to: Vec<u32>,
    /// As [`Pipes::east`].
    pub open: Vec<f32>,
    /// Surface outside (units), where `to` is [`NONE`].
    pub level: Vec<i32>,
    /// First link of each row, and the end of the last.
    pub rows: Vec<u32>,
    /// Columns with links, row by row.
    pub columns: Vec<u32>,
    /// First of those columns of each row, and the end of the last.
    pub column_rows: Vec<u32>,
    /// Most pipes that a column has.
    pub most: usize,
}

/// All pipes of a terrain.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pipes {
    /// Openness of the pipe from each index to the next along x: 0 where there is none.
    pub east: Vec<f32>,
    /// Openness of the pipe from each index to the one behind it along z.
    pub south: Vec<f32>,
    /// All others.
    pub links: Links,
}

impl Pipes {
    /// The pipes between columns, and over the border of the domain.
    pub fn new(columns: &Columns, border: Border) -> Self {
        let mut pipes = Self {
            east: vec![0.0; columns.len()],
            south: vec![0.0; columns.len()],
            links: Links { rows: vec![0], column_rows: vec![0], ..Links::default() },
        };
        for row in 0..columns.grid.size[1] {
            for strip in columns.row(row) {
                pipes.open_strip(columns, strip);
            }
            pipes.link_row(columns, row, border);
        }
        pipes.links.index(columns);
        pipes
    }

    fn open_strip(&mut self, columns: &Columns, strip: usize) {
        for i in (strip * STRIP..(strip + 1) * STRIP).filter(|&i| columns.is_column(i)) {
            if let Some(j) = beside(columns, i, Side::East).filter(|&j| columns.overlap(i, j)) {
                self.east[i] = openness(columns, i, j, Axis::X);
            }
            if let Some(j) = beside(columns, i, Side::South).filter(|&j| columns.overlap(i, j)) {
                self.south[i] = openness(columns, i, j, Axis::Z);
            }
        }
    }

    fn link_row(&mut self, columns: &Columns, row: usize, border: Border) {
        for x in 0..columns.grid.size[0] {
            for i in columns.of_cell([x, row]) {
                for side in Side::ALL {
                    self.links.join(columns, i, side, border);
                }
            }
        }
        self.links.rows.push(self.links.from.len() as u32);
    }
}

/// A side of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    East,
    South,
    West,
    North,
}

/// An axis on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axis {
    X,
    Z,
}

impl Side {
    const ALL: [Self; 4] = [Self::East, Self::South, Self::West, Self::North];

    fn axis(self) -> Axis {
        if matches!(self, Self::East | Self::West) { Axis::X } else { Axis::Z }
    }

    fn opposite(self) -> Self {
        match self {
            Self::East => Self::West,
            Self::South => Self::North,
            Self::West => Self::East,
            Self::North => Self::South,
        }
    }

    /// The cell beyond this side, if it is within the domain.
    fn cell(self, [x, z]: [usize; 2], [nx, nz]: [usize; 2]) -> Option<[usize; 2]> {
        match self {
            Self::East => (x + 1 < nx).then(|| [x + 1, z]),
            Self::South => (z + 1 < nz).then(|| [x, z + 1]),
            Self::West => x.checked_sub(1).map(|x| [x, z]),
            Self::North => z.checked_sub(1).map(|z| [x, z]),
        }
    }
}

/// The column of the same layer beyond a side.
fn beside(columns: &Columns, i: usize, side: Side) -> Option<usize> {
    let (strip, place) = (i / STRIP, i % STRIP);
    let at = |strip: u32| (strip != NONE).then(|| strip as usize * STRIP + place);
    let j = match side {
        Side::East if place + 1 < STRIP => Some(i + 1),
        Side::East => columns.east(strip).map(|next| next * STRIP),
        Side::West if place > 0 => Some(i - 1),
        Side::West => columns.west(strip).map(|before| before * STRIP + STRIP - 1),
        Side::South => at(columns.south(strip)),
        Side::North => at(columns.north(strip)),
    };
    j.filter(|&j| columns.is_column(j))
}

/// Twice the difference of the bases beyond both sides of a column along an axis, over regular pipes; over one side where the other has none.
fn rise(columns: &Columns, i: usize, axis: Axis) -> i64 {
    let sides = if axis == Axis::X { [Side::West, Side::East] } else { [Side::North, Side::South] };
    let base = |i: usize| i64::from(columns.bases()[i]);
    let beyond = sides.map(|side| beside(columns, i, side).filter(|&j| columns.overlap(i, j)).map(base));
    match beyond {
        [Some(before), Some(behind)] => behind - before,
        [Some(before), None] => 2 * (base(i) - before),
        [None, Some(behind)] => 2 * (behind - base(i)),
        [None, None] => 0,
    }
}

/// 1 / (1 + slope^2)^2 of the ground between two columns that are adjacent along an axis: the discharge of a film on it over that of a film of
/// the same vertical depth and fall on level ground.
fn openness(columns: &Columns, i: usize, j: usize, axis: Axis) -> f32 {
    let along = i64::from(columns.bases()[j]) - i64::from(columns.bases()[i]);
    openness_of(columns, 4 * along, i, j, axis)
}

/// As [`openness`], of four times the rise along the axis.
fn openness_of(columns: &Columns, along: i64, i: usize, j: usize, axis: Axis) -> f32 {
    let other = if axis == Axis::X { Axis::Z } else { Axis::X };
    // Integers, so that the sum is the same from both ends.
    let across = rise(columns, i, other) + rise(columns, j, other);
    let scale = columns.heights.unit / (4.0 * columns.grid.cell);
    let slope = [along, across].map(|rise| (rise as f64 * scale).powi(2));
    let steep = 1.0 + (slope[0] + slope[1]).min(STEEPEST);
    (1.0 / (steep * steep)) as f32
}

impl Links {
    /// Adds the links of a column over a side: those to columns of other layers, which the cell to the west or north owns, and
    /// the one to the outside.
    fn join(&mut self, columns: &Columns, i: usize, side: Side, border: Border) {
        let cell = side.cell(columns.cell(i), columns.grid.size);
        let is_owner = matches!(side, Side::East | Side::South);
        if let Some(cell) = cell.filter(|_| is_owner) {
            let layer = columns.layer(i);
            for j in columns.of_cell(cell) {
                if columns.layer(j) != layer && columns.overlap(i, j) {
                    self.add(i, j as u32, openness(columns, i, j, side.axis()), 0);
                }
            }
        }
        let falls = cell.is_some_and(|cell| match columns.column(cell, 0) {
            // Below a solid that hangs.
            Some(j) => columns.unders()[j] != BOTTOMLESS && columns.bases()[i] < columns.unders()[j],
            None => true,
        });
        if falls || (cell.is_none() && border != Border::Closed) {
            let base = i64::from(columns.bases()[i]);
            let fall = if falls {
                (columns.grid.cell / columns.heights.unit).min(f64::from(i32::MAX / 2)) as i64
            } else {
                // The ground goes on as it comes, but never rises.
                let inner = beside(columns, i, side.opposite()).filter(|&j| columns.overlap(i, j));
                inner.map_or(0, |j| (i64::from(columns.bases()[j]) - base).max(0))
            };
            let open = openness_of(columns, 4 * fall, i, i, side.axis());
            self.add(i, NONE, open, (base - fall).max(i64::from(i32::MIN / 2)) as i32);
        }
    }

    fn add(&mut self, from: usize, to: u32, open: f32, level: i32) {
        self.from.push(from as u32);
        self.to.push(to);
        self.open.push(open);
        self.level.push(level);
    }

    /// Lists the columns with links.
    fn index(&mut self, columns: &Columns) {
        let mut linked = vec![0usize; columns.len()];
        let ends = self.from.iter().chain(self.to.iter().filter(|&&to| to != NONE));
        ends.for_each(|&end| linked[end as usize] += 1);
        self.most = 4 + linked.iter().copied().max().unwrap_or(0);
        for row in 0..columns.grid.size[1] {
            let strips = columns.row(row);
            let with = (strips.start * STRIP..strips.end * STRIP).filter(|&i| linked[i] > 0);
            self.columns.extend(with.map(|i| i as u32));
            self.column_rows.push(self.columns.len() as u32);
        }
    }

    /// Count of links.
    pub fn len(&self) -> usize {
        self.from.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.from.is_empty()
    }

    /// The links that a row owns: from its columns to others of the row, of the next one, or outside.
    pub fn row(&self, row: usize) -> std::ops::Range<usize> {
        self.rows[row] as usize..self.rows[row + 1] as usize
    }

    /// The columns of a row that have links.
    pub fn columns_of(&self, row: usize) -> &[u32] {
        &self.columns[self.column_rows[row] as usize..self.column_rows[row + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::grid::{Grid, Heights};
    use crate::shallow::terrain::Solids;

    fn columns(size: [usize; 2], cell: impl Fn([usize; 2]) -> Vec<[i32; 2]>) -> Columns {
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size };
        let heights = Heights::between(0.0, 1024.0).unwrap();
        let cells = (0..grid.cells()).map(|index| cell([index % size[0], index / size[0]]));
        Columns::new(&Solids::new(grid, heights, cells))
    }

    /// Units in a metre.
    const METRE: i32 = 1 << 20;

    #[test]
    fn a_slope_closes_by_its_square_and_one_the_same_from_both_sides() {
        let ground = |[x, z]: [usize; 2]| vec![[BOTTOMLESS, (100 + x as i32 + 3 * z as i32) * METRE / 4]];
        let columns = columns([20, 20], ground);
        let pipes = Pipes::new(&columns, Border::Closed);
        // Slopes 0.25 along x and 0.75 along z.
        let all = (1.0f32 + 0.0625 + 0.5625).powi(-2);
        let i = columns.column([7, 9], 0).unwrap();
        assert_eq!((pipes.east[i], pipes.south[i]), (all, all));
        let last = columns.column([19, 19], 0).unwrap();
        assert_eq!((pipes.east[last], pipes.south[last]), (0.0, 0.0));
        assert!(pipes.links.is_empty());
    }

    #[test]
    fn a_bridge_has_links_and_walls_have_no_pipes() {
        let ground = |[x, z]: [usize; 2]| match (x, z) {
            (_, 1) => vec![[BOTTOMLESS, METRE], [3 * METRE, 4 * METRE]],
            (2, 2) => vec![[BOTTOMLESS, 3 * METRE]],
            _ => vec![[BOTTOMLESS, METRE]],
        };
        let columns = columns([5, 3], ground);
        let pipes = Pipes::new(&columns, Border::Closed);
        let at = |x: usize, z: usize, layer: usize| columns.column([x, z], layer).unwrap();
        assert!(pipes.south[at(1, 0, 0)] > 0.0 && pipes.south[at(1, 1, 0)] > 0.0);
        assert_eq!(pipes.south[at(2, 1, 0)], 0.0, "the pillar closes the passage");
        // From the bridge to both sides, ten in all; the bridge is passed below and above, the pillar's top lies open to the bridge.
        let joins = |i: usize, j: usize| {
            (0..pipes.links.len())
                .any(|link| (pipes.links.from[link], pipes.links.to[link]) == (i as u32, j as u32))
        };
        assert!(
            joins(at(3, 0, 0), at(3, 1, 1))
                && joins(at(3, 1, 1), at(3, 2, 0))
                && joins(at(2, 1, 1), at(2, 2, 0))
        );
        assert_eq!(pipes.links.len(), 10);
        assert_eq!(pipes.links.row(0).len(), 5);
        assert_eq!(pipes.links.columns_of(1).len(), 5, "those of the bridge");
        assert_eq!(pipes.links.most, 6);
    }

    #[test]
    fn open_borders_go_on_downhill_only() {
        let columns = columns([3, 1], |[x, _]| vec![[BOTTOMLESS, (10 - x as i32) * METRE]]);
        let pipes = Pipes::new(&columns, Border::Open);
        let links = &pipes.links;
        let level = |x: usize, side: usize| {
            let own: Vec<i32> =
                (0..links.len()).filter(|&l| links.from[l] == x as u32).map(|l| links.level[l]).collect();
            own[side]
        };
        // The last cell: east, south, north; the first: south, west, north.
        assert_eq!(level(2, 0), 7 * METRE);
        assert_eq!(level(2, 1), 8 * METRE);
        assert_eq!(level(0, 1), 10 * METRE, "it does not rise outside");
        assert_eq!(links.to, vec![NONE; links.len()]);
    }

    #[test]
    fn liquid_falls_where_there_is_no_ground() {
        let columns = columns([3, 1], |[x, _]| match x {
            0 => vec![[2 * METRE, 5 * METRE]],
            1 => vec![],
            _ => vec![[7 * METRE, 8 * METRE]],
        });
        let links = Pipes::new(&columns, Border::Closed).links;
        assert_eq!((links.len(), links.level[0]), (2, 4 * METRE));
    }
}
