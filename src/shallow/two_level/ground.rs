//! The ground of both sizes of cells.

use crate::shallow::columns::grid::{BOTTOMLESS, Cells, Grid};
use crate::shallow::pipes::pipe_rules::ExcludedCells;
use crate::shallow::terrain::Solids;
use crate::shallow::terrain::solids::{Solid, unite};

/// The terrain, in cells of both sizes.
pub(super) struct Ground {
    pub fine: Solids,
    pub coarse: Solids,
}

impl Ground {
    /// The terrain's fine ground, and the coarse ground that follows from it.
    pub fn new(solids: &Solids) -> Self {
        let Grid { cell, origin, size: [nx, nz] } = solids.grid;
        let grid = Grid { cell: 2.0 * cell, origin, size: [nx / 2, nz / 2] };
        let cells = (0..grid.cells()).map(|index| {
            mean(quarters(grid.position(index)).map(|cell| solids.cell(solids.grid.index(cell))))
        });
        Self { fine: solids.clone(), coarse: Solids::new(grid, solids.heights, cells) }
    }

    /// The fine ground of the near cells, and the coarse ground of all others.
    pub fn divided_solids(&self, near: &Cells) -> [Solids; 2] {
        let Self { fine, coarse } = self;
        [
            Solids::of_cells(fine.grid, fine.heights, |index| {
                self.fine_cell(near, fine.grid.position(index))
            }),
            Solids::of_cells(coarse.grid, coarse.heights, |index| {
                self.coarse_cell(near, coarse.grid.position(index))
            }),
        ]
    }

    /// The cells that the fine liquid and the coarse liquid leave to each other.
    pub fn excluded(near: &Cells) -> [ExcludedCells; 2] {
        [
            ExcludedCells { cells: near.clone(), is_inside: false },
            ExcludedCells { cells: halved(near), is_inside: true },
        ]
    }

    /// The solids of a fine cell; none if it is not near.
    pub fn fine_cell(&self, near: &Cells, [x, z]: [usize; 2]) -> &[Solid] {
        let is_near = near[0].contains(&x) && near[1].contains(&z);
        if is_near { self.fine.cell(self.fine.grid.index([x, z])) } else { &[] }
    }

    /// The solids of a coarse cell; none if its fine cells are near.
    pub fn coarse_cell(&self, near: &Cells, [x, z]: [usize; 2]) -> &[Solid] {
        let is_near = near[0].contains(&(2 * x)) && near[1].contains(&(2 * z));
        if is_near { &[] } else { self.coarse.cell(self.coarse.grid.index([x, z])) }
    }
}

/// The box of coarse cells that a box of fine ones makes up.
pub(super) fn halved(cells: &Cells) -> Cells {
    cells.clone().map(|range| range.start / 2..range.end / 2)
}

/// The fine cells of a coarse one.
pub(super) fn quarters([x, z]: [usize; 2]) -> [[usize; 2]; 4] {
    [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[dx, dz]| [2 * x + dx, 2 * z + dz])
}

/// The mean of four cells' solids, layer by layer from the lowest, over the cells that have the layer.
fn mean(four: [&[Solid]; 4]) -> Vec<Solid> {
    let layers = four.iter().map(|solids| solids.len()).max().unwrap_or(0);
    let layer = |layer: usize| {
        let own = || four.iter().filter_map(move |solids| solids.get(layer));
        let of = |end: usize| {
            let is_endless = own().any(|solid| solid[end] == BOTTOMLESS);
            let sum: i64 = own().map(|solid| i64::from(solid[end])).sum();
            if is_endless { BOTTOMLESS } else { sum.div_euclid(own().count() as i64) as i32 }
        };
        [of(0), of(1)]
    };
    let mut solids = (0..layers).map(layer).collect();
    unite(&mut solids);
    solids
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::Heights;

    #[test]
    fn coarse_ground_is_the_mean_of_each_layer() {
        let grid = Grid { cell: 1.0, origin: [0.0; 2], size: [4, 2] };
        let heights = Heights::between(0.0, 1.0).unwrap();
        let cell = |index: usize| match index {
            0 => vec![[BOTTOMLESS, 10], [50, 60]],
            1 | 4 => vec![[BOTTOMLESS, 12]],
            5 => vec![[BOTTOMLESS, 13], [52, 63]],
            _ => vec![[0, 7]],
        };
        let ground = Ground::new(&Solids::new(grid, heights, (0..8).map(cell)));
        assert_eq!((ground.coarse.grid.cell, ground.coarse.grid.size), (2.0, [2, 1]));
        assert_eq!(ground.coarse.cell(0), [[BOTTOMLESS, 11], [51, 61]]);
        assert_eq!(ground.coarse.cell(1), [[0, 7]]);
        let near = [2..4, 0..2];
        assert_eq!(
            (ground.fine_cell(&near, [2, 1]), ground.fine_cell(&near, [1, 1])),
            (&[[0, 7]][..], &[][..])
        );
        assert_eq!(
            (ground.coarse_cell(&near, [1, 0]), ground.coarse_cell(&near, [0, 0]).len()),
            (&[][..], 2)
        );
    }
}
