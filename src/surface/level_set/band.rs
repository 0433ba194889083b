//! Signed distances from the zero set of the implicit function, in a narrow band (thesis 2.3.1). The thesis measures distances in the cells
//! at the surface and extends them by a fast marching method; here they are exact in the whole band.

use std::collections::HashMap;

use rayon::prelude::*;

use super::implicit::{Implicit, SIDE};
use super::isosurface::Isosurface;
use crate::context::Context;
use crate::distance::nearest::{Search, search};
use crate::distance::triangle::Triangle;
use crate::error::Result;
use crate::geometry::Coord;
use crate::geometry::coords::{around, between, is_between};
use crate::numeric::blocks::{DIM, VOXELS, Values, offset};
use crate::numeric::lanes::LANES;

/// Signed distances in blocks of 8 x 8 x 8 nodes.
pub struct Distances {
    /// Edge of a cell (m).
    cell: f64,
    /// How far from the surface distances are known (cells); beyond, they are clamped to this.
    reach: f32,
    /// Blocks in which distances are known farther from the surface, ascending, each with how far (cells).
    deep: Vec<(Coord, f32)>,
    /// Coordinates of blocks, ascending.
    coords: Vec<Coord>,
    /// Distances (cells), negative inside.
    values: Vec<Values>,
    slots: HashMap<Coord, u32>,
    /// Slots of the 27 blocks around each block, which is in the middle; [`Distances::NONE`]: there is none.
    around: Vec<[u32; 27]>,
}

/// Patches along the edge of a block.
const PARTS: i32 = DIM as i32 / SIDE;
/// Bytes of a block: its distances, while they are computed and afterwards, and its neighbours.
const BYTES: usize = 2 * 4 * VOXELS + 200;
/// What needs the memory, for messages.
const WHAT: &str = "the distances from the particles' surface (larger cells need less)";
/// All nodes of a block.
const ALL: [u64; DIM] = [u64::MAX; DIM];

impl Distances {
    /// Sentinel: no block.
    pub const NONE: u32 = u32::MAX;

    /// Distances up to `reach` (cells) from a surface.
    ///
    /// # Errors
    /// More memory than the context allows; cancel.
    pub fn new(ctx: &Context, phi: &Implicit, surface: &Isosurface, reach: f32) -> Result<Self> {
        Self::with_deep_blocks(ctx, phi, surface, reach, Vec::new())
    }

