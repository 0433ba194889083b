//! Normals of vertices, for shading.

use std::collections::HashMap;

use super::coincident;
use crate::geometry::lists::Lists;
use crate::geometry::shape::normal;
use crate::geometry::{DVec3, Vec3};

/// Unit normals of the vertices: means over the triangles around, weighted by area; zero where there is none.
pub fn smooth(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::zeros(); positions.len()];
    for (triangle, doubled) in triangles.iter().zip(doubled_areas(positions, triangles)) {
        triangle.iter().for_each(|&corner| sums[corner as usize] += doubled);
    }
    let unit = |sum: &DVec3| sum.try_normalize(0.0).unwrap_or_default().cast();
    sums.iter().map(unit).collect()
}

/// Unit normals of corners, and for each corner of the triangles the index of its own: means over the triangles around its position,
/// weighted by area, whose normals differ from that of its triangle by less than an angle with this cosine. Vertices at one position
/// count as one, so that seams of texture coordinates do not show. A triangle without an area has the normal of Y.
pub fn creased(positions: &[Vec3], triangles: &[[u32; 3]], cosine: f64) -> (Vec<Vec3>, Vec<u32>) {
    let areas = doubled_areas(positions, triangles);
    let units: Vec<DVec3> = areas.iter().map(|area| area.try_normalize(0.0).unwrap_or_default()).collect();
    let firsts = coincident(positions.iter().map(|position| position.cast()));
    let numbered =
        (0..).zip(triangles).flat_map(|(triangle, corners)| corners.map(|corner| (corner, triangle)));
    let around =
        Lists::new(positions.len(), numbered.map(|(corner, triangle)| (firsts[corner as usize], triangle)));
    let (mut normals, mut indices) = (Vec::new(), Vec::with_capacity(3 * triangles.len()));
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for (triangle, corners) in triangles.iter().enumerate() {
        for corner in corners {
            let position = firsts[*corner as usize];
            let near = around.get(position as usize).iter().map(|other: &u32| *other as usize);
            let smooth = near.filter(|other| units[*other].dot(&units[triangle]) > cosine);
            let sum: DVec3 = smooth.map(|other| areas[other]).sum();
            let unit: Vec3 = sum.try_normalize(0.0).unwrap_or_else(DVec3::y).cast();
            let index = *known.entry(<[f32; 3]>::from(unit).map(f32::to_bits)).or_insert_with(|| {
                normals.push(unit);
                normals.len() as u32 - 1
            });
            indices.push(index);
        }
    }
    (normals, indices)
}

/// Normals of the triangles, twice as long as their areas.
fn doubled_areas(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize].cast());
    triangles.iter().map(|triangle| normal(&corners(triangle))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;

    #[test]
    fn a_cube_has_sharp_edges_and_a_shallow_roof_has_none() {
        let cube = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        let (normals, indices) = creased(&cube.positions, &cube.triangles, 0.8);
        assert_eq!((normals.len(), indices.len()), (6, 36));
        for (triangle, indices) in indices.chunks(3).enumerate() {
            let flat = normal(&cube.corners(triangle)).normalize().cast();
            assert!(indices.iter().all(|index| normals[*index as usize] == flat));
        }
        // Two faces that meet at 6 degrees, of vertices of their own.
        let ridge = [[0.0, 0.1, 0.0], [0.0, 0.1, 1.0]].map(Vec3::from);
        let (left, right) = (Vec3::new(-2.0, 0.0, 0.5), Vec3::new(2.0, 0.0, 0.5));
        let roof = [ridge[0], left, ridge[1], ridge[0], ridge[1], right];
        let (normals, indices) = creased(&roof, &[[0, 1, 2], [3, 4, 5]], 0.8);
        assert_eq!(indices[0], indices[3]);
        let at_ridge = normals[indices[0] as usize];
        assert!((at_ridge.x.abs() < 1e-6) && (at_ridge.norm() - 1.0).abs() < 1e-6, "{at_ridge}");
    }
}
