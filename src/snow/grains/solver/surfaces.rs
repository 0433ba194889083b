//! The surfaces around grains that are inside a surface or in a crowd.

use super::blocks::BlockIndex;
use super::rows::{V, dot};
use crate::error::Result;
use crate::geometry::DVec3;
use crate::snow::bounds::bounds;
use crate::snow::grains::colliders::field::Window;
use crate::snow::grains::colliders::nearby::Nearby;
use crate::snow::grains::colliders::set::{Colliders, Floor, Pose};
use crate::snow::grains::colliders::shell::{DEPTH_REACH, Shell};

/// Search distance for surfaces (diameters): more than the longest step of a crowd's path, which starts anywhere in a cell with
/// edges of two diameters and ends at the centre of the next, so that a mesh between the two is near both.
const FAR: f64 = 5.5;
/// Released grains are at most this share of [`DEEP`] deep, so that they stay within it when positions are written with less
/// precision.
const RELEASED_SHARE: f64 = 0.98;
/// Maximum number of times that a grain is moved out of each surface.
const MAX_ROUNDS: usize = 16;
/// Maximum displacement of a released grain (diameters).
const MAX_DISPLACEMENT: f64 = 1.5;
/// Two positions are on opposite sides of a mesh if the cosine between its outward directions there is below this.
const OPPOSITE: f64 = -0.5;

/// The surfaces around a block at the end of the step.
pub struct Surfaces<'a> {
    floor: Option<Floor>,
    /// Edge of a cell of the level set (m), and its values around the block.
    field: Option<(f64, Window<'a>)>,
    shells: &'a [(Shell, Pose<'a>)],
    /// Diameter of a grain (m).
    diameter: f64,
}

/// Which side of the surfaces a position is on.
pub struct Side {
    /// Distance to the nearest surface (diameters), negative inside; at most [`FAR`].
    pub distance: f64,
    /// Index of each mesh nearer than [`FAR`] and the outward direction from it.
    pub out: Vec<(usize, DVec3)>,
}

impl Side {
    /// Whether a mesh lies between this position and another nearby.
    pub fn is_across(&self, other: &Self) -> bool {
        let is_same = |(mesh, out): &(usize, DVec3)| {
            other.out.iter().any(|(index, direction)| index == mesh && direction.dot(out) < OPPOSITE)
        };
        self.out.iter().any(is_same)
    }
}

impl<'a> Surfaces<'a> {
    /// The surfaces around blocks, with a margin (cells of a level set).
    ///
    /// # Errors
    /// Errors of a grid.
    pub fn around(
        colliders: &'a Colliders<'_>,
        blocks: &[BlockIndex],
        diameter: f64,
        margin: f64,
    ) -> Result<Vec<Self>> {
        let Colliders { floor, field, shells } = colliders;
        let new = || Surfaces { floor: *floor, field: None, shells, diameter };
        let mut around: Vec<Self> = blocks.iter().map(|_| new()).collect();
        if let Some(field) = field {
            let windows = field.windows(blocks, diameter, margin)?;
            for (surfaces, window) in around.iter_mut().zip(windows) {
                surfaces.field = window.map(|window| (field.grid.voxel_size(), window));
            }
        }
        Ok(around)
    }

    /// Which side of the surfaces a position (m) is on.
    pub fn side(&self, position: DVec3) -> Side {
        let mut side = Side { distance: FAR, out: Vec::new() };
        if let Some(floor) = &self.floor {
            side.distance = side.distance.min((position.y - floor.height) / self.diameter);
        }
        if let Some((cell, window)) = &self.field {
            let distance = f64::from(window.sample([0, 1, 2].map(|axis| position[axis] / cell)).0);
            side.distance = side.distance.min(distance / self.diameter);
        }
        for (index, (shell, _)) in self.shells.iter().enumerate() {
            if let Some((depth, out)) = shell.depth(position, FAR * self.diameter) {
                side.distance = side.distance.min(FAR - depth / self.diameter);
                side.out.push((index, out));
            }
        }
        side
    }

    /// Collects the triangles near positions (m) for [`Surfaces::release`].
    pub fn find(&self, positions: impl Iterator<Item = DVec3>, nearby: &mut Vec<Nearby>) {
        let [low, high] = bounds(positions);
        let margin = DVec3::repeat((MAX_DISPLACEMENT + 0.5) * self.diameter);
        nearby.resize_with(self.shells.len(), Nearby::default);
        for ((shell, _), nearby) in self.shells.iter().zip(nearby) {
            nearby.find(shell, &[low - margin, high + margin], 0.5 * DEPTH_REACH * self.diameter);
        }
    }

    /// Displacement (diameters) that moves a grain at a position (m) out of the surfaces, and whether it is trapped: it has no free
    /// position, and is only moved out of the ground.
    pub fn release(&self, from: DVec3, nearby: &mut [Nearby]) -> (V, bool) {
        let displacement = |position: DVec3| {
            let displacement = (position - from) / self.diameter;
            [0, 1, 2].map(|axis| displacement[axis] as f32)
        };
        let mut position = from;
        for _ in 0..MAX_ROUNDS {
            if self.push_out(&mut position, nearby, false) {
                return (displacement(position), false);
            }
            if (position - from).norm() > MAX_DISPLACEMENT * self.diameter {
                break;
            }
        }
        position = from;
        for _ in 0..MAX_ROUNDS {
            if self.push_out(&mut position, nearby, true) {
                break;
            }
        }
        (displacement(position), true)
    }

    /// Moves a position (m) out of each surface in turn, or only out of ground; returns whether it was outside of all.
    fn push_out(&self, position: &mut DVec3, nearby: &mut [Nearby], only_ground: bool) -> bool {
        let half = 0.5 * self.diameter;
        let mut is_out = true;
        let mut check = |depth: f64| is_out &= depth / self.diameter <= RELEASED_SHARE * DEEP;
        if let Some(floor) = &self.floor {
            let depth = floor.height + half - position.y;
            check(depth);
            position.y += depth.max(0.0);
        }
        if let Some((cell, window)) = self.field.as_ref().filter(|_| !only_ground) {
            let (distance, gradient) = window.sample([0, 1, 2].map(|axis| position[axis] / cell));
            let depth = half - f64::from(distance);
            check(depth);
            let slope = dot(gradient, gradient).sqrt();
            if depth > 0.0 && slope > 1.0e-6 {
                *position += DVec3::from(gradient.map(f64::from)) * (depth / f64::from(slope));
            }
        }
        for ((shell, _), nearby) in self.shells.iter().zip(nearby) {
            if only_ground && !shell.is_ground() {
                continue;
            }
            let nearest = nearby.nearest(shell, *position, DEPTH_REACH * half);
            if let Some((depth, out)) = shell.depth_from(*position, half, nearest) {
                check(depth);
                *position += out * depth.max(0.0);
            }
        }
        is_out
    }
}

/// Depth (diameters) beyond which a grain counts as inside a surface.
pub const DEEP: f64 = 0.1;
