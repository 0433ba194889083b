//! Threads: what goes over lips close to each other gathers into one fall, as surface tension makes it.
//!
//! A thin sheet that leaves an edge contracts: from the edge of a table a film runs off in threads some millimetres apart. Of all lips the one with
//! most liquid is the first thread, and takes what goes over those within [`REACH`]; of what is left the one with most is the next. What a
//! thread has carried counts, so that it stays where it is. Everything is compared in integers, and among equals each is its own thread: a turned or
//! mirrored scene has the same ones.

use super::falling::{Falling, Waiting, add};
use crate::shallow::columns::Columns;
use crate::shallow::pipes::Links;
use crate::shallow::pipes::joints::Side;

/// A thread takes what goes over lips so far from its own (m); of the order of the capillary length, sqrt(sigma / (rho g)), 2.7 mm for water.
const REACH: f64 = 0.004;
/// Its own.
const OWN: u32 = u32::MAX;

/// A lip that liquid waits at.
#[derive(Debug, Clone, Copy)]
struct Lip {
    /// Index of the cell that it belongs to (`Grid::index`).
    cell: u32,
    link: u32,
    /// Middle of its edge (half cells), and its base (units).
    middle: [i32; 2],
    base: i32,
    side: Side,
    /// What it carries in an interval (units); 0 where nothing came in the last.
    strength: i64,
    /// The lip, in this list, that takes its liquid, and how far away that is (square of half cells).
    into: u32,
    away: i32,
}

/// What is found of the lips; kept, so that nothing is allocated again.
#[derive(Debug, Clone, Default)]
pub(super) struct Threads {
    /// By cell.
    lips: Vec<Lip>,
    /// From the strongest on.
    order: Vec<u32>,
}

impl Threads {
    /// Nothing yet, and room for the lips of so many links.
    pub fn with_room(links: usize) -> Self {
        Self { lips: Vec::with_capacity(links), order: Vec::with_capacity(links) }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        self.lips.capacity() * size_of::<Lip>() + self.order.capacity() * size_of::<u32>()
    }

    /// Finds which lips are threads, and what others give to them.
    fn find(&mut self, columns: &Columns, links: &Links, waiting: &[Waiting]) {
        let grid = columns.grid;
        let reach = 2.0 * REACH / grid.cell;
        // Beside it the next lips are a cell, two halves, away; over a corner less.
        let (reach, cells) = ((reach * reach).min(1e6) as i32, (0.5 * reach).min(500.0) as usize + 1);
        self.lips.clear();
        for (link, own) in waiting.iter().enumerate().filter(|(_, own)| own.is_awake()) {
            let from = (if own.is_back { links.to[link] } else { links.from[link] }) as usize;
            let side = if own.is_back { links.sides[link].opposite() } else { links.sides[link] };
            let [x, z] = columns.cell(from);
            let [east, south] = side.outward();
            let came = own.units - own.before;
            self.lips.push(Lip {
                cell: grid.index([x, z]) as u32,
                link: link as u32,
                middle: [2 * x as i32 + east, 2 * z as i32 + south],
                base: columns.bases()[from],
                side,
                strength: if came > 0 { own.steady + came } else { 0 },
                into: OWN,
                away: i32::MAX,
            });
        }
        self.lips.sort_unstable_by_key(|lip| (lip.cell, lip.link));
        self.order.clear();
        self.order.extend(0..self.lips.len() as u32);
        let lips = &self.lips;
        self.order.sort_unstable_by_key(|&at| std::cmp::Reverse(lips[at as usize].strength));
        let step = (grid.cell / columns.heights.unit).min(f64::from(i32::MAX / 2)) as i32;
        let mut first = 0;
        while first < self.order.len() {
            // Those that are as strong do not take from each other.
            let strength = self.lips[self.order[first] as usize].strength;
            let same =
                self.order[first..].iter().take_while(|&&at| self.lips[at as usize].strength == strength);
            let end = first + same.count();
            if strength > 0 {
                for position in first..end {
                    let at = self.order[position];
                    if self.lips[at as usize].into == OWN {
                        self.take_around(at, [reach, step], cells, grid.size);
                    }
                }
            }
            first = end;
        }
    }

    /// A thread takes what is weaker and near, if none stronger does; of two that are as strong the nearer.
    fn take_around(&mut self, at: u32, [reach, step]: [i32; 2], cells: usize, [nx, nz]: [usize; 2]) {
        let own = self.lips[at as usize];
        let [x, z] = [own.cell as usize % nx, own.cell as usize / nx];
        for row in z.saturating_sub(cells)..(z + cells + 1).min(nz) {
            let [from, to] =
                [x.saturating_sub(cells), (x + cells).min(nx - 1)].map(|x| (row * nx + x) as u32);
            let first = self.lips.partition_point(|lip| lip.cell < from);
            for other in first..self.lips.len() {
                let lip = self.lips[other];
                if lip.cell > to {
                    break;
                }
                let [east, south] = [0, 1].map(|n| lip.middle[n] - own.middle[n]);
                let away = east * east + south * south;
                let joins = away <= reach
                    && lip.strength < own.strength
                    && lip.side != own.side.opposite()
                    && (lip.base - own.base).abs() <= step;
                if !joins {
                    continue;
                }
                let (is_free, taken) = (lip.into == OWN && lip.away == i32::MAX, lip.into);
                let is_equal =
                    !is_free && (taken == OWN || self.lips[taken as usize].strength == own.strength);
                let lip = &mut self.lips[other];
                if is_free || is_equal && away < lip.away {
                    (lip.into, lip.away) = (at, away);
                } else if is_equal && away == lip.away {
                    // Between two of the same it goes to neither.
                    lip.into = OWN;
                }
            }
        }
    }
}

impl Falling {
    /// Gives what waits at lips to the threads near them, and counts what came to each in this interval.
    pub(super) fn gather_threads(&mut self, columns: &Columns, links: &Links) {
        let Self { threads, waiting, .. } = self;
        threads.find(columns, links, waiting);
        for lip in threads.lips.iter().filter(|lip| lip.into != OWN) {
            let given = &mut waiting[lip.link as usize];
            let Waiting { units, amounts, impulse, .. } = *given;
            given.clear();
            let taker = &mut waiting[threads.lips[lip.into as usize].link as usize];
            taker.units += units;
            add(&mut taker.amounts, &amounts);
            taker.gathered += impulse.round() as i64;
        }
        for lip in &threads.lips {
            let own = &mut waiting[lip.link as usize];
            // Whole numbers, so that it does not depend on the order.
            own.impulse += own.gathered as f64;
            own.gathered = 0;
            let came = (own.units - own.before).max(0);
            if came > 2 * own.steady {
                own.phase = (scatter(came as u64) >> 33) as u32;
            }
            own.steady = (3 * own.steady + came) / 4;
        }
    }
}

/// Numbers that are scattered over all, for any that are close together (splitmix64, Steele et al. 2014).
fn scatter(number: u64) -> u64 {
    let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ mixed >> 31
}
