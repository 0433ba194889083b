//! Grains: snow that is pushed, piled and thrown (thesis section 3.3).
//!
//! Grains are created where the base layer lost snow (`sourcing`), pushed by moving meshes (`shell`), lie on the base
//! (`field`), pile up at their angle of repose (`solve`) and come to rest (`rest`). They read the base layer and never change
//! it. A step is divided into sub-steps (`heap`).
//!
//! | word | meaning |
//! |---|---|
//! | row | the part of a grain that every sub-step reads and writes: one cache line |
//! | slot | index of a grain in the heap's arrays; it changes from step to step, the identity (`id`) never does |
//! | pair | two grains in contact or close to it; one of them owns the pair |
//! | batch | eight pairs that share no grain, solved together |
//! | collider | an obstacle that grains cannot move: the floor, the base layer, the mesh of an object |
//! | shell | a mesh as a collider |
//! | touch | a contact between a grain and a collider, as a plane |
//! | impulse | the change of velocity that a contact causes; kept from sub-step to sub-step |
//! | push | a displacement that removes overlap and never becomes velocity |
//! | block, column | a cube of 8 x 8 x 8 diameters; a stack of blocks, the unit of work |
//! | colour | one of four sets of columns; no two columns of a set share a grain |
//! | anchor | a position slightly ahead of a moving grain, from which its pairs are found |
//! | rest | a grain that has lain still stops and supports others like the ground, until something wakes it |

mod birth;
pub(super) mod colliders;
#[doc(hidden)]
pub mod heap;
mod params;
#[doc(hidden)]
pub mod solver;
mod start_positions;
mod state;
mod surroundings;

use std::collections::{BTreeMap, HashSet};

use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::geometry::points::{Attribute, Column, Points, Values};
use crate::numeric::blocks::{DIM, Origin};
use crate::numeric::checks::ensure;
use birth::claims::Claims;
use birth::sourcing::Sourcing;
use heap::{Heap, Starts};
use params::Division;
use solver::layout::locate;
use surroundings::{Bounds, Obstacles, WAKE_SETTINGS, have_stayed};

pub use crate::snow::grains::heap::Start;
pub use birth::removed_snow::{Base, Removal, removals};
pub use birth::sourcing::PACKING;
pub use colliders::ground::Ground;
pub use params::Params;
pub(super) use surroundings::MAX_CLOSED_HOLES;
pub use surroundings::{FASTEST_OBJECT, Object, Surroundings};

/// Where and when a grain was created.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Birth {
    /// Position (m).
    rest: [f32; 3],
    /// Frame that removed its snow.
    frame: i32,
}

/// Grains of a layer of snow.
#[derive(Clone)]
pub struct Grains {
    params: Params,
    heap: Heap,
    /// Indexed by identity.
    births: Vec<Birth>,
    next_id: u32,
    /// Grains that the removed snow of a block of the base has paid for but that do not exist yet: mostly fractions.
    owed: BTreeMap<Origin, f64>,
    /// Settings of the last step whose change wakes all grains: see [`Surroundings::wake_settings`].
    wake_settings: [f64; WAKE_SETTINGS],
    /// Bounding boxes (m) of the meshes at the end of the last step.
    boxes: Vec<Bounds>,
    starts: Starts,
}

/// Results of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Count of grains after the step.
    pub count: usize,
    /// Count of those at rest.
    pub resting: usize,
    /// Count of new grains.
    pub born: usize,
    /// Snow removed from the base (m3).
    pub removed_volume: f64,
    /// Grains that removed snow has paid for but that do not exist yet.
    pub owed: f64,
    /// Count of grains removed below the lowest height, outside [`Params::keep_box`] or beyond the range of coordinates.
    pub dropped: usize,
    /// Of these, count of grains that fell below the lowest height, beyond the edge of the ground.
    pub fell: usize,
    /// Count of grains that reached [`Params::lifetime`].
    pub expired: usize,
    /// Count of trapped grains: see [`Grains::trapped`].
    pub trapped: usize,
    /// Count of sub-steps.
    pub sub_steps: usize,
    /// Largest speed (m/s).
    pub fastest: f32,
    /// Wall-clock time of each phase.
    pub phases: Vec<PhaseTime>,
}

/// Edge (diameters) of a voxel of [`Grains::points`], a power of two: readers of VDB Points work best with a few points per
/// voxel.
const VOXEL: f32 = 2.0;

/// Largest component (m/s) of the velocity of an emitted grain.
pub const MAX_SPEED: f32 = 10_000.0;

/// Memory (bytes) of grains in a step, including the copy that a failed step restores.
pub fn memory(grains: usize) -> u64 {
    (grains as u64).saturating_mul(808)
}

