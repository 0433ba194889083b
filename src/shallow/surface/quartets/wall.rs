//! Odd quartets in which a surface ends at a wall: several entries of a cell may be linked with the same entry there.

use super::cells::{Cells, Entry};
use super::divide::{OTHERS, divide, triangle};
use crate::numeric::lists::reset;
use crate::shallow::columns::NONE;
use crate::shallow::surface::rim::boundary::Wall;

/// Entries of a quartet, and their links.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct WalledQuartet {
    /// Entries, corner by corner.
    entries: Vec<Entry>,
    /// Where the entries of each corner begin, and the end of the last.
    ends: [usize; 5],
    /// For each entry with a wall, the set of the wall's members, and of the members of all walls of the same column: [`WORD`] bits a word.
    members: Vec<u64>,
    of_column: Vec<u64>,
    /// For each wet entry, the set of entries that it is linked with.
    links: Vec<u64>,
    /// Words per set.
    words: usize,
    /// Wet entries.
    wet: Vec<usize>,
    /// Entries that have a wall, and its position among the walls.
    at_walls: Vec<(usize, usize)>,
}

/// Bits per word.
const WORD: usize = 64;

impl WalledQuartet {
    /// Reserves memory for this many entries.
    pub fn reserve(&mut self, entries: usize) {
        self.clear(0);
        self.entries.clear();
        self.entries.reserve(entries);
        self.wet.clear();
        self.wet.reserve(entries);
        self.at_walls.clear();
        self.at_walls.reserve(entries);
        let words = entries * entries.div_ceil(WORD);
        for bits in [&mut self.members, &mut self.of_column, &mut self.links] {
            bits.reserve(words);
        }
    }

    fn clear(&mut self, entries: usize) {
        self.words = entries.div_ceil(WORD);
        for bits in [&mut self.members, &mut self.of_column, &mut self.links] {
            reset(bits, entries * self.words, 0);
        }
    }

    /// Finds the triangles of a quartet.
    pub fn find(&mut self, cells: &Cells, walls: &[Wall], quartet: usize, triangles: &mut Vec<[u32; 3]>) {
        triangles.clear();
        self.entries.clear();
        for corner in 0..4 {
            // A wet column of a full group has no links outside the group.
            let open = cells.corner(quartet, corner).iter();
            self.entries.extend(open.filter(|entry| !(entry.wet && cells.is_done(quartet, entry))));
            self.ends[corner + 1] = self.entries.len();
        }
        self.link(walls);
        for corner in 0..4 {
            for own in self.ends[corner]..self.ends[corner + 1] {
                if self.entries[own].wet {
                    self.add(corner, own, triangles);
                }
            }
        }
    }

    /// Finds the links of wet entries.
    fn link(&mut self, walls: &[Wall]) {
        self.clear(self.entries.len());
        let Self { entries, members, of_column, links, words, wet, at_walls, .. } = self;
        let (entries, words) = (&entries[..], *words);
        wet.clear();
        at_walls.clear();
        for (own, entry) in entries.iter().enumerate() {
            if entry.wet {
                wet.push(own);
            }
            if entry.wall != NONE {
                at_walls.push((own, entry.wall as usize));
            }
        }
        for &own in wet.iter() {
            let entry = entries[own];
            for (word, others) in entries.chunks(WORD).enumerate() {
                let bits =
                    others.iter().rev().fold(0, |bits, other| bits << 1 | u64::from(entry.is_linked(other)));
                links[own * words + word] = bits;
            }
        }
        for &(own, wall) in at_walls.iter() {
            for &wet in wet.iter().filter(|&&wet| walls[wall].has(entries[wet].id)) {
                members[own * words + wet / WORD] |= 1 << (wet % WORD);
            }
        }
        // A wall's vertex is linked with the columns whose surface ends there, and with those that are linked with one of them and have no
        // other vertex there.
        for &(own, wall) in at_walls.iter() {
            for &(other, _) in at_walls.iter().filter(|(_, other)| walls[*other].column == walls[wall].column)
            {
                for word in 0..words {
                    of_column[own * words + word] |= members[other * words + word];
                }
            }
            for &wet in wet.iter() {
                let (word, bit) = (own * words + wet / WORD, 1 << (wet % WORD));
                let is_near =
                    (0..words).any(|word| links[wet * words + word] & members[own * words + word] != 0);
                if members[word] & bit != 0 || is_near && of_column[word] & bit == 0 {
                    links[wet * words + own / WORD] |= 1 << (own % WORD);
                }
            }
        }
    }

    /// Whether a wet entry has a link with another.
    fn has(&self, wet: usize, other: usize) -> bool {
        self.links[wet * self.words + other / WORD] >> (other % WORD) & 1 == 1
    }

    /// Whether two entries may be in a group.
    fn may_join(&self, a: usize, b: usize) -> bool {
        match (self.entries[a].wet, self.entries[b].wet) {
            (false, false) => true,
            (true, _) => self.has(a, b),
            (false, true) => self.has(b, a),
        }
    }

    /// Entries of a corner that are linked with a wet one.
    fn linked(&self, wet: usize, corner: usize) -> impl Iterator<Item = usize> {
        (self.ends[corner]..self.ends[corner + 1]).filter(move |&other| self.has(wet, other))
    }

    /// Adds the triangles of groups whose first wet entry is `own`, at `corner`.
    fn add(&self, corner: usize, own: usize, triangles: &mut Vec<[u32; 3]>) {
        let [p, q, r] = OTHERS[corner];
        if [p, q, r].into_iter().filter(|&other| self.linked(own, other).next().is_some()).count() < 2 {
            return;
        }
        let wet = &self.entries[own];
        let is_first = |at: usize, entry: usize| at > corner || !self.entries[entry].wet;
        for x in self.linked(own, p).filter(|&x| is_first(p, x)) {
            for y in self.linked(own, q).filter(|&y| is_first(q, y) && self.may_join(x, y)) {
                for z in self.linked(own, r) {
                    if is_first(r, z) && self.may_join(x, z) && self.may_join(y, z) {
                        let mut four = [wet; 4];
                        [four[p], four[q], four[r]] = [x, y, z].map(|entry| &self.entries[entry]);
                        triangles.extend(divide(four));
                    }
                }
            }
        }
        for [first, second, omitted] in [[p, q, r], [p, r, q], [q, r, p]] {
            for x in self.linked(own, first).filter(|&x| is_first(first, x)) {
                for y in self.linked(own, second).filter(|&y| is_first(second, y) && self.may_join(x, y)) {
                    if !self.linked(own, omitted).any(|z| self.may_join(x, z) && self.may_join(y, z)) {
                        let [x_id, y_id] = [x, y].map(|entry| self.entries[entry].id);
                        triangles.push(triangle(wet.id, [(first, x_id), (second, y_id)], omitted));
                    }
                }
            }
        }
    }
}
