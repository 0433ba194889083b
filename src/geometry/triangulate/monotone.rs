//! Triangulation of large polygons by a sweep line.
//!
//! Diagonals from the corners where the polygon turns back against the sweep cut it into pieces that are monotone along x, and each of
//! those is cut from left to right (de Berg et al., Computational Geometry, 3rd ed., sections 3.2 and 3.3): n corners take some n log n
//! steps. Predicates are exact, on integers. For a polygon that touches or crosses itself, diagonals may cross, or pieces not be monotone:
//! the former are left out, the latter triangulated by ear clipping.

use super::ear_clipping;
use super::ear_clipping::Point;

/// Size of the square that the points are rounded into: finer than the 24 bits of their coordinates, and twice an area still fits in 64
/// bits.
const SQUARE: f64 = (1u64 << 30) as f64;
/// Edges in a run of the list of edges that the sweep line crosses.
const RUN: usize = 256;

/// Triangles of a counter-clockwise polygon of at least three corners, two fewer than corners.
pub fn triangles(points: &[Point]) -> Vec<[usize; 3]> {
    let whole = rounded(points);
    let mut out = Vec::with_capacity(points.len() - 2);
    let ring = without_spikes(&whole, &mut out);
    let positions: Vec<[i64; 2]> = ring.iter().map(|&corner| whole[corner]).collect();
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_unstable_by_key(|&corner| (positions[corner], corner));
    let mut rank = vec![0; positions.len()];
    order.iter().enumerate().for_each(|(at, &corner)| rank[corner] = at);
    let diagonals = Sweep::new(&positions, &rank).run(&order);
    let mut cut = Vec::new();
    for piece in pieces(positions.len(), diagonals) {
        cut.clear();
        if !cut_monotone(&positions, &rank, &piece, &mut cut) {
            let own: Vec<Point> = piece.iter().map(|&corner| points[ring[corner]]).collect();
            cut = ear_clipping::triangles(&own)
                .into_iter()
                .map(|triangle| triangle.map(|i| piece[i]))
                .collect();
        }
        out.extend(cut.iter().map(|triangle| triangle.map(|corner| ring[corner])));
    }
    out
}

/// The points on the integer grid of a square.
fn rounded(points: &[Point]) -> Vec<[i64; 2]> {
    let end =
        |axis: usize, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[axis]).fold(points[0][axis], pick);
    let low = [0, 1].map(|axis| end(axis, f64::min));
    let high = [0, 1].map(|axis| end(axis, f64::max));
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let scale = if extent > 0.0 { SQUARE / extent } else { 0.0 };
    // NaN becomes 0.
    points.iter().map(|p| [0, 1].map(|axis| ((p[axis] - low[axis]) * scale).round() as i64)).collect()
}

/// Twice the area of a triangle, positive when it is counter-clockwise.
fn turn(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Cuts off corners that are doubled, or where the polygon turns back on itself; returns the rest, at least three.
fn without_spikes(positions: &[[i64; 2]], out: &mut Vec<[usize; 3]>) -> Vec<usize> {
    let mut ring: Vec<usize> = Vec::with_capacity(positions.len());
    let is_spike = |a: usize, b: usize, c: usize| {
        let [p, q, r] = [a, b, c].map(|corner| positions[corner]);
        let along = (p[0] - q[0]) * (r[0] - q[0]) + (p[1] - q[1]) * (r[1] - q[1]);
        turn(p, q, r) == 0 && along >= 0
    };
    for corner in 0..positions.len() {
        let rest = positions.len() - corner;
        while let [.., a, b] = ring[..] {
            if ring.len() + rest <= 3 || !is_spike(a, b, corner) {
                break;
            }
            out.push([a, b, corner]);
            ring.pop();
        }
        ring.push(corner);
    }
    // Where the ring closes.
    let (mut begin, mut end) = (0, ring.len());
    while end - begin > 3 {
        let (last, first) = (ring[end - 1], ring[begin]);
        if is_spike(ring[end - 2], last, first) {
            out.push([ring[end - 2], last, first]);
            end -= 1;
        } else if is_spike(last, first, ring[begin + 1]) {
            out.push([last, first, ring[begin + 1]]);
            begin += 1;
        } else {
            break;
        }
    }
    ring[begin..end].to_vec()
}

/// The sweep from left to right. Corners are ordered by position, then by index; an edge is named by the corner that it leaves. Of the
/// edges that the line crosses, those with the polygon above them are kept, ordered upward.
struct Sweep<'a> {
    positions: &'a [[i64; 2]],
    rank: &'a [usize],
    /// Runs of edges, and the order of the runs.
    runs: Vec<Vec<u32>>,
    order: Vec<usize>,
    run_of: Vec<usize>,
    /// For each edge the last corner that the line met between it and the next edge above.
    helper: Vec<u32>,
    is_merge: Vec<bool>,
    diagonals: Vec<[usize; 2]>,
}

