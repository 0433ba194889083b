//! Pairs of grains that touch or may soon, each with the impulse that it carries from sub-step to sub-step.
//!
//! The pairs of a block are found when a grain near it has moved by half the skin, from where grains were then (`anchors`), so that
//! no pair is missed before. They are solved eight at a time: a *batch* has eight pairs that share no grain, and every pair comes
//! after those before it in the sweep that have a grain in common with it, so that the result is that of one pair after the other.

use rayon::prelude::*;

use super::layout::{ALL_CELLS, Block, CELLS, EDGE, Layout, NONE};
use super::rows::{Row, Shared, V, norm, sub};
use crate::base::cpu::dispatch;
use crate::base::lanes::{LANES, Lanes};

/// Distance (diameters) up to which a pair of grains is kept beyond touching: pairs are found again once a grain has moved half
/// of it. Less than a cell less a diameter.
pub const SKIN: f32 = 0.25;

/// Bits of a grain's index; above them from which block the other grain of a pair is, two bits an axis.
const INDEX: u32 = 26;
/// Most grains.
pub const MOST: usize = 1 << INDEX;

/// Eight pairs without a common grain. Lanes that are left over repeat the first one.
#[derive(Clone, Copy, Default)]
pub struct Batch {
    /// The grains that own them: of each pair the one that lies higher, or farther along x, then z.
    pub owners: [u32; LANES],
    /// The other grains, and above their bits from which block.
    codes: [u32; LANES],
    /// Impulses (m/s, of a grain of unit mass) on the owners.
    pub impulse: [Lanes; 3],
}

/// The impulse of a pair between two steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Its grains.
    pub grains: [u32; 2],
    /// On the first one (m/s).
    pub impulse: V,
}

/// A pair that was found.
#[derive(Clone, Copy)]
struct Pair {
    code: u32,
    /// Number of the other grain among the members of the blocks around the owner's.
    local: u32,
    impulse: V,
}

/// The pairs of a block by owner.
pub struct Found {
    /// Where each member's pairs begin, and how many there are.
    starts: Vec<u32>,
    pairs: Vec<Pair>,
}

impl Batch {
    /// The other grains.
    #[inline(always)]
    pub fn others(&self) -> [u32; LANES] {
        let mut others = self.codes;
        for code in &mut others {
            *code = other(*code);
        }
        others
    }

    /// From the owner's block to the other's (diameters).
    #[inline(always)]
    pub fn shift(&self) -> [Lanes; 3] {
        let mut shift = [Lanes::default(); 3];
        for (axis, shift) in shift.iter_mut().enumerate() {
            for (lane, shift) in shift.0.iter_mut().enumerate() {
                *shift = ((self.codes[lane] >> (INDEX + 2 * axis as u32) & 3) as i32 - 1) as f32 * EDGE;
            }
        }
        shift
    }

    /// Its pairs that carry an impulse, each once.
    pub fn held(&self) -> impl Iterator<Item = Held> + '_ {
        let held = |lane: usize| Held {
            grains: [self.owners[lane], other(self.codes[lane])],
            impulse: [0, 1, 2].map(|axis: usize| self.impulse[axis].0[lane]),
        };
        self.lanes().map(held).filter(|held| held.impulse != [0.0; 3])
    }

    /// Lanes with a pair of their own.
    fn lanes(&self) -> impl Iterator<Item = usize> + '_ {
        let repeats = |lane: usize| self.owners[lane] == self.owners[0] && self.codes[lane] == self.codes[0];
        (0..LANES).filter(move |&lane| lane == 0 || !repeats(lane))
    }
}

/// The grain of a code.
#[inline(always)]
fn other(code: u32) -> u32 {
    code & ((1 << INDEX) - 1)
}

/// Bits for the block a step away, -1 to 1 along each axis.
fn step_bits(step: [i32; 3]) -> u32 {
    let [x, y, z] = step.map(|step| (step + 1) as u32);
    (z << 4 | y << 2 | x) << INDEX
}

impl Layout {
    /// Finds the pairs of blocks that changed and of those that may have pairs with their grains. What they carry, is taken from
    /// their old pairs, and from those of `held`.
    pub fn find_pairs(&mut self, held: &[Held]) {
        let blocks = &self.blocks;
        // Blocks below, and beside at the same level, may have given a block its pairs.
        let below = (0..27).filter(|code| code / 3 % 3 < 2).collect::<Vec<usize>>();
        let is_listed: Vec<bool> = blocks
            .par_iter()
            .map(|block| {
                let near = below.iter().map(|&code| block.near[code]);
                near.filter(|&other| other != NONE).any(|other| blocks[other as usize].is_changed)
            })
            .collect();
        let listed: Vec<u32> =
            (0..).zip(&is_listed).filter(|(_, is_listed)| **is_listed).map(|(index, _)| index).collect();
        let found: Vec<Found> = listed.par_iter().map(|&index| find(blocks, index as usize)).collect();
        for (&index, found) in listed.iter().zip(found) {
            self.blocks[index as usize].found = Some(found);
        }
        self.carry(&is_listed, held);
        self.blocks.par_iter_mut().for_each(|block| {
            if let Some(found) = block.found.take() {
                found.schedule(&block.members, &mut block.batches);
            }
            block.is_changed = false;
        });
    }

