//! Grains that a step leaves in a surface: pressed between a sole and the base, say. At the step's end each of them is moved out
//! of the surfaces around it, one after the other, again and again. One that finds no place within a diameter and a half stays
//! where it was: it is *trapped*.

use rayon::prelude::*;

use super::field::{Field, Window};
use super::heap::{Colliders, Floor};
use super::layout::{At, Block, Layout, world};
use super::rows::{Row, V, dot};
use super::shell::Shell;
use super::touch::Touch;
use crate::base::DVec3;
use crate::error::Result;

/// Depth (diameters) in a surface from which a grain is in it.
const DEEP: f64 = 0.1;
/// Share of that depth in which places that are written with less precision stay.
const ROUNDED: f64 = 0.98;
/// Gap (diameters) to the plane of a surface up to which a grain that is awake may be in the surface itself.
const NEAR: f32 = 0.1;
/// How often it is moved out of each surface.
const ROUNDS: usize = 16;
/// Farthest that it is moved (diameters).
const FARTHEST: f64 = 1.5;
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
    /// them of the last step. `pose` is room for the places of a mesh.
    ///
    /// # Errors
    /// A pose that cannot be computed; what a grid reports.
    pub fn release(
        &self,
        rows: &mut [Row],
        ids: &[u32],
        before: &[u32],
        colliders: &mut Colliders<'_>,
        pose: &mut Vec<DVec3>,
    ) -> Result<Vec<u32>> {
        let blocks = self.layout.blocks.par_iter();
        let deep: Vec<Vec<u32>> = blocks.map(|block| self.deep(block, rows, ids, before)).collect();
        let which: Vec<u32> =
            (0..).zip(&deep).filter(|(_, deep)| !deep.is_empty()).map(|(index, _)| index).collect();
        if which.is_empty() {
            return Ok(Vec::new());
        }
        for (shell, at) in &mut colliders.shells {
            at(1.0, pose)?;
            shell.follow(pose);
        }
        let windows =
            colliders.fields.iter().map(|field| field.windows(self.layout, &which, self.diameter, MARGIN));
        let windows: Vec<Vec<Option<Window<'_>>>> = windows.collect::<Result<_>>()?;
        let seen = &*rows;
        let released = which.par_iter().enumerate().flat_map_iter(|(index, &block)| {
            let fields = colliders.fields.iter().zip(&windows);
            let surfaces = Surfaces {
                floor: colliders.floor,
                fields: fields
                    .filter_map(|(field, windows)| Some((field, windows[index].as_ref()?)))
                    .collect(),
                shells: colliders.shells.iter().map(|(shell, _)| shell).collect(),
                diameter: self.diameter,
            };
            let at = self.layout.blocks[block as usize].at;
            let release = |&slot: &u32| (slot, surfaces.release(at, seen[slot as usize].place));
            deep[block as usize].iter().map(release).collect::<Vec<_>>()
        });
        let released: Vec<(u32, Option<V>)> = released.collect();
        let mut trapped = Vec::new();
        for (slot, place) in released {
            match place {
                Some(place) => rows[slot as usize].place = place,
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

/// The surfaces around a block, as they are at the step's end.
struct Surfaces<'a> {
    floor: Option<Floor>,
    fields: Vec<(&'a Field<'a>, &'a Window<'a>)>,
    shells: Vec<&'a Shell>,
    diameter: f64,
}

impl Surfaces<'_> {
    /// Where a grain at a place in a block is out of them; nothing where it finds no room.
    fn release(&self, at: At, within: V) -> Option<V> {
        let from = world(at, within, self.diameter);
        let mut place = from;
        for _ in 0..ROUNDS {
            let mut is_out = true;
            self.for_each_way_out(&mut place, |depth| is_out &= depth <= ROUNDED * DEEP);
            if is_out {
                let way = (place - from) / self.diameter;
                return Some([0, 1, 2].map(|axis| within[axis] + way[axis] as f32));
            }
            if (place - from).norm() > FARTHEST * self.diameter {
                return None;
            }
        }
        None
    }

    /// Moves a place (m) out of one surface after the other, and tells how deep (diameters) it was in each.
    fn for_each_way_out(&self, place: &mut DVec3, mut tell: impl FnMut(f64)) {
        let half = 0.5 * self.diameter;
        if let Some(floor) = &self.floor {
            let depth = floor.height + half - place.y;
            tell(depth / self.diameter);
            place.y += depth.max(0.0);
        }
        for (field, window) in &self.fields {
            let cell = field.grid.voxel_size();
            let (distance, gradient) = window.sample([0, 1, 2].map(|axis| place[axis] / cell));
            let depth = half - f64::from(distance);
            tell(depth / self.diameter);
            let steep = dot(gradient, gradient).sqrt();
            if depth > 0.0 && steep > 1.0e-6 {
                *place += DVec3::from(gradient.map(f64::from)) * (depth / f64::from(steep));
            }
        }
        for shell in &self.shells {
            if let Some((depth, out)) = shell.depth(*place, half) {
                tell(depth / self.diameter);
                *place += out * depth.max(0.0);
            }
        }
    }
}
