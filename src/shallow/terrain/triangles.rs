//! Solids of triangles, open or closed, that may overlap: a point is solid where the winding number is above 0.
//!
//! Down a vertical line from above, where the winding number is 0, a triangle that faces up adds 1 and one that faces down subtracts 1. So
//! overlapping solids unite, an open sheet that faces up is solid down to [`BOTTOMLESS`](crate::shallow::columns::grid::BOTTOMLESS), and
//! one that faces down is nothing. Which lines meet a triangle is decided exactly (`crossings.rs`), so no closed surface leaks.
//!
//! Heights of crossings, accurate to 2^-8 units, are first rounded to units and clamped to the range, and changes at the same height are
//! summed. A unit of height is thus solid if and only if the winding number at its middle is above 0: solids thinner than a unit may
//! vanish, and so may gaps.
//!
//! A line that meets an edge or vertex exactly passes it on the side of larger x, or z. A scene that is mirrored or rotated by 90 degrees
//! gives the same solids unless a line meets the silhouette of a solid exactly; the line then belongs to the other side.

use super::Solids;
use super::cell_crossings::{CellCrossings, reserve_half_more};
use super::crossings::{Crossed, Facet};
use super::lines::{LANES, Lines, Outline, Spans};
use super::solids::Solid;
use crate::error::{Error, Result};
use crate::geometry::Vec3;
use crate::numeric::checks::ensure;
use crate::numeric::cpu::{FlushDenormals, dispatch};
use crate::numeric::lists::refill;
use crate::shallow::columns::grid::{Cells, Grid, Heights, check_cells};

/// Up to this many lines are all tested against a triangle; of more, only those of each row between its edges.
const FEW: u32 = 3;
/// Count of lines that are collected before they are tested against a triangle.
const ROOM: usize = 64;

/// The solids of every cell. Triangles are counter-clockwise seen from outside.
///
/// # Errors
/// As [`Caster::new`] and [`Caster::cast`].
pub fn solids(positions: &[Vec3], triangles: &[[u32; 3]], grid: Grid, heights: Heights) -> Result<Solids> {
    let mut caster = Caster::new(grid, heights)?;
    let [nx, nz] = grid.size;
    caster.cast(positions, triangles, [0..nx, 0..nz])?;
    Ok(Solids::of_cells(grid, heights, |cell| caster.at(cell)))
}

/// Casts the lines through a box of cells, and is reused from frame to frame. Buffers have room for half as many crossings again: a cast
/// allocates only for a larger box, more vertices or many more crossings than before.
pub struct Caster {
    heights: Heights,
    size: [usize; 2],
    /// Along x and along z.
    lines: [Lines; 2],
    /// The cells of the last cast, along x and z.
    cells: Cells,
    /// For each vertex, its rank ([`Lines::rank`]) along x and z, clamped to the box.
    ranks: Vec<[u32; 2]>,
    crossings: CellCrossings,
    starts: Vec<u32>,
    solids: Vec<Solid>,
}

impl Caster {
    /// A caster that has not cast yet.
    ///
    /// # Errors
    /// `Argument`: a grid that [`Grid::validate`] refuses, an origin beyond 1e30 m from 0 (the range of exact decisions), cells that f64
    /// cannot distinguish, heights without a range.
    pub fn new(grid: Grid, heights: Heights) -> Result<Self> {
        grid.validate()?;
        let Grid { cell, origin, size } = grid;
        if let Some(far) = origin.into_iter().find(|position| position.abs() > 1e30) {
            return Err(Error::argument(format!("an origin at {far:e} m is beyond 1e30 m")));
        }
        if !(heights.low.is_finite() && heights.unit.is_finite() && heights.unit > 0.0) {
            let Heights { low, unit } = heights;
            return Err(Error::argument(format!(
                "heights from {low} m in units of {unit} m are not a range"
            )));
        }
        let centre = |axis: usize, index: usize| grid.centre([index; 2])[axis];
        for axis in [0, 1] {
            let merges = |index: &usize| centre(axis, *index) >= centre(axis, *index + 1);
            if let Some(index) = (0..size[axis] - 1).find(merges) {
                let position = centre(axis, index);
                return Err(Error::argument(format!(
                    "a cell of {cell} m is too fine for positions at {position:e} m"
                )));
            }
        }
        let lines = |axis: usize| {
            let ends = [origin[axis], centre(axis, 0), centre(axis, size[axis] - 1)].map(f64::abs);
            let reach = ends.into_iter().fold(0.0, f64::max);
            Lines::new((0..size[axis]).map(|index| centre(axis, index)), cell, reach)
        };
        Ok(Self {
            heights,
            size,
            lines: [0, 1].map(lines),
            cells: [0..0, 0..0],
            ranks: Vec::new(),
            crossings: CellCrossings::default(),
            starts: Vec::new(),
            solids: Vec::new(),
        })
    }

