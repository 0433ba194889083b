//! Welding: corners at the same position, or no further apart than the rounding of their file, are one.
//!
//! Triangle soup (.stl, and .obj or .ply as many programs export them) gives each triangle its own corners, and programs that compute a
//! corner once for each triangle may round it differently each time. Corners at equal positions are always joined. If that leaves edges
//! with one triangle, corners on such edges are joined too if they are within rounding; a mesh that is closed already costs one pass over
//! its edges, and a mesh that is open by more than rounding stays open. Whether the triangles share their corners elsewhere does not
//! matter: seams of texture coordinates are joined by the same rule.
//!
//! Three rounds, each for the edges that the previous one left open:
//!
//! 1. Within [`STEPS`] adjacent 32-bit numbers on each axis, at the precision of each coordinate.
//! 2. The same, but steps are no finer than those at a coordinate of half the open edges' extent: programs that rotate a mesh leave 1e-9
//!    in one triangle and 0 in another, which by their own size are millions of steps apart. Only where it closes a part wholly: it may
//!    not bridge a slit of a mesh that is open anyway.
//! 3. Chains of corners, each within rounding of the next and the ends further apart. Only where it closes a part, and with a warning.
//!
//! The nearest corners are joined first, and never both ends of an edge: a triangle as thin as the rounding is kept.

use super::{coincident, home};
use crate::geometry::DVec3;
use crate::geometry::check::topology::Sets;
use crate::geometry::lists::Lists;

/// Corners may be this many adjacent 32-bit numbers apart on each axis.
pub const STEPS: i64 = 4;
/// Maximum corners that one is compared with: more within rounding cannot be told apart.
const MAX_NEAR: usize = 64;
/// Edge (steps) of the cells used to look up corners: few corners need a second cell.
const CELL: i64 = 4 * STEPS;

/// Which vertices of a mesh are one corner.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Weld {
    /// For each vertex the first one that is the same corner: itself if there is no earlier one.
    pub firsts: Vec<u32>,
    /// Joined vertices (ascending) that are not at the position of their first vertex.
    pub near: Vec<u32>,
    /// Vertices (ascending) for which rounding does not decide which corner they are: those of joined chains, and those that are still on
    /// an edge with one triangle although others lie within rounding.
    pub ambiguous: Vec<u32>,
}

impl Weld {
    /// Welds positions, in the unit and around the origin of their file, so that their rounding is known; the triangles' indices must be in
    /// range.
    pub fn of(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let firsts = coincident(positions.iter().copied());
        let boundary = Boundary::of(triangles, &firsts);
        Self::with_boundary(positions, triangles, firsts, &boundary)
    }

    /// As [`Weld::of`], with `firsts` of [`coincident`] and the boundary after joining equal positions already known.
    pub fn with_boundary(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        firsts: Vec<u32>,
        boundary: &Boundary,
    ) -> Self {
        if boundary.is_empty() {
            return Self { firsts, near: Vec::new(), ambiguous: Vec::new() };
        }
        let boundary_positions: Vec<[f32; 3]> =
            boundary.vertices.iter().map(|&vertex| positions[vertex as usize].cast::<f32>().into()).collect();
        let both = boundary.edges.iter().flat_map(|&([a, b], _)| [(a, b), (b, a)]);
        let links = Lists::new(boundary.vertices.len(), both);
        let mut rounds = Rounds::new(boundary, &links);
        let undecided = rounds.join(&Ruler::OWN.measure(&boundary_positions), false);
        let coarse = Ruler::of_extent(&boundary_positions).map(|ruler| ruler.measure(&boundary_positions));
        for chains in [false, true] {
            let Some(coarse) = coarse.as_ref().filter(|_| rounds.has_open_edges()) else { break };
            let mut tried = rounds.clone();
            tried.join(coarse, chains);
            if tried.joined > rounds.joined {
                rounds.accept(tried, triangles, &firsts);
            }
        }
        rounds.finish(firsts, undecided)
    }

    /// The warning about vertices that rounding does not decide; `None` if there are none.
    pub fn warning(&self) -> Option<String> {
        let first = self.ambiguous.first()?;
        let (count, s) = (self.ambiguous.len(), if self.ambiguous.len() == 1 { "" } else { "s" });
        Some(format!(
            "{count} corner{s} on open edges lie{} within rounding of others, but it is not clear which belong together (vertex {} is the \
             first): look at `frazil mesh check`, or save the mesh nearer to the origin",
            if count == 1 { "s" } else { "" },
            first + 1
        ))
    }

