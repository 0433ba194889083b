//! Minimum heights: how far wet columns are lifted so that the terrain's mesh does not show through a thin film, and how far dry ones are
//! lowered so that the rim of the surface is hidden under it (thesis 4.2.4).
//!
//! The terrain's mesh is not aligned with the grid, and a film that follows the bases of columns cuts its bumps. For a vertex of the mesh at the
//! height h_v, within a quartet whose columns have the bases b_k, the least lifts l_k are those for which
//!
//! sum w_k l_k^2 is least, sum c_k (b_k + l_k) >= h_v + margin, and l_k >= the global least (Eq. 4.37),
//!
//! where c_k are barycentric coordinates of the vertex in a triangle of three columns, and w_k = dx / max(h_v - b_k, 1e-10 dx) (Eq. 4.38). A
//! quartet may be divided along either diagonal, so the triangles of both constrain; the lift of a column is the most of all vertices. The
//! thesis constrains the bilinear patch, which is neither, by an equation that would lower surfaces too.
//!
//! Lagrange's solution is l_k = m c_k / w_k; columns for which that is under the global least have it, and leave the rest to the others.
//!
//! Where the weights make a lift of over dx, which a vertex close to a column at the top of a slope does to those at its foot, equal weights
//! are tried, and taken if their greatest lift is the smaller one. A vertex that needs a height of more than dx above the highest base is
//! discarded even so (thesis 4.2.4).
//!
//! A film links three columns if each one's room holds the bases of the others; the vertex belongs to the columns whose rooms hold it.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::geometry::Vec3;
use crate::shallow::columns::{Columns, STRIP, Strip};
use crate::shallow::surface::quartets::links::{Scene, find_above};

/// Where Eq. 4.38 is cut off: the least h_v - b_k, in cells.
const LEAST_RISE: f64 = 1e-10;

/// What a thin film keeps from the terrain's mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Global least: how far a wet vertex is above its base (cells).
    pub least: f64,
    /// How far the surface is above the terrain's vertices (cells).
    pub margin: f64,
    /// How far its rim is below them, and at least below the bases of dry columns (cells); more than the margin, as between its vertices the
    /// terrain may be lower.
    pub rim: f64,
}

impl Default for Distance {
    fn default() -> Self {
        Self { least: 0.05, margin: 0.01, rim: 0.1 }
    }
}

/// What became of the vertices that a call looked at: those that face up, within a quartet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Fitted {
    /// Count of them.
    pub upward: usize,
    /// Of these, those that would need a height of over a cell above the highest base around: they may be above the surface.
    pub discarded: usize,
    /// Of the others, those that lie too close to a ceiling for their lift.
    pub capped: usize,
}

/// Least depths at which columns are shown, and how far they are lowered where they are dry; keeps its memory.
#[derive(Debug, Default)]
pub struct Lifts {
    least: Vec<i32>,
    sunk: Vec<i32>,
    /// The strips that these are of, and all of them before the last change.
    strips: Vec<Strip>,
    old: (Vec<i32>, Vec<i32>, Vec<Strip>),
    above: Vec<u32>,
    /// Vertices of the last call that were given up.
    bare: Vec<u32>,
    /// Of each vertex of the mesh, the area above of the triangles around: negative where they face down.
    facing: Vec<f64>,
}

/// Three columns that film links, the one at the right angle first: coordinates of a vertex, bases less the height of the vertex (units).
struct Triple {
    columns: [usize; 3],
    parts: [f64; 3],
    rises: [f64; 3],
    /// Least lifts (units).
    lifts: [f64; 3],
}

/// The cells whose columns are found anew, and lengths in units.
struct Area<'a> {
    scene: Scene<'a>,
    cells: [Range<usize>; 2],
    cell: f64,
    least: f64,
    margin: f64,
    rim: f64,
}

impl Lifts {
    /// Makes room for so many strips and vertices: [`Lifts::update`] then allocates nothing as long as there are no more.
    pub fn reserve(&mut self, strips: usize, vertices: usize) {
        let Self { least, sunk, strips: own, old, above, bare, facing } = self;
        for numbers in [least, sunk, &mut old.0, &mut old.1] {
            numbers.reserve((strips * STRIP).saturating_sub(numbers.len()));
        }
        for list in [own, &mut old.2] {
            list.reserve(strips.saturating_sub(list.len()));
        }
        above.reserve(strips.saturating_sub(above.len()));
        bare.reserve(vertices.saturating_sub(bare.len()));
        facing.reserve(vertices.saturating_sub(facing.len()));
    }

