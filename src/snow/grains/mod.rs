//! Grains: snow that is pushed, piled and thrown (thesis section 3.3).
//!
//! They are born where the base layer was removed (`sourcing`), pushed by what moves (`shell`), lie on the base (`field`), pile up
//! at their angle of repose (`solve`), come to rest (`rest`), and read the base layer without changing it. A step is divided into
//! sub-steps (`heap`).
//!
//! | word | meaning |
//! |---|---|
//! | row | the part of a grain that every sub-step reads and writes, a cache line |
//! | pair | two grains that touch or may soon; one of them owns it |
//! | batch | eight pairs that share no grain, solved at once |
//! | touch | a grain beside a plane that it cannot move: ground, base, object |
//! | impulse | what a contact changes of a velocity; kept from sub-step to sub-step |
//! | push | a displacement that removes overlap and never becomes velocity |
//! | block, column | 8 x 8 x 8 diameters; blocks one above the other, the unit of work |
//! | colour | one of four sets of columns that share no grain |
//! | anchor | where a grain was when its pairs were found |
//! | rest | a grain that has lain still stops, and holds what lies on it, until something wakes it |

mod claims;
mod collide;
mod contacts;
mod crowd;
mod density;
mod distance;
mod field;
#[doc(hidden)]
pub mod heap;
mod layout;
mod nearby;
mod params;
mod rest;
mod rows;
mod search;
mod shell;
#[doc(hidden)]
pub mod solve;
mod sourcing;
mod state;
mod surfaces;
mod surroundings;
mod touch;
mod trapped;

use std::collections::{BTreeMap, HashSet};

use crate::base::DVec3;
use crate::base::blocks::{DIM, Origin};
use crate::base::points::{Attribute, Column, Points, Values};
use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};

use claims::Claims;
use heap::{Division, Heap};
use layout::locate;
use sourcing::Sourcing;
use surroundings::{Bounds, Obstacles, TIES, have_stayed};

pub use params::Params;
pub use sourcing::{Base, PACKING, Removal, removals};
pub use surroundings::{Object, Surroundings};

/// Where and when a grain was born.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Birth {
    /// Its place then (m).
    rest: [f32; 3],
    /// The frame that removed its snow.
    frame: i32,
}

/// Grains of a layer of snow.
#[derive(Clone)]
pub struct Grains {
    params: Params,
    heap: Heap,
    /// By identity.
    births: Vec<Birth>,
    next_id: u32,
    /// Grains that blocks of the base have paid for and not got: fractions, mostly.
    owed: BTreeMap<Origin, f64>,
    /// What rest depends on as a whole, as it was in the last step: see [`Surroundings::ties`].
    ties: [f64; TIES],
    /// The boxes (m) of the meshes at the end of the last step.
    boxes: Vec<Bounds>,
}

/// What a step did.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Grains now.
    pub count: usize,
    /// Those that rest.
    pub resting: usize,
    /// Grains that were born.
    pub born: usize,
    /// Snow removed from the base (m3).
    pub removed_volume: f64,
    /// Grains that removed snow has paid for and that are not born yet.
    pub owed: f64,
    /// Grains that fell below the lowest height, left [`Params::keep_box`] or the range of coordinates.
    pub dropped: usize,
    /// Grains that had lived for [`Params::lifetime`].
    pub expired: usize,
    /// Grains that are pressed where they have no room: see [`Grains::trapped`].
    pub trapped: usize,
    /// Sub-steps.
    pub sub_steps: usize,
    /// Largest speed (m/s).
    pub fastest: f32,
    /// Wall-clock time of each phase.
    pub phases: Vec<PhaseTime>,
}

/// Edge (diameters) of a voxel of [`Grains::points`], a power of two: it holds the few grains that readers of VDB Points like best.
const VOXEL: f32 = 2.0;

/// Largest component (m/s) of the velocity of a grain that is emitted.
pub const FASTEST: f32 = 10_000.0;

