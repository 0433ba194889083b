//! Pairs of grains that touch or may soon, each with the impulses that it carried in the last sub-step.

use rayon::prelude::*;

use super::layout::{ALL_CELLS, CELLS, EDGE, Layout};
use super::rows::{Row, V, add, dot, norm, scaled, sub};

/// Distance (diameters) up to which a pair of grains is kept beyond touching: pairs are found again once a grain has moved half
/// of it. Less than a cell less a diameter.
pub const SKIN: f32 = 0.25;

/// A pair: the grain that owns it lies higher, or earlier along x, then z.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// The other grain, and in bits 27..32 from which block it is.
    pub code: u32,
    /// Impulse along the line from the other grain (m/s, of a grain of unit mass).
    pub normal: f32,
    /// Impulse across it (m/s).
    pub across: V,
}

/// Bits of a grain's index.
const INDEX: u32 = 27;
/// Most grains.
pub const MOST: usize = 1 << INDEX;

/// In place of a grain's index: it was left out.
pub const GONE: u32 = u32::MAX;

impl Pair {
    fn new(other: u32, steps: [i32; 3]) -> Self {
        let [x, y, z] = steps.map(|step| (step + 1) as u32);
        Self { code: (x * 9 + y * 3 + z) << INDEX | other, normal: 0.0, across: [0.0; 3] }
    }

    /// The other grain.
    #[inline(always)]
    pub fn other(self) -> usize {
        (self.code & ((1 << INDEX) - 1)) as usize
    }

    /// From the owner's block to the other's (diameters).
    #[inline(always)]
    pub fn shift(self) -> V {
        SHIFTS[(self.code >> INDEX) as usize]
    }
}

/// Offsets of neighbouring blocks (diameters), by code.
const SHIFTS: [V; 32] = {
    let mut out = [[0.0; 3]; 32];
    let values = [-EDGE, 0.0, EDGE];
    let mut x = 0;
    while x < 3 {
        let mut y = 0;
        while y < 3 {
            let mut z = 0;
            while z < 3 {
                out[x * 9 + y * 3 + z] = [values[x], values[y], values[z]];
                z += 1;
            }
            y += 1;
        }
        x += 1;
    }
    out
};

/// The pairs of all grains.
#[derive(Clone, Default)]
pub struct Contacts {
    /// Where each grain's pairs begin, and one more.
    pub starts: Vec<u32>,
    /// The pairs, by owner: its neighbours below come first.
    pub pairs: Vec<Pair>,
}

/// Cells that come before a grain's own: below it, then along x, then z.
const BEFORE: [[i32; 3]; 13] = [
    [-1, -1, -1],
    [-1, -1, 0],
    [-1, -1, 1],
    [0, -1, -1],
    [0, -1, 0],
    [0, -1, 1],
    [1, -1, -1],
    [1, -1, 0],
    [1, -1, 1],
    [-1, 0, -1],
    [-1, 0, 0],
    [-1, 0, 1],
    [0, 0, -1],
];

impl Contacts {
    /// Finds the pairs of sorted grains; `slots` says where each went that was there before, [`GONE`] where it was left out. What
    /// pairs that have parted still carried is taken from their grains.
    pub fn find(&mut self, layout: &Layout, rows: &mut [Row], slots: &[u32]) {
        let old = std::mem::take(self);
        let parts: Vec<(Vec<u32>, Vec<Pair>)> =
            layout.blocks.par_iter().map(|block| pairs_of(layout, block, &*rows)).collect();
        self.starts = Vec::with_capacity(rows.len() + 1);
        self.starts.push(0);
        let mut total = 0;
        for (counts, _) in &parts {
            for count in counts {
                total += count;
                self.starts.push(total);
            }
        }
        self.pairs = parts.into_par_iter().flat_map_iter(|(_, pairs)| pairs).collect();
        if !old.pairs.is_empty() {
            self.carry(&old, slots, layout, rows);
        }
    }

