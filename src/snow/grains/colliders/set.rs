//! The colliders of a step.

use super::field::Field;
use super::shell::Shell;
use super::touch::{self, Touch};
use crate::error::Result;
use crate::geometry::DVec3;
use crate::snow::grains::solver::blocks::{Block, EDGE};
use crate::snow::grains::solver::pairs::SKIN;
use crate::snow::grains::solver::rows::{Row, norm};

/// Colliders: grains cannot move them.
#[derive(Default)]
pub struct Colliders<'a> {
    /// A level plane.
    pub floor: Option<Floor>,
    /// A level set that does not move during the step.
    pub field: Option<Field<'a>>,
    /// Meshes, each with a function for its pose (m) at a share 0..=1 of the step; ground ignores poses.
    pub shells: Vec<(Shell, Pose<'a>)>,
}

/// A level plane that grains lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Height (m).
    pub height: f64,
    /// Friction against it.
    pub friction: f32,
}

impl Floor {
    /// Touches of a block's members near the floor.
    pub(in crate::snow::grains) fn touches(
        &self,
        block: &Block,
        rows: &[Row],
        diameter: f64,
        reach: f32,
    ) -> Vec<Touch> {
        // Height of the floor above the bottom of the block (diameters).
        let height = (self.height / diameter - f64::from(block.at[1]) * f64::from(EDGE)) as f32;
        let near = block.members.iter().filter(|slot| {
            let row = &rows[**slot as usize];
            row.position[1] - height - 0.5 < SKIN + norm(row.velocity) * reach
        });
        let touch = |&grain: &u32| Touch {
            grain,
            collider: touch::FLOOR,
            normal: [0.0, 1.0, 0.0],
            offset: height + 0.5,
            friction: self.friction,
            is_ground: true,
            ..Touch::default()
        };
        near.map(touch).collect()
    }
}

/// Writes the positions (m) of a mesh's vertices at a share 0..=1 of a step.
pub type Pose<'a> = Box<dyn Fn(f64, &mut Vec<DVec3>) -> Result<()> + Send + Sync + 'a>;
