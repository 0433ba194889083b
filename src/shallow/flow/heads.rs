//! The heads of full columns: conjugate gradients, each node by its diagonal, with sums that do not depend on their order.

use super::network::{At, Edge, Network};
use crate::shallow::columns::{Columns, NONE};

/// What is missing of a full column, and comes in a step.
const REFILL: f64 = 0.5;
/// Most iterations for the heads of a step.
const ITERATIONS: usize = 500;
/// Units by which a column's head may be off, if those around it were right.
const RESIDUAL: f64 = 0.005;
/// Heads closer than this (units) are equal, as surfaces are that do not differ by a unit: liquid at rest stays at rest.
pub(super) const EQUAL: f64 = 0.5;
/// What a head over the surface takes up, as part of the conductance: so little that a closed cavity has a solution.
const GIVE: f64 = 1e-12;
/// Rounds in which columns below their surface leave the system.
const RELEASES: usize = 3;
/// Parts of a unit in which flows through links are summed.
const LINK_SCALE: f64 = 65536.0;

/// A full column in the system of heads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Its pipes to the east, west, south and north, or [`NONE`].
    pub edges: [u32; 4],
    /// Whether it is in the system: else it has left it.
    pub is_held: bool,
    /// Head over its surface (units).
    pub over: f64,
    pub right: f64,
    pub residual: f64,
    pub direction: f64,
    pub product: f64,
    pub diagonal: f64,
    /// Sum over links, in 1/65536 unit.
    pub linked: i64,
}

impl Node {
    /// A node with the head over its surface of the last step.
    pub fn new(over: f64) -> Self {
        Self {
            edges: [NONE; 4],
            is_held: true,
            over,
            right: 0.0,
            residual: 0.0,
            direction: 0.0,
            product: 0.0,
            diagonal: 0.0,
            linked: 0,
        }
    }
}

impl Network {
    /// Finds the heads of full columns with which as much flows out of each as flows in.
    pub(super) fn find_heads(&mut self, columns: &Columns) {
        for _ in 0..=RELEASES {
            self.set_up(columns);
            self.solve();
            let mut released = false;
            for node in self.nodes.iter_mut().filter(|node| node.is_held && node.over < 0.0) {
                (node.is_held, node.over) = (false, 0.0);
                released = true;
            }
            if !released {
                break;
            }
        }
        for (node, party) in self.nodes.iter().zip(&self.parties) {
            self.over[party.column as usize] = node.over as f32;
        }
    }

    /// The surface at an end of a pipe (units).
    pub(super) fn surface(&self, columns: &Columns, edge: &Edge, end: usize) -> f64 {
        match edge.ends[end] {
            NONE => edge.outside,
            party => {
                let party = &self.parties[party as usize];
                (i64::from(columns.bases()[party.column as usize]) + party.has) as f64
            }
        }
    }

    /// The right side of the system: what is to come in, less what would without heads over the surface; and its diagonal.
    fn set_up(&mut self, columns: &Columns) {
        for at in 0..self.edges.len() {
            let edge = self.edges[at];
            let fall = self.surface(columns, &edge, 0) - self.surface(columns, &edge, 1);
            self.edges[at].flux = edge.kept + edge.conductance * fall;
        }
        self.sum_links(|edge| edge.flux);
        for node in 0..self.nodes.len() {
            let out = self.out(node, |edge| edge.flux);
            let missing = REFILL * self.parties[node].room as f64;
            self.nodes[node].right = -missing - out;
        }
        // The same sums of conductances: all count as out.
        let links = self.edges.iter().filter(|edge| matches!(edge.at, At::Link(_)));
        self.nodes.iter_mut().for_each(|node| node.linked = 0);
        for edge in links {
            for end in edge.ends {
                if let Some(node) = self.nodes.get_mut(end as usize) {
                    node.linked += scaled(edge.conductance);
                }
            }
        }
        for node in &mut self.nodes {
            let conductance =
                |edge: u32| if edge == NONE { 0.0 } else { self.edges[edge as usize].conductance };
            let [east, west, south, north] = node.edges.map(conductance);
            node.diagonal =
                ((east + west) + (south + north) + node.linked as f64 / LINK_SCALE) * (1.0 + GIVE);
        }
    }

