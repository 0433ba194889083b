//! The terrains of the scenes with a little liquid: an incline, shelves above each other, a bowl.

use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;

/// Writes their meshes.
pub fn write(folder: &Path) -> frazil::Result<()> {
    mesh::write(&folder.join("incline.obj"), &incline())?;
    mesh::write(&folder.join("shelves.obj"), &shelves())?;
    mesh::write(&folder.join("bowl.obj"), &bowl())
}

/// A sheet over a rectangle around the origin, with these edges (m) and this many points along each.
pub fn sheet(edges: [f32; 2], points: [u32; 2], height: impl Fn(f32, f32) -> f32) -> TriMesh {
    let [nx, nz] = points;
    let position = |index: u32| {
        let at = [index % nx, index / nx];
        let [x, z] = [0, 1].map(|n| edges[n] * (at[n] as f32 / (points[n] - 1) as f32 - 0.5));
        Vec3::new(x, height(x, z), z)
    };
    let is_square = |index: &u32| index % nx + 1 < nx && index / nx + 1 < nz;
    let square = |index: u32| {
        let [a, b, c, d] = [index, index + nx, index + nx + 1, index + 1];
        [[a, b, c], [a, c, d]]
    };
    let triangles = (0..nx * nz).filter(is_square).flat_map(square).collect();
    TriMesh { positions: (0..nx * nz).map(position).collect(), triangles }
}

/// A plane of 10 x 10 cm that falls by 35 % along x, with low bumps that part the liquid.
fn incline() -> TriMesh {
    let sine = |phase: f32| libm::sinf(phase);
    sheet([0.1; 2], [201; 2], |x, z| {
        let bumps = sine(150.0 * x + 1.0) * sine(170.0 * z) + 0.6 * sine(310.0 * z + 90.0 * x);
        -0.35 * x + 0.0006 * bumps
    })
}

/// A bowl 6.4 cm wide and 2 cm deep, with a rim.
fn bowl() -> TriMesh {
    sheet([0.08; 2], [161; 2], |x, z| {
        let from_middle = (x * x + z * z).sqrt();
        let inside = 20.0 * from_middle * from_middle;
        // Outside the rim the ground falls a little.
        inside.min(0.0205 - 0.15 * (from_middle - 0.032))
    })
}

/// A basin of 10 x 10 cm, above it a platform with a hole and a rim, above that a smaller one.
fn shelves() -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut put = |low: [f32; 3], high: [f32; 3]| mesh.append(&TriMesh::cuboid(low, high));
    // The basin, and its walls.
    put([-0.05, 0.0, -0.05], [0.05, 0.004, 0.05]);
    for [x0, x1, z0, z1] in walls([0.05; 2], 0.003) {
        put([x0, 0.0, z0], [x1, 0.012, z1]);
    }
    // The platform around its hole, and its rim.
    let (outer, hole) = (0.032, 0.011);
    for [x0, x1, z0, z1] in walls([outer; 2], outer - hole) {
        put([x0, 0.020, z0], [x1, 0.023, z1]);
    }
    for [x0, x1, z0, z1] in walls([outer; 2], 0.002) {
        put([x0, 0.020, z0], [x1, 0.026, z1]);
    }
    // Pillars under its corners. It is level: liquid falls through the hole, or over the rim.
    for x in [-0.028, 0.028] {
        for z in [-0.028, 0.028] {
            put([x - 0.002, 0.0, z - 0.002], [x + 0.002, 0.0225, z + 0.002]);
        }
    }
    // The smallest platform, without a rim, and its pillar.
    put([-0.026, 0.038, -0.010], [0.004, 0.041, 0.010]);
    put([-0.022, 0.020, -0.002], [-0.018, 0.040, 0.002]);
    mesh
}

/// Four boxes, seen from above, that make a wall of a thickness along the inside of a rectangle: x0, x1, z0, z1.
pub fn walls([x, z]: [f32; 2], thick: f32) -> [[f32; 4]; 4] {
    let [inner_x, inner_z] = [x, z].map(|half| half - thick);
    [
        [-x, x, -z, -inner_z],
        [-x, x, inner_z, z],
        [-x, -inner_x, -inner_z, inner_z],
        [inner_x, x, -inner_z, inner_z],
    ]
}