impl<'a> Sweep<'a> {
    fn new(positions: &'a [[i64; 2]], rank: &'a [usize]) -> Self {
        let count = positions.len();
        Self {
            positions,
            rank,
            runs: Vec::new(),
            order: Vec::new(),
            run_of: vec![usize::MAX; count],
            helper: vec![0; count],
            is_merge: vec![false; count],
            diagonals: Vec::new(),
        }
    }

    fn run(mut self, order: &[usize]) -> Vec<[usize; 2]> {
        order.iter().for_each(|&corner| self.meet(corner));
        self.diagonals
    }

    fn before(&self, corner: usize) -> usize {
        if corner == 0 { self.positions.len() - 1 } else { corner - 1 }
    }

    fn after(&self, corner: usize) -> usize {
        if corner + 1 == self.positions.len() { 0 } else { corner + 1 }
    }

    fn meet(&mut self, corner: usize) {
        let (before, after) = (self.before(corner), self.after(corner));
        let [comes_from_left, goes_left] = [before, after].map(|other| self.rank[other] < self.rank[corner]);
        let is_convex = turn(self.positions[before], self.positions[corner], self.positions[after]) > 0;
        if comes_from_left {
            // The edge `before` was inserted at a start, a split, or a corner of a lower side.
            self.join_merged(before, corner);
            self.remove(before);
        }
        match (comes_from_left, goes_left, is_convex) {
            // A start, and a lower side.
            (false, false, true) | (true, false, _) => self.insert(corner, after),
            (false, false, false) => {
                if let Some(edge) = self.below(corner, before) {
                    self.diagonals.push([corner, self.helper[edge] as usize]);
                    self.helper[edge] = corner as u32;
                }
                self.insert(corner, after);
            }
            // An end.
            (true, true, true) => {}
            // A merge, and an upper side.
            (true, true, false) | (false, true, _) => {
                self.is_merge[corner] = comes_from_left;
                if let Some(edge) = self.below(corner, after) {
                    self.join_merged(edge, corner);
                    self.helper[edge] = corner as u32;
                }
            }
        }
    }

    /// A diagonal to an edge's helper if that is a merge corner.
    fn join_merged(&mut self, edge: usize, corner: usize) {
        let helper = self.helper[edge] as usize;
        if self.is_merge[helper] {
            self.diagonals.push([corner, helper]);
        }
    }

    /// Whether a corner is above an edge, or on it with another point above.
    fn is_above(&self, edge: u32, corner: usize, other: usize) -> bool {
        let edge = edge as usize;
        let (a, b) = (self.positions[edge], self.positions[self.after(edge)]);
        match turn(a, b, self.positions[corner]) {
            0 => turn(a, b, self.positions[other]) > 0,
            side => side > 0,
        }
    }

    /// The position in the list at which a corner belongs, after all edges that are below it: the run's index in the order, and an index in
    /// the run.
    fn position(&self, corner: usize, other: usize) -> Option<(usize, usize)> {
        let run = self.order.partition_point(|&run| self.is_above(self.runs[run][0], corner, other));
        let run = run.checked_sub(1)?;
        let edges = &self.runs[self.order[run]];
        Some((run, edges.partition_point(|&edge| self.is_above(edge, corner, other))))
    }

    fn below(&self, corner: usize, other: usize) -> Option<usize> {
        let (run, at) = self.position(corner, other)?;
        // The first of the run is below.
        Some(self.runs[self.order[run]][at.max(1) - 1] as usize)
    }

    /// Inserts the edge that leaves a corner.
    fn insert(&mut self, corner: usize, after: usize) {
        self.helper[corner] = corner as u32;
        if self.order.is_empty() {
            self.run_of[corner] = self.runs.len();
            self.order.push(self.runs.len());
            return self.runs.push(vec![corner as u32]);
        }
        let (run, at) = self.position(corner, after).unwrap_or((0, 0));
        let name = self.order[run];
        self.runs[name].insert(at, corner as u32);
        self.run_of[corner] = name;
        if self.runs[name].len() > RUN {
            let upper = self.runs[name].split_off(RUN / 2);
            upper.iter().for_each(|&edge| self.run_of[edge as usize] = self.runs.len());
            self.order.insert(run + 1, self.runs.len());
            self.runs.push(upper);
        }
    }