    /// Takes over the impulses of pairs that were there before; `slots` says where grains went.
    fn carry(&mut self, old: &Self, slots: &[u32], layout: &Layout, rows: &mut [Row]) {
        let mut place = |owner: usize, other: usize, normal: f32, across: V| {
            let found = self.of(owner).find(|&at| self.pairs[at].other() == other);
            if let Some(at) = found {
                (self.pairs[at].normal, self.pairs[at].across) = (normal, across);
            }
            found.is_some()
        };
        for was in 0..old.starts.len() - 1 {
            for pair in old.of(was).map(|at| &old.pairs[at]).filter(|pair| pair.normal != 0.0) {
                let (owner, other) = (slots[was], slots[pair.other()]);
                if owner == GONE || other == GONE {
                    continue;
                }
                let (owner, other) = (owner as usize, other as usize);
                let is_kept = place(owner, other, pair.normal, pair.across)
                    || place(other, owner, pair.normal, pair.across.map(|x| -x));
                if !is_kept {
                    let direction = layout.apart(rows, owner, other);
                    let length = norm(direction).max(1.0e-6);
                    let impulse = add(scaled(direction, pair.normal / length), pair.across);
                    rows[owner].carried = sub(rows[owner].carried, impulse);
                    rows[other].carried = add(rows[other].carried, impulse);
                }
            }
        }
    }

    /// Indices of the pairs that a grain owns.
    pub fn of(&self, owner: usize) -> std::ops::Range<usize> {
        self.starts[owner] as usize..self.starts[owner + 1] as usize
    }
}

/// How many pairs each grain of a block owns, and the pairs.
fn pairs_of(layout: &Layout, block: &super::layout::Block, rows: &[Row]) -> (Vec<u32>, Vec<Pair>) {
    let neighbours: [Option<&super::layout::Block>; 27] = std::array::from_fn(|code| {
        let step = [code / 9, code / 3 % 3, code % 3].map(|digit| digit as i32 - 1);
        let at = [block.at[0] + step[0], block.at[1] + step[1], block.at[2] + step[2]];
        if code == 13 {
            Some(block)
        } else if step[1] <= 0 {
            layout.find(at)
        } else {
            None
        }
    });
    let (mut counts, mut pairs) = (Vec::with_capacity(block.grains().len()), Vec::new());
    let reach = (1.0 + SKIN) * (1.0 + SKIN);
    for cell in 0..ALL_CELLS {
        let own = block.starts[cell]..block.starts[cell + 1];
        if own.is_empty() {
            continue;
        }
        let [y, x, z] = [cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS];
        let before: [Option<(std::ops::Range<u32>, [i32; 3])>; 13] = std::array::from_fn(|index| {
            let cells = CELLS as i32;
            let to = [x as i32, y as i32, z as i32];
            let to = [0, 1, 2].map(|axis| to[axis] + BEFORE[index][axis]);
            let steps = to.map(|to| to.div_euclid(cells));
            let code = ((steps[0] + 1) * 9 + (steps[1] + 1) * 3 + steps[2] + 1) as usize;
            let within = to.map(|to| to.rem_euclid(cells) as usize);
            let cell = (within[1] * CELLS + within[0]) * CELLS + within[2];
            neighbours[code].map(|block| (block.starts[cell]..block.starts[cell + 1], steps))
        });
        for owner in own.clone() {
            let count = pairs.len();
            let place = rows[owner as usize].place;
            let mut near = |others: std::ops::Range<u32>, steps: [i32; 3]| {
                let shift = steps.map(|step| step as f32 * EDGE);
                for other in others {
                    let there = rows[other as usize].place;
                    let apart = sub(sub(place, shift), there);
                    if dot(apart, apart) < reach {
                        pairs.push(Pair::new(other, steps));
                    }
                }
            };
            before.iter().flatten().for_each(|(others, steps)| near(others.clone(), *steps));
            near(own.start..owner, [0; 3]);
            counts.push((pairs.len() - count) as u32);
        }
    }
    (counts, pairs)
}
