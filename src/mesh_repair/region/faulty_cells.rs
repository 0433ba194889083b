//! Cells in which a mesh is at fault.

use std::collections::HashMap;

use super::CellSet;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::check::faults::meeting_pairs;
use crate::geometry::check::topology::{components, faulty};
use crate::geometry::coords::nodes_of;
use crate::geometry::{Coord, DVec3};
use crate::mesh_repair::cut::Shape;
use crate::mesh_repair::cut::exact::{cell_of, cells_around, cells_beside, passages};
use crate::mesh_repair::prepare::Closed;

/// Pierces closer to each other than this count as being at one position (cells).
const SAME_POSITION: f64 = 1e-6;
/// Triangles that close holes are faulty if their altitude is below this share of their longest edge.
const MIN_ALTITUDE: f64 = 4e-4;

/// The cells in which a mesh is at fault: where triangles intersect, where edges or vertices are non-manifold, where the surface does not
/// bound the solid, at parts too small for the grid that lie within others, and at slivers that close holes.
///
/// # Errors
/// Cancel.
pub fn flagged(ctx: &Context, closed: &Closed, shape: &Shape) -> Result<CellSet> {
    let mut set = CellSet::default();
    // A large triangle intersects many small ones: its cells are kept.
    let mut known: HashMap<u32, Vec<Coord>> = HashMap::new();
    for [first, second] in meeting_pairs(&closed.mesh) {
        ctx.check()?;
        for triangle in [first, second] {
            known.entry(triangle).or_insert_with(|| shape.cells_of(triangle));
        }
        let [a, b] = [&known[&first], &known[&second]];
        let common: Vec<Coord> = a.iter().copied().filter(|cell| b.binary_search(cell).is_ok()).collect();
        // On the lattice they may just miss each other.
        let cells = if common.is_empty() { [&a[..], b].concat() } else { common };
        cells.into_iter().for_each(|cell| _ = set.add(cell));
    }
    let (vertices, edges) = faulty(shape.fixed.len(), &shape.triangles);
    for vertex in vertices {
        set.add(cell_of(shape.fixed[vertex as usize]));
    }
    for ends in edges {
        let [a, b] = ends.map(|end| shape.fixed[end as usize]);
        [a, b].into_iter().for_each(|end| _ = set.add(cell_of(end)));
        for passage in passages(a, b).into_iter().flatten() {
            cells_beside(passage.face).into_iter().for_each(|cell| _ = set.add(cell));
        }
    }
    add_overlaps(shape, 0.0, &mut set);
    add_small_parts(shape, &mut set);
    let caps = (0u32..).zip(&closed.sources).filter(|(_, source)| source.is_none());
    for (triangle, _) in caps.filter(|(triangle, _)| is_thin(closed.mesh.corners(*triangle as usize))) {
        shape.cells_of(triangle).into_iter().for_each(|cell| _ = set.add(cell));
    }
    Ok(set)
}

fn is_thin([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    (b - a).cross(&(c - a)).norm() < MIN_ALTITUDE * longest
}

/// Adds the cells in which the surface does not bound the solid, because it has passed through itself by at least a depth (cells, less than
/// 1) along an edge of the grid.
pub fn add_overlaps(shape: &Shape, depth: f64, set: &mut CellSet) {
    for edge in shape.pierces.edges() {
        let mut winding = shape.pierces.winding(edge.1);
        let mut from = 0.0;
        let is_wrong = |winding: i32| !(0..=1).contains(&winding);
        let mut is_deep = false;
        // Pierces at one position have no order: only the winding numbers before and behind them count.
        for together in shape.pierces.on(*edge).chunk_by(|a, b| b.share - a.share < SAME_POSITION) {
            let at = together[0].share;
            is_deep |= is_wrong(winding) && (from == 0.0 || at - from >= depth);
            winding += together.iter().map(|pierce| pierce.change).sum::<i32>();
            from = at;
        }
        if is_deep || is_wrong(winding) {
            cells_around(*edge).into_iter().for_each(|cell| _ = set.add(cell));
        }
    }
}

/// Adds the cells of parts that cross no edge of the grid and are not clearly outside all others.
fn add_small_parts(shape: &Shape, set: &mut CellSet) {
    for part in components(&shape.triangles) {
        if part.iter().any(|triangle| !shape.pierces.of_triangle(*triangle).is_empty()) {
            continue;
        }
        let cells: Vec<Coord> = part.iter().flat_map(|triangle| shape.cells_of(*triangle)).collect();
        let is_outside =
            |cell: &Coord| nodes_of(*cell).into_iter().all(|node| shape.pierces.winding(node) == 0);
        if !cells.iter().all(is_outside) {
            cells.into_iter().for_each(|cell| _ = set.add(cell));
        }
    }
}

/// The cells of all parts that touch a set, and the set itself.
pub fn with_parts(shape: &Shape, set: &CellSet) -> CellSet {
    let mut out = set.clone();
    for part in components(&shape.triangles) {
        let touches = |triangle: &u32| shape.cells_of(*triangle).iter().any(|cell| set.holds(*cell));
        if part.iter().any(touches) {
            part.iter().flat_map(|triangle| shape.cells_of(*triangle)).for_each(|cell| _ = out.add(cell));
        }
    }
    out
}

/// The cells that the mesh passes through.
pub fn all_cells(shape: &Shape) -> CellSet {
    let mut out = CellSet::default();
    for triangle in 0..shape.triangles.len() as u32 {
        shape.cells_of(triangle).into_iter().for_each(|cell| _ = out.add(cell));
    }
    out
}
