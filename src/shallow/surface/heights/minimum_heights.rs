//! Minimum heights: how far wet columns are lifted so that the terrain's mesh does not show through a thin film, and how far dry ones are
//! lowered so that the rim of the surface is hidden under it (thesis 4.2.4).
//!
//! The terrain's mesh is not aligned with the grid, so its bumps cut through a film that follows the bases of columns. For a vertex of the
//! mesh at height h_v, within a quartet whose columns have the bases b_k, the minimum heights l_k are those that
//!
//! minimise sum w_k l_k^2, subject to sum c_k (b_k + l_k) >= h_v + margin and l_k >= the global minimum (Eq. 4.37),
//!
//! where c_k are the barycentric coordinates of the vertex in a triangle of three columns, and w_k = dx / max(h_v - b_k, 1e-10 dx)
//! (Eq. 4.38). A quartet may be divided along either diagonal, so the triangles of both are constraints; a column takes the maximum over all
//! vertices. The thesis constrains the bilinear patch, which is not what is drawn, by an equation that would also lower surfaces.
//!
//! Lagrange multipliers give l_k = m c_k / w_k. Columns below the global minimum are set to it, and the others make up the rest.
//!
//! Where the weights give a minimum height of over dx, as a vertex close to a column at the top of a slope does for the columns at its
//! foot, equal weights are tried, and used if the largest minimum height that they give is smaller. A vertex that still needs a height of
//! more than dx above the highest base is discarded (thesis 4.2.4).
//!
//! A film links three columns if each one's room holds the bases of the others; a vertex belongs to the columns whose rooms hold it.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::geometry::Vec3;
use crate::numeric::lists::reset;
use crate::shallow::columns::grid::{Cells, check_cells};
use crate::shallow::columns::{Columns, STRIP, Strip};
use crate::shallow::surface::quartets::links::{LiquidColumns, find_above};

/// Cut-off of Eq. 4.38: minimum of h_v - b_k, in cells.
const MIN_RISE: f64 = 1e-10;

/// Distances between a thin film and the terrain's mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Global minimum: the minimum height of a wet vertex above its base (cells).
    pub least: f64,
    /// Minimum height of the surface above the terrain's vertices (cells).
    pub margin: f64,
    /// Minimum distance of the surface's rim below the terrain's vertices and below the bases of dry columns (cells); more than the margin,
    /// as the terrain may be lower between its vertices.
    pub rim: f64,
}

impl Default for Distance {
    fn default() -> Self {
        Self { least: 0.05, margin: 0.01, rim: 0.1 }
    }
}

/// Counts of the vertices that a call examined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Fitted {
    /// Vertices that face up, within a quartet.
    pub upward: usize,
    /// Of these, those that would need a height of over a cell above the highest base around: they may be above the surface.
    pub discarded: usize,
    /// Of the others, those too close to a ceiling for their minimum height.
    pub capped: usize,
}

/// Minimum depths at which columns are shown, and how far they are lowered where they are dry; reuses its memory.
#[derive(Debug, Default)]
pub struct MinimumHeights {
    least: Vec<i32>,
    sunk: Vec<i32>,
    /// The strips of these arrays.
    strips: Vec<Strip>,
    /// `least`, `sunk` and `strips` before the last change: scratch.
    old: (Vec<i32>, Vec<i32>, Vec<Strip>),
    above: Vec<u32>,
    /// Uncovered vertices of the last call.
    uncovered: Vec<u32>,
    /// For each vertex of the mesh, twice the signed area, seen from above, of the triangles around it: negative where they face down.
    facing: Vec<f64>,
}

/// A triangle of columns that a film links, over or under a vertex of the terrain.
struct FilmTriangle {
    /// The one at the right angle first.
    columns: [usize; 3],
    /// Barycentric coordinates of the vertex.
    barycentric: [f64; 3],
    /// Bases minus the height of the vertex (units).
    rises: [f64; 3],
    /// Minimum heights (units).
    min_heights: [f64; 3],
}

