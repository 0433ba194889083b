//! Sorts grains into blocks of 8 x 8 x 8 diameters, so that neighbours are close in memory, and blocks into columns: two
//! columns that are not adjacent never use the same grain.
//!
//! Within a step, grains change blocks without moving in memory: a block lists its members.

use std::collections::HashMap;

use rayon::prelude::*;

use super::blocks::{ALL_CELLS, Block, BlockIndex, CELLS, EDGE, Home, NONE};
use super::pairs::{Batch, PairImpulse, SKIN, THIN_SKIN};
use super::rows::{Row, Shared, V, add, dot, norm, scaled};
use crate::geometry::DVec3;
use crate::numeric::lanes::LANES;
use crate::numeric::lists::{refill, reset};

/// A grain that has left its block.
struct Mover {
    slot: u32,
    /// Index of its new block along each axis.
    at: BlockIndex,
    /// The new block if it exists and is adjacent to the old one, else [`NONE`].
    block: u32,
}

/// The block at `to` if it exists and is adjacent to the one at `from`, else [`NONE`]; `near` are the blocks around `from`.
fn adjacent_block(from: BlockIndex, near: &[u32; 27], to: BlockIndex) -> u32 {
    let [x, y, z] = [0, 1, 2].map(|axis| i64::from(to[axis]) - i64::from(from[axis]) + 1);
    if [x, y, z].iter().all(|step| (0..3).contains(step)) { near[(9 * x + 3 * y + z) as usize] } else { NONE }
}

/// Blocks above each other.
pub struct Column {
    /// Index along x and z.
    pub at: [i32; 2],
    /// Its blocks, upward.
    pub blocks: Vec<u32>,
}

/// Blocks and columns of grains.
#[derive(Default)]
pub struct Layout {
    /// Blocks that have or had grains.
    pub blocks: Vec<Block>,
    /// The pairs that each block owns: those of a member with another member or with one of an earlier block.
    pub batches: Vec<Vec<Batch>>,
    /// Columns of blocks.
    pub columns: Vec<Column>,
    /// Home of each grain, by slot.
    pub homes: Vec<Home>,
    /// Whether a grain changed blocks in the last update.
    pub has_moved: bool,
    /// Whether a grain has changed blocks since the start of the step.
    pub has_ever_moved: bool,
    /// Impulses of the last step with the block that owns the pair, sorted by block.
    pub kept: Vec<(u32, PairImpulse)>,
    /// Count of neighbours of each grain at the start of the step, if needed: see [`super::density`].
    pub neighbours: Vec<u8>,
    index: HashMap<BlockIndex, u32>,
    column_index: HashMap<[i32; 2], u32>,
}

/// Sort key of a grain: column, level and cell, then identity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    cell: u64,
    id: u32,
    from: u32,
}

/// Offset of block indices in a key, which holds 2^21 blocks along x and z and 2^14 upward.
const KEY_OFFSET: [i32; 3] = [1 << 20, 1 << 13, 1 << 20];

/// Whether a block index fits into a sort key.
pub fn is_in_range(at: BlockIndex) -> bool {
    (0..3).all(|axis| (-KEY_OFFSET[axis]..KEY_OFFSET[axis]).contains(&at[axis]))
}

/// Index of the cell of a position in a block.
fn cell(position: V) -> usize {
    let [x, y, z] = position.map(|x| ((x * (CELLS as f32 / EDGE)) as usize).min(CELLS - 1));
    (y * CELLS + x) * CELLS + z
}

/// The slots of grains, sorted by column, level, cell and identity. Grains in blocks that do not fit into a key are omitted.
pub fn order(rows: &[Row], ids: &[u32], at: &[BlockIndex]) -> Vec<u32> {
    let mut keys: Vec<Key> = (rows.par_iter(), ids.par_iter(), at.par_iter())
        .into_par_iter()
        .enumerate()
        .filter(|(_, (_, _, at))| is_in_range(**at))
        .map(|(from, (row, id, at))| {
            let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] + KEY_OFFSET[axis]) as u64);
            Key {
                cell: ((x << 21 | z) << 14 | y) << 8 | cell(row.position) as u64,
                id: *id,
                from: from as u32,
            }
        })
        .collect();
    keys.par_sort_unstable();
    keys.par_iter().map(|key| key.from).collect()
}