    /// Finds the solids of a box of cells (ranges of x and of z). Denormals are flushed meanwhile.
    ///
    /// # Errors
    /// `Argument`: no triangle, a vertex that is not finite, an index beyond the vertices, a box that is not within the grid. The
    /// caster then has no cells.
    pub fn cast(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], cells: Cells) -> Result<()> {
        let _flushed = FlushDenormals::begin();
        self.begin(&cells)?;
        ensure(!triangles.is_empty(), "the terrain has no triangles")?;
        self.rank(positions, &cells)?;
        self.cross(positions, triangles, &cells)?;
        self.crossings.find_solids(&mut self.starts, &mut self.solids);
        self.cells = cells;
        self.crossings.reserve_half_more();
        reserve_half_more(&mut self.solids);
        Ok(())
    }

    fn begin(&mut self, cells: &Cells) -> Result<()> {
        self.cells = [0..0, 0..0];
        self.starts.clear();
        self.solids.clear();
        check_cells(cells, self.size)?;
        self.crossings.reset(cells[0].len() * cells[1].len());
        Ok(())
    }

    /// Ranks of all vertices, clamped to the box.
    fn rank(&mut self, positions: &[Vec3], [x, z]: &Cells) -> Result<()> {
        let [along_x, along_z] = &self.lines;
        let [x, z] = [x, z].map(|range| [range.start as u32, range.end as u32]);
        let mut is_finite = true;
        refill(
            &mut self.ranks,
            positions.iter().map(|p| {
                is_finite &= p.x.is_finite() & p.y.is_finite() & p.z.is_finite();
                let ranks = [along_x.rank(p.x.into()), along_z.rank(p.z.into())];
                [ranks[0].clamp(x[0], x[1]), ranks[1].clamp(z[0], z[1])]
            }),
        );
        if is_finite {
            return Ok(());
        }
        let wild = positions.iter().position(|p| p.iter().any(|value| !value.is_finite()));
        Err(Error::argument(format!("vertex {} is not finite", wild.unwrap_or(0) + 1)))
    }

    /// Lists the crossings of each cell.
    fn cross(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], cells: &Cells) -> Result<()> {
        let ([x, z], lines, heights) = (cells, &self.lines, self.heights);
        let (ranks, crossings) = (&self.ranks[..], &mut self.crossings);
        let first = [x.start as u32, z.start as u32];
        let mut work = Work { positions, ranks, lines, heights, width: x.len() as u32, first, crossings };
        let work = &mut work;
        dispatch!(at most avx2: cross_triangles(work: &mut Work<'_>, triangles: &[[u32; 3]]) -> Result<()>)
    }

    /// The box of the last cast: ranges of x and of z.
    pub fn cells(&self) -> Cells {
        self.cells.clone()
    }

    /// Where each cell's solids begin in [`Caster::solids`], row by row along x through the box, and the end of the last.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The solids of all cells of the box; those of a cell from the lowest up, separate from each other.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The solids of a cell (x, z) of the grid, which must be within the box.
    pub fn cell(&self, [x, z]: [usize; 2]) -> &[Solid] {
        let [columns, rows] = &self.cells;
        assert!(columns.contains(&x) && rows.contains(&z), "cell ({x}, {z}) is not within the box");
        self.at((z - rows.start) * columns.len() + (x - columns.start))
    }

    /// The solids of a cell by its index in the box, row by row along x.
    pub fn at(&self, index: usize) -> &[Solid] {
        &self.solids[self.starts[index] as usize..self.starts[index + 1] as usize]
    }
}

/// Input and output of a search for crossings.
struct Work<'a> {
    positions: &'a [Vec3],
    ranks: &'a [[u32; 2]],
    lines: &'a [Lines; 2],
    heights: Heights,
    /// Count of the box's cells along x.
    width: u32,
    /// First cell of the box.
    first: [u32; 2],
    crossings: &'a mut CellCrossings,
}

