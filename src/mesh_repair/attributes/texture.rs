//! Texture coordinates of new geometry, from those of the first frame.
//!
//! Each vertex of charted triangles has its own coordinate, that of the position on the first mesh nearest to where the liquid there was,
//! shared by the triangles around it on one side of a seam. Where that position lies across a seam from a triangle's chart, the triangle's
//! corner takes the nearest coordinate on the chart.
//!
//! Beside kept triangles, the mesh and the particles may have drifted apart slightly. A vertex there keeps the coordinate that it has in
//! those triangles, and the difference is spread over the new geometry: the texture continues without a seam and without a row of stretched
//! triangles. Spreading stops at torn triangles.

use super::charts::{Chart, Charts, longest};
use super::weights::{Weights, interpolated};
use crate::geometry::mesh::{drop_marked, renumber_kept};
use crate::geometry::{TriMesh, Uvs};

/// A coordinate, or a difference of two.
type Pair = [f64; 2];

/// The coordinates of two positions on the first mesh are on the same side of a seam if they differ by at most this many times the largest
/// gradient of the coordinates, on the two positions' triangles, times the distance between the positions.
const SEAMLESS: f64 = 4.0;
/// Rounding to 32 bits may change equal coordinates by this much.
const ROUNDING: f64 = 1e-6;
/// Two coordinates of a vertex are about the same if they differ by at most this many edges of the new triangle.
const SAME: f64 = 2.0;
/// Share of a difference that is passed on from one vertex to the next: far from kept triangles the texture is that of the first frame.
const FADES: f64 = 0.8;
/// Number of passes that spread differences.
const SWEEPS: usize = 48;
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Writes the coordinates of the first frame into those that a mesh has from the previous mesh; `is_kept` is, for each of the charts'
/// vertices, whether it existed before, or a triangle without a chart uses it too. If coordinates are stored at vertices, charted triangles
/// with a vertex that keeps a coordinate from far away are torn.
pub(in crate::mesh_repair) fn textured(
    charts: &mut Charts<'_>,
    first: &Uvs,
    out: &mut Uvs,
    mesh: &TriMesh,
    is_kept: &[bool],
) {
    if charts.list.is_empty() {
        // New geometry has coordinates of the previous mesh, and each change adds some.
        tidy(out, first.coordinates.len());
        return;
    }
    let texture = Texture::of(charts, first, mesh);
    let near = KeptCoordinates::of(charts, out, mesh, is_kept);
    // The coordinates that vertices keep, and the differences from them.
    let kept: Vec<Option<u32>> = (0..charts.vertices.len())
        .map(|slot| near.nearest(slot, out, texture.own[slot], texture.reach[slot]))
        .collect();
    let differences = kept.iter().zip(&texture.own).map(|(kept, own)| {
        let position = out.coordinates[(*kept)? as usize].map(f64::from);
        Some([position[0] - own[0], position[1] - own[1]])
    });
    let spread = texture.spread(charts, differences.collect());
    let own = |slot: usize| [0, 1].map(|axis| (texture.own[slot][axis] + spread[slot][axis]) as f32);
    if out.corners.is_none() {
        for (slot, name) in charts.vertices.iter().enumerate().filter(|(slot, _)| !is_kept[*slot]) {
            out.coordinates[*name as usize] = own(slot);
        }
        let is_far = |slot: &usize| is_kept[*slot] && kept[*slot].is_none();
        charts.list.iter_mut().for_each(|chart| chart.is_torn |= chart.slots.iter().any(is_far));
        return;
    }
    let mut made: Vec<Option<u32>> = vec![None; charts.vertices.len()];
    let mut indices = Vec::with_capacity(3 * charts.list.len());
    for (chart, corners) in charts.list.iter().zip(&texture.corners) {
        for (slot, corner) in chart.slots.into_iter().zip(&corners.of) {
            let found = match corner {
                Corner::Own => kept[slot].or(made[slot]),
                Corner::Chart(_) if chart.is_torn => None,
                Corner::Chart(position) => near.nearest(slot, out, *position, corners.reach),
            };
            let index = found.unwrap_or_else(|| {
                let position = match corner {
                    Corner::Own => own(slot),
                    Corner::Chart(position) => position.map(|x| x as f32),
                };
                out.coordinates.push(position);
                out.coordinates.len() as u32 - 1
            });
            if let Corner::Own = corner {
                made[slot] = Some(index);
            }
            indices.push(index);
        }
    }
    if let Some(corners) = &mut out.corners {
        for (chart, own) in charts.list.iter().zip(indices.chunks(3)) {
            corners[3 * chart.number..3 * chart.number + 3].copy_from_slice(own);
        }
    }
    tidy(out, first.coordinates.len());
}

