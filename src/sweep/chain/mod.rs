//! The signed space-time chain of a moving mesh and its boundary.
//!
//! Between two poses each triangle sweeps a prism, split into three tetrahedra by ascending vertex index so that neighbours match: T1 = (a0
//! a1 a2 b2), T2 = (a0 a1 b1 b2), T3 = (a0 b0 b1 b2), where a is the earlier pose and b the later. The chain is the solid at the first pose
//! plus every tetrahedron through which the surface moves outward (with the exceptions in [`folds`]); points with winding number > 0 are
//! the swept volume. Only the boundary of the chain is built: faces between two tetrahedra that are both in the chain, or both not in it,
//! cancel and are never made.

pub(in crate::sweep) mod facet;
pub(in crate::sweep) mod facets;
mod folds;
mod patch;
pub(in crate::sweep) mod prism;

use rayon::prelude::*;

use super::moving_mesh::topology::Topology;
use super::window::Window;
use crate::context::Context;
use crate::distance::Face;
use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::vectors::{cross, difference, dot};
use crate::error::Result;
use folds::drop_returns;

/// The weights with which a moving mesh contributes to the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weights {
    /// Weight of the solid at the first pose (normally 1; 0 omits it, a negative weight subtracts it).
    pub solid: i32,
    /// Weight of the part that is swept outward (normally 1).
    pub swept: i32,
}

/// Outward motion below this (fixed-point units) counts as none: otherwise rounding would decide its sign.
pub const STILL: f64 = 4.0 / 4096.0 * UNITS as f64;
/// Triangles or edges per task: fixed, so that the order of faces never depends on the number of threads.
const GRAIN: usize = 2048;

/// Boundary of the chain that sweeps `topology` through `levels` (poses in time order, at least one).
///
/// # Errors
/// Cancel.
pub fn boundary(
    ctx: &Context,
    topology: &Topology,
    levels: &[Vec<Fixed>],
    weights: Weights,
    window: &Window,
) -> Result<Vec<Face>> {
    let chain = Chain { topology, levels, weights, window };
    let steps = levels.len() - 1;
    let triangles = topology.simplices.len();
    let mut outward = vec![0u8; triangles * steps];
    let mut faces: Vec<Face> = if steps == 0 {
        chunks(ctx, triangles, |triangle, out| chain.caps(triangle, &[], out))?
    } else {
        outward.par_chunks_mut(steps * GRAIN).enumerate().for_each(|(chunk, bits)| {
            if ctx.check().is_err() {
                return;
            }
            for (index, bits) in bits.chunks_mut(steps).enumerate() {
                chain.mark_outward(chunk * GRAIN + index, bits);
            }
        });
        drop_returns(ctx, topology, levels, window, &mut outward)?;
        chunks(ctx, triangles, |triangle, out| {
            chain.caps(triangle, &outward[triangle * steps..(triangle + 1) * steps], out);
        })?
    };
    let edges = if steps == 0 { 0 } else { topology.edges.len() };
    faces.extend(chunks(ctx, edges, |edge, out| chain.sides(edge, &outward, out))?);
    Ok(faces)
}

/// Runs `make` for 0..count in tasks of fixed size and concatenates the results, in order.
fn chunks(ctx: &Context, count: usize, make: impl Fn(usize, &mut Vec<Face>) + Sync) -> Result<Vec<Face>> {
    let parts: Vec<Vec<Face>> = (0..count.div_ceil(GRAIN))
        .into_par_iter()
        .map(|chunk| {
            let mut out = Vec::new();
            if ctx.check().is_ok() {
                (chunk * GRAIN..((chunk + 1) * GRAIN).min(count)).for_each(|index| make(index, &mut out));
            }
            out
        })
        .collect();
    ctx.check()?;
    Ok(parts.concat())
}

/// A chain that sweeps `topology` through `levels`.
struct Chain<'a> {
    topology: &'a Topology,
    levels: &'a [Vec<Fixed>],
    weights: Weights,
    window: &'a Window,
}

