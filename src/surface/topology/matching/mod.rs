//! Topology matching (thesis 2.4): near flagged nodes, Gamma takes the topology of phi.
//!
//! Gamma is the signed distance from the mesh, phi that from the particles' surface, and psi = Gamma - phi (Eq. 2.2). At fixed nodes, near
//! the mesh and not flagged, psi stays as it is: the mesh's detail. Between them psi is as smooth as possible, a solution of Laplace's
//! equation (Eq. 2.3), and Gamma becomes phi + psi: it merges and splits where phi does, and is unchanged where nothing is flagged. Lengths
//! are in cells.
//!
//! The thesis solves on the whole grid, which takes most of its time. Here nodes within a reach of flagged ones are free, and all others
//! keep their Gamma. Neighbours of a free node:
//!
//! | node | its psi |
//! |---|---|
//! | missing | ignored, as at the border of the thesis' grid (Neumann, 2.4.2) |
//! | fixed, within reach or not | given: Gamma - phi (Dirichlet) |
//! | beyond reach, where phi has Gamma's sign and a magnitude over sqrt(3) | ignored |
//! | beyond reach, elsewhere | given: Gamma - phi |
//!
//! Far from the mesh Gamma and phi are clamped, each at its band, and their difference means little: if it were given everywhere along the
//! rim (the border of the reach), it would distort the result at flagged nodes (between two balls by 0.1 to 0.3 at a reach of 8, by 0.02 at
//! most with these rules). The difference is needed where phi alone would change a sign: without it, a drop of phi that lies across the rim
//! would be cut in two. As a last resort a free node beside one beyond reach keeps its Gamma if its sign would change. So no edge of the
//! grid across the rim gains or loses a crossing.

pub(in crate::surface) mod nodes;
mod solve;

use crate::context::Context;
use crate::error::{Error, Result, fail_if};
use nodes::Free;
pub use nodes::Node;
use solve::System;

/// Nodes per task.
const PIECE: usize = 2048;

/// How the Laplace equation is solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Solver {
    /// Successive over-relaxation, red and black nodes in turn (thesis 2.4.1).
    #[default]
    Sor,
    /// Conjugate gradients, preconditioned by a symmetric pass of Gauss-Seidel over red and black nodes.
    Gradients,
}

/// Settings of the matching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matching {
    /// Solver of the equation.
    pub solver: Solver,
    /// The iteration ends when every psi changes by less than this (cells), over 0 (thesis: 0.01).
    pub tolerance: f64,
    /// Distance from flagged nodes, on each axis, within which the equation is solved (cells), at least 1; beyond, Gamma stays.
    pub reach: i32,
    /// Maximum number of iterations.
    pub max_iterations: usize,
    /// Relaxation factor of [`Solver::Sor`], at least 1 and less than 2; none: derived from the width of the space between fixed nodes.
    pub omega: Option<f64>,
}

impl Default for Matching {
    fn default() -> Self {
        Self { solver: Solver::default(), tolerance: 0.01, reach: 12, max_iterations: 1000, omega: None }
    }
}

/// Result of a matching.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// Gamma of each node (cells), in the input order. At nodes that are not free it has the same bits as before.
    pub gamma: Vec<f32>,
    /// Count of iterations.
    pub iterations: usize,
    /// Maximum difference between a free node's psi and the mean psi of the nodes that it depends on (cells).
    pub residual: f64,
    /// Count of fixed nodes: those not flagged, with |Gamma| <= sqrt(3).
    pub fixed: usize,
    /// Count of free nodes: flagged ones, and those within reach that are not fixed.
    pub free: usize,
    /// Relaxation factor: the requested one, else the one derived from the space between fixed nodes, used by [`Solver::Sor`].
    pub omega: f64,
}