impl Grains {
    /// No grains yet.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn new(params: Params) -> Result<Self> {
        params.validate()?;
        let heap = Heap::new(2.0 * params.radius);
        let (births, owed, boxes, starts) = Default::default();
        Ok(Self {
            params,
            heap,
            births,
            next_id: 0,
            owed,
            wake_settings: [0.0; WAKE_SETTINGS],
            boxes,
            starts,
        })
    }

    /// Resumes from a state that [`Grains::save`] wrote.
    ///
    /// # Errors
    /// A parameter out of range; bytes that are not a valid state.
    pub fn resume(params: Params, bytes: &[u8]) -> Result<Self> {
        let mut grains = Self::new(params)?;
        state::load(&mut grains, bytes)?;
        Ok(grains)
    }

    /// Unpacked size (bytes) of a saved state; 0 if it is invalid.
    pub fn unpacked_size(bytes: &[u8]) -> u64 {
        state::unpacked_size(bytes)
    }

    /// The exact state as bytes, the same for any number of threads.
    pub fn save(&self) -> Vec<u8> {
        state::save(self)
    }

    /// Count of grains.
    pub fn count(&self) -> usize {
        self.heap.count()
    }

    /// The current parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Sets the parameters from the next step on.
    ///
    /// # Errors
    /// A parameter out of range, or a different radius; the old parameters are then kept.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        if params.radius != self.params.radius {
            let old = self.params.radius;
            return Err(Error::argument(format!("radius = {} cannot change, it is {old}", params.radius)));
        }
        self.params = params;
        Ok(())
    }

    /// Adds grains at positions (m) with velocities (m/s), or at rest if `velocities` is empty; `frame` is their frame of
    /// birth. Returns the identity of the first; the others follow in order. On error nothing changes.
    ///
    /// # Errors
    /// Too many grains; a position out of range; a velocity that is not finite or over [`MAX_SPEED`].
    pub fn emit(&mut self, positions: &[DVec3], velocities: &[[f32; 3]], frame: i32) -> Result<u32> {
        if !velocities.is_empty() && velocities.len() != positions.len() {
            let (given, count) = (velocities.len(), positions.len());
            return Err(Error::argument(format!(
                "velocities: {given} elements, but there are {count} positions"
            )));
        }
        let is_out = |position: &DVec3| {
            !position.iter().all(|x| x.is_finite())
                || !solver::layout::is_in_range(locate(*position, self.heap.diameter).0)
        };
        if let Some(at) = positions.iter().position(is_out) {
            return Err(Error::argument(format!("positions: element {at} is too far from the origin")));
        }
        let is_fast = |velocity: &[f32; 3]| velocity.iter().any(|x| !(-MAX_SPEED..=MAX_SPEED).contains(x));
        if let Some(at) = velocities.iter().position(is_fast) {
            return Err(Error::argument(format!(
                "velocities: element {at} has a component that is not within -{MAX_SPEED} to {MAX_SPEED} m/s"
            )));
        }
        self.check_count(positions.len(), frame)?;
        let first = self.next_id;
        for (at, position) in positions.iter().enumerate() {
            self.add(*position, velocities.get(at).copied().unwrap_or_default(), frame)?;
        }
        Ok(first)
    }

    /// Fails if there would be more grains than allowed.
    fn check_count(&self, more: usize, frame: i32) -> Result<()> {
        let (count, max_grains) = (self.heap.count() + more, self.params.max_grains);
        ensure(
            count <= max_grains && self.next_id as usize + more <= solver::contacts::MAX_GRAINS,
            format_args!(
                "frame {frame} would have {count} grains, more than max = {max_grains}: larger grains or more compression make fewer"
            ),
        )?;
        Ok(())
    }

    fn add(&mut self, position: DVec3, velocity: [f32; 3], frame: i32) -> Result<()> {
        self.heap.add(self.next_id, position, velocity)?;
        self.births.push(Birth { rest: [position.x as f32, position.y as f32, position.z as f32], frame });
        self.next_id += 1;
        Ok(())
    }

    /// Count of grains at rest.
    pub fn resting(&self) -> usize {
        self.heap.resting()
    }

    /// Moves the grains from `from` to `to` (s), including new ones from the snow that this step removed from the base. A
    /// step that fails or is cancelled leaves them unchanged.
    ///
    /// # Errors
    /// Too many grains; a pose that cannot be computed; cancel; memory.
    pub fn step(
        &mut self,
        ctx: &Context,
        around: &Surroundings<'_>,
        [from, to]: [f64; 2],
        frame: i32,
    ) -> Result<StepReport> {
        let starts = std::mem::take(&mut self.starts);
        let before = self.clone();
        self.starts = Starts::of(&self.heap, self.next_id);
        let stepped = ctx.step(["source", "colliders", "move"].len(), || {
            let (born, removed_volume) = ctx.phase("source", || {
                let wake_settings = around.wake_settings(&self.params);
                if std::mem::replace(&mut self.wake_settings, wake_settings) != wake_settings {
                    self.heap.wake(|_| true);
                }
                self.source(ctx, around, [from, to], frame)
            })?;
            let mut obstacles = ctx.phase("colliders", || self.obstacles(around, [from, to]))?;
            let sub_steps = self.params.sub_steps(to - from, obstacles.max_displacement);
            let division = Division { dt: to - from, sub_steps };
            let all = self.heap.count();
            let ([expired, fell], resting, fastest) = ctx.phase("move", || {
                let coefficients = self.params.coefficients(&division);
                if let Some(distance) = self.params.active_distance.filter(|_| self.params.rests) {
                    self.heap.rest_far_away(
                        distance,
                        self.params.gravity,
                        &mut obstacles.colliders.shells,
                    )?;
                }
                self.heap.step(ctx, division, coefficients, &mut obstacles.colliders)?;
                let left = self.enforce_limits(around.lowest, to - from, frame);
                Ok((left, self.heap.resting(), self.heap.fastest()))
            })?;
            let (count, owed) = (self.heap.count(), self.owed());
            let (dropped, phases) = (all - count - expired, Vec::new());
            Ok(StepReport {
                count,
                resting,
                born,
                removed_volume,
                owed,
                dropped,
                fell,
                expired,
                trapped: self.heap.trapped().len(),
                sub_steps,
                fastest,
                phases,
            })
        });
        match stepped {
            Ok((report, phases)) => {
                self.starts.end(self.next_id);
                Ok(StepReport { phases, ..report })
            }
            Err(error) => {
                *self = Self { starts, ..before };
                Err(error)
            }
        }
    }

    /// Creates grains where snow was removed; returns their count and the volume of the snow (m3).
    fn source(
        &mut self,
        ctx: &Context,
        around: &Surroundings<'_>,
        [from, to]: [f64; 2],
        frame: i32,
    ) -> Result<(usize, f64)> {
        let Some(after) = around.base.after() else { return Ok((0, 0.0)) };
        let Some((before, removals)) = around.base.removed(ctx)? else { return Ok((0, 0.0)) };
        self.wake_near(&removals, after.voxel_size());
        let claims = Claims::new(around.objects, self.params.compression, [from, to])?;
        let sourcing = Sourcing { diameter: self.heap.diameter, claims, seed: self.params.seed, frame };
        ctx.allow("finding positions for grains", sourcing.bytes(removals.len(), after.voxel_size()))?;
        let cell = after.voxel_size();
        let behind = |position: DVec3| around.is_behind(position, 2.0 * cell);
        let positions = sourcing.positions([before.grid(), after], &removals, &mut self.owed, behind)?;
        self.check_count(positions.len(), frame)?;
        ctx.allow("the grains", memory(self.heap.count() + positions.len()))?;
        for position in &positions {
            self.add(*position, [0.0; 3], frame)?;
        }
        Ok((positions.len(), removals.iter().map(|removal| removal.volume).sum::<f64>() + 0.0))
    }

    /// The colliders of the step; wakes all grains if a mesh has jumped since the last step.
    fn obstacles<'a>(&mut self, around: &Surroundings<'a>, times: [f64; 2]) -> Result<Obstacles<'a>> {
        let obstacles = around.obstacles(&self.params, &self.heap.bounds(), times)?;
        let [first, last] = &obstacles.boxes;
        if !have_stayed(&self.boxes, first, self.heap.diameter) {
            self.heap.wake(|_| true);
        }
        self.boxes.clone_from(last);
        Ok(obstacles)
    }

    /// Removes grains that are too old, too low or outside the box; returns the counts of those that are too old and too low.
    fn enforce_limits(&mut self, lowest: f64, dt: f64, frame: i32) -> [usize; 2] {
        let Params { lifetime, keep_box, .. } = self.params;
        let all = self.heap.count();
        if let Some(lifetime) = lifetime {
            let births = &self.births;
            // Rounding must not add a frame to a lifetime of a whole number of frames.
            let age =
                |id: u32| (f64::from(frame) - f64::from(births[id as usize].frame)) * dt * (1.0 + 1.0e-9);
            self.heap.retain(|id, _| age(id) < lifetime);
        }
        let expired = all - self.heap.count();
        self.heap.retain(|_, position| position.y >= lowest);
        let fell = all - expired - self.heap.count();
        if let Some([low, high]) = keep_box {
            self.heap.retain(|_, position| low <= position && position <= high);
        }
        [expired, fell]
    }

    /// Wakes the grains within a diameter and a cell of the blocks of the base that lost snow; a cell is `cell` m wide.
    fn wake_near(&mut self, removals: &[Removal], cell: f64) {
        let changed: HashSet<Origin> = removals.iter().map(|removal| removal.origin).collect();
        let reach = 1.0 + self.heap.diameter / cell;
        self.heap.wake(|position| {
            let leaf = |axis: usize, off: f64| {
                ((position[axis] / cell + 0.5 + off).floor() as i32) & !(DIM as i32 - 1)
            };
            let ends = [0, 1, 2].map(|axis| [leaf(axis, -reach), leaf(axis, reach)]);
            let mut corners =
                (0..8).map(|corner| [0, 1, 2].map(|axis: usize| ends[axis][corner >> axis & 1]));
            let mut last = None;
            corners.any(|corner| last.replace(corner) != Some(corner) && changed.contains(&corner))
        });
    }

    /// Positions (m). The values of each grain, here and below, are in the order of [`Grains::points`].
    pub fn positions(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.heap.positions()
    }

    /// Velocities (m/s).
    pub fn velocities(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.heap.velocities()
    }

    /// Identities, counted from 0 in order of birth; they never change and are never reused.
    pub fn ids(&self) -> &[u32] {
        self.heap.ids()
    }

    /// Frame of birth of each grain.
    pub fn source_frames(&self) -> impl Iterator<Item = i32> + '_ {
        self.births().map(|birth| birth.frame)
    }

    /// Position of birth of each grain (m).
    pub fn rests(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.births().map(|birth| birth.rest)
    }

    /// Whether each is awake.
    pub fn awake(&self) -> impl Iterator<Item = bool> + '_ {
        self.heap.awake()
    }

    /// Identities of the grains that the last step could not move out of a surface, ascending: each is deeper than a tenth of
    /// its diameter in a surface and has no position outside all surfaces within a diameter and a half, as between a sole and
    /// the base.
    pub fn trapped(&self) -> &[u32] {
        self.heap.trapped()
    }

    /// Number of grains that removed snow has paid for but that do not exist yet; it may have a fraction.
    pub fn owed(&self) -> f64 {
        // An empty sum is -0.
        self.owed.values().sum::<f64>() + 0.0
    }

    fn births(&self) -> impl Iterator<Item = &Birth> + '_ {
        self.heap.ids().iter().map(|id| &self.births[*id as usize])
    }

    /// Whether each is trapped.
    pub fn trapped_each(&self) -> impl Iterator<Item = bool> + '_ {
        self.heap.ids().iter().map(|id| self.trapped().binary_search(id).is_ok())
    }

    /// The grains as points: `v` (m/s), `id`, `active` (false at rest), `trapped`, `pscale` (radius, m), `source_frame` and
    /// `rest` (position of birth, m).
    pub fn points(&self) -> Points {
        let (mut cells, mut offsets) = (Vec::new(), Vec::new());
        for (at, position) in self.heap.located() {
            // An offset is relative to the centre of its voxel, at most half a voxel.
            let position = position.map(|x| x / VOXEL);
            let voxel = position.map(|x| (x + 0.5).floor());
            cells.push(
                [0, 1, 2].map(|axis| at[axis] * (solver::blocks::EDGE / VOXEL) as i32 + voxel[axis] as i32),
            );
            offsets.push([0, 1, 2].map(|axis| position[axis] - voxel[axis]));
        }
        let trapped = match self.trapped() {
            [] => Column::Uniform(false),
            _ => Column::Each(self.trapped_each().collect()),
        };
        let attribute = |name: &str, values: Values| Attribute { name: name.into(), values };
        let attributes = vec![
            attribute("v", Values::Vector(Column::Each(self.heap.velocities().collect()))),
            attribute(
                "id",
                Values::Long(Column::Each(self.heap.ids().iter().map(|id| i64::from(*id)).collect())),
            ),
            attribute("active", Values::Bool(Column::Each(self.heap.awake().collect()))),
            attribute("trapped", Values::Bool(trapped)),
            attribute("pscale", Values::Float(Column::Uniform(self.params.radius as f32))),
            attribute("source_frame", Values::Int(Column::Each(self.source_frames().collect()))),
            attribute("rest", Values::Vector(Column::Each(self.rests().collect()))),
        ];
        Points { voxel_size: f64::from(VOXEL) * self.heap.diameter, cells, offsets, attributes }
    }
}
