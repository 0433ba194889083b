//! Finds the grains near meshes that move during the step: in every sub-step, block by block, among the few triangles near each.

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
    queries: Vec<Query>,
    /// By mesh.
    nearby: Vec<Nearby>,
}

/// A grain that may touch a mesh.
struct Query {
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
    /// Largest travel of the meshes from the start of the step to this sub-step (diameters): the sum of [`Travel::max`].
    pub before: f64,
    /// The same in this sub-step.
    pub travel: Travel,
}

/// Travel of meshes in a sub-step: a common displacement, which leaves the distance of grains that ride on a mesh unchanged, and
/// deviations.
#[derive(Debug, Clone, Copy, Default)]
pub struct Travel {
    /// Common displacement (diameters).
    pub common: V,
    /// Largest deviation of a vertex's displacement from it (diameters).
    pub deviation: f64,
}

impl Travel {
    /// Travel of meshes, with grains of a diameter (m).
    pub fn of(shells: &[&Shell], diameter: f64) -> Self {
        let farthest = shells.iter().map(|shell| shell.max_displacement).fold(0.0, f64::max);
        let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let bounds = shells.iter().map(|shell| &shell.displacement_bounds);
        let [min, max] = bounds.fold(none, |[min, max], [low, high]| [min.inf(low), max.sup(high)]);
        let middle = (min + max) * 0.5;
        let deviation = 0.5 * (max - min).norm();
        if middle.norm() + deviation > MAX_RATIO * farthest {
            return Self { common: [0.0; 3], deviation: farthest / diameter };
        }
        Self {
            common: [0, 1, 2].map(|axis| (middle[axis] / diameter) as f32),
            deviation: deviation / diameter,
        }
    }

    /// Upper bound of the displacement of a vertex (diameters).
    pub fn max(&self) -> f64 {
        f64::from(norm(self.common)) + self.deviation
    }
}

/// Maximum of [`Travel::max`], as a multiple of the largest displacement of a vertex: beyond it, grains that do not ride on a mesh would
/// search too often.
const MAX_RATIO: f64 = 1.2;

/// Maximum distance (diameters) from the middle of a block to a mesh that its members touch: a member may have left the block, by less than
/// two diameters.
pub fn block_reach() -> f64 {
    0.5 * f64::from(EDGE) * 3f64.sqrt() + REACH + 2.0
}

