//! Meshes that unit tests share.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::{DVec3, TriMesh, Vec3};

/// Positions and triangles of a unit sphere: an octahedron, its triangles divided into four `levels` times.
pub fn sphere(levels: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = vec![DVec3::x(), -DVec3::x(), DVec3::y(), -DVec3::y(), DVec3::z(), -DVec3::z()];
    let mut triangles: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[i, j]| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (positions, triangles)
}

/// Positions and triangles of a torus with edges of 0.3 to 0.9. Triangles 2n and 2n + 1 share their first edge.
pub fn torus() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    // Quads around its axis, and across its tube.
    const AROUND: u32 = 80;
    const ACROSS: u32 = 24;
    let position = |n: u32| {
        let turn = |n: u32, of: u32| TAU * f64::from(n) / f64::from(of);
        let (u, v) = (turn(n / ACROSS, AROUND), turn(n % ACROSS, ACROSS));
        let far = 6.0 + 2.0 * libm::cos(v);
        DVec3::new(far * libm::cos(u), 2.0 * libm::sin(v), far * libm::sin(u))
    };
    let quad = |n: u32| {
        let at = |i: u32, j: u32| (n / ACROSS + i) % AROUND * ACROSS + (n % ACROSS + j) % ACROSS;
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
        [[a, c, b], [c, a, d]]
    };
    ((0..AROUND * ACROSS).map(position).collect(), (0..AROUND * ACROSS).flat_map(quad).collect())
}

/// A tetrahedron with a corner at (at, at, at).
pub fn tetrahedron(at: f32) -> TriMesh {
    let shift = Vec3::new(at, at, at);
    TriMesh {
        positions: [Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()].map(|p| p + shift).to_vec(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
}

/// Two meshes as one.
pub fn both(mut first: TriMesh, second: &TriMesh) -> TriMesh {
    first.append(second);
    first
}
