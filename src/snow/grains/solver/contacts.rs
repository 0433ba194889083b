//! Pairs of grains that touch or may soon, each with the impulse that it carries from sub-step to sub-step.
//!
//! The pairs of a block are found again when a grain in or near it is half the skin away from its anchor; as pairs are found
//! between anchors, none is missed before. They are solved eight at a time: the pairs of a *batch* share no grain, and every
//! pair is solved after the earlier pairs that share a grain with it, so that the result is that of one pair after the other.

use std::sync::LazyLock;

use rayon::prelude::*;

use super::blocks::{ALL_CELLS, Block, CELLS, EDGE, Home, NONE};
use super::layout::Layout;
use super::pairs::{Batch, PairImpulse, SLOT_BITS, slot_of};
use super::rows::{Row, V, norm, sub};
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::{LANES, Lanes};
use crate::numeric::lists::reset;

/// Maximum number of grains.
pub const MAX_GRAINS: usize = 1 << SLOT_BITS;

/// A pair that was found.
#[derive(Clone, Copy)]
struct Pair {
    code: u32,
    /// Index of the other grain among the members of the owner's block and the earlier ones around it.
    local: u32,
    impulse: V,
}

/// Scratch memory of one thread.
#[derive(Default)]
struct Scratch {
    /// Index of each member's first pair, then the count of pairs.
    starts: Vec<u32>,
    /// Pairs by owner.
    pairs: Vec<Pair>,
    /// For each grain around, the index after the last batch that contains it.
    first_allowed: Vec<u32>,
    /// Count of pairs in each batch.
    counts: Vec<u8>,
    /// For each batch its own index if it is not full, else that of a later batch to try.
    next_free: Vec<u32>,
}

/// The upper bits of a code: a step of -1 to 1 along each axis.
fn step_bits(step: [i32; 3]) -> u32 {
    let [x, y, z] = step.map(|step| (step + 1) as u32);
    (z << 4 | y << 2 | x) << SLOT_BITS
}

impl Layout {
    /// Keeps the impulses of the last step until their pairs are found.
    pub fn keep_impulses(&mut self, held: Vec<PairImpulse>) {
        let mut kept: Vec<(u32, PairImpulse)> =
            held.into_par_iter().filter_map(|held| self.with_owner(held)).collect();
        kept.par_sort_unstable_by_key(|(block, held)| (*block, held.grains));
        self.kept = kept;
    }

    /// Finds the pairs of the reached blocks that lack them because they, or earlier blocks around them, changed. Impulses are
    /// taken over from the old pairs and from the last step.
    pub fn find_pairs(&mut self) {
        let changed: Vec<bool> = self.blocks.par_iter().map(|block| block.is_changed).collect();
        let is_changed = |block: &u32| *block != NONE && changed[*block as usize];
        self.blocks.par_iter_mut().for_each(|block| {
            block.lacks_pairs |=
                block.is_changed || EARLIER.iter().any(|&code| is_changed(&block.near[code]));
            block.is_changed = false;
        });
        let blocks = &self.blocks;
        let is_listed: Vec<bool> =
            blocks.par_iter().map(|block| block.lacks_pairs && block.is_reached).collect();
        if !is_listed.contains(&true) {
            return;
        }
        let moved = self.moved(&is_listed);
        fn of_block(all: &[(u32, PairImpulse)], block: u32) -> impl Iterator<Item = PairImpulse> {
            let first = all.partition_point(|(of, _)| *of < block);
            all[first..].iter().take_while(move |(of, _)| *of == block).map(|(_, held)| *held)
        }
        let (homes, has_moved, kept) = (&self.homes, self.has_ever_moved, &self.kept);
        let listed = self.batches.par_iter_mut().enumerate().filter(|(index, _)| is_listed[*index]);
        listed.for_each_init(Scratch::default, |scratch, (index, batches)| {
            find(scratch, blocks, index);
            let block = &blocks[index];
            let mut carry = |[a, b]: [u32; 2], homes: [Home; 2], impulse: V| {
                let _ = scratch.carry(homes[0].rank, b, impulse)
                    || homes[1].block == index as u32
                        && scratch.carry(homes[1].rank, a, [-impulse[0], -impulse[1], -impulse[2]]);
            };
            for batch in &*batches {
                batch.for_each_impulse(|grains, code, impulse| {
                    let homes = [homes[grains[0] as usize], homes[grains[1] as usize]];
                    if !has_moved || block.still_owns(homes, code, index) {
                        carry(grains, homes, impulse);
                    }
                });
            }
            let kept = if block.has_found_pairs { &[] } else { &kept[..] };
            for held in of_block(kept, index as u32).chain(of_block(&moved, index as u32)) {
                let homes = held.grains.map(|grain| homes[grain as usize]);
                if homes[0].block == index as u32 {
                    carry(held.grains, homes, held.impulse);
                }
            }
            scratch.schedule(&block.members, batches);
        });
        self.blocks.par_iter_mut().zip(is_listed).filter(|(_, is_listed)| *is_listed).for_each(
            |(block, _)| {
                (block.lacks_pairs, block.has_found_pairs) = (false, true);
            },
        );
    }

