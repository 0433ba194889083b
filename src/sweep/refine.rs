//! Splitting of edges whose ends move differently.
//!
//! A moving edge sweeps a bilinear patch; the chain has two triangles in its place, which differ from
//! it by at most |db - da| / 4 (da, db: the displacements of the edge's ends in a step).

use rayon::prelude::*;

use super::topology::{Derived, Simplex, Topology};
use crate::base::DVec3;

/// No middle vertex.
const NONE: u32 = u32::MAX;
/// Rounds of halving: an edge becomes at most 2^12 pieces.
const MOST_ROUNDS: usize = 12;

/// Largest difference (cells) between the patch that an edge sweeps in one step and its two triangles.
pub fn edge_error(poses: &[impl AsRef<[DVec3]>], [i, j]: [u32; 2]) -> f64 {
    let (i, j) = (i as usize, j as usize);
    let edge = |pose: &dyn AsRef<[DVec3]>| pose.as_ref()[i] - pose.as_ref()[j];
    poses.windows(2).map(|pair| (edge(&pair[1]) - edge(&pair[0])).norm_squared()).fold(0.0, f64::max).sqrt()
        / 4.0
}

/// Halves edges until each error is within `tolerance` (cells), extending the poses; none when no edge
/// needs it. `wanted` tells which edges matter.
pub fn refine(
    topology: &Topology,
    poses: &mut [Vec<DVec3>],
    tolerance: f64,
    wanted: impl Fn(&[Vec<DVec3>], [u32; 2]) -> bool + Sync,
) -> Option<Topology> {
    let mut refined: Option<Topology> = None;
    for _ in 0..MOST_ROUNDS {
        let current = refined.as_ref().unwrap_or(topology);
        let middles =
            middles(current, poses, |edge| edge_error(poses, edge) > tolerance && wanted(poses, edge));
        let Some((derived, middle_of)) = middles else { break };
        let simplices = halve(current, &middle_of);
        for pose in poses.iter_mut() {
            for middle in &derived[current.derived.len()..] {
                if let Derived::Middle(i, j) = middle {
                    let position = (pose[*i as usize] + pose[*j as usize]) * 0.5;
                    pose.push(position);
                }
            }
        }
        refined = Some(Topology::from_parts(topology.own_vertices, derived, simplices));
    }
    refined
}

/// Gives each edge that needs it a middle vertex: all derived vertices, and each edge's middle.
fn middles(
    topology: &Topology,
    poses: &[Vec<DVec3>],
    needs: impl Fn([u32; 2]) -> bool + Sync,
) -> Option<(Vec<Derived>, Vec<u32>)> {
    debug_assert!(poses.iter().all(|pose| pose.len() == topology.vertex_count()));
    let mut derived = topology.derived.clone();
    let needed: Vec<bool> = topology.edges.par_iter().with_min_len(2048).map(|&edge| needs(edge)).collect();
    let middle_of: Vec<u32> = topology
        .edges
        .iter()
        .zip(needed)
        .map(|(&[i, j], needed)| {
            if !needed {
                return NONE;
            }
            derived.push(Derived::Middle(i, j));
            (topology.own_vertices + derived.len() - 1) as u32
        })
        .collect();
    (derived.len() > topology.derived.len()).then_some((derived, middle_of))
}

/// Splits each triangle at the middles of its edges.
fn halve(topology: &Topology, middle_of: &[u32]) -> Vec<Simplex> {
    let mut middles = vec![[NONE; 3]; topology.simplices.len()];
    for (edge, &middle) in middle_of.iter().enumerate() {
        for at in topology.beside(edge) {
            middles[at.triangle as usize][at.side as usize] = middle;
        }
    }
    let mut out = Vec::with_capacity(topology.simplices.len() * 2);
    for (simplex, [m01, m12, m02]) in topology.simplices.iter().zip(middles) {
        let [a, b, c] = simplex.v;
        // Corners in order, and the middle that follows each.
        let (corners, middles) =
            if simplex.sign > 0 { ([a, b, c], [m01, m12, m02]) } else { ([a, c, b], [m02, m12, m01]) };
        split(corners, middles, |triangle| out.extend(Simplex::new(triangle)));
    }
    out
}

fn split(v: [u32; 3], m: [u32; 3], mut emit: impl FnMut([u32; 3])) {
    let count = m.iter().filter(|&&middle| middle != NONE).count();
    // Turned so that the odd one out comes last (one middle: first).
    let turn = match count {
        1 => (0..3).find(|&i| m[i] != NONE),
        2 => (0..3).find(|&i| m[(i + 2) % 3] == NONE),
        _ => Some(0),
    }
    .unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| v[(i + turn) % 3]);
    let [ab, bc, ca] = [0, 1, 2].map(|i| m[(i + turn) % 3]);
    match count {
        0 => emit([a, b, c]),
        1 => [[a, ab, c], [ab, b, c]].into_iter().for_each(emit),
        2 => [[ab, b, bc], [a, ab, bc], [a, bc, c]].into_iter().for_each(emit),
        _ => [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].into_iter().for_each(emit),
    }
}
