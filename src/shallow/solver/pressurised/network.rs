//! Flooded passages: columns that are full to their ceiling push with a head instead of a surface (the extended pipes of Dagenais et al.,
//! Computers & Graphics 76, 2018, which the thesis leaves out).
//!
//! Inflow and outflow of a full column are equal: the heads of a step follow from a linear system, solved by conjugate gradients whose sums
//! do not depend on their order. The pipes of full columns form the *network*. Its transfers are found before all other fluxes, and stored
//! after them: all use the same surface, or waves would grow. A head below the surface would be suction: such a column acts as a free one.

use std::ops::Range;

use super::edges::{Edge, PipeIndex};
use super::gradients::Gradients;
use super::nodes::{HEAD_TOLERANCE, Node, section};
use crate::shallow::columns::per_column::{Array, PerColumn};
use crate::shallow::columns::{Columns, NONE, STRIP, strip_mut, strip_of};
use crate::shallow::pipes::Pipes;
use crate::shallow::pipes::cliffs::index_beyond;
use crate::shallow::pipes::side::Side;
use crate::shallow::solver::full::full_of;
use crate::shallow::solver::lateral_friction::LateralFriction;
use crate::shallow::solver::link_flow::LinkFlow;
use crate::shallow::solver::overflow_edges::{Fall, OverflowEdges};
use crate::shallow::solver::rows::filling::Filling;
use crate::shallow::solver::stop::Stop;
use crate::shallow::solver::transfers::limiter::{self, Party};
use crate::shallow::solver::viscous_flux::Step;

/// Columns of a network for which capacity is reserved from the beginning.
const ROOM: usize = 1024;

/// The network of a step.
#[derive(Debug, Clone)]
pub struct Network {
    /// Full columns first, then those at the other ends of their pipes.
    pub(in crate::shallow::solver) parties: Vec<Party>,
    pub(in crate::shallow::solver) nodes: Vec<Node>,
    pub(in crate::shallow::solver) edges: Vec<Edge>,
    pub(in crate::shallow::solver) gradients: Gradients,
    /// Party of each column, or [`NONE`].
    party_of: Vec<u32>,
    /// Head above the surface of each column in the last step (units).
    pub(in crate::shallow::solver) excess_heads: PerColumn<f32>,
    /// Whether each row may have a column with a head.
    has_heads: Vec<bool>,
    /// Indices of the network's pipes to the east, to the south, and of its links, sorted.
    pipe_indices: [Vec<u32>; 3],
    /// Changes by the network: column and units, sorted by column.
    moves: Vec<(u32, i32)>,
}

