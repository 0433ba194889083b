//! Grains that a step leaves inside a surface, for example pressed between a sole and the base. At the end of the step each is moved out of
//! the surfaces around it, one after another, repeatedly. A grain that reaches no free position within a diameter and a half stays where it
//! was, except that it is moved out of ground: it is *trapped*.

use rayon::prelude::*;

use super::blocks::BlockIndex;
use super::layout::{Layout, world};
use super::rows::{Row, V, add, dot};
use super::surfaces::{DEEP, Surfaces};
use crate::error::Result;
use crate::snow::grains::colliders::field::CachedField;
use crate::snow::grains::colliders::nearby::Nearby;
use crate::snow::grains::colliders::search::block_reach;
use crate::snow::grains::colliders::set::Colliders;
use crate::snow::grains::colliders::touch::Touch;

/// A grain that is awake and this near (diameters) to the plane of a surface may be inside the surface itself.
const NEAR: f32 = 0.1;
/// Margin around a block (cells of a level set) for grains that left it or are moved.
const MARGIN: f64 = 4.0;

/// Input at the end of a step.
pub struct StepEnd<'a> {
    /// Blocks of the grains.
    pub layout: &'a Layout,
    /// Diameter of a grain (m).
    pub diameter: f64,
    /// Length of the last sub-step (s).
    pub dt: f64,
    /// How far the meshes may have travelled in the step (diameters).
    pub travelled: f64,
}

impl StepEnd<'_> {
    /// Members of each block that may be inside a surface; `field` is the level set that the sub-steps read, and `trapped_before` has the
    /// identities of the grains that the last step left trapped, ascending.
    pub fn deep(
        &self,
        rows: &[Row],
        ids: &[u32],
        trapped_before: &[u32],
        field: Option<&CachedField<'_>>,
    ) -> Vec<Vec<u32>> {
        (0..self.layout.blocks.len())
            .into_par_iter()
            .map(|index| self.deep_members(index, rows, ids, trapped_before, field))
            .collect()
    }

    /// Moves the grains that [`StepEnd::deep`] found out of surfaces. Returns the identities of the trapped ones, ascending.
    ///
    /// # Errors
    /// A pose that cannot be computed; errors of a grid.
    pub fn release(
        &self,
        rows: &mut [Row],
        ids: &[u32],
        deep: &[Vec<u32>],
        colliders: &Colliders<'_>,
    ) -> Result<Vec<u32>> {
        let which: Vec<u32> =
            (0..).zip(deep).filter(|(_, deep)| !deep.is_empty()).map(|(index, _)| index).collect();
        if which.is_empty() {
            return Ok(Vec::new());
        }
        let blocks: Vec<BlockIndex> =
            which.iter().map(|&block| self.layout.blocks[block as usize].at).collect();
        let around = Surfaces::around(colliders, &blocks, self.diameter, MARGIN)?;
        let seen = &*rows;
        let blocks = which.par_iter().zip(&around).with_max_len(1);
        let released = blocks.map_init(Vec::new, |nearby: &mut Vec<Nearby>, (&block, surfaces)| {
            let at = self.layout.blocks[block as usize].at;
            let position = |slot: u32| world(at, seen[slot as usize].position, self.diameter);
            let deep = &deep[block as usize];
            surfaces.find(deep.iter().map(|&slot| position(slot)), nearby);
            deep.iter().map(|&slot| (slot, surfaces.release(position(slot), nearby))).collect::<Vec<_>>()
        });
        let released: Vec<Vec<(u32, (V, bool))>> = released.collect();
        let mut trapped = Vec::new();
        for (slot, (displacement, is_trapped)) in released.into_iter().flatten() {
            rows[slot as usize].position = add(rows[slot as usize].position, displacement);
            if is_trapped {
                trapped.push(ids[slot as usize]);
            }
        }
        trapped.par_sort_unstable();
        Ok(trapped)
    }

    /// Members of a block that may be inside a surface: awake grains close to the plane of a touch, or in a surface that they did not touch
    /// before the last sub-step pushed them there; resting grains inside such a plane; and resting grains that were trapped before.
    fn deep_members(
        &self,
        index: usize,
        rows: &[Row],
        ids: &[u32],
        trapped_before: &[u32],
        field: Option<&CachedField<'_>>,
    ) -> Vec<u32> {
        let block = &self.layout.blocks[index];
        let has_mesh = f64::from(block.travel_limit) - self.travelled < block_reach();
        let is_deep = |touch: &&Touch| {
            let row = &rows[touch.grain as usize];
            if !touch.has_plane() {
                return !row.rests();
            }
            let moved = dot(touch.velocity, touch.normal) * (self.dt / self.diameter) as f32;
            let depth = touch.offset + moved - dot(touch.normal, row.position);
            depth > if row.rests() { 0.5 * DEEP as f32 } else { -NEAR }
        };
        let was_pushed_in = |slot: &&u32| {
            let row = &rows[**slot as usize];
            let is_in_mesh = || row.travel_limit > 0.0 && f64::from(row.travel_limit) - self.travelled < 0.5;
            let is_in_field = || {
                let distance = field.and_then(|field| field.distance(index, block.at, row.position));
                distance.is_some_and(|distance| distance < 0.5)
            };
            !row.rests() && (has_mesh && is_in_mesh() || is_in_field())
        };
        let had_no_room = |slot: &&u32| {
            let slot = **slot as usize;
            rows[slot].rests() && trapped_before.binary_search(&ids[slot]).is_ok()
        };
        let mut deep: Vec<u32> = block.touches.iter().filter(is_deep).map(|touch| touch.grain).collect();
        deep.extend(block.members.iter().filter(was_pushed_in));
        if !trapped_before.is_empty() {
            deep.extend(block.members.iter().filter(had_no_room));
        }
        deep.sort_unstable();
        deep.dedup();
        deep
    }
}
