//! Whether a character's feet stay where they stand: the speed of its clip against that of its keys.

use serde::Serialize;

use crate::error::Result;
use crate::geometry::DVec3;
use crate::motion::{Character, Keys, Motion, Placed, Play, gait, is_gltf};
use crate::scene::{Object, Scene};

/// Feet that slip slower than this (m/s), or than this fraction of their clip's speed, are ignored.
const SLOW: f64 = 0.05;
const PART: f64 = 0.25;

/// How a clip must be carried, and how it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Walk {
    /// Velocity (m/s) that keeps standing parts in position, before any rotation by the keys.
    pub carry_m_per_s: [f64; 3],
    /// Distance covered in one cycle of the clip (m), and the duration of a cycle (s).
    pub stride_m: f64,
    /// See [`Walk::stride_m`].
    pub round_s: f64,
    /// Fraction of the time that something stands.
    pub standing: f64,
    /// Speed (m/s) of standing parts when carried by the scene's keys.
    pub slips_m_per_s: f64,
    /// Keys that carry it correctly, straight on from the scene's first key.
    pub keys: String,
    /// Whether the feet slip enough to report.
    pub slips: bool,
}

/// Analyses a character's clip; `None` if it has none, or stands nowhere for long, or too unevenly.
///
/// # Errors
/// As [`Character::open`].
pub(in crate::scene::snow) fn walk(
    scene: &Scene,
    object: &Object,
    moved: &dyn Motion,
) -> Result<Option<Walk>> {
    if !is_gltf(&object.file) {
        return Ok(None);
    }
    let play = Play { node: object.node.clone(), clip: object.clip.clone(), repeat: false, start: 0.0 };
    let own = Character::open(&object.file, play)?;
    let round = own.duration();
    let own = Placed::new(Box::new(own), object.space, Keys::default());
    let Some(own) = gait(&own, 0.0, round)?.filter(|gait| gait.is_steady()) else { return Ok(None) };
    let frames = scene.shot.frames;
    let start = scene.shot.time(frames.first);
    let end = (start + round).min(scene.shot.time(frames.last));
    let Some(carried) = gait(moved, start, end)? else { return Ok(None) };
    let (speed, slips) = (own.velocity.norm(), carried.velocity.norm());
    Ok(Some(Walk {
        carry_m_per_s: own.carry().into(),
        stride_m: speed * round,
        round_s: round,
        standing: own.standing,
        slips_m_per_s: slips,
        keys: keys(scene, object, own.carry())?,
        slips: slips > SLOW && slips > PART * speed,
    }))
}

/// Keys at the first and last frame that carry a figure at a velocity (m/s, before the first key's rotation).
fn keys(scene: &Scene, object: &Object, carry: DVec3) -> Result<String> {
    let (frames, fps) = (scene.shot.frames, scene.shot.fps);
    let first = object.keys.first();
    let (at, turn) = first.map_or(([0.0; 3], [0.0; 3]), |key| (key.at, key.turn_deg));
    let turned =
        crate::motion::Key { time: 0.0, at: DVec3::zeros(), turn: DVec3::from(turn.map(f64::to_radians)) };
    let (rotation, _) = Keys::new(vec![turned])?.at(0.0);
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