    /// The block that owns a pair, and the impulse with that block's grain first; none if a grain has left.
    fn with_owner(&self, held: PairImpulse) -> Option<(u32, PairImpulse)> {
        let level = |block: u32| {
            let [x, y, z] = self.blocks[block as usize].at;
            [y, x, z]
        };
        let [a, b] = held.grains.map(|grain| self.homes[grain as usize].block);
        if a == NONE || b == NONE {
            None
        } else if a == b || level(a) > level(b) {
            Some((a, held))
        } else {
            Some((b, held.swapped()))
        }
    }

    /// Impulses of the pairs whose grains have just changed blocks, sorted by the block that owns them now.
    fn moved(&self, is_listed: &[bool]) -> Vec<(u32, PairImpulse)> {
        if !self.has_moved {
            return Vec::new();
        }
        let listed = self.batches.par_iter().enumerate().filter(|(index, _)| is_listed[*index]);
        let moved = listed.flat_map_iter(|(index, batches)| {
            let mut gone = Vec::new();
            for batch in batches {
                batch.for_each_impulse(|grains, code, impulse| {
                    let homes = [self.homes[grains[0] as usize], self.homes[grains[1] as usize]];
                    if !self.blocks[index].still_owns(homes, code, index) {
                        gone.extend(self.with_owner(PairImpulse { grains, impulse }));
                    }
                });
            }
            gone
        });
        let mut moved: Vec<(u32, PairImpulse)> = moved.collect();
        moved.par_sort_unstable_by_key(|(block, held)| (*block, held.grains));
        moved
    }

    /// Overlaps (diameters) of touching pairs.
    pub fn overlaps(&self, rows: &[Row]) -> Vec<f32> {
        let pairs = self.batches.iter().flatten().flat_map(|batch| {
            batch.lanes().map(|lane| {
                let (row, other) = (rows[batch.owners[lane] as usize], rows[batch.others()[lane] as usize]);
                let shift = batch.shift().map(|shift| shift.0[lane]);
                1.0 - norm(sub(sub(row.position, shift), other.position))
            })
        });
        pairs.filter(|overlap| *overlap > -0.02).map(|overlap| overlap.max(0.0)).collect()
    }

    /// The impulses of all pairs, sorted by slots: the same whether a pair was found in this step or kept. Pairs are freed block by block,
    /// so that both need not be in memory at once.
    pub fn take_impulses(&mut self) -> Vec<PairImpulse> {
        let batches = std::mem::take(&mut self.batches);
        let kept = std::mem::take(&mut self.kept);
        let found = batches
            .into_par_iter()
            .flat_map_iter(|batches| batches.iter().flat_map(Batch::held).collect::<Vec<_>>());
        let is_kept = |(block, _): &(u32, PairImpulse)| !self.blocks[*block as usize].has_found_pairs;
        let all = found.chain(kept.into_par_iter().filter(is_kept).map(|(_, held)| held));
        let mut held: Vec<PairImpulse> = all.map(PairImpulse::in_order).collect();
        held.par_sort_unstable_by_key(|held| held.grains);
        held
    }
}

