//! The linear system for the heads of full columns, which [`super::gradients`] solves.

use super::edges::{Edge, PipeIndex};
use super::network::Network;
use super::nodes::{LINK_SCALE, REGULARISATION, scaled};
use crate::shallow::columns::{Columns, NONE};
use crate::shallow::solver::stop::Stop;

/// Part of a full column's missing liquid that is to flow in during a step.
const REFILL: f64 = 0.5;

/// Maximum rounds in which columns with a head below their surface are removed from the system.
const MAX_RELEASES: usize = 3;

impl Network {
    /// Finds the heads of full columns with which inflow and outflow of each are equal.
    pub(in crate::shallow::solver) fn find_heads(&mut self, columns: &Columns, stop: &Stop) {
        self.gradients.set(&self.nodes, &self.edges);
        for _ in 0..=MAX_RELEASES {
            self.set_up(columns);
            self.gradients.solve(&mut self.nodes, stop);
            let mut released = false;
            for node in self.nodes.iter_mut().filter(|node| node.is_in_system && node.excess_head < 0.0) {
                (node.is_in_system, node.excess_head) = (false, 0.0);
                released = true;
            }
            if !released {
                break;
            }
        }
        for (node, party) in self.nodes.iter().zip(&self.parties) {
            self.excess_heads[party.column as usize] = node.excess_head as f32;
        }
    }

    /// The surface at an end of a pipe (units).
    pub(in crate::shallow::solver) fn surface(&self, columns: &Columns, edge: &Edge, end: usize) -> f64 {
        match edge.ends[end] {
            NONE => edge.outside,
            party => {
                let party = &self.parties[party as usize];
                (i64::from(columns.bases()[party.column as usize]) + party.has) as f64
            }
        }
    }

    /// Sets the right side of the system (the inflow required, less the inflow without heads above the surface) and its diagonal.
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
        // The same sums, of conductances: both ends count as outflow.
        let links = self.edges.iter().filter(|edge| matches!(edge.at, PipeIndex::Link(_)));
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
                ((east + west) + (south + north) + node.linked as f64 / LINK_SCALE) * (1.0 + REGULARISATION);
        }
    }

    /// Adds the flow through links to their nodes.
    fn sum_links(&mut self, flow: impl Fn(&Edge) -> f64) {
        self.nodes.iter_mut().for_each(|node| node.linked = 0);
        for edge in self.edges.iter().filter(|edge| matches!(edge.at, PipeIndex::Link(_))) {
            let flow = scaled(flow(edge));
            for (end, flow) in edge.ends.into_iter().zip([flow, -flow]) {
                if let Some(node) = self.nodes.get_mut(end as usize) {
                    node.linked += flow;
                }
            }
        }
    }

    /// The outflow of a node, including its summed links.
    fn out(&self, node: usize, flow: impl Fn(&Edge) -> f64) -> f64 {
        let node = &self.nodes[node];
        let through = |edge: u32| if edge == NONE { 0.0 } else { flow(&self.edges[edge as usize]) };
        let [east, west, south, north] = node.edges.map(through);
        (east - west) + (south - north) + node.linked as f64 / LINK_SCALE
    }
}
