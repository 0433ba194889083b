//! Contacts between grains and colliders: floor, base layer, meshes.

use crate::snow::grains::solver::rows::{V, add, scaled};

/// A contact between a grain and a collider, as a plane that the grain cannot move.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Touch {
    /// Slot of the grain.
    pub grain: u32,
    /// Collider index.
    pub collider: u32,
    /// From the collider to the grain.
    pub normal: V,
    /// Offset of the plane that the grain's centre may not cross: dot(normal, p) (diameters) for points p on it.
    pub offset: f32,
    /// Velocity of the surface (m/s).
    pub velocity: V,
    /// Friction coefficient for a grain at rest against the collider (static friction).
    pub friction: f32,
    /// Friction in this sub-step.
    pub friction_now: f32,
    /// Acceleration up to which the collider holds the grain (multiples of gravity).
    pub stick: f32,
    /// Whether no grain may be behind the plane at the end of a sub-step: ground.
    pub is_ground: bool,
    /// Impulse along the normal (m/s).
    pub impulse: f32,
    /// Tangential impulse (m/s).
    pub tangential: V,
    /// Speed at which the grain bounces in this sub-step (m/s).
    pub bounce: f32,
}

impl Touch {
    /// Total impulse (m/s).
    pub fn total(&self) -> V {
        add(scaled(self.normal, self.impulse), self.tangential)
    }

    /// Grain and collider, unique for each touch.
    pub fn key(&self) -> (u32, u32) {
        (self.grain, self.collider)
    }

    /// Clears the impulses after a bounce: the next sub-step starts without any.
    pub fn clear_bounce(&mut self) {
        if self.bounce > 0.0 {
            (self.impulse, self.tangential, self.bounce) = (0.0, [0.0; 3], 0.0);
        }
    }

    /// Continues with the impulses of the same touch in the last sub-step.
    pub fn take_over(&mut self, old: &Self) {
        (self.impulse, self.tangential, self.bounce) = (old.impulse, old.tangential, old.bounce);
    }

    /// The part that the next step needs.
    pub fn for_next_step(mut self) -> Self {
        self.clear_bounce();
        let Self { grain, collider, impulse, tangential, .. } = self;
        Self { grain, collider, impulse, tangential, ..Self::default() }
    }

    /// Whether it has a plane: false if it was kept from the last step, or if the grain is deep in a level set.
    pub fn has_plane(&self) -> bool {
        self.normal != [0.0; 3]
    }

    /// Whether the collider is a mesh.
    pub fn is_of_mesh(&self) -> bool {
        self.collider >= FIRST_SHELL
    }
}

/// Collider index of the floor.
pub const FLOOR: u32 = 0;
/// Collider index of the base layer.
pub const BASE: u32 = 1;
/// Collider index of the first mesh.
pub const FIRST_SHELL: u32 = 2;
