//! Where a mesh passes through the grid's planes and edges, decided exactly.
//!
//! Vertices lie on a fine lattice, and the grid's planes are shifted by an infinitesimal (-z, then +x, then +y, each far smaller than the
//! last, as in [`crate::distance::winding`]): no vertex lies on a plane, no edge of the mesh meets an edge of the grid, and two triangles
//! always agree on their common edge.

use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::winding::{Axis, passes_left};
use crate::geometry::{Coord, DVec3};

/// An edge of the grid: its axis and its lower node.
pub type GridEdge = (usize, Coord);

/// A face of the grid: the axis across it, and the cell behind it, in the direction of the axis.
pub type GridFace = (usize, Coord);

/// A point of the mesh, by its definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Point {
    /// A vertex of the mesh.
    Vertex(u32),
    /// Where the edge between two vertices, the lower index first, passes through a plane of an axis.
    OnEdge([u32; 2], usize, i32),
    /// Where a triangle passes through an edge of the grid.
    OnTriangle(u32, GridEdge),
    /// Where a rebuilt surface passes through an edge of the grid.
    OnGrid(GridEdge),
    /// The middle of a rebuilt ring in a cell.
    Middle(Coord, u32),
}

/// Where an edge of the mesh passes through a face of the grid.
#[derive(Debug, Clone, Copy)]
pub struct Passage {
    /// The face.
    pub face: GridFace,
    /// Whether it passes to the cell behind the face.
    pub is_onward: bool,
}

/// The two cells that a face lies between: the one before it and the one behind it.
pub fn cells_beside((axis, cell): GridFace) -> [Coord; 2] {
    let mut before = cell;
    before[axis] -= 1;
    [before, cell]
}

/// The four cells around an edge of the grid, in order.
pub fn cells_around((axis, node): GridEdge) -> [Coord; 4] {
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[back, down]| {
        let mut cell = node;
        cell[b] -= back;
        cell[c] -= down;
        cell
    })
}

/// The end of an edge of the grid.
pub fn end((axis, mut node): GridEdge) -> Coord {
    node[axis] += 1;
    node
}

/// The cell that holds a vertex.
pub fn cell_of([x, y, z]: Fixed) -> Coord {
    // Planes across x and y are shifted forward, those across z back.
    [(x - 1).div_euclid(UNITS), (y - 1).div_euclid(UNITS), z.div_euclid(UNITS)]
}

/// A position in cells.
pub fn to_cells(fixed: Fixed) -> DVec3 {
    DVec3::from(fixed.map(|x| f64::from(x) / f64::from(UNITS)))
}

/// Whether the line from `p` to `q`, at its intersection with plane `n` of axis `a`, lies beyond plane `m` of axis `b`.
fn is_beyond(p: Fixed, q: Fixed, (a, n): (usize, i32), (b, m): (usize, i32)) -> bool {
    let axis = Axis::ALL[3 - a - b];
    let mut node = [0; 3];
    (node[a], node[b]) = (n, m);
    let is_left = passes_left(axis, p, q, axis.line(node));
    let [along_p, along_q, _] = [0, 1, 2].map(|i| axis.rotated(q)[i] - axis.rotated(p)[i]);
    // Which world axis the first rotated axis is, and whether it points the opposite way.
    let (first, is_against) = match axis {
        Axis::Z => (0, false),
        _ => (2, true),
    };
    if a == first {
        // A point to the left of a line that runs right is above the line, so the line is below the point.
        is_left != (along_p > 0)
    } else {
        // A point to the left of a line that runs up is left of the line, so the line is right of the point.
        (is_left == (along_q > 0)) != is_against
    }
}

/// The faces of the grid that the segment from vertex `a` to vertex `b` passes through, in order. None if the predicates contradict each
/// other, which cannot happen as they are exact.
pub fn passages(a: Fixed, b: Fixed) -> Option<Vec<Passage>> {
    let (mut cell, last) = (cell_of(a), cell_of(b));
    let steps: i32 = (0..3).map(|axis| (last[axis] - cell[axis]).abs()).sum();
    let mut out = Vec::with_capacity(steps as usize);
    while cell != last {
        let open = [0, 1, 2].map(|axis| cell[axis] != last[axis]);
        let plane = |axis: usize| if last[axis] > cell[axis] { cell[axis] + 1 } else { cell[axis] };
        let is_next = |axis: usize| {
            open[axis]
                && (0..3).filter(|other| *other != axis && open[*other]).all(|other| {
                    // The segment leaves through this plane first if it is still before the plane of the other axis there.
                    let beyond = is_beyond(a, b, (axis, plane(axis)), (other, plane(other)));
                    beyond != (last[other] > cell[other])
                })
        };
        let axis = (0..3).find(|axis| is_next(*axis))?;
        let is_onward = last[axis] > cell[axis];
        let mut behind = cell;
        behind[axis] = plane(axis);
        out.push(Passage { face: (axis, behind), is_onward });
        cell[axis] += if is_onward { 1 } else { -1 };
    }
    Some(out)
}

/// Where the edge between two vertices passes through a plane (cells).
pub fn on_edge([p, q]: [Fixed; 2], axis: usize, plane: i32) -> DVec3 {
    let share = (f64::from(plane) * f64::from(UNITS) - f64::from(p[axis]))
        / (f64::from(q[axis]) - f64::from(p[axis]));
    let mut position = to_cells(p) + (to_cells(q) - to_cells(p)) * share.clamp(0.0, 1.0);
    position[axis] = f64::from(plane);
    position
}