    /// Gives each vertex that is not at the position of its first vertex the value of that first vertex.
    pub fn unify<T: Copy>(&self, values: &mut [T]) {
        for &vertex in &self.near {
            values[vertex as usize] = values[self.firsts[vertex as usize] as usize];
        }
    }
}

/// The boundary after joining equal positions: vertices on edges with one triangle, and all edges between these.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Boundary {
    /// Ascending; each the first one at its position.
    vertices: Vec<u32>,
    /// Edges by indices into `vertices` (the smaller first), ascending, with their numbers of triangles.
    edges: Vec<([u32; 2], u32)>,
}

impl Boundary {
    /// `firsts` has, for each vertex, the first one at the same position; triangles that use one of these twice do not count.
    pub fn of(triangles: &[[u32; 3]], firsts: &[u32]) -> Self {
        let joined = |corners: &[u32; 3]| corners.map(|vertex| firsts[vertex as usize]);
        let whole = triangles.iter().map(joined).filter(|[a, b, c]| a != b && b != c && c != a);
        let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]].map(|[i, j]| (i.min(j), i.max(j)));
        // Short lists: few edges begin at one vertex.
        let mut ends = Lists::new(firsts.len(), whole.flat_map(sides));
        ends.each_mut(|ends| ends.sort_unstable());
        let mut is_open = vec![false; firsts.len()];
        for vertex in 0..firsts.len() {
            for run in ends.get(vertex).chunk_by(|a, b| a == b).filter(|run| run.len() == 1) {
                is_open[vertex] = true;
                is_open[run[0] as usize] = true;
            }
        }
        let vertices: Vec<u32> =
            (0..firsts.len() as u32).filter(|&vertex| is_open[vertex as usize]).collect();
        if vertices.is_empty() {
            return Self::default();
        }
        let mut own = vec![u32::MAX; firsts.len()];
        vertices.iter().zip(0..).for_each(|(&vertex, index)| own[vertex as usize] = index);
        let mut edges = Vec::new();
        for (&vertex, index) in vertices.iter().zip(0..) {
            let runs = ends.get(vertex as usize).chunk_by(|a, b| a == b);
            for run in runs.filter(|run| own[run[0] as usize] != u32::MAX) {
                edges.push(([index, own[run[0] as usize]], run.len() as u32));
            }
        }
        Self { vertices, edges }
    }

    /// Whether every edge has at least two triangles.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }
}

/// Converts coordinates to steps.
#[derive(Clone, Copy)]
struct Ruler {
    /// Coordinates below this count in steps of `step`.
    from: f32,
    /// 0: every coordinate counts in its own steps.
    step: f64,
}

impl Ruler {
    const OWN: Self = Self { from: 0.0, step: 0.0 };

    /// With steps no finer than those at a coordinate of half the longest side of the positions' box; `None` if they have no extent.
    fn of_extent(positions: &[[f32; 3]]) -> Option<Self> {
        let side = |axis: usize| {
            let of_axis = || positions.iter().map(|position| position[axis]);
            of_axis().fold(f32::MIN, f32::max) - of_axis().fold(f32::MAX, f32::min)
        };
        let half = 0.5 * (0..3).map(side).fold(0.0, f32::max);
        // Steps change at powers of two.
        let from = f32::from_bits(half.to_bits() & 0x7f80_0000);
        (from > 0.0 && from.is_finite()).then(|| Self { from, step: super::spacing(f64::from(from)) })
    }

    fn measure(self, positions: &[[f32; 3]]) -> Vec<[i64; 3]> {
        positions.iter().map(|position| position.map(|coordinate| self.steps(coordinate))).collect()
    }

    /// The number of steps from 0 to a coordinate; adjacent 32-bit numbers have adjacent counts unless steps are coarser.
    fn steps(self, coordinate: f32) -> i64 {
        let bits = |value: f32| i64::from(value.to_bits());
        let size = coordinate.abs();
        let steps = if size >= self.from {
            let fine = if self.step > 0.0 { (f64::from(self.from) / self.step) as i64 } else { 0 };
            bits(size) - bits(self.from) + fine
        } else {
            (f64::from(size) / self.step).round() as i64
        };
        if coordinate.is_sign_negative() { -steps } else { steps }
    }
}

/// The joined vertices of the boundary, round by round.
#[derive(Clone)]
struct Rounds<'a> {
    boundary: &'a Boundary,
    /// For each vertex, the other ends of its edges.
    links: &'a Lists<u32>,
    sets: Sets,
    /// For each vertex the next one of its set, as a ring.
    next: Vec<u32>,
    /// For the first vertex of each set, whether it was joined as a chain.
    is_chained: Vec<bool>,
    /// Number of merges of two sets.
    joined: usize,
}

