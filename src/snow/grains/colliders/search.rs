//! Finds the grains near meshes that move during the step: in every sub-step, block by block, among the few triangles near it.

use super::nearby::Nearby;
use super::shell::Shell;
use super::touch::Touch;
use crate::geometry::DVec3;
use crate::snow::grains::solver::blocks::{Block, EDGE};
use crate::snow::grains::solver::layout::world;
use crate::snow::grains::solver::pairs::SKIN;
use crate::snow::grains::solver::rest;
use crate::snow::grains::solver::rows::{Row, Shared, V, dot, norm, scaled, sub};

/// Scratch memory of one thread.
#[derive(Default)]
pub struct Scratch {
    asking: Vec<Asking>,
    /// By mesh.
    nearby: Vec<Nearby>,
}

/// A grain that may touch a mesh.
struct Asking {
    slot: u32,
    /// Its position (m).
    position: DVec3,
    /// Maximum distance (diameters) of a surface that counts as near.
    reach: f64,
    /// Search distance for surfaces (diameters).
    within: f64,
}

/// The search for meshes in a sub-step.
pub struct Search<'a> {
    /// The meshes.
    pub shells: Vec<&'a Shell>,
    /// Diameter of a grain (m).
    pub diameter: f64,
    /// Length of the sub-step (s).
    pub dt: f64,
    /// Largest travel of the meshes in the step before this sub-step (diameters): the sum of [`Travel::most`].
    pub before: f64,
    /// The same in this sub-step.
    pub travel: Travel,
}

/// Travel of meshes in a sub-step: a common part, along which grains that ride on a mesh stay as near to it, and the rest.
#[derive(Debug, Clone, Copy, Default)]
pub struct Travel {
    /// Common displacement (diameters).
    pub along: V,
    /// Largest deviation of a vertex from it (diameters).
    pub beside: f64,
}

impl Travel {
    /// Travel of meshes, with grains of a diameter (m).
    pub fn of(shells: &[&Shell], diameter: f64) -> Self {
        let farthest = shells.iter().map(|shell| shell.way).fold(0.0, f64::max);
        let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let bounds = shells.iter().map(|shell| &shell.bounds_of_ways);
        let [least, greatest] =
            bounds.fold(none, |[low, high], [least, greatest]| [low.inf(least), high.sup(greatest)]);
        let middle = (least + greatest) * 0.5;
        let beside = 0.5 * (greatest - least).norm();
        if middle.norm() + beside > ALONG * farthest {
            return Self { along: [0.0; 3], beside: farthest / diameter };
        }
        Self { along: [0, 1, 2].map(|axis| (middle[axis] / diameter) as f32), beside: beside / diameter }
    }

    /// Upper bound of the displacement of a vertex (diameters).
    pub fn most(&self) -> f64 {
        f64::from(norm(self.along)) + self.beside
    }
}

/// Maximum of [`Travel::most`], as a multiple of the largest displacement of a vertex: beyond it, grains that do not ride on a mesh would
/// search too often.
const ALONG: f64 = 1.2;

/// Maximum distance (diameters) from the middle of a block to a mesh that its members touch: they have left the block by less than two
/// diameters.
pub fn around() -> f64 {
    0.5 * f64::from(EDGE) * 3f64.sqrt() + REACH + 2.0
}

