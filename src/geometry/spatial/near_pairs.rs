//! Pairs of triangles that may meet, found without comparing all pairs.
//!
//! Boxes separate most triangles, but not those around a common vertex, which all their boxes contain. If many triangles share a vertex, a
//! hub, they are separated by the arcs in which the hub sees them: two triangles share more than the hub only if their arcs meet.

use std::cmp::Reverse;

use super::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh, Vec3};

/// Maximum triangles around a vertex that is not a hub.
const MAX_TRIANGLES: u32 = 16;
/// Margin of arc boxes, in radii of the sphere that they lie on: far more than rounding to 32 bits costs.
const MARGIN: f64 = 1e-6;

/// Minimum and maximum corner of a box (m).
type Span = (Vec3, Vec3);

/// The triangles of a mesh, in trees of boxes.
pub(in crate::geometry) struct NearPairs<'a> {
    mesh: &'a TriMesh,
    /// Triangles without a hub.
    others: Boxes,
    /// Triangles by their hub: if a triangle has several, by the one with most triangles.
    fans: Vec<Fan>,
    /// The fans, as one box each.
    all_fans: Boxes,
    /// The fan of each triangle.
    fan_of: Vec<Option<usize>>,
}

/// The triangles of a hub, by position and by the arc in which the hub sees them.
struct Fan {
    hub: u32,
    boxes: Boxes,
    arcs: Boxes,
}

impl<'a> NearPairs<'a> {
    /// Requires triangles with an area, and corners joined by position.
    pub(in crate::geometry) fn of(mesh: &'a TriMesh) -> Self {
        let mut near = Self {
            mesh,
            others: Boxes::new(std::iter::empty()),
            fans: Vec::new(),
            all_fans: Boxes::new(std::iter::empty()),
            fan_of: vec![None; mesh.triangles.len()],
        };
        let mut by_hub: Vec<(Option<u32>, usize)> = hubs(mesh).into_iter().zip(0..).collect();
        by_hub.sort_unstable();
        for group in by_hub.chunk_by(|a, b| a.0 == b.0) {
            let members = || group.iter().map(|(_, triangle)| *triangle);
            let boxes = Boxes::new(members().map(|triangle| (span(mesh, triangle), triangle)));
            let Some(hub) = group[0].0 else {
                near.others = boxes;
                continue;
            };
            let arcs = Boxes::new(members().map(|triangle| (arc(mesh, triangle, hub), triangle)));
            members().for_each(|triangle| near.fan_of[triangle] = Some(near.fans.len()));
            near.fans.push(Fan { hub, boxes, arcs });
        }
        let whole = |(fan, number): (&Fan, usize)| (fan.boxes.whole, number);
        near.all_fans = Boxes::new(near.fans.iter().zip(0..).map(whole));
        near
    }

    /// Calls `see` with the triangles that a triangle may meet elsewhere than in common corners and edges, or along a common edge; over all
    /// triangles every such pair is seen once, from one of its two triangles.
    pub(in crate::geometry) fn of_triangle(&self, triangle: usize, mut see: impl FnMut(usize)) {
        let (own, here) = (self.fan_of[triangle], span(self.mesh, triangle));
        self.others.touching(here, |other| {
            if own.is_some() || other > triangle {
                see(other);
            }
        });
        let Some(own) = own else { return };
        let fan = &self.fans[own];
        fan.arcs.touching(arc(self.mesh, triangle, fan.hub), |other| {
            if other > triangle {
                see(other);
            }
        });
        self.all_fans.touching(here, |fan| {
            if fan > own {
                self.fans[fan].boxes.touching(here, &mut see);
            }
        });
    }
}

/// The hub of each triangle: the corner with most triangles around it, if these are many.
fn hubs(mesh: &TriMesh) -> Vec<Option<u32>> {
    let mut around = vec![0u32; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&vertex| around[vertex as usize] += 1);
    let hub = |corners: &[u32; 3]| {
        let fullest =
            corners.iter().copied().max_by_key(|&vertex| (around[vertex as usize], Reverse(vertex)));
        fullest.filter(|&vertex| around[vertex as usize] > MAX_TRIANGLES)
    };
    mesh.triangles.iter().map(hub).collect()
}

fn span(mesh: &TriMesh, triangle: usize) -> Span {
    let [a, b, c] = mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize]);
    (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
}

