//! Flooded passages: columns that are full to their ceiling push with a head instead of a surface (the extended pipes of Dagenais et al.,
//! Computers & Graphics 76, 2018, which the thesis leaves out).
//!
//! Inflow and outflow of a full column are equal: the heads of a step follow from a linear system, solved by conjugate gradients whose sums
//! do not depend on their order. The pipes of full columns form the *network*. Its transfers are found before all other fluxes, and stored
//! after them: all use the same surface, or waves would grow. A head below the surface would be suction: such a column acts as a free one.

use std::ops::Range;

use super::edges::{At, Edge};
use super::gradients::Gradients;
use super::nodes::{EQUAL, Node, section};
use crate::shallow::columns::per_column::{Array, PerColumn};
use crate::shallow::columns::{Columns, NONE, STRIP, strip_mut, strip_of};
use crate::shallow::pipes::Pipes;
use crate::shallow::pipes::cliffs::beside;
use crate::shallow::pipes::side::Side;
use crate::shallow::solver::full::full_of;
use crate::shallow::solver::lateral_friction::Walls;
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
    pub(in crate::shallow::solver) over: PerColumn<f32>,
    /// Whether each row may have a column with a head.
    has_heads: Vec<bool>,
    /// The network's pipes to the east, to the south, and its links, sorted.
    shut: [Vec<u32>; 3],
    /// Changes by the network: columns, sorted, and units.
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
    /// Flux to the east and to the south (units a step).
    pub flux: [&'a [f32]; 2],
    /// Remainders of transfers, to the east and to the south (units).
    pub left: [&'a [f32]; 2],
    /// Flow through links.
    pub links: &'a LinkFlow,
    /// Overflow edges: links that liquid falls freely from.
    pub overflow_edges: &'a OverflowEdges,
    /// Lateral friction of pipes.
    pub walls: &'a Walls,
}

impl Network {
    /// An empty network, for so many column indices and rows.
    pub fn new(columns: usize, rows: usize) -> Self {
        // A tool that dips in floods some hundred columns: frames must not allocate for them.
        let room = columns.min(ROOM);
        Self {
            parties: Vec::with_capacity(room),
            nodes: Vec::with_capacity(room),
            edges: Vec::with_capacity(2 * room),
            gradients: Gradients::with_room(room),
            shut: [(); 3].map(|()| Vec::with_capacity(room)),
            moves: Vec::with_capacity(room),
            party_of: vec![NONE; columns],
            over: PerColumn::new(Array::Head, columns, 0.0),
            has_heads: vec![false; rows],
        }
    }

    /// Changes the count of indices of a part of the columns; their contents are then unspecified.
    pub(in crate::shallow::solver) fn resize_part(&mut self, part: Range<usize>, len: usize) {
        self.clear();
        self.has_heads.fill(true);
        self.over.resize_part(part, len, 0.0);
        self.party_of.resize(self.over.len(), NONE);
    }

    /// Heads above the surface (units) by column index: part of the state, as the next step's iteration starts from them.
    pub fn over_mut(&mut self) -> &mut [f32] {
        self.has_heads.fill(true);
        &mut self.over
    }

    /// As [`Network::over_mut`], read-only.
    pub fn over(&self) -> &[f32] {
        &self.over
    }

    /// Memory that does not depend on full columns (bytes).
    pub fn bytes(&self) -> usize {
        size_of_val(&self.party_of[..]) + self.over.bytes() + self.has_heads.len()
    }

    /// Clears the heads of dry columns.
    pub fn dry(&mut self, columns: Range<usize>) {
        self.over[columns].fill(0.0);
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
        self.flow(columns);
        limiter::settle(&mut self.parties, &mut self.edges, stop);
        if stop.is_asked() {
            return;
        }
        self.decide(columns);
    }

    fn clear(&mut self) {
        for party in self.parties.drain(..) {
            self.party_of[party.column as usize] = NONE;
        }
        self.nodes.clear();
        self.edges.clear();
        self.shut.iter_mut().for_each(Vec::clear);
        self.moves.clear();
    }

    /// Finds the full columns of a row; clears the heads of all others.
    fn find_full(&mut self, columns: &Columns, row: usize, depth: &[i32]) {
        let before = self.nodes.len();
        for strip in columns.row(row) {
            let numbers =
                [columns.bases(), columns.ceilings(), depth].map(|numbers| strip_of(numbers, strip));
            let is_full = full_of(numbers);
            let over = strip_mut(&mut self.over, strip);
            if is_full == [0; STRIP] && over.iter().fold(0, |any, over| any | over.to_bits()) == 0 {
                continue;
            }
            for (column, is_full) in (strip * STRIP..).zip(is_full) {
                if is_full == 0 {
                    self.over[column] = 0.0;
                } else {
                    self.add_party(columns, depth, column as u32);
                    self.nodes.push(Node::new(f64::from(self.over[column])));
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
            let next = |side| beside(state.columns, i, side);
            if pipes.east[i] > 0.0 {
                let edge = self.join(state, At::East(i as u32), [i, i + 1], pipes.east[i]);
                self.meet(edge, node, 0, i + 1, 1);
            }
            if let Some(j) = next(Side::South).filter(|_| pipes.south[i] > 0.0) {
                let edge = self.join(state, At::South(i as u32), [i, j], pipes.south[i]);
                self.meet(edge, node, 2, j, 3);
            }
            // A pipe between two full columns was already added by the other one.
            let is_node = |network: &Self, j: usize| (network.party_of[j] as usize) < network.nodes.len();
            if let Some(j) = next(Side::West).filter(|&j| pipes.east[j] > 0.0 && !is_node(self, j)) {
                let edge = self.join(state, At::East(j as u32), [j, i], pipes.east[j]);
                self.nodes[node].edges[1] = edge;
            }
            if let Some(j) = next(Side::North).filter(|&j| pipes.south[j] > 0.0 && !is_node(self, j)) {
                let edge = self.join(state, At::South(j as u32), [j, i], pipes.south[j]);
                self.nodes[node].edges[3] = edge;
            }
        }
        self.connect_links(rows, state);
        self.shut.iter_mut().for_each(|pipes| pipes.sort_unstable());
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
                let at = At::Link(link as u32);
                let is_node =
                    |column: u32| column != NONE && (self.party_of[column as usize] as usize) < count;
                let fall = state.overflow_edges.at(link);
                if fall != Fall::No {
                    let giver = if fall == Fall::Ahead { from } else { to };
                    if is_node(giver) {
                        let ends = [giver as usize, NONE as usize];
                        let edge = self.join(state, at, ends, links.open[link]);
                        self.edges[edge as usize].fall(state.columns, giver, fall);
                    }
                } else if is_node(from) || is_node(to) {
                    self.join(state, at, [from as usize, to as usize], links.open[link]);
                    if let (NONE, Some(edge)) = (to, self.edges.last_mut()) {
                        edge.outside = f64::from(links.outside(state.columns, link, state.step.still).0);
                    }
                }
            }
        }
    }

    /// Adds a pipe; returns its index.
    fn join(&mut self, state: &State, at: At, [i, j]: [usize; 2], open: f32) -> u32 {
        let State { step, columns, .. } = *state;
        let (flux, left, tilt) = match at {
            At::East(at) => {
                self.shut[0].push(at);
                (state.flux[0][at as usize], state.left[0][at as usize], step.tilt[0])
            }
            At::South(at) => {
                self.shut[1].push(at);
                (state.flux[1][at as usize], state.left[1][at as usize], step.tilt[1])
            }
            At::Link(at) => {
                self.shut[2].push(at);
                (state.links.flux[at as usize], state.links.left[at as usize], 0)
            }
        };
        let outside = j == NONE as usize;
        let from = self.add_party(columns, state.depth, i as u32);
        let to = if outside { NONE } else { self.add_party(columns, state.depth, j as u32) };
        let height = section(columns, state.depth, i, (!outside).then_some(j), flux);
        let square = height * height;
        let thinned = f64::from(step.thinned(flux, square as f32));
        let is_full = |party: u32| (party as usize) < self.nodes.len();
        let beside = state.walls.beside(state, at, [i, j], [from, to].map(is_full));
        let drag = f64::from(step.drag) * thinned * beside.ground;
        let lateral = square * thinned * beside.held;
        let held_back = if square > 0.0 && open > 0.0 {
            square / (square + drag / f64::from(open) + lateral)
        } else {
            0.0
        };
        let conductance = held_back * f64::from(step.drive) * height.min(f64::from(step.section));
        self.edges.push(Edge {
            at,
            ends: [from, to],
            kept: held_back * (f64::from(step.kept * flux) + thinned * beside.taken)
                + conductance * f64::from(tilt),
            conductance,
            outside: 0.0,
            flux: 0.0,
            left: f64::from(left),
            units: 0,
        });
        (self.edges.len() - 1) as u32
    }

    /// Enters a pipe in the nodes at both of its ends.
    fn meet(&mut self, edge: u32, node: usize, side: usize, other: usize, other_side: usize) {
        self.nodes[node].edges[side] = edge;
        let other = self.party_of[other] as usize;
        if let Some(node) = self.nodes.get_mut(other) {
            node.edges[other_side] = edge;
        }
    }

    /// Computes the fluxes for these heads.
    fn flow(&mut self, columns: &Columns) {
        for at in 0..self.edges.len() {
            let edge = self.edges[at];
            let head = |end: usize| {
                let over = self.nodes.get(edge.ends[end] as usize).map_or(0.0, |node| node.over);
                self.surface(columns, &edge, end) + over
            };
            let fall = head(0) - head(1);
            let fall = if fall.abs() < EQUAL { 0.0 } else { fall };
            let flux = edge.kept + edge.conductance * fall;
            let edge = &mut self.edges[at];
            (edge.flux, edge.units) = (flux, nearest(flux + edge.left));
        }
    }

    /// Finds the remainders of the network's pipes and the changes of its columns.
    fn decide(&mut self, columns: &Columns) {
        for edge in &mut self.edges {
            let asked = nearest(edge.flux + edge.left);
            if asked == edge.units {
                edge.left += edge.flux - asked as f64;
            } else {
                edge.flux *= edge.units as f64 / asked as f64;
                edge.left = 0.0;
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
        mut shut: impl FnMut(At),
    ) {
        let first = self.moves.partition_point(|(column, _)| *column < columns.start);
        for (column, units) in self.moves[first..].iter().take_while(|(column, _)| *column < columns.end) {
            change(*column, *units);
        }
        let ranges = [columns.clone(), columns.clone(), links.start as u32..links.end as u32];
        for ((pipes, range), at) in self.shut.iter().zip(ranges).zip([At::East, At::South, At::Link]) {
            let first = pipes.partition_point(|&at| at < range.start);
            pipes[first..].iter().take_while(|&&at| at < range.end).for_each(|&pipe| shut(at(pipe)));
        }
    }

    /// Fluxes of the pipes to the east (0) and to the south (1) of columns.
    pub(in crate::shallow::solver) fn fluxes(&self) -> impl Iterator<Item = (usize, usize, f32)> + '_ {
        self.edges.iter().filter_map(|edge| match edge.at {
            At::East(at) => Some((0, at as usize, edge.flux as f32)),
            At::South(at) => Some((1, at as usize, edge.flux as f32)),
            At::Link(_) => None,
        })
    }

    /// Stores the fluxes of the network, after the rest of the step.
    pub fn put_back(
        &self,
        flux: &mut [PerColumn<f32>; 2],
        left: &mut [PerColumn<f32>; 2],
        links: &mut LinkFlow,
        overflow_edges: &mut OverflowEdges,
    ) {
        let ([flux_east, flux_south], [left_east, left_south]) = (flux, left);
        for edge in &self.edges {
            let lip = match edge.at {
                At::Link(link) if overflow_edges.at(link as usize) != Fall::No => Some(link as usize),
                _ => None,
            };
            match edge.ends {
                _ if lip.is_some() => {
                    lip.iter().for_each(|&lip| overflow_edges.add_flooded(lip, edge.units.abs()))
                }
                [_, NONE] if edge.units > 0 => links.lost += edge.units,
                [_, NONE] => links.gained -= edge.units,
                _ => {}
            }
            let (flux, left, at) = match edge.at {
                At::East(at) => (&mut flux_east[..], &mut left_east[..], at),
                At::South(at) => (&mut flux_south[..], &mut left_south[..], at),
                At::Link(at) => (&mut links.flux[..], &mut links.left[..], at),
            };
            (flux[at as usize], left[at as usize]) = (edge.flux as f32, edge.left as f32);
        }
    }
}

/// A transfer rounded to whole units, and clamped: a restored state may exceed all bounds, and sums must fit 64 bits.
fn nearest(transfer: f64) -> i64 {
    transfer.clamp(-1e15, 1e15).round() as i64
}