/// The cells whose columns are recomputed, and lengths in units.
struct Area<'a> {
    liquid: LiquidColumns<'a>,
    cells: Cells,
    cell: f64,
    least: f64,
    margin: f64,
    rim: f64,
}

impl MinimumHeights {
    /// Reserves memory for this many strips and vertices: [`MinimumHeights::update`] then allocates nothing as long as there are no more.
    pub fn reserve(&mut self, strips: usize, vertices: usize) {
        let Self { least, sunk, strips: own, old, above, uncovered, facing } = self;
        for numbers in [least, sunk, &mut old.0, &mut old.1] {
            numbers.reserve((strips * STRIP).saturating_sub(numbers.len()));
        }
        for list in [own, &mut old.2] {
            list.reserve(strips.saturating_sub(list.len()));
        }
        above.reserve(strips.saturating_sub(above.len()));
        uncovered.reserve(vertices.saturating_sub(uncovered.len()));
        facing.reserve(vertices.saturating_sub(facing.len()));
    }

    /// Minimum depth of each index (units) for [`Depths::least`](crate::shallow::surface::Depths::least), at most from base to ceiling; 0
    /// without a column.
    pub fn least(&self) -> &[i32] {
        &self.least
    }

    /// How far below its base each index is shown where it is dry (units), for [`Depths::sunk`](crate::shallow::surface::Depths::sunk); 0
    /// without a column.
    pub fn sunk(&self) -> &[i32] {
        &self.sunk
    }

    /// Vertices that may still be above the surface, of those that the last call examined: discarded, or under a low ceiling; in order.
    pub fn uncovered(&self) -> &[u32] {
        &self.uncovered
    }

    /// Finds the minimum heights of all columns from the terrain's mesh: positions (m), and triangles that are counter-clockwise seen from
    /// outside.
    ///
    /// # Errors
    /// `Argument`: a vertex that is not finite, an index beyond the vertices, a distance that is negative or not finite. The minimum
    /// heights are then invalid until they are found again.
    pub fn find(
        &mut self,
        columns: &Columns,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        distance: Distance,
    ) -> Result<Fitted> {
        let [nx, nz] = columns.grid.size;
        self.update(columns, positions, triangles, distance, [0..nx, 0..nz])
    }

    /// Recomputes the minimum heights near a box of cells (ranges of x and of z); the result is as if all were recomputed. Changed columns,
    /// and the old and new positions of changed triangles, must lie in the box; the indices of other columns may have changed.
    ///
    /// # Errors
    /// As [`MinimumHeights::find`]; also a box that is not within the grid.
    pub fn update(
        &mut self,
        columns: &Columns,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        distance: Distance,
        cells: Cells,
    ) -> Result<Fitted> {
        let size = columns.grid.size;
        let Distance { least, margin, rim } = distance;
        if let Some(bad) =
            [least, margin, rim].into_iter().find(|length| !(*length >= 0.0 && length.is_finite()))
        {
            return Err(Error::argument(format!("a distance of {bad} cells is negative or not finite")));
        }
        check_cells(&cells, size)?;
        // Quartets with a cell of the box extend one cell further.
        let cells = [0, 1].map(|axis| {
            let Range { start, end } = cells[axis];
            if start == end { start..end } else { start.saturating_sub(1)..(end + 1).min(size[axis]) }
        });
        self.reindex(columns);
        let cell = columns.grid.cell / columns.heights.unit;
        find_above(columns, &mut self.above);
        let liquid = LiquidColumns { columns, depth: &[], above: &self.above };
        let area = Area { liquid, cells, cell, least: least * cell, margin: margin * cell, rim: rim * cell };
        area.find_facing(positions, triangles, &mut self.facing)?;
        area.clear(&mut self.least, &mut self.sunk);
        self.uncovered.clear();
        let mut out = Fitted::default();
        for (vertex, at) in positions.iter().enumerate().filter(|(vertex, _)| self.facing[*vertex] > 0.0) {
            let before = out;
            area.fit(at, [&mut self.least, &mut self.sunk], &mut out);
            if out.discarded + out.capped > before.discarded + before.capped {
                self.uncovered.push(vertex as u32);
            }
        }
        Ok(out)
    }