impl Search<'_> {
    /// Largest speed (m/s) that contacts may give grains, from the speed of the fastest one now (m/s), restitution and gravity (m/s2);
    /// infinite without meshes.
    ///
    /// Grains in a closing gap between an object and the base would be squeezed out like a liquid, faster without bound the shorter the
    /// sub-steps; snow is compacted instead. Contacts dissipate energy: apart from falling, no grain becomes faster than whatever drives
    /// them all.
    pub fn fastest(&self, fastest: f32, restitution: f32, gravity: f32) -> f32 {
        let Some(way) = self.shells.iter().map(|shell| shell.way).reduce(f64::max) else {
            return f32::INFINITY;
        };
        let thrown = (way / self.dt) as f32 * (1.0 + restitution);
        let falls = (gravity.abs() * self.diameter as f32).sqrt();
        fastest.max(thrown).max(falls) * (1.0 + ROUNDING)
    }

    /// Whether a mesh may be within `reach` (diameters), according to a stored limit.
    fn is_within(&self, limit: f32, reach: f64) -> bool {
        f64::from(limit) - self.before < reach
    }

    /// Whether a mesh may be near members of a block, according to the block's limit.
    pub fn may_be_near(&self, block: &Block) -> bool {
        !block.members.is_empty() && self.is_within(block.limit, around() + self.travel.most())
    }

    /// Touches of the members of a block with meshes. A resting grain has one only if a moving mesh touches it, which wakes it.
    /// Updates the limits of the block and of its grains.
    pub fn touches(&self, scratch: &mut Scratch, block: &mut Block, rows: Shared<'_, Row>) -> Vec<Touch> {
        let most = self.travel.most();
        // A block that touched a mesh in the last sub-step is still near it.
        if !block.touches.iter().any(Touch::is_of_mesh) {
            let middle = world(block.at, [EDGE * 0.5; 3], self.diameter);
            block.limit = self.limit(middle, around() + f64::from(EDGE));
            if !self.may_be_near(block) {
                return Vec::new();
            }
        }
        let Scratch { asking, nearby } = scratch;
        asking.clear();
        let mut room = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let mut farthest = 0.0f64;
        for &slot in &block.members {
            // SAFETY: a grain is a member of one block, which one task has.
            let row = unsafe { rows.get(slot as usize) };
            let reach = REACH + f64::from(norm(row.velocity)) * self.dt / self.diameter;
            let closing = if row.rests() {
                most
            } else {
                let way = scaled(row.velocity, (self.dt / self.diameter) as f32);
                f64::from(norm(sub(way, self.travel.along))) + self.travel.beside
            };
            if self.is_within(row.limit, REACH + closing) && !(row.rests() && most == 0.0) {
                let position = world(block.at, row.position, self.diameter);
                room = [room[0].inf(&position), room[1].sup(&position)];
                // Near fast meshes, a grain would have to search again at once anyway.
                let within = if most < 0.5 * AHEAD { reach + AHEAD } else { reach };
                farthest = farthest.max(within);
                asking.push(Asking { slot, position, reach, within });
            }
        }
        if asking.is_empty() {
            return Vec::new();
        }
        nearby.resize_with(self.shells.len(), Nearby::default);
        for (shell, nearby) in self.shells.iter().zip(&mut *nearby) {
            nearby.find(shell, &room, farthest * self.diameter);
        }
        let mut touches = Vec::new();
        for asking in asking {
            // SAFETY: as above.
            let row = unsafe { rows.get(asking.slot as usize) };
            self.touch(asking, nearby, row, &mut touches);
        }
        touches
    }

    /// Travel of the meshes at which one can reach a position (m), from a search within `within` diameters.
    fn limit(&self, position: DVec3, within: f64) -> f32 {
        let square =
            |shell: &&Shell| shell.nearest(position, within * self.diameter).map(|found| found.square);
        let nearest = self.shells.iter().filter_map(square).fold(f64::INFINITY, f64::min).sqrt();
        (self.before + (nearest / self.diameter).min(within)) as f32 - SLACK
    }

    /// Finds what a grain touches, and updates its limit.
    fn touch(&self, asking: &Asking, nearby: &mut [Nearby], row: &mut Row, touches: &mut Vec<Touch>) {
        let Asking { slot, position, reach, within } = *asking;
        let mut free = within;
        for (shell, nearby) in self.shells.iter().zip(nearby) {
            let Some(nearest) = nearby.nearest(shell, position, within * self.diameter) else { continue };
            let distance = nearest.square.sqrt() / self.diameter;
            free = free.min(distance);
            if distance <= reach + nearest.motion.norm() / self.diameter {
                let touch = shell.touch(slot, row, position, &nearest, self.diameter, self.dt);
                let is_close = dot(touch.normal, row.position) - touch.offset < rest::NEAR;
                let moves = nearest.motion.norm() > 1.0e-6 * self.diameter;
                if !row.rests() || is_close && moves {
                    rest::wake(row);
                    touches.push(touch);
                }
            }
        }
        row.limit = (self.before + free) as f32 - SLACK;
    }
}

/// Maximum distance (diameters) between a grain's centre and a mesh that counts as near.
const REACH: f64 = 0.5 + SKIN as f64;
/// Additional search distance (diameters), so that a grain need not search in every sub-step.
const AHEAD: f64 = 1.5;

/// Relative tolerance of a speed.
const ROUNDING: f32 = 1.0e-4;
/// Tolerance for rounding (diameters).
const SLACK: f32 = 1.0e-3;

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle with displacements of its corners (m).
    fn moved(ways: [[f64; 3]; 3]) -> Shell {
        let positions = [DVec3::zeros(), DVec3::x(), DVec3::z()];
        let mut shell = Shell::new(0.0, vec![[0, 1, 2]], false, positions.to_vec());
        let next: Vec<DVec3> =
            positions.iter().zip(ways).map(|(position, way)| position + DVec3::from(way)).collect();
        shell.follow(&next);
        shell
    }

    #[test]
    fn no_corner_travels_farther_than_along_and_beside() {
        let [along, still] = [[0.3, -0.2, 0.1], [0.0; 3]];
        let cases =
            [[along; 3], [still; 3], [along, still, still], [[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], still]];
        for ways in cases {
            let shell = moved(ways);
            let travel = Travel::of(&[&shell], 0.1);
            let corner = travel.along.map(f64::from);
            for way in ways {
                let rest = DVec3::from(way) / 0.1 - DVec3::from(corner);
                assert!(rest.norm() <= travel.beside + 1.0e-6, "{travel:?} for {way:?}");
            }
            assert!(travel.most() <= ALONG * shell.way / 0.1 + 1.0e-6, "{travel:?}");
        }
        assert!(Travel::of(&[&moved([along; 3])], 0.1).beside < 1.0e-6);
    }
}