impl Search<'_> {
    /// Largest speed (m/s) that contacts may give grains, from the speed of the fastest one now (m/s), restitution and gravity (m/s2);
    /// infinite without meshes.
    ///
    /// Grains in a closing gap between an object and the base would be squeezed out like a liquid, faster without bound the shorter the
    /// sub-steps; snow is compacted instead. Contacts dissipate energy: apart from falling, no grain becomes faster than the fastest
    /// mesh or grain that drives it.
    pub fn fastest(&self, fastest: f32, restitution: f32, gravity: f32) -> f32 {
        let Some(displacement) = self.shells.iter().map(|shell| shell.max_displacement).reduce(f64::max)
        else {
            return f32::INFINITY;
        };
        let thrown = (displacement / self.dt) as f32 * (1.0 + restitution);
        let falls = (gravity.abs() * self.diameter as f32).sqrt();
        fastest.max(thrown).max(falls) * (1.0 + ROUNDING)
    }

    /// Whether a mesh may be within `reach` (diameters), according to a stored travel limit.
    fn is_within(&self, limit: f32, reach: f64) -> bool {
        f64::from(limit) - self.before < reach
    }

    /// Whether a mesh may be near members of a block, according to the block's limit.
    pub fn may_be_near(&self, block: &Block) -> bool {
        !block.members.is_empty() && self.is_within(block.travel_limit, block_reach() + self.travel.max())
    }

    /// Touches of the members of a block with meshes. A resting grain has one only if a moving mesh touches it, which wakes it.
    /// Updates the limits of the block and of its grains.
    pub fn touches(&self, scratch: &mut Scratch, block: &mut Block, rows: Shared<'_, Row>) -> Vec<Touch> {
        let max = self.travel.max();
        // A block that touched a mesh in the last sub-step is still near it.
        if !block.touches.iter().any(Touch::is_of_mesh) {
            let middle = world(block.at, [EDGE * 0.5; 3], self.diameter);
            block.travel_limit = self.travel_limit(middle, block_reach() + f64::from(EDGE));
            if !self.may_be_near(block) {
                return Vec::new();
            }
        }
        let Scratch { queries, nearby } = scratch;
        queries.clear();
        let mut bounds = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let mut farthest = 0.0f64;
        for &slot in &block.members {
            // SAFETY: a grain is a member of one block, which only one task visits.
            let row = unsafe { rows.get(slot as usize) };
            let reach = REACH + f64::from(norm(row.velocity)) * self.dt / self.diameter;
            let closing = if row.rests() {
                max
            } else {
                let displacement = scaled(row.velocity, (self.dt / self.diameter) as f32);
                f64::from(norm(sub(displacement, self.travel.common))) + self.travel.deviation
            };
            if self.is_within(row.travel_limit, REACH + closing) && !(row.rests() && max == 0.0) {
                let position = world(block.at, row.position, self.diameter);
                bounds = [bounds[0].inf(&position), bounds[1].sup(&position)];
                // Near fast meshes, a grain would have to search again at once anyway.
                let within = if max < 0.5 * AHEAD { reach + AHEAD } else { reach };
                farthest = farthest.max(within);
                queries.push(Query { slot, position, reach, within });
            }
        }
        if queries.is_empty() {
            return Vec::new();
        }
        nearby.resize_with(self.shells.len(), Nearby::default);
        for (shell, nearby) in self.shells.iter().zip(&mut *nearby) {
            nearby.find(shell, &bounds, farthest * self.diameter);
        }
        let mut touches = Vec::new();
        for query in queries {
            // SAFETY: as above.
            let row = unsafe { rows.get(query.slot as usize) };
            self.touch(query, nearby, row, &mut touches);
        }
        touches
    }

    /// Travel of the meshes (diameters, from the start of the step) before one can reach a position (m), from a search within `within`
    /// diameters.
    fn travel_limit(&self, position: DVec3, within: f64) -> f32 {
        let square =
            |shell: &&Shell| shell.nearest(position, within * self.diameter).map(|found| found.square);
        let nearest = self.shells.iter().filter_map(square).fold(f64::INFINITY, f64::min).sqrt();
        (self.before + (nearest / self.diameter).min(within)) as f32 - SLACK
    }

    /// Finds what a grain touches, and updates its limit.
    fn touch(&self, query: &Query, nearby: &mut [Nearby], row: &mut Row, touches: &mut Vec<Touch>) {
        let Query { slot, position, reach, within } = *query;
        let mut free = within;
        for (shell, nearby) in self.shells.iter().zip(nearby) {
            let Some(nearest) = nearby.nearest(shell, position, within * self.diameter) else { continue };
            let distance = nearest.square.sqrt() / self.diameter;
            free = free.min(distance);
            if distance <= reach + nearest.displacement.norm() / self.diameter {
                let touch = shell.touch(slot, row, position, &nearest, self.diameter, self.dt);
                let is_close = dot(touch.normal, row.position) - touch.offset < rest::NEAR;
                let moves = nearest.displacement.norm() > 1.0e-6 * self.diameter;
                if !row.rests() || is_close && moves {
                    rest::wake(row);
                    touches.push(touch);
                }
            }
        }
        row.travel_limit = (self.before + free) as f32 - SLACK;
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
    fn moved(displacements: [[f64; 3]; 3]) -> Shell {
        let positions = [DVec3::zeros(), DVec3::x(), DVec3::z()];
        let mut shell = Shell::new(0.0, vec![[0, 1, 2]], false, positions.to_vec());
        let next: Vec<DVec3> = positions
            .iter()
            .zip(displacements)
            .map(|(position, displacement)| position + DVec3::from(displacement))
            .collect();
        shell.advance(&next);
        shell
    }

    #[test]
    fn common_and_deviation_bound_the_displacement_of_each_corner() {
        let [common, still] = [[0.3, -0.2, 0.1], [0.0; 3]];
        let cases =
            [[common; 3], [still; 3], [common, still, still], [[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], still]];
        for displacements in cases {
            let shell = moved(displacements);
            let travel = Travel::of(&[&shell], 0.1);
            let corner = travel.common.map(f64::from);
            for displacement in displacements {
                let rest = DVec3::from(displacement) / 0.1 - DVec3::from(corner);
                assert!(rest.norm() <= travel.deviation + 1.0e-6, "{travel:?} for {displacement:?}");
            }
            assert!(travel.max() <= MAX_RATIO * shell.max_displacement / 0.1 + 1.0e-6, "{travel:?}");
        }
        assert!(Travel::of(&[&moved([common; 3])], 0.1).deviation < 1.0e-6);
    }
}
