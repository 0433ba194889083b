//! The terrain's own solids, kept apart from those of moving shapes, so that shapes move without casting the terrain again.

use std::ops::Range;

use super::shapes::Shape;
use super::solids::{Solid, unite};
use crate::shallow::columns::grid::{Cells, Grid, Heights};

/// Lists of solids, cell by cell.
#[derive(Debug, Clone, Default)]
struct CellSolids {
    /// Where each cell's solids begin, and the end of the last.
    starts: Vec<u32>,
    solids: Vec<Solid>,
}

impl CellSolids {
    fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.solids.clear();
    }

    /// Ends a cell, whose solids have been added.
    fn end_cell(&mut self) {
        self.starts.push(self.solids.len() as u32);
    }

    fn cell(&self, index: usize) -> &[Solid] {
        &self.solids[self.starts[index] as usize..self.starts[index + 1] as usize]
    }

    /// Adds a range of another list's cells.
    fn add(&mut self, other: &Self, cells: Range<usize>) {
        let from = other.starts[cells.start];
        let shift = (self.solids.len() as u32).wrapping_sub(from);
        self.solids.extend_from_slice(&other.solids[from as usize..other.starts[cells.end] as usize]);
        let ends = &other.starts[cells.start + 1..=cells.end];
        self.starts.extend(ends.iter().map(|end| end.wrapping_add(shift)));
    }
}

/// Moving shapes, and the terrain's own solids.
#[derive(Debug, Clone, Default)]
pub struct Ground {
    bodies: Vec<Shape>,
    /// Solids of every cell (`Grid::index`), while there are shapes.
    own: CellSolids,
    /// Scratch buffer in which `own` is rebuilt.
    rebuilt: CellSolids,
    /// The solids of some cells, united with those of the shapes.
    united: CellSolids,
    /// Shapes over the current row of cells, with their cells along x.
    in_row: Vec<(usize, Range<usize>)>,
    /// Scratch: the solids of one cell.
    cell: Vec<Solid>,
}

impl Ground {
    /// The shapes.
    pub fn bodies(&self) -> &[Shape] {
        &self.bodies
    }

    /// Sets the shapes; calls `visit` with the boxes of cells that a changed shape may have covered before, or may cover now.
    pub fn set_bodies(&mut self, grid: &Grid, bodies: &[Shape], mut visit: impl FnMut(Cells)) {
        for index in 0..bodies.len().max(self.bodies.len()) {
            let (old, new) = (self.bodies.get(index), bodies.get(index));
            if old != new {
                old.into_iter().chain(new).for_each(|shape| visit(shape.cells(grid)));
            }
        }
        bodies.clone_into(&mut self.bodies);
    }

    /// Clears the terrain's solids; [`Ground::add`] is then called for every cell, row by row along x.
    pub fn clear(&mut self) {
        self.own.clear();
    }

    /// Adds the solids of the next cell, from the lowest up.
    pub fn add(&mut self, solids: impl Iterator<Item = Solid>) {
        self.own.solids.extend(solids);
        self.own.end_cell();
    }