impl Layout {
    /// Blocks of grains that are sorted as by [`order`]; pairs are not found yet.
    pub fn new(rows: &mut [Row], ids: &[u32], at: &[BlockIndex], ahead: f32) -> Self {
        let mut layout = Self { homes: vec![Home { block: NONE, rank: 0 }; at.len()], ..Self::default() };
        let is_first = |slot: &usize| *slot == 0 || at[*slot] != at[slot - 1];
        let mut firsts: Vec<usize> = (0..at.len()).into_par_iter().filter(is_first).collect();
        firsts.push(at.len());
        for run in firsts.windows(2) {
            let block = layout.block(at[run[0]]);
            layout.blocks[block as usize].members.extend(run[0] as u32..run[1] as u32);
            layout.homes[run[0]..run[1]].fill(Home { block, rank: 0 });
        }
        layout.rank_members(rows, ids, ahead, |_| true);
        layout
    }

    /// The block at an index; creates it if there is none.
    pub fn block(&mut self, at: BlockIndex) -> u32 {
        if let Some(&index) = self.index.get(&at) {
            return index;
        }
        let index = self.blocks.len() as u32;
        let mut near = [NONE; 27];
        near[13] = index;
        for code in (0..27).filter(|code| *code != 13) {
            let step = [code / 9, code / 3 % 3, code % 3].map(|digit| digit as i32 - 1);
            let neighbour = [at[0] + step[0], at[1] + step[1], at[2] + step[2]];
            if let Some(&other) = self.index.get(&neighbour) {
                near[code] = other;
                self.blocks[other as usize].near[26 - code] = index;
            }
        }
        self.index.insert(at, index);
        self.blocks.push(Block {
            at,
            near,
            members: Vec::new(),
            starts: [0; ALL_CELLS + 1],
            anchors: Default::default(),
            skin: SKIN,
            touches: Vec::new(),
            travel_limit: 0.0,
            is_awake: false,
            is_reached: false,
            has_strayed: true,
            is_changed: true,
            has_ever_changed: false,
            lacks_touches: true,
            is_due: false,
            lacks_pairs: true,
            has_found_pairs: false,
        });
        let (columns, at) = (&mut self.columns, [at[0], at[2]]);
        self.batches.push(Vec::new());
        let column = *self.column_index.entry(at).or_insert_with(|| {
            columns.push(Column { at, blocks: Vec::new() });
            columns.len() as u32 - 1
        });
        let column = &mut self.columns[column as usize].blocks;
        let level = |block: &u32| self.blocks[*block as usize].at[1];
        let above = column.partition_point(|block| level(block) < level(&index));
        column.insert(above, index);
        index
    }

    /// Moves members of strayed blocks to the blocks that they are in now, and sorts the members of every block that changed.
    pub fn update_members(&mut self, rows: &mut [Row], ids: &[u32], ahead: f32) {
        let shared = Shared::new(rows);
        let strayed = self.blocks.par_iter_mut().filter(|block| block.has_strayed);
        let movers: Vec<Vec<Mover>> = strayed
            .map(|block| {
                (block.is_changed, block.has_ever_changed) = (true, true);
                let (mut gone, at, near) = (Vec::new(), block.at, block.near);
                block.members.retain(|&slot| {
                    let mut now = at;
                    // SAFETY: a grain is a member of one block, which only one task visits.
                    settle(unsafe { shared.get(slot as usize) }, &mut now);
                    if now != at {
                        gone.push(Mover { slot, at: now, block: adjacent_block(at, &near, now) });
                    }
                    now == at
                });
                gone
            })
            .collect();
        self.has_moved = movers.iter().any(|movers| !movers.is_empty());
        self.has_ever_moved |= self.has_moved;
        for Mover { slot, at, block } in movers.into_iter().flatten() {
            self.homes[slot as usize].block = NONE;
            if is_in_range(at) {
                let block = if block == NONE { self.block(at) } else { block };
                self.homes[slot as usize].block = block;
                let block = &mut self.blocks[block as usize];
                block.members.push(slot);
                (block.is_changed, block.has_ever_changed) = (true, true);
                if !block.has_strayed {
                    let position = anchor(&rows[slot as usize], ahead, block.skin);
                    block.anchors.iter_mut().zip(position).for_each(|(anchors, position)| {
                        anchors.insert(anchors.len() - LANES.min(anchors.len()), position);
                    });
                }
            }
        }
        self.rank_members(rows, ids, ahead, |block| block.is_changed && block.has_ever_changed);
    }