/// Matches Gamma to phi near flagged nodes. The result does not depend on the order of the nodes or the number of threads. When the
/// iterations reach their limit, the residual shows how far the solution is from convergence.
///
/// psi starts at 0 (thesis, algorithm 2.1): started from the Gamma - phi of flagged nodes, a solve that ends early would keep part of the
/// detail to be removed. Free nodes that are not connected to a given psi through free nodes keep 0: any constant would solve their
/// equations, and with 0 they become phi.
///
/// # Errors
/// Parameters out of range; two nodes at the same position; distances that are not finite; more memory than the context allows; cancel.
pub fn match_topology(ctx: &Context, nodes: &[Node], matching: &Matching) -> Result<Matched> {
    matching.validate()?;
    ctx.check()?;
    let Free { nodes: free, rows, fixed } = Free::of(ctx, nodes, matching.reach)?;
    let system = System::new(&rows);
    let omega = matching.omega.unwrap_or_else(|| system.omega());
    let solved = match matching.solver {
        Solver::Sor => system.over_relaxed(ctx, omega, matching.tolerance, matching.max_iterations)?,
        Solver::Gradients => system.by_gradients(ctx, matching.tolerance, matching.max_iterations)?,
    };
    let mut gamma: Vec<f32> = nodes.iter().map(|node| node.gamma).collect();
    for ((at, row), psi) in free.iter().zip(&rows).zip(&solved.psi) {
        let gamma = &mut gamma[*at as usize];
        let matched = (f64::from(nodes[*at as usize].phi) + psi) as f32;
        if !row.is_rim || (matched < 0.0) == (*gamma < 0.0) {
            *gamma = matched;
        }
    }
    let (iterations, residual) = (solved.iterations, solved.residual);
    Ok(Matched { gamma, iterations, residual, fixed, free: free.len(), omega })
}