impl Chain<'_> {
    /// Whether the window may want faces at these vertices.
    fn is_wanted(&self, vertices: &[u32]) -> bool {
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for level in self.levels {
            for &vertex in vertices {
                for axis in 0..3 {
                    let value = level[vertex as usize][axis];
                    low[axis] = low[axis].min(value);
                    high[axis] = high[axis].max(value);
                }
            }
        }
        self.window.wants(low, high)
    }

    /// Sets bit i - 1 of each step's byte where the surface moves outward through tetrahedron Ti.
    fn mark_outward(&self, triangle: usize, bits: &mut [u8]) {
        let simplex = &self.topology.simplices[triangle];
        if !self.is_wanted(&simplex.v) {
            return;
        }
        let sign = f64::from(simplex.sign);
        for (step, bits) in bits.iter_mut().enumerate() {
            let a = simplex.v.map(|vertex| self.levels[step][vertex as usize]);
            let b = simplex.v.map(|vertex| self.levels[step + 1][vertex as usize]);
            let [edge1, edge2] = [difference(a[1], a[0]), difference(a[2], a[0])];
            let normal = cross(edge1, edge2);
            let still = STILL * dot(normal, normal).sqrt();
            let volume1 = dot(normal, difference(b[2], a[0]));
            let volume2 = -determinant(edge1, difference(b[1], a[0]), difference(b[2], a[0]));
            let volume3 = determinant(difference(b[0], a[0]), difference(b[1], a[0]), difference(b[2], a[0]));
            *bits = u8::from(sign * volume1 > still)
                | u8::from(sign * volume2 > still) << 1
                | u8::from(sign * volume3 > still) << 2;
        }
    }

    /// Faces of one triangle: the triangle itself at each pose, and the two between the tetrahedra of each prism.
    fn caps(&self, triangle: usize, outward: &[u8], out: &mut Vec<Face>) {
        let &Self { levels, weights, .. } = self;
        let simplex = &self.topology.simplices[triangle];
        if !self.is_wanted(&simplex.v) {
            return;
        }
        let sign = i32::from(simplex.sign);
        let at = |level: usize, corner: usize| levels[level][simplex.v[corner] as usize];
        let bit = |step: usize, index: u8| i32::from(outward[step] >> index & 1);
        for level in 0..levels.len() {
            let solid = if level == 0 { weights.solid } else { 0 };
            let entered = if level > 0 { bit(level - 1, 2) } else { 0 };
            let left = if level < outward.len() { bit(level, 0) } else { 0 };
            let coef = solid + weights.swept * (entered - left);
            push(out, [at(level, 0), at(level, 1), at(level, 2)], sign * coef);
        }
        for step in 0..outward.len() {
            let (first, second) = (bit(step, 0) - bit(step, 1), bit(step, 1) - bit(step, 2));
            let weight = sign * weights.swept;
            push(out, [at(step, 0), at(step, 1), at(step + 1, 2)], weight * first);
            push(out, [at(step, 0), at(step + 1, 1), at(step + 1, 2)], weight * second);
        }
    }

    /// The two faces that an edge (i, j) sweeps in each step, (ai aj bj) and (ai bi bj), where the tetrahedra beside them do not cancel.
    fn sides(&self, edge: usize, outward: &[u8], out: &mut Vec<Face>) {
        let &Self { topology, levels, weights, .. } = self;
        let steps = levels.len() - 1;
        let [i, j] = topology.edges[edge].map(|vertex| vertex as usize);
        let mut near = None;
        for step in 0..steps {
            let (mut lower, mut upper) = (0, 0);
            for at in topology.beside(edge) {
                let sign = i32::from(topology.simplices[at.triangle as usize].sign);
                let bits = i32::from(outward[at.triangle as usize * steps + step]);
                let [s1, s2, s3] = [bits & 1, bits >> 1 & 1, bits >> 2 & 1];
                let (low, up) = [(s2, -s3), (s1, -s2), (-s1, s3)][at.side as usize];
                lower += sign * low;
                upper += sign * up;
            }
            if (lower, upper) == (0, 0) {
                continue;
            }
            let wanted = *near.get_or_insert_with(|| self.is_wanted(&topology.edges[edge]));
            if !wanted {
                return;
            }
            let (a, b) = (&levels[step], &levels[step + 1]);
            push(out, [a[i], a[j], b[j]], lower * weights.swept);
            push(out, [a[i], b[i], b[j]], upper * weights.swept);
        }
    }
}

/// Adds a face; a negative `coef` flips it to make the coefficient positive.
fn push(out: &mut Vec<Face>, [a, b, c]: [Fixed; 3], coef: i32) {
    match coef {
        0 => {}
        1.. => out.push(Face { v: [a, b, c], coef }),
        _ => out.push(Face { v: [a, c, b], coef: -coef }),
    }
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    dot(a, cross(b, c))
}
