//! Gates of topology matching: near the flags it finds what it finds on the whole grid.

use frazil::geometry::DVec3;
use frazil::surface::{Matching, Node, Solver, match_topology};

use crate::common::liquids::context;

/// How far the grid of two balls reaches from the origin on each axis (cells).
pub const HALF: [i32; 3] = [26, 18, 18];
/// How far from flagged nodes a tracker's Gamma may change (cells).
pub const REACH: i32 = 8;
/// Change of psi at which a solution ends (cells): its residual is then less than [`SOLVED`].
const TOLERANCE: f64 = 1e-8;
const SOLVED: f64 = 1e-6;
/// By how much Gamma may differ at flagged nodes (cells).
const APART: f32 = 0.1;

pub fn measure() -> [(f64, String); 2] {
    let ctx = context(2);
    let (mut is_same, mut far, mut residual, mut worst) = (true, 0.0f32, 0.0f64, 0.0f64);
    for (shift, solver) in [(0.0, Solver::Sor), (1.0, Solver::Gradients)] {
        let nodes = balls(1, shift);
        let [near, whole] = [REACH, i32::MAX].map(|reach| {
            let matching =
                Matching { solver, tolerance: TOLERANCE, reach, max_iterations: 5000, omega: None };
            match_topology(&ctx, &nodes, &matching).expect("a matching")
        });
        residual = residual.max(near.residual).max(whole.residual);
        // What has grown at flagged nodes: near the flags, and on the whole grid (cubic cells).
        let mut neck = [0.0; 2];
        for ((node, near), whole) in nodes.iter().zip(&near.gamma).zip(&whole.gamma) {
            is_same &= (*near < 0.0) == (*whole < 0.0);
            if node.is_flagged {
                far = far.max((near - whole).abs());
                neck[0] += share(*near) - share(node.gamma);
                neck[1] += share(*whole) - share(node.gamma);
            }
        }
        worst = worst.max(100.0 * (neck[0] / neck[1] - 1.0).abs());
    }
    let note = format!("at flagged nodes {far:.4} cells apart at most; residual {residual:.1e} cells");
    let is_near = is_same && far <= APART && residual <= SOLVED;
    [(f64::from(is_near), note.clone()), (worst, note)]
}

/// How much of the cube around a node is inside, about.
fn share(gamma: f32) -> f64 {
    f64::from(0.5 - gamma).clamp(0.0, 1.0)
}

/// Nodes around two balls with a radius of 8 and 1.5 between them, on cells `scale` times smaller. For phi they lie `shift` farther along
/// y, and a neck has grown between them; flagged within 7 of the gap.
pub fn balls(scale: i32, shift: f64) -> Vec<Node> {
    let cell = 1.0 / f64::from(scale);
    let node = |position: [i32; 3]| {
        let at = DVec3::from(position.map(f64::from)) * cell;
        let ball = |side: f64, shift: f64| (at - DVec3::new(side * 8.75, shift, 0.0)).norm() - 8.0;
        let (a, b) = (ball(-1.0, shift), ball(1.0, shift));
        // Smooth minimum.
        let near = (6.0 - (a - b).abs()).max(0.0) / 6.0;
        let phi = (a.min(b) - near * near * 1.5) / cell;
        let gamma = ball(-1.0, 0.0).min(ball(1.0, 0.0)) / cell;
        let is_flagged = at.norm() <= 7.0;
        Node { position, gamma: gamma.clamp(-4.0, 4.0) as f32, phi: phi.clamp(-5.0, 5.0) as f32, is_flagged }
    };
    let on = |axis: usize| -HALF[axis] * scale..=HALF[axis] * scale;
    on(0).flat_map(|x| on(1).flat_map(move |y| on(2).map(move |z| [x, y, z]))).map(node).collect()
}
