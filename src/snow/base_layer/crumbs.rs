//! Crumbs: islands of few voxels that ragged edges and thin walls leave; they are removed in the step that made them.
//!
//! Only snow that is connected to a block changed by the step can have become an island. An island is removed as if it were pressed out:
//! its snow goes into `removed` and is subtracted from its columns.

use std::collections::{BTreeMap, HashMap, HashSet};

use rayon::prelude::*;

use super::columns::{CELLS, add_by_cell};
use super::subtraction::{self, Edit, Scale};
use super::voxel_fill;
use crate::context::Context;
use crate::error::Result;
use crate::numeric::blocks::{BlockEdit, Mask, Origin, VOXELS, Values, offset};
use crate::vdb::FloatGrid;

/// Distance (voxels) from an island within which its surface may be the nearest one: a band of three cells, and one more.
const REACH: i32 = 4;

type Voxel = [i32; 3];

/// The snow as it will be after a step's edits.
struct EditedSnow<'a> {
    edits: &'a [Edit],
    positions: HashMap<Origin, usize>,
    surface: &'a FloatGrid,
}

impl EditedSnow<'_> {
    fn value(&self, voxel: Voxel) -> f32 {
        match self.positions.get(&voxel.map(|at| at & !7)).map(|&index| &self.edits[index].surface) {
            Some(BlockEdit::Constant(_, value)) => *value,
            Some(BlockEdit::Dense(block)) => block.values[index_of(voxel)],
            None => self.surface.value(voxel),
        }
    }

    /// All voxels of the island around a voxel of the snow; none if there are `min_voxels` or more.
    fn island(&self, seed: Voxel, min_voxels: usize) -> Option<Vec<Voxel>> {
        let (mut voxels, mut seen) = (vec![seed], HashSet::from([seed]));
        let mut next = 0;
        while next < voxels.len() {
            let voxel = voxels[next];
            next += 1;
            for beside in neighbours(voxel) {
                if !seen.contains(&beside) && self.value(beside) < 0.0 {
                    if voxels.len() + 1 >= min_voxels {
                        return None;
                    }
                    seen.insert(beside);
                    voxels.push(beside);
                }
            }
        }
        (voxels.len() < min_voxels).then_some(voxels)
    }
}

fn index_of(voxel: Voxel) -> usize {
    let [x, y, z] = voxel.map(|at| (at & 7) as usize);
    offset(x, y, z)
}

fn neighbours(voxel: Voxel) -> impl Iterator<Item = Voxel> {
    (0..6).map(move |side| {
        let mut beside = voxel;
        beside[side >> 1] += if side & 1 == 0 { -1 } else { 1 };
        beside
    })
}

/// Removes the islands of fewer than `min_voxels` voxels from the result of the edits; returns their number.
///
/// # Errors
/// Cancel; when memory runs out.
pub fn remove(
    ctx: &Context,
    edits: &mut Vec<Edit>,
    surface: &FloatGrid,
    scale: Scale,
    min_voxels: usize,
) -> Result<usize> {
    let positions = edits.iter().enumerate().map(|(index, edit)| (edit.surface.origin(), index)).collect();
    let after = EditedSnow { edits, positions, surface };
    let seeds: Vec<Vec<Voxel>> =
        edits.par_iter().map(|edit| small_components(&edit.surface, min_voxels)).collect();
    let (mut islands, mut voxels) = (Vec::new(), HashSet::new());
    for seed in seeds.concat() {
        ctx.check()?;
        if voxels.contains(&seed) {
            continue;
        }
        if let Some(island) = after.island(seed, min_voxels) {
            voxels.extend(island.iter().copied());
            islands.push(island);
        }
    }
    let mut cleared: BTreeMap<Origin, BTreeMap<usize, f32>> = BTreeMap::new();
    for island in &islands {
        ctx.check()?;
        for (voxel, value) in values_without(&after, island, &voxels, scale) {
            cleared.entry(voxel.map(|at| at & !7)).or_default().insert(index_of(voxel), value);
        }
    }
    let positions = after.positions;
    for (origin, values) in cleared {
        let index = match positions.get(&origin) {
            Some(&index) => index,
            None => {
                edits.push(untouched(origin, surface)?);
                edits.len() - 1
            }
        };
        clear(&mut edits[index], &values, scale);
    }
    Ok(islands.len())
}

