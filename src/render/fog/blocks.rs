//! The densities of a fog: blocks of 8 x 8 x 8 voxels, found through nodes of 16 x 16 x 16 blocks.

use std::collections::{HashMap, HashSet};

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{DIM, Mask, Origin, Values, offset};
use crate::render::camera::corner;

/// Samples along an edge of a block: its own voxels and the first of the next block, so that every position in the block is
/// interpolated from its samples alone.
const EDGE: usize = DIM + 1;
/// Extinctions (1/m) at the samples of a block; sample (x, y, z) lies at `(x * 9 + y) * 9 + z`.
type Samples = [f32; EDGE * EDGE * EDGE];
/// Blocks along an edge of a node.
pub(super) const NODE: i32 = 16;
/// Blocks of a node.
const NODE_BLOCKS: usize = (NODE * NODE * NODE) as usize;
/// Maximum number of nodes in the box around a fog: their table takes 64 MB.
const MAX_NODES: f64 = (1 << 24) as f64;
/// Voxel coordinates have magnitudes below this.
const COORDINATE_LIMIT: i32 = 1 << 30;
/// Maximum extinction (1/m): no light passes a micrometre.
const MAX_EXTINCTION: f64 = 1.0e6;
/// Voxels below this share of the maximum extinction are left out of the bounds, so that invisible wisps do not widen the view.
const VISIBLE_SHARE: f32 = 0.01;
/// Memory (bytes) of a block with its own samples while a fog is made: its samples twice, and its light.
const BYTES_PER_DENSE_BLOCK: u64 = 2 * size_of::<Samples>() as u64 + 1500;
/// Memory (bytes) of any block position while a fog is made.
const BYTES_PER_POSITION: u64 = 256;
/// No node, or no block.
const NONE: u32 = u32::MAX;

/// A fog volume, ready to be drawn.
pub struct Fog {
    placement: Placement,
    /// Minimum corner of the box of nodes, in nodes, and the number of nodes along each axis.
    low: [i32; 3],
    counts: [usize; 3],
    /// For each node of the box its index, or [`NONE`].
    table: Vec<u32>,
    /// For each block of a node its index, or [`NONE`].
    nodes: Vec<Box<[u32; NODE_BLOCKS]>>,
    blocks: Vec<FogBlock>,
    /// Samples of the blocks; blocks of one uniform value share them.
    samples: Vec<Samples>,
    bounds: Option<(DVec3, DVec3)>,
}

/// A block that is not empty.
#[derive(Clone, Copy)]
pub(super) struct FogBlock {
    /// Minimum corner, in voxels.
    pub origin: Origin,
    samples: u32,
}

/// Positions of the voxels of a fog in the world.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// The centre of voxel (0, 0, 0) (m).
    origin: DVec3,
    /// Displacements (m) from one voxel to the next along x, y and z.
    axes: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl Placement {
    /// From the centre of voxel (0, 0, 0) and the displacements to its neighbours (m); none if these are coplanar.
    pub fn new(origin: DVec3, axes: [DVec3; 3]) -> Option<Self> {
        let axes = Matrix3::from_columns(&axes);
        let inverse = axes.try_inverse()?;
        inverse.iter().all(|number| number.is_finite()).then_some(Self { origin, axes, inverse })
    }

    /// World position (m) of a position in voxels.
    pub fn to_world(self, at: DVec3) -> DVec3 {
        self.origin + self.axes * at
    }

    /// A ray in voxels: its origin, and voxels per metre along it.
    pub fn ray(self, origin: DVec3, toward: DVec3) -> [DVec3; 2] {
        [self.inverse * (origin - self.origin), self.inverse * toward]
    }

    /// Minimum distance (m) between neighbouring voxels.
    pub fn cell(self) -> f64 {
        self.axes.column_iter().map(|axis| axis.norm()).fold(f64::INFINITY, f64::min)
    }
}

/// Densities at a block position; those below 0 count as 0.
#[derive(Clone, Copy)]
pub enum Part<'a> {
    /// One for each voxel; voxels that are not active are empty.
    Dense(&'a Values, &'a Mask),
    /// The same for all.
    Uniform(f32),
}

