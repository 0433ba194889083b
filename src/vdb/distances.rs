//! Checks that the values of a level set are distances in metres in a band of several cells, as every tool expects.

use super::level_set::{from_mesh, to_mesh};
use super::{FloatGrid, Leaf};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::numeric::blocks::VOXELS;

/// Number of leaves that are sampled.
const LEAVES: usize = 512;
/// Minimum number of edges between inside and outside voxels for a verdict.
const MIN_EDGES: usize = 64;
/// Valid range of the median slope (difference over length) along such edges. For distances it is 0.67 to 1, depending on the orientation
/// of the surface.
const SLOPES: [f64; 2] = [0.4, 1.6];
/// Range of the median difference (not divided by the length) that identifies distances in voxels.
const IN_VOXELS: [f64; 2] = [0.5, 1.1];
/// Minimum width of the band on each side (cells): with less, no tool measures or moves the surface correctly.
const MIN_BAND: f64 = 1.9;
/// Width of the rebuilt band on each side (cells).
const BAND: f32 = 3.0;

/// What is wrong with the values of a level set.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// They are distances in voxels.
    InVoxels,
    /// Their gradient at the surface.
    Slope(f64),
    /// Width (cells) of a band that is too thin, on each side.
    Thin(f64),
}

impl Fault {
    /// Its description, to be appended to the grid's name.
    fn description(self) -> String {
        match self {
            Self::InVoxels => "has distances in voxels, not in metres".to_string(),
            Self::Slope(slope) => format!(
                "has values that are no distances in metres: their gradient at the surface is {slope:.3}, not 1; offsets, \
                 combinations and volumes of it are wrong"
            ),
            Self::Thin(cells) => {
                format!("has distances only up to {cells:.2} cells from its surface, and tools need 2 to 3")
            }
        }
    }
}

/// What is wrong with the values of a level set, to be appended to its name; none if they are distances in metres in a band of two cells or
/// more on each side.
///
/// # Errors
/// What OpenVDB reports.
pub fn warning(grid: &FloatGrid) -> Result<Option<String>> {
    Ok(fault(grid)?.map(Fault::description))
}

/// A level set as it was read or, where its values are in voxels or end within two cells of the surface, one with distances in metres in a
/// band of three cells around the same surface; also what was wrong, to be appended to its name. Values that are not distances at all are
/// left unchanged, and the fault is returned.
///
/// # Errors
/// Cancel, or what OpenVDB reports.
pub fn mended(ctx: &Context, grid: FloatGrid) -> Result<(FloatGrid, Option<String>)> {
    let Some(fault) = fault(&grid)? else { return Ok((grid, None)) };
    let what = fault.description();
    if let Fault::Slope(_) = fault {
        return Ok((grid, Some(what)));
    }
    let voxel = grid.voxel_size();
    let mesh = if grid.is_world_fixed() {
        // Where the surface passes through a voxel, a one-cell band contains only that voxel: meshing also needs its neighbours on both sides.
        let mut wider = grid.deep_copy()?;
        wider.dilate()?;
        to_mesh(ctx, &wider, 0.0, 0.0)?
    } else {
        TriMesh::default()
    };
    if mesh.triangles.is_empty() || !mesh.is_closed() {
        return Ok((grid, Some(format!("{what}: offsets, combinations and volumes of it are wrong"))));
    }
    let mut made = from_mesh(ctx, &mesh, voxel, BAND)?;
    made.set_name(&grid.name())?;
    let what = format!("{what}: they are made anew from its surface, {BAND} cells wide on each side");
    Ok((made, Some(what)))
}

