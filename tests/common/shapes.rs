//! Shapes whose size is known.

use frazil::geometry::mesh::coincident;
use frazil::geometry::{TriMesh, Vec3};

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

/// Squares with count * count corners, which are where a function of their index, row by row, says.
pub fn squares(count: u32, position: impl Fn(u32) -> Vec3) -> TriMesh {
    let is_square = |index: &u32| index % count + 1 < count && index / count + 1 < count;
    let square = |a: u32| [[a, a + count, a + count + 1], [a, a + count + 1, a + 1]];
    let triangles = (0..count * count).filter(is_square).flat_map(square).collect();
    TriMesh { positions: (0..count * count).map(position).collect(), triangles }
}

/// A mesh in which vertices at one position are the same: closed by index where its faces share their rims.
pub fn welded(mesh: &TriMesh) -> TriMesh {
    let same = coincident(mesh.positions.iter().map(|position| position.cast()));
    let triangles =
        mesh.triangles.iter().map(|corners| corners.map(|corner| same[corner as usize])).collect();
    TriMesh { positions: mesh.positions.clone(), triangles }.without_unused()
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

/// A sphere of meridians and parallels about the y axis (m): `n` around, `m` from pole to pole.
pub fn globe(radius: f32, n: usize, m: usize) -> TriMesh {
    let ring = |i: usize| {
        let (height, across) = (std::f32::consts::PI * i as f32 / m as f32).sin_cos();
        (0..n).map(move |j| {
            let (sin, cos) = (std::f32::consts::TAU * j as f32 / n as f32).sin_cos();
            Vec3::new(height * cos, across, height * sin) * radius
        })
    };
    let mut positions: Vec<Vec3> = (1..m).flat_map(ring).collect();
    let at = |i: usize, j: usize| ((i - 1) * n + j % n) as u32;
    let [top, bottom] = [positions.len() as u32, positions.len() as u32 + 1];
    positions.extend([Vec3::y() * radius, -Vec3::y() * radius]);
    let mut triangles = Vec::new();
    for j in 0..n {
        triangles.extend([[top, at(1, j + 1), at(1, j)], [bottom, at(m - 1, j), at(m - 1, j + 1)]]);
        for i in 1..m - 1 {
            triangles.extend([[at(i, j), at(i, j + 1), at(i + 1, j + 1)]]);
            triangles.extend([[at(i, j), at(i + 1, j + 1), at(i + 1, j)]]);
        }
    }
    TriMesh { positions, triangles }
}

/// A wheel of `n` sides about the y axis (m).
pub fn wheel(radius: f32, width: f32, n: usize) -> TriMesh {
    let rim = |y: f32| {
        let spoke = move |j: usize| {
            let (sin, cos) = (std::f32::consts::TAU * j as f32 / n as f32).sin_cos();
            Vec3::new(cos * radius, y, sin * radius)
        };
        std::iter::once(Vec3::new(0.0, y, 0.0)).chain((0..n).map(spoke))
    };
    let positions = rim(-width / 2.0).chain(rim(width / 2.0)).collect();
    let other = n as u32 + 1;
    let side = |j: u32| {
        let (a, b) = (1 + j, 1 + (j + 1) % n as u32);
        [[0, a, b], [other, other + b, other + a], [a, other + a, other + b], [a, other + b, b]]
    };
    TriMesh { positions, triangles: (0..n as u32).flat_map(side).collect() }
}

/// A ring about the y axis (m): `radius` to the middle of a tube of radius `tube`.
pub fn torus(radius: f32, tube: f32, n: usize, m: usize) -> TriMesh {
    let point = |i: usize, j: usize| {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / n as f32).sin_cos();
        let (up, out) = (std::f32::consts::TAU * j as f32 / m as f32).sin_cos();
        Vec3::new((radius + tube * out) * cos, tube * up, (radius + tube * out) * sin)
    };
    let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let square = |i: usize, j: usize| {
        [[at(i, j), at(i, j + 1), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i + 1, j)]]
    };
    TriMesh {
        positions: (0..n).flat_map(|i| (0..m).map(move |j| point(i, j))).collect(),
        triangles: (0..n).flat_map(|i| (0..m).flat_map(move |j| square(i, j))).collect(),
    }
}

/// A closed tube along y (m) of `rings` + 1 rings of `n` vertices, and the cones that close its ends.
pub fn tube(radius: f32, length: f32, n: usize, rings: usize) -> TriMesh {
    let ring = |i: usize| {
        let y = length * (i as f32 / rings as f32 - 0.5);
        (0..n).map(move |j| {
            let (sin, cos) = (std::f32::consts::TAU * j as f32 / n as f32).sin_cos();
            Vec3::new(radius * cos, y, radius * sin)
        })
    };
    let mut positions: Vec<Vec3> = (0..=rings).flat_map(ring).collect();
    let [bottom, top] = [positions.len() as u32, positions.len() as u32 + 1];
    positions.extend([Vec3::y() * (-length / 2.0), Vec3::y() * (length / 2.0)]);
    let at = |i: usize, j: usize| (i * n + j % n) as u32;
    let mut triangles = Vec::new();
    for j in 0..n {
        triangles.extend([[bottom, at(0, j), at(0, j + 1)], [top, at(rings, j + 1), at(rings, j)]]);
        for i in 0..rings {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriMesh { positions, triangles }
}
