//! A treaded boot and a walk, made by code.

use super::shapes::cuboid;
use frazil::base::{DVec3, TriMesh, Vec3};
use nalgebra::Rotation3;

/// Points of a ring around the boot.
const RING: usize = 40;
/// The sole's underside (m above the ground); lugs reach down to 0.
const SOLE: f32 = 0.011;
/// Heel and ball of the foot, about which it rolls (m along the boot).
const HEEL: f64 = -0.075;
const BALL: f64 = 0.115;

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
            let centre = Vec3::new(side * (0.006 + width / 2.0), (SOLE + 0.004) / 2.0, z);
            boot.append(&moved(&lug, centre));
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

fn moved(mesh: &TriMesh, by: Vec3) -> TriMesh {
    TriMesh { positions: mesh.positions.iter().map(|p| p + by).collect(), triangles: mesh.triangles.clone() }
}

/// Half the sole's width at a place along the boot (m).
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
        (0.030, -0.09, 0.195, 1.0),
        (0.034, -0.085, 0.188, 0.93),
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
            // The outline's own place along the sole, squeezed into this ring.
            let along = 0.0525 + 0.1425 * cosine;
            let x = sine.signum() * half_width(along).max(0.02 * sine.abs()) * width;
            mesh.positions.push(Vec3::new(if sine.abs() < 1e-6 { 0.0 } else { x }, y, z));
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

/// Where a boot is at a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Frame, from 1.
    pub frame: i32,
    /// The boot's origin (m).
    pub at: [f64; 3],
    /// Pitch (toes down is positive), yaw, roll (degrees).
    pub turn_deg: [f64; 3],
}

/// Frames of a stride (two steps), at 24 frames a second.
const STRIDE_FRAMES: f64 = 26.0;
/// Length of a stride (m).
const STRIDE: f64 = 1.36;

/// The walk of one boot: `side` is -1 (left) or 1 (right); feet press down to `depth` m above y = 0.
pub fn walk(side: f64, frames: i32, depth: f64) -> Vec<Step> {
    let shift = if side < 0.0 { 0.25 } else { 0.75 };
    (1..=frames).map(|frame| pose(side, f64::from(frame - 1) / STRIDE_FRAMES + shift, frame, depth)).collect()
}

fn pose(side: f64, strides: f64, frame: i32, depth: f64) -> Step {
    let (stride, phase) = (strides.floor(), strides.fract());
    let (at, pitch) = if phase < 0.6 {
        stance(side, stride, phase, depth)
    } else {
        let part = (phase - 0.6) / 0.4;
        let (from, down) = stance(side, stride, 0.6, depth);
        let (to, up) = stance(side, stride + 1.0, 0.0, depth);
        let eased = part * part * (3.0 - 2.0 * part);
        let lift = DVec3::y() * 0.27 * (std::f64::consts::PI * part.powf(0.8)).sin();
        (from.lerp(&to, eased) + lift, down + (up - down) * eased)
    };
    Step { frame, at: at.into(), turn_deg: [pitch, 7.0 * side, 0.0] }
}

/// On the ground: rolls over the heel, rests, rolls over the ball. Nothing slides.
fn stance(side: f64, stride: f64, phase: f64, depth: f64) -> (DVec3, f64) {
    let (pitch, pivot) = match phase {
        p if p < 0.12 => (-20.0 * (1.0 - p / 0.12), HEEL),
        p if p < 0.38 => (0.0, HEEL),
        p => (45.0 * ((p - 0.38) / 0.22).min(1.0), BALL),
    };
    let yaw = 7.0 * side;
    let rest = DVec3::new(0.09 * side, depth, 0.25 + STRIDE * stride);
    let turned = |pitch: f64| Rotation3::from_euler_angles(pitch.to_radians(), yaw.to_radians(), 0.0);
    let pivot = DVec3::new(0.0, 0.0, pivot);
    (rest + turned(0.0) * pivot - turned(pitch) * pivot, pitch)
}