    fn remove(&mut self, edge: usize) {
        let name = self.run_of[edge];
        let run = &mut self.runs[name];
        run.retain(|&other| other as usize != edge);
        if run.is_empty() {
            self.order.retain(|&other| other != name);
        }
    }
}

/// The pieces into which diagonals cut a polygon of `count` corners, each counter-clockwise. Diagonals that cross an earlier one, or are
/// sides, are left out.
fn pieces(count: usize, diagonals: Vec<[usize; 2]>) -> Vec<Vec<usize>> {
    let mut cuts: Vec<(usize, usize)> = diagonals.iter().map(|&[a, b]| (a.min(b), a.max(b))).collect();
    cuts.retain(|&(low, high)| high - low > 1 && (low, high) != (0, count - 1));
    // Of those that begin at the same corner, the outermost first.
    cuts.sort_unstable_by_key(|&(low, high)| (low, count - high));
    cuts.dedup();
    let mut out = Vec::new();
    // The open cuts around the current corner, with their pieces so far; the whole polygon is the first.
    let mut open: Vec<(usize, Vec<usize>)> = vec![(count, Vec::new())];
    let mut cuts = cuts.into_iter().peekable();
    for corner in 0..count {
        while open.last().is_some_and(|(high, _)| *high == corner) {
            let (_, mut piece) = open.pop().unwrap_or_default();
            piece.push(corner);
            out.push(piece);
        }
        open.iter_mut().last().into_iter().for_each(|(_, piece)| piece.push(corner));
        while let Some((_, high)) = cuts.next_if(|&(low, _)| low == corner) {
            if open.last().is_some_and(|(outer, _)| high <= *outer) {
                open.push((high, vec![corner]));
            }
        }
    }
    out.extend(open.into_iter().map(|(_, piece)| piece));
    out
}

/// Cuts a monotone piece; returns whether it was monotone and no triangle is flipped.
fn cut_monotone(positions: &[[i64; 2]], rank: &[usize], piece: &[usize], out: &mut Vec<[usize; 3]>) -> bool {
    let count = piece.len();
    let first = (0..count).min_by_key(|&at| rank[piece[at]]).unwrap_or(0);
    let corner = |at: usize| piece[(first + at) % count];
    let last = (0..count).max_by_key(|&at| rank[corner(at)]).unwrap_or(0);
    let rises = |at: usize| rank[corner(at)] < rank[corner(at + 1)];
    if !(0..last).all(rises) || (last..count).any(rises) {
        return false;
    }
    let mut is_valid = true;
    let mut add = |a: usize, b: usize, c: usize| {
        is_valid &= turn(positions[a], positions[b], positions[c]) >= 0;
        out.push([a, b, c]);
    };
    // The lower side counts up from the first corner, the upper one down to it.
    let (mut lower, mut upper) = (1, count - 1);
    let mut stack = vec![(corner(0), true)];
    while lower <= upper {
        let is_lower = lower < last + 1 && (upper < last + 1 || rank[corner(lower)] < rank[corner(upper)]);
        let next = if is_lower { corner(lower) } else { corner(upper) };
        if is_lower {
            lower += 1
        } else {
            upper -= 1
        };
        let (top, was_lower) = stack[stack.len() - 1];
        if stack.len() > 1 && (was_lower != is_lower || lower > upper) {
            // All corners on the stack are visible from the other side.
            for pair in stack.windows(2) {
                let ((a, _), (b, _)) = (pair[0], pair[1]);
                if was_lower { add(a, b, next) } else { add(b, a, next) }
            }
            stack.clear();
            stack.push((top, was_lower));
        } else {
            while let [.., (a, _), (b, _)] = stack[..] {
                let seen = turn(positions[a], positions[b], positions[next]);
                if if is_lower { seen <= 0 } else { seen >= 0 } {
                    break;
                }
                if is_lower {
                    add(a, b, next)
                } else {
                    add(b, a, next)
                }
                stack.pop();
            }
        }
        stack.push((next, is_lower));
    }
    is_valid
}