/// What is wrong with the values of a level set, judged at its surface.
fn fault(grid: &FloatGrid) -> Result<Option<Fault>> {
    let voxel = grid.voxel_size();
    let leaves = grid.leaves()?;
    let step = leaves.len().div_ceil(LEAVES).max(1);
    let mut slopes: Vec<f64> = leaves.iter().step_by(step).flat_map(differences).collect();
    if slopes.len() < MIN_EDGES {
        return Ok(None);
    }
    let middle = slopes.len() / 2;
    let slope = *slopes.select_nth_unstable_by(middle, f64::total_cmp).1 / voxel;
    let within = |[low, high]: [f64; 2], value: f64| (low..=high).contains(&value);
    if !within(SLOPES, slope) {
        let is_in_voxels = within(IN_VOXELS, slope * voxel);
        return Ok(Some(if is_in_voxels { Fault::InVoxels } else { Fault::Slope(slope) }));
    }
    let band = f64::from(grid.background().abs()) / voxel;
    Ok((band < MIN_BAND).then_some(Fault::Thin(band)))
}

/// Differences between the values of adjacent voxels, one inside and one outside, in a leaf.
fn differences(leaf: &Leaf<'_>) -> Vec<f64> {
    let is_active = |at: usize| leaf.mask[at / 64] >> (at % 64) & 1 == 1;
    let mut out = Vec::new();
    for at in 0..VOXELS {
        // Bit offset in the index, and stride, of x, y and z.
        for (shift, stride) in [(6, 64), (3, 8), (0, 1)] {
            if at >> shift & 7 == 7 || !is_active(at) || !is_active(at + stride) {
                continue;
            }
            let [a, b] = [at, at + stride].map(|at| f64::from(leaf.values[at]));
            if (a < 0.0) != (b < 0.0) {
                out.push((a - b).abs());
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;
    use crate::geometry::DVec3;
    use crate::numeric::blocks::{Block, BlockEdit};
    use crate::vdb::GridClass;
    use crate::vdb::level_set::{from_particles, measure};

    const VOXEL: f64 = 0.05;

    /// A ball of 0.5 m, and a box beside it, whose values are distances times a factor, in a band of `cells` cells.
    fn ball(ctx: &Context, factor: f32, cells: f32) -> FloatGrid {
        let exact = from_particles(ctx, &[DVec3::zeros()], &[0.5], VOXEL, 3.0).unwrap();
        let band = cells * VOXEL as f32;
        let mut out = FloatGrid::new(VOXEL, band * factor).unwrap();
        let edit = |leaf: &Leaf<'_>| {
            let mut block: Block = leaf.to_block();
            for (at, value) in block.values.iter_mut().enumerate() {
                let is_out = value.abs() >= band;
                if is_out {
                    block.mask[at / 64] &= !(1 << (at % 64));
                }
                *value = value.clamp(-band, band) * factor;
            }
            BlockEdit::Dense(block)
        };
        let edits: Vec<BlockEdit> = exact.leaves().unwrap().iter().map(edit).collect();
        out.replace_blocks(ctx, &edits).unwrap();
        out.flood_fill().unwrap();
        out.set_class(GridClass::LevelSet).unwrap();
        out.set_name("ball").unwrap();
        out
    }

    #[test]
    fn distances_stay_and_other_values_are_rebuilt() {
        let ctx = Context::new(Pool::new(2).unwrap());
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.125;
        let (same, what) = mended(&ctx, ball(&ctx, 1.0, 3.0)).unwrap();
        assert!(what.is_none() && same.name() == "ball", "{what:?}");
        for (factor, cells, words) in
            [(20.0, 3.0, "in voxels"), (1.0, 1.0, "1.00 cells"), (20.0, 1.0, "in voxels")]
        {
            let (mended, what) = mended(&ctx, ball(&ctx, factor, cells)).unwrap();
            assert!(what.as_deref().is_some_and(|what| what.contains(words)), "{what:?}");
            assert_eq!(mended.name(), "ball");
            assert!((f64::from(mended.background()) / VOXEL - 3.0).abs() < 1e-5, "{what:?}");
            let own = measure(&ctx, &mended).unwrap().volume;
            assert!((own / volume - 1.0).abs() < 0.01, "{own}");
            assert!(warning(&mended).unwrap().is_none());
        }
        let (_, what) = mended(&ctx, ball(&ctx, 100.0, 3.0)).unwrap();
        assert!(what.is_some_and(|what| what.contains("no distances in metres")));
    }
}
