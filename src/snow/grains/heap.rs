//! Grains and their motion: sub-steps of [`super::solver::solve`]; pairs are found again where grains have moved.

use rayon::prelude::*;

use super::colliders::field::CachedField;
use super::colliders::renewal;
use super::colliders::search::{Scratch, Search, Travel};
pub use super::colliders::set::{Colliders, Floor, Pose};
pub use super::colliders::shell::Shell;
use super::colliders::touch::{FIRST_SHELL, Touch};
pub use super::params::Division;
use super::solver::contacts::MAX_GRAINS;
use super::solver::layout::{Layout, SUB_STEPS_AHEAD, is_in_range, locate, order, settle, world};
use super::solver::pairs::PairImpulse;
use super::solver::rows::{Row, Shared, V, norm};
use super::solver::solve::{Motion, sub_step};
use super::solver::{rest, trapped};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::checks::ensure;
use crate::snow::grains::solver::blocks::{BlockIndex, NONE};
use crate::snow::grains::solver::collide::Coefficients;

/// Grains between two steps.
#[derive(Clone)]
pub struct Heap {
    pub(super) diameter: f64,
    pub(super) rows: Vec<Row>,
    pub(super) ids: Vec<u32>,
    /// Block index of each.
    pub(super) at: Vec<BlockIndex>,
    /// Impulses of pairs.
    pub(super) pair_impulses: Vec<PairImpulse>,
    /// Touches, sorted by slot and collider.
    pub(super) touches: Vec<Touch>,
    /// Identities of the grains trapped at the end of the last step, ascending.
    pub(super) trapped: Vec<u32>,
}

impl Heap {
    /// No grains yet; they will have this diameter (m).
    pub fn new(diameter: f64) -> Self {
        let (rows, ids, at) = (Vec::new(), Vec::new(), Vec::new());
        let (pair_impulses, touches, trapped) = Default::default();
        Self { diameter, rows, ids, at, pair_impulses, touches, trapped }
    }

    /// Count of grains.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Count of grains at rest.
    pub fn resting(&self) -> usize {
        self.rows.iter().filter(|row| row.rests()).count()
    }

    /// Adds a grain with an unused identity, at a position (m) with a velocity (m/s).
    ///
    /// # Errors
    /// A position out of range; too many grains.
    pub fn add(&mut self, id: u32, position: DVec3, velocity: V) -> Result<()> {
        let (at, position) = locate(position, self.diameter);
        ensure(is_in_range(at), "a grain is too far from the origin")?;
        if self.rows.len() >= MAX_GRAINS {
            return Err(Error::argument(format!("there are more than {MAX_GRAINS} grains")));
        }
        self.rows.push(Row { position, mass_state: 1.0, velocity, reference: position, ..Row::default() });
        self.ids.push(id);
        self.at.push(at);
        Ok(())
    }

    /// Removes the grains for which `keeps`, given identity and position (m), returns false.
    pub fn retain(&mut self, keeps: impl Fn(u32, DVec3) -> bool + Sync) {
        let is_kept = |slot: &u32| {
            let slot = *slot as usize;
            keeps(self.ids[slot], world(self.at[slot], self.rows[slot].position, self.diameter))
        };
        let kept: Vec<u32> = (0..self.rows.len() as u32).into_par_iter().filter(is_kept).collect();
        if kept.len() < self.rows.len() {
            self.reorder(&kept);
        }
    }

    /// Wakes the grains for which `wakes`, given the position (m), returns true.
    pub fn wake(&mut self, wakes: impl Fn(DVec3) -> bool + Sync) {
        let diameter = self.diameter;
        self.rows.par_iter_mut().zip(&self.at).for_each(|(row, at)| {
            if wakes(world(*at, row.position, diameter)) {
                rest::wake(row);
                rest::restart_wait(row);
            }
        });
    }

