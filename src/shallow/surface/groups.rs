//! Odd quartets: groups of four and of three linked columns, whatever their layers (thesis 4.2.2).

use super::boundary::{Wall, Walls, walls_of};
use super::cells::{Cells, Entry};
use super::links::Scene;
use super::strips::{Found, places};

/// Corners of a quartet besides one.
const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

/// The triangle without a corner, facing up.
const TRIANGLES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [1, 0, 3], [0, 2, 1]];

/// What a search for groups works with.
#[derive(Debug, Default)]
pub(super) struct Search {
    cells: Cells,
    /// The columns of a quartet's triangles.
    triangles: Vec<[u32; 3]>,
    /// Entries that are linked with a wet one, corner by corner.
    near: Vec<Entry>,
    ends: [usize; 5],
}

impl Search {
    /// Makes room for so many layers.
    pub fn reserve(&mut self, layers: usize) {
        self.cells.reserve(layers);
        self.near.reserve(4 * layers * (1 + 8 * layers));
        self.triangles.reserve(32 * layers);
    }

    /// Finds the triangles of a quartet without walls; returns false if there is one, and calls `add_wall` with each.
    fn find(&mut self, quartet: usize, mut add_wall: impl FnMut(u32)) -> bool {
        self.triangles.clear();
        let mut has_wall = false;
        for (corner, others) in OTHERS.into_iter().enumerate() {
            for wet in self.cells.corner(quartet, corner) {
                if !wet.wet || self.cells.is_done(quartet, wet) {
                    continue;
                }
                // A column is linked with at most one of each cell: the one whose room holds its height.
                let mut near = [None; 4];
                for other in others {
                    if let Some(holder) =
                        self.cells.corner(quartet, other).iter().find(|entry| entry.holds(wet.height))
                    {
                        if wet.holds(holder.height) {
                            near[other] = Some(holder);
                        } else if wet.ends_at(holder) {
                            has_wall = true;
                            add_wall(holder.id);
                        }
                    }
                }
                add_triangles(corner, wet, near, &mut self.triangles);
            }
        }
        !has_wall
    }

    /// Finds the triangles of a quartet with walls.
    fn find_walled(&mut self, walls: &[Wall], quartet: usize) {
        self.triangles.clear();
        for corner in 0..4 {
            for at in 0..self.cells.corner(quartet, corner).len() {
                let wet = self.cells.corner(quartet, corner)[at];
                let is_open = wet.wet && !self.cells.is_done(quartet, &wet);
                if is_open && self.find_near(walls, quartet, corner, &wet) {
                    self.add_walled(walls, quartet, corner, &wet);
                }
            }
        }
    }

    /// Finds what is linked with a wet entry of a quartet with walls: there may be several in a cell. Returns whether two cells have any.
    fn find_near(&mut self, walls: &[Wall], quartet: usize, corner: usize, wet: &Entry) -> bool {
        let Self { cells, near, ends, .. } = self;
        near.clear();
        for other in 0..4 {
            if other != corner {
                near.extend(
                    cells
                        .corner(quartet, other)
                        .iter()
                        .filter(|entry| links(cells, walls, quartet, wet, entry)),
                );
            }
            ends[other + 1] = near.len();
        }
        ends.windows(2).filter(|pair| pair[0] < pair[1]).count() > 1
    }

    /// Adds the triangles of groups of which `wet`, at `corner`, is the first that is wet.
    fn add_walled(&mut self, walls: &[Wall], quartet: usize, corner: usize, wet: &Entry) {
        let Self { cells, near, ends, triangles } = self;
        let near = |corner: usize| &near[ends[corner]..ends[corner + 1]];
        let fit = |a: &Entry, b: &Entry| match (a.wet, b.wet) {
            (false, false) => true,
            (true, _) => links(cells, walls, quartet, a, b),
            (false, true) => links(cells, walls, quartet, b, a),
        };
        let is_earlier = |at: usize, entry: &Entry| at < corner && entry.wet;
        let [p, q, r] = OTHERS[corner];
        for x in near(p).iter().filter(|x| !is_earlier(p, x)) {
            for y in near(q).iter().filter(|y| !is_earlier(q, y) && fit(x, y)) {
                for z in near(r).iter().filter(|z| !is_earlier(r, z) && fit(x, z) && fit(y, z)) {
                    let mut four = [wet; 4];
                    [four[p], four[q], four[r]] = [x, y, z];
                    triangles.extend(divide(four));
                }
            }
        }
        for [first, second, omitted] in [[p, q, r], [p, r, q], [q, r, p]] {
            for x in near(first).iter().filter(|x| !is_earlier(first, x)) {
                for y in near(second).iter().filter(|y| !is_earlier(second, y) && fit(x, y)) {
                    if !near(omitted).iter().any(|z| fit(x, z) && fit(y, z)) {
                        triangles.push(three(wet.id, [(first, x.id), (second, y.id)], omitted));
                    }
                }
            }
        }
    }
}

