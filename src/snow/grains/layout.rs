//! Grains in blocks of 8 x 8 x 8 diameters, so that neighbours are near in memory, and those in columns: two columns that are
//! no neighbours never touch the same grain.
//!
//! Within a step grains change blocks without moving in memory: a block has a list of its members.

use std::collections::HashMap;

use rayon::prelude::*;

use super::contacts::{Batch, Held, SKIN, THIN_SKIN};
use super::rows::{Row, Shared, V, add, dot, norm, scaled};
use super::touch::Touch;
use crate::base::DVec3;
use crate::base::lanes::LANES;

/// Edge of a block (diameters). At least twice the reach of a contact.
pub const EDGE: f32 = 8.0;
/// Cells along a block's edge: wider than the reach of a contact.
pub const CELLS: usize = 6;
/// Cells of a block.
pub const ALL_CELLS: usize = CELLS * CELLS * CELLS;
/// In place of a number: there is none.
pub const NONE: u32 = u32::MAX;

/// Index of a block along each axis.
pub type At = [i32; 3];

/// A block of grains, and what they do in a step.
pub struct Block {
    /// Which.
    pub at: At,
    /// The blocks around it, and itself in the middle: along x, then y, then z; [`NONE`] where there is none.
    pub near: [u32; 27],
    /// Its grains by cell, in a cell in the order in which they came to the block.
    pub members: Vec<u32>,
    /// The first member of each cell (upward, then along x, then z), and how many there are.
    pub starts: [u32; ALL_CELLS + 1],
    /// Where members were when their neighbours were found (diameters, each axis for itself), and some that are nowhere.
    pub anchors: [Vec<f32>; 3],
    /// Distance (diameters) beyond touching up to which two members are a pair.
    pub skin: f32,
    /// What members touch that cannot be moved, by member.
    pub touches: Vec<Touch>,
    /// How far (diameters) meshes may travel in a step before one can touch a member.
    pub limit: f32,
    /// Whether a member is awake.
    pub is_awake: bool,
    /// Whether contacts of its members can matter: it or a neighbour is awake.
    pub is_reached: bool,
    /// Whether a member has moved so far that neighbours must be found again.
    pub has_strayed: bool,
    /// Whether its members changed in this sub-step.
    pub is_changed: bool,
    /// Whether they have changed since the step began.
    pub is_stirred: bool,
    /// Whether its touches are not those of its members.
    pub lacks_touches: bool,
    /// Whether they are found in this sub-step.
    pub is_due: bool,
    /// Whether its pairs are not those of its members.
    pub lacks_pairs: bool,
    /// Whether it has had its pairs found in this step.
    pub is_found: bool,
}

/// Where a grain belongs.
#[derive(Clone, Copy)]
pub struct Home {
    /// Its block; [`NONE`] where it has left the range of blocks.
    pub block: u32,
    /// Its place among the block's members.
    pub rank: u32,
}

/// A grain that has left its block.
struct Mover {
    slot: u32,
    /// Index of the block that it is in.
    at: At,
    /// That block, where it is next to the last one; [`NONE`] where there is none yet.
    block: u32,
}

/// Of the blocks around an index the one at another index; [`NONE`] where there is none, or farther away.
fn beside(from: At, near: &[u32; 27], to: At) -> u32 {
    let [x, y, z] = [0, 1, 2].map(|axis| i64::from(to[axis]) - i64::from(from[axis]) + 1);
    if [x, y, z].iter().all(|step| (0..3).contains(step)) { near[(9 * x + 3 * y + z) as usize] } else { NONE }
}

/// Blocks one above the other.
pub struct Column {
    /// Index along x and z.
    pub at: [i32; 2],
    /// Its blocks, upward.
    pub blocks: Vec<u32>,
}

