//! Rest (thesis section 3.3.3) as a part of the model: a grain that has stayed within a small part of its diameter for a while
//! stops, and holds what lies on it like the ground. The while is longer where nothing below supports it, but friction from the
//! sides, say; without gravity such a grain floats and never rests. It wakes when a neighbour that moves touches it,
//! when a surface that moves does, and when the base layer near it changes; gravity, a material, and an object that comes, goes
//! or jumps wake all. What rests next to nothing that is awake need not be visited: that is only speed.

use super::rows::{Row, SUPPORTED, dot, sub};

/// How far (diameters) a grain goes before it counts as moving.
const WAY: f32 = 0.01;
/// Gap (diameters) across which a moving grain wakes another.
pub const NEAR: f32 = 0.1;
/// In `still`: the grain has just woken.
const JUST_WOKEN: f32 = f32::MAX;
/// In `marks`: something wakes the grain.
pub const WOKEN: f32 = 2.0;
/// How long a grain lies still before it rests, in usual sub-steps, sqrt(0.02 d / g): grains of every size rest alike.
const PATIENCE: f64 = 64.0;
/// How many times as long where nothing supports it.
const HELD: f32 = 4.0;
/// How long a grain that has come so far counts as moving, in the same unit.
const MOVING: f64 = 16.0;

/// When grains rest.
#[derive(Debug, Clone, Copy)]
pub struct Rest {
    /// Sub-steps that a grain lies still before it rests.
    pub patience: f32,
    /// The same where nothing supports it.
    pub long_patience: f32,
    /// Sub-steps that a grain that has moved counts as moving.
    pub moving: f32,
}

impl Rest {
    /// The rule for a diameter (m), gravity (m/s2) and sub-steps of `dt` (s).
    pub fn new(diameter: f64, gravity: f64, dt: f64) -> Self {
        let floats = gravity == 0.0;
        let gravity = if floats { 9.81 } else { gravity.abs() };
        let sub_steps = |times: f64| (times * (0.02 * diameter / gravity).sqrt() / dt).ceil() as f32;
        let patience = sub_steps(PATIENCE).max(16.0);
        let long_patience = if floats { f32::INFINITY } else { HELD * patience };
        Self { patience, long_patience, moving: sub_steps(MOVING).max(4.0) }
    }
}

/// What becomes of a grain at the end of a sub-step; without a rule it never rests.
pub fn judge(row: &mut Row, rule: Option<Rest>) {
    let (is_woken, is_supported) = (row.marks >= WOKEN, row.marks == 1.0 || row.marks == WOKEN + 1.0);
    (row.push, row.marks) = ([0.0; 3], 0.0);
    if row.rests() {
        if is_woken || rule.is_none() {
            wake(row);
        }
        return;
    }
    let moving = rule.map_or(0.0, |rule| rule.moving);
    row.still = if row.still == JUST_WOKEN { moving } else { row.still };
    row.hold = if is_supported { 1.0 + SUPPORTED } else { 1.0 };
    let way = sub(row.place, row.since);
    if dot(way, way) > WAY * WAY {
        (row.since, row.still) = (row.place, 0.0);
    } else {
        row.still += 1.0;
    }
    let patience = |rule: Rest| if is_supported { rule.patience } else { rule.long_patience };
    if rule.is_some_and(|rule| row.still >= patience(rule)) {
        stop(row);
    }
}

/// Puts a grain to rest: it stops, and holds what lies on it.
pub fn stop(row: &mut Row) {
    (row.hold, row.velocity) = (SUPPORTED, [0.0; 3]);
}

/// Whether something has woken a grain, or begun its wait again, since the last sub-step.
pub fn has_just_woken(row: &Row) -> bool {
    row.still == JUST_WOKEN
}

/// Wakes a grain, which does not count as moving before it has moved.
pub fn wake(row: &mut Row) {
    if row.rests() {
        row.hold = 1.0 + SUPPORTED;
        begin_again(row);
    }
}

/// How long the grain has lain still no longer counts.
pub fn begin_again(row: &mut Row) {
    (row.since, row.still) = (row.place, JUST_WOKEN);
}
