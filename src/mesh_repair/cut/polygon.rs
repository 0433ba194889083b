//! The part of a triangle that a cut leaves, as triangles.

use super::exact::Point;
use super::{Half, Shape};
use crate::geometry::triangulate::ear_clipping::turn;
use crate::geometry::triangulate::{ear_clipping, monotone};

/// Maximum number of corners of a polygon that is triangulated by ear clipping.
const MAX_EAR_CLIPPED: usize = 200;

type Corner = (Point, [f64; 2]);

/// Triangulates the part of a triangle that lies to the left of these sides. None if the sides do not join.
pub fn polygons(shape: &Shape, triangle: u32, halves: Vec<Half>) -> Option<Vec<[Point; 3]>> {
    let [a, b, c] = shape.triangles[triangle as usize].map(|vertex| shape.position(Point::Vertex(vertex)));
    let [a, b, c] = [a?, b?, c?];
    let normal = (b - a).cross(&(c - a));
    let along = normal.iamax();
    let (x, y) = if normal[along] < 0.0 {
        ((along + 2) % 3, (along + 1) % 3)
    } else {
        ((along + 1) % 3, (along + 2) % 3)
    };
    let mut outer: Vec<Vec<Corner>> = Vec::new();
    let mut holes: Vec<Vec<Corner>> = Vec::new();
    for ring in rings(halves)? {
        let seen = |point: Point| {
            shape.position(point).map(|position| (point, [position[x] - a[x], position[y] - a[y]]))
        };
        let ring: Vec<Corner> = ring.into_iter().map(seen).collect::<Option<_>>()?;
        // A ring whose points all lie inside the triangle is a hole or an island.
        let is_within = ring.iter().all(|(point, _)| matches!(point, Point::OnTriangle(..)));
        if is_within && area(&ring) < 0.0 { holes.push(ring) } else { outer.push(ring) }
    }
    // Starting from the leftmost hole, so that a bridge never passes through a hole that is still to be joined.
    let left = |ring: &Vec<Corner>| ring.iter().map(|(_, at)| at[0]).fold(f64::INFINITY, f64::min);
    holes.sort_by(|a, b| left(a).total_cmp(&left(b)));
    for hole in holes {
        join(&mut outer, hole)?;
    }
    let mut out = Vec::new();
    for ring in outer {
        if ring.len() < 3 {
            return None;
        }
        let flat: Vec<[f64; 2]> = ring.iter().map(|(_, at)| *at).collect();
        let cut = if flat.len() > MAX_EAR_CLIPPED { monotone::triangles } else { ear_clipping::triangles };
        out.extend(cut(&flat).into_iter().map(|corners| corners.map(|at| ring[at].0)));
    }
    Some(out)
}

/// Joins sides to rings. Where two sides continue from a point, the one in the same cell is taken.
fn rings(mut halves: Vec<Half>) -> Option<Vec<Vec<Point>>> {
    halves.sort_unstable_by_key(|half| (half.ends, half.cell));
    let mut is_done = vec![false; halves.len()];
    let mut out = Vec::new();
    for start in 0..halves.len() {
        if is_done[start] {
            continue;
        }
        let mut ring = Vec::new();
        let mut at = start;
        loop {
            is_done[at] = true;
            ring.push(halves[at].ends[0]);
            let [_, to] = halves[at].ends;
            let first = halves.partition_point(|half| half.ends[0] < to);
            let onward = (first..halves.len()).take_while(|next| halves[*next].ends[0] == to);
            let is_same_cell = |next: &usize| halves[*next].cell == halves[at].cell;
            let open: Vec<usize> = onward.filter(|next| !is_done[*next] || *next == start).collect();
            let next = *open.iter().find(|next| open.len() == 1 || is_same_cell(next))?;
            if next == start {
                break;
            }
            at = next;
        }
        out.push(ring);
    }
    Some(out)
}

fn area(ring: &[Corner]) -> f64 {
    (1..ring.len().saturating_sub(1)).map(|at| turn(ring[0].1, ring[at].1, ring[at + 1].1)).sum()
}

/// Joins a hole to the ring around it by a bridge that is traversed in both directions: from the hole's leftmost point to a corner of the
/// ring that is visible from there.
fn join(outer: &mut [Vec<Corner>], hole: Vec<Corner>) -> Option<()> {
    let start = (0..hole.len()).min_by(|a, b| hole[*a].1[0].total_cmp(&hole[*b].1[0]))?;
    let from = hole[start].1;
    // The nearest side to the left.
    let mut nearest: Option<(f64, usize, usize)> = None;
    for (number, ring) in outer.iter().enumerate() {
        for side in 0..ring.len() {
            let (a, b) = (ring[side].1, ring[(side + 1) % ring.len()].1);
            // Seen from inside, a side to the left runs down.
            if !(a[1] >= from[1] && b[1] <= from[1] && a[1] > b[1]) {
                continue;
            }
            let at = a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            if at <= from[0] && nearest.is_none_or(|(best, ..)| at > best) {
                nearest = Some((at, number, side));
            }
        }
    }
    let (at, number, side) = nearest?;
    let ring = &mut outer[number];
    let count = ring.len();
    let ends = [side, (side + 1) % count];
    // The end of that side farther to the left, unless corners lie between: then the one of them nearest in direction.
    let end = *ends.iter().min_by(|a, b| ring[**a].1[0].total_cmp(&ring[**b].1[0]))?;
    let triangle = if ring[end].1[1] > from[1] {
        [from, ring[end].1, [at, from[1]]]
    } else {
        [from, [at, from[1]], ring[end].1]
    };
    let holds = |p: [f64; 2]| (0..3).all(|side| turn(triangle[side], triangle[(side + 1) % 3], p) >= 0.0);
    let slope = |corner: usize| {
        let [dx, dy] = [from[0] - ring[corner].1[0], (ring[corner].1[1] - from[1]).abs()];
        (dy / dx.max(f64::MIN_POSITIVE), dx)
    };
    let is_reflex = |corner: usize| {
        turn(ring[(corner + count - 1) % count].1, ring[corner].1, ring[(corner + 1) % count].1) < 0.0
    };
    let between =
        (0..count).filter(|corner| *corner == end || (is_reflex(*corner) && holds(ring[*corner].1)));
    let to = between.min_by(|a, b| {
        let (a, b) = (slope(*a), slope(*b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    })?;
    let mut bridged: Vec<Corner> = ring[..=to].to_vec();
    bridged.extend((0..=hole.len()).map(|step| hole[(start + step) % hole.len()]));
    bridged.extend_from_slice(&ring[to..]);
    *ring = bridged;
    Some(())
}