/// A voxel of each connected component of a block's snow, if the component has fewer than `min_voxels` voxels.
fn small_components(block: &BlockEdit, min_voxels: usize) -> Vec<Voxel> {
    let BlockEdit::Dense(block) = block else {
        // All snow (at least 512 voxels), or no snow.
        return match block {
            BlockEdit::Constant(origin, value) if *value < 0.0 && min_voxels > VOXELS => vec![*origin],
            _ => Vec::new(),
        };
    };
    let mut left: Mask = [0; 8];
    block
        .values
        .iter()
        .enumerate()
        .for_each(|(at, value)| left[at >> 6] |= u64::from(*value < 0.0) << (at & 63));
    let mut seeds = Vec::new();
    while let Some(x) = left.iter().position(|slab| *slab != 0) {
        let bit = left[x].trailing_zeros() as usize;
        let mut component: Mask = [0; 8];
        component[x] = 1 << bit;
        loop {
            let grown = grown(&component, &left);
            if grown == component {
                break;
            }
            component = grown;
        }
        if (component.iter().map(|slab| slab.count_ones()).sum::<u32>() as usize) < min_voxels {
            let at = [x, bit >> 3, bit & 7];
            seeds.push([0, 1, 2].map(|axis| block.origin[axis] + at[axis] as i32));
        }
        (0..8).for_each(|slab| left[slab] &= !component[slab]);
    }
    seeds
}

/// A component with its neighbours within a mask of voxels: a word of a mask is one x, with y and z in its bits.
fn grown(component: &Mask, within: &Mask) -> Mask {
    const FIRST_Z: u64 = 0x0101_0101_0101_0101;
    std::array::from_fn(|x| {
        let own = component[x];
        let beside = (own & !FIRST_Z) >> 1 | (own & !(FIRST_Z << 7)) << 1 | own << 8 | own >> 8;
        let below = if x > 0 { component[x - 1] } else { 0 };
        let above = if x < 7 { component[x + 1] } else { 0 };
        (own | beside | below | above) & within[x]
    })
}

/// Values (m) after the removal of all islands, for the voxels of an island and those whose nearest surface is its surface.
fn values_without(
    after: &EditedSnow<'_>,
    island: &[Voxel],
    gone: &HashSet<Voxel>,
    scale: Scale,
) -> Vec<(Voxel, f32)> {
    let low = island.iter().fold(island[0], |low, v| [0, 1, 2].map(|axis| low[axis].min(v[axis])));
    let high = island.iter().fold(island[0], |high, v| [0, 1, 2].map(|axis| high[axis].max(v[axis])));
    let region = Region::new(after, low.map(|v| v - 2 * REACH), high.map(|v| v + 2 * REACH), gone);
    let around: HashSet<Voxel> = island.iter().flat_map(|&voxel| cube(voxel)).collect();
    let mut around: Vec<Voxel> = around.into_iter().collect();
    around.sort_unstable();
    let cleared = |voxel: Voxel| {
        let [to_islands, to_rest] = region.bounds(voxel, scale);
        let value = region.value(voxel);
        if value < 0.0 && !region.gone[region.position(voxel)] {
            return None;
        }
        // At least half a cell outside, so that no part of the cell counts as filled.
        let outside = to_rest.max(0.5 * scale.cell).max(value).min(scale.background);
        (to_islands < to_rest && outside != value).then_some((voxel, outside))
    };
    around.into_iter().filter_map(cleared).collect()
}

/// The voxels within reach of a voxel.
fn cube([x, y, z]: Voxel) -> impl Iterator<Item = Voxel> {
    let along = move |middle: i32| middle - REACH..=middle + REACH;
    along(x).flat_map(move |x| along(y).flat_map(move |y| along(z).map(move |z| [x, y, z])))
}

/// Copied values of a box of voxels, and whether each belongs to a removed island.
struct Region {
    low: Voxel,
    size: [usize; 3],
    values: Vec<f32>,
    gone: Vec<bool>,
}