    /// Gives the pairs that were found the impulses of those that were there before.
    fn carry(&mut self, is_listed: &[bool], held: &[Held]) {
        let batches: Vec<Vec<Batch>> = self
            .blocks
            .iter_mut()
            .zip(is_listed)
            .map(|(block, is_listed)| if *is_listed { std::mem::take(&mut block.batches) } else { Vec::new() })
            .collect();
        let (of, rank) = (&self.of, &self.rank);
        let blocks = Shared::new(&mut self.blocks);
        let place = |owner: u32, partner: u32, impulse: V| {
            let block = of[owner as usize];
            if block == NONE {
                return false;
            }
            // SAFETY: two grains make one pair, whose impulse is set once; nothing else of a block changes.
            let Some(found) = (unsafe { &mut blocks.get(block as usize).found }) else { return false };
            let member = rank[owner as usize] as usize;
            let pairs = &mut found.pairs[found.starts[member] as usize..found.starts[member + 1] as usize];
            let pair = pairs.iter_mut().find(|pair| other(pair.code) == partner);
            let is_there = pair.is_some();
            pair.into_iter().for_each(|pair| pair.impulse = impulse);
            is_there
        };
        let hand_over = |held: &Held| {
            let [a, b] = held.grains;
            let _ = place(a, b, held.impulse) || place(b, a, held.impulse.map(|x| -x));
        };
        batches.par_iter().for_each(|batches| batches.iter().flat_map(Batch::held).for_each(|held| hand_over(&held)));
        held.par_iter().for_each(hand_over);
    }

    /// Overlaps (diameters) of the pairs that touch.
    pub fn overlaps(&self, rows: &[Row]) -> Vec<f32> {
        let pairs = self.blocks.iter().flat_map(|block| &block.batches).flat_map(|batch| {
            batch.lanes().map(|lane| {
                let (row, other) = (rows[batch.owners[lane] as usize], rows[batch.others()[lane] as usize]);
                let shift = batch.shift().map(|shift| shift.0[lane]);
                1.0 - norm(sub(sub(row.place, shift), other.place))
            })
        });
        pairs.filter(|overlap| *overlap > -0.02).map(|overlap| overlap.max(0.0)).collect()
    }

    /// What all pairs carry.
    pub fn held(&self) -> Vec<Held> {
        self.blocks.par_iter().flat_map_iter(|block| block.batches.iter().flat_map(Batch::held)).collect()
    }
}

/// Members of a block one behind the other that may be near a grain.
struct Run<'a> {
    block: &'a Block,
    low: u32,
    high: u32,
    /// From the owner's block to this one (diameters).
    shift: V,
    bits: u32,
    /// Number of this block's first member among those around.
    first: u32,
}

fn find(blocks: &[Block], index: usize) -> Found {
    dispatch!(find_pairs(blocks: &[Block], index: usize) -> Found)
}

/// The pairs of a block: for each of its cells, those with grains in cells below, then before along x, then along z.
#[inline(always)]
fn find_pairs(blocks: &[Block], index: usize) -> Found {
    let block = &blocks[index];
    let around: [Option<&Block>; 27] =
        block.near.map(|other| if other == NONE { None } else { Some(&blocks[other as usize]) });
    let mut firsts = [0; 27];
    let mut total = 0;
    // Its own members come first.
    for code in std::iter::once(13).chain((0..27).filter(|code| *code != 13)) {
        firsts[code] = total;
        total += around[code].map_or(0, |block| block.members.len() as u32);
    }
    let run = |step: [i32; 3], cells: std::ops::Range<usize>| {
        let code = ((step[0] + 1) * 9 + (step[1] + 1) * 3 + step[2] + 1) as usize;
        let block = around[code]?;
        let (low, high) = (block.starts[cells.start], block.starts[cells.end]);
        let run = Run {
            block,
            low,
            high,
            shift: step.map(|step| step as f32 * EDGE),
            bits: step_bits(step),
            first: firsts[code],
        };
        (low < high).then_some(run)
    };
    let mut found = Found {
        starts: Vec::with_capacity(block.members.len() + 1),
        pairs: Vec::with_capacity(5 * block.members.len()),
    };
    found.starts.push(0);
    let mut runs: Vec<Run<'_>> = Vec::with_capacity(16);
    for cell in 0..ALL_CELLS {
        let own = block.starts[cell]..block.starts[cell + 1];
        if own.is_empty() {
            continue;
        }
        let [y, x, z] = [cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS];
        runs.clear();
        for [dy, dx] in [[-1, -1], [-1, 0], [-1, 1], [0, -1]] {
            let cells = CELLS as i32;
            let (there_x, there_y) = (x as i32 + dx, y as i32 + dy);
            let step = [there_x.div_euclid(cells), there_y.div_euclid(cells)];
            let row = (there_y.rem_euclid(cells) * cells + there_x.rem_euclid(cells)) as usize * CELLS;
            if z == 0 {
                runs.extend(run([step[0], step[1], -1], row + CELLS - 1..row + CELLS));
            }
            runs.extend(run([step[0], step[1], 0], row + z.max(1) - 1..row + (z + 2).min(CELLS)));
            if z == CELLS - 1 {
                runs.extend(run([step[0], step[1], 1], row..row + 1));
            }
        }
        if z == 0 {
            let row = (y * CELLS + x) * CELLS;
            runs.extend(run([0, 0, -1], row + CELLS - 1..row + CELLS));
        }
        // What comes before a grain in its own cell and in the one before.
        let mut before = run([0; 3], cell - usize::from(z > 0)..cell + 1);
        for owner in own {
            let place = [0, 1, 2].map(|axis| block.anchors[axis][owner as usize]);
            runs.iter().for_each(|run| scan(place, run, &mut found.pairs));
            if let Some(before) = &mut before {
                before.high = owner;
                scan(place, before, &mut found.pairs);
            }
            found.starts.push(found.pairs.len() as u32);
        }
    }
    found
}

