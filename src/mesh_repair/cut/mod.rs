//! The mesh outside of a set of cells, cut along the outer faces of the set.
//!
//! A triangle that passes through an outer face is replaced by its part outside: polygons whose corners are its own corners, the points
//! where its edges pass through outer faces, and those where it passes through outer edges of the grid. The rebuilt surface begins at the
//! same points, in the opposite direction ([`super::fill`]).

pub(in crate::mesh_repair) mod draft;
pub(in crate::mesh_repair) mod exact;
pub(in crate::mesh_repair) mod pierces;
mod polygon;

use rayon::prelude::*;

use exact::{GridFace, Point, Trace, cells_beside, on_edge, to_cells, trace};
use pierces::Pierces;

use super::region::CellSet;
use crate::distance::lattice::Fixed;
use crate::geometry::coords::between;
use crate::geometry::{Coord, DVec3};

/// Triangles per task.
const GRAIN: usize = 1024;
/// Maximum cells of a triangle's bounding box that are checked one by one before the triangle is traced.
const MAX_BOX: i64 = 64;

/// A closed mesh on the lattice.
pub struct Shape {
    /// Positions of the vertices.
    pub fixed: Vec<Fixed>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    pub pierces: Pierces,
}

/// The part of the mesh outside a set of cells.
#[derive(Default)]
pub struct Cut {
    /// Indices of the triangles that are entirely outside.
    pub whole: Vec<u32>,
    /// Parts of other triangles, each with the triangle's index.
    pub parts: Vec<(u32, [Point; 3])>,
    /// The cut along outer faces, in the direction of the surface inside; ascending by face.
    pub rim: Vec<(GridFace, [Point; 2])>,
}

/// Cells by which the set has to grow before the mesh can be cut.
#[derive(Debug)]
pub struct Trouble(pub Vec<Coord>);

impl Shape {
    /// The position of a point that lies on the mesh (cells).
    pub fn position(&self, point: Point) -> Option<DVec3> {
        match point {
            Point::Vertex(vertex) => Some(to_cells(self.fixed[vertex as usize])),
            Point::OnEdge(ends, axis, plane) => {
                Some(on_edge(ends.map(|end| self.fixed[end as usize]), axis, plane))
            }
            Point::OnTriangle(triangle, (axis, node)) => {
                let pierce =
                    self.pierces.on((axis, node)).iter().find(|pierce| pierce.triangle == triangle)?;
                let mut position = DVec3::from(node.map(f64::from));
                position[axis] += pierce.share;
                Some(position)
            }
            Point::OnGrid(_) | Point::Middle(..) => None,
        }
    }

    fn corners(&self, triangle: u32) -> [Fixed; 3] {
        self.triangles[triangle as usize].map(|vertex| self.fixed[vertex as usize])
    }

    fn traced(&self, triangle: u32) -> Option<Trace> {
        let vertices = self.triangles[triangle as usize];
        trace(triangle, vertices, self.corners(triangle), self.pierces.of_triangle(triangle))
    }