    /// Sorts the members of some blocks; strayed blocks get new anchors.
    fn rank_members(
        &mut self,
        rows: &mut [Row],
        ids: &[u32],
        ahead: f32,
        which: impl Fn(&Block) -> bool + Sync,
    ) {
        let rows = &*rows;
        let homes = Shared::new(&mut self.homes);
        let changed = self.blocks.par_iter_mut().filter(|block| which(block));
        changed.for_each_init(Ranking::default, |Ranking { positions, members }, block| {
            if block.has_strayed {
                let square = |&slot: &u32| {
                    let velocity = rows[slot as usize].velocity;
                    dot(velocity, velocity)
                };
                let fastest = block.members.iter().map(square).fold(0.0, f32::max).sqrt();
                block.skin =
                    if fastest * ahead / SUB_STEPS_AHEAD > FAST_DISPLACEMENT { THIN_SKIN } else { SKIN };
            }
            let position = |member: usize, slot: u32| {
                if block.has_strayed {
                    anchor(&rows[slot as usize], ahead, block.skin)
                } else {
                    [0, 1, 2].map(|axis: usize| block.anchors[axis][member])
                }
            };
            refill(
                positions,
                block.members.iter().enumerate().map(|(member, &slot)| {
                    let position = position(member, slot);
                    (position, cell(position) as u32)
                }),
            );
            // A counting sort by cell, then the few of a cell by identity.
            let mut starts = [0u32; ALL_CELLS + 1];
            positions.iter().for_each(|(_, cell)| starts[*cell as usize + 1] += 1);
            (0..ALL_CELLS).for_each(|cell| starts[cell + 1] += starts[cell]);
            let mut next = starts;
            let count = positions.len();
            reset(members, count, 0);
            block.anchors.iter_mut().for_each(|anchors| {
                reset(anchors, count + LANES, f32::INFINITY);
            });
            let [xs, ys, zs] = &mut block.anchors;
            for ((position, cell), &slot) in positions.iter().zip(&block.members) {
                let at = next[*cell as usize] as usize;
                next[*cell as usize] += 1;
                members[at] = slot;
                (xs[at], ys[at], zs[at]) = (position[0], position[1], position[2]);
            }
            for cell in starts.windows(2) {
                for from in cell[0] as usize + 1..cell[1] as usize {
                    let mut at = from;
                    while at > cell[0] as usize && ids[members[at] as usize] < ids[members[at - 1] as usize] {
                        members.swap(at, at - 1);
                        [&mut *xs, &mut *ys, &mut *zs]
                            .into_iter()
                            .for_each(|positions| positions.swap(at, at - 1));
                        at -= 1;
                    }
                }
            }
            for (member, &slot) in (0..).zip(&*members) {
                // SAFETY: a grain is a member of one block, which only one task visits.
                unsafe { homes.get(slot as usize).rank = member };
            }
            block.starts = starts;
            block.members.copy_from_slice(members);
            block.is_awake = block.members.iter().any(|&slot| !rows[slot as usize].rests());
            block.has_strayed = false;
            block.lacks_touches = true;
        });
    }

    /// Marks the blocks whose contacts can matter: those awake and their neighbours, or all.
    pub fn mark_reached(&mut self, all: bool) {
        let awake: Vec<bool> = self.blocks.par_iter().map(|block| block.is_awake).collect();
        let is_awake = |&block: &u32| block != NONE && awake[block as usize];
        self.blocks
            .par_iter_mut()
            .for_each(|block| block.is_reached = all || block.near.iter().any(is_awake));
    }

