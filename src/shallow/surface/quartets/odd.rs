//! Odd quartets: groups of four and of three linked columns, whatever their layers (thesis 4.2.2).

use super::cells::{Cells, Entry};
use super::divide::{OTHERS, divide, triangle};
use super::links::LiquidColumns;
use super::strips::{Found, positions};
use super::wall::WalledQuartet;
use crate::shallow::surface::rim::boundary::Walls;

/// Scratch buffers of a search for groups.
#[derive(Debug, Default)]
pub(in crate::shallow::surface) struct Search {
    cells: Cells,
    /// Triangles of the quartet that was searched last.
    triangles: Vec<[u32; 3]>,
    walled_quartet: WalledQuartet,
    /// Triangles of all odd quartets without walls (0) and with walls (1), and how many each quartet has; quartets with neither walls nor
    /// triangles are left out.
    found: [Vec<[u32; 3]>; 2],
    counts: [Vec<u32>; 2],
}

impl Search {
    /// Reserves memory for this many layers, odd quartets and triangles.
    pub fn reserve(&mut self, layers: usize, quartets: usize, triangles: usize) {
        self.cells.reserve(layers);
        // A cell has at most one extra per column of the eight cells around it.
        self.walled_quartet.reserve(4 * layers * (1 + 8));
        self.triangles.reserve(32 * layers);
        self.clear();
        self.found.iter_mut().for_each(|found| found.reserve(triangles));
        self.counts.iter_mut().for_each(|counts| counts.reserve(quartets));
    }

    /// Clears the previous frame.
    fn clear(&mut self) {
        self.found.iter_mut().for_each(Vec::clear);
        self.counts.iter_mut().for_each(Vec::clear);
    }

    /// Stores the quartet's triangles; `kind`: without walls (0) or with walls (1).
    fn keep(&mut self, kind: usize) {
        self.counts[kind].push(self.triangles.len() as u32);
        self.found[kind].extend_from_slice(&self.triangles);
    }

    /// Finds the triangles of a quartet, as if without walls. If surfaces end at walls there, calls `add_wall` with the column of each and
    /// returns false.
    fn find(&mut self, quartet: usize, mut add_wall: impl FnMut(u32)) -> bool {
        self.triangles.clear();
        let mut has_wall = false;
        for (corner, others) in OTHERS.into_iter().enumerate() {
            for wet in self.cells.corner(quartet, corner) {
                if !wet.wet || self.cells.is_done(quartet, wet) {
                    continue;
                }
                // A column is linked with at most one column of each cell: the one whose room holds its height.
                let mut linked = [None; 4];
                for other in others {
                    if let Some(holder) =
                        self.cells.corner(quartet, other).iter().find(|entry| entry.holds(wet.height))
                    {
                        if wet.holds(holder.height) {
                            linked[other] = Some(holder);
                        } else if wet.ends_at(holder) {
                            has_wall = true;
                            add_wall(holder.id);
                        }
                    }
                }
                add_triangles(corner, wet, linked, &mut self.triangles);
            }
        }
        !has_wall
    }
}

/// Adds the triangles of groups whose first wet column is `wet`, at `corner`, given the columns at the other corners that it is linked
/// with.
#[inline(always)]
pub fn add_triangles(corner: usize, wet: &Entry, linked: [Option<&Entry>; 4], triangles: &mut Vec<[u32; 3]>) {
    let may_join = |a: &Entry, b: &Entry| !a.wet && !b.wet || a.is_linked(b);
    let is_first = |at: usize, entry: &Entry| at > corner || !entry.wet;
    let [p, q, r] = OTHERS[corner];
    if let (Some(x), Some(y), Some(z)) = (linked[p], linked[q], linked[r])
        && may_join(x, y)
        && may_join(x, z)
        && may_join(y, z)
    {
        if is_first(p, x) && is_first(q, y) && is_first(r, z) {
            let mut four = [wet; 4];
            [four[p], four[q], four[r]] = [x, y, z];
            triangles.extend(divide(four));
        }
        return;
    }
    for [first, second, omitted] in [[p, q, r], [p, r, q], [q, r, p]] {
        if let (Some(x), Some(y)) = (linked[first], linked[second])
            && is_first(first, x)
            && is_first(second, y)
            && may_join(x, y)
        {
            triangles.push(triangle(wet.id, [(first, x.id), (second, y.id)], omitted));
        }
    }
}

/// Finds the groups of odd quartets, marks their vertices and returns the triangle count.
pub(in crate::shallow::surface) fn find_groups(
    liquid: LiquidColumns<'_>,
    found: &mut Found,
    walls: &mut Walls,
    search: &mut Search,
) -> usize {
    let mut count = 0;
    search.clear();
    let mut has_walls = false;
    each_odd(found, |found, block| {
        let odd = found.blocks[block].odd;
        found.blocks[block].searched = odd;
        search.cells.load(liquid, found, &[], block, odd);
        for quartet in positions(odd) {
            let is_plain = search.find(quartet, |wall| found.add_wall(wall as usize));
            if is_plain {
                count += search.triangles.len();
                search.triangles.iter().flatten().for_each(|&column| found.add_vertex(column as usize));
                if !search.triangles.is_empty() {
                    search.keep(0);
                }
            }
            // Quartets without triangles are not searched again.
            let out = &mut found.blocks[block];
            out.walled |= u16::from(!is_plain) << quartet;
            out.odd &= !(u16::from(is_plain && search.triangles.is_empty()) << quartet);
            has_walls |= !is_plain;
        }
    });
    if !has_walls {
        return count;
    }
    walls.find(liquid, found);
    let len = liquid.columns.len();
    each_odd(found, |found, block| {
        let walled = found.blocks[block].walled;
        if walled == 0 {
            return;
        }
        search.cells.load(liquid, found, &walls.list, block, walled);
        for quartet in positions(walled) {
            search.walled_quartet.find(&search.cells, &walls.list, quartet, &mut search.triangles);
            search.keep(1);
            count += search.triangles.len();
            for &id in search.triangles.iter().flatten() {
                match (id as usize).checked_sub(len) {
                    Some(extra) => walls.used[extra] = true,
                    None => found.add_vertex(id as usize),
                }
            }
        }
    });
    count
}

/// Calls `visit` with each block that has odd quartets.
fn each_odd(found: &mut Found, mut visit: impl FnMut(&mut Found, usize)) {
    let odd = std::mem::take(&mut found.odd);
    odd.iter().for_each(|block| visit(found, block));
    found.odd = odd;
}

impl Search {
    /// The columns or extras of all triangles of odd quartets, those without walls first.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.found.iter().flatten().copied()
    }
}

/// Calls `add` with the columns or extras of each triangle of odd quartets, in order.
pub(in crate::shallow::surface) fn each_odd_triangle(
    found: &Found,
    search: &Search,
    mut add: impl FnMut([u32; 3]),
) {
    let mut rest = search.found.each_ref().map(|found| &found[..]);
    let mut counts = search.counts.each_ref().map(|counts| counts.iter());
    for block in found.odd.iter() {
        let quartets = found.blocks[block];
        for quartet in positions(quartets.odd) {
            let kind = usize::from(quartets.walled >> quartet & 1);
            let count = counts[kind].next().map_or(0, |count| *count as usize);
            let (own, others) = rest[kind].split_at(count);
            rest[kind] = others;
            own.iter().for_each(|triangle| add(*triangle));
        }
    }
}