impl Region {
    fn new(after: &EditedSnow<'_>, low: Voxel, high: Voxel, gone: &HashSet<Voxel>) -> Self {
        let size = [0, 1, 2].map(|axis| (high[axis] - low[axis]) as usize + 1);
        let voxels = (low[0]..=high[0])
            .flat_map(|x| (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z])));
        let (values, gone) = voxels.map(|voxel| (after.value(voxel), gone.contains(&voxel))).unzip();
        Self { low, size, values, gone }
    }

    fn position(&self, voxel: Voxel) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| (voxel[axis] - self.low[axis]) as usize);
        (x * self.size[1] + y) * self.size[2] + z
    }

    fn value(&self, voxel: Voxel) -> f32 {
        self.values[self.position(voxel)]
    }

    /// Upper bounds on a voxel's distances (m) to islands and to other snow, from the snow within reach: a distance field changes no faster
    /// than the position.
    fn bounds(&self, voxel: Voxel, scale: Scale) -> [f32; 2] {
        let mut bounds = [f32::INFINITY; 2];
        for other in cube(voxel) {
            let position = self.position(other);
            let value = self.values[position];
            if value < 0.0 {
                let squared: i32 =
                    (0..3).map(|axis| (voxel[axis] - other[axis]) * (voxel[axis] - other[axis])).sum();
                let bound = &mut bounds[usize::from(!self.gone[position])];
                *bound = bound.min(value + (squared as f32).sqrt() * scale.cell);
            }
        }
        bounds
    }
}

/// An edit without changes.
fn untouched(origin: Origin, surface: &FloatGrid) -> Result<Edit> {
    let surface = surface.probe(&[origin])?[0].to_edit(origin);
    Ok(Edit { surface, removed: None, changed: [0; 8], heights: [0.0; CELLS] })
}

/// Writes the values (m) of cleared voxels into an edit; the previous values go into `removed`.
fn clear(edit: &mut Edit, cleared: &BTreeMap<usize, f32>, scale: Scale) {
    let origin = edit.surface.origin();
    let mut after = values_of(Some(&edit.surface), scale);
    let mut removed = values_of(edit.removed.as_ref(), scale);
    let fractions_before = voxel_fill::fractions(&after, scale.cell);
    for (&index, &value) in cleared {
        let before = after[index];
        removed[index] = removed[index].min(before);
        after[index] = value;
        edit.changed[index >> 6] |= 1 << (index & 63);
    }
    let fractions_after = voxel_fill::fractions(&after, scale.cell);
    add_by_cell(&mut edit.heights, |index| fractions_before[index] - fractions_after[index]);
    edit.surface = subtraction::pack(origin, after, scale);
    let removed = subtraction::pack(origin, removed, scale);
    edit.removed = (!matches!(removed, BlockEdit::Constant(_, value) if value > 0.0)).then_some(removed);
}

fn values_of(block: Option<&BlockEdit>, scale: Scale) -> Box<Values> {
    match block {
        Some(BlockEdit::Dense(block)) => block.values.clone(),
        Some(BlockEdit::Constant(_, value)) => Box::new([*value; VOXELS]),
        None => Box::new([scale.background; VOXELS]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::blocks::Block;

    #[test]
    fn components_of_a_block_are_found_by_their_size() {
        let mut values = Box::new([1.0; VOXELS]);
        // A bar of three along z, one voxel diagonally adjacent to it, and a plate of 16.
        for at in [offset(1, 1, 1), offset(1, 1, 2), offset(1, 1, 3), offset(2, 2, 4)] {
            values[at] = -1.0;
        }
        (0..16).for_each(|k| values[offset(4 + k / 8, 5, k % 8)] = -1.0);
        let block = BlockEdit::Dense(Block { origin: [8, 16, -8], values, mask: [0; 8] });
        assert_eq!(small_components(&block, 1), Vec::<Voxel>::new());
        assert_eq!(small_components(&block, 3), [[10, 18, -4]]);
        assert_eq!(small_components(&block, 4), [[9, 17, -7], [10, 18, -4]]);
        assert_eq!(small_components(&block, 17).len(), 3);
    }
}