/// A range of cells of a block along z whose grains may be near those of a cell.
#[derive(Clone, Copy)]
struct Cells {
    /// Step to the block.
    step: [i8; 3],
    first: u8,
    end: u8,
}

/// For each cell of a block, the cells whose grains may form pairs with its own: in the same block the adjacent ones before it
/// (ordered by y, x, z) but not itself, in earlier blocks all adjacent ones.
static NEAR_CELLS: LazyLock<Vec<Vec<Cells>>> = LazyLock::new(|| {
    let cells = CELLS as i32;
    let near = |cell: i32| {
        let [y, x, z] = [cell / (cells * cells), cell / cells % cells, cell % cells];
        let mut out = Vec::new();
        for (dy, dx) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dy, dx))) {
            let (there_x, there_y) = (x + dx, y + dy);
            let row = (there_y.rem_euclid(cells) * cells + there_x.rem_euclid(cells)) * cells;
            let [step_x, step_y] = [there_x, there_y].map(|at| at.div_euclid(cells));
            for step_z in -1..=1 {
                let (first, last) =
                    ((z - 1 - step_z * cells).max(0), (z + 1 - step_z * cells).min(cells - 1));
                let order = [step_y, step_x, step_z].cmp(&[0; 3]).then([dy, dx].cmp(&[0; 2]));
                let end = if [step_x, step_y, step_z, dx, dy] == [0; 5] { z } else { last + 1 };
                if first < end && (order.is_lt() || [step_x, step_y, step_z, dx, dy] == [0; 5]) {
                    let step = [step_x, step_y, step_z].map(|step| step as i8);
                    out.push(Cells { step, first: (row + first) as u8, end: (row + end) as u8 });
                }
            }
        }
        out
    };
    (0..ALL_CELLS as i32).map(near).collect()
});

/// The earlier blocks around a block (by y, x, z), as indices in [`Block::near`].
const EARLIER: [usize; 13] = [0, 1, 2, 9, 10, 11, 18, 19, 20, 3, 4, 5, 12];

impl Block {
    /// Whether the block still owns a pair: neither grain has changed blocks.
    #[inline(always)]
    fn still_owns(&self, homes: [Home; 2], code: usize, index: usize) -> bool {
        homes[0].block == index as u32 && homes[1].block == self.near[code]
    }

    /// Maximum distance (diameters) between the anchors of a pair formed by a member of this block and one of `other`.
    fn reach_to(&self, other: &Self) -> f32 {
        1.0 + 0.5 * (self.skin + other.skin)
    }
}

/// A range of members of a block that may be near a grain.
struct Run<'a> {
    block: &'a Block,
    low: u32,
    high: u32,
    /// Maximum distance (diameters) between the anchors of a pair.
    reach: f32,
    /// From the owner's block to this one (diameters).
    shift: V,
    bits: u32,
    /// Index of this block's first member among those around.
    first: u32,
}

fn find(scratch: &mut Scratch, blocks: &[Block], index: usize) {
    dispatch!(find_in(scratch: &mut Scratch, blocks: &[Block], index: usize))
}

