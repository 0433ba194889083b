//! Foot sliding of a character: the walking speed of its clip compared with the speed at which its keys move it.

use serde::Serialize;

use crate::error::Result;
use crate::geometry::DVec3;
use crate::motion::{Character, Keys, Motion, Placed, Play, gait, is_gltf};
use crate::scene::{Object, Scene};

/// Slip slower than this (m/s), or than this fraction of the clip's speed, is ignored.
const MIN_SLIP: f64 = 0.05;
const MIN_SHARE: f64 = 0.25;

/// The motion that a character's clip requires of its keys, and how much its feet slip with the keys of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FootSlip {
    /// Velocity (m/s) at which keys must move the character so that standing feet stay in position, before any rotation by the keys.
    pub carry_m_per_s: [f64; 3],
    /// Distance covered in one cycle of the clip (m).
    pub stride_m: f64,
    /// Duration of a cycle (s).
    pub round_s: f64,
    /// Fraction of the time in which some part stands still.
    pub standing: f64,
    /// Speed (m/s) at which standing feet slip with the scene's keys.
    pub slips_m_per_s: f64,
    /// Keys that cause no slip: straight ahead from the scene's first key.
    pub keys: String,
    /// Whether the feet slip enough to report.
    pub slips: bool,
}

/// Analyses a character's clip; `None` if it has none, or if no part stands still for long enough, or not steadily enough.
///
/// # Errors
/// As [`Character::open`].
pub(in crate::scene::snow) fn foot_slip(
    scene: &Scene,
    object: &Object,
    moved: &dyn Motion,
) -> Result<Option<FootSlip>> {
    if !is_gltf(&object.file) {
        return Ok(None);
    }
    let play = Play { node: object.node.clone(), clip: object.clip.clone(), repeat: false, start: 0.0 };
    let clip = Character::open(&object.file, play)?;
    let cycle = clip.duration();
    let clip = Placed::new(Box::new(clip), object.space, Keys::default());
    let Some(clip_gait) = gait(&clip, 0.0, cycle)?.filter(|gait| gait.is_steady()) else { return Ok(None) };
    let frames = scene.shot.frames;
    let start = scene.shot.time(frames.first);
    let end = (start + cycle).min(scene.shot.time(frames.last));
    let Some(moved_gait) = gait(moved, start, end)? else { return Ok(None) };
    let (speed, slip_speed) = (clip_gait.velocity.norm(), moved_gait.velocity.norm());
    Ok(Some(FootSlip {
        carry_m_per_s: clip_gait.carry().into(),
        stride_m: speed * cycle,
        round_s: cycle,
        standing: clip_gait.standing,
        slips_m_per_s: slip_speed,
        keys: keys(scene, object, clip_gait.carry())?,
        slips: slip_speed > MIN_SLIP && slip_speed > MIN_SHARE * speed,
    }))
}

/// Keys at the first and last frame that move a character at a velocity (m/s, before the first key's rotation).
fn keys(scene: &Scene, object: &Object, carry: DVec3) -> Result<String> {
    let (frames, fps) = (scene.shot.frames, scene.shot.fps);
    let first = object.keys.first();
    let (at, turn) = first.map_or(([0.0; 3], [0.0; 3]), |key| (key.at, key.turn_deg));
    let first_key =
        crate::motion::Key { time: 0.0, at: DVec3::zeros(), turn: DVec3::from(turn.map(f64::to_radians)) };
    let (rotation, _) = Keys::new(vec![first_key])?.at(0.0);
    let seconds = (f64::from(frames.last) - f64::from(frames.first)) / fps;
    let last = DVec3::from(at) + rotation * carry * seconds;
    let key = |frame: i32, at: DVec3| {
        // Adding 0 turns -0 into 0.
        let [x, y, z] = <[f64; 3]>::from(at.map(|v| (v * 1e4).round() / 1e4 + 0.0));
        let turn = if turn == [0.0; 3] { String::new() } else { format!(", turn_deg = {turn:?}") };
        format!("{{ frame = {frame}, at = [{x}, {y}, {z}]{turn} }}")
    };
    Ok(format!("keys = [{}, {}]", key(frames.first, at.into()), key(frames.last, last)))
}
