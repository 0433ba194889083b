//! Rest (thesis section 3.3.3) as part of the model: a grain that has stayed within a small part of its diameter for a while
//! stops and supports others like the ground. It takes longer if nothing supports the grain from below (but, say, friction
//! from the sides does); without gravity, such a grain floats and never rests. A resting grain wakes when a moving neighbour or a
//! moving surface touches it, and when the base layer near it changes; a change of gravity or material, or an object that
//! comes, goes or jumps, wakes all. Resting grains with no neighbour awake are skipped: that only saves time and never
//! changes the result.

use super::rows::{Row, SUPPORTED, dot, sub};

/// Displacement (diameters) beyond which a grain counts as moving.
const MAX_STILL: f32 = 0.01;
/// Largest gap (diameters) at which a moving grain wakes another.
pub const NEAR: f32 = 0.1;
/// Value of `still`: the grain has just woken.
const JUST_WOKEN: f32 = f32::MAX;
/// Added to `marks`: something wakes the grain.
pub const WOKEN: f32 = 2.0;
/// Time without motion before a grain rests, in standard sub-steps of sqrt(0.02 d / g), so that grains of every size behave alike.
const PATIENCE: f64 = 96.0;
/// Multiple of [`PATIENCE`] for an unsupported grain.
const UNSUPPORTED: f32 = 4.0;
/// Time for which a grain that has moved counts as moving, in the same unit.
const MOVING: f64 = 16.0;

/// When grains come to rest.
#[derive(Debug, Clone, Copy)]
pub struct Rest {
    /// Sub-steps without motion before a grain rests.
    pub patience: f32,
    /// The same for an unsupported grain.
    pub long_patience: f32,
    /// Sub-steps for which a grain that has moved counts as moving.
    pub moving: f32,
}

impl Rest {
    /// The rule for a diameter (m), gravity (m/s2) and sub-steps of `dt` (s).
    pub fn new(diameter: f64, gravity: f64, dt: f64) -> Self {
        let floats = gravity == 0.0;
        let gravity = if floats { 9.81 } else { gravity.abs() };
        let sub_steps = |times: f64| (times * (0.02 * diameter / gravity).sqrt() / dt).ceil() as f32;
        let patience = sub_steps(PATIENCE).max(16.0);
        let long_patience = if floats { f32::INFINITY } else { UNSUPPORTED * patience };
        Self { patience, long_patience, moving: sub_steps(MOVING).max(4.0) }
    }
}

/// Updates the state of a grain at the end of a sub-step; without a rule, grains never rest.
pub fn update(row: &mut Row, rule: Option<Rest>) {
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
    row.mass_state = if is_supported { 1.0 + SUPPORTED } else { 1.0 };
    let displacement = sub(row.position, row.reference);
    if dot(displacement, displacement) > MAX_STILL * MAX_STILL {
        (row.reference, row.still) = (row.position, 0.0);
    } else {
        row.still += 1.0;
    }
    let patience = |rule: Rest| if is_supported { rule.patience } else { rule.long_patience };
    if rule.is_some_and(|rule| row.still >= patience(rule)) {
        stop(row);
    }
}

/// Puts a grain to rest: it stops and supports others.
pub fn stop(row: &mut Row) {
    (row.mass_state, row.velocity) = (SUPPORTED, [0.0; 3]);
}

/// Whether a grain was woken, or its waiting time restarted, since the last sub-step.
pub fn has_just_woken(row: &Row) -> bool {
    row.still == JUST_WOKEN
}

/// Wakes a grain; it does not count as moving until it has moved.
pub fn wake(row: &mut Row) {
    if row.rests() {
        row.mass_state = 1.0 + SUPPORTED;
        restart_wait(row);
    }
}

/// Restarts the time that the grain must lie still.
pub fn restart_wait(row: &mut Row) {
    (row.reference, row.still) = (row.position, JUST_WOKEN);
}