    /// Least depth of each index (units) for [`Depths::least`](crate::shallow::surface::Depths::least), at most from base to ceiling; 0 without a column.
    pub fn least(&self) -> &[i32] {
        &self.least
    }

    /// How far below its base each index is shown where it is dry (units), for [`Depths::sunk`](crate::shallow::surface::Depths::sunk); 0 without a column.
    pub fn sunk(&self) -> &[i32] {
        &self.sunk
    }

    /// Vertices that may be above the surface after all, of those that the last call looked at: discarded, or under a low ceiling; in order.
    pub fn bare(&self) -> &[u32] {
        &self.bare
    }

    /// Finds those of all columns, from the terrain's mesh: positions (m), and triangles that are counter-clockwise seen from outside.
    ///
    /// # Errors
    /// `Argument`: a vertex that is not finite, an index beyond the vertices, a distance that is negative or not finite. The lifts are then
    /// of no use until they are found again.
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

    /// Finds those near a box of cells (ranges of x and of z) anew, which are then as if all were found anew. Columns have changed, and
    /// triangles lay or lie, in the box only; the others may have other indices.
    ///
    /// # Errors
    /// As [`Lifts::find`]; also a box that is not within the grid.
    pub fn update(
        &mut self,
        columns: &Columns,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        distance: Distance,
        cells: [Range<usize>; 2],
    ) -> Result<Fitted> {
        let size = columns.grid.size;
        let Distance { least, margin, rim } = distance;
        if let Some(bad) =
            [least, margin, rim].into_iter().find(|length| !(*length >= 0.0 && length.is_finite()))
        {
            return Err(Error::argument(format!("a distance of {bad} cells is not finite and 0 or more")));
        }
        if [0, 1].into_iter().any(|axis| cells[axis].start > cells[axis].end || cells[axis].end > size[axis])
        {
            let ([x, z], [nx, nz]) = (cells, size);
            return Err(Error::argument(format!(
                "cells {x:?} x {z:?} are not a box within {nx} x {nz} cells"
            )));
        }
        // Quartets with a cell of the box reach one further.
        let cells = [0, 1].map(|axis| {
            let Range { start, end } = cells[axis];
            if start == end { start..end } else { start.saturating_sub(1)..(end + 1).min(size[axis]) }
        });
        self.follow(columns);
        let cell = columns.grid.cell / columns.heights.unit;
        find_above(columns, &mut self.above);
        let scene = Scene { columns, depth: &[], above: &self.above };
        let area = Area { scene, cells, cell, least: least * cell, margin: margin * cell, rim: rim * cell };
        area.face(positions, triangles, &mut self.facing)?;
        area.clear(&mut self.least, &mut self.sunk);
        self.bare.clear();
        let mut out = Fitted::default();
        for (vertex, at) in positions.iter().enumerate().filter(|(vertex, _)| self.facing[*vertex] > 0.0) {
            let before = out;
            area.fit(at, [&mut self.least, &mut self.sunk], &mut out);
            if out.discarded + out.capped > before.discarded + before.capped {
                self.bare.push(vertex as u32);
            }
        }
        Ok(out)
    }