/// The segment along which a triangle meets a face of the grid: two points, and the face.
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    pub face: GridFace,
    /// The cell behind the face is on the left, seen from the side from which the triangle is counter-clockwise.
    pub ends: [Point; 2],
}

/// How a triangle lies in the grid.
#[derive(Debug, Default)]
pub struct Trace {
    /// Cells of the three corners.
    pub cells: [Coord; 3],
    /// For each edge, from a corner to the next.
    pub edges: [Vec<Passage>; 3],
    /// Where it meets faces of the grid.
    pub segments: Vec<Segment>,
}

/// Traces triangle `number`, with these vertices and their positions, which passes through these edges of the grid, ascending. None if the
/// data are inconsistent: the triangle has no area on the lattice in some view, or edges are missing.
pub fn trace(number: u32, vertices: [u32; 3], v: [Fixed; 3], pierced: &[GridEdge]) -> Option<Trace> {
    let mut traced = Trace { cells: v.map(cell_of), ..Trace::default() };
    for edge in 0..3 {
        traced.edges[edge] = edge_passages(vertices, v, edge)?;
    }
    // Each plane that it passes through is entered and left once.
    let mut planes: Vec<(usize, i32)> = traced
        .edges
        .iter()
        .flatten()
        .map(|Passage { face: (axis, cell), .. }| (*axis, cell[*axis]))
        .collect();
    planes.sort_unstable();
    planes.dedup();
    for (axis, plane) in planes {
        let mut out = None;
        let mut back = None;
        for (edge, passages) in traced.edges.iter().enumerate() {
            let through =
                passages.iter().find(|passage| passage.face.0 == axis && passage.face.1[axis] == plane);
            let Some(passage) = through else { continue };
            let mut ends = [vertices[edge], vertices[(edge + 1) % 3]];
            ends.sort_unstable();
            let point = (Point::OnEdge(ends, axis, plane), passage.face.1);
            if passage.is_onward {
                back = Some(point);
            } else {
                out = Some(point);
            }
        }
        // Behind the plane the triangle lies left of the segment from where its edge comes back to where it leaves.
        let ((mut from, mut at), (to, last)) = (out?, back?);
        while at != last {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            let step = others.into_iter().find_map(|across| {
                let sign = (last[across] - at[across]).signum();
                let mut node = at;
                node[across] += sign.max(0);
                let edge = (3 - axis - across, node);
                (sign != 0 && pierced.binary_search(&edge).is_ok()).then_some((across, sign, edge))
            });
            let (across, sign, edge) = step?;
            let point = Point::OnTriangle(number, edge);
            traced.segments.push(Segment { face: (axis, at), ends: [from, point] });
            at[across] += sign;
            from = point;
        }
        traced.segments.push(Segment { face: (axis, at), ends: [from, to] });
    }
    Some(traced)
}

/// The passages of an edge of a triangle, from its corner to the next; computed from the lower vertex, so that both its triangles find the
/// same ones.
fn edge_passages(vertices: [u32; 3], v: [Fixed; 3], edge: usize) -> Option<Vec<Passage>> {
    let next = (edge + 1) % 3;
    if vertices[edge] < vertices[next] {
        return passages(v[edge], v[next]);
    }
    let mut back = passages(v[next], v[edge])?;
    back.reverse();
    back.iter_mut().for_each(|passage| passage.is_onward = !passage.is_onward);
    Some(back)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distance::Face;
    use crate::distance::winding::each_crossing;

    fn random(seed: u64) -> impl FnMut(i32) -> i32 {
        let mut state = seed;
        move |range| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as i64 % i64::from(2 * range + 1)) as i32 - range
        }
    }

    fn pierced(v: [Fixed; 3]) -> Vec<GridEdge> {
        let mut out = Vec::new();
        for axis in Axis::ALL {
            let wide = [[i64::from(i32::MIN) / 4096, i64::from(i32::MAX) / 4096]; 2];
            each_crossing(&Face { v, coef: 1 }, axis, wide, |line, at, _| {
                out.push((axis.index(), axis.voxel(line, at.floor() as i32)));
            });
        }
        out.sort_unstable();
        out
    }

    #[test]
    fn every_triangle_is_traced_also_where_it_lies_on_planes_and_edges_of_the_grid() {
        let mut random = random(3);
        let (mut flat, mut pieces) = (0, 0);
        for round in 0..20_000 {
            // Coarse coordinates lie on planes, lines and nodes; equal ones make needles and points.
            let step = [1, 64, 512, 2048, 4096][round % 5];
            let mut corner = || [0, 1, 2].map(|_| random(3 * UNITS / step) * step);
            let v = [corner(), corner(), corner()];
            let pierced = pierced(v);
            let traced = trace(7, [4, 9, 2], v, &pierced);
            let [a, b, c] = v.map(to_cells);
            if (b - a).cross(&(c - a)).norm() == 0.0 {
                flat += 1;
                continue;
            }
            let traced = traced.unwrap_or_else(|| panic!("{v:?} {pierced:?}"));
            pieces += traced.segments.len();
            // Each edge of the grid that it passes through is an end of four segments.
            for edge in &pierced {
                let is_end = |point: &&Point| **point == Point::OnTriangle(7, *edge);
                let count = traced.segments.iter().flat_map(|segment| &segment.ends).filter(is_end).count();
                assert_eq!(count, 4, "{v:?} {edge:?}");
            }
        }
        assert!(flat > 20 && pieces > 100_000, "{flat} {pieces}");
    }
}
