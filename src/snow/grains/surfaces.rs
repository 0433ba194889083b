//! The surfaces around grains that have no room.

use super::field::Window;
use super::heap::{Colliders, Floor, Pose};
use super::layout::At;
use super::nearby::Nearby;
use super::rows::{V, dot};
use super::shell::{DEPTHS, Shell};
use super::trapped::DEEP;
use crate::base::DVec3;
use crate::error::Result;

/// How far (diameters) surfaces are looked for.
const FAR: f64 = 2.0;
/// Share of the depth of grains that are in a surface, in which places that are written with less precision stay.
const ROUNDED: f64 = 0.98;
/// How often a grain is moved out of each surface.
const ROUNDS: usize = 16;
/// Farthest that it is moved (diameters).
const FARTHEST: f64 = 1.5;
/// Cosine between the ways out of a mesh on its two sides.
const OPPOSITE: f64 = -0.5;

/// The surfaces around a block, as they are at the step's end.
pub struct Surfaces<'a> {
    floor: Option<Floor>,
    /// Edge of a cell of the level set (m), and the values around the block.
    field: Option<(f64, Window<'a>)>,
    shells: &'a [(Shell, Pose<'a>)],
    /// Of a grain (m).
    diameter: f64,
}

/// What a place lies beside.
pub struct Side {
    /// Distance from the nearest surface (diameters), negative inside; at most [`FAR`].
    pub distance: f64,
    /// The way out of each mesh that is nearer than [`FAR`].
    pub out: Vec<(usize, DVec3)>,
}

impl Side {
    /// Whether a mesh lies between this place and another one nearby.
    pub fn is_across(&self, other: &Self) -> bool {
        let is_same = |(mesh, out): &(usize, DVec3)| {
            other.out.iter().any(|(index, way)| index == mesh && way.dot(out) < OPPOSITE)
        };
        self.out.iter().any(is_same)
    }
}

impl<'a> Surfaces<'a> {
    /// Those of some blocks and a margin (cells of a level set).
    ///
    /// # Errors
    /// What a grid reports.
    pub fn around(
        colliders: &'a Colliders<'_>,
        blocks: &[At],
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

    /// What a place (m) lies beside.
    pub fn side(&self, place: DVec3) -> Side {
        let mut side = Side { distance: FAR, out: Vec::new() };
        if let Some(floor) = &self.floor {
            side.distance = side.distance.min((place.y - floor.height) / self.diameter);
        }
        if let Some((cell, window)) = &self.field {
            let distance = f64::from(window.sample([0, 1, 2].map(|axis| place[axis] / cell)).0);
            side.distance = side.distance.min(distance / self.diameter);
        }
        for (index, (shell, _)) in self.shells.iter().enumerate() {
            if let Some((depth, out)) = shell.depth(place, FAR * self.diameter) {
                side.distance = side.distance.min(FAR - depth / self.diameter);
                side.out.push((index, out));
            }
        }
        side
    }

    /// What is near some places (m) of the meshes, so that [`Surfaces::release`] finds it soon.
    pub fn find(&self, places: impl Iterator<Item = DVec3>, nearby: &mut Vec<Nearby>) {
        let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let [low, high] = places.fold(none, |[low, high], place| [low.inf(&place), high.sup(&place)]);
        let room = DVec3::repeat((FARTHEST + 0.5) * self.diameter);
        nearby.resize_with(self.shells.len(), Nearby::default);
        for ((shell, _), nearby) in self.shells.iter().zip(nearby) {
            nearby.find(shell, &[low - room, high + room], 0.5 * DEPTHS * self.diameter);
        }
    }

    /// Where a grain at a place (m) is out of them, as a way from there (diameters); nothing where it finds no room.
    pub fn release(&self, from: DVec3, nearby: &mut [Nearby]) -> Option<V> {
        let mut place = from;
        for _ in 0..ROUNDS {
            let mut is_out = true;
            self.for_each_way_out(&mut place, nearby, |depth| is_out &= depth <= ROUNDED * DEEP);
            if is_out {
                let way = (place - from) / self.diameter;
                return Some([0, 1, 2].map(|axis| way[axis] as f32));
            }
            if (place - from).norm() > FARTHEST * self.diameter {
                return None;
            }
        }
        None
    }

    /// Moves a place (m) out of one surface after the other, and tells how deep (diameters) it was in each.
    fn for_each_way_out(&self, place: &mut DVec3, nearby: &mut [Nearby], mut tell: impl FnMut(f64)) {
        let half = 0.5 * self.diameter;
        if let Some(floor) = &self.floor {
            let depth = floor.height + half - place.y;
            tell(depth / self.diameter);
            place.y += depth.max(0.0);
        }
        if let Some((cell, window)) = &self.field {
            let (distance, gradient) = window.sample([0, 1, 2].map(|axis| place[axis] / cell));
            let depth = half - f64::from(distance);
            tell(depth / self.diameter);
            let steep = dot(gradient, gradient).sqrt();
            if depth > 0.0 && steep > 1.0e-6 {
                *place += DVec3::from(gradient.map(f64::from)) * (depth / f64::from(steep));
            }
        }
        for ((shell, _), nearby) in self.shells.iter().zip(nearby) {
            let nearest = nearby.nearest(shell, *place, DEPTHS * half);
            if let Some((depth, out)) = shell.depth_beside(*place, half, nearest) {
                tell(depth / self.diameter);
                *place += out * depth.max(0.0);
            }
        }
    }
}
