//! Triangulation of polygons by ear clipping.
//!
//! A corner is an ear if its triangle has the polygon's orientation and contains no other corner. Corners lie in a tree of boxes, so that a
//! triangle is compared only with those near it, and cutting an ear affects only its two neighbours: n corners take some n log n steps, or
//! n^2 if most triangles are long and thin. A limit on the steps bounds that.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// A point of the plane.
pub type Point = [f64; 2];

/// Maximum corners of a leaf box, compared one by one.
const LEAF: usize = 8;
/// Maximum boxes visited per corner, before the search for ears is given up: more than a polygon of the allowed size needs.
const MAX_VISITS: usize = 1200;

/// Twice the area of a triangle, positive when it is counter-clockwise.
pub fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Triangles of a counter-clockwise polygon of at least three corners, two fewer than corners. The ear with the smallest index is cut
/// first; a polygon that crosses itself may have none: then its widest corner is cut.
pub fn triangles(points: &[Point]) -> Vec<[usize; 3]> {
    let mut ring = Ring::new(points);
    let mut out = Vec::with_capacity(points.len() - 2);
    for _ in 3..points.len() {
        let corner = ring.next_to_cut();
        out.push(ring.around(corner));
        ring.cut(corner);
    }
    let last = ring.first();
    let [before, at, after] = ring.around(last);
    // In the order of their indices, as far as that is counter-clockwise.
    let mut three = [before, at, after];
    let least = (0..3).min_by_key(|&i| three[i]).unwrap_or(0);
    three.rotate_left(least);
    out.push(three);
    out
}

/// The remaining corners, each with its neighbours.
struct Ring<'a> {
    points: &'a [Point],
    before: Vec<usize>,
    after: Vec<usize>,
    is_remaining: Vec<bool>,
    near: Boxes,
    /// Corners that were ears when they were added.
    ears: BinaryHeap<Reverse<usize>>,
    is_ear: Vec<bool>,
    /// Corners with their turn when they were added, the widest first.
    wide: BinaryHeap<Wide>,
    turns: Vec<f64>,
    /// Boxes that may still be visited.
    visits_left: usize,
}

/// A corner, ordered by its turn, then by its index.
#[derive(PartialEq)]
struct Wide(f64, Reverse<usize>);

impl Eq for Wide {}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Wide {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl<'a> Ring<'a> {
    fn new(points: &'a [Point]) -> Self {
        let count = points.len();
        let mut ring = Self {
            points,
            before: (0..count).map(|i| (i + count - 1) % count).collect(),
            after: (0..count).map(|i| (i + 1) % count).collect(),
            is_remaining: vec![true; count],
            near: Boxes::new(points),
            ears: BinaryHeap::new(),
            is_ear: vec![false; count],
            wide: BinaryHeap::new(),
            turns: vec![0.0; count],
            visits_left: MAX_VISITS * count,
        };
        (0..count).for_each(|corner| ring.classify(corner));
        ring
    }

    /// A corner with its neighbours: before, at, after.
    fn around(&self, corner: usize) -> [usize; 3] {
        [self.before[corner], corner, self.after[corner]]
    }

    /// Classifies a corner.
    fn classify(&mut self, corner: usize) {
        let [a, b, c] = self.around(corner).map(|i| self.points[i]);
        let turn = turn(a, b, c);
        self.turns[corner] = turn;
        self.wide.push(Wide(turn, Reverse(corner)));
        self.is_ear[corner] = turn > 0.0
            && self.visits_left > 0
            && !self.near.any_within(self.points, [a, b, c], &mut self.visits_left);
        if self.is_ear[corner] {
            self.ears.push(Reverse(corner));
        }
    }

    fn next_to_cut(&mut self) -> usize {
        while let Some(Reverse(corner)) = self.ears.pop() {
            if self.is_remaining[corner] && self.is_ear[corner] {
                return corner;
            }
        }
        while let Some(Wide(turn, Reverse(corner))) = self.wide.pop() {
            if self.is_remaining[corner] && self.turns[corner].to_bits() == turn.to_bits() {
                return corner;
            }
        }
        self.first()
    }