impl Part<'_> {
    fn density(&self, voxel: usize) -> f32 {
        match self {
            Self::Dense(values, mask) if mask[voxel >> 6] >> (voxel & 63) & 1 == 1 => values[voxel].max(0.0),
            Self::Dense(..) => 0.0,
            Self::Uniform(density) => density.max(0.0),
        }
    }

    fn is_empty(&self) -> bool {
        match self {
            Self::Dense(..) => (0..DIM * DIM * DIM).all(|voxel| self.density(voxel) == 0.0),
            Self::Uniform(density) => *density <= 0.0,
        }
    }
}

/// The samples of a block.
enum BlockSamples {
    Uniform(f32),
    Dense(Box<Samples>),
}

impl Fog {
    /// A fog of densities by block position (in voxels, a multiple of 8 on each axis, each position at most once). A density of 1 has
    /// the extinction `extinction` (1/m, above 0); density times extinction is clamped to a million.
    ///
    /// # Errors
    /// Densities too far apart, or too many for the memory limit; cancel.
    pub fn of_parts(
        ctx: &Context,
        placement: Placement,
        mut parts: Vec<(Origin, Part<'_>)>,
        extinction: f64,
    ) -> Result<Self> {
        parts.retain(|(_, part)| !part.is_empty());
        let (low, counts) = node_box(&parts)?;
        const WHAT: &str = "a fog";
        // Each block contributes to the samples of eight positions.
        ctx.allow(WHAT, 8 * parts.len() as u64 * size_of::<Origin>() as u64)?;
        let positions = ctx.pool().install(|| positions(&parts));
        ctx.allow(
            WHAT,
            parts.len() as u64 * BYTES_PER_POSITION + positions.len() as u64 * BYTES_PER_POSITION,
        )?;
        let by_position: HashMap<Origin, Part<'_>> = parts.iter().copied().collect();
        let dense =
            positions.iter().filter(|position| uniform_density(**position, &by_position).is_none()).count();
        let nodes: HashSet<[i32; 3]> =
            positions.iter().map(|position| position.map(|at| at.div_euclid(NODE * DIM as i32))).collect();
        let needed = dense as u64 * BYTES_PER_DENSE_BLOCK
            + positions.len() as u64 * BYTES_PER_POSITION
            + nodes.len() as u64 * size_of::<[u32; NODE_BLOCKS]>() as u64
            + counts.iter().product::<usize>() as u64 * size_of::<u32>() as u64;
        ctx.allow(WHAT, needed)?;
        let samples_of_blocks: Vec<Option<BlockSamples>> = ctx.pool().install(|| {
            let fill = |position: &Origin| {
                ctx.check()?;
                Ok(samples_at(*position, &by_position, extinction))
            };
            positions.par_iter().map(fill).collect::<Result<_>>()
        })?;
        let mut fog = Self {
            placement,
            low,
            counts,
            table: vec![NONE; counts.iter().product()],
            nodes: Vec::new(),
            blocks: Vec::new(),
            // Most fogs have at most one value of uniform blocks.
            samples: Vec::with_capacity(
                1 + samples_of_blocks
                    .iter()
                    .flatten()
                    .filter(|samples| matches!(samples, BlockSamples::Dense(_)))
                    .count(),
            ),
            bounds: None,
        };
        let mut uniform: HashMap<u32, u32> = HashMap::new();
        for (position, samples) in positions.into_iter().zip(samples_of_blocks) {
            let next = fog.samples.len() as u32;
            let samples = match samples {
                None => continue,
                Some(BlockSamples::Uniform(value)) => *uniform.entry(value.to_bits()).or_insert_with(|| {
                    fog.samples.push([value; EDGE * EDGE * EDGE]);
                    next
                }),
                Some(BlockSamples::Dense(samples)) => {
                    fog.samples.push(*samples);
                    next
                }
            };
            fog.insert(FogBlock { origin: position, samples });
        }
        fog.bounds = fog.find_bounds();
        Ok(fog)
    }

    /// Adds a block.
    fn insert(&mut self, block: FogBlock) {
        let position = block.origin.map(|at| at.div_euclid(DIM as i32));
        let (Some(slot), within) = self.slot(position) else { return };
        if self.table[slot] == NONE {
            self.table[slot] = self.nodes.len() as u32;
            self.nodes.push(Box::new([NONE; NODE_BLOCKS]));
        }
        self.nodes[self.table[slot] as usize][within] = self.blocks.len() as u32;
        self.blocks.push(block);
    }

    /// Index of a block's node in the table (none outside the box), and of the block in the node.
    fn slot(&self, position: [i32; 3]) -> (Option<usize>, usize) {
        let [x, y, z] = [0, 1, 2].map(|axis| i64::from(position[axis].div_euclid(NODE) - self.low[axis]));
        let inside = [x, y, z].iter().zip(&self.counts).all(|(at, count)| (0..*count as i64).contains(at));
        let slot = (x as usize * self.counts[1] + y as usize) * self.counts[2] + z as usize;
        let [x, y, z] = position.map(|at| at.rem_euclid(NODE) as usize);
        (inside.then_some(slot), (x * NODE as usize + y) * NODE as usize + z)
    }

    /// Contents of a block position (counted in blocks).
    pub(super) fn lookup(&self, position: [i32; 3]) -> Lookup {
        let (Some(slot), within) = self.slot(position) else { return Lookup::Outside };
        match self.table[slot] {
            NONE => Lookup::EmptyNode,
            node => match self.nodes[node as usize][within] {
                NONE => Lookup::Empty,
                block => Lookup::Block(block as usize),
            },
        }
    }

    /// Minimum block position of the box of nodes, and the first one beyond it, in blocks.
    pub(super) fn block_box(&self) -> [[i32; 3]; 2] {
        let end = [0, 1, 2].map(|axis| (self.low[axis] + self.counts[axis] as i32) * NODE);
        [self.low.map(|low| low * NODE), end]
    }

    /// The blocks that are not empty.
    pub(super) fn blocks(&self) -> &[FogBlock] {
        &self.blocks
    }

    /// Positions of its voxels.
    pub(super) fn placement(&self) -> Placement {
        self.placement
    }

    /// Extinction (1/m) at a position in a block, in voxels from its minimum corner, 0 to 8.
    #[inline]
    pub(super) fn extinction(&self, block: usize, local: [f32; 3]) -> f32 {
        let samples = &self.samples[self.blocks[block].samples as usize];
        let whole = local.map(|at| (at as usize).min(DIM - 1));
        let [x, y, z] = [0, 1, 2].map(|axis| local[axis] - whole[axis] as f32);
        let corner = (whole[0] * EDGE + whole[1]) * EDGE + whole[2];
        let along_z = |at: usize| samples[at] + (samples[at + 1] - samples[at]) * z;
        let along_y = |at: usize| {
            let (near, far) = (along_z(at), along_z(at + EDGE));
            near + (far - near) * y
        };
        let (near, far) = (along_y(corner), along_y(corner + EDGE * EDGE));
        near + (far - near) * x
    }

    /// Maximum extinction (1/m) of the samples of a block around a position, less than `reach` voxels away along each axis.
    pub(super) fn max_near(&self, block: usize, local: [i32; 3], reach: i32) -> f32 {
        let samples = &self.samples[self.blocks[block].samples as usize];
        let [x, y, z] =
            local.map(|at| (at - reach + 1).max(0) as usize..=((at + reach - 1) as usize).min(DIM));
        let row = |x: usize, y: usize| samples[(x * EDGE + y) * EDGE..][z.clone()].iter().copied();
        let slice_max = |x: usize| y.clone().flat_map(move |y| row(x, y)).fold(0.0, f32::max);
        x.map(slice_max).fold(0.0, f32::max)
    }

    /// Whether it has no density above 0 anywhere.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Minimum and maximum corner (m) of its visible part: of the voxels with at least a hundredth of the maximum density; none if it is
    /// empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    fn find_bounds(&self) -> Option<(DVec3, DVec3)> {
        let max = self.samples.iter().flat_map(|samples| samples.iter().copied()).fold(0.0, f32::max);
        let boxes = self.blocks.iter().flat_map(|block| {
            let samples = &self.samples[block.samples as usize];
            let seen = (0..samples.len()).filter(|n| samples[*n] >= VISIBLE_SHARE * max && samples[*n] > 0.0);
            let voxel = |n: usize| [n / (EDGE * EDGE), n / EDGE % EDGE, n % EDGE];
            let all = seen.map(|n| DVec3::from(voxel(n).map(|at| at as f64)));
            let corner = DVec3::from(block.origin.map(f64::from));
            let found = all.map(|at| (at, at)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
            found.map(|(low, high)| (corner + low, corner + high))
        });
        let (low, high) = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
        let half = DVec3::repeat(0.5);
        let corners = (0..8).map(|n| self.placement.to_world(corner((low - half, high + half), n)));
        corners.map(|at| (at, at)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }
}

/// Contents of a block position.
pub(super) enum Lookup {
    /// A block that is not empty, by its index.
    Block(usize),
    /// Nothing.
    Empty,
    /// Nothing in the whole node.
    EmptyNode,
    /// Outside the box of nodes.
    Outside,
}

/// The box of nodes around some blocks and the positions just below them: its minimum node and the number of nodes along each axis.
fn node_box(parts: &[(Origin, Part<'_>)]) -> Result<([i32; 3], [usize; 3])> {
    let too_far = || Error::argument("has densities too far apart, or too far from its origin, to be drawn");
    let ends = parts.iter().map(|(origin, _)| (*origin, *origin)).reduce(|(low, high), (at, _)| {
        let pick = |choose: fn(i32, i32) -> i32, a: Origin| [0, 1, 2].map(|axis| choose(a[axis], at[axis]));
        (pick(i32::min, low), pick(i32::max, high))
    });
    let Some((low, high)) = ends else { return Ok(([0; 3], [0; 3])) };
    if low.iter().chain(&high).any(|at| !(-COORDINATE_LIMIT..COORDINATE_LIMIT).contains(at)) {
        return Err(too_far());
    }
    let node = |at: i32| at.div_euclid(NODE * DIM as i32);
    let first = low.map(|at| node(at - DIM as i32));
    let counts = [0, 1, 2].map(|axis| (node(high[axis]) - first[axis] + 1) as usize);
    if counts.iter().map(|count| *count as f64).product::<f64>() > MAX_NODES {
        return Err(too_far());
    }
    Ok((first, counts))
}

/// The block positions that may not be empty: those of the parts, and those just below them, whose last samples are the parts' first ones.
fn positions(parts: &[(Origin, Part<'_>)]) -> Vec<Origin> {
    let before = |n: usize, origin: &Origin| [0, 1, 2].map(|axis| origin[axis] - (n >> axis & 1) as i32 * 8);
    let mut positions: Vec<Origin> =
        parts.iter().flat_map(|(origin, _)| (0..8).map(move |n| before(n, origin))).collect();
    positions.par_sort_unstable();
    positions.dedup();
    positions
}

/// The block at a position and the next ones along the axes.
fn neighbours<'a>(position: Origin, parts: &HashMap<Origin, Part<'a>>) -> [Option<Part<'a>>; 8] {
    std::array::from_fn(|n| {
        parts.get(&[0, 1, 2].map(|axis| position[axis] + (n >> axis & 1) as i32 * DIM as i32)).copied()
    })
}

/// The density of all samples of the block at a position if it is uniform; none if they may differ.
fn uniform_density(position: Origin, parts: &HashMap<Origin, Part<'_>>) -> Option<f32> {
    let neighbours = neighbours(position, parts);
    let Some(Part::Uniform(first)) = neighbours[0] else { return None };
    let is_same = |part: &Option<Part<'_>>| matches!(part, Some(Part::Uniform(other)) if *other == first);
    neighbours.iter().all(is_same).then_some(first)
}

/// The samples of the block at a position; none if all are 0.
fn samples_at(position: Origin, parts: &HashMap<Origin, Part<'_>>, extinction: f64) -> Option<BlockSamples> {
    let value = |density: f32| (f64::from(density) * extinction).min(MAX_EXTINCTION) as f32;
    if let Some(density) = uniform_density(position, parts) {
        return Some(value(density)).filter(|value| *value > 0.0).map(BlockSamples::Uniform);
    }
    let neighbours = neighbours(position, parts);
    let mut samples = Box::new([0.0; EDGE * EDGE * EDGE]);
    for (n, part) in neighbours.iter().enumerate().filter_map(|(n, part)| part.map(|part| (n, part))) {
        // The block itself gives 8 samples along an axis, the next one its first.
        let range = |axis: usize| if n >> axis & 1 == 0 { 0..DIM } else { 0..1 };
        let shift = |axis: usize| if n >> axis & 1 == 0 { 0 } else { DIM };
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let at = ((x + shift(0)) * EDGE + y + shift(1)) * EDGE + z + shift(2);
                    samples[at] = value(part.density(offset(x, y, z)));
                }
            }
        }
    }
    samples.iter().any(|sample| *sample > 0.0).then_some(BlockSamples::Dense(samples))
}
