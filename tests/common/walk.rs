//! A walk in deep snow, made by code: where each boot is at each frame.

use frazil::geometry::DVec3;
use nalgebra::Rotation3;

use super::boot::{BACK, BALL, HEEL, TOE, rise};

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

/// Frames of a stride (two steps), at 24 frames per second.
const STRIDE_FRAMES: f64 = 26.0;
/// Length of a stride (m).
const STRIDE: f64 = 1.3;
/// Parts of a stride at which the foot is flat, the heel rises, and the toes leave the ground.
const FLAT: f64 = 0.12;
const HEEL_UP: f64 = 0.42;
const TOE_OFF: f64 = 0.62;
/// Pitch at heel strike and at toe-off (degrees).
const STRIKE: f64 = -14.0;
const PUSH: f64 = 34.0;
/// Height that a foot is lifted to, over its print (m).
const LIFT: f64 = 0.32;

/// The walk of one boot: `side` is 1 (left, at +X when walking towards +Z) or -1 (right); feet press down to
/// `depth` m above y = 0.
pub fn walk(side: f64, frames: i32, depth: f64) -> Vec<Step> {
    let shift = if side > 0.0 { 0.25 } else { 0.75 };
    (1..=frames).map(|frame| pose(side, f64::from(frame - 1) / STRIDE_FRAMES + shift, frame, depth)).collect()
}

fn pose(side: f64, strides: f64, frame: i32, depth: f64) -> Step {
    let (stride, phase) = (strides.floor(), strides.fract());
    let (at, pitch) = if phase < TOE_OFF {
        stance(side, stride, phase, depth)
    } else {
        swing(side, stride, (phase - TOE_OFF) / (1.0 - TOE_OFF), depth)
    };
    Step { frame, at: at.into(), turn_deg: [pitch, yaw(side), 0.0] }
}

fn yaw(side: f64) -> f64 {
    6.0 * side
}

/// On the ground: rolls down from the heel, rests, rolls up over the ball and the toes. Nothing slides.
fn stance(side: f64, stride: f64, phase: f64, depth: f64) -> (DVec3, f64) {
    let pitch = match phase {
        p if p < FLAT => STRIKE * (1.0 - p / FLAT),
        p if p < HEEL_UP => 0.0,
        p => PUSH * ((p - HEEL_UP) / (TOE_OFF - HEEL_UP)).powf(1.5),
    };
    let yaw = Rotation3::from_euler_angles(0.0, yaw(side).to_radians(), 0.0);
    let (contact, along) = contact(pitch.to_radians());
    let turned = Rotation3::from_axis_angle(&DVec3::x_axis(), pitch.to_radians()) * contact;
    // The right foot comes down half a stride before the left.
    let ahead = stride - if side > 0.0 { 0.0 } else { 0.5 };
    let rest = DVec3::new(0.09 * side, depth, 0.25 + STRIDE * ahead);
    (rest + yaw * (DVec3::z() * along - turned), pitch)
}

/// The sole's point that touches the ground at a pitch (boot space, m), and its position on the ground: as far
/// along it as along the sole, for nothing slides.
fn contact(pitch: f64) -> (DVec3, f64) {
    let (begin, end, steepness) = match pitch >= 0.0 {
        true => (f64::from(BALL), f64::from(TOE), 4.0),
        false => (f64::from(HEEL), f64::from(BACK), 8.0),
    };
    let z = begin + (pitch.tan() / steepness).clamp(-(end - begin).abs(), (end - begin).abs());
    let slope = steepness * (z - begin);
    // Length of the parabola from its vertex.
    let length = (slope * (1.0 + slope * slope).sqrt() + slope.asinh()) / (2.0 * steepness);
    (DVec3::new(0.0, f64::from(rise(z as f32)), z), begin + length)
}

/// In the air: up out of the print, forward, down into the next.
fn swing(side: f64, stride: f64, part: f64, depth: f64) -> (DVec3, f64) {
    let (from, up) = stance(side, stride, TOE_OFF - 1e-9, depth);
    let (to, down) = stance(side, stride + 1.0, 0.0, depth);
    let forward = part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part);
    let lift = LIFT * (1.0 - (2.0 * part - 1.0).powi(4));
    let turn = part * part * (3.0 - 2.0 * part);
    (from.lerp(&to, forward) + DVec3::y() * lift, up + (down - up) * turn)
}