/// Finds the pairs that a block owns.
#[inline(always)]
fn find_in(scratch: &mut Scratch, blocks: &[Block], index: usize) {
    let block = &blocks[index];
    let mut around: [Option<&Block>; 27] = [None; 27];
    let mut firsts = [0; 27];
    let mut total = 0;
    // Its own members come first.
    for code in [13].into_iter().chain(EARLIER) {
        if block.near[code] != NONE {
            around[code] = Some(&blocks[block.near[code] as usize]);
        }
        firsts[code] = total;
        total += around[code].map_or(0, |block| block.members.len() as u32);
    }
    scratch.starts.clear();
    scratch.starts.push(0);
    scratch.pairs.clear();
    reset(&mut scratch.first_allowed, total as usize, 0);
    let mut runs: Vec<Run<'_>> = Vec::with_capacity(16);
    for cell in 0..ALL_CELLS {
        let own = block.starts[cell]..block.starts[cell + 1];
        if own.is_empty() {
            continue;
        }
        runs.clear();
        for cells in &NEAR_CELLS[cell] {
            let step = [i32::from(cells.step[0]), i32::from(cells.step[1]), i32::from(cells.step[2])];
            let code = ((step[0] + 1) * 9 + (step[1] + 1) * 3 + step[2] + 1) as usize;
            let Some(there) = around[code] else { continue };
            let (low, high) = (there.starts[usize::from(cells.first)], there.starts[usize::from(cells.end)]);
            if low < high {
                let shift = [step[0] as f32 * EDGE, step[1] as f32 * EDGE, step[2] as f32 * EDGE];
                let reach = block.reach_to(there);
                let (bits, first) = (step_bits(step), firsts[code]);
                runs.push(Run { block: there, low, high, reach, shift, bits, first });
            }
        }
        // The earlier members of the grain's own cell.
        let mut before = Run {
            block,
            low: own.start,
            high: own.start,
            reach: block.reach_to(block),
            shift: [0.0; 3],
            bits: step_bits([0; 3]),
            first: 0,
        };
        for owner in own {
            let [xs, ys, zs] = &block.anchors;
            let position = [xs[owner as usize], ys[owner as usize], zs[owner as usize]];
            for run in &runs {
                scan(position, run, &mut scratch.pairs);
            }
            before.high = owner;
            scan(position, &before, &mut scratch.pairs);
            scratch.starts.push(scratch.pairs.len() as u32);
        }
    }
}

/// Adds the pairs of a grain with members of a run.
#[inline(always)]
fn scan(position: V, run: &Run<'_>, pairs: &mut Vec<Pair>) {
    let reach = Lanes::all(run.reach * run.reach);
    let [x, y, z] = sub(position, run.shift);
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

/// Eight numbers, starting at `first`.
#[inline(always)]
fn eight(numbers: &[f32], first: u32) -> Lanes {
    let mut out = [0.0; LANES];
    out.copy_from_slice(&numbers[first as usize..first as usize + LANES]);
    Lanes(out)
}

impl Scratch {
    /// Sets the impulse of the pair of an owner (rank) and a partner (slot); returns whether it exists.
    #[inline(always)]
    fn carry(&mut self, owner: u32, partner: u32, impulse: V) -> bool {
        let owned = self.starts[owner as usize] as usize..self.starts[owner as usize + 1] as usize;
        for pair in &mut self.pairs[owned] {
            if slot_of(pair.code) == partner {
                pair.impulse = impulse;
                return true;
            }
        }
        false
    }

    /// Puts each pair into the first batch with a free lane after those of its grains' earlier pairs.
    fn schedule(&mut self, members: &[u32], batches: &mut Vec<Batch>) {
        let Self { starts, pairs, first_allowed, counts, next_free } = self;
        counts.clear();
        next_free.clear();
        batches.clear();
        for (member, &slot) in members.iter().enumerate() {
            for pair in &pairs[starts[member] as usize..starts[member + 1] as usize] {
                let first = first_allowed[member].max(first_allowed[pair.local as usize]) as usize;
                let mut at = first;
                while at < next_free.len() && next_free[at] as usize != at {
                    at = next_free[at] as usize;
                }
                let mut through = first;
                while through < at {
                    through = std::mem::replace(&mut next_free[through], at as u32) as usize;
                }
                if at == batches.len() {
                    next_free.push(at as u32);
                    counts.push(0);
                    // All lanes: unused ones repeat the first pair.
                    let (owners, codes) = ([slot; LANES], [pair.code; LANES]);
                    batches.push(Batch { owners, codes, impulse: pair.impulse.map(Lanes::all) });
                }
                let (lane, batch) = (usize::from(counts[at]), &mut batches[at]);
                (batch.owners[lane], batch.codes[lane]) = (slot, pair.code);
                (0..3).for_each(|axis| batch.impulse[axis].0[lane] = pair.impulse[axis]);
                counts[at] += 1;
                if counts[at] == LANES as u8 {
                    next_free[at] = at as u32 + 1;
                }
                first_allowed[member] = at as u32 + 1;
                first_allowed[pair.local as usize] = at as u32 + 1;
            }
        }
        if batches.capacity() > batches.len() + batches.len() / 4 + 4 {
            batches.shrink_to_fit();
        }
    }
}