    /// Identities, in the order of [`Heap::positions`].
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Velocities (m/s).
    pub fn velocities(&self) -> impl Iterator<Item = V> + '_ {
        self.rows.iter().map(|row| row.velocity)
    }

    /// Positions (m).
    pub fn positions(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.rows.iter().zip(&self.at).map(|(row, at)| world(*at, row.position, self.diameter))
    }

    /// Bounding box (m) of all positions, plus a diameter; minimum above maximum if there are none.
    pub fn bounds(&self) -> [DVec3; 2] {
        let room = DVec3::repeat(self.diameter);
        let none = || [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let positions =
            self.rows.par_iter().zip(&self.at).map(|(row, at)| world(*at, row.position, self.diameter));
        let with = |[low, high]: [DVec3; 2], position: DVec3| {
            [low.inf(&(position - room)), high.sup(&(position + room))]
        };
        positions.fold(none, with).reduce(none, |[low, high], [l, h]| [low.inf(&l), high.sup(&h)])
    }

    /// Positions as a block and a position within it (diameters).
    pub fn located(&self) -> impl Iterator<Item = (BlockIndex, V)> + '_ {
        self.rows.iter().zip(&self.at).map(|(row, at)| (*at, row.position))
    }

    /// Whether each grain is awake.
    pub fn awake(&self) -> impl Iterator<Item = bool> + '_ {
        self.rows.iter().map(|row| !row.rests())
    }

    /// Identities of the grains that the last step left trapped, ascending: see [`super::solver::trapped`].
    pub fn trapped(&self) -> &[u32] {
        &self.trapped
    }

    /// Largest speed (m/s).
    pub fn fastest(&self) -> f32 {
        self.rows.par_iter().map(|row| norm(row.velocity)).reduce(|| 0.0, f32::max)
    }

    /// Moves the grains through a step.
    ///
    /// # Errors
    /// Cancel; a pose that cannot be computed; a grid that cannot be read; a position or velocity that is no longer finite.
    pub fn step(
        &mut self,
        ctx: &Context,
        division: Division,
        coefficients: Coefficients,
        colliders: &mut Colliders<'_>,
    ) -> Result<()> {
        let dt = division.dt / division.sub_steps as f64;
        for (number, (shell, _)) in (FIRST_SHELL..).zip(&mut colliders.shells) {
            shell.collider = number;
        }
        let mut pose = Vec::new();
        advance_shells(&mut colliders.shells, 0.0, &mut pose)?;
        self.make_room(ctx, colliders, MAX_IN_CELL_BEFORE)?;
        let Colliders { floor, field, shells } = colliders;
        let mut field = field.as_ref().map(|field| CachedField::new(field, self.diameter));
        // Distance (diameters) that a grain at 1 m/s moves while its pairs should last.
        let ahead = (f64::from(SUB_STEPS_AHEAD) * dt / self.diameter) as f32;
        let mut layout = self.sort_into_blocks(ahead);
        // Largest travel of the meshes in the step so far (diameters).
        let mut before = 0.0;
        let mut fastest = self.fastest();
        self.rows.par_iter_mut().for_each(|row| row.travel_limit = 0.0);
        ctx.expect(division.sub_steps);
        for sub in 0..division.sub_steps {
            ctx.check()?;
            layout.update_members(&mut self.rows, &self.ids, ahead);
            advance_shells(shells, (sub + 1) as f64 / division.sub_steps as f64, &mut pose)?;
            let meshes: Vec<&Shell> = shells.iter().map(|(shell, _)| shell).collect();
            let travel = Travel::of(&meshes, self.diameter);
            let search = Search { shells: meshes, diameter: self.diameter, dt, before, travel };
            self.find_touches(&mut layout, *floor, field.as_mut(), &search)?;
            before += travel.max();
            ctx.check()?;
            layout.mark_reached(coefficients.visits_all);
            layout.find_pairs();
            if sub == 0 && coefficients.air_by_neighbours.is_some() {
                layout.count_neighbours(&self.rows);
            }
            let limit = search.fastest(fastest, coefficients.restitution, coefficients.gravity[1]);
            let motion = Motion { mesh_displacement: travel.common, fastest: limit };
            fastest = sub_step(ctx, &mut self.rows, &mut layout, &coefficients, motion)?;
            ctx.advance();
        }
        advance_shells(shells, 1.0, &mut pose)?;
        let end = trapped::StepEnd { layout: &layout, diameter: self.diameter, dt, travelled: before };
        let deep = end.deep(&self.rows, &self.ids, &self.trapped, field.as_ref());
        self.trapped = end.release(&mut self.rows, &self.ids, &deep, colliders)?;
        self.store_layout(layout)?;
        self.make_room(ctx, colliders, MAX_IN_CELL)
    }

    /// Sorts the grains into blocks.
    fn sort_into_blocks(&mut self, ahead: f32) -> Layout {
        let from = order(&self.rows, &self.ids, &self.at);
        self.reorder(&from);
        let mut layout = Layout::new(&mut self.rows, &self.ids, &self.at, ahead);
        layout.keep_impulses(std::mem::take(&mut self.pair_impulses));
        for touch in std::mem::take(&mut self.touches) {
            layout.blocks[layout.homes[touch.grain as usize].block as usize].touches.push(touch);
        }
        layout
    }

    /// Stores the data of a layout that the next step needs; removes the grains that have left the range of blocks.
    fn store_layout(&mut self, mut layout: Layout) -> Result<()> {
        self.pair_impulses = layout.take_impulses();
        self.touches = layout.blocks.iter().flat_map(|block| block.touches.iter().copied()).collect();
        self.touches.iter_mut().for_each(|touch| *touch = touch.for_next_step());
        self.touches.par_sort_unstable_by_key(Touch::key);
        self.rows.par_iter_mut().zip(&mut self.at).zip(&layout.homes).for_each(|((row, at), home)| {
            if home.block != NONE {
                *at = layout.blocks[home.block as usize].at;
                settle(row, at);
            }
        });
        let is_finite = |row: &Row| row.position.iter().chain(&row.velocity).all(|x| x.is_finite());
        ensure(
            self.rows.par_iter().all(is_finite),
            "a grain would move infinitely fast: the base layer or an object is not as it should be",
        )?;
        let is_there =
            |slot: &u32| layout.homes[*slot as usize].block != NONE && is_in_range(self.at[*slot as usize]);
        let kept: Vec<u32> = (0..self.rows.len() as u32).filter(is_there).collect();
        if kept.len() < self.rows.len() {
            self.reorder(&kept);
        }
        Ok(())
    }

    /// Moves the grains to new slots; `from` lists their old slots, and grains that it omits are removed.
    fn reorder(&mut self, from: &[u32]) {
        let leaves_out = from.len() < self.rows.len();
        let mut slots = vec![NONE; self.rows.len()];
        from.iter().zip(0..).for_each(|(&was, slot)| slots[was as usize] = slot);
        self.rows = from.par_iter().map(|&from| self.rows[from as usize]).collect();
        self.ids = from.par_iter().map(|&from| self.ids[from as usize]).collect();
        self.at = from.par_iter().map(|&from| self.at[from as usize]).collect();
        self.pair_impulses
            .par_iter_mut()
            .for_each(|held| held.grains = held.grains.map(|grain| slots[grain as usize]));
        self.touches.iter_mut().for_each(|touch| touch.grain = slots[touch.grain as usize]);
        if leaves_out {
            self.pair_impulses.retain(|held| !held.grains.contains(&NONE));
            self.touches.retain(|touch| touch.grain != NONE);
        }
        self.touches.par_sort_unstable_by_key(Touch::key);
    }

    /// Finds the touches of grains, and wakes the grains that a moving surface touches.
    fn find_touches(
        &mut self,
        layout: &mut Layout,
        floor: Option<Floor>,
        field: Option<&mut CachedField<'_>>,
        search: &Search<'_>,
    ) -> Result<()> {
        let mut fresh: Vec<Vec<Touch>> = vec![Vec::new(); layout.blocks.len()];
        if !search.shells.is_empty() {
            let rows = Shared::new(&mut self.rows);
            // Few blocks search, and those are adjacent: small tasks balance the load.
            let blocks = layout.blocks.par_iter_mut().zip(&mut fresh);
            let searching: Vec<_> = blocks.filter(|(block, _)| search.may_be_near(block)).collect();
            let searching = searching.into_par_iter().with_max_len(4);
            searching.for_each_init(Scratch::default, |scratch, (block, fresh)| {
                *fresh = search.touches(scratch, block, rows);
                block.is_awake |= !fresh.is_empty();
            });
        }
        // Blocks at rest need no touches, but are due if their grains changed: grains that left take their touches along.
        layout.blocks.par_iter_mut().for_each(|block| {
            block.is_due = block.lacks_touches && (block.is_awake || block.has_ever_changed);
            block.lacks_touches &= !block.is_due;
        });
        let due: Vec<u32> =
            (0..).zip(&layout.blocks).filter(|(_, block)| block.is_due).map(|(index, _)| index).collect();
        let reach = (2.0 * search.dt / self.diameter) as f32;
        if let Some(floor) = &floor {
            let blocks = layout.blocks.par_iter().zip(&mut fresh).filter(|(block, _)| block.is_due);
            blocks.for_each(|(block, fresh)| {
                fresh.extend(floor.touches(block, &self.rows, self.diameter, reach));
            });
        }
        if let Some(field) = field {
            let found = field.touches(layout, &due, &self.rows, reach)?;
            due.iter().zip(found).for_each(|(&index, found)| fresh[index as usize].extend(found));
        }
        renewal::renew(&mut layout.blocks, fresh);
        Ok(())
    }

    /// Overlaps (diameters) of touching pairs, for tests and reports.
    pub fn overlaps(&self) -> Vec<f32> {
        let mut heap = self.clone();
        let mut layout = heap.sort_into_blocks(0.0);
        layout.mark_reached(true);
        layout.find_pairs();
        layout.overlaps(&heap.rows)
    }
}

