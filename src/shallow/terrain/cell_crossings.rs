//! Crossings of the vertical lines of cells with triangles, and the solids between them.

use super::solids::Solid;
use crate::numeric::lists::reset;
use crate::shallow::columns::grid::BOTTOMLESS;

/// The crossings of the lines of a box of cells: height (units) x 2, plus 1 if the triangle faces up.
#[derive(Debug, Default)]
pub(super) struct CellCrossings {
    /// Cell and crossing, in any order.
    crossings: Vec<[u32; 2]>,
    /// For each cell: first the count of its crossings, then where they begin in `sorted`, and last where they end.
    ends: Vec<u32>,
    /// The crossings of each cell together.
    sorted: Vec<u32>,
}

impl CellCrossings {
    /// Clears the crossings, for this many cells.
    pub fn reset(&mut self, cells: usize) {
        self.crossings.clear();
        reset(&mut self.ends, cells, 0);
    }

    /// Count of crossings.
    pub fn len(&self) -> usize {
        self.crossings.len()
    }

    /// Adds a crossing of a cell's line.
    #[inline(always)]
    pub fn add(&mut self, cell: usize, crossing: u32) {
        self.ends[cell] += 1;
        self.crossings.push([cell as u32, crossing]);
    }

    /// Sorts the crossings of each cell and makes solids of them; `starts` gets where each cell's solids begin, and the end of the last.
    pub fn find_solids(&mut self, starts: &mut Vec<u32>, solids: &mut Vec<Solid>) {
        let Self { crossings, ends, sorted } = self;
        let mut next = 0;
        for end in ends.iter_mut() {
            next += std::mem::replace(end, next);
        }
        sorted.resize(crossings.len(), 0);
        for &[cell, crossing] in crossings.iter() {
            let end = &mut ends[cell as usize];
            sorted[*end as usize] = crossing;
            *end += 1;
        }
        starts.push(0);
        let mut rest = &mut sorted[..];
        let mut begin = 0;
        for &end in ends.iter() {
            let (line, others) = rest.split_at_mut((end - begin) as usize);
            (rest, begin) = (others, end);
            line.sort_unstable();
            add_solids(line, solids);
            starts.push(solids.len() as u32);
        }
    }

    /// Addresses and capacities of the buffers.
    #[cfg(test)]
    pub fn memory(&self) -> [usize; 6] {
        let Self { crossings, ends, sorted } = self;
        let sizes = [crossings.capacity(), ends.capacity(), sorted.capacity()];
        let positions = [crossings.as_ptr() as usize, ends.as_ptr() as usize, sorted.as_ptr() as usize];
        [sizes[0], sizes[1], sizes[2], positions[0], positions[1], positions[2]]
    }

    /// Reserves memory for half as many crossings again, so that frames with a few more allocate nothing.
    pub fn reserve_half_more(&mut self) {
        reserve_half_more(&mut self.crossings);
        reserve_half_more(&mut self.sorted);
    }
}

/// Adds the solids of one line, given its crossings in ascending order. From the top down, the line is solid where the winding number is
/// above 0.
fn add_solids(line: &[u32], solids: &mut Vec<Solid>) {
    let first = solids.len();
    let (mut winding, mut top) = (0, 0);
    let mut is_solid = false;
    let mut downward = line.iter().rev().peekable();
    while let Some(crossing) = downward.next() {
        winding += ((crossing & 1) << 1) as i32 - 1;
        // Changes at the same height are summed.
        if downward.peek().is_some_and(|next| *next >> 1 == crossing >> 1) || is_solid == (winding > 0) {
            continue;
        }
        is_solid = !is_solid;
        let height = (crossing >> 1) as i32;
        if is_solid {
            top = height;
        } else {
            solids.push([height, top]);
        }
    }
    if is_solid {
        solids.push([BOTTOMLESS, top]);
    }
    solids[first..].reverse();
}

/// Reserves memory for half as much again.
pub(super) fn reserve_half_more<T>(buffer: &mut Vec<T>) {
    let wanted = buffer.len() + buffer.len() / 2;
    if buffer.capacity() < wanted {
        buffer.reserve_exact(wanted - buffer.len());
    }
}