/// What a network is built from.
pub struct State<'a> {
    /// The step.
    pub step: &'a Step,
    /// Columns.
    pub columns: &'a Columns,
    /// Pipes between them.
    pub pipes: &'a Pipes,
    /// H (units).
    pub depth: &'a [i32],
    /// Flux to the east and to the south (units per step).
    pub flux: [&'a [f32]; 2],
    /// Remainders of transfers, to the east and to the south (units).
    pub remainder: [&'a [f32]; 2],
    /// Flow through links.
    pub links: &'a LinkFlow,
    /// Overflow edges: links that liquid falls freely from.
    pub overflow_edges: &'a OverflowEdges,
    /// Lateral friction of pipes.
    pub friction: &'a LateralFriction,
}

impl Network {
    /// An empty network, for these counts of column indices and rows.
    pub fn new(columns: usize, rows: usize) -> Self {
        // A tool that dips in floods some hundred columns: frames must not allocate for them.
        let room = columns.min(ROOM);
        Self {
            parties: Vec::with_capacity(room),
            nodes: Vec::with_capacity(room),
            edges: Vec::with_capacity(2 * room),
            gradients: Gradients::with_room(room),
            pipe_indices: [(); 3].map(|()| Vec::with_capacity(room)),
            moves: Vec::with_capacity(room),
            party_of: vec![NONE; columns],
            excess_heads: PerColumn::new(Array::Head, columns, 0.0),
            has_heads: vec![false; rows],
        }
    }

    /// Changes the count of indices of a part of the columns; their contents are then unspecified.
    pub(in crate::shallow::solver) fn resize_part(&mut self, part: Range<usize>, len: usize) {
        self.clear();
        self.has_heads.fill(true);
        self.excess_heads.resize_part(part, len, 0.0);
        self.party_of.resize(self.excess_heads.len(), NONE);
    }

    /// Heads above the surface (units) by column index: part of the state, as the next step's iteration starts from them.
    pub fn excess_heads_mut(&mut self) -> &mut [f32] {
        self.has_heads.fill(true);
        &mut self.excess_heads
    }

    /// As [`Network::excess_heads_mut`], read-only.
    pub fn excess_heads(&self) -> &[f32] {
        &self.excess_heads
    }

    /// Memory that does not depend on full columns (bytes).
    pub fn bytes(&self) -> usize {
        size_of_val(&self.party_of[..]) + self.excess_heads.bytes() + self.has_heads.len()
    }

    /// Clears the heads of dry columns.
    pub fn clear_heads(&mut self, columns: Range<usize>) {
        self.excess_heads[columns].fill(0.0);
    }

    /// Whether there is no full column.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Count of full columns.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The strips of its columns, and of the columns beside them.
    pub fn strips(&self) -> impl Iterator<Item = usize> {
        self.parties.iter().map(|party| party.column as usize / STRIP)
    }

    /// Finds the full columns of the rows that are filling and may have some, their heads, and the flow through their pipes.
    pub fn find(&mut self, filling: Filling, state: &State, stop: &Stop) {
        let columns = state.columns;
        self.clear();
        for row in (0..filling.may_fill.len()).filter(|&row| filling.may_fill[row]) {
            if filling.may_be_full[row] || self.has_heads[row] {
                self.find_full(columns, row, state.depth);
            }
        }
        if self.nodes.is_empty() {
            return;
        }
        self.connect(filling.may_fill, state);
        self.find_heads(columns, stop);
        self.find_fluxes(columns);
        limiter::limit(&mut self.parties, &mut self.edges, stop);
        if stop.is_requested() {
            return;
        }
        self.finish_transfers(columns);
    }

    fn clear(&mut self) {
        for party in self.parties.drain(..) {
            self.party_of[party.column as usize] = NONE;
        }
        self.nodes.clear();
        self.edges.clear();
        self.pipe_indices.iter_mut().for_each(Vec::clear);
        self.moves.clear();
    }

    /// Finds the full columns of a row; clears the heads of all others.
    fn find_full(&mut self, columns: &Columns, row: usize, depth: &[i32]) {
        let before = self.nodes.len();
        for strip in columns.row(row) {
            let numbers =
                [columns.bases(), columns.ceilings(), depth].map(|numbers| strip_of(numbers, strip));
            let is_full = full_of(numbers);
            let heads = strip_mut(&mut self.excess_heads, strip);
            if is_full == [0; STRIP] && heads.iter().fold(0, |any, head| any | head.to_bits()) == 0 {
                continue;
            }
            for (column, is_full) in (strip * STRIP..).zip(is_full) {
                if is_full == 0 {
                    self.excess_heads[column] = 0.0;
                } else {
                    self.add_party(columns, depth, column as u32);
                    self.nodes.push(Node::new(f64::from(self.excess_heads[column])));
                }
            }
        }
        self.has_heads[row] = self.nodes.len() > before;
    }

    fn add_party(&mut self, columns: &Columns, depth: &[i32], column: u32) -> u32 {
        let i = column as usize;
        if self.party_of[i] == NONE {
            self.party_of[i] = self.parties.len() as u32;
            let has = i64::from(depth[i]);
            let room = i64::from(columns.ceilings()[i] - columns.bases()[i] - depth[i]);
            self.parties.push(Party { column, has, room, gives: 0, takes: 0 });
        }
        self.party_of[i]
    }

    /// Collects the pipes of full columns.
    fn connect(&mut self, rows: &[bool], state: &State) {
        let pipes = state.pipes;
        for node in 0..self.nodes.len() {
            let i = self.parties[node].column as usize;
            let next = |side| index_beyond(state.columns, i, side);
            if pipes.east[i] > 0.0 {
                let edge = self.join(state, PipeIndex::East(i as u32), [i, i + 1], pipes.east[i]);
                self.set_edge(edge, node, 0, i + 1, 1);
            }
            if let Some(j) = next(Side::South).filter(|_| pipes.south[i] > 0.0) {
                let edge = self.join(state, PipeIndex::South(i as u32), [i, j], pipes.south[i]);
                self.set_edge(edge, node, 2, j, 3);
            }
            // A pipe between two full columns was already added by the other one.
            let is_node = |network: &Self, j: usize| (network.party_of[j] as usize) < network.nodes.len();
            if let Some(j) = next(Side::West).filter(|&j| pipes.east[j] > 0.0 && !is_node(self, j)) {
                let edge = self.join(state, PipeIndex::East(j as u32), [j, i], pipes.east[j]);
                self.nodes[node].edges[1] = edge;
            }
            if let Some(j) = next(Side::North).filter(|&j| pipes.south[j] > 0.0 && !is_node(self, j)) {
                let edge = self.join(state, PipeIndex::South(j as u32), [j, i], pipes.south[j]);
                self.nodes[node].edges[3] = edge;
            }
        }
        self.connect_links(rows, state);
        self.pipe_indices.iter_mut().for_each(|pipes| pipes.sort_unstable());
    }

    fn connect_links(&mut self, rows: &[bool], state: &State) {
        let links = &state.pipes.links;
        let count = self.nodes.len();
        for row in 0..rows.len() {
            if !rows[row] && !rows.get(row + 1).is_some_and(|next| *next) {
                continue;
            }
            for link in links.row(row) {
                let (from, to) = (links.from[link], links.to[link]);
                let at = PipeIndex::Link(link as u32);
                let is_node =
                    |column: u32| column != NONE && (self.party_of[column as usize] as usize) < count;
                let fall = state.overflow_edges.at(link);
                if fall != Fall::No {
                    let donor = if fall == Fall::Ahead { from } else { to };
                    if is_node(donor) {
                        let ends = [donor as usize, NONE as usize];
                        let edge = self.join(state, at, ends, links.open[link]);
                        self.edges[edge as usize].make_overflow_edge(state.columns, donor, fall);
                    }
                } else if is_node(from) || is_node(to) {
                    self.join(state, at, [from as usize, to as usize], links.open[link]);
                    if let (NONE, Some(edge)) = (to, self.edges.last_mut()) {
                        edge.outside =
                            f64::from(links.outside(state.columns, link, state.step.still_level).0);
                    }
                }
            }
        }
    }

    /// Adds a pipe; returns its index.
    fn join(&mut self, state: &State, at: PipeIndex, [i, j]: [usize; 2], open: f32) -> u32 {
        let State { step, columns, .. } = *state;
        let (flux, remainder, tilt) = match at {
            PipeIndex::East(at) => {
                self.pipe_indices[0].push(at);
                (state.flux[0][at as usize], state.remainder[0][at as usize], step.tilt[0])
            }
            PipeIndex::South(at) => {
                self.pipe_indices[1].push(at);
                (state.flux[1][at as usize], state.remainder[1][at as usize], step.tilt[1])
            }
            PipeIndex::Link(at) => {
                self.pipe_indices[2].push(at);
                (state.links.flux[at as usize], state.links.remainder[at as usize], 0)
            }
        };
        let outside = j == NONE as usize;
        let from = self.add_party(columns, state.depth, i as u32);
        let to = if outside { NONE } else { self.add_party(columns, state.depth, j as u32) };
        let height = section(columns, state.depth, i, (!outside).then_some(j), flux);
        let square = height * height;
        let thinned = f64::from(step.thinned(flux, square as f32));
        let is_full = |party: u32| (party as usize) < self.nodes.len();
        let friction = state.friction.of_pipe(state, at, [i, j], [from, to].map(is_full));
        let drag = f64::from(step.drag) * thinned * friction.ground;
        let lateral = square * thinned * friction.lateral;
        let damping = if square > 0.0 && open > 0.0 {
            square / (square + drag / f64::from(open) + lateral)
        } else {
            0.0
        };
        let conductance = damping * f64::from(step.drive) * height.min(f64::from(step.section));
        self.edges.push(Edge {
            at,
            ends: [from, to],
            kept: damping * (f64::from(step.kept * flux) + thinned * friction.dragged)
                + conductance * f64::from(tilt),
            conductance,
            outside: 0.0,
            flux: 0.0,
            remainder: f64::from(remainder),
            units: 0,
        });
        (self.edges.len() - 1) as u32
    }

    /// Sets a pipe as an edge of the nodes at both of its ends.
    fn set_edge(&mut self, edge: u32, node: usize, side: usize, other: usize, other_side: usize) {
        self.nodes[node].edges[side] = edge;
        let other = self.party_of[other] as usize;
        if let Some(node) = self.nodes.get_mut(other) {
            node.edges[other_side] = edge;
        }
    }

    /// Computes the fluxes for these heads.
    fn find_fluxes(&mut self, columns: &Columns) {
        for at in 0..self.edges.len() {
            let edge = self.edges[at];
            let head = |end: usize| {
                let excess = self.nodes.get(edge.ends[end] as usize).map_or(0.0, |node| node.excess_head);
                self.surface(columns, &edge, end) + excess
            };
            let fall = head(0) - head(1);
            let fall = if fall.abs() < HEAD_TOLERANCE { 0.0 } else { fall };
            let flux = edge.kept + edge.conductance * fall;
            let edge = &mut self.edges[at];
            (edge.flux, edge.units) = (flux, rounded(flux + edge.remainder));
        }
    }

    /// Finds the remainders of the network's pipes and the changes of its columns, from the limited transfers.
    fn finish_transfers(&mut self, columns: &Columns) {
        for edge in &mut self.edges {
            let asked = rounded(edge.flux + edge.remainder);
            if asked == edge.units {
                edge.remainder += edge.flux - asked as f64;
            } else {
                edge.flux *= edge.units as f64 / asked as f64;
                edge.remainder = 0.0;
            }
        }
        for party in self.parties.iter().filter(|party| party.takes != party.gives) {
            let units = (party.takes - party.gives) as i32;
            let i = party.column as usize;
            debug_assert!(
                party.has >= party.gives && party.has + i64::from(units) <= party.has + party.room,
                "{i} {columns:?}"
            );
            self.moves.push((party.column, units));
        }
        self.moves.sort_unstable();
    }

    /// Moves the network's units in a range of columns, and closes its pipes there and in a range of links for the rest of the step.
    pub fn move_units(
        &self,
        columns: &Range<u32>,
        links: &Range<usize>,
        mut change: impl FnMut(u32, i32),
        mut close: impl FnMut(PipeIndex),
    ) {
        let first = self.moves.partition_point(|(column, _)| *column < columns.start);
        for (column, units) in self.moves[first..].iter().take_while(|(column, _)| *column < columns.end) {
            change(*column, *units);
        }
        let ranges = [columns.clone(), columns.clone(), links.start as u32..links.end as u32];
        for ((pipes, range), at) in
            self.pipe_indices.iter().zip(ranges).zip([PipeIndex::East, PipeIndex::South, PipeIndex::Link])
        {
            let first = pipes.partition_point(|&at| at < range.start);
            pipes[first..].iter().take_while(|&&at| at < range.end).for_each(|&pipe| close(at(pipe)));
        }
    }

    /// Fluxes of the pipes to the east (0) and to the south (1) of columns.
    pub(in crate::shallow::solver) fn fluxes(&self) -> impl Iterator<Item = (usize, usize, f32)> + '_ {
        self.edges.iter().filter_map(|edge| match edge.at {
            PipeIndex::East(at) => Some((0, at as usize, edge.flux as f32)),
            PipeIndex::South(at) => Some((1, at as usize, edge.flux as f32)),
            PipeIndex::Link(_) => None,
        })
    }

    /// Stores the fluxes of the network, after the rest of the step.
    pub fn store_fluxes(
        &self,
        flux: &mut [PerColumn<f32>; 2],
        remainder: &mut [PerColumn<f32>; 2],
        links: &mut LinkFlow,
        overflow_edges: &mut OverflowEdges,
    ) {
        let ([flux_east, flux_south], [remainder_east, remainder_south]) = (flux, remainder);
        for edge in &self.edges {
            let overflow = match edge.at {
                PipeIndex::Link(link) if overflow_edges.at(link as usize) != Fall::No => Some(link as usize),
                _ => None,
            };
            match edge.ends {
                _ if overflow.is_some() => {
                    overflow.iter().for_each(|&link| overflow_edges.add_flooded(link, edge.units.abs()))
                }
                [_, NONE] if edge.units > 0 => links.lost += edge.units,
                [_, NONE] => links.gained -= edge.units,
                _ => {}
            }
            let (flux, remainder, at) = match edge.at {
                PipeIndex::East(at) => (&mut flux_east[..], &mut remainder_east[..], at),
                PipeIndex::South(at) => (&mut flux_south[..], &mut remainder_south[..], at),
                PipeIndex::Link(at) => (&mut links.flux[..], &mut links.remainder[..], at),
            };
            (flux[at as usize], remainder[at as usize]) = (edge.flux as f32, edge.remainder as f32);
        }
    }
}

/// A transfer rounded to whole units, and clamped: a restored state may exceed all bounds, and sums must fit 64 bits.
fn rounded(transfer: f64) -> i64 {
    transfer.clamp(-1e15, 1e15).round() as i64
}