impl Matching {
    fn validate(&self) -> Result<()> {
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return Err(Error::argument(format!(
                "the tolerance of the matching, {}, is not over 0 and finite",
                self.tolerance
            )));
        }
        fail_if(self.reach < 1, || {
            Error::argument(format!("the reach of the matching, {}, is not 1 or more", self.reach))
        })?;
        if let Some(omega) = self.omega.filter(|omega| !(1.0..2.0).contains(omega)) {
            return Err(Error::argument(format!(
                "the relaxation factor of the matching, {omega}, is not at least 1 and less than 2"
            )));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::DVec3;
    use crate::geometry::coords::between;
    use crate::surface::test_particles::context;

    const SOLVERS: [Solver; 2] = [Solver::Sor, Solver::Gradients];
    /// Extent of the grid of two balls from the origin on each axis (cells).
    const HALF: [i32; 3] = [26, 18, 18];

    fn matching(solver: Solver, tolerance: f64, reach: i32) -> Matching {
        Matching { solver, tolerance, reach, max_iterations: 5000, omega: None }
    }

    /// Two balls with a radius of 8, 1.5 apart. In phi they lie `shift` farther along y, and a neck has grown between them; nodes within 7
    /// of the gap are flagged.
    fn balls(shift: f64) -> Vec<Node> {
        let node = |position: [i32; 3]| {
            let position_of = DVec3::from(position.map(f64::from));
            let ball =
                |side: f64, shift: f64| (position_of - DVec3::new(side * 8.75, shift, 0.0)).norm() - 8.0;
            let (a, b) = (ball(-1.0, shift), ball(1.0, shift));
            // Smooth minimum.
            let near = (6.0 - (a - b).abs()).max(0.0) / 6.0;
            let phi = a.min(b) - near * near * 1.5;
            let gamma = ball(-1.0, 0.0).min(ball(1.0, 0.0));
            let is_flagged = position_of.norm() <= 7.0;
            Node {
                position,
                gamma: gamma.clamp(-4.0, 4.0) as f32,
                phi: phi.clamp(-5.0, 5.0) as f32,
                is_flagged,
            }
        };
        between(HALF.map(|x| -x), HALF).map(node).collect()
    }

    /// Index of a position in the grid of two balls.
    fn index(position: [i32; 3]) -> usize {
        (0..3).fold(0, |at, axis| at * (2 * HALF[axis] + 1) as usize + (position[axis] + HALF[axis]) as usize)
    }

    /// Whether a path over nodes inside leads from one ball's centre to the other's.
    fn are_joined(gamma: &[f32]) -> bool {
        let mut is_seen = vec![false; gamma.len()];
        let mut due = vec![[-9, 0, 0]];
        while let Some(position) = due.pop() {
            let at = index(position);
            if gamma[at] >= 0.0 || std::mem::replace(&mut is_seen[at], true) {
                continue;
            }
            for side in 0..6usize {
                let mut next = position;
                next[side / 2] += if side.is_multiple_of(2) { -1 } else { 1 };
                if (0..3).all(|axis| next[axis].abs() <= HALF[axis]) {
                    due.push(next);
                }
            }
        }
        is_seen[index([9, 0, 0])]
    }

    /// Pseudo-random values at nodes in a box, some missing.
    fn noise() -> Vec<Node> {
        let random = |position: [i32; 3], salt: u32| {
            let mix = |sum: u32, x: u32| (sum ^ x).wrapping_mul(0x9e37_79b1).rotate_left(13) ^ (sum >> 7);
            position.into_iter().map(|x| x as u32).fold(mix(salt, 77), mix).wrapping_mul(0x85eb_ca6b) >> 8
        };
        let value = |position, salt| (random(position, salt) % 6000) as f32 / 1000.0 - 3.0;
        between([-9, -7, -5], [12, 8, 9])
            .filter(|position| !random(*position, 1).is_multiple_of(7))
            .map(|position| Node {
                position,
                gamma: value(position, 2),
                phi: value(position, 3),
                is_flagged: random(position, 4).is_multiple_of(3),
            })
            .collect()
    }

    fn max_abs(differences: impl Iterator<Item = f32>) -> f32 {
        differences.fold(0.0f32, |max, x| max.max(x.abs()))
    }

    /// psi between two planes: -0.25 at x = 0 and 0.5 at x = 12.
    fn psi(x: i32) -> f32 {
        -0.25 + x as f32 / 16.0
    }

    /// Nodes of two planes and between them, where Gamma has no information.
    fn planes() -> Vec<Node> {
        let node = |position: [i32; 3]| {
            let is_flagged = (1..12).contains(&position[0]);
            let phi = (position[0] * 3 + position[1] * 5 + position[2]) as f32 / 8.0 % 1.0;
            Node { position, gamma: if is_flagged { 3.0 } else { phi + psi(position[0]) }, phi, is_flagged }
        };
        between([0; 3], [12, 4, 3]).map(node).collect()
    }

    #[test]
    fn psi_is_linear_between_two_planes() {
        let nodes = planes();
        for solver in SOLVERS {
            let out = match_topology(&context(1), &nodes, &matching(solver, 1e-11, 12)).unwrap();
            assert_eq!((out.fixed, out.free), (2 * 20, 11 * 20));
            assert!(out.iterations < 400, "{solver:?} took {}", out.iterations);
            assert!(out.residual < 1e-9, "{solver:?} left {}", out.residual);
            let far = max_abs(
                nodes.iter().zip(&out.gamma).map(|(node, out)| out - node.phi - psi(node.position[0])),
            );
            assert!(far < 1e-6, "{solver:?} is off by {far}");
        }
    }

    #[test]
    fn the_relaxation_factor_is_the_one_that_is_asked_for() {
        let nodes = planes();
        let solve = |omega| {
            let matching = Matching { omega, ..matching(Solver::Sor, 1e-9, 12) };
            match_topology(&context(1), &nodes, &matching).unwrap()
        };
        // Eleven nodes in a row are free.
        let own = solve(None);
        assert!((own.omega - 1.588_790_71).abs() < 1e-6, "{}", own.omega);
        assert!(solve(Some(own.omega)) == own);
        let plain = solve(Some(1.0));
        assert_eq!(plain.omega, 1.0);
        assert!(plain.iterations > 2 * own.iterations, "{} and {}", plain.iterations, own.iterations);
        let far = max_abs(plain.gamma.iter().zip(&own.gamma).map(|(a, b)| a - b));
        assert!(far < 1e-4, "they differ by {far}");
    }

    #[test]
    fn both_solvers_find_the_same_from_any_order_and_with_any_threads() {
        let nodes = noise();
        let solve = |solver, threads, nodes: &[Node]| {
            let ctx = context(threads);
            ctx.phase("match", || match_topology(&ctx, nodes, &matching(solver, 1e-9, 2))).unwrap()
        };
        let outs = SOLVERS.map(|solver| solve(solver, 1, &nodes));
        assert!(outs[0].fixed > 300 && outs[0].free > 1000, "{} and {}", outs[0].fixed, outs[0].free);
        assert!(outs.iter().all(|out| out.residual < 1e-6));
        let far = max_abs(outs[0].gamma.iter().zip(&outs[1].gamma).map(|(a, b)| a - b));
        assert!(far < 1e-4, "they differ by {far}");
        // Every 1009th node, modulo the count.
        let order: Vec<usize> = (0..nodes.len()).map(|n| n * 1009 % nodes.len()).collect();
        let shuffled: Vec<Node> = order.iter().map(|at| nodes[*at]).collect();
        for (solver, out) in SOLVERS.into_iter().zip(&outs) {
            let bits = |out: &Matched| out.gamma.iter().map(|gamma| gamma.to_bits()).collect::<Vec<_>>();
            assert!(bits(&solve(solver, 2, &nodes)) == bits(out), "{solver:?} with two threads");
            let other = solve(solver, 2, &shuffled);
            let expected: Vec<u32> = order.iter().map(|at| out.gamma[*at].to_bits()).collect();
            assert!(bits(&other) == expected, "{solver:?} in another order");
            assert_eq!((other.iterations, other.residual), (out.iterations, out.residual));
        }
    }

    #[test]
    fn a_neck_of_phi_joins_two_balls_and_what_is_far_stays() {
        let nodes = balls(0.0);
        let before: Vec<f32> = nodes.iter().map(|node| node.gamma).collect();
        assert!(!are_joined(&before));
        for solver in SOLVERS {
            let out = match_topology(&context(2), &nodes, &matching(solver, 0.01, 8)).unwrap();
            assert!(are_joined(&out.gamma), "{solver:?}");
            assert!(out.iterations < 100, "{solver:?} took {}", out.iterations);
            let mut stayed = 0;
            for (node, gamma) in nodes.iter().zip(&out.gamma) {
                let is_far = node.position.iter().any(|x| x.abs() > 15);
                let is_fixed = !node.is_flagged && node.gamma.abs() <= 1.7;
                if is_far || is_fixed {
                    assert_eq!(node.gamma.to_bits(), gamma.to_bits(), "{solver:?} at {:?}", node.position);
                    stayed += 1;
                } else if !node.is_flagged {
                    assert_eq!(node.gamma < 0.0, *gamma < 0.0, "{solver:?} at {:?}", node.position);
                }
            }
            assert!(stayed > nodes.len() / 3 && stayed < nodes.len());
        }
    }

    #[test]
    fn within_a_reach_it_is_what_it_is_on_the_whole_grid() {
        for (shift, solver) in [(0.0, Solver::Sor), (1.0, Solver::Gradients)] {
            let nodes = balls(shift);
            let [near, whole] = [12, i32::MAX].map(|reach| {
                let out = match_topology(&context(2), &nodes, &matching(solver, 1e-8, reach)).unwrap();
                assert!(out.residual < 1e-6, "{}", out.residual);
                out
            });
            assert!(near.free < whole.free);
            assert!(whole.free + whole.fixed == nodes.len());
            let same = |(a, b): (&f32, &f32)| (*a < 0.0) == (*b < 0.0);
            assert!(near.gamma.iter().zip(&whole.gamma).all(same), "shift {shift}");
            let flagged = nodes.iter().zip(near.gamma.iter().zip(&whole.gamma));
            let far =
                max_abs(flagged.filter(|(node, _)| node.is_flagged).map(|(_, (near, whole))| near - whole));
            assert!(far < 0.1, "shift {shift}: they differ by {far}");
        }
    }

    #[test]
    fn no_sign_changes_at_the_rim() {
        // A drop of phi above liquid, across the rim at x = 10; nodes within 2 of the origin are flagged.
        let node = |position: [i32; 3]| {
            let drop = (DVec3::from(position.map(f64::from)) - DVec3::new(10.0, 0.0, 7.0)).norm() - 4.0;
            let height = f64::from(position[2]) + 0.5;
            let is_flagged = position.iter().all(|x| x.abs() <= 2);
            let phi = height.min(drop).clamp(-4.0, 4.0) as f32;
            Node { position, gamma: height.clamp(-3.0, 3.0) as f32, phi, is_flagged }
        };
        let nodes: Vec<Node> = between([-14, -12, -12], [18, 12, 14]).map(node).collect();
        for solver in SOLVERS {
            let out = match_topology(&context(1), &nodes, &matching(solver, 1e-4, 8)).unwrap();
            let mut counts = [0; 2];
            for (node, gamma) in nodes.iter().zip(&out.gamma) {
                let far = node.position.iter().map(|x| x.abs()).max().unwrap();
                if far >= 10 {
                    assert_eq!(node.gamma < 0.0, *gamma < 0.0, "{solver:?} at {:?}", node.position);
                    counts[0] += usize::from(far == 10 && node.phi < 0.0 && node.gamma > 0.0);
                }
                if far > 10 {
                    assert_eq!(node.gamma.to_bits(), gamma.to_bits(), "{solver:?} at {:?}", node.position);
                }
                counts[1] += usize::from(node.gamma != *gamma);
            }
            assert!(counts[0] > 20 && counts[1] > 100, "{counts:?}");
        }
    }

    #[test]
    fn a_free_node_beside_one_beyond_reach_keeps_its_sign() {
        // psi is -5.5 throughout.
        let values = [(-1.5, 4.0, false), (1.0, 2.0, true), (3.0, 3.5, false), (3.0, 4.0, false)];
        let node = |(x, (gamma, phi, is_flagged)): (i32, (f32, f32, bool))| Node {
            position: [x, 0, 0],
            gamma,
            phi,
            is_flagged,
        };
        let nodes: Vec<Node> = (0..).zip(values).map(node).collect();
        for solver in SOLVERS {
            let out = match_topology(&context(1), &nodes, &matching(solver, 1e-9, 1)).unwrap();
            assert_eq!((out.fixed, out.free), (1, 2));
            assert!((out.gamma[1] + 3.5).abs() < 1e-6, "{solver:?}: {:?}", out.gamma);
            assert_eq!([out.gamma[0], out.gamma[2], out.gamma[3]], [-1.5, 3.0, 3.0], "{solver:?}");
        }
    }

    #[test]
    fn free_nodes_without_a_fixed_one_take_phi() {
        let island = between([20, 0, 0], [22, 2, 2]).map(|position| {
            let phi = 0.25 * (position[0] - 21) as f32 + 0.5 * position[1] as f32;
            Node { position, gamma: -1.0, phi, is_flagged: true }
        });
        let other = between([0; 3], [2, 2, 2]).map(|position| Node {
            position,
            gamma: 0.5,
            phi: 0.25,
            is_flagged: position == [1; 3],
        });
        let nodes: Vec<Node> = island.chain(other).collect();
        for solver in SOLVERS {
            let out = match_topology(&context(1), &nodes, &matching(solver, 1e-8, 3)).unwrap();
            assert_eq!((out.fixed, out.free), (26, 28));
            for (node, gamma) in nodes.iter().zip(&out.gamma) {
                let expected = if node.position[0] >= 20 { node.phi } else { 0.5 };
                assert!((gamma - expected).abs() < 1e-6, "{solver:?}: {gamma} is not {expected}");
            }
        }
    }

    #[test]
    fn nothing_is_nothing_and_what_makes_no_sense_is_refused() {
        let node = Node { position: [1, 2, 3], gamma: 0.5, phi: 0.25, is_flagged: true };
        for solver in SOLVERS {
            let small = Matching { solver, ..Matching::default() };
            let out = match_topology(&context(1), &[], &small).unwrap();
            assert_eq!((out.gamma.len(), out.iterations, out.free), (0, 0, 0));
            let calm = Node { is_flagged: false, ..node };
            assert_eq!(match_topology(&context(1), &[calm], &small).unwrap().gamma, [0.5]);
            let refusal = |nodes: &[Node], matching: &Matching| {
                match_topology(&context(1), nodes, matching).unwrap_err().to_string()
            };
            assert_eq!(refusal(&[node, node], &small), "node [1, 2, 3] is listed twice");
            let lost = Node { phi: f32::NAN, ..node };
            assert_eq!(refusal(&[lost], &small), "the distances of node [1, 2, 3] are not finite");
            assert!(refusal(&[node], &Matching { tolerance: 0.0, ..small }).contains("tolerance"));
            assert!(refusal(&[node], &Matching { reach: 0, ..small }).contains("reach"));
            for omega in [0.99, 2.0, f64::NAN] {
                assert!(refusal(&[node], &Matching { omega: Some(omega), ..small }).contains("factor"));
            }
            let ctx = context(1);
            ctx.cancel();
            assert!(matches!(match_topology(&ctx, &[node], &small), Err(Error::Cancelled)));
        }
    }
}