#[inline(always)]
fn cross_triangles(work: &mut Work<'_>, triangles: &[[u32; 3]]) -> Result<()> {
    let mut candidates = Candidates::default();
    for (index, triangle) in triangles.iter().enumerate() {
        let rank = |corner: usize| work.ranks.get(triangle[corner] as usize);
        let (Some(&a), Some(&b), Some(&c)) = (rank(0), rank(1), rank(2)) else {
            let (triangle, count) = (index + 1, work.positions.len());
            let what = format!("triangle {triangle} names a vertex beyond the {count} there are");
            return Err(Error::argument(what));
        };
        let range = |axis: usize| {
            let [a, b, c] = [a[axis], b[axis], c[axis]];
            [a.min(b).min(c), a.max(b).max(c)]
        };
        let [columns, rows] = [range(0), range(1)];
        if columns[0] == columns[1] || rows[0] == rows[1] {
            continue;
        }
        work.cross(triangle, columns, rows, &mut candidates);
        if work.crossings.len() >= u32::MAX as usize {
            return Err(Error::argument("the terrain has over 4,294,967,294 crossings with lines of cells"));
        }
    }
    Ok(())
}

impl Work<'_> {
    /// Adds the crossings of a triangle within ranges of lines.
    #[inline(always)]
    fn cross(&mut self, triangle: &[u32; 3], columns: [u32; 2], rows: [u32; 2], candidates: &mut Candidates) {
        let [along_x, along_z] = self.lines;
        let corner = |corner: usize| {
            let p = &self.positions[triangle[corner] as usize];
            [p.x, p.y, p.z].map(f64::from)
        };
        let facet = Facet::new([corner(0), corner(1), corner(2)], self.heights.unit);
        // Few lines are all tested; of many, only those of each row between the triangle's edges.
        let [width, depth] = [columns, rows].map(|[first, last]| last - first);
        let first = (rows[0] - self.first[1]) * self.width + (columns[0] - self.first[0]);
        if width == 1 && depth == 1 {
            if let Some((height, is_up)) = facet.cross([along_x.at(columns[0]), along_z.at(rows[0])]) {
                self.crossings
                    .add(first as usize, (self.heights.round(height) as u32) << 1 | u32::from(is_up));
            }
            return;
        }
        let is_wide = width > 1 && width.saturating_mul(depth) > FEW;
        let outline = is_wide.then(|| Outline::new(&facet.corners, along_x));
        for first_row in (rows[0]..rows[1]).step_by(LANES) {
            let z = along_z.from(first_row);
            if let Some(outline) = &outline {
                outline.spans(z, columns, &mut candidates.spans);
            }
            for (position, row) in (first_row..rows[1]).take(LANES).enumerate() {
                let [start, end] = if is_wide { candidates.spans.lines(position) } else { columns };
                let first = (row - self.first[1]) * self.width + (start - self.first[0]);
                let mut column = start;
                loop {
                    if candidates.count > ROOM - LANES {
                        self.add_all(&facet, candidates);
                    }
                    let count = end.saturating_sub(column);
                    candidates.add(along_x.from(column), z[position], first + (column - start), count);
                    if count <= LANES as u32 {
                        break;
                    }
                    column += LANES as u32;
                }
            }
        }
        self.add_all(&facet, candidates);
    }

    /// Adds the crossings of a triangle with the candidates, and clears these.
    #[inline(always)]
    fn add_all(&mut self, facet: &Facet, candidates: &mut Candidates) {
        let Candidates { x, z, cells, count, crossed, .. } = candidates;
        let lanes = x.as_chunks::<LANES>().0.iter().zip(z.as_chunks::<LANES>().0);
        for ((x, z), cells) in lanes.zip(cells[..*count].chunks(LANES)) {
            facet.cross_all(x, z, &self.heights, crossed);
            for (lane, &cell) in cells.iter().enumerate() {
                if let Some((height, is_up)) =
                    facet.crossing_of(lane, crossed, [x[lane], z[lane]], &self.heights)
                {
                    self.crossings.add(cell as usize, height << 1 | u32::from(is_up));
                }
            }
        }
        *count = 0;
    }
}

/// Lines that may cross a triangle.
struct Candidates {
    x: [f64; ROOM],
    z: [f64; ROOM],
    cells: [u32; ROOM],
    count: usize,
    spans: Spans,
    crossed: Crossed,
}

