//! Pipes between columns (thesis 4.1.1): their openness, the slope of the ground below them, and the pipes that leave the domain.
//!
//! A pipe joins two columns of adjacent cells whose [b, max] overlap. Those between columns of one layer are *regular*: each column owns
//! the one to its east and the one to its south, so that they are arrays beside the columns. All others are *links*, in a list: between
//! layers, to the outside, and, where liquid may fall freely, over cliffs.

mod border;
pub(super) mod cliffs;
pub(super) mod finder;
pub(super) mod links;
pub(super) mod pipe_rules;
pub(super) mod side;
mod slopes;

pub use border::Border;
pub(super) use links::Ends;
pub use links::Links;

use super::columns::Columns;
use super::columns::per_column::{Array, PerColumn};
use finder::Finder;
use pipe_rules::Rules;

/// All pipes of a terrain.
#[derive(Debug, Clone, PartialEq)]
pub struct Pipes {
    /// Openness of the pipe from each index to the next along x; 0: none.
    pub east: PerColumn<f32>,
    /// Openness of the pipe from each index to its southern neighbour along z.
    pub south: PerColumn<f32>,
    /// All other pipes.
    pub links: Links,
}

impl Pipes {
    /// The pipes between columns, and over the border of the domain.
    pub fn new(columns: &Columns, border: Border) -> Self {
        Self::with_rules(columns, Rules::bordered(border))
    }

    /// As [`Pipes::new`], but with these rules: pipes over cliffs are links, and where the ground beside a column rises steeply it is a
    /// wall (`Rules::wall_rise`).
    pub(super) fn with_rules(columns: &Columns, rules: Rules) -> Self {
        let mut pipes = Self {
            east: PerColumn::new(Array::OpenEast, columns.len(), 0.0),
            south: PerColumn::new(Array::OpenSouth, columns.len(), 0.0),
            links: Links { rows: vec![0], ..Links::default() },
        };
        let (rows, open) = (0..columns.grid.size[1], [&mut pipes.east[..], &mut pipes.south[..]]);
        Finder::default().find(columns, &rules, rows, open, &mut pipes.links);
        pipes.links.list_columns(columns, &mut Ends::default());
        pipes
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let links = &self.links;
        let ends = size_of_val(&links.from[..]) + size_of_val(&links.to[..]) + size_of_val(&links.sides[..]);
        let numbers = size_of_val(&links.open[..]) + size_of_val(&links.level[..]);
        let lists = [&links.rows, &links.columns, &links.column_rows];
        let lists: usize = lists.iter().map(|list| size_of_val(&list[..])).sum();
        self.east.bytes() + self.south.bytes() + ends + numbers + lists
    }
}

#[cfg(test)]
mod tests {
    use super::super::columns::grid::{BOTTOMLESS, Grid, Heights};
    use super::*;
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
    fn openness_falls_with_the_square_of_the_slope_and_is_the_same_from_both_sides() {
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
    fn a_bank_is_a_wall_where_friction_is_at_walls_and_a_steep_plane_stays_a_slope() {
        let rules = |wall_rise| Rules { wall_rise, ..Rules::bordered(Border::Closed) };
        // A channel along x, with banks of three metres beside three cells of one metre.
        let channel = columns([4, 5], |[_, z]| {
            vec![[BOTTOMLESS, if z == 0 || z == 4 { 103 * METRE } else { 100 * METRE }]]
        });
        let beside = channel.column([1, 1], 0).unwrap();
        let [walled, open] =
            [METRE, i32::MAX].map(|rise| Pipes::with_rules(&channel, rules(rise)).east[beside]);
        assert_eq!((walled, open), (1.0, (1.0f32 + 2.25).powi(-2)));
        // A plane of 56 degrees across the pipe.
        let plane = columns([4, 5], |[_, z]| vec![[BOTTOMLESS, 100 * METRE + 3 * z as i32 * METRE / 2]]);
        let middle = plane.column([1, 2], 0).unwrap();
        assert_eq!(Pipes::with_rules(&plane, rules(METRE)).east[middle], (1.0f32 + 2.25).powi(-2));
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
        // From the bridge to both sides, ten in all; liquid passes below and above the bridge, and the pillar's top is open towards it.
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
        assert_eq!(pipes.links.max_pipes, 6);
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
        assert_eq!(links.to, vec![crate::shallow::columns::NONE; links.len()]);
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
