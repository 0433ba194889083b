//! The snow that a step removed from the base layer, block by block.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::context::Context;
use crate::error::Result;
use crate::numeric::blocks::{BlockEdit, DIM, Origin, VOXELS};
use crate::snow::base_layer::{filled, voxel_fill};
use crate::vdb::{FloatGrid, Probe};

/// Snow that a step removed from a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Removal {
    /// The block.
    pub origin: Origin,
    /// Volume (m3).
    pub volume: f64,
}

/// The snow removed between two states of a layer, by block, ascending.
///
/// # Errors
/// When a grid cannot be read.
pub fn removals(before: &FloatGrid, after: &FloatGrid) -> Result<Vec<Removal>> {
    let mut leaves: Vec<Origin> =
        before.leaves()?.iter().chain(&after.leaves()?).map(|leaf| leaf.origin).collect();
    leaves.par_sort_unstable();
    leaves.dedup();
    let mut out = volumes(before, after, &leaves)?;
    // Blocks without a surface before and after (deep snow that is gone) lie within the bounding box of the others.
    let Some(first) = out.first() else { return Ok(out) };
    let bounds = out.iter().fold([first.origin; 2], |[low, high], removal| {
        let at = removal.origin;
        [[0, 1, 2].map(|axis| low[axis].min(at[axis])), [0, 1, 2].map(|axis| high[axis].max(at[axis]))]
    });
    let span = |axis: usize| (bounds[0][axis]..=bounds[1][axis]).step_by(DIM);
    let all = span(0).flat_map(|x| span(1).flat_map(move |y| span(2).map(move |z| [x, y, z])));
    let deep: Vec<Origin> = all.filter(|origin| leaves.binary_search(origin).is_err()).collect();
    out.extend(volumes(before, after, &deep)?);
    out.par_sort_unstable_by_key(|removal| removal.origin);
    Ok(out)
}

/// The snow removed from blocks; blocks that lost none are omitted.
pub(super) fn volumes(before: &FloatGrid, after: &FloatGrid, origins: &[Origin]) -> Result<Vec<Removal>> {
    let cell = after.voxel_size() as f32;
    let (old, new) = (before.probe(origins)?, after.probe(origins)?);
    let removed = origins.par_iter().zip(old.par_iter().zip(&new)).map(|(origin, (old, new))| {
        let volume = lost(old, new, cell) * f64::from(cell).powi(3);
        Removal { origin: *origin, volume }
    });
    Ok(removed.filter(|removal| removal.volume > 0.0).collect())
}

/// Volume (cells) that a block lost.
pub(super) fn lost(old: &Probe<'_>, new: &Probe<'_>, cell: f32) -> f64 {
    let volume = |probe: &Probe<'_>| match probe {
        Probe::Leaf(leaf) => voxel_fill::volume(leaf.values, cell),
        Probe::Tile { value, .. } => f64::from(filled(*value, cell)) * VOXELS as f64,
    };
    match (old, new) {
        (Probe::Leaf(old), Probe::Leaf(new)) if old.values == new.values => 0.0,
        _ => volume(old) - volume(new),
    }
}

/// The base layer that a step of grains reads.
#[derive(Clone, Copy)]
pub enum Base<'a> {
    /// No base layer.
    Missing,
    /// At the start and end of the step.
    Whole([&'a FloatGrid; 2]),
    /// At the end of the step, and the changed blocks as they were at its start
    /// ([`BaseLayer::before`](crate::snow::base_layer::BaseLayer::before)).
    Changed(&'a FloatGrid, &'a [BlockEdit]),
}

impl<'a> Base<'a> {
    /// The layer at the end of the step.
    pub fn after(&self) -> Option<&'a FloatGrid> {
        match *self {
            Self::Missing => None,
            Self::Whole([_, after]) | Self::Changed(after, _) => Some(after),
        }
    }

    /// The layer before the step and what the step removed, by block, ascending. Visits only the changed blocks where they
    /// are known. None without a layer.
    ///
    /// # Errors
    /// When a grid cannot be read; when memory runs out.
    pub fn removed(&self, ctx: &Context) -> Result<Option<(Before<'a>, Vec<Removal>)>> {
        match *self {
            Self::Missing => Ok(None),
            Self::Whole([before, after]) => Ok(Some((Before::Whole(before), removals(before, after)?))),
            Self::Changed(after, blocks) => {
                let mut before = FloatGrid::new(after.voxel_size(), after.background())?;
                before.replace_blocks(ctx, blocks)?;
                let changed: BTreeSet<Origin> = blocks.iter().map(BlockEdit::origin).collect();
                let origins: Vec<Origin> = changed.iter().copied().collect();
                let removals = volumes(&before, after, &origins)?;
                // Interpolation also reads the neighbouring blocks.
                let around: BTreeSet<Origin> =
                    removals.iter().flat_map(|removal| around(removal.origin)).collect();
                let around: Vec<Origin> = around.difference(&changed).copied().collect();
                let same: Vec<BlockEdit> =
                    after.probe(&around)?.iter().zip(&around).map(|(probe, at)| probe.to_edit(*at)).collect();
                before.replace_blocks(ctx, &same)?;
                Ok(Some((Before::Near(before), removals)))
            }
        }
    }
}

/// The layer before a step, where grains may be created.
pub enum Before<'a> {
    /// The whole layer.
    Whole(&'a FloatGrid),
    /// The blocks that the step changed, and their neighbours.
    Near(FloatGrid),
}

impl Before<'_> {
    /// The grid.
    pub fn grid(&self) -> &FloatGrid {
        match self {
            Self::Whole(grid) => grid,
            Self::Near(grid) => grid,
        }
    }
}

/// A block and its neighbours.
pub(super) fn around([x, y, z]: Origin) -> impl Iterator<Item = Origin> {
    let side = |at: i32| [-1, 0, 1].map(|step| at + step * DIM as i32);
    let rows = side(x).into_iter().flat_map(move |x| side(y).map(move |y| [x, y]));
    rows.flat_map(move |[x, y]| side(z).map(move |z| [x, y, z]))
}
