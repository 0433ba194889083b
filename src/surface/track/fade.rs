//! Detail fades (suggested in thesis 2.8): a runny liquid does not keep what was sculpted into it.
//!
//! Delta halves in a given time, and shrinks with the strain of the mesh around a vertex. Detail retention slows both; at 1 nothing fades.

use crate::geometry::DVec3;
use crate::surface::tracked_mesh::Tracker;

/// The distance that each vertex keeps after a step of `dt` (s) in which the vertices are carried to `carried` (m).
pub fn fade(tracker: &Tracker, carried: &[DVec3], dt: f64) -> Vec<f32> {
    let params = &tracker.params;
    let mut delta = tracker.delta.clone();
    if params.half_life.is_infinite() && params.fade == 0.0 {
        return delta;
    }
    let rate = std::f64::consts::LN_2 * dt / params.half_life;
    let strains = if params.fade > 0.0 { strains(tracker, carried) } else { Vec::new() };
    for (vertex, delta) in delta.iter_mut().enumerate() {
        let strain = strains.get(vertex).map_or(0.0, |strain| params.fade * strain);
        let detail_retention = tracker.detail_retention.get(vertex).map_or(0.0, |share| f64::from(*share));
        *delta = (f64::from(*delta) * libm::exp(-(rate + strain) * (1.0 - detail_retention))) as f32;
    }
    delta
}

/// Strain of the edges around each vertex: the mean absolute logarithm of the ratio of their lengths after and before the step.
fn strains(tracker: &Tracker, carried: &[DVec3]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0u32); carried.len()];
    for &[a, b, c] in &tracker.triangles {
        for [a, b] in [[a, b], [b, c], [c, a]].map(|edge| edge.map(|vertex| vertex as usize)) {
            let before = (tracker.vertices[a] - tracker.vertices[b]).norm();
            let now = (carried[a] - carried[b]).norm();
            if before > 0.0 && now > 0.0 {
                let strain = libm::log(now / before).abs();
                for vertex in [a, b] {
                    sums[vertex].0 += strain;
                    sums[vertex].1 += 1;
                }
            }
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0 { sum / f64::from(count) } else { 0.0 }).collect()
}
