//! Mesh improvement (thesis 2.6): edges are split where the tracked mesh was stretched and collapsed where it was compressed, and edges of
//! thin new triangles are flipped. The reference is the length that the edges around a vertex had at its birth: long and short edges stay
//! as they were sculpted. Nearly all of a mesh needs no change, and stays as it is, bit for bit; so does all of a mesh at rest
//! (`strain.rs`).
//!
//! After Wojtan et al. 2009, and Brochu and Bridson 2009 ("Robust topological operations for dynamic explicit surfaces") for the
//! preservation of ridges and corners. `remesh/vertex_rings.rs` has the operations, `butterfly.rs`, `collapse.rs`, `flip.rs` and `relax.rs`
//! decide where they are applied and whether they are allowed.
//!
//! | word | meaning |
//! |---|---|
//! | size | of a vertex: the lengths of the shortest and of the longest edge around it at its birth |
//! | target | of an edge: its range of lengths, from the longer of its ends' shortest lengths to the shorter of their longest |
//! | due | of a triangle: it may need an improvement |
//! | near | triangles that a pass looks at |

mod butterfly;
mod collapse;
pub(in crate::surface) mod drift;
mod flip;
mod improvable;
mod relax;
mod shape;
mod strain;
mod vertex_rings;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::surface::pieces::in_pieces;
pub use improvable::{Improvable, Size};
use improvable::{is_long, is_short};
use vertex_rings::VertexRings;

/// How often an edge and its parts may be halved in a frame: a stray vertex may make it arbitrarily long.
const ROUNDS: usize = 5;
/// Sweeps in a frame: the changes of one are checked in the next.
const SWEEPS: usize = 3;
/// How often vertices move in a sweep.
const RELAXATIONS: usize = 3;
/// Triangles per task.
const GRAIN: usize = 4096;
/// Operations between two checks for a cancel.
const CHECK_INTERVAL: usize = 256;

/// Counts of the operations that improved a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Improvements {
    /// Edges split by a vertex.
    pub splits: usize,
    /// Vertices merged into a neighbour.
    pub collapses: usize,
    /// Edges flipped within their two triangles.
    pub flips: usize,
}

/// Improves a mesh; it stays a closed 2-manifold by index. Vertices that have an origin stay where they are or are removed; unchanged
/// triangles keep their order and vertices. Runs on the threads of the phase around it.
///
/// # Errors
/// Cancel: the mesh is then partly improved, and still closed.
pub fn improve(ctx: &Context, mesh: &mut Improvable<'_>) -> Result<Improvements> {
    let due = due(ctx, mesh)?;
    if due.is_empty() {
        return Ok(Improvements::default());
    }
    let rings = VertexRings::of(mesh);
    let mut work = Work { ctx, rings, rounds: ROUNDS, done: Improvements::default() };
    let result = work.run(due);
    let Work { rings, done, .. } = work;
    rings.finish();
    result.map(|()| done)
}

/// The current size of each vertex; 0 if it has no edges.
pub fn sizes(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<Size> {
    let mut sizes = vec![[f32::INFINITY, 0.0f32]; positions.len()];
    for &[a, b, c] in triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            let [p, q] = ends.map(|end| positions[end as usize]);
            let length = (p - q).norm() as f32;
            for end in ends {
                let [shortest, longest] = &mut sizes[end as usize];
                (*shortest, *longest) = (shortest.min(length), longest.max(length));
            }
        }
    }
    sizes.into_iter().map(|size| if size[0].is_finite() { size } else { [0.0; 2] }).collect()
}

/// Triangles that may be due, ascending.
fn due(ctx: &Context, mesh: &Improvable<'_>) -> Result<Vec<u32>> {
    in_pieces(ctx, mesh.triangles, GRAIN, |first, triangles| {
        let all = (first as u32..).zip(triangles.iter().zip(&mesh.sources[first..]));
        let due = all.filter(|(_, (corners, source))| mesh.is_due(**corners, **source));
        due.map(|(triangle, _)| triangle).collect()
    })
}

/// Adds triangles to others; ascending, each once.
fn join(near: &mut Vec<u32>, more: &[u32]) {
    if !more.is_empty() {
        near.extend_from_slice(more);
        near.sort_unstable();
        near.dedup();
    }
}

/// A pass over some triangles.
type Pass<T> = fn(&mut T, &[u32]) -> Result<()>;

/// A mesh that is being improved.
struct Work<'c, 'm, 'a> {
    ctx: &'c Context,
    rings: VertexRings<'m, 'a>,
    /// Rounds of splits that are left.
    rounds: usize,
    done: Improvements,
}