/// Whether an entry of a quartet with walls is linked with a wet one.
fn links(cells: &Cells, walls: &[Wall], quartet: usize, wet: &Entry, other: &Entry) -> bool {
    if wet.is_linked(other) {
        return true;
    }
    let Some(wall) = walls.get(other.wall as usize) else { return false };
    // A wall's vertex goes with the columns whose surface ends there, and with those that are linked with one of them and have no other
    // vertex there.
    if wall.has(wet.id) {
        return true;
    }
    let mut entries = (0..4).flat_map(|corner| cells.corner(quartet, corner));
    entries.any(|entry| entry.wet && entry.is_linked(wet) && wall.has(entry.id))
        && !walls_of(walls, wall.column).any(|other| walls[other].has(wet.id))
}

/// Adds the triangles of groups of which `wet`, at `corner`, is the first that is wet, from what it is linked with.
#[inline(always)]
fn add_triangles(corner: usize, wet: &Entry, near: [Option<&Entry>; 4], triangles: &mut Vec<[u32; 3]>) {
    let fit = |a: &Entry, b: &Entry| !a.wet && !b.wet || a.is_linked(b);
    let is_first = |at: usize, entry: &Entry| at > corner || !entry.wet;
    let [p, q, r] = OTHERS[corner];
    if let (Some(x), Some(y), Some(z)) = (near[p], near[q], near[r])
        && fit(x, y)
        && fit(x, z)
        && fit(y, z)
    {
        if is_first(p, x) && is_first(q, y) && is_first(r, z) {
            let mut four = [wet; 4];
            [four[p], four[q], four[r]] = [x, y, z];
            triangles.extend(divide(four));
        }
        return;
    }
    for [first, second, omitted] in [[p, q, r], [p, r, q], [q, r, p]] {
        if let (Some(x), Some(y)) = (near[first], near[second])
            && is_first(first, x)
            && is_first(second, y)
            && fit(x, y)
        {
            triangles.push(three(wet.id, [(first, x.id), (second, y.id)], omitted));
        }
    }
}

/// The triangle of three columns, of which two are at given corners.
fn three(first: u32, others: [(usize, u32); 2], omitted: usize) -> [u32; 3] {
    let mut ids = [first; 4];
    others.into_iter().for_each(|(corner, id)| ids[corner] = id);
    TRIANGLES[omitted].map(|corner| ids[corner])
}

/// Divides a group of four.
fn divide(four: [&Entry; 4]) -> [[u32; 3]; 2] {
    let [a, b, c, d] = four;
    let turned = match (a.wet == d.wet, b.wet == c.wet) {
        (true, true) if a.wet != b.wet => b.wet,
        (true, false) => false,
        (false, true) => true,
        _ => a.height.wrapping_sub(b.height) < c.height.wrapping_sub(d.height),
    };
    let omitted = if turned { [3, 0] } else { [1, 2] };
    omitted.map(|corner| TRIANGLES[corner].map(|corner| four[corner].id))
}

/// Finds the groups of odd quartets, marks their vertices and returns how many triangles they become.
pub(super) fn find_groups(
    scene: Scene<'_>,
    found: &mut Found,
    walls: &mut Walls,
    search: &mut Search,
) -> usize {
    let mut count = 0;
    let mut has_walls = false;
    each_odd(found, |found, block| {
        let odd = found.blocks[block].odd;
        search.cells.enter(scene, found, &[], block, odd);
        for quartet in places(odd) {
            let is_plain = search.find(quartet, |wall| found.add_wall(wall as usize));
            if is_plain {
                count += search.triangles.len();
                search.triangles.iter().flatten().for_each(|&column| found.add_vertex(column as usize));
            }
            // Those without triangles are looked at no more.
            let out = &mut found.blocks[block];
            out.walled |= u16::from(!is_plain) << quartet;
            out.odd &= !(u16::from(is_plain && search.triangles.is_empty()) << quartet);
            has_walls |= !is_plain;
        }
    });
    if !has_walls {
        return count;
    }
    walls.find(scene, found);
    let len = scene.columns.len();
    each_odd(found, |found, block| {
        let walled = found.blocks[block].walled;
        if walled == 0 {
            return;
        }
        search.cells.enter(scene, found, &walls.list, block, walled);
        for quartet in places(walled) {
            search.find_walled(&walls.list, quartet);
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

/// Calls `add` with the columns or extras of each triangle of odd quartets, in order.
pub(super) fn each_odd_triangle(
    scene: Scene<'_>,
    found: &Found,
    walls: &[Wall],
    search: &mut Search,
    mut add: impl FnMut([u32; 3]),
) {
    for block in found.odd.iter() {
        let quartets = found.blocks[block];
        if quartets.odd == 0 {
            continue;
        }
        search.cells.enter(scene, found, walls, block, quartets.odd);
        for quartet in places(quartets.odd) {
            if quartets.walled >> quartet & 1 == 1 {
                search.find_walled(walls, quartet);
            } else {
                search.find(quartet, |_| {});
            }
            search.triangles.iter().for_each(|triangle| add(*triangle));
        }
    }
}