/// Adds the pairs of a grain with those of a run.
#[inline(always)]
fn scan(place: V, run: &Run<'_>, pairs: &mut Vec<Pair>) {
    let reach = Lanes::all((1.0 + SKIN) * (1.0 + SKIN));
    let [x, y, z] = sub(place, run.shift);
    let [xs, ys, zs] = &run.block.anchors;
    let mut member = run.low;
    while member < run.high {
        let x = Lanes::all(x) - eight(xs, member);
        let y = Lanes::all(y) - eight(ys, member);
        let z = Lanes::all(z) - eight(zs, member);
        let square = x * x + y * y + z * z;
        let mut near = square.is_less(reach).bits();
        if run.high - member < LANES as u32 {
            near &= (1 << (run.high - member)) - 1;
        }
        while near != 0 {
            let at = member + near.trailing_zeros();
            let code = run.bits | run.block.members[at as usize];
            pairs.push(Pair { code, local: run.first + at, impulse: [0.0; 3] });
            near &= near - 1;
        }
        member += LANES as u32;
    }
}

/// Eight numbers from one on.
#[inline(always)]
fn eight(numbers: &[f32], first: u32) -> Lanes {
    let mut out = [0.0; LANES];
    out.copy_from_slice(&numbers[first as usize..first as usize + LANES]);
    Lanes(out)
}

impl Found {
    /// Puts the pairs into batches, each into the first one with room behind those of its grains' earlier pairs.
    fn schedule(self, members: &[u32], batches: &mut Vec<Batch>) {
        let locals = self.pairs.iter().map(|pair| pair.local + 1).max().unwrap_or(0).max(members.len() as u32);
        const APART: usize = 1;
        // The batch behind the last one of each grain.
        let mut behind = vec![0u32; locals as usize];
        let mut counts: Vec<u8> = Vec::new();
        // A batch with room at or behind each.
        let mut room: Vec<u32> = Vec::new();
        batches.clear();
        batches.reserve_exact(self.pairs.len().div_ceil(LANES) + 8);
        for (member, &slot) in members.iter().enumerate() {
            for pair in &self.pairs[self.starts[member] as usize..self.starts[member + 1] as usize] {
                let least = behind[member].max(behind[pair.local as usize]) as usize;
                let mut at = least;
                while at < room.len() && room[at] as usize != at {
                    at = room[at] as usize;
                }
                let mut through = least;
                while through < at {
                    through = std::mem::replace(&mut room[through], at as u32) as usize;
                }
                while at >= batches.len() {
                    room.push(batches.len() as u32);
                    counts.push(0);
                    batches.push(Batch::default());
                }
                let lane = usize::from(counts[at]);
                let batch = &mut batches[at];
                (batch.owners[lane], batch.codes[lane]) = (slot, pair.code);
                (0..3).for_each(|axis| batch.impulse[axis].0[lane] = pair.impulse[axis]);
                counts[at] += 1;
                if counts[at] == LANES as u8 {
                    room[at] = at as u32 + 1;
                }
                behind[member] = (at + APART) as u32;
                behind[pair.local as usize] = (at + APART) as u32;
            }
        }
        for (batch, count) in batches.iter_mut().zip(&mut counts) {
            for lane in usize::from(*count).max(1)..LANES {
                (batch.owners[lane], batch.codes[lane]) = (batch.owners[0], batch.codes[0]);
                batch.impulse.iter_mut().for_each(|impulse| impulse.0[lane] = impulse.0[0]);
            }
        }
        let mut counts = counts.iter();
        batches.retain(|_| counts.next().is_some_and(|count| *count > 0));
        batches.shrink_to_fit();
    }
}