impl<'a> Rounds<'a> {
    fn new(boundary: &'a Boundary, links: &'a Lists<u32>) -> Self {
        let count = boundary.vertices.len();
        let next = (0..count as u32).collect();
        Self { boundary, links, sets: Sets::new(count), next, is_chained: vec![false; count], joined: 0 }
    }

    /// Joins open vertices with these coordinates (steps), the nearest first. Returns those that had another within rounding but were not
    /// joined with it.
    fn join(&mut self, steps: &[[i64; 3]], chains: bool) -> Vec<u32> {
        let is_open = self.open();
        let open: Vec<u32> = (0..steps.len() as u32).filter(|&vertex| is_open[vertex as usize]).collect();
        let (mut pairs, mut undecided) = near_pairs(steps, &open);
        pairs.sort_unstable();
        // The box of each set, over all members, joined in this round or before.
        let mut boxes: Vec<[[i64; 3]; 2]> = steps.iter().map(|&at| [at, at]).collect();
        for vertex in 0..steps.len() as u32 {
            let root = self.sets.root(vertex);
            let at = boxes[vertex as usize];
            boxes[root as usize] = united(boxes[root as usize], at);
        }
        for (_, [a, b]) in pairs {
            let roots = [a, b].map(|vertex| self.sets.root(vertex));
            if roots[0] == roots[1] || self.links.get(a as usize).contains(&b) {
                continue;
            }
            let both = united(boxes[roots[0] as usize], boxes[roots[1] as usize]);
            let is_wide = (0..3).any(|axis| both[1][axis] - both[0][axis] > STEPS);
            if (is_wide && !chains) || self.share_an_edge(roots) {
                undecided.extend([a, b]);
                continue;
            }
            let root = self.unite(roots) as usize;
            boxes[root] = both;
            self.is_chained[root] |= is_wide;
        }
        undecided
    }

    /// Merges two sets; returns the first vertex.
    fn unite(&mut self, roots: [u32; 2]) -> u32 {
        let is_chained = roots.iter().any(|&root| self.is_chained[root as usize]);
        self.sets.join(roots[0], roots[1]);
        self.next.swap(roots[0] as usize, roots[1] as usize);
        self.joined += 1;
        let root = roots[0].min(roots[1]);
        self.is_chained[root as usize] = is_chained;
        root
    }

    /// Whether an edge connects two sets.
    fn share_an_edge(&mut self, [from, to]: [u32; 2]) -> bool {
        let mut at = from;
        loop {
            if self.links.get(at as usize).iter().any(|&other| self.sets.root(other) == to) {
                return true;
            }
            at = self.next[at as usize];
            if at == from {
                return false;
            }
        }
    }

    /// The edges after joining, ascending, with their numbers of triangles.
    fn edges(&mut self) -> Vec<([u32; 2], u32)> {
        let mut edges = Vec::with_capacity(self.boundary.edges.len());
        for &([a, b], uses) in &self.boundary.edges {
            let (a, b) = (self.sets.root(a), self.sets.root(b));
            edges.push(([a.min(b), a.max(b)], uses));
        }
        edges.sort_unstable();
        edges.dedup_by(|next, last| {
            let is_same = next.0 == last.0;
            if is_same {
                last.1 += next.1;
            }
            is_same
        });
        edges
    }

    /// Which vertices are on edges with one triangle.
    fn open(&mut self) -> Vec<bool> {
        let mut is_open = vec![false; self.next.len()];
        for (ends, _) in self.edges().into_iter().filter(|(_, uses)| *uses == 1) {
            ends.iter().for_each(|&end| is_open[end as usize] = true);
        }
        // Edges name sets by their first vertices.
        (0..self.next.len() as u32).map(|vertex| is_open[self.sets.root(vertex) as usize]).collect()
    }

    fn has_open_edges(&mut self) -> bool {
        self.edges().iter().any(|(_, uses)| *uses == 1)
    }

    /// Adopts what a round joined, in parts of the mesh (connected by vertices) that then have no edge with one triangle.
    fn accept(&mut self, mut tried: Self, triangles: &[[u32; 3]], firsts: &[u32]) {
        let mut parts = Sets::new(firsts.len());
        for corners in triangles {
            let [a, b, c] = corners.map(|vertex| firsts[vertex as usize]);
            parts.join(a, b);
            parts.join(b, c);
        }
        let vertices = &self.boundary.vertices;
        for index in 0..vertices.len() as u32 {
            let root = tried.sets.root(index);
            parts.join(vertices[index as usize], vertices[root as usize]);
        }
        let mut is_open = vec![false; firsts.len()];
        for (index, open) in tried.open().into_iter().enumerate() {
            is_open[parts.root(vertices[index]) as usize] |= open;
        }
        for index in 0..vertices.len() as u32 {
            let root = tried.sets.root(index);
            if is_open[parts.root(vertices[index as usize]) as usize] {
                continue;
            }
            let own = [index, root].map(|vertex| self.sets.root(vertex));
            if own[0] != own[1] {
                let now = self.unite(own);
                self.is_chained[now as usize] |= tried.is_chained[root as usize];
            }
        }
    }