    /// Moves the known values to the current indices of the same columns.
    fn reindex(&mut self, columns: &Columns) {
        let now = columns.strips();
        if self.strips == now {
            return;
        }
        let Self { least, sunk, strips, old, .. } = self;
        std::mem::swap(least, &mut old.0);
        std::mem::swap(sunk, &mut old.1);
        std::mem::swap(strips, &mut old.2);
        now.clone_into(strips);
        let mut before = 0;
        for numbers in [&mut *least, &mut *sunk] {
            reset(numbers, columns.len(), 0);
        }
        for (strip, position) in now.iter().enumerate() {
            before += old.2[before..].iter().take_while(|other| *other < position).count();
            if old.2.get(before) == Some(position) {
                let (to, from) = (strip * STRIP..(strip + 1) * STRIP, before * STRIP..(before + 1) * STRIP);
                least[to.clone()].copy_from_slice(&old.0[from.clone()]);
                sunk[to].copy_from_slice(&old.1[from]);
            }
        }
    }
}

impl Area<'_> {
    /// Finds the area (`facing`) of the triangles around each vertex in the quartets of these cells, and around some others.
    fn find_facing(&self, positions: &[Vec3], triangles: &[[u32; 3]], facing: &mut Vec<f64>) -> Result<()> {
        if let Some(bad) = positions.iter().position(|p| !p.iter().all(|length| length.is_finite())) {
            return Err(Error::argument(format!("vertex {bad} of the terrain is not finite")));
        }
        reset(facing, positions.len(), 0.0);
        let grid = self.liquid.columns.grid;
        let [x, z] = [0, 1].map(|axis| {
            let Range { start, end } = self.cells[axis];
            let at = |cell: f64| grid.origin[axis] + cell * grid.cell;
            at(start as f64 - 1.0)..=at(end as f64 + 1.0)
        });
        let is_near = |at: &Vec3| x.contains(&f64::from(at.x)) && z.contains(&f64::from(at.z));
        for (index, corners) in triangles.iter().enumerate() {
            let corners = corners.map(|corner| corner as usize);
            let [Some(a), Some(b), Some(c)] = corners.map(|corner| positions.get(corner)) else {
                let count = positions.len();
                return Err(Error::argument(format!(
                    "triangle {index} of the terrain has a corner beyond its {count} vertices"
                )));
            };
            if !(is_near(a) || is_near(b) || is_near(c)) {
                continue;
            }
            let [a, b, c] = [a, b, c].map(|at| [f64::from(at.x), f64::from(at.z)]);
            let ([bx, bz], [cx, cz]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
            let area = bz * cx - bx * cz;
            corners.into_iter().for_each(|corner| facing[corner] += area);
        }
        Ok(())
    }

    /// Resets the columns of the box to their values without any vertex.
    fn clear(&self, least: &mut [i32], sunk: &mut [i32]) {
        let columns = self.liquid.columns;
        let [across, rows] = &self.cells;
        for row in rows.clone() {
            for strip in columns.row(row) {
                let first = columns.strips()[strip].at as usize * STRIP;
                for position in (0..STRIP).filter(|position| across.contains(&(first + position))) {
                    let index = strip * STRIP + position;
                    let is_column = columns.is_column(index);
                    least[index] = if is_column { self.limited_height(index, self.least) } else { 0 };
                    sunk[index] = if is_column { self.limited_sink(index, self.rim) } else { 0 };
                }
            }
        }
    }

    /// A minimum height of a column in whole units, up to its ceiling.
    fn limited_height(&self, index: usize, min_height: f64) -> i32 {
        (min_height.ceil() as i32)
            .min(self.liquid.columns.ceilings()[index] - self.liquid.columns.bases()[index])
    }

    /// How far a dry column is lowered, in whole units, within its solid.
    fn limited_sink(&self, index: usize, sink: f64) -> i32 {
        (sink.ceil() as i32).min(
            self.liquid.columns.bases()[index].saturating_sub(self.liquid.columns.unders()[index]).max(1) - 1,
        )
    }

    /// Raises and lowers columns for a vertex that faces up.
    fn fit(&self, at: &Vec3, numbers: [&mut [i32]; 2], out: &mut Fitted) {
        let (grid, heights) = (self.liquid.columns.grid, self.liquid.columns.heights);
        let position = [f64::from(at.x), f64::from(at.z)];
        let position = [0, 1].map(|axis| (position[axis] - grid.origin[axis]) / grid.cell - 0.5);
        let [across, along] = [0, 1].map(|axis| self.quartets(axis, position[axis]));
        if across.is_empty() || along.is_empty() {
            return;
        }
        let height = (f64::from(at.y) - heights.low) / heights.unit;
        // A vertex on a line between quartets is in both.
        let mut triangles = [const { None::<FilmTriangle> }; 16];
        let quartets = along.flat_map(|z| across.clone().map(move |x| [x, z]));
        let found = quartets.flat_map(|[x, z]| {
            self.triangles([x, z], [position[0] - x as f64, position[1] - z as f64], height)
        });
        triangles.iter_mut().zip(found).for_each(|(out, triangle)| *out = Some(triangle));
        self.fit_triangles(triangles.iter().flatten(), numbers, out);
    }

    /// The quartets along an axis that contain a cell of the box and a position (cells, from the centre of the first cell).
    fn quartets(&self, axis: usize, position: f64) -> Range<usize> {
        let last = self.liquid.columns.grid.size[axis] - 1;
        let cells = &self.cells[axis];
        let range = cells.start.saturating_sub(1)..cells.end.min(last);
        if cells.is_empty()
            || range.is_empty()
            || !(position >= range.start as f64 && position <= range.end as f64)
        {
            return 0..0;
        }
        let first = position.floor() as usize;
        let is_between = position == first as f64;
        let start = if is_between { first.saturating_sub(1) } else { first };
        start.max(range.start)..(first + 1).min(range.end)
    }

    /// The film triangles in a quartet that contain a position: at most one for each diagonal, or two if it lies on the diagonal.
    fn triangles(
        &self,
        [x, z]: [usize; 2],
        [u, w]: [f64; 2],
        height: f64,
    ) -> impl Iterator<Item = FilmTriangle> {
        let liquid = self.liquid;
        let (bases, unders, ceilings) =
            (liquid.columns.bases(), liquid.columns.unders(), liquid.columns.ceilings());
        let four: [Option<usize>; 4] = std::array::from_fn(|corner| {
            let mut columns = liquid.of_cell([x + (corner & 1), z + (corner >> 1)]);
            columns.find(|&index| f64::from(unders[index]) <= height && height < f64::from(ceilings[index]))
        });
        (0..4).filter_map(move |corner| {
            let p = if corner & 1 == 0 { u } else { 1.0 - u };
            let q = if corner >> 1 == 0 { w } else { 1.0 - w };
            if p + q > 1.0 {
                return None;
            }
            let columns = [four[corner]?, four[corner ^ 1]?, four[corner ^ 2]?];
            let is_linked = columns.iter().all(|&own| {
                columns.iter().all(|&other| (unders[own]..ceilings[own]).contains(&bases[other]))
            });
            let rises = columns.map(|column| f64::from(bases[column]) - height);
            let triangle = FilmTriangle {
                columns,
                barycentric: [1.0 - (p + q), p, q],
                rises,
                min_heights: [self.least; 3],
            };
            is_linked.then(|| FilmTriangle { min_heights: self.min_heights(&triangle), ..triangle })
        })
    }

    /// Raises and lowers the columns of all triangles that contain a vertex.
    fn fit_triangles<'t>(
        &self,
        triangles: impl Iterator<Item = &'t FilmTriangle> + Clone,
        [least, sunk]: [&mut [i32]; 2],
        out: &mut Fitted,
    ) {
        out.upward += 1;
        let highest = triangles.clone().flat_map(|triangle| triangle.rises).fold(f64::NEG_INFINITY, f64::max);
        let is_high = |triangle: &FilmTriangle| {
            let is_lifted = |k: usize| triangle.barycentric[k] > 0.0 && triangle.min_heights[k] > self.least;
            (0..3).any(|k| is_lifted(k) && triangle.rises[k] + triangle.min_heights[k] > highest + self.cell)
        };
        if triangles.clone().any(is_high) {
            out.discarded += 1;
        } else {
            let mut is_capped = false;
            for triangle in triangles.clone() {
                let min_heights = triangle.min_heights;
                let lifted = [0, 1, 2].map(|k| self.limited_height(triangle.columns[k], min_heights[k]));
                for (&column, lifted) in triangle.columns.iter().zip(lifted) {
                    if self.has(column) {
                        least[column] = least[column].max(lifted);
                    }
                }
                let heights = [0, 1, 2].map(|k| triangle.rises[k] + f64::from(lifted[k]));
                is_capped |= (0..3).any(|k| f64::from(lifted[k]) < min_heights[k])
                    && triangle.mean(heights) < self.margin;
            }
            out.capped += usize::from(is_capped);
        }
        for triangle in triangles {
            for (&column, sink) in triangle.columns.iter().zip(self.sinks(triangle).unwrap_or_default()) {
                if self.has(column) {
                    sunk[column] = sunk[column].max(self.limited_sink(column, sink));
                }
            }
        }
    }

    fn has(&self, column: usize) -> bool {
        let [x, z] = self.liquid.columns.cell(column);
        self.cells[0].contains(&x) && self.cells[1].contains(&z)
    }

    /// Minimum heights (units) of three columns for a vertex; the global minimum if it is covered anyway.
    fn min_heights(&self, triangle: &FilmTriangle) -> [f64; 3] {
        let need = self.margin - triangle.mean(triangle.rises);
        if need <= self.least {
            return [self.least; 3];
        }
        let thesis = triangle.rises.map(|rise| (-rise).max(MIN_RISE * self.cell));
        let min_heights = triangle.least_squares(need, self.least, thesis);
        let max = |numbers: [f64; 3]| numbers.into_iter().fold(0.0, f64::max);
        if max(min_heights) <= self.cell {
            return min_heights;
        }
        let equal = triangle.least_squares(need, self.least, [1.0; 3]);
        if max(equal) < max(min_heights) { equal } else { min_heights }
    }

    /// How far (units) three dry columns are lowered so that the terrain at a vertex hides the rim between them. A vertex more than a cell
    /// lower, at the foot of a cliff, hides nothing.
    fn sinks(&self, triangle: &FilmTriangle) -> Option<[f64; 3]> {
        let need = self.rim + triangle.mean(triangle.rises);
        (need > self.rim && need <= self.cell + self.rim)
            .then(|| triangle.least_squares(need, self.rim, [1.0; 3]))
    }
}