impl Work<'_, '_, '_> {
    fn run(&mut self, mut due: Vec<u32>) -> Result<()> {
        for _ in 0..SWEEPS {
            due = self.sweep(due)?;
            if due.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// Runs each pass on some triangles, and on those that earlier passes changed; returns all that changed.
    fn sweep(&mut self, mut near: Vec<u32>) -> Result<Vec<u32>> {
        let mut changed = Vec::new();
        let mut halved = self.split(&near)?;
        while !halved.is_empty() {
            join(&mut changed, &halved);
            halved = self.split(&halved)?;
        }
        join(&mut near, &changed);
        let passes: [Pass<Self>; 4] = [Self::collapse, Self::unfold, Self::flip, Self::relax];
        for pass in passes {
            pass(self, &near)?;
            let touched = self.rings.take_touched();
            join(&mut near, &touched);
            join(&mut changed, &touched);
        }
        Ok(changed)
    }

    /// Halves each edge that is too long, the longest first; returns the triangles that changed.
    fn split(&mut self, near: &[u32]) -> Result<Vec<u32>> {
        if self.rounds == 0 {
            return Ok(Vec::new());
        }
        let edges = self.edges(near, is_long, -1.0);
        self.rounds -= usize::from(!edges.is_empty());
        for (n, ends) in edges.into_iter().enumerate() {
            self.check_cancel(n)?;
            let edge = self.rings.edge(ends).filter(|_| self.rings.needs_change(ends, is_long));
            if let Some(edge) = edge
                && !edge.corners.iter().any(|&corner| self.rings.is_flagged(corner))
            {
                let position = self.rings.split_position(&edge);
                self.rings.split(&edge, position);
                self.done.splits += 1;
            }
        }
        Ok(self.rings.take_touched())
    }

    /// Collapses edges that are too short, the shortest first.
    fn collapse(&mut self, near: &[u32]) -> Result<()> {
        let edges = self.edges(near, is_short, 1.0);
        for (n, ends) in edges.into_iter().enumerate() {
            self.check_cancel(n)?;
            if self.rings.edge(ends).is_none() || !self.rings.needs_change(ends, is_short) {
                continue;
            }
            let collapse =
                self.rings.collapses(ends).into_iter().find(|collapse| self.rings.is_allowed(collapse, &[]));
            if let Some(collapse) = collapse {
                self.rings.collapse(&collapse);
                self.done.collapses += 1;
            }
        }
        Ok(())
    }

    /// Removes folds.
    fn unfold(&mut self, near: &[u32]) -> Result<()> {
        for (n, &triangle) in near.iter().enumerate() {
            self.check_cancel(n)?;
            if let Some(collapse) = self.rings.unfolding(triangle) {
                self.rings.collapse(&collapse);
                self.done.collapses += 1;
            }
        }
        Ok(())
    }

    /// Flips edges of thin triangles.
    fn flip(&mut self, near: &[u32]) -> Result<()> {
        for (n, &triangle) in near.iter().enumerate() {
            self.check_cancel(n)?;
            if let Some(edge) = self.rings.best_flip(triangle) {
                self.rings.flip(&edge);
                self.done.flips += 1;
            }
        }
        Ok(())
    }

    /// Moves vertices created in this frame.
    fn relax(&mut self, near: &[u32]) -> Result<()> {
        let there = near.iter().filter(|triangle| self.rings.exists(**triangle));
        let mut vertices: Vec<u32> = there.flat_map(|triangle| self.rings.corners(*triangle)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        for _ in 0..RELAXATIONS {
            for (n, vertex) in vertices.iter().enumerate() {
                self.check_cancel(n)?;
                if let Some(position) = self.rings.relaxed(*vertex) {
                    self.rings.move_vertex(*vertex, position);
                }
            }
        }
        Ok(())
    }

    /// Of the edges of some triangles, those that are out of range and not at rest, each once, in the order of their lengths times `sign`,
    /// then of their vertices.
    fn edges(&self, near: &[u32], is_out: fn(f64) -> bool, sign: f64) -> Vec<[u32; 2]> {
        let mut edges = Vec::new();
        for &triangle in near.iter().filter(|triangle| self.rings.exists(**triangle)) {
            let [a, b, c] = self.rings.corners(triangle);
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let ends = [a.min(b), a.max(b)];
                if self.rings.needs_change(ends, is_out) {
                    edges.push((sign * self.rings.length(ends), ends));
                }
            }
        }
        edges.sort_unstable_by(|one, two| one.0.total_cmp(&two.0).then(one.1.cmp(&two.1)));
        edges.dedup_by_key(|edge| edge.1);
        edges.into_iter().map(|(_, ends)| ends).collect()
    }

    fn check_cancel(&self, n: usize) -> Result<()> {
        if n.is_multiple_of(CHECK_INTERVAL) { self.ctx.check() } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests;
