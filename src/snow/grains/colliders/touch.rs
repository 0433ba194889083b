//! Contacts between grains and colliders: floor, base layer, meshes.

use rayon::prelude::*;

use crate::snow::grains::solver::layout::Block;
use crate::snow::grains::solver::rows::{V, add, dot, scaled};

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
    /// Friction of a grain that does not slide against it.
    pub friction: f32,
    /// Friction in this sub-step.
    pub friction_now: f32,
    /// Acceleration up to which the collider holds the grain (weights of the grain).
    pub stick: f32,
    /// Whether no grain may be behind the plane at the end of a sub-step: ground.
    pub is_ground: bool,
    /// Impulse along the normal (m/s).
    pub impulse: f32,
    /// Tangential impulse (m/s).
    pub across: V,
    /// Speed at which the grain bounces in this sub-step (m/s).
    pub bounce: f32,
}

impl Touch {
    /// Total impulse (m/s).
    pub fn total(&self) -> V {
        add(scaled(self.normal, self.impulse), self.across)
    }

    /// Grain and collider, unique for each touch.
    pub fn key(&self) -> (u32, u32) {
        (self.grain, self.collider)
    }

    /// Clears the impulses after a bounce: the next sub-step starts without any.
    pub fn forget_bounce(&mut self) {
        if self.bounce > 0.0 {
            (self.impulse, self.across, self.bounce) = (0.0, [0.0; 3], 0.0);
        }
    }

    /// Continues with the impulses of the same touch in the last sub-step.
    fn take_over(&mut self, old: &Self) {
        (self.impulse, self.across, self.bounce) = (old.impulse, old.across, old.bounce);
    }

    /// The part that the next step needs.
    pub fn kept(mut self) -> Self {
        self.forget_bounce();
        let Self { grain, collider, impulse, across, .. } = self;
        Self { grain, collider, impulse, across, ..Self::default() }
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

/// Replaces the touches of blocks with those found in this sub-step: all touches of blocks that are due, and those with
/// meshes in every block. New touches take over the impulses of the old ones.
pub fn renew(blocks: &mut [Block], mut fresh: Vec<Vec<Touch>>) {
    let is_renewed = |block: &Block, fresh: &[Touch]| {
        block.is_due || !fresh.is_empty() || block.touches.iter().any(Touch::is_of_mesh)
    };
    let renewed = blocks.par_iter_mut().zip(&mut fresh).filter(|(block, fresh)| is_renewed(block, fresh));
    // Touches that a block lost: their grains may have moved to another block.
    let mut gone: Vec<Touch> = renewed
        .flat_map_iter(|(block, fresh)| {
            fresh.sort_unstable_by_key(Touch::key);
            let (mut gone, mut next) = (Vec::new(), 0);
            block.touches.retain(|old| {
                let is_kept = !block.is_due && !old.is_of_mesh();
                if !is_kept {
                    while fresh.get(next).is_some_and(|touch| touch.key() < old.key()) {
                        next += 1;
                    }
                    match fresh.get_mut(next).filter(|touch| touch.key() == old.key()) {
                        Some(touch) => touch.take_over(old),
                        None => gone.push(*old),
                    }
                }
                is_kept
            });
            gone
        })
        .collect();
    gone.par_sort_unstable_by_key(Touch::key);
    blocks.par_iter_mut().zip(fresh).filter(|(_, fresh)| !fresh.is_empty()).for_each(|(block, mut fresh)| {
        for touch in &mut fresh {
            if let Ok(at) = gone.binary_search_by_key(&touch.key(), Touch::key) {
                touch.take_over(&gone[at]);
            }
        }
        if block.touches.is_empty() {
            block.touches = fresh;
        } else {
            block.touches.extend(fresh);
            block.touches.sort_unstable_by_key(Touch::key);
        }
        release_pressed(&mut block.touches);
    });
}

/// Clears the impulses of grains that are pressed from opposite sides: they would grow as long as both sides press, and throw
/// the grain when one of them leaves. The touches must be sorted.
fn release_pressed(touches: &mut [Touch]) {
    for touches in touches.chunk_by_mut(|a, b| a.grain == b.grain) {
        let is_pressed = touches.iter().enumerate().any(|(index, touch)| {
            touches[..index].iter().any(|other| dot(touch.normal, other.normal) < OPPOSITE)
        });
        if is_pressed {
            touches.iter_mut().for_each(|touch| (touch.impulse, touch.across) = (0.0, [0.0; 3]));
        }
    }
}

/// Two normals with a cosine below this press a grain from opposite sides.
const OPPOSITE: f32 = -0.5;