impl FilmTriangle {
    /// The mean of three numbers at the vertex, summed in an order that rotates and mirrors with the scene.
    fn mean(&self, of: [f64; 3]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| self.barycentric[k] * of[k]);
        a + (b + c)
    }

    /// Numbers whose mean at the vertex is `need`, none of them below `min` (itself below `need`), with the minimum sum of their squares
    /// divided by `ease`.
    fn least_squares(&self, need: f64, min: f64, ease: [f64; 3]) -> [f64; 3] {
        let mut out = [min; 3];
        let mut is_free = self.barycentric.map(|part| part > 0.0);
        loop {
            let of_free = |numbers: [f64; 3]| {
                let barycentric = self.barycentric;
                self.mean(
                    [0, 1, 2].map(|k| if is_free[k] && barycentric[k] > 0.0 { numbers[k] } else { 0.0 }),
                )
            };
            let pulls = [0, 1, 2].map(|k| self.barycentric[k] * ease[k]);
            let fixed = self.mean(is_free.map(|is_free| if is_free { 0.0 } else { min }));
            let pull = (need - fixed) / of_free(pulls);
            let mut is_done = true;
            for k in (0..3).filter(|&k| is_free[k]) {
                out[k] = pull * pulls[k];
            }
            for k in 0..3 {
                if is_free[k] && out[k] < min {
                    (out[k], is_free[k], is_done) = (min, false, false);
                }
            }
            if is_done {
                return out;
            }
        }
    }
}
