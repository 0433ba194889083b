//! Surface: ways to solve the equation of the topology matching (thesis 2.4.1): over-relaxation by its factor, and conjugate gradients.

use std::f64::consts::PI;
use std::time::Instant;

use frazil::Context;
use frazil::surface::{Matched, Matching, Node, Solver, match_topology};

use crate::common::liquids::context;
use crate::harness::median;
use crate::matching_gates::{HALF, REACH, balls};
use crate::surface::title;

/// Two balls, on cells so many times smaller, and the relaxation factors that are tried on them.
const SETS: [(i32, &str, &[f64]); 2] = [
    (1, "two balls", &[1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 1.95]),
    (2, "on cells half as large", &[1.5, 1.6, 1.7, 1.8, 1.9, 1.95]),
];
/// Changes of psi at which a solution ends (cells), the thesis' and one that leaves nothing, and how often it is timed.
const TOLERANCES: [(f64, usize); 2] = [(0.01, 3), (1e-6, 1)];
/// That of the solution that all are compared with.
const EXACT: f64 = 1e-9;
/// Most iterations.
const MOST: usize = 5000;

/// Prints it.
pub fn tables() {
    let near = Matching { reach: REACH, max_iterations: MOST, ..Matching::default() };
    let whole = Matching { reach: i32::MAX, ..near };
    title(
        &format!(
            "Solvers of the topology matching, 1 thread. Two balls with a radius of 8 cells, 1.5 apart, and a neck of phi between \
             them, flagged within 7 of the middle; then on cells half as large. Solved within {REACH} cells of what is flagged, or \
             on the whole grid, until no psi changes by 0.01 cells (thesis) or 1e-6. Times are with the work before the first \
             iteration; off: how far Gamma is at most, at flagged nodes, from what many more iterations find."
        ),
        "set | way | to 0.01: iterations, ms, off (cells) | to 1e-6: iterations, ms, off (cells)",
    );
    let ctx = context(1);
    for (scale, name, factors) in SETS {
        let nodes = balls(scale, 0.0);
        let set = Set { ctx: &ctx, name, nodes: &nodes };
        let exact = set.exact(&near);
        set.row(&exact, "no iteration", Matching { max_iterations: 0, ..near });
        for factor in factors {
            set.row(&exact, &format!("factor {factor:.2}"), Matching { omega: Some(*factor), ..near });
        }
        set.row(&exact, &format!("factor {:.2}, ours: of the band's width", exact.omega), near);
        let best = best(scale);
        let of_grid = Some(best);
        let way = format!("factor {best:.2}, thesis: of the grid's size");
        set.row(&exact, &way, Matching { omega: of_grid, ..near });
        set.row(&exact, "conjugate gradients", Matching { solver: Solver::Gradients, ..near });
        let exact = set.exact(&whole);
        let way = format!("the whole grid, factor {best:.2} (thesis)");
        set.row(&exact, &way, Matching { omega: of_grid, ..whole });
        let gradients = Matching { solver: Solver::Gradients, ..whole };
        set.row(&exact, "the whole grid, conjugate gradients", gradients);
    }
}

/// The best relaxation factor for a cube as wide as the widest side of the grid (Yang & Gobbert 2009), which the thesis takes.
fn best(scale: i32) -> f64 {
    let nodes = f64::from(2 * HALF[0] * scale + 1);
    2.0 / (1.0 + libm::sin(PI / (nodes + 1.0)))
}

/// Nodes to match.
struct Set<'a> {
    ctx: &'a Context,
    name: &'a str,
    nodes: &'a [Node],
}

impl Set<'_> {
    fn matched(&self, matching: &Matching) -> Matched {
        self.ctx.phase("match", || match_topology(self.ctx, self.nodes, matching)).expect("a matching")
    }

    /// What no more iterations change.
    fn exact(&self, matching: &Matching) -> Matched {
        self.matched(&Matching { solver: Solver::Gradients, tolerance: EXACT, ..*matching })
    }

    /// Solves in one way to each tolerance.
    fn row(&self, exact: &Matched, way: &str, matching: Matching) {
        let [rough, fine] = TOLERANCES.map(|(tolerance, times)| {
            let matching = Matching { tolerance, ..matching };
            let solve = || {
                let start = Instant::now();
                let out = self.matched(&matching);
                (1e3 * start.elapsed().as_secs_f64(), out)
            };
            let (first, out) = solve();
            let took = median(std::iter::once(first).chain((1..times).map(|_| solve().0)).collect());
            let both = self.nodes.iter().zip(out.gamma.iter().zip(&exact.gamma));
            let flagged = both.filter(|(node, _)| node.is_flagged);
            let off = flagged.fold(0.0f32, |most, (_, (gamma, exact))| most.max((gamma - exact).abs()));
            format!("{}, {took:.1}, {off:.1e}", out.iterations)
        });
        println!("| {} | {way} | {rough} | {fine} |", self.name);
    }
}