    fn finish(mut self, mut firsts: Vec<u32>, mut undecided: Vec<u32>) -> Weld {
        let vertices = &self.boundary.vertices;
        let is_open = self.open();
        undecided.retain(|&vertex| is_open[vertex as usize]);
        // Joining may have made edges with a third triangle.
        let edges = self.edges();
        let is_joined = |vertex: u32| self.next[vertex as usize] != vertex;
        let odd = edges.iter().filter(|(_, uses)| *uses > 2 && uses % 2 == 1).flat_map(|(ends, _)| *ends);
        undecided.extend(odd.filter(|&end| is_joined(end)));
        let roots: Vec<u32> = (0..vertices.len() as u32).map(|vertex| self.sets.root(vertex)).collect();
        let is_chained = |vertex: &u32| self.is_chained[roots[*vertex as usize] as usize];
        undecided.extend((0..vertices.len() as u32).filter(is_chained));
        let mut ambiguous: Vec<u32> = undecided.into_iter().map(|vertex| vertices[vertex as usize]).collect();
        ambiguous.sort_unstable();
        ambiguous.dedup();
        // Boundary vertices are the first at their positions, and sets are named by their smallest vertex.
        let mut joined_to: Vec<u32> = (0..firsts.len() as u32).collect();
        for (&vertex, &root) in vertices.iter().zip(&roots) {
            joined_to[vertex as usize] = vertices[root as usize];
        }
        let is_near = |vertex: &u32| joined_to[firsts[*vertex as usize] as usize] != firsts[*vertex as usize];
        let near = (0..firsts.len() as u32).filter(is_near).collect();
        firsts.iter_mut().for_each(|first| *first = joined_to[*first as usize]);
        Weld { firsts, near, ambiguous }
    }
}

fn united([low, high]: [[i64; 3]; 2], [other_low, other_high]: [[i64; 3]; 2]) -> [[i64; 3]; 2] {
    [
        std::array::from_fn(|axis| low[axis].min(other_low[axis])),
        std::array::from_fn(|axis| high[axis].max(other_high[axis])),
    ]
}

/// The largest distance of two vertices on an axis and the sum over the axes (steps), and the vertices.
type NearPair = ([i64; 2], [u32; 2]);

/// Pairs of vertices (the smaller first) within [`STEPS`] on each axis, with their distances, and the vertices that have too many others
/// around them.
fn near_pairs(steps: &[[i64; 3]], some: &[u32]) -> (Vec<NearPair>, Vec<u32>) {
    let cell = |at: [i64; 3]| at.map(|step| step.div_euclid(CELL));
    // Open addressing, at most half full; each slot leads to the last vertex of its cell, and each vertex to the one before it.
    let bits = (2 * some.len().max(1)).next_power_of_two().ilog2().max(1);
    let mut slots = vec![u32::MAX; 1 << bits];
    let mut before = vec![u32::MAX; steps.len()];
    let find = |slots: &[u32], key: [i64; 3]| {
        let mut slot = home(&key.map(|part| part as u64), bits);
        while slots[slot] != u32::MAX && cell(steps[slots[slot] as usize]) != key {
            slot = (slot + 1) & ((1 << bits) - 1);
        }
        slot
    };
    let (mut pairs, mut with_too_many) = (Vec::new(), Vec::new());
    for &vertex in some {
        let at = steps[vertex as usize];
        let [low, high] = [-STEPS, STEPS].map(|by| cell(at.map(|step| step + by)));
        let mut count = 0;
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let mut other = slots[find(&slots, [x, y, z])];
                    while other != u32::MAX && count < MAX_NEAR {
                        let off = [0, 1, 2].map(|axis| (steps[other as usize][axis] - at[axis]).abs());
                        let farthest = off.into_iter().max().unwrap_or(0);
                        if farthest <= STEPS {
                            pairs.push(([farthest, off.iter().sum()], [other, vertex]));
                            count += 1;
                        }
                        other = before[other as usize];
                    }
                }
            }
        }
        if count == MAX_NEAR {
            with_too_many.push(vertex);
        }
        let slot = find(&slots, cell(at));
        before[vertex as usize] = slots[slot];
        slots[slot] = vertex;
    }
    (pairs, with_too_many)
}