/// A box around the arc in which a corner sees its triangle, on the unit sphere around the corner.
fn arc(mesh: &TriMesh, triangle: usize, hub: u32) -> Span {
    let corners = mesh.triangles[triangle];
    let position = |vertex: u32| mesh.positions[vertex as usize].cast::<f64>();
    let first = corners.iter().position(|&corner| corner == hub).unwrap_or(0);
    let end = |next: usize| (position(corners[(first + next) % 3]) - position(hub)).normalize();
    let (a, b) = (end(1), end(2));
    // Half the sum reaches the middle of the chord; the arc rises above the chord by the rest of the radius.
    let rise = DVec3::repeat(1.0 - (a + b).norm() / 2.0 + MARGIN);
    ((a.inf(&b) - rise).cast(), (a.sup(&b) + rise).cast())
}

/// A tree of numbered boxes.
struct Boxes {
    tree: Bvh,
    numbers: Vec<usize>,
    /// The box around all.
    whole: Span,
}

impl Boxes {
    fn new(boxes: impl Iterator<Item = (Span, usize)>) -> Self {
        let (boxes, numbers): (Vec<Span>, Vec<usize>) = boxes.unzip();
        let empty = (Vec3::repeat(f32::INFINITY), Vec3::repeat(f32::NEG_INFINITY));
        let around = |(low, high): Span, (a, b): &Span| (low.inf(a), high.sup(b));
        let whole = boxes.iter().fold(empty, around);
        // Each box as a triangle with these bounds.
        let positions = boxes.iter().flat_map(|&(low, high)| [low, high]).collect();
        let triangles = (0..boxes.len() as u32).map(|n| [2 * n, 2 * n, 2 * n + 1]).collect();
        Self { tree: Bvh::new(&TriMesh { positions, triangles }), numbers, whole }
    }

    /// Calls `see` with the numbers of the boxes that touch a box.
    fn touching(&self, (low, high): Span, mut see: impl FnMut(usize)) {
        self.tree.in_box(low, high, |at| see(self.numbers[at]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::check::intersection::{Meeting, meeting};
    use crate::geometry::check::predicates::is_flat;

    /// Triangles on a coarse lattice, most of them around the first few vertices.
    fn tangle(seed: u64) -> TriMesh {
        let mut state = seed;
        let mut below = |count: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % count
        };
        let positions: Vec<Vec3> =
            (0..343).map(|n| Vec3::new((n % 7) as f32, (n / 7 % 7) as f32, (n / 49) as f32)).collect();
        let hubs = [171, 0, 172, 24];
        let mut triangles = Vec::new();
        while triangles.len() < 400 {
            let mut any = || below(343) as u32;
            let corners = [any(), any(), any()];
            let corners =
                if below(4) > 0 { [hubs[below(4) as usize], corners[1], corners[2]] } else { corners };
            if !is_flat(&corners.map(|vertex| positions[vertex as usize])) {
                triangles.push(corners);
            }
        }
        TriMesh { positions, triangles }
    }

    #[test]
    fn all_pairs_that_meet_are_seen_once() {
        for seed in 1..5 {
            let mesh = tangle(seed);
            let near = NearPairs::of(&mesh);
            assert!(near.fans.len() >= 3 && near.fan_of.iter().any(|fan| fan.is_none()));
            let mut seen = Vec::new();
            for first in 0..mesh.triangles.len() {
                near.of_triangle(first, |second| seen.push((first.min(second), first.max(second))));
            }
            seen.sort_unstable();
            let count = seen.len();
            seen.dedup();
            assert_eq!(seen.len(), count);
            let corners = |t: usize| mesh.triangles[t].map(|vertex| mesh.positions[vertex as usize]);
            let meets = |a: usize, b: usize| meeting(&corners(a), &corners(b)) != Meeting::Apart;
            let all = (0..mesh.triangles.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
            let missed: Vec<_> =
                all.filter(|&(a, b)| meets(a, b) && seen.binary_search(&(a, b)).is_err()).collect();
            assert!(missed.is_empty(), "{missed:?}");
        }
    }

    #[test]
    fn triangles_around_a_vertex_see_their_neighbours_only() {
        let n = 5_000u32;
        let rim = (0..n).map(|at| {
            let (sin, cos) = (std::f32::consts::TAU * at as f32 / n as f32).sin_cos();
            Vec3::new(cos, sin, cos)
        });
        let positions: Vec<Vec3> = rim.chain([Vec3::zeros()]).collect();
        let around: Vec<[u32; 3]> = (0..n).map(|at| [n, at, (at + 1) % n]).collect();
        let from_the_rim: Vec<[u32; 3]> = (1..n - 1).map(|at| [0, at, at + 1]).collect();
        for triangles in [around, from_the_rim] {
            let mesh = TriMesh { positions: positions.clone(), triangles };
            let near = NearPairs::of(&mesh);
            let mut pairs = 0;
            (0..mesh.triangles.len()).for_each(|triangle| near.of_triangle(triangle, |_| pairs += 1));
            assert!((n as usize - 3..3 * n as usize).contains(&pairs), "{pairs}");
        }
    }
}
