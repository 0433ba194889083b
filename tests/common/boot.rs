//! A treaded boot, made by code.

use super::shapes::cuboid;
use frazil::geometry::{TriMesh, Vec3};

/// Points of a ring around the boot.
const RING: usize = 40;
/// The sole's underside (m above the ground); lugs reach down to 0.
const SOLE: f32 = 0.015;
/// Where the sole begins to rise towards the toes, and towards the back of the heel (m along the boot).
pub const BALL: f32 = 0.09;
pub const HEEL: f32 = -0.05;
/// Ends of the sole (m along the boot).
pub const TOE: f32 = 0.19;
pub const BACK: f32 = -0.085;

/// How far the sole's underside is above the ground when the boot stands (m): flat in the middle, curved up
/// at both ends so that the foot rolls.
pub fn rise(z: f32) -> f32 {
    if z > BALL {
        2.0 * (z - BALL).powi(2)
    } else if z < HEEL {
        4.0 * (HEEL - z).powi(2)
    } else {
        0.0
    }
}

/// A right boot: about 0.29 m long, 0.3 m high; Y up, toes towards +Z, the ankle above the origin. Its
/// parts (sole and upper, lugs) are closed and overlap.
pub fn right_boot() -> TriMesh {
    let mut boot = upper();
    for row in 0..10 {
        let z = -0.078 + 0.0285 * row as f32;
        // The arch has no lugs.
        if (0.0..0.03).contains(&z) {
            continue;
        }
        let half = half_width(z) - 0.004;
        for side in [-1.0f32, 1.0] {
            let width = half - 0.006;
            let lug = cuboid([width, SOLE + 0.004, 0.0165]);
            let centre = Vec3::new(bend(z) + side * (0.006 + width / 2.0), (SOLE + 0.004) / 2.0, z);
            let follow = |p: &Vec3| p + centre + Vec3::y() * rise(p.z + z);
            let positions = lug.positions.iter().map(follow).collect();
            boot.append(&TriMesh { positions, triangles: lug.triangles });
        }
    }
    boot
}

/// The right boot's mirror image.
pub fn left_boot() -> TriMesh {
    let mut boot = right_boot();
    boot.positions.iter_mut().for_each(|p| p.x = -p.x);
    boot.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    boot
}

/// How far the middle of a right boot lies inward (towards +X) at a position along it (m): the big toe is inside.
fn bend(z: f32) -> f32 {
    0.014 * ((z - 0.03).max(0.0) / 0.16).powi(2)
}

/// Half the sole's width at a position along the boot (m).
fn half_width(z: f32) -> f32 {
    let s = ((z - 0.0525) / 0.1425).clamp(-1.0, 1.0);
    let round = (1.0 - s * s).max(0.0).powf(0.36);
    round * (0.041 + 0.010 * s - 0.012 * (-((s + 0.15) / 0.35).powi(2)).exp())
}

/// Sole, foot and shaft: rings joined from the sole to the top.
fn upper() -> TriMesh {
    // Height, back and front (m), and width as a part of the sole's or in metres.
    let rings = [
        (SOLE, -0.09, 0.195, 1.0),
        (0.034, -0.09, 0.195, 1.0),
        (0.038, -0.085, 0.188, 0.93),
        (0.060, -0.083, 0.178, 0.90),
        (0.080, -0.081, 0.145, 0.88),
        (0.105, -0.079, 0.085, 0.95),
        (0.135, -0.076, 0.058, 1.05),
        (0.200, -0.074, 0.056, 1.15),
        (0.300, -0.078, 0.062, 1.25),
    ];
    let mut mesh = TriMesh::default();
    for (y, back, front, width) in rings {
        for point in 0..RING {
            let angle = std::f32::consts::TAU * point as f32 / RING as f32;
            let (sine, cosine) = angle.sin_cos();
            let z = (front + back) / 2.0 + (front - back) / 2.0 * cosine;
            // The outline's own position along the sole, squeezed into this ring.
            let along = 0.0525 + 0.1425 * cosine;
            let x = sine.signum() * half_width(along).max(0.02 * sine.abs()) * width;
            // Low rings follow the sole, high ones are level.
            let lift = rise(z) * (1.0 - (y - SOLE) / 0.1).clamp(0.0, 1.0);
            let x = if sine.abs() < 1e-6 { 0.0 } else { x };
            mesh.positions.push(Vec3::new(x + bend(z), y + lift, z));
        }
    }
    let ring = |level: usize, point: usize| (level * RING + point % RING) as u32;
    for level in 0..rings.len() - 1 {
        for point in 0..RING {
            let [a, b] = [ring(level, point), ring(level, point + 1)];
            let [c, d] = [ring(level + 1, point + 1), ring(level + 1, point)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let (bottom, top) = (mesh.positions.len() as u32, mesh.positions.len() as u32 + 1);
    mesh.positions.push(Vec3::new(0.0, SOLE, 0.05));
    mesh.positions.push(Vec3::new(0.0, 0.3, -0.008));
    for point in 0..RING {
        mesh.triangles.push([bottom, ring(0, point + 1), ring(0, point)]);
        mesh.triangles.push([top, ring(rings.len() - 1, point), ring(rings.len() - 1, point + 1)]);
    }
    mesh
}
