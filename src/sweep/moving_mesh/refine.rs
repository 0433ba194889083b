//! Splits edges whose ends move differently.
//!
//! A moving edge sweeps a bilinear patch; the chain replaces it by two triangles, which differ from it by at most |db - da| / 4 (da, db:
//! the displacements of the edge's ends in a step).

use rayon::prelude::*;

use super::topology::{Derived, Simplex, Topology};
use crate::context::Context;
use crate::error::{Error, Result, fail_if};
use crate::geometry::DVec3;

/// Maximum number of pieces of an edge in one round.
const MAX_PIECES: f64 = 4096.0;
/// Maximum number of rounds: the edges that one round adds are split by the next.
const MAX_ROUNDS: usize = 12;

/// For messages: what needs the memory, and how to reduce it.
const WHAT: &str =
    "a body's edges, split where their ends move differently (larger cells or a shorter motion need less)";
/// Bytes of a new vertex in each pose: as `f64` and in fixed point.
const BYTES_PER_POSITION: u64 = 36;
/// Bytes of a new vertex, and of the two triangles and three edges that come with it.
const BYTES_PER_VERTEX: u64 = 150;
/// Maximum number of bytes added in one round, whatever the context allows.
const MAX_BYTES: u64 = 8 << 30;

/// Difference (cells) between the patch that an edge sweeps in a step and the two triangles that replace it.
pub fn edge_error([before, after]: [&[DVec3]; 2], [i, j]: [u32; 2]) -> f64 {
    let edge = |pose: &[DVec3]| pose[i as usize] - pose[j as usize];
    (edge(after) - edge(before)).norm() / 4.0
}

/// Splits edges into equal pieces until each error is within `tolerance` (cells), and adds the new vertices to the poses; returns none if
/// no edge is split. `wanted` returns whether an edge matters in a step, given the step's two poses.
///
/// # Errors
/// Cancel; more pieces than fit in memory.
pub fn refine(
    ctx: &Context,
    topology: &Topology,
    poses: &mut [Vec<DVec3>],
    tolerance: f64,
    wanted: impl Fn([&[DVec3]; 2], [u32; 2]) -> bool + Sync,
) -> Result<Option<Topology>> {
    let mut refined: Option<Topology> = None;
    for _ in 0..MAX_ROUNDS {
        let current = refined.as_ref().unwrap_or(topology);
        debug_assert!(poses.iter().all(|pose| pose.len() == current.vertex_count()));
        let pieces = |edge: &[u32; 2]| {
            let steps = poses.windows(2).map(|pair| [&pair[0][..], &pair[1][..]]);
            let error = steps.fold(tolerance, |max, step| {
                let error = edge_error(step, *edge);
                if error > max && wanted(step, *edge) { error } else { max }
            });
            (error / tolerance).min(MAX_PIECES).ceil() as u32
        };
        let pieces: Vec<u32> = current.edges.par_iter().with_min_len(2048).map(pieces).collect();
        if pieces.iter().all(|&pieces| pieces == 1) {
            break;
        }
        ctx.check()?;
        let added: u64 = pieces.iter().map(|&pieces| u64::from(pieces - 1)).sum();
        let needed = added * (poses.len() as u64 * BYTES_PER_POSITION + BYTES_PER_VERTEX);
        ctx.allow(WHAT, needed)?;
        fail_if(needed > MAX_BYTES, || Error::Memory { what: WHAT.into(), needed, limit: MAX_BYTES })?;
        let split = Split::new(current, &pieces);
        let simplices = split.triangles(current);
        let mut derived = current.derived.clone();
        derived.extend(split.added.iter().cloned());
        poses
            .iter_mut()
            .for_each(|pose| split.added.iter().for_each(|added| pose.push(added.position(pose))));
        refined = Some(Topology::from_parts(topology.own_vertices, derived, simplices));
    }
    Ok(refined)
}

/// Edges split into pieces.
struct Split {
    /// The vertices between the pieces.
    added: Vec<Derived>,
    /// For each edge the index of its first new vertex, and the number of its pieces.
    edges: Vec<(u32, u32)>,
}

impl Split {
    fn new(topology: &Topology, pieces: &[u32]) -> Self {
        let mut split = Self { added: Vec::new(), edges: Vec::with_capacity(pieces.len()) };
        for (&[i, j], &pieces) in topology.edges.iter().zip(pieces) {
            split.edges.push(((topology.vertex_count() + split.added.len()) as u32, pieces));
            split
                .added
                .extend((1..pieces).map(|piece| Derived::Along(i, j, f64::from(piece) / f64::from(pieces))));
        }
        split
    }

    /// The triangles, split where their edges are split.
    fn triangles(&self, topology: &Topology) -> Vec<Simplex> {
        let mut edges = vec![[0; 3]; topology.simplices.len()];
        for edge in 0..topology.edges.len() {
            for at in topology.beside(edge) {
                edges[at.triangle as usize][at.side as usize] = edge;
            }
        }
        let mut out = Vec::with_capacity(topology.simplices.len() * 2);
        for (simplex, [e01, e12, e02]) in topology.simplices.iter().zip(edges) {
            let [a, b, c] = simplex.v;
            // Corners in counter-clockwise order, and the edge after each.
            let (corners, edges) =
                if simplex.sign > 0 { ([a, b, c], [e01, e12, e02]) } else { ([a, c, b], [e02, e12, e01]) };
            self.split_triangle(corners, edges, |triangle| out.extend(Simplex::new(triangle)));
        }
        out
    }

    /// Connects the two sides of a triangle that have the most pieces by a strip that starts at their common corner.
    fn split_triangle(&self, v: [u32; 3], edges: [usize; 3], mut emit: impl FnMut([u32; 3])) {
        let pieces = edges.map(|edge| self.edges[edge].1);
        let base = (0..3).min_by_key(|&side| pieces[side]).unwrap_or(0);
        let [c, a, b] = [0, 1, 2].map(|i| v[(base + i) % 3]);
        let [across, left, right] = [0, 1, 2].map(|i| edges[(base + i) % 3]);
        let [count, lefts, rights] = [across, left, right].map(|edge| self.edges[edge].1);
        let on_left = |position: u32| self.vertex(left, b, a, position);
        let on_right = |position: u32| self.vertex(right, b, c, position);
        let (mut i, mut j) = (1, 1);
        let mut tip = b;
        while (i, j) != (lefts, rights) {
            emit([on_left(i), tip, on_right(j)]);
            let go_left = j == rights || i < lefts && (i + 1) * rights <= (j + 1) * lefts;
            tip = if go_left { on_left(i) } else { on_right(j) };
            (i, j) = if go_left { (i + 1, j) } else { (i, j + 1) };
        }
        for position in 0..count {
            let part = [self.vertex(across, c, a, position), self.vertex(across, c, a, position + 1)];
            emit([part[1], tip, part[0]]);
        }
    }

    /// The vertex at the end of the first `position` pieces of an edge, counted from one of its ends to the other.
    fn vertex(&self, edge: usize, from: u32, to: u32, position: u32) -> u32 {
        let (first, pieces) = self.edges[edge];
        match position {
            0 => from,
            _ if position == pieces => to,
            _ if from < to => first + position - 1,
            _ => first + pieces - position - 1,
        }
    }
}