impl Default for Candidates {
    fn default() -> Self {
        let (spans, crossed) = (Spans::default(), Crossed::default());
        Self { x: [0.0; ROOM], z: [0.0; ROOM], cells: [0; ROOM], count: 0, spans, crossed }
    }
}

impl Candidates {
    /// Adds lines side by side: the first `count` ones, at most [`LANES`].
    #[inline(always)]
    fn add(&mut self, x: &[f64; LANES], z: f64, cell: u32, count: u32) {
        let position = self.count.min(ROOM - LANES);
        // All lanes are written; the next call overwrites those beyond `count`.
        self.x[position..][..LANES].copy_from_slice(x);
        self.z[position..][..LANES].fill(z);
        for (lane, out) in (0..).zip(&mut self.cells[position..][..LANES]) {
            *out = cell.wrapping_add(lane);
        }
        self.count = position + count.min(LANES as u32) as usize;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shallow::columns::grid::BOTTOMLESS;

    const GRID: Grid = Grid { cell: 0.5, origin: [-2.0, -2.0], size: [8, 8] };

    /// 0 to 1024 m: a unit is 2^-20 m.
    fn heights() -> Heights {
        Heights::between(0.0, 1024.0).unwrap()
    }

    fn units(metres: f64) -> i32 {
        heights().round(metres)
    }

    /// Boxes between corners.
    fn boxes(ends: &[[[f32; 3]; 2]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for ends in ends {
            let first = positions.len() as u32;
            positions.extend((0..8).map(|n| Vec3::from([0, 1, 2].map(|axis| ends[n >> axis & 1][axis]))));
            let of_face =
                |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]].map(|corners| corners.map(|n| first + n));
            triangles.extend(faces.into_iter().flat_map(of_face));
        }
        (positions, triangles)
    }

    fn at(solids: &Solids, cell: [usize; 2]) -> Vec<Solid> {
        solids.cell(GRID.index(cell)).to_vec()
    }

    #[test]
    fn sheets_that_face_up_have_no_bottom_and_others_are_nothing() {
        let (positions, triangles) = boxes(&[[[-9.0, 1.0, -9.0], [9.0, 2.0, 9.0]]]);
        // The box's upper and lower faces alone.
        let facing = |axis_up: bool| {
            let is_one = |triangle: &[u32; 3]| triangle.iter().all(|n| (n >> 1 & 1 == 1) == axis_up);
            let sheet: Vec<_> = triangles.iter().copied().filter(is_one).collect();
            assert_eq!(sheet.len(), 2);
            solids(&positions, &sheet, GRID, heights()).unwrap()
        };
        assert_eq!(at(&facing(true), [3, 4]), [[BOTTOMLESS, units(2.0)]]);
        assert_eq!(facing(false).layers(), 0);
    }

    #[test]
    fn solids_that_overlap_or_touch_unite_and_others_stay_apart() {
        let wide = |low: f32, high: f32| [[-1.0, low, -1.0], [1.0, high, 1.0]];
        let thin = 2f32.powi(-22);
        let (positions, triangles) = boxes(&[
            wide(1.0, 3.0),
            wide(2.0, 4.0),
            wide(4.0, 5.0),
            wide(6.0, 7.0),
            wide(7.0 + thin, 8.0),
            wide(9.0, 9.0 + thin),
            wide(10.0, 12.0),
            [[-9.0, 10.5, -9.0], [9.0, 11.0, 9.0]],
        ]);
        let found = solids(&positions, &triangles, GRID, heights()).unwrap();
        let expected = [[1.0, 5.0], [6.0, 8.0], [10.0, 12.0]].map(|solid| solid.map(units));
        for cell in [[2, 2], [3, 3], [5, 2], [4, 5]] {
            assert_eq!(at(&found, cell), expected, "{cell:?}");
        }
        assert_eq!(at(&found, [0, 3]), [[units(10.5), units(11.0)]]);
        assert_eq!(found.layers(), 3);
    }

    #[test]
    fn heights_beyond_the_range_are_its_ends() {
        let wide = |low: f32, high: f32| [[-9.0, low, -9.0], [9.0, high, 9.0]];
        let (positions, triangles) =
            boxes(&[wide(-5.0, -4.0), wide(-3.0, 1.0), wide(1000.0, 2000.0), wide(3000.0, 4000.0)]);
        let found = solids(&positions, &triangles, GRID, heights()).unwrap();
        assert_eq!(at(&found, [0, 0]), [[0, units(1.0)], [units(1000.0), units(1024.0)]]);
    }