    fn first(&self) -> usize {
        self.is_remaining.iter().position(|&remaining| remaining).unwrap_or(0)
    }

    fn cut(&mut self, corner: usize) {
        let [before, _, after] = self.around(corner);
        self.is_remaining[corner] = false;
        self.near.remove(corner);
        (self.after[before], self.before[after]) = (after, before);
        self.classify(before);
        self.classify(after);
    }
}

/// A tree of boxes around points.
struct Boxes {
    nodes: Vec<Node>,
    /// Points in the order of the leaves.
    order: Vec<usize>,
    /// Leaf of each point.
    leaf_of: Vec<usize>,
    is_remaining: Vec<bool>,
}

struct Node {
    low: Point,
    high: Point,
    /// Remaining points below it.
    remaining: usize,
    parent: usize,
    /// Its two children; none for a leaf.
    children: Option<[usize; 2]>,
    /// Range of its points in `order`.
    range: std::ops::Range<usize>,
}

impl Boxes {
    fn new(points: &[Point]) -> Self {
        let mut out = Self {
            nodes: Vec::new(),
            order: (0..points.len()).collect(),
            leaf_of: vec![0; points.len()],
            is_remaining: vec![true; points.len()],
        };
        let mut todo = vec![(0..points.len(), 0, None)];
        while let Some((range, parent, side)) = todo.pop() {
            let index = out.nodes.len();
            if let Some(side) = side {
                out.nodes[parent].children.get_or_insert([0; 2])[side] = index;
            }
            let own = &mut out.order[range.clone()];
            let end =
                |axis: usize, pick: fn(f64, f64) -> f64| own.iter().map(|&i| points[i][axis]).reduce(pick);
            let bound = |pick| [0, 1].map(|axis| end(axis, pick).unwrap_or(0.0));
            let (low, high) = (bound(f64::min), bound(f64::max));
            if own.len() > LEAF {
                let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
                let middle = own.len() / 2;
                own.select_nth_unstable_by(middle, |&a, &b| {
                    points[a][axis].total_cmp(&points[b][axis]).then(a.cmp(&b))
                });
                let middle = range.start + middle;
                todo.push((range.start..middle, index, Some(0)));
                todo.push((middle..range.end, index, Some(1)));
            } else {
                own.iter().for_each(|&point| out.leaf_of[point] = index);
            }
            out.nodes.push(Node { low, high, remaining: range.len(), parent, children: None, range });
        }
        out
    }

    fn remove(&mut self, point: usize) {
        self.is_remaining[point] = false;
        let mut at = self.leaf_of[point];
        loop {
            self.nodes[at].remaining -= 1;
            if at == 0 {
                return;
            }
            at = self.nodes[at].parent;
        }
    }

    /// Whether a counter-clockwise triangle contains a remaining point, even on its sides, other than its corners.
    fn any_within(&self, points: &[Point], triangle: [Point; 3], visits_left: &mut usize) -> bool {
        let sides = [0, 1, 2].map(|i| (triangle[i], triangle[(i + 1) % 3]));
        let holds = |p: Point| sides.iter().all(|&(a, b)| turn(a, b, p) >= 0.0) && !triangle.contains(&p);
        let mut todo = vec![0];
        while let Some(index) = todo.pop() {
            let node = &self.nodes[index];
            *visits_left = visits_left.saturating_sub(1);
            if node.remaining == 0 {
                continue;
            }
            let corners = [node.low, [node.high[0], node.low[1]], node.high, [node.low[0], node.high[1]]];
            let outside = |&(a, b): &(Point, Point)| corners.iter().all(|&corner| turn(a, b, corner) < 0.0);
            let beside = |axis: usize| {
                triangle.iter().all(|p| p[axis] < node.low[axis])
                    || triangle.iter().all(|p| p[axis] > node.high[axis])
            };
            if beside(0) || beside(1) || sides.iter().any(outside) {
                continue;
            }
            match node.children {
                Some(children) => todo.extend(children),
                None => {
                    let own = &self.order[node.range.clone()];
                    if own.iter().any(|&point| self.is_remaining[point] && holds(points[point])) {
                        return true;
                    }
                }
            }
        }
        false
    }
}
