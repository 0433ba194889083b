//! The heads of full columns by conjugate gradients with a diagonal preconditioner; sums do not depend on their order.
//!
//! Each iteration reads and writes all nodes several times: so their numbers are kept in separate arrays, and neighbours are found without
//! the pipes.

use super::edges::{Edge, PipeIndex};
use super::nodes::{LINK_SCALE, Node, REGULARISATION, scaled};
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::NONE;
use crate::shallow::solver::stop::Stop;

/// Maximum iterations for the heads of a step.
const MAX_ITERATIONS: usize = 500;
/// Tolerance (units) of a column's head, if those around it were exact.
const RESIDUAL: f64 = 0.005;
/// Numbers that are summed in parallel.
const LANES: usize = 8;

/// The linear system of a step, and the vectors of the iteration.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow::solver) struct Gradients {
    /// Nodes to the east, west, south and north of each, and the conductance of the pipes to them; where there is none, the index after the
    /// last node.
    neighbours: Vec<[u32; 4]>,
    conductances: Vec<[f64; 4]>,
    links: Vec<Link>,
    /// Sum over the links of each node, in 1/65536 unit; empty without links.
    linked: Vec<i64>,
    /// 1 where a node is in the system, else 0.
    in_system: Vec<f64>,
    diagonal: Vec<f64>,
    excess_heads: Vec<f64>,
    residual: Vec<f64>,
    /// One for each node, and a 0 after the last.
    direction: Vec<f64>,
    product: Vec<f64>,
    /// Terms of a sum.
    addends: Vec<f64>,
}

/// A link: a pipe that is not between adjacent columns of a layer.
#[derive(Debug, Clone, Copy)]
struct Link {
    ends: [u32; 2],
    conductance: f64,
}

impl Gradients {
    /// With capacity for `room` nodes.
    pub fn with_room(room: usize) -> Self {
        let numbers = || Vec::with_capacity(room + 1);
        Self {
            neighbours: Vec::with_capacity(room),
            conductances: Vec::with_capacity(room),
            links: Vec::with_capacity(room),
            linked: Vec::with_capacity(room),
            in_system: numbers(),
            diagonal: numbers(),
            excess_heads: numbers(),
            residual: numbers(),
            direction: numbers(),
            product: numbers(),
            addends: numbers(),
        }
    }

    /// Sets the nodes' connections from the pipes.
    pub fn set(&mut self, nodes: &[Node], edges: &[Edge]) {
        let count = nodes.len();
        let node = |end: u32| end.min(count as u32);
        self.neighbours.clear();
        self.conductances.clear();
        for node_edges in nodes.iter().map(|node| node.edges) {
            let mut neighbours = [count as u32; 4];
            let mut conductances = [0.0; 4];
            for (side, edge) in node_edges.into_iter().enumerate().filter(|(_, edge)| *edge != NONE) {
                let edge = &edges[edge as usize];
                // The node is the first end of its pipes to the east and to the south.
                neighbours[side] = node(edge.ends[1 - side % 2]);
                conductances[side] = edge.conductance;
            }
            self.neighbours.push(neighbours);
            self.conductances.push(conductances);
        }
        let links = edges.iter().filter(|edge| matches!(edge.at, PipeIndex::Link(_)));
        refill(
            &mut self.links,
            links.map(|edge| Link { ends: edge.ends.map(node), conductance: edge.conductance }),
        );
        reset(&mut self.linked, if self.links.is_empty() { 0 } else { count + 1 }, 0);
    }

    /// Solves for the heads above the surface of the nodes in the system, starting from their present ones. If stopped, the result is
    /// meaningless.
    pub fn solve(&mut self, nodes: &mut [Node], stop: &Stop) {
        self.begin(nodes);
        let mut norm = self.preconditioned_norm();
        for _ in 0..MAX_ITERATIONS {
            if self.is_done() || stop.is_requested() {
                break;
            }
            self.apply();
            let curvature = self.curvature();
            if curvature <= 0.0 || norm <= 0.0 {
                break;
            }
            self.advance(norm / curvature);
            let next = self.preconditioned_norm();
            self.update_direction(next / norm);
            norm = next;
        }
        for (node, excess) in nodes.iter_mut().zip(&self.excess_heads) {
            node.excess_head = *excess;
        }
    }

    /// Starts from the present heads of the nodes.
    fn begin(&mut self, nodes: &mut [Node]) {
        let count = nodes.len();
        let number = |is_in_system: bool| if is_in_system { 1.0 } else { 0.0 };
        type Value = fn(&Node) -> f64;
        let lists: [(&mut Vec<f64>, Value); 4] = [
            (&mut self.diagonal, |node| node.diagonal),
            (&mut self.excess_heads, |node| node.excess_head),
            (&mut self.residual, |node| node.right),
            (&mut self.direction, |node| if node.is_in_system { node.excess_head } else { 0.0 }),
        ];
        for (list, number) in lists {
            refill(list, nodes.iter().map(number));
        }
        self.direction.push(0.0);
        reset(&mut self.in_system, count, 1.0);
        self.product.resize(count, 0.0);
        self.apply();
        for (at, node) in nodes.iter_mut().enumerate() {
            node.is_in_system &= node.diagonal > 0.0;
            let residual = if node.is_in_system { node.right - self.product[at] } else { 0.0 };
            self.residual[at] = residual;
            self.direction[at] = if node.is_in_system { residual / node.diagonal } else { 0.0 };
            self.in_system[at] = number(node.is_in_system);
        }
    }