    /// Distances up to `reach` (cells) from a surface, and farther in some blocks, ascending, each with its reach (cells).
    ///
    /// # Errors
    /// As [`Distances::new`].
    pub fn with_deep_blocks(
        ctx: &Context,
        phi: &Implicit,
        surface: &Isosurface,
        reach: f32,
        deep: Vec<(Coord, f32)>,
    ) -> Result<Self> {
        let runs: Vec<(Coord, &[[u32; 3]])> = surface.runs().collect();
        // The blocks that may have nodes near triangles of a run.
        let reached = |patch: &Coord, reach: f32| {
            let margin = reach.ceil() as i32;
            let low = patch.map(|at| (at * SIDE - margin).div_euclid(DIM as i32));
            let high = patch.map(|at| (at * SIDE + SIDE + margin).div_euclid(DIM as i32));
            [low, high]
        };
        let deepest = deep.iter().map(|(_, reach)| *reach).fold(reach, f32::max);
        let blocks = |((patch, _), run): (&(Coord, &[[u32; 3]]), u32)| {
            let ([low, high], [from, to]) = (reached(patch, reach), reached(patch, deepest));
            let is_wanted = |block: &Coord| {
                let is_in = |[low, high]: [Coord; 2]| is_between(*block, low, high);
                is_in([low, high])
                    || reach_in(&deep, *block).is_some_and(|reach| is_in(reached(patch, reach)))
            };
            between(from, to).filter(is_wanted).map(|block| (block, run)).collect::<Vec<(Coord, u32)>>()
        };
        let pairs: Vec<Vec<(Coord, u32)>> =
            runs.par_iter().zip(0..runs.len() as u32).with_min_len(64).map(blocks).collect();
        let mut pairs = pairs.concat();
        pairs.par_sort_unstable();
        let groups: Vec<&[(Coord, u32)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
        ctx.allow(WHAT, (groups.len() * BYTES) as u64)?;
        let corners = |run: usize| {
            let (patch, triangles) = runs[run];
            triangles.iter().map(move |triangle| {
                triangle.map(|vertex| {
                    let (owner, position) = surface.position(phi, vertex);
                    [0, 1, 2].map(|axis| position[axis] + ((owner[axis] - patch[axis]) * SIDE) as f32)
                })
            })
        };
        let corners: Vec<Vec<[[f32; 3]; 3]>> =
            (0..runs.len()).into_par_iter().with_min_len(16).map(|run| corners(run).collect()).collect();
        let fill = |(search, triangles): &mut (Search, Vec<Triangle>), group: &&[(Coord, u32)]| {
            ctx.check()?;
            let block = group[0].0;
            let reach = reach_in(&deep, block).map_or(reach, |own| own.max(reach));
            triangles.clear();
            for (_, run) in *group {
                let shift =
                    [0, 1, 2].map(|axis| ((runs[*run as usize].0[axis] - block[axis] * PARTS) * SIDE) as f32);
                let moved = corners[*run as usize]
                    .iter()
                    .map(|v| v.map(|at| [0, 1, 2].map(|axis| at[axis] + shift[axis])))
                    .filter(|v| is_near(v, reach));
                triangles.extend(moved.map(Triangle::of_cells));
            }
            Ok(distances(phi, block, triangles, reach, search))
        };
        let values: Vec<Option<Box<Values>>> =
            groups.par_iter().with_min_len(2).map_init(Default::default, fill).collect::<Result<_>>()?;
        let (coords, values): (Vec<Coord>, Vec<Values>) =
            groups.iter().zip(values).filter_map(|(group, values)| Some((group[0].0, *values?))).unzip();
        let slots: HashMap<Coord, u32> = coords.iter().copied().zip(0..).collect();
        let find = |block: Coord| slots.get(&block).copied().unwrap_or(Self::NONE);
        let around = coords.par_iter().with_min_len(64).map(|block| around(*block).map(find)).collect();
        Ok(Self { cell: phi.cell(), reach, deep, coords, values, slots, around })
    }

    /// Edge of a cell (m).
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// How far from the surface distances are known everywhere (cells).
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// How far from the surface distances are known in a block (cells).
    pub fn reach_in(&self, block: Coord) -> f32 {
        reach_in(&self.deep, block).map_or(self.reach, |own| own.max(self.reach))
    }

    /// Coordinates of the blocks, ascending: block (i, j, k) begins at node (8 i, 8 j, 8 k).
    pub fn coords(&self) -> &[Coord] {
        &self.coords
    }

    /// The distances of a block (cells).
    pub fn values(&self, slot: usize) -> &Values {
        &self.values[slot]
    }

    /// The slot of a block.
    pub fn find(&self, block: Coord) -> Option<usize> {
        self.slots.get(&block).map(|slot| *slot as usize)
    }

    /// Slots of the 27 blocks around a block.
    pub fn around(&self, slot: usize) -> &[u32; 27] {
        &self.around[slot]
    }
}

/// Whether a triangle's box is within reach of the nodes of a block.
fn is_near(v: &[[f32; 3]; 3], reach: f32) -> bool {
    (0..3).all(|axis| {
        let low = v[0][axis].min(v[1][axis]).min(v[2][axis]);
        let high = v[0][axis].max(v[1][axis]).max(v[2][axis]);
        high >= -reach && low <= (DIM - 1) as f32 + reach
    })
}

/// The distances of a block; none if all are out of reach.
fn distances(
    phi: &Implicit,
    block: Coord,
    triangles: &[Triangle],
    reach: f32,
    scratch: &mut Search,
) -> Option<Box<Values>> {
    if triangles.is_empty() {
        return None;
    }
    let mut out = Box::new([reach; VOXELS]);
    let mut is_found = false;
    search(triangles, reach, &ALL, scratch, |group| {
        for lane in 0..LANES {
            let distance = group.squared[lane].sqrt();
            is_found |= distance < reach;
            out[group.voxel(lane)] = distance.min(reach);
        }
    });
    if !is_found {
        return None;
    }
    let side = SIDE as usize;
    for part in 0..8 {
        let half = [part >> 2, part >> 1 & 1, part & 1];
        let patch = [0, 1, 2].map(|axis| block[axis] * PARTS + half[axis] as i32);
        let values = phi.find(patch).map(|at| phi.values(at));
        if values.is_none() && !phi.is_inside(patch) {
            continue;
        }
        for (x, y, z) in
            (0..side).flat_map(|x| (0..side).flat_map(move |y| (0..side).map(move |z| (x, y, z))))
        {
            if values.is_none_or(|values| values[x << 4 | y << 2 | z] < 0.0) {
                let at = offset(half[0] * side + x, half[1] * side + y, half[2] * side + z);
                out[at] = -out[at];
            }
        }
    }
    Some(out)
}

/// Reach of the band in a block; none if it is the same as elsewhere.
pub fn reach_in(deep: &[(Coord, f32)], block: Coord) -> Option<f32> {
    deep.binary_search_by_key(&block, |(block, _)| *block).ok().map(|at| deep[at].1)
}
