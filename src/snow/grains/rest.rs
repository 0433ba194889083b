//! Rest (thesis section 3.3.3) as a part of the model: a grain that something supports and that has stayed within a small part of
//! its diameter for a while stops, and holds what lies on it like the ground. It wakes when a neighbour that moves touches it,
//! when a surface that moves does, and when the base layer near it, gravity or a material changes. What rests next to nothing
//! that is awake need not be visited: that is only speed.

use super::rows::{Row, SUPPORTED, dot, sub};

/// How far (diameters) a grain goes before it counts as moving.
const WAY: f32 = 0.01;
/// How many sub-steps a grain that has come so far counts as moving.
pub const MOVING: f32 = 16.0;
/// Gap (diameters) across which a moving grain wakes another.
pub const NEAR: f32 = 0.1;
/// In `marks`: something wakes the grain.
pub const WOKEN: f32 = 2.0;
/// How long a grain lies still before it rests (s).
pub const PATIENCE: f64 = 0.2;

/// What becomes of a grain at the end of a sub-step; `patience` are the sub-steps that it must lie still.
pub fn judge(row: &mut Row, patience: Option<f32>) {
    let (is_woken, is_supported) = (row.marks >= WOKEN, row.marks == 1.0 || row.marks == WOKEN + 1.0);
    (row.push, row.marks) = ([0.0; 3], 0.0);
    if row.rests() {
        if is_woken {
            wake(row);
        }
        return;
    }
    row.hold = if is_supported { 1.0 + SUPPORTED } else { 1.0 };
    let way = sub(row.place, row.since);
    if dot(way, way) > WAY * WAY {
        (row.since, row.still) = (row.place, 0.0);
    } else {
        row.still = if is_supported { row.still + 1.0 } else { (row.still + 1.0).min(MOVING) };
    }
    if patience.is_some_and(|patience| row.still >= patience) {
        (row.hold, row.velocity) = (SUPPORTED, [0.0; 3]);
    }
}

/// Wakes a grain, which does not count as moving before it has moved.
pub fn wake(row: &mut Row) {
    if row.rests() {
        (row.hold, row.since, row.still) = (1.0 + SUPPORTED, row.place, MOVING);
    }
}