    /// Adds what flows through links to their nodes.
    fn sum_links(&mut self, flow: impl Fn(&Edge) -> f64) {
        self.nodes.iter_mut().for_each(|node| node.linked = 0);
        for edge in self.edges.iter().filter(|edge| matches!(edge.at, At::Link(_))) {
            let flow = scaled(flow(edge));
            for (end, flow) in edge.ends.into_iter().zip([flow, -flow]) {
                if let Some(node) = self.nodes.get_mut(end as usize) {
                    node.linked += flow;
                }
            }
        }
    }

    /// What flows out of a node, with its links as they were summed.
    fn out(&self, node: usize, flow: impl Fn(&Edge) -> f64) -> f64 {
        let node = &self.nodes[node];
        let through = |edge: u32| if edge == NONE { 0.0 } else { flow(&self.edges[edge as usize]) };
        let [east, west, south, north] = node.edges.map(through);
        (east - west) + (south - north) + node.linked as f64 / LINK_SCALE
    }

    /// Applies the system to directions.
    fn apply(&mut self) {
        for at in 0..self.edges.len() {
            let edge = self.edges[at];
            let direction = |end: u32| {
                self.nodes.get(end as usize).filter(|node| node.is_held).map_or(0.0, |node| node.direction)
            };
            self.edges[at].flux = edge.conductance * (direction(edge.ends[0]) - direction(edge.ends[1]));
        }
        self.sum_links(|edge| edge.flux);
        for node in 0..self.nodes.len() {
            let out = self.out(node, |edge| edge.flux);
            let node = &mut self.nodes[node];
            node.product = out + GIVE * node.diagonal * node.direction;
        }
    }

    /// Conjugate gradients, from the heads of the last step, each node by its diagonal.
    fn solve(&mut self) {
        self.nodes.iter_mut().for_each(|node| node.direction = node.over);
        self.apply();
        for node in &mut self.nodes {
            node.is_held &= node.diagonal > 0.0;
            node.residual = if node.is_held { node.right - node.product } else { 0.0 };
            node.direction = if node.is_held { node.residual / node.diagonal } else { 0.0 };
        }
        let held = |network: &Self, number: fn(&Node) -> f64| {
            fixed_sum(network.nodes.iter().filter(|node| node.is_held).map(number))
        };
        let by_diagonal: fn(&Node) -> f64 = |node| node.residual * node.residual / node.diagonal;
        let mut rest = held(self, by_diagonal);
        for _ in 0..ITERATIONS {
            // Links are not summed any closer.
            let least = 4.0 / LINK_SCALE;
            if self.nodes.iter().all(|node| node.residual.abs() <= (RESIDUAL * node.diagonal).max(least)) {
                break;
            }
            self.apply();
            let along = held(self, |node| node.direction * node.product);
            if along <= 0.0 || rest <= 0.0 {
                break;
            }
            let step = rest / along;
            for node in self.nodes.iter_mut().filter(|node| node.is_held) {
                node.over += step * node.direction;
                node.residual -= step * node.product;
            }
            let next = held(self, by_diagonal);
            for node in self.nodes.iter_mut().filter(|node| node.is_held) {
                node.direction = node.residual / node.diagonal + next / rest * node.direction;
            }
            rest = next;
        }
    }
}

/// A sum that does not depend on its order: addends are cut to 2^-40 of the power of two below the greatest.
fn fixed_sum(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let greatest = numbers.clone().fold(0.0, |greatest, number| f64::max(greatest, number.abs()));
    if greatest == 0.0 || !greatest.is_finite() {
        return greatest;
    }
    let exponent = (greatest.to_bits() >> 52) as i64 - 1023;
    let power = |exponent: i64| f64::from_bits(((1023 + exponent.clamp(-1022, 1023)) as u64) << 52);
    let scale = power(40 - exponent);
    numbers.map(|number| (number * scale) as i64).sum::<i64>() as f64 / scale
}

/// A number of a link for a sum of such, whatever is asked for: their sums stay within 64 bits.
fn scaled(number: f64) -> i64 {
    (number * LINK_SCALE).clamp(-1e16, 1e16) as i64
}
