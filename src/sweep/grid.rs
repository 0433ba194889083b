//! Swept volumes and solids of meshes as complete level sets.

use rayon::prelude::*;

use super::signed_distance::voxelise::{ALL, Band, Piece, Scratch, Voxeliser};
use super::window::Window;
use super::{Body, Settings};
use crate::context::Context;
use crate::distance::Face;
use crate::distance::lattice::{Lattice, UNITS};
use crate::error::{Error, Result};
use crate::geometry::{DVec3, TriMesh};
use crate::motion::{Keys, Rigid};
use crate::numeric::blocks::{Block, BlockEdit, DIM};
use crate::vdb::FloatGrid;

/// Blocks per batch added to the grid; limits the memory that is needed besides the grid.
const BATCH: usize = 2048;
/// An unbounded window.
const EVERYWHERE: Window = Window { min: [i32::MIN; 3], max: [i32::MAX; 3] };
/// All voxels within the lattice's reach.
const ALL_VOXELS: [[i32; 3]; 2] = [[-(1 << 18); 3], [1 << 18; 3]];

/// Level set of the volume that bodies sweep from `from` to `to` (s), or of the pose if they are equal.
///
/// # Errors
/// Settings out of range, a pose that cannot be computed, a region that is too large, cancel.
pub fn chain(ctx: &Context, bodies: &[Body], from: f64, to: f64, settings: &Settings) -> Result<FloatGrid> {
    settings.validate()?;
    let mut pose = Vec::new();
    let first = bodies.first().ok_or_else(|| Error::argument("a sweep needs at least one object"))?;
    first.motion().pose(from, &mut pose)?;
    let lattice = Lattice::near(settings.voxel, pose[0])?;
    let faces = ctx.phase("chain", || {
        ctx.expect(bodies.len());
        let faces = |body: &Body| {
            let faces = body.faces(ctx, from, to, &lattice, settings.tolerance, &EVERYWHERE);
            ctx.advance();
            faces
        };
        let parts: Vec<Vec<Face>> = bodies.iter().map(faces).collect::<Result<_>>()?;
        Ok(parts.concat())
    })?;
    fill(ctx, faces, lattice, settings.half_width)
}

/// Level set of the solid that a mesh bounds: winding number > 0, vertices of the same corner welded ([`crate::geometry::mesh::weld`]),
/// open loops closed. Corners that are ambiguous within rounding cause a warning of the context.
///
/// # Errors
/// As [`chain`].
pub fn voxelise(ctx: &Context, mesh: TriMesh, settings: &Settings) -> Result<FloatGrid> {
    let still = Body::new(Box::new(Rigid::new(mesh, Keys::default())), 0.0)?;
    if let Some(what) = still.weld_warning() {
        ctx.warn(&what);
    }
    chain(ctx, &[still], 0.0, 0.0, settings)
}

/// As [`voxelise`], in a box of voxels (minimum and maximum, both inclusive): the cost depends only on what lies in it, however large the
/// solid is. Everything more than a block away from the box counts as outside.
///
/// # Errors
/// As [`voxelise`].
pub fn voxelise_within(
    ctx: &Context,
    mesh: TriMesh,
    settings: &Settings,
    [low, high]: [[i32; 3]; 2],
) -> Result<FloatGrid> {
    settings.validate()?;
    let still = Body::new(Box::new(Rigid::new(mesh, Keys::default())), 0.0)?;
    let middle = [0, 1, 2].map(|axis| (f64::from(low[axis]) + f64::from(high[axis])) * 0.5 * settings.voxel);
    let lattice = Lattice::near(settings.voxel, DVec3::from(middle))?;
    let relative = |voxel: [i32; 3]| [0, 1, 2].map(|axis| voxel[axis] - lattice.origin[axis]);
    let bounds = [relative(low), relative(high)];
    // Whole blocks are built, and winding numbers are needed around them.
    let margin = settings.half_width.ceil() as i32 + 3 + DIM as i32;
    let fixed = |cells: i32| cells.saturating_mul(UNITS);
    let min = bounds[0].map(|cells| fixed(cells - margin));
    let max = bounds[1].map(|cells| fixed(cells + margin));
    let window = Window { min, max };
    let faces = ctx.phase("chain", || still.faces(ctx, 0.0, 0.0, &lattice, settings.tolerance, &window))?;
    fill_within(ctx, faces, lattice, settings.half_width, bounds)
}

/// Level set of the points where the winding number of a closed chain is at least 1.
///
/// # Errors
/// A region that is too large; cancel.
pub fn fill(ctx: &Context, faces: Vec<Face>, lattice: Lattice, half_width: f32) -> Result<FloatGrid> {
    fill_within(ctx, faces, lattice, half_width, ALL_VOXELS)
}

/// As [`fill`], in a box of voxels (counted from the lattice's origin voxel).
fn fill_within(
    ctx: &Context,
    faces: Vec<Face>,
    lattice: Lattice,
    half_width: f32,
    bounds: [[i32; 3]; 2],
) -> Result<FloatGrid> {
    let band = Band { inside: half_width, outside: half_width };
    let voxeliser = ctx.phase("winding", || {
        ctx.expect(Voxeliser::PARTS);
        Voxeliser::new(ctx, faces, lattice, band, bounds, |blocks| Ok(vec![true; blocks.len()]))
    })?;
    let mut grid = FloatGrid::level_set(lattice.voxel, half_width)?;
    let blocks: Vec<usize> = (0..voxeliser.near_blocks().len()).collect();
    for batch in blocks.chunks(BATCH) {
        let edits =
            ctx.phase("distance", || Ok(pieces(ctx, &voxeliser, batch, lattice.voxel, half_width)))?;
        grid.replace_blocks(ctx, &edits)?;
    }
    let background = half_width * lattice.voxel as f32;
    for batch in voxeliser.inside_blocks().chunks(BATCH) {
        let edits: Vec<BlockEdit> =
            batch.iter().map(|&origin| BlockEdit::Constant(origin, -background)).collect();
        grid.replace_blocks(ctx, &edits)?;
        ctx.check()?;
    }
    Ok(grid)
}

fn pieces(
    ctx: &Context,
    voxeliser: &Voxeliser,
    batch: &[usize],
    voxel: f64,
    half_width: f32,
) -> Vec<BlockEdit> {
    let background = half_width * voxel as f32;
    ctx.expect(batch.len());
    batch
        .par_iter()
        .map_init(Scratch::default, |scratch, &index| {
            ctx.advance();
            if ctx.check().is_err() { None } else { voxeliser.piece(index, &ALL, scratch) }
        })
        .filter_map(|piece| {
            Some(match piece? {
                Piece::Inside(origin) => BlockEdit::Constant(origin, -background),
                Piece::Near(origin, cells) => {
                    BlockEdit::Dense(Block::of_cells(origin, cells, voxel as f32, background))
                }
            })
        })
        .collect()
}