/// Removes coordinates that no corner uses, except those of the first mesh.
fn tidy(uvs: &mut Uvs, first: usize) {
    let Some(corners) = &mut uvs.corners else { return };
    let mut is_unused: Vec<bool> = (0..uvs.coordinates.len()).map(|at| at >= first).collect();
    corners.iter().for_each(|corner| is_unused[*corner as usize] = false);
    renumber_kept(corners, &is_unused);
    drop_marked(&mut uvs.coordinates, &is_unused);
}

/// Where a corner of a charted triangle takes its coordinate from.
#[derive(Clone, Copy)]
enum Corner {
    /// The coordinate of its vertex.
    Own,
    /// The coordinate at a position on the chart.
    Chart(Pair),
}

/// Corners of a charted triangle.
struct Corners {
    of: [Corner; 3],
    /// Largest difference at which coordinates are about the same.
    reach: f64,
}

/// Coordinates of the first frame, for the charts' vertices and triangles.
struct Texture {
    /// For each vertex.
    own: Vec<Pair>,
    /// Largest difference at which coordinates are about the same, for each vertex.
    reach: Vec<f64>,
    /// For each triangle.
    corners: Vec<Corners>,
}

impl Texture {
    fn of(charts: &Charts<'_>, first: &Uvs, mesh: &TriMesh) -> Self {
        let triangles = &charts.first.mesh.triangles;
        let at = |triangle: usize, weights: &Weights| -> Pair {
            let corners = first.indices(triangles, triangle).map(|index| first.coordinates[index as usize]);
            interpolated(corners, weights).map(f64::from)
        };
        let own: Vec<Pair> = charts.spots.iter().map(|spot| at(spot.triangle, &spot.weights)).collect();
        // Largest change of coordinates per metre on a triangle of the first mesh.
        let rate = |triangle: usize| {
            let positions = charts.first.mesh.corners(triangle);
            let corners = first.indices(triangles, triangle).map(|index| first.coordinates[index as usize]);
            let corners = corners.map(|position| position.map(f64::from));
            let of_edge = |[a, b]: [usize; 2]| {
                let length = (positions[b] - positions[a]).norm();
                if length > 0.0 { distance(corners[a], corners[b]) / length } else { 0.0 }
            };
            EDGES.into_iter().map(of_edge).fold(0.0, f64::max)
        };
        let rates: Vec<f64> = charts.spots.iter().map(|spot| rate(spot.triangle)).collect();
        let corners_of = |chart: &Chart| {
            let of_chart = rate(chart.triangle);
            let corner = |n: usize| {
                let (slot, weights) = (chart.slots[n], &chart.corners[n]);
                let on_chart = at(chart.triangle, weights);
                let off = (charts.position(&charts.spots[slot]) - charts.at(chart.triangle, weights)).norm();
                let max_difference = SEAMLESS * of_chart.max(rates[slot]) * off + ROUNDING;
                let is_own = !chart.is_torn && distance(own[slot], on_chart) <= max_difference;
                if is_own { (Corner::Own, own[slot]) } else { (Corner::Chart(on_chart), on_chart) }
            };
            let found = [0, 1, 2].map(corner);
            let of_edge = |[a, b]: [usize; 2]| distance(found[a].1, found[b].1);
            let long = EDGES.into_iter().map(of_edge).fold(0.0, f64::max);
            let reach = SAME * long.max(of_chart * longest(&mesh.corners(chart.number)));
            Corners { of: found.map(|(corner, _)| corner), reach }
        };
        let corners: Vec<Corners> = charts.list.iter().map(corners_of).collect();
        let mut reach = vec![0.0f64; charts.vertices.len()];
        for (chart, corners) in charts.list.iter().zip(&corners).filter(|(chart, _)| !chart.is_torn) {
            for slot in chart.slots {
                reach[slot] = reach[slot].max(corners.reach);
            }
        }
        Self { own, reach, corners }
    }