    #[test]
    fn cells_on_a_face_belong_to_one_side() {
        // Its sides and diagonals pass through centres of cells.
        let (positions, triangles) = boxes(&[[[-0.75, 1.0, -0.75], [0.75, 2.0, 0.75]]]);
        let found = solids(&positions, &triangles, GRID, heights()).unwrap();
        for z in 0..8 {
            for x in 0..8 {
                let is_within = (2..5).contains(&x) && (2..5).contains(&z);
                assert_eq!(at(&found, [x, z]).len(), usize::from(is_within), "({x}, {z})");
            }
        }
    }

    #[test]
    fn a_box_of_cells_is_cast_like_the_whole_and_without_new_memory() {
        let (mut positions, triangles) = boxes(&[
            [[-1.3, 1.0, -1.7], [1.2, 2.0, 0.9]],
            [[-0.4, 0.5, -0.8], [1.9, 3.0, 1.6]],
            [[-9.0, 0.1, -9.0], [9.0, 0.2, 9.0]],
        ]);
        let mut caster = Caster::new(GRID, heights()).unwrap();
        caster.cast(&positions, &triangles, [0..8, 0..8]).unwrap();
        let memory = |caster: &Caster| {
            let Caster { ranks, crossings, starts, solids, .. } = caster;
            let sizes = [ranks.capacity(), starts.capacity(), solids.capacity()];
            (sizes, ranks.as_ptr(), crossings.memory(), starts.as_ptr(), solids.as_ptr())
        };
        let first = memory(&caster);
        for frame in 0..20u8 {
            positions.iter_mut().for_each(|p| p.x += 0.01 * f32::from(frame % 5));
            let whole = solids(&positions, &triangles, GRID, heights()).unwrap();
            let (start, end) = (usize::from(frame % 4), usize::from(4 + frame % 5));
            caster.cast(&positions, &triangles, [start..end, 1..end]).unwrap();
            assert_eq!(caster.starts().len(), (end - start) * (end - 1) + 1);
            for z in 1..end {
                for x in start..end {
                    assert_eq!(
                        caster.cell([x, z]),
                        whole.cell(GRID.index([x, z])),
                        "frame {frame}: ({x}, {z})"
                    );
                }
            }
            assert!(memory(&caster) == first, "frame {frame}");
        }
        caster.cast(&positions, &triangles, [3..3, 2..4]).unwrap();
        assert_eq!((caster.cells(), caster.solids().len()), ([3..3, 2..4], 0));
    }

    #[test]
    fn bad_input_is_a_sentence() {
        let (positions, triangles) = boxes(&[[[0.0; 3], [1.0; 3]]]);
        let message = |positions: &[Vec3], triangles: &[[u32; 3]]| {
            solids(positions, triangles, GRID, heights()).unwrap_err().to_string()
        };
        assert_eq!(message(&positions, &[]), "the terrain has no triangles");
        assert_eq!(
            message(&positions, &[[0, 1, 2], [0, 8, 1]]),
            "triangle 2 names a vertex beyond the 8 there are"
        );
        for wild in [f32::NAN, f32::INFINITY] {
            let mut positions = positions.clone();
            positions[2].y = wild;
            assert_eq!(message(&positions, &triangles), "vertex 3 is not finite");
        }
        let caster = |grid: Grid| Caster::new(grid, heights()).map(|_| ()).unwrap_err().to_string();
        assert_eq!(
            caster(Grid { cell: 1e-10, ..GRID }),
            "a cell of 0.0000000001 m is not within 1e-9 to 1e9 m"
        );
        assert_eq!(caster(Grid { origin: [0.0, 2e30], ..GRID }), "an origin at 2e30 m is beyond 1e30 m");
        assert!(
            caster(Grid { origin: [1e17, 0.0], ..GRID })
                .starts_with("a cell of 0.5 m is too fine for positions at ")
        );
        let mut caster = Caster::new(GRID, heights()).unwrap();
        let error = caster.cast(&positions, &triangles, [0..9, 0..8]).unwrap_err().to_string();
        assert_eq!(error, "cells 0..9 x 0..8 are not a box within 8 x 8 cells");
    }
}
