//! Grains that touch what they cannot move: ground, base layer, objects.

use super::contacts::GONE;
use super::rows::{V, add, dot, scaled};

/// A grain beside a plane that nothing moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Touch {
    /// The grain.
    pub grain: u32,
    /// Which collider it is.
    pub collider: u32,
    /// From the collider to the grain.
    pub normal: V,
    /// Where the plane is that the grain's centre may not pass: normal . place (diameters) of the points on it.
    pub offset: f32,
    /// Velocity of the surface (m/s).
    pub velocity: V,
    /// Friction against it.
    pub friction: f32,
    /// Impulse along the normal (m/s).
    pub impulse: f32,
    /// Impulse across it (m/s).
    pub across: V,
}

impl Touch {
    /// All of its impulse (m/s).
    pub fn total(&self) -> V {
        add(scaled(self.normal, self.impulse), self.across)
    }

    fn key(&self) -> (u32, u32) {
        (self.grain, self.collider)
    }
}

/// Sorts touches by grain and gives them the impulses of those that were there before, sorted too.
pub fn carry(touches: &mut [Touch], old: &[Touch]) {
    touches.sort_unstable_by_key(Touch::key);
    let mut before = old.iter().peekable();
    for touch in touches {
        while before.next_if(|old| old.key() < touch.key()).is_some() {}
        if let Some(old) = before.next_if(|old| old.key() == touch.key()) {
            (touch.impulse, touch.across) = (old.impulse, old.across);
        }
    }
}

/// Renames the grains of sorted touches; `slots` says where they went, [`GONE`] where they were left out.
pub fn rename(touches: &mut Vec<Touch>, slots: &[u32]) {
    touches.iter_mut().for_each(|touch| touch.grain = slots[touch.grain as usize]);
    touches.retain(|touch| touch.grain != GONE);
    touches.sort_unstable_by_key(Touch::key);
}

/// Takes the impulses of grains that are pressed between two sides: those would grow as long as the sides fight over the grain,
/// and throw it when one of them leaves. The touches are sorted.
pub fn release_pressed(touches: &mut [Touch]) {
    for touches in touches.chunk_by_mut(|a, b| a.grain == b.grain) {
        let is_pressed = touches.iter().enumerate().any(|(index, touch)| {
            touches[..index].iter().any(|other| dot(touch.normal, other.normal) < OPPOSITE)
        });
        if is_pressed {
            touches.iter_mut().for_each(|touch| (touch.impulse, touch.across) = (0.0, [0.0; 3]));
        }
    }
}

/// Cosine between the normals of two sides that press a grain.
const OPPOSITE: f32 = -0.5;