    /// The cells that a triangle passes through, ascending; those of its box if it cannot be traced.
    pub fn cells_of(&self, triangle: u32) -> Vec<Coord> {
        let mut cells = match self.traced(triangle) {
            Some(traced) => cells(&traced),
            None => {
                let (low, high) = bounds(self.corners(triangle));
                between(low, high).collect()
            }
        };
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Cuts the mesh along the outer faces of a set of cells.
    ///
    /// # Errors
    /// [`Trouble`] if a triangle cannot be cut.
    pub fn cut(&self, set: &CellSet) -> Result<Cut, Trouble> {
        let numbers: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let parts: Vec<Result<Cut, Trouble>> = numbers
            .par_chunks(GRAIN)
            .map(|numbers| {
                let mut cut = Cut::default();
                let mut trouble = Vec::new();
                for triangle in numbers {
                    if self.cut_one(*triangle, set, &mut cut).is_none() {
                        trouble.extend(self.cells_of(*triangle));
                    }
                }
                if trouble.is_empty() { Ok(cut) } else { Err(Trouble(trouble)) }
            })
            .collect();
        let (mut all, mut trouble) = (Cut::default(), Vec::new());
        for part in parts {
            match part {
                Ok(cut) => {
                    all.whole.extend(cut.whole);
                    all.parts.extend(cut.parts);
                    all.rim.extend(cut.rim);
                }
                Err(Trouble(cells)) => trouble.extend(cells),
            }
        }
        all.rim.sort_unstable();
        if trouble.is_empty() { Ok(all) } else { Err(Trouble(trouble)) }
    }

    fn cut_one(&self, triangle: u32, set: &CellSet, out: &mut Cut) -> Option<()> {
        let (low, high) = bounds(self.corners(triangle));
        let size = (0..3).map(|axis| i64::from(high[axis] - low[axis]) + 1).product::<i64>();
        if size <= MAX_BOX {
            let held = between(low, high).filter(|cell| set.holds(*cell)).count() as i64;
            if held == 0 {
                out.whole.push(triangle);
            }
            if held == 0 || held == size {
                return Some(());
            }
        }
        let traced = self.traced(triangle)?;
        let cells = cells(&traced);
        let held = cells.iter().filter(|cell| set.holds(**cell)).count();
        if held == 0 {
            out.whole.push(triangle);
        }
        if held == 0 || held == cells.len() {
            return Some(());
        }
        let halves = self.halves(triangle, &traced, set, &mut out.rim);
        for polygon in polygon::polygons(self, triangle, halves)? {
            out.parts.push((triangle, polygon));
        }
        Some(())
    }

    /// The sides of the part of a triangle outside a set, directed so that this part lies to their left; adds the sides along outer faces
    /// to the rim, in the opposite direction.
    fn halves(
        &self,
        triangle: u32,
        traced: &Trace,
        set: &CellSet,
        rim: &mut Vec<(GridFace, [Point; 2])>,
    ) -> Vec<Half> {
        let vertices = self.triangles[triangle as usize];
        let mut halves = Vec::new();
        for (edge, passages) in traced.edges.iter().enumerate() {
            let [vertex, next] = [vertices[edge], vertices[(edge + 1) % 3]];
            let mut cell = traced.cells[edge];
            let mut from = (!set.holds(cell)).then_some(Point::Vertex(vertex));
            for passage in passages {
                let behind = cells_beside(passage.face)[usize::from(passage.is_onward)];
                if set.holds(behind) != set.holds(cell) {
                    let (axis, at) = passage.face;
                    let point = Point::OnEdge([vertex.min(next), vertex.max(next)], axis, at[axis]);
                    match from.take() {
                        Some(from) => halves.push(Half { ends: [from, point], cell }),
                        None => from = Some(point),
                    }
                }
                cell = behind;
            }
            if let Some(from) = from {
                halves.push(Half { ends: [from, Point::Vertex(next)], cell });
            }
        }
        for segment in &traced.segments {
            let [before, behind] = cells_beside(segment.face);
            let [a, b] = segment.ends;
            match [before, behind].map(|cell| set.holds(cell)) {
                [true, false] => {
                    halves.push(Half { ends: [a, b], cell: behind });
                    rim.push((segment.face, [b, a]));
                }
                [false, true] => {
                    halves.push(Half { ends: [b, a], cell: before });
                    rim.push((segment.face, [a, b]));
                }
                _ => {}
            }
        }
        halves
    }
}

/// A side of the part of a triangle outside a set of cells: from one point to another, with an outside cell to the left.
#[derive(Debug, Clone, Copy)]
pub struct Half {
    pub ends: [Point; 2],
    pub cell: Coord,
}

/// The cells that a triangle passes through; some appear more than once.
fn cells(traced: &Trace) -> Vec<Coord> {
    let through = traced.edges.iter().flatten().flat_map(|passage| cells_beside(passage.face));
    let across = traced.segments.iter().flat_map(|segment| cells_beside(segment.face));
    traced.cells.into_iter().chain(through).chain(across).collect()
}

fn bounds(corners: [Fixed; 3]) -> (Coord, Coord) {
    let cells = corners.map(exact::cell_of);
    let of = |pick: fn(i32, i32) -> i32| [0, 1, 2].map(|a| pick(pick(cells[0][a], cells[1][a]), cells[2][a]));
    (of(i32::min), of(i32::max))
}
