//! The liquid as a fog volume: the filled fraction of each voxel.

use std::collections::BTreeMap;

use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::io::usd::{ContentsByName, Field, Holds};
use crate::numeric::blocks::{Block, BlockEdit, DIM, Origin, VOXELS, offset, origin_of};
use crate::scene::Scene;
use crate::scene::run::Volume;
use crate::scene::shallow::Shallow;
use crate::scene::vdb_metadata::{contents, metadata};
use crate::shallow;
use crate::vdb::file::{WriteOptions, to_bytes};
use crate::vdb::{DENSITY_SCALE_KEY, FloatGrid, GridClass, MetaValue};

/// Name of the only grid, as shaders expect it.
const GRID: &str = "density";
/// Optical thickness of the opaque depth: a twentieth of the light passes through.
const OPTICAL_THICKNESS: f64 = 3.0;

/// The volume's description in `shot.usda`.
pub(in crate::scene::shallow) fn of_shot(kind: &'static str) -> Volume {
    const FIELDS: &[Field] = &[Field::of(GRID, Holds::Density(1.0))];
    Volume { kind, prim: "liquid_volume", fields: FIELDS, is_guide: false }
}

/// The bytes of a frame's .vdb file, and its contents.
///
/// `made_from` is the hash of everything that the frame was made from.
///
/// # Errors
/// Out of memory; cancel.
pub(in crate::scene::shallow) fn bytes(
    ctx: &Context,
    scene: &Scene,
    setup: &Shallow,
    liquid: &shallow::Shallow,
    frame: i32,
    made_from: &str,
) -> Result<(Vec<u8>, ContentsByName)> {
    let mut metadata = metadata(scene, frame, made_from);
    metadata.push(("volume_m3".into(), MetaValue::Double(liquid.balance().inside)));
    let grid = ctx.phase("volume", || density(ctx, liquid, OPTICAL_THICKNESS / setup.opaque_depth))?;
    let bytes = to_bytes(&[&grid], &WriteOptions { metadata, ..WriteOptions::default() })?;
    Ok((bytes, contents(&[&grid])))
}

/// The fraction of each voxel that is liquid. Voxels are as large as cells and aligned with them; the heights of their centres are multiples
/// of that size. A value of 1 means an extinction of `scale` (1/m).
fn density(ctx: &Context, liquid: &shallow::Shallow, scale: f64) -> Result<FloatGrid> {
    let (columns, depths) = (liquid.columns(), liquid.depths());
    let (grid, heights) = (columns.grid, columns.heights);
    let mut blocks: BTreeMap<Origin, Block> = BTreeMap::new();
    for index in columns.indices().filter(|&index| depths[index] > 0) {
        let [x, z] = columns.cell(index).map(|at| at as i32);
        let bottom = heights.metres(columns.bases()[index]);
        let ends =
            [bottom, bottom + heights.length(depths[index].into())].map(|height| height / grid.cell + 0.5);
        for y in ends[0].floor() as i32..=ends[1].ceil() as i32 - 1 {
            let share = (ends[1].min(f64::from(y) + 1.0) - ends[0].max(f64::from(y))) as f32;
            if share <= 0.0 {
                continue;
            }
            add(&mut blocks, [x, y, z], share);
        }
    }
    // Liquid in the air: each drop goes to the voxel of its centre.
    for drop in liquid.drops() {
        let [x, y, z] = drop.position;
        let along = |axis: usize, at: f64| ((at - grid.origin[axis]) / grid.cell).floor() as i32;
        let at = [along(0, x), (y / grid.cell + 0.5).floor() as i32, along(1, z)];
        add(&mut blocks, at, (drop.volume / grid.cell.powi(3)) as f32);
    }
    let edits: Vec<BlockEdit> = blocks.into_values().map(BlockEdit::Dense).collect();
    let mut out = FloatGrid::new(grid.cell, 0.0)?;
    out.replace_blocks(ctx, &edits)?;
    let [x, z] = grid.origin;
    out.shift(DVec3::new(x + 0.5 * grid.cell, 0.0, z + 0.5 * grid.cell))?;
    out.set_name(GRID)?;
    out.set_class(GridClass::Fog)?;
    out.set_metadata(DENSITY_SCALE_KEY, MetaValue::Float(scale as f32))?;
    Ok(out)
}

/// Adds a liquid fraction to a voxel.
fn add(blocks: &mut BTreeMap<Origin, Block>, at: [i32; 3], share: f32) {
    let origin = origin_of(at);
    let block = blocks.entry(origin).or_insert_with(|| Block {
        origin,
        values: Box::new([0.0; VOXELS]),
        mask: [0; DIM],
    });
    let [i, j, k] = [0, 1, 2].map(|axis| (at[axis] - origin[axis]) as usize);
    block.values[offset(i, j, k)] += share;
    block.mask[i] |= 1 << (j << 3 | k);
}
