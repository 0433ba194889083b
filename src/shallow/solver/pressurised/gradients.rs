//! The heads of full columns by conjugate gradients with a diagonal preconditioner; sums do not depend on their order.
//!
//! Each iteration reads and writes all nodes several times: so their numbers are kept in separate arrays, and neighbours are found without
//! the pipes.

use super::edges::{At, Edge};
use super::nodes::{GIVE, LINK_SCALE, Node, scaled};
use crate::numeric::lists::{refill, reset};
use crate::shallow::columns::NONE;
use crate::shallow::solver::stop::Stop;

/// Maximum iterations for the heads of a step.
const ITERATIONS: usize = 500;
/// Tolerance (units) of a column's head, if those around it were exact.
const RESIDUAL: f64 = 0.005;
/// Numbers that are summed in parallel.
const LANES: usize = 8;

/// The linear system of a step, and the vectors of the iteration.
#[derive(Debug, Clone, Default)]
pub(in crate::shallow::solver) struct Gradients {
    /// Nodes to the east, west, south and north of each, and the conductance of the pipes to them; where there is none, the index behind
    /// the last node.
    beside: Vec<[u32; 4]>,
    through: Vec<[f64; 4]>,
    links: Vec<Link>,
    /// Sum over the links of each node, in 1/65536 unit; empty without links.
    linked: Vec<i64>,
    /// 1 where a node is in the system, else 0.
    held: Vec<f64>,
    diagonal: Vec<f64>,
    over: Vec<f64>,
    residual: Vec<f64>,
    /// One for each node, and a 0 behind the last.
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
    /// With capacity for so many nodes.
    pub fn with_room(room: usize) -> Self {
        let numbers = || Vec::with_capacity(room + 1);
        Self {
            beside: Vec::with_capacity(room),
            through: Vec::with_capacity(room),
            links: Vec::with_capacity(room),
            linked: Vec::with_capacity(room),
            held: numbers(),
            diagonal: numbers(),
            over: numbers(),
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
        self.beside.clear();
        self.through.clear();
        for node_edges in nodes.iter().map(|node| node.edges) {
            let mut beside = [count as u32; 4];
            let mut through = [0.0; 4];
            for (side, edge) in node_edges.into_iter().enumerate().filter(|(_, edge)| *edge != NONE) {
                let edge = &edges[edge as usize];
                // The node is the first end of its pipes to the east and to the south.
                beside[side] = node(edge.ends[1 - side % 2]);
                through[side] = edge.conductance;
            }
            self.beside.push(beside);
            self.through.push(through);
        }
        let links = edges.iter().filter(|edge| matches!(edge.at, At::Link(_)));
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
        let mut rest = self.by_diagonal();
        for _ in 0..ITERATIONS {
            if self.is_done() || stop.is_asked() {
                break;
            }
            self.apply();
            let along = self.along();
            if along <= 0.0 || rest <= 0.0 {
                break;
            }
            self.go(rest / along);
            let next = self.by_diagonal();
            self.turn(next / rest);
            rest = next;
        }
        for (node, over) in nodes.iter_mut().zip(&self.over) {
            node.over = *over;
        }
    }

    /// Starts from the present heads of the nodes.
    fn begin(&mut self, nodes: &mut [Node]) {
        let count = nodes.len();
        let number = |held: bool| if held { 1.0 } else { 0.0 };
        type Value = fn(&Node) -> f64;
        let lists: [(&mut Vec<f64>, Value); 4] = [
            (&mut self.diagonal, |node| node.diagonal),
            (&mut self.over, |node| node.over),
            (&mut self.residual, |node| node.right),
            (&mut self.direction, |node| if node.is_held { node.over } else { 0.0 }),
        ];
        for (list, number) in lists {
            refill(list, nodes.iter().map(number));
        }
        self.direction.push(0.0);
        reset(&mut self.held, count, 1.0);
        self.product.resize(count, 0.0);
        self.apply();
        for (at, node) in nodes.iter_mut().enumerate() {
            node.is_held &= node.diagonal > 0.0;
            let residual = if node.is_held { node.right - self.product[at] } else { 0.0 };
            self.residual[at] = residual;
            self.direction[at] = if node.is_held { residual / node.diagonal } else { 0.0 };
            self.held[at] = number(node.is_held);
        }
    }

    /// Whether all residuals are within the tolerance.
    fn is_done(&self) -> bool {
        // Link sums are no more precise than this.
        const LEAST: f64 = 4.0 / LINK_SCALE;
        let is_near = |(residual, diagonal): (&f64, &f64)| residual.abs() <= (RESIDUAL * diagonal).max(LEAST);
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
        let Self { beside, through, direction, diagonal, held, product, .. } = self;
        let nodes = beside.iter().zip(through).zip(&direction[..]).zip(diagonal).zip(held).zip(product);
        for (((((beside, through), own), diagonal), held), product) in nodes {
            let [east, west, south, north] = beside.map(|node| direction[node as usize]);
            let east_west = through[0] * (own - east) - through[1] * (west - own);
            let south_north = through[2] * (own - south) - through[3] * (north - own);
            let all = (east_west + south_north) + GIVE * *diagonal * own;
            *product = if *held > 0.0 { all } else { 0.0 };
        }
        if !self.linked.is_empty() {
            self.apply_links();
        }
    }

    /// As [`Gradients::apply`], at nodes with links, in the same order.
    fn apply_links(&mut self) {
        for at in (0..self.product.len()).filter(|&at| self.linked[at] != 0 && self.held[at] > 0.0) {
            let (beside, through, own) = (self.beside[at], self.through[at], self.direction[at]);
            let [east, west, south, north] = beside.map(|node| self.direction[node as usize]);
            let east_west = through[0] * (own - east) - through[1] * (west - own);
            let south_north = through[2] * (own - south) - through[3] * (north - own);
            let out = (east_west + south_north) + self.linked[at] as f64 / LINK_SCALE;
            self.product[at] = out + GIVE * self.diagonal[at] * own;
        }
    }

    /// Advances along the search direction.
    fn go(&mut self, step: f64) {
        let Self { over, residual, direction, product, held, .. } = self;
        let nodes = over.iter_mut().zip(residual).zip(&direction[..]).zip(product).zip(held);
        for ((((over, residual), direction), product), held) in nodes {
            let is_held = *held > 0.0;
            *over = if is_held { *over + step * direction } else { *over };
            *residual = if is_held { *residual - step * *product } else { *residual };
        }
    }

    /// Updates the search direction.
    fn turn(&mut self, part: f64) {
        let Self { residual, direction, diagonal, held, .. } = self;
        for (((direction, residual), diagonal), held) in
            direction.iter_mut().zip(residual).zip(diagonal).zip(held)
        {
            *direction = if *held > 0.0 { *residual / *diagonal + part * *direction } else { *direction };
        }
    }

    fn along(&mut self) -> f64 {
        let Self { addends, direction, product, .. } = self;
        refill(addends, direction.iter().zip(product).map(|(direction, product)| direction * *product));
        fixed_sum(addends)
    }

    fn by_diagonal(&mut self) -> f64 {
        let Self { addends, residual, diagonal, held, .. } = self;
        let nodes = residual.iter().zip(&*diagonal).zip(&*held);
        let part = |((residual, diagonal), held): ((&f64, &f64), &f64)| {
            if *held > 0.0 { residual * residual / diagonal } else { 0.0 }
        };
        refill(addends, nodes.map(part));
        fixed_sum(addends)
    }
}

/// A sum that does not depend on its order: terms are truncated to 2^-40 of the power of two below the largest.
fn fixed_sum(numbers: &[f64]) -> f64 {
    let (chunks, rest) = numbers.as_chunks::<LANES>();
    let mut most = [0.0; LANES];
    let larger = |most: f64, number: f64| if number.abs() > most { number.abs() } else { most };
    for chunk in chunks {
        for lane in 0..LANES {
            most[lane] = larger(most[lane], chunk[lane]);
        }
    }
    let greatest = rest.iter().chain(&most).fold(0.0, |most, number| larger(most, *number));
    if greatest == 0.0 || !greatest.is_finite() {
        return greatest;
    }
    let exponent = (greatest.to_bits() >> 52) as i64 - 1023;
    let power = |exponent: i64| f64::from_bits(((1023 + exponent.clamp(-1022, 1023)) as u64) << 52);
    let scale = power(40 - exponent);
    numbers.iter().map(|number| (number * scale) as i64).sum::<i64>() as f64 / scale
}
