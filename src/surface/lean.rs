//! How vertices lean against the particles' surface: a merge is seen by it before it moves a vertex far. Where a bridge has just formed
//! between two parts, the surface nearest to the vertices under it is the bridge's side: not far yet, but across.

use super::project::Foot;
use crate::base::DVec3;

/// A vertex that leans so much more than a frame ago has lost its surface: from upright to across is 1.
pub const MOST: f32 = 0.7;

/// Unit normals of vertices: means over the triangles around, weighted by their areas; 0 where there is none.
pub fn normals(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::zeros(); vertices.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| vertices[corner as usize]);
        let doubled = (b - a).cross(&(c - a));
        triangle.iter().for_each(|corner| sums[*corner as usize] += doubled);
    }
    sums.iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default().cast::<f32>().into()).collect()
}

/// The cosine of the angle between a vertex' normal and the way outward from its foot.
pub fn of(normal: &[f32; 3], foot: &Foot) -> f32 {
    DVec3::from(normal.map(f64::from)).dot(&foot.outward) as f32
}
