//! Grains that a step leaves in a surface: pressed between a sole and the base, say. At the step's end each of them is moved out
//! of the surfaces around it, one after the other, again and again. One that finds no place within a diameter and a half stays
//! where it was: it is *trapped*.

use rayon::prelude::*;

use super::heap::Colliders;
use super::layout::{At, Block, Layout, world};
use super::nearby::Nearby;
use super::rows::{Row, V, add, dot};
use super::surfaces::Surfaces;
use super::touch::Touch;
use crate::error::Result;

/// Depth (diameters) in a surface from which a grain is in it.
pub const DEEP: f64 = 0.1;
/// Gap (diameters) to the plane of a surface up to which a grain that is awake may be in the surface itself.
const NEAR: f32 = 0.1;
/// Room around a block for grains that left it and are moved (cells of a level set).
const MARGIN: f64 = 4.0;

/// A step's end.
pub struct End<'a> {
    /// Where the grains are.
    pub layout: &'a Layout,
    /// Diameter of a grain (m).
    pub diameter: f64,
    /// Length of the last sub-step (s).
    pub dt: f64,
}

impl End<'_> {
    /// Moves grains out of the surfaces that they are in; the identities of those that have no room, ascending, as `before` has
    /// them of the last step.
    ///
    /// # Errors
    /// A pose that cannot be computed; what a grid reports.
    pub fn release(
        &self,
        rows: &mut [Row],
        ids: &[u32],
        before: &[u32],
        colliders: &Colliders<'_>,
    ) -> Result<Vec<u32>> {
        let blocks = self.layout.blocks.par_iter();
        let deep: Vec<Vec<u32>> = blocks.map(|block| self.deep(block, rows, ids, before)).collect();
        let which: Vec<u32> =
            (0..).zip(&deep).filter(|(_, deep)| !deep.is_empty()).map(|(index, _)| index).collect();
        if which.is_empty() {
            return Ok(Vec::new());
        }
        let blocks: Vec<At> = which.iter().map(|&block| self.layout.blocks[block as usize].at).collect();
        let around = Surfaces::around(colliders, &blocks, self.diameter, MARGIN)?;
        let seen = &*rows;
        let blocks = which.par_iter().zip(&around).with_max_len(1);
        let released = blocks.map_init(Vec::new, |nearby: &mut Vec<Nearby>, (&block, surfaces)| {
            let at = self.layout.blocks[block as usize].at;
            let place = |slot: u32| world(at, seen[slot as usize].place, self.diameter);
            let deep = &deep[block as usize];
            surfaces.find(deep.iter().map(|&slot| place(slot)), nearby);
            deep.iter().map(|&slot| (slot, surfaces.release(place(slot), nearby))).collect::<Vec<_>>()
        });
        let released: Vec<Vec<(u32, Option<V>)>> = released.collect();
        let mut trapped = Vec::new();
        for (slot, way) in released.into_iter().flatten() {
            match way {
                Some(way) => rows[slot as usize].place = add(rows[slot as usize].place, way),
                None => trapped.push(ids[slot as usize]),
            }
        }
        trapped.par_sort_unstable();
        Ok(trapped)
    }

    /// Members of a block that may be in something: those whose planes come near them while they are awake, or say that they
    /// are in them while they rest; those that are so deep in a level set that there is no plane; and those that rest where they
    /// had no room.
    fn deep(&self, block: &Block, rows: &[Row], ids: &[u32], before: &[u32]) -> Vec<u32> {
        let is_deep = |touch: &&Touch| {
            let row = &rows[touch.grain as usize];
            if !touch.has_plane() {
                return !row.rests();
            }
            let moved = dot(touch.velocity, touch.normal) * (self.dt / self.diameter) as f32;
            let depth = touch.offset + moved - dot(touch.normal, row.place);
            depth > if row.rests() { 0.5 * DEEP as f32 } else { -NEAR }
        };
        let had_no_room = |slot: &&u32| {
            let slot = **slot as usize;
            rows[slot].rests() && before.binary_search(&ids[slot]).is_ok()
        };
        let mut deep: Vec<u32> = block.touches.iter().filter(is_deep).map(|touch| touch.grain).collect();
        if !before.is_empty() {
            deep.extend(block.members.iter().filter(had_no_room));
            deep.sort_unstable();
        }
        deep.dedup();
        deep
    }
}