    /// Whether all residuals are within the tolerance.
    fn is_done(&self) -> bool {
        // Link sums are no more precise than this.
        const MIN_RESIDUAL: f64 = 4.0 / LINK_SCALE;
        let is_near =
            |(residual, diagonal): (&f64, &f64)| residual.abs() <= (RESIDUAL * diagonal).max(MIN_RESIDUAL);
        self.residual.iter().zip(&self.diagonal).all(is_near)
    }

    /// Multiplies the system's matrix by the search direction.
    fn apply(&mut self) {
        if !self.links.is_empty() {
            self.linked.fill(0);
            for link in &self.links {
                let [from, to] = link.ends.map(|end| end as usize);
                let flow = scaled(link.conductance * (self.direction[from] - self.direction[to]));
                self.linked[from] += flow;
                self.linked[to] -= flow;
            }
        }
        let Self { neighbours, conductances, direction, diagonal, in_system, product, .. } = self;
        let nodes =
            neighbours.iter().zip(conductances).zip(&direction[..]).zip(diagonal).zip(in_system).zip(product);
        for (((((neighbours, conductances), own), diagonal), in_system), product) in nodes {
            let [east, west, south, north] = neighbours.map(|node| direction[node as usize]);
            let east_west = conductances[0] * (own - east) - conductances[1] * (west - own);
            let south_north = conductances[2] * (own - south) - conductances[3] * (north - own);
            let all = (east_west + south_north) + REGULARISATION * *diagonal * own;
            *product = if *in_system > 0.0 { all } else { 0.0 };
        }
        if !self.linked.is_empty() {
            self.apply_links();
        }
    }

    /// As [`Gradients::apply`], at nodes with links, in the same order.
    fn apply_links(&mut self) {
        for at in (0..self.product.len()).filter(|&at| self.linked[at] != 0 && self.in_system[at] > 0.0) {
            let (neighbours, conductances, own) =
                (self.neighbours[at], self.conductances[at], self.direction[at]);
            let [east, west, south, north] = neighbours.map(|node| self.direction[node as usize]);
            let east_west = conductances[0] * (own - east) - conductances[1] * (west - own);
            let south_north = conductances[2] * (own - south) - conductances[3] * (north - own);
            let out = (east_west + south_north) + self.linked[at] as f64 / LINK_SCALE;
            self.product[at] = out + REGULARISATION * self.diagonal[at] * own;
        }
    }

    /// Advances along the search direction.
    fn advance(&mut self, step: f64) {
        let Self { excess_heads, residual, direction, product, in_system, .. } = self;
        let nodes = excess_heads.iter_mut().zip(residual).zip(&direction[..]).zip(product).zip(in_system);
        for ((((head, residual), direction), product), in_system) in nodes {
            let is_in_system = *in_system > 0.0;
            *head = if is_in_system { *head + step * direction } else { *head };
            *residual = if is_in_system { *residual - step * *product } else { *residual };
        }
    }

    /// Updates the search direction.
    fn update_direction(&mut self, part: f64) {
        let Self { residual, direction, diagonal, in_system, .. } = self;
        for (((direction, residual), diagonal), in_system) in
            direction.iter_mut().zip(residual).zip(diagonal).zip(in_system)
        {
            *direction =
                if *in_system > 0.0 { *residual / *diagonal + part * *direction } else { *direction };
        }
    }

    /// Dot product of the search direction and the matrix applied to it.
    fn curvature(&mut self) -> f64 {
        let Self { addends, direction, product, .. } = self;
        refill(addends, direction.iter().zip(product).map(|(direction, product)| direction * *product));
        fixed_sum(addends)
    }

    /// Squared norm of the residual, preconditioned.
    fn preconditioned_norm(&mut self) -> f64 {
        let Self { addends, residual, diagonal, in_system, .. } = self;
        let nodes = residual.iter().zip(&*diagonal).zip(&*in_system);
        let part = |((residual, diagonal), in_system): ((&f64, &f64), &f64)| {
            if *in_system > 0.0 { residual * residual / diagonal } else { 0.0 }
        };
        refill(addends, nodes.map(part));
        fixed_sum(addends)
    }
}

/// A sum that does not depend on its order: terms are truncated to 2^-40 of the power of two below the largest.
fn fixed_sum(numbers: &[f64]) -> f64 {
    let (chunks, rest) = numbers.as_chunks::<LANES>();
    let mut largest = [0.0; LANES];
    let larger = |largest: f64, number: f64| if number.abs() > largest { number.abs() } else { largest };
    for chunk in chunks {
        for lane in 0..LANES {
            largest[lane] = larger(largest[lane], chunk[lane]);
        }
    }
    let greatest = rest.iter().chain(&largest).fold(0.0, |largest, number| larger(largest, *number));
    if greatest == 0.0 || !greatest.is_finite() {
        return greatest;
    }
    let exponent = (greatest.to_bits() >> 52) as i64 - 1023;
    let power = |exponent: i64| f64::from_bits(((1023 + exponent.clamp(-1022, 1023)) as u64) << 52);
    let scale = power(40 - exponent);
    numbers.iter().map(|number| (number * scale) as i64).sum::<i64>() as f64 / scale
}