    /// Moves what is known to the indices of the same columns now.
    fn follow(&mut self, columns: &Columns) {
        let now = columns.strips();
        if self.strips == now {
            return;
        }
        let Self { least, sunk, strips, old, .. } = self;
        std::mem::swap(least, &mut old.0);
        std::mem::swap(sunk, &mut old.1);
        std::mem::swap(strips, &mut old.2);
        strips.clear();
        strips.extend_from_slice(now);
        let mut before = 0;
        for numbers in [&mut *least, &mut *sunk] {
            numbers.clear();
            numbers.resize(columns.len(), 0);
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
    /// Finds twice the areas, seen from above, of the triangles around each vertex in the quartets of these cells, and around some others.
    fn face(&self, positions: &[Vec3], triangles: &[[u32; 3]], facing: &mut Vec<f64>) -> Result<()> {
        if let Some(bad) = positions.iter().position(|p| !p.iter().all(|length| length.is_finite())) {
            return Err(Error::argument(format!("vertex {bad} of the terrain is not finite")));
        }
        facing.clear();
        facing.resize(positions.len(), 0.0);
        let grid = self.scene.columns.grid;
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

    /// Gives the columns of the box what they have without a vertex above.
    fn clear(&self, least: &mut [i32], sunk: &mut [i32]) {
        let columns = self.scene.columns;
        let [across, rows] = &self.cells;
        for row in rows.clone() {
            for strip in columns.row(row) {
                let first = columns.strips()[strip].at as usize * STRIP;
                for position in (0..STRIP).filter(|position| across.contains(&(first + position))) {
                    let index = strip * STRIP + position;
                    let is_column = columns.is_column(index);
                    least[index] = if is_column { self.lift(index, self.least) } else { 0 };
                    sunk[index] = if is_column { self.sink(index, self.rim) } else { 0 };
                }
            }
        }
    }

    /// A lift of a column in whole units, within its room.
    fn lift(&self, index: usize, lift: f64) -> i32 {
        (lift.ceil() as i32).min(self.scene.columns.ceilings()[index] - self.scene.columns.bases()[index])
    }

    /// A way down from a column's base in whole units, within its solid.
    fn sink(&self, index: usize, sink: f64) -> i32 {
        (sink.ceil() as i32).min(
            self.scene.columns.bases()[index].saturating_sub(self.scene.columns.unders()[index]).max(1) - 1,
        )
    }

    /// Lifts and sinks columns for a vertex that faces up.
    fn fit(&self, at: &Vec3, numbers: [&mut [i32]; 2], out: &mut Fitted) {
        let (grid, heights) = (self.scene.columns.grid, self.scene.columns.heights);
        let position = [f64::from(at.x), f64::from(at.z)];
        let position = [0, 1].map(|axis| (position[axis] - grid.origin[axis]) / grid.cell - 0.5);
        let [across, along] = [0, 1].map(|axis| self.quartets(axis, position[axis]));
        if across.is_empty() || along.is_empty() {
            return;
        }
        let height = (f64::from(at.y) - heights.low) / heights.unit;
        // A vertex on a line between quartets is in both.
        let mut triples = [const { None::<Triple> }; 16];
        let quartets = along.flat_map(|z| across.clone().map(move |x| [x, z]));
        let found = quartets.flat_map(|[x, z]| {
            self.triples([x, z], [position[0] - x as f64, position[1] - z as f64], height)
        });
        triples.iter_mut().zip(found).for_each(|(out, triple)| *out = Some(triple));
        self.fit_triples(triples.iter().flatten(), numbers, out);
    }

    /// The quartets along an axis that have a cell of the box and a position: cells from the centre of the first.
    fn quartets(&self, axis: usize, position: f64) -> Range<usize> {
        let last = self.scene.columns.grid.size[axis] - 1;
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

    /// The triangles of film in a quartet that a position within is in: at most one along each diagonal, or both on a diagonal itself.
    fn triples(&self, [x, z]: [usize; 2], [u, w]: [f64; 2], height: f64) -> impl Iterator<Item = Triple> {
        let scene = self.scene;
        let (bases, unders, ceilings) =
            (scene.columns.bases(), scene.columns.unders(), scene.columns.ceilings());
        let four: [Option<usize>; 4] = std::array::from_fn(|corner| {
            let mut columns = scene.of_cell([x + (corner & 1), z + (corner >> 1)]);
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
            let triple = Triple { columns, parts: [1.0 - (p + q), p, q], rises, lifts: [self.least; 3] };
            is_linked.then(|| Triple { lifts: self.lifts(&triple), ..triple })
        })
    }

    /// Lifts and sinks the columns of all triangles that a vertex is in.
    fn fit_triples<'t>(
        &self,
        triples: impl Iterator<Item = &'t Triple> + Clone,
        [least, sunk]: [&mut [i32]; 2],
        out: &mut Fitted,
    ) {
        out.upward += 1;
        let highest = triples.clone().flat_map(|triple| triple.rises).fold(f64::NEG_INFINITY, f64::max);
        let is_high = |triple: &Triple| {
            let is_lifted = |k: usize| triple.parts[k] > 0.0 && triple.lifts[k] > self.least;
            (0..3).any(|k| is_lifted(k) && triple.rises[k] + triple.lifts[k] > highest + self.cell)
        };
        if triples.clone().any(is_high) {
            out.discarded += 1;
        } else {
            let mut is_capped = false;
            for triple in triples.clone() {
                let lifts = triple.lifts;
                let lifted = [0, 1, 2].map(|k| self.lift(triple.columns[k], lifts[k]));
                for (&column, lifted) in triple.columns.iter().zip(lifted) {
                    if self.has(column) {
                        least[column] = least[column].max(lifted);
                    }
                }
                let heights = [0, 1, 2].map(|k| triple.rises[k] + f64::from(lifted[k]));
                is_capped |=
                    (0..3).any(|k| f64::from(lifted[k]) < lifts[k]) && triple.mean(heights) < self.margin;
            }
            out.capped += usize::from(is_capped);
        }
        for triple in triples {
            for (&column, sink) in triple.columns.iter().zip(self.sinks(triple).unwrap_or_default()) {
                if self.has(column) {
                    sunk[column] = sunk[column].max(self.sink(column, sink));
                }
            }
        }
    }

    fn has(&self, column: usize) -> bool {
        let [x, z] = self.scene.columns.cell(column);
        self.cells[0].contains(&x) && self.cells[1].contains(&z)
    }

    /// Lifts (units) of three columns for a vertex; the least if it is covered anyway.
    fn lifts(&self, triple: &Triple) -> [f64; 3] {
        let need = self.margin - triple.mean(triple.rises);
        if need <= self.least {
            return [self.least; 3];
        }
        let thesis = triple.rises.map(|rise| (-rise).max(LEAST_RISE * self.cell));
        let lifts = triple.least_squares(need, self.least, thesis);
        let most = |lifts: [f64; 3]| lifts.into_iter().fold(0.0, f64::max);
        if most(lifts) <= self.cell {
            return lifts;
        }
        let equal = triple.least_squares(need, self.least, [1.0; 3]);
        if most(equal) < most(lifts) { equal } else { lifts }
    }

    /// How far (units) three dry columns go down so that a vertex hides what is between them. One over a cell lower, at the foot of a
    /// cliff, does not.
    fn sinks(&self, triple: &Triple) -> Option<[f64; 3]> {
        let need = self.rim + triple.mean(triple.rises);
        (need > self.rim && need <= self.cell + self.rim)
            .then(|| triple.least_squares(need, self.rim, [1.0; 3]))
    }
}

impl Triple {
    /// The mean of three numbers at the vertex, in an order that turns and mirrors with the scene.
    fn mean(&self, of: [f64; 3]) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| self.parts[k] * of[k]);
        a + (b + c)
    }

    /// The numbers of which the mean at the vertex is `need`, none is under `least`, which is less, and the sum of squares / `ease` is the
    /// least.
    fn least_squares(&self, need: f64, least: f64, ease: [f64; 3]) -> [f64; 3] {
        let mut out = [least; 3];
        let mut is_free = self.parts.map(|part| part > 0.0);
        loop {
            let of_free = |numbers: [f64; 3]| {
                let parts = self.parts;
                self.mean([0, 1, 2].map(|k| if is_free[k] && parts[k] > 0.0 { numbers[k] } else { 0.0 }))
            };
            let pulls = [0, 1, 2].map(|k| self.parts[k] * ease[k]);
            let fixed = self.mean(is_free.map(|is_free| if is_free { 0.0 } else { least }));
            let pull = (need - fixed) / of_free(pulls);
            let mut is_done = true;
            for k in (0..3).filter(|&k| is_free[k]) {
                out[k] = pull * pulls[k];
            }
            for k in 0..3 {
                if is_free[k] && out[k] < least {
                    (out[k], is_free[k], is_done) = (least, false, false);
                }
            }
            if is_done {
                return out;
            }
        }
    }
}
