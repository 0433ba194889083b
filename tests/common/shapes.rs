//! Shapes whose size is known.

use frazil::base::{TriMesh, Vec3};

/// A box around the origin with the given edges (m), 12 triangles.
pub fn cuboid(size: [f32; 3]) -> TriMesh {
    let half = Vec3::from(size) / 2.0;
    let corner = |i: u32| {
        let side = |bit: u32, axis: usize| if i >> bit & 1 == 1 { half[axis] } else { -half[axis] };
        Vec3::new(side(0, 0), side(1, 1), side(2, 2))
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { positions: (0..8).map(corner).collect(), triangles }
}

/// A sphere of 12 n^2 triangles: a cube's faces, each n x n squares, blown up.
pub fn sphere(radius: f32, n: usize) -> TriMesh {
    star(n, |_| radius)
}

/// A bumpy closed body of 12 n^2 triangles, about `size` across.
pub fn blob(size: f32, n: usize) -> TriMesh {
    star(n, |d| {
        size / 2.0 * (0.9 + 0.06 * (5.0 * d.x).sin() * (4.0 * d.y).cos() + 0.04 * (9.0 * d.z + d.x).sin())
    })
}

/// A closed star-shaped body; `radius` gives its reach in a direction.
fn star(n: usize, radius: impl Fn(Vec3) -> f32) -> TriMesh {
    let mut mesh = TriMesh::default();
    for face in 0..6 {
        let first = mesh.positions.len() as u32;
        let at = |i: usize, j: usize| first + (i * (n + 1) + j) as u32;
        for i in 0..=n {
            for j in 0..=n {
                let tangent =
                    |k: usize| (((2 * k) as f32 / n as f32 - 1.0) * std::f32::consts::FRAC_PI_4).tan();
                // The rims of neighbouring faces must be the same bits.
                let (u, v) = (exact(tangent(i), i, n), exact(tangent(j), j, n));
                let p =
                    [[1.0, u, v], [-1.0, v, u], [v, 1.0, u], [u, -1.0, v], [u, v, 1.0], [v, u, -1.0]][face];
                let direction = Vec3::from(p).normalize();
                mesh.positions.push(direction * radius(direction));
            }
        }
        for i in 0..n {
            for j in 0..n {
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

fn exact(value: f32, index: usize, n: usize) -> f32 {
    if index == 0 {
        -1.0
    } else if index == n {
        1.0
    } else {
        value
    }
}

/// A closed capsule between two points (m), its rings along the axis.
fn capsule(a: Vec3, b: Vec3, radius: f32, n: usize) -> TriMesh {
    let mut mesh = sphere(1.0, n);
    let axis = (b - a).normalize();
    let side = axis.cross(&if axis.y.abs() < 0.9 { Vec3::y() } else { Vec3::x() }).normalize();
    let other = axis.cross(&side);
    for p in &mut mesh.positions {
        let end = if p.z > 0.0 { b } else { a };
        *p = end + (side * p.x + other * p.y + axis * p.z) * radius;
    }
    mesh
}

/// A standing figure 1.7 m tall of overlapping closed parts, about 12 n^2 x 9 triangles (50,000 for n = 21).
pub fn figure(n: usize) -> TriMesh {
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let parts = [
        (at(-0.1, 0.06, 0.0), at(-0.1, 0.8, 0.0), 0.07),
        (at(0.1, 0.06, 0.2), at(0.1, 0.8, 0.0), 0.07),
        (at(-0.1, 0.05, -0.05), at(-0.1, 0.05, 0.17), 0.05),
        (at(0.1, 0.05, 0.15), at(0.1, 0.05, 0.37), 0.05),
        (at(-0.09, 0.9, 0.0), at(0.09, 0.9, 0.0), 0.13),
        (at(0.0, 0.95, 0.0), at(0.0, 1.3, 0.0), 0.16),
        (at(-0.2, 1.35, 0.0), at(-0.3, 0.8, 0.2), 0.05),
        (at(0.2, 1.35, 0.0), at(0.3, 0.8, -0.2), 0.05),
        (at(0.0, 1.55, 0.0), at(0.0, 1.6, 0.02), 0.1),
    ];
    let mut mesh = TriMesh::default();
    parts.iter().for_each(|&(a, b, radius)| mesh.append(&capsule(a, b, radius, n)));
    mesh
}