/// Where the grains are.
#[derive(Default)]
pub struct Layout {
    /// Blocks with grains, and some that had some.
    pub blocks: Vec<Block>,
    /// The pairs that each block owns: those with a grain of its own and another one, of its own or of a block that comes before it.
    pub batches: Vec<Vec<Batch>>,
    /// Columns of blocks.
    pub columns: Vec<Column>,
    /// Where each grain belongs.
    pub homes: Vec<Home>,
    /// Whether a grain has just changed blocks.
    pub has_moved: bool,
    /// Whether one has in this step.
    pub has_ever_moved: bool,
    /// What pairs carried in the last step, by the block that owns them, in this order.
    pub kept: Vec<(u32, Held)>,
    /// How many neighbours each grain had when the step began, where that is asked: see [`super::density`].
    pub neighbours: Vec<u8>,
    index: HashMap<At, u32>,
    column_index: HashMap<[i32; 2], u32>,
}

/// Where a grain goes: column, level and cell, then its identity.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    cell: u64,
    id: u32,
    from: u32,
}

/// Blocks are counted from the middle of what a key holds: 2^21 of them along x and z, 2^14 upward.
const MIDDLE: [i32; 3] = [1 << 20, 1 << 13, 1 << 20];

/// Whether a block index can be sorted.
pub fn holds(at: At) -> bool {
    (0..3).all(|axis| (-MIDDLE[axis]..MIDDLE[axis]).contains(&at[axis]))
}

/// Cell of a block that a place lies in.
fn cell(place: V) -> usize {
    let [x, y, z] = place.map(|x| ((x * (CELLS as f32 / EDGE)) as usize).min(CELLS - 1));
    (y * CELLS + x) * CELLS + z
}

/// The order of grains by column, level, cell and identity: where each was before. Those in a block that cannot be sorted are
/// left out.
pub fn order(rows: &[Row], ids: &[u32], at: &[At]) -> Vec<u32> {
    let mut keys: Vec<Key> = (rows.par_iter(), ids.par_iter(), at.par_iter())
        .into_par_iter()
        .enumerate()
        .filter(|(_, (_, _, at))| holds(**at))
        .map(|(from, (row, id, at))| {
            let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] + MIDDLE[axis]) as u64);
            Key { cell: ((x << 21 | z) << 14 | y) << 8 | cell(row.place) as u64, id: *id, from: from as u32 }
        })
        .collect();
    keys.par_sort_unstable();
    keys.par_iter().map(|key| key.from).collect()
}

impl Layout {
    /// Blocks of grains in the order of [`order`]; neighbours are not found yet.
    pub fn new(rows: &mut [Row], at: &[At], ahead: f32) -> Self {
        let mut layout = Self { homes: vec![Home { block: NONE, rank: 0 }; at.len()], ..Self::default() };
        let is_first = |slot: &usize| *slot == 0 || at[*slot] != at[slot - 1];
        let mut firsts: Vec<usize> = (0..at.len()).into_par_iter().filter(is_first).collect();
        firsts.push(at.len());
        for run in firsts.windows(2) {
            let block = layout.block(at[run[0]]);
            layout.blocks[block as usize].members.extend(run[0] as u32..run[1] as u32);
            layout.homes[run[0]..run[1]].fill(Home { block, rank: 0 });
        }
        layout.rank_members(rows, ahead, |_| true);
        layout
    }