    /// Differences of all vertices, from those that have one: each vertex takes most of the mean of its neighbours' differences, through
    /// triangles that are not torn and have no seam between the two.
    fn spread(&self, charts: &Charts<'_>, fixed: Vec<Option<Pair>>) -> Vec<Pair> {
        let mut links: Vec<(usize, usize)> = Vec::new();
        for (chart, corners) in charts.list.iter().zip(&self.corners).filter(|(chart, _)| !chart.is_torn) {
            for [a, b] in EDGES {
                if let (Corner::Own, Corner::Own) = (corners.of[a], corners.of[b]) {
                    let [a, b] = [a, b].map(|n| chart.slots[n]);
                    links.extend([(a, b), (b, a)]);
                }
            }
        }
        links.sort_unstable();
        links.dedup();
        let mut now = fixed.clone();
        for _ in 0..SWEEPS {
            for around in links.chunk_by(|a, b| a.0 == b.0) {
                let slot = around[0].0;
                if fixed[slot].is_some() {
                    continue;
                }
                let known = around.iter().filter_map(|(_, other)| now[*other]);
                let (sum, count) = known.fold(([0.0; 2], 0.0), |(sum, count), difference| {
                    ([sum[0] + difference[0], sum[1] + difference[1]], count + 1.0)
                });
                if count > 0.0 {
                    now[slot] = Some(sum.map(|x| FADES * x / count));
                }
            }
        }
        now.into_iter().map(Option::unwrap_or_default).collect()
    }
}

/// The coordinates that the charts' vertices have in other triangles: slots, each with the indices of its coordinates, ascending.
struct KeptCoordinates(Vec<(usize, u32)>);

impl KeptCoordinates {
    fn of(charts: &Charts<'_>, out: &Uvs, mesh: &TriMesh, is_kept: &[bool]) -> Self {
        let mut slots = vec![None; mesh.positions.len()];
        charts.vertices.iter().enumerate().for_each(|(slot, name)| slots[*name as usize] = Some(slot));
        let mut list = Vec::new();
        if out.corners.is_none() {
            let kept = charts.vertices.iter().enumerate().filter(|(slot, _)| is_kept[*slot]);
            list.extend(kept.map(|(slot, name)| (slot, *name)));
            return Self(list);
        }
        for number in charts.others(&mesh.triangles) {
            let indices = out.indices(&mesh.triangles, number);
            for (name, index) in mesh.triangles[number].iter().zip(indices) {
                list.extend(slots[*name as usize].map(|slot| (slot, index)));
            }
        }
        list.sort_unstable();
        list.dedup();
        Self(list)
    }

    /// The index of the coordinate of a slot that is nearest to a position, the first of several; none if all are farther away than `reach`.
    fn nearest(&self, slot: usize, uvs: &Uvs, position: Pair, reach: f64) -> Option<u32> {
        let begin = self.0.partition_point(|(other, _)| *other < slot);
        let own = self.0[begin..].iter().take_while(|(other, _)| *other == slot);
        let far = |index: u32| distance(uvs.coordinates[index as usize].map(f64::from), position);
        let all = own.map(|(_, index)| (far(*index), *index));
        let nearest = all.fold(None, |best: Option<(f64, u32)>, next| match best {
            Some(best) if best.0 <= next.0 => Some(best),
            _ => Some(next),
        });
        nearest.filter(|(far, _)| *far <= reach).map(|(_, index)| index)
    }
}

/// Distance between two coordinates.
fn distance(a: Pair, b: Pair) -> f64 {
    let [u, v] = [b[0] - a[0], b[1] - a[1]];
    (u * u + v * v).sqrt()
}