/// Advances meshes to the pose at a share 0..=1 of the step.
fn advance_shells(shells: &mut [(Shell, Pose<'_>)], share: f64, pose: &mut Vec<DVec3>) -> Result<()> {
    for (shell, at) in shells {
        at(share, pose)?;
        shell.advance(pose);
    }
    Ok(())
}

/// Maximum number of grains in a cell that is not crowded; a random packing fits ten.
pub const MAX_IN_CELL: usize = 14;

/// The same before a step, much larger: only a cell with more, for example from a file with many grains at one position, would give grains
/// too many neighbours. So grains that the last step could not move out are not tried again.
pub const MAX_IN_CELL_BEFORE: usize = 64;

/// The grains at the beginning of the last step.
#[derive(Clone, Default)]
pub(super) struct Starts {
    /// By identity, ascending.
    pub grains: Vec<(u32, Start)>,
    /// Identities of the grains that the step created: first and end (exclusive).
    pub born: [u32; 2],
}

impl Starts {
    /// The state at the beginning of a step, given the next identity to be assigned.
    pub fn of(heap: &Heap, next_id: u32) -> Self {
        let all = heap.ids().iter().copied().zip(heap.positions().zip(heap.velocities()));
        let mut grains: Vec<(u32, Start)> = all.collect();
        grains.par_sort_unstable_by_key(|(id, _)| *id);
        Self { grains, born: [next_id; 2] }
    }

    /// Records the end of the step, given the next identity to be assigned.
    pub fn end(&mut self, next_id: u32) {
        self.born[1] = next_id;
    }

    pub fn find(&self, id: u32) -> Option<Start> {
        self.grains.binary_search_by_key(&id, |(id, _)| *id).ok().map(|index| self.grains[index].1)
    }
}

/// Position (m) and velocity (m/s) at the beginning of a step.
pub type Start = (DVec3, [f32; 3]);