    /// The block at an index; a new one where there is none yet.
    pub fn block(&mut self, at: At) -> u32 {
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
            limit: 0.0,
            is_awake: false,
            is_reached: false,
            has_strayed: true,
            is_changed: true,
            is_stirred: false,
            lacks_touches: true,
            is_due: false,
            lacks_pairs: true,
            is_found: false,
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

    /// Moves members of blocks that have strayed to the blocks that they are in, and sorts the members of every block that
    /// changed.
    pub fn follow(&mut self, rows: &mut [Row], ahead: f32) {
        let shared = Shared::new(rows);
        let strayed = self.blocks.par_iter_mut().filter(|block| block.has_strayed);
        let movers: Vec<Vec<Mover>> = strayed
            .map(|block| {
                (block.is_changed, block.is_stirred) = (true, true);
                let (mut gone, at, near) = (Vec::new(), block.at, block.near);
                block.members.retain(|&slot| {
                    let mut now = at;
                    // SAFETY: a grain is a member of one block.
                    settle(unsafe { shared.get(slot as usize) }, &mut now);
                    if now != at {
                        gone.push(Mover { slot, at: now, block: beside(at, &near, now) });
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
            if holds(at) {
                let block = if block == NONE { self.block(at) } else { block };
                self.homes[slot as usize].block = block;
                let block = &mut self.blocks[block as usize];
                block.members.push(slot);
                (block.is_changed, block.is_stirred) = (true, true);
                if !block.has_strayed {
                    let place = anchor(&rows[slot as usize], ahead, block.skin);
                    block.anchors.iter_mut().zip(place).for_each(|(anchors, place)| {
                        anchors.insert(anchors.len() - LANES.min(anchors.len()), place);
                    });
                }
            }
        }
        self.rank_members(rows, ahead, |block| block.is_changed && block.is_stirred);
    }

    /// Sorts the members of some blocks.
    fn rank_members(&mut self, rows: &mut [Row], ahead: f32, which: impl Fn(&Block) -> bool + Sync) {
        let rows = &*rows;
        let homes = Shared::new(&mut self.homes);
        let changed = self.blocks.par_iter_mut().filter(|block| which(block));
        changed.for_each_init(Ranking::default, |Ranking { places, members }, block| {
            if block.has_strayed {
                let square = |&slot: &u32| {
                    let velocity = rows[slot as usize].velocity;
                    dot(velocity, velocity)
                };
                let fastest = block.members.iter().map(square).fold(0.0, f32::max).sqrt();
                block.skin = if fastest * ahead / SUB_STEPS_AHEAD > FAST { THIN_SKIN } else { SKIN };
            }
            let place = |member: usize, slot: u32| {
                if block.has_strayed {
                    anchor(&rows[slot as usize], ahead, block.skin)
                } else {
                    [0, 1, 2].map(|axis: usize| block.anchors[axis][member])
                }
            };
            places.clear();
            places.extend(block.members.iter().enumerate().map(|(member, &slot)| {
                let place = place(member, slot);
                (place, cell(place) as u32)
            }));
            // Counted into cells; in a cell they keep their order.
            let mut starts = [0u32; ALL_CELLS + 1];
            places.iter().for_each(|(_, cell)| starts[*cell as usize + 1] += 1);
            (0..ALL_CELLS).for_each(|cell| starts[cell + 1] += starts[cell]);
            let mut next = starts;
            let count = places.len();
            members.clear();
            members.resize(count, 0);
            block.anchors.iter_mut().for_each(|anchors| {
                anchors.clear();
                anchors.resize(count + LANES, f32::INFINITY);
            });
            let [xs, ys, zs] = &mut block.anchors;
            for ((place, cell), &slot) in places.iter().zip(&block.members) {
                let at = next[*cell as usize] as usize;
                next[*cell as usize] += 1;
                members[at] = slot;
                (xs[at], ys[at], zs[at]) = (place[0], place[1], place[2]);
            }
            for (member, &slot) in (0..).zip(&*members) {
                // SAFETY: a grain is a member of one block.
                unsafe { homes.get(slot as usize).rank = member };
            }
            block.starts = starts;
            block.members.copy_from_slice(members);
            block.is_awake = block.members.iter().any(|&slot| !rows[slot as usize].rests());
            block.has_strayed = false;
            block.lacks_touches = true;
        });
    }

    /// Marks the blocks whose contacts can matter: those that are awake, and their neighbours; all of them on request.
    pub fn reach(&mut self, all: bool) {
        let awake: Vec<bool> = self.blocks.par_iter().map(|block| block.is_awake).collect();
        let is_awake = |&block: &u32| block != NONE && awake[block as usize];
        self.blocks
            .par_iter_mut()
            .for_each(|block| block.is_reached = all || block.near.iter().any(is_awake));
    }

    /// Columns with blocks that are reached in four sets: of two columns of one set neither is the other's neighbour.
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

/// Working memory of one thread that sorts the members of blocks.
#[derive(Default)]
struct Ranking {
    /// Of each member, with its cell.
    places: Vec<(V, u32)>,
    members: Vec<u32>,
}

/// Where a grain is taken to be while its neighbours last: a little ahead of it, so that it takes longer to stray. `ahead` is how
/// far (diameters) it would go at 1 m/s.
fn anchor(row: &Row, ahead: f32, skin: f32) -> V {
    // Less than half of the skin.
    let most = 0.45 * skin;
    let way = scaled(row.velocity, ahead);
    let length = norm(way);
    let share = if length > most { most / length } else { 1.0 };
    let place = add(row.place, scaled(way, share));
    place.map(|x| x.clamp(0.0, EDGE))
}

/// For how many sub-steps neighbours are to last.
pub const SUB_STEPS_AHEAD: f32 = 6.0;
/// How far (diameters) a grain goes in a sub-step for which a thin skin is the cheaper one: some grain near it strays in every
/// sub-step then, and takes its neighbours' pairs along.
const FAST: f32 = 0.06;

/// Moves a grain to the block that its place lies in.
pub fn settle(row: &mut Row, at: &mut At) {
    for axis in 0..3 {
        let (place, since, at) = (&mut row.place[axis], &mut row.since[axis], &mut at[axis]);
        let blocks = (*place / EDGE).floor();
        if blocks != 0.0 {
            *at = at.saturating_add(blocks as i32);
            *place -= blocks * EDGE;
            *since -= blocks * EDGE;
            // A place just below 0 becomes the edge itself.
            if *place >= EDGE {
                *at = at.saturating_add(1);
                *place = 0.0;
                *since -= EDGE;
            }
        }
        // So near 0 that it or an eighth of it counts as 0 where denormal numbers do.
        if *place <= 0.0 {
            *place = 0.0;
        }
    }
}

/// World position (m) of a place in a block.
pub fn world(at: At, place: V, diameter: f64) -> DVec3 {
    DVec3::from(
        [0, 1, 2].map(|axis| (f64::from(at[axis]) * f64::from(EDGE) + f64::from(place[axis])) * diameter),
    )
}

/// Block and place of a world position (m).
pub fn locate(world: DVec3, diameter: f64) -> (At, V) {
    let mut row = Row::default();
    let mut at = [0; 3];
    for axis in 0..3 {
        let place = world[axis] / diameter;
        let block = (place / f64::from(EDGE)).floor();
        at[axis] = block as i32;
        row.place[axis] = (place - block * f64::from(EDGE)) as f32;
    }
    settle(&mut row, &mut at);
    (at, row.place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::cpu::FlushDenormals;

    #[test]
    fn every_place_settles_in_a_block() {
        for place in [-6.0e-38, -1.0e-45, -1.0e-8, -0.0, 0.0, 7.999_999_5, 8.0, -8.0, -8.1, 31.0, -1.0e6] {
            let mut row = Row { place: [place; 3], since: [place; 3], ..Row::default() };
            let mut at = [3; 3];
            let flush = FlushDenormals::begin();
            settle(&mut row, &mut at);
            drop(flush);
            assert!(row.place.iter().all(|x| (0.0..EDGE).contains(x)), "{place} becomes {:?}", row.place);
            let whole = f64::from(at[0] - 3) * f64::from(EDGE) + f64::from(row.place[0]);
            assert!((whole - f64::from(place)).abs() < 1.0e-6, "{place} becomes {whole}");
        }
    }
}