/// Memory (bytes) of grains in a step, with the copy to which a failed step returns.
pub fn memory(grains: usize) -> u64 {
    (grains as u64).saturating_mul(760)
}

impl Grains {
    /// No grains yet.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn new(params: Params) -> Result<Self> {
        params.validate()?;
        let heap = Heap::new(2.0 * params.radius);
        let (births, owed, boxes) = Default::default();
        Ok(Self { params, heap, births, next_id: 0, owed, ties: [0.0; TIES], boxes })
    }

    /// Resumes from what [`Grains::save`] wrote.
    ///
    /// # Errors
    /// A parameter out of range; bytes that are no such state.
    pub fn resume(params: Params, bytes: &[u8]) -> Result<Self> {
        let mut grains = Self::new(params)?;
        state::load(&mut grains, bytes)?;
        Ok(grains)
    }

    /// Bytes that a saved state has once it is unpacked; 0 where it is none.
    pub fn unpacked(bytes: &[u8]) -> u64 {
        state::unpacked(bytes)
    }

    /// The exact state as bytes, the same from any number of threads.
    pub fn save(&self) -> Vec<u8> {
        state::save(self)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.heap.count()
    }

    /// How they behave.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// How they behave from the next step on.
    ///
    /// # Errors
    /// A parameter out of range, another radius; the old ones are then kept.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate()?;
        if params.radius != self.params.radius {
            let old = self.params.radius;
            return Err(Error::argument(format!("radius = {} cannot change, it is {old}", params.radius)));
        }
        self.params = params;
        Ok(())
    }

    /// Adds loose grains at places (m) with velocities (m/s), at rest where there are none of these; `frame` is that of their
    /// birth. Returns the identity of the first, those of the others follow. After a failure all is as it was.
    ///
    /// # Errors
    /// Too many grains; a place out of range; a velocity that is not finite or over [`FASTEST`].
    pub fn emit(&mut self, places: &[DVec3], velocities: &[[f32; 3]], frame: i32) -> Result<u32> {
        if !velocities.is_empty() && velocities.len() != places.len() {
            let text =
                format!("velocities: {} elements, but there are {} places", velocities.len(), places.len());
            return Err(Error::argument(text));
        }
        let is_out = |place: &DVec3| {
            !place.iter().all(|x| x.is_finite()) || !layout::holds(locate(*place, self.heap.diameter).0)
        };
        if let Some(at) = places.iter().position(is_out) {
            return Err(Error::argument(format!("positions: element {at} is too far from the origin")));
        }
        let is_fast = |velocity: &[f32; 3]| velocity.iter().any(|x| !(-FASTEST..=FASTEST).contains(x));
        if let Some(at) = velocities.iter().position(is_fast) {
            let text = format!(
                "velocities: element {at} has a component that is not within -{FASTEST} to {FASTEST} m/s"
            );
            return Err(Error::argument(text));
        }
        self.room_for(places.len(), frame)?;
        let first = self.next_id;
        for (at, place) in places.iter().enumerate() {
            self.add(*place, velocities.get(at).copied().unwrap_or_default(), frame)?;
        }
        Ok(first)
    }

    /// Refuses more grains than there may be.
    fn room_for(&self, more: usize, frame: i32) -> Result<()> {
        let (count, most) = (self.heap.count() + more, self.params.most);
        if count > most || self.next_id as usize + more > contacts::MOST {
            return Err(Error::argument(format!(
                "frame {frame} would have {count} grains, more than max = {most}: larger grains or more compression make fewer"
            )));
        }
        Ok(())
    }

    fn add(&mut self, place: DVec3, velocity: [f32; 3], frame: i32) -> Result<()> {
        self.heap.add(self.next_id, place, velocity)?;
        self.births.push(Birth { rest: [place.x as f32, place.y as f32, place.z as f32], frame });
        self.next_id += 1;
        Ok(())
    }

    /// How many rest.
    pub fn resting(&self) -> usize {
        self.heap.resting()
    }

    /// Moves the grains from `from` to `to` (s), those born of the snow that this removed from the base among them. A step that
    /// fails or is cancelled leaves them as they were.
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
        let before = self.clone();
        let stepped = ctx.step(["source", "colliders", "move"].len(), || {
            let (born, removed_volume) = ctx.phase("source", || {
                let ties = around.ties(&self.params);
                if std::mem::replace(&mut self.ties, ties) != ties {
                    self.heap.wake(|_| true);
                }
                self.source(ctx, around, [from, to], frame)
            })?;
            let mut obstacles = ctx.phase("colliders", || self.obstacles(around, [from, to]))?;
            let sub_steps = self.params.sub_steps(to - from, obstacles.way);
            let division = Division { dt: to - from, sub_steps };
            let all = self.heap.count();
            let (expired, resting, fastest) = ctx.phase("move", || {
                let coefficients = self.params.coefficients(&division);
                if let Some(distance) = self.params.active_distance.filter(|_| self.params.rests) {
                    self.heap.rest_far_away(
                        distance,
                        self.params.gravity,
                        &mut obstacles.colliders.shells,
                    )?;
                }
                self.heap.step(ctx, division, coefficients, &mut obstacles.colliders)?;
                let expired = self.limit(around.lowest, to - from, frame);
                Ok((expired, self.heap.resting(), self.heap.fastest()))
            })?;
            let (count, owed) = (self.heap.count(), self.owed.values().sum());
            let (dropped, phases) = (all - count - expired, Vec::new());
            Ok(StepReport {
                count,
                resting,
                born,
                removed_volume,
                owed,
                dropped,
                expired,
                trapped: self.heap.trapped().len(),
                sub_steps,
                fastest,
                phases,
            })
        });
        match stepped {
            Ok((report, phases)) => Ok(StepReport { phases, ..report }),
            Err(error) => {
                *self = before;
                Err(error)
            }
        }
    }

    /// Grains where snow was removed; how many, and the snow's volume (m3).
    fn source(
        &mut self,
        ctx: &Context,
        around: &Surroundings<'_>,
        [from, to]: [f64; 2],
        frame: i32,
    ) -> Result<(usize, f64)> {
        let Some(after) = around.base.after() else { return Ok((0, 0.0)) };
        let Some((before, removals)) = around.base.taken(ctx)? else { return Ok((0, 0.0)) };
        self.wake_near(&removals, after.voxel_size());
        let claims = Claims::new(around.objects, self.params.compression, [from, to])?;
        let sourcing = Sourcing { diameter: self.heap.diameter, claims, seed: self.params.seed, frame };
        ctx.allow("finding places for grains", sourcing.bytes(removals.len(), after.voxel_size()))?;
        let places = sourcing.places(before.grid(), after, &removals, &mut self.owed)?;
        self.room_for(places.len(), frame)?;
        ctx.allow("the grains", memory(self.heap.count() + places.len()))?;
        for place in &places {
            self.add(*place, [0.0; 3], frame)?;
        }
        Ok((places.len(), removals.iter().map(|removal| removal.volume).sum()))
    }

    /// What the grains cannot move; all of them wake where a mesh is not where it was.
    fn obstacles<'a>(&mut self, around: &Surroundings<'a>, times: [f64; 2]) -> Result<Obstacles<'a>> {
        let obstacles = around.obstacles(&self.params, &self.heap.bounds(), times)?;
        let [first, last] = &obstacles.boxes;
        if !have_stayed(&self.boxes, first, self.heap.diameter) {
            self.heap.wake(|_| true);
        }
        self.boxes.clone_from(last);
        Ok(obstacles)
    }

    /// Takes away grains that are too old (how many is returned), too low, or out of the box.
    fn limit(&mut self, lowest: f64, dt: f64, frame: i32) -> usize {
        let Params { lifetime, keep_box, .. } = self.params;
        let all = self.heap.count();
        if let Some(lifetime) = lifetime {
            let births = &self.births;
            // A grain that lives for a whole number of frames is not to outlive them by rounding.
            let age =
                |id: u32| (f64::from(frame) - f64::from(births[id as usize].frame)) * dt * (1.0 + 1.0e-9);
            self.heap.retain(|id, _| age(id) < lifetime);
        }
        let expired = all - self.heap.count();
        self.heap.retain(|_, place| {
            place.y >= lowest && keep_box.is_none_or(|[low, high]| low <= place && place <= high)
        });
        expired
    }

    /// Wakes the grains within a grain and a cell of blocks of the base (m a cell) that have lost snow.
    fn wake_near(&mut self, removals: &[Removal], cell: f64) {
        let changed: HashSet<Origin> = removals.iter().map(|removal| removal.origin).collect();
        let reach = 1.0 + self.heap.diameter / cell;
        self.heap.wake(|place| {
            let leaf =
                |axis: usize, off: f64| ((place[axis] / cell + 0.5 + off).floor() as i32) & !(DIM as i32 - 1);
            let ends = [0, 1, 2].map(|axis| [leaf(axis, -reach), leaf(axis, reach)]);
            let mut corners =
                (0..8).map(|corner| [0, 1, 2].map(|axis: usize| ends[axis][corner >> axis & 1]));
            let mut last = None;
            corners.any(|corner| last.replace(corner) != Some(corner) && changed.contains(&corner))
        });
    }

    /// Places (m), in the order in which [`Grains::points`] has the grains, as all that follows.
    pub fn places(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.heap.places()
    }

    /// Velocities (m/s).
    pub fn velocities(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.heap.velocities()
    }

    /// Identities, counted from 0 in the order of birth: a grain keeps its own, and no other ever has it.
    pub fn ids(&self) -> &[u32] {
        self.heap.ids()
    }

    /// The frame of each one's birth.
    pub fn source_frames(&self) -> impl Iterator<Item = i32> + '_ {
        self.births().map(|birth| birth.frame)
    }

    /// The place of each one's birth (m).
    pub fn rests(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        self.births().map(|birth| birth.rest)
    }

    /// Whether each is awake.
    pub fn awake(&self) -> impl Iterator<Item = bool> + '_ {
        self.heap.awake()
    }

    /// Identities of the grains that the last step left no room, ascending: each is deeper than a tenth of its diameter in a
    /// surface, and has no place outside of all surfaces within a diameter and a half, such as between a sole and the base.
    pub fn trapped(&self) -> &[u32] {
        self.heap.trapped()
    }

    fn births(&self) -> impl Iterator<Item = &Birth> + '_ {
        self.heap.ids().iter().map(|id| &self.births[*id as usize])
    }

    /// Whether each is trapped.
    pub fn trapped_each(&self) -> impl Iterator<Item = bool> + '_ {
        self.heap.ids().iter().map(|id| self.trapped().binary_search(id).is_ok())
    }

    /// The grains as points: `v` (m/s), `id`, `active` (not where it rests), `trapped` (where it has no room), `pscale` (radius, m),
    /// `source_frame` and `rest` (place of birth, m).
    pub fn points(&self) -> Points {
        let (mut cells, mut offsets) = (Vec::new(), Vec::new());
        for (at, place) in self.heap.located() {
            // Offsets reach half a voxel around its centre.
            let place = place.map(|x| x / VOXEL);
            let voxel = place.map(|x| (x + 0.5).floor());
            cells.push([0, 1, 2].map(|axis| at[axis] * (layout::EDGE / VOXEL) as i32 + voxel[axis] as i32));
            offsets.push([0, 1, 2].map(|axis| place[axis] - voxel[axis]));
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
