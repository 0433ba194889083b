//! A sleigh, made by code.

use super::shapes::cuboid;
use frazil::geometry::{TriMesh, Vec3};

/// Half the length of a runner's straight part, and half the distance between the runners' middles (m).
const HALF: [f32; 2] = [0.45, 0.28];
/// Width and thickness of a runner (m), and the radius of its curled front.
const RUNNER: [f32; 2] = [0.1, 0.04];
const CURL: f32 = 0.16;
/// Pieces of the curl: a sixth of a degree off the circle's way at most.
const PIECES: usize = 24;

/// A sleigh 1.1 m long and 0.66 m wide on two runners that are curled up in front, on struts; Y up, forward is +Z, the runners'
/// undersides at a height of 0. Its parts are closed and overlap.
pub fn sleigh() -> TriMesh {
    let mut sleigh = TriMesh::default();
    for side in [-HALF[1], HALF[1]] {
        sleigh.append(&moved(&runner(), [side, 0.0, 0.0]));
        for z in [-0.3, 0.3] {
            sleigh.append(&moved(&cuboid([0.04, 0.26, 0.05]), [side, 0.15, z]));
        }
    }
    for z in [-0.3, 0.3] {
        sleigh.append(&moved(&cuboid([2.0 * HALF[1] + 0.06, 0.05, 0.06]), [0.0, 0.25, z]));
    }
    for slat in 0..5 {
        let x = 0.13 * (slat as f32 - 2.0);
        sleigh.append(&moved(&cuboid([0.1, 0.025, 1.0]), [x, 0.285, 0.0]));
    }
    sleigh
}

fn moved(mesh: &TriMesh, by: [f32; 3]) -> TriMesh {
    let positions = mesh.positions.iter().map(|position| position + Vec3::from(by)).collect();
    TriMesh { positions, triangles: mesh.triangles.clone() }
}

/// A plank that runs straight along z and curls up by three quarters of a half circle.
fn runner() -> TriMesh {
    let bend = |piece: usize| 0.75 * std::f32::consts::PI * piece as f32 / PIECES as f32;
    // Positions on the underside, with the direction to the upper side.
    let curl = (0..=PIECES).map(|piece| {
        let (sine, cosine) = bend(piece).sin_cos();
        ([HALF[0] + CURL * sine, CURL * (1.0 - cosine)], [-sine, cosine])
    });
    let profile: Vec<_> = std::iter::once(([-HALF[0], 0.0], [0.0, 1.0])).chain(curl).collect();
    let mut mesh = TriMesh::default();
    for ([z, y], [dz, dy]) in &profile {
        for [x, up] in [[-0.5, 0.0], [0.5, 0.0], [0.5, 1.0], [-0.5, 1.0]] {
            let up = up * RUNNER[1];
            mesh.positions.push(Vec3::new(x * RUNNER[0], y + dy * up, z + dz * up));
        }
    }
    let mut quad = |[a, b, c, d]: [u32; 4]| mesh.triangles.extend([[a, b, c], [a, c, d]]);
    let last = 4 * (profile.len() as u32 - 1);
    for at in (0..last).step_by(4) {
        for side in 0..4 {
            let next = (side + 1) % 4;
            quad([at + side, at + next, at + 4 + next, at + 4 + side]);
        }
    }
    quad([3, 2, 1, 0]);
    quad([last, last + 1, last + 2, last + 3]);
    mesh
}