    /// Replaces the solids of a box of cells by those of `cast`, one cell after another, row by row along x.
    pub fn replace<'a>(&mut self, grid: &Grid, [across, rows]: &Cells, cast: impl Fn(usize) -> &'a [Solid]) {
        let nx = grid.size[0];
        let Self { own, rebuilt, .. } = self;
        rebuilt.clear();
        rebuilt.add(own, 0..rows.start * nx);
        let mut next = 0;
        for row in rows.clone() {
            rebuilt.add(own, row * nx..row * nx + across.start);
            for _ in across.clone() {
                rebuilt.solids.extend_from_slice(cast(next));
                rebuilt.end_cell();
                next += 1;
            }
            rebuilt.add(own, row * nx + across.end..(row + 1) * nx);
        }
        rebuilt.add(own, rows.end * nx..grid.cells());
        std::mem::swap(own, rebuilt);
    }

    /// Unites the solids of some cells (x, z), row by row along x, with those of the shapes, except in excluded cells.
    pub fn unite(
        &mut self,
        grid: &Grid,
        heights: &Heights,
        cells: impl Iterator<Item = [usize; 2]>,
        is_excluded: impl Fn([usize; 2]) -> bool,
    ) {
        let mut last = None;
        self.united.clear();
        for [x, z] in cells {
            if last != Some(z) {
                last = Some(z);
                self.in_row.clear();
                for (index, shape) in self.bodies.iter().enumerate() {
                    let [across, rows] = shape.cells(grid);
                    if rows.contains(&z) && !across.is_empty() {
                        self.in_row.push((index, across));
                    }
                }
            }
            let own = self.own.cell(grid.index([x, z]));
            self.cell.clear();
            let over = self.in_row.iter().filter(|(_, across)| across.contains(&x));
            let solid = |(index, _): &(usize, _)| self.bodies[*index].solid(grid.centre([x, z]), heights);
            if !is_excluded([x, z]) {
                self.cell.extend(over.filter_map(solid));
            }
            if self.cell.is_empty() {
                self.united.solids.extend_from_slice(own);
            } else {
                self.cell.extend_from_slice(own);
                unite(&mut self.cell);
                self.united.solids.extend_from_slice(&self.cell);
            }
            self.united.end_cell();
        }
    }

    /// The united solids of a cell, by its rank among the cells given to [`Ground::unite`].
    pub fn united(&self, rank: usize) -> &[Solid] {
        self.united.cell(rank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::shallow::columns::grid::BOTTOMLESS;

    const GRID: Grid = Grid { cell: 1.0, origin: [0.0; 2], size: [6, 5] };

    fn ground() -> Ground {
        let mut ground = Ground::default();
        ground.clear();
        for cell in 0..30 {
            let bridge = (cell % 3 == 0).then_some([1000, 2000]);
            ground.add([[BOTTOMLESS, cell]].into_iter().chain(bridge));
        }
        ground
    }

    #[test]
    fn a_box_of_cells_gets_other_solids() {
        let mut ground = ground();
        let (one, two): (&[Solid], &[Solid]) = (&[[7, 8]], &[[5, 6], [7, 8]]);
        ground.replace(&GRID, &[2..4, 1..3], |at| [one, &[], two, one][at]);
        for cell in 0..30 {
            let expected = match cell {
                8 => vec![[7, 8]],
                9 => vec![],
                14 => vec![[5, 6], [7, 8]],
                15 => vec![[7, 8]],
                _ if cell % 3 == 0 => vec![[BOTTOMLESS, cell as i32], [1000, 2000]],
                _ => vec![[BOTTOMLESS, cell as i32]],
            };
            assert_eq!(ground.own.cell(cell), expected, "cell {cell}");
        }
    }

    #[test]
    fn shapes_are_united_with_the_ground_and_leave_it_as_it_was() {
        let mut ground = ground();
        let heights = Heights::between(0.0, f64::from(1 << 30)).unwrap();
        let ball = |y: f64| Shape::Sphere { centre: DVec3::new(2.5, y, 2.5), radius: 1.2 };
        let mut boxes = Vec::new();
        ground.set_bodies(&GRID, &[ball(1000.0)], |cells| boxes.push(cells));
        assert_eq!(boxes.len(), 1);
        let all = || (0..30).map(|cell| [cell % 6, cell / 6]);
        ground.unite(&GRID, &heights, all(), |_| false);
        assert_eq!(ground.united(14), [[BOTTOMLESS, 14], [999, 1001]]);
        assert_eq!(ground.united(15), [[BOTTOMLESS, 15], [999, 2000]], "it touches the bridge");
        assert_eq!(ground.united(17), [[BOTTOMLESS, 17]]);
        ground.set_bodies(&GRID, &[ball(1000.0), ball(10.0)], |cells| boxes.push(cells));
        assert_eq!(boxes.len(), 2, "the first stays");
        ground.set_bodies(&GRID, &[], |cells| boxes.push(cells));
        assert_eq!(boxes.len(), 4);
        ground.unite(&GRID, &heights, all(), |_| false);
        assert!((0..30).all(|cell| ground.united(cell) == ground.own.cell(cell)));
    }
}