    /// Columns with blocks that are reached, in four sets; no two columns of a set are adjacent.
    pub fn colours(&self) -> [Vec<u32>; 4] {
        let mut sets: [Vec<u32>; 4] = Default::default();
        for (index, column) in self.columns.iter().enumerate() {
            if column.blocks.iter().any(|block| self.blocks[*block as usize].is_reached) {
                sets[((column.at[0] & 1) << 1 | column.at[1] & 1) as usize].push(index as u32);
            }
        }
        sets
    }
}

/// Scratch memory of one thread that sorts members.
#[derive(Default)]
struct Ranking {
    /// Anchor and cell of each member.
    positions: Vec<(V, u32)>,
    members: Vec<u32>,
}

/// Anchor of a grain, from which its pairs are found: slightly ahead of it, so that it takes longer to stray. `ahead` is the distance
/// (diameters) that a grain covers at 1 m/s while its pairs should last.
fn anchor(row: &Row, ahead: f32, skin: f32) -> V {
    // Less than half the skin, at which a grain strays.
    let max = 0.45 * skin;
    let displacement = scaled(row.velocity, ahead);
    let length = norm(displacement);
    let share = if length > max { max / length } else { 1.0 };
    let position = add(row.position, scaled(displacement, share));
    position.map(|x| x.clamp(0.0, EDGE))
}

/// Number of sub-steps for which pairs should last.
pub const SUB_STEPS_AHEAD: f32 = 6.0;
/// Displacement (diameters) in a sub-step beyond which a thin skin is cheaper: some grain nearby then strays in every
/// sub-step, and the pairs around it are found again.
const FAST_DISPLACEMENT: f32 = 0.06;

/// Moves a grain to the block that it lies in.
pub fn settle(row: &mut Row, at: &mut BlockIndex) {
    for axis in 0..3 {
        let (position, reference, at) = (&mut row.position[axis], &mut row.reference[axis], &mut at[axis]);
        let blocks = (*position / EDGE).floor();
        if blocks != 0.0 {
            *at = at.saturating_add(blocks as i32);
            *position -= blocks * EDGE;
            *reference -= blocks * EDGE;
            // A position just below 0 rounds to the edge itself.
            if *position >= EDGE {
                *at = at.saturating_add(1);
                *position = 0.0;
                *reference -= EDGE;
            }
        }
        // The position may be so slightly below 0 that it, or an eighth of it, was a denormal and was flushed to 0.
        if *position <= 0.0 {
            *position = 0.0;
        }
    }
}

/// World position (m) of a position in a block.
pub fn world(at: BlockIndex, position: V, diameter: f64) -> DVec3 {
    DVec3::from(
        [0, 1, 2].map(|axis| (f64::from(at[axis]) * f64::from(EDGE) + f64::from(position[axis])) * diameter),
    )
}

/// Block of a world position (m), and the position in it.
pub fn locate(world: DVec3, diameter: f64) -> (BlockIndex, V) {
    let mut row = Row::default();
    let mut at = [0; 3];
    for axis in 0..3 {
        let position = world[axis] / diameter;
        let block = (position / f64::from(EDGE)).floor();
        at[axis] = block as i32;
        row.position[axis] = (position - block * f64::from(EDGE)) as f32;
    }
    settle(&mut row, &mut at);
    (at, row.position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::cpu::FlushDenormals;

    #[test]
    fn every_position_settles_in_a_block() {
        for position in [-6.0e-38, -1.0e-45, -1.0e-8, -0.0, 0.0, 7.999_999_5, 8.0, -8.0, -8.1, 31.0, -1.0e6] {
            let mut row = Row { position: [position; 3], reference: [position; 3], ..Row::default() };
            let mut at = [3; 3];
            let flush = FlushDenormals::begin();
            settle(&mut row, &mut at);
            drop(flush);
            assert!(
                row.position.iter().all(|x| (0.0..EDGE).contains(x)),
                "{position} becomes {:?}",
                row.position
            );
            let whole = f64::from(at[0] - 3) * f64::from(EDGE) + f64::from(row.position[0]);
            assert!((whole - f64::from(position)).abs() < 1.0e-6, "{position} becomes {whole}");
        }
    }
}
