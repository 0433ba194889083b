//! Active strips: those with liquid and their neighbours, unless they are asleep (`rest.rs`). A step works on them as runs of each row.
//!
//! Strips fall asleep between frames, if their liquid and that of their neighbours rests. Within a frame, a strip beside a moving one does
//! not sleep. So nothing can enter a sleeping strip: as soon as something enters its neighbour, it wakes.

use std::ops::Range;

use super::rest::RestSearch;
use crate::numeric::lists::reset;
use crate::shallow::columns::runs::find;
use crate::shallow::columns::{Columns, NONE, STRIP, resize_part, strip_of};
use crate::shallow::pipes::Links;

/// A run of active strips of a row that is contiguous in memory, and whose neighbours in the rows to the north and south are, too.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Span {
    /// First index.
    pub first: u32,
    /// Count of indices.
    pub len: u32,
    /// First index of the strips to the south, or [`NONE`].
    pub south: u32,
    /// First index of the strips to the north, or [`NONE`]: there is none, or steps skip it.
    pub north: u32,
}

/// The active strips.
#[derive(Debug, Clone, Default)]
pub struct Active {
    /// Whether each strip had liquid at the start of the frame, or has become wet since.
    pub(super) wet: Vec<bool>,
    /// Whether each strip is wet or beside a wet one: all others have neither liquid nor flow.
    pub(super) active: Vec<bool>,
    /// Whether the content of each strip may move: an active strip that rests, and whose neighbours rest, too, sleeps.
    pub(super) moving: Vec<bool>,
    asleep: Vec<bool>,
    /// Whether any strip may be asleep.
    pub(super) any_asleep: bool,
    /// Whether nothing in a row, including its links, may move: steps skip it.
    resting: Vec<bool>,
    /// Maximum depth of the sleeping strips of each row (units).
    pub(super) asleep_depths: Vec<i32>,
    /// Whether some column of each strip has room for liquid: walls are never active.
    has_room: Vec<bool>,
    /// The strips that links lead to, for each strip, and where each list begins.
    linked: Vec<u32>,
    linked_starts: Vec<u32>,
    /// First strip of each row, and the end of the last.
    rows: Vec<u32>,
    /// The spans of each row, stored from the position of its first strip.
    spans: Vec<Span>,
    counts: Vec<u32>,
    /// Rows whose spans must be found again.
    stale: Vec<bool>,
    any_stale: bool,
}

impl Active {
    /// Nothing is active at first.
    pub fn new(columns: &Columns, links: &Links) -> Self {
        let (strips, rows) = (columns.strips().len(), columns.grid.size[1]);
        let mut active = Self {
            wet: vec![false; strips],
            active: vec![false; strips],
            moving: vec![false; strips],
            asleep: vec![false; strips],
            any_asleep: false,
            resting: vec![false; rows],
            asleep_depths: vec![0; rows],
            has_room: (0..strips).map(|strip| has_room(columns, strip)).collect(),
            linked: Vec::new(),
            linked_starts: Vec::new(),
            rows: vec![0; rows + 1],
            spans: vec![Span::default(); strips],
            counts: vec![0; rows],
            stale: vec![false; rows],
            any_stale: false,
        };
        active.find_rows(columns);
        active.list_linked(strips, links);
        active
    }

    /// Count of strips that a step works on.
    pub fn count(&self) -> usize {
        self.moving.iter().filter(|moving| **moving).count()
    }

    fn find_rows(&mut self, columns: &Columns) {
        for row in 1..self.rows.len() {
            self.rows[row] = columns.row(row - 1).end as u32;
        }
    }

    /// Finds the wet and active strips again after the columns of some rows have changed, and the links if `links` is given.
    pub(super) fn refit(
        &mut self,
        columns: &Columns,
        links: Option<&Links>,
        rows: Range<usize>,
        depth: &[i32],
    ) {
        let old = self.rows[rows.start] as usize..self.rows[rows.end] as usize;
        let new = columns.row(rows.start).start..columns.row(rows.end - 1).end;
        for flags in [&mut self.wet, &mut self.active, &mut self.moving, &mut self.asleep, &mut self.has_room]
        {
            resize_part(flags, old.clone(), new.len(), false);
        }
        resize_part(&mut self.spans, old.clone(), new.len(), Span::default());
        self.find_rows(columns);
        if let Some(links) = links {
            self.list_linked(columns.strips().len(), links);
        }
        for strip in new.clone() {
            self.wet[strip] = strip_of(depth, strip).iter().any(|&depth| depth > 0);
            (self.active[strip], self.moving[strip]) = (false, false);
            self.has_room[strip] = has_room(columns, strip);
        }
        let count = columns.grid.size[1];
        let around = rows.start.saturating_sub(1)..(rows.end + 1).min(count);
        let stale = if old == new { around.end } else { count };
        (around.start..stale).for_each(|row| self.make_stale(row));
        for strip in columns.row(around.start).start..columns.row(around.end - 1).end {
            self.asleep[strip] = false;
            if self.wet[strip] {
                self.wake(columns, strip);
            }
        }
    }

    /// Lists for each strip those at the other ends of its links.
    fn list_linked(&mut self, strips: usize, links: &Links) {
        let Self { linked, linked_starts: starts, .. } = self;
        let pairs = || {
            let ends = links.from.iter().zip(&links.to).filter(|(_, to)| **to != NONE);
            ends.map(|(&from, &to)| [from, to].map(|end| end / STRIP as u32))
                .flat_map(|[a, b]| [[a, b], [b, a]])
        };
        reset(starts, strips + 2, 0);
        pairs().for_each(|[strip, _]| starts[strip as usize + 2] += 1);
        (2..strips + 2).for_each(|at| starts[at] += starts[at - 1]);
        reset(linked, 2 * links.len(), 0);
        for [strip, other] in pairs() {
            let end = &mut starts[strip as usize + 1];
            linked[*end as usize] = other;
            *end += 1;
        }
        // Removes duplicates.
        let mut count = 0;
        for strip in 0..strips {
            let own = starts[strip] as usize..starts[strip + 1] as usize;
            starts[strip] = count as u32;
            linked[own.clone()].sort_unstable();
            for at in own.clone() {
                if at == own.start || linked[at] != linked[at - 1] {
                    linked[count] = linked[at];
                    count += 1;
                }
            }
        }
        starts.truncate(strips + 1);
        starts[strips] = count as u32;
        linked.truncate(count);
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        let flags = 5 * self.wet.len() + 2 * self.stale.len() + size_of_val(&self.asleep_depths[..]);
        let lists = [&self.linked, &self.linked_starts, &self.rows, &self.counts];
        flags + lists.iter().map(|list| size_of_val(&list[..])).sum::<usize>() + size_of_val(&self.spans[..])
    }

    /// The strips of a row, active or not.
    pub fn strips(&self, row: usize) -> Range<usize> {
        self.rows[row] as usize..self.rows[row + 1] as usize
    }

    /// The spans of a row.
    pub fn row(&self, row: usize) -> &[Span] {
        let first = self.rows[row] as usize;
        &self.spans[first..first + self.counts[row] as usize]
    }

    /// Whether nothing in a row, including its links, may move.
    pub fn rests(&self, row: usize) -> bool {
        self.resting[row]
    }

    /// Whether nothing may move in any row.
    pub fn all_rest(&self) -> bool {
        !self.resting.contains(&false)
    }

    /// Maximum depth of the sleeping strips of a row (units).
    pub fn asleep_depth(&self, row: usize) -> i32 {
        self.asleep_depths[row]
    }

    /// Makes the strips of `runs` (in ascending order) active, and besides them only strips beside liquid.
    pub(super) fn reset(
        &mut self,
        columns: &Columns,
        depth: &[i32],
        runs: impl Iterator<Item = Range<usize>> + Clone,
    ) {
        self.wake_all();
        let mut end = 0;
        for run in runs.clone() {
            self.deactivate(columns, end..run.start);
            end = run.end;
            for strip in run {
                let (own, _) = depth[strip * STRIP..].split_at(STRIP);
                self.wet[strip] = own.iter().fold(0, |any, depth| any | depth) != 0;
                self.moving[strip] = self.wet[strip];
                self.activate(columns, strip);
            }
        }
        self.deactivate(columns, end..self.active.len());
        for strip in runs.flatten() {
            if self.wet[strip] && self.may_have_inactive_neighbour(columns, strip) {
                self.wake(columns, strip);
            }
        }
        self.refresh(columns, depth);
    }

    /// Whether a strip might have an inactive neighbour. A cheap test: nearly always there is none.
    fn may_have_inactive_neighbour(&self, columns: &Columns, strip: usize) -> bool {
        let active = |other: u32| other == NONE || self.active[other as usize];
        let next = self.active.get(strip + 1).is_none_or(|next| *next);
        let before = strip == 0 || self.active[strip - 1];
        let has_links = self.linked_starts[strip] < self.linked_starts[strip + 1];
        has_links || !(next && before && active(columns.north(strip)) && active(columns.south(strip)))
    }

    /// Deactivates the strips of a range.
    fn deactivate(&mut self, columns: &Columns, strips: Range<usize>) {
        let mut strip = find(&self.active[..strips.end], strips.start, true);
        while strip < strips.end {
            (self.active[strip], self.wet[strip], self.moving[strip]) = (false, false, false);
            self.make_stale(columns.strips()[strip].row as usize);
            strip = find(&self.active[..strips.end], strip + 1, true);
        }
    }

    /// Makes a strip that became wet or was stirred, and its neighbours, active and awake.
    pub fn wake(&mut self, columns: &Columns, strip: usize) {
        (self.wet[strip], self.moving[strip]) = (true, true);
        self.activate(columns, strip);
        self.for_each_neighbour(columns, strip, |active, other| active.activate(columns, other));
    }

    /// Calls `visit` with each strip that a pipe leads to from `strip`.
    fn for_each_neighbour(
        &mut self,
        columns: &Columns,
        strip: usize,
        mut visit: impl FnMut(&mut Self, usize),
    ) {
        let beside = [columns.east(strip), columns.west(strip)];
        beside.into_iter().flatten().for_each(|other| visit(self, other));
        for other in [columns.north(strip), columns.south(strip)].into_iter().filter(|&other| other != NONE) {
            visit(self, other as usize);
        }
        for link in self.linked_starts[strip]..self.linked_starts[strip + 1] {
            visit(self, self.linked[link as usize] as usize);
        }
    }

    /// Wakes a wet strip after a transfer into or out of it.
    pub fn stir(&mut self, columns: &Columns, strip: usize) {
        if self.wet[strip] && !self.moving[strip] {
            self.wake(columns, strip);
        }
    }

    /// Wakes all strips, so that the next frame decides anew which rest.
    pub fn wake_all(&mut self) {
        self.asleep.fill(false);
        self.moving.copy_from_slice(&self.wet);
        (0..self.stale.len()).for_each(|row| self.make_stale(row));
    }

    /// Ends the sleep of a strip.
    fn end_sleep(&mut self, columns: &Columns, strip: usize) {
        if std::mem::take(&mut self.asleep[strip]) {
            self.make_stale(columns.strips()[strip].row as usize);
        }
    }

    fn activate(&mut self, columns: &Columns, strip: usize) {
        if self.has_room[strip] && (!self.active[strip] || self.asleep[strip]) {
            (self.active[strip], self.asleep[strip]) = (true, false);
            self.make_stale(columns.strips()[strip].row as usize);
        }
    }

    /// Marks a row as stale, and the next one, whose spans refer to it.
    fn make_stale(&mut self, row: usize) {
        self.any_stale = true;
        self.stale[row] = true;
        self.resting[row] = false;
        if let Some(next) = self.stale.get_mut(row + 1) {
            *next = true;
        }
    }

    /// Finds the wet strips, and deactivates those that are dry and beside dry ones; `dried` is called with the indices of each.
    pub fn deactivate_dry(&mut self, columns: &Columns, depth: &[i32], mut dried: impl FnMut(Range<usize>)) {
        let rows = self.counts.len();
        // Sleeping strips keep their state, and so do those beside them.
        let Self { wet, active, asleep, counts, .. } = self;
        for row in (0..rows).filter(|&row| counts[row] > 0) {
            for strip in columns.row(row).filter(|&strip| active[strip] && !asleep[strip]) {
                wet[strip] = strip_of(depth, strip).iter().any(|&depth| depth > 0);
            }
        }
        for row in 0..rows {
            for strip in if self.counts[row] > 0 { columns.row(row) } else { 0..0 } {
                if self.is_awake(strip) && !self.is_marked_around(columns, strip, &self.wet) {
                    (self.active[strip], self.moving[strip]) = (false, false);
                    self.make_stale(row);
                    dried(strip * STRIP..(strip + 1) * STRIP);
                }
            }
        }
    }

    /// Puts strips to sleep that rest, and whose neighbours rest.
    pub fn fall_asleep(&mut self, search: &RestSearch) {
        let (columns, rows) = (search.columns, self.counts.len());
        for row in 0..rows {
            for strip in if self.counts[row] > 0 { columns.row(row) } else { 0..0 } {
                if self.is_awake(strip) {
                    self.moving[strip] = self.wet[strip] && !search.rests(strip);
                }
            }
        }
        for row in 0..rows {
            let links = if self.resting[row] { 0..0 } else { search.pipes.links.row(row) };
            for [from, to] in search.moving_links(links) {
                for end in [from, to].into_iter().filter(|&end| end != NONE) {
                    let strip = end as usize / STRIP;
                    self.moving[strip] |= self.is_awake(strip);
                }
            }
        }
        // A strip that began to move wakes its sleeping neighbours.
        self.any_asleep = self.asleep.contains(&true);
        for row in 0..rows {
            for strip in if self.any_asleep && self.counts[row] > 0 { columns.row(row) } else { 0..0 } {
                if self.moving[strip] {
                    self.for_each_neighbour(columns, strip, |active, other| active.end_sleep(columns, other));
                }
            }
        }
        for row in 0..rows {
            for strip in if self.counts[row] > 0 { columns.row(row) } else { 0..0 } {
                if self.is_awake(strip) && !self.is_marked_around(columns, strip, &self.moving) {
                    (self.asleep[strip], self.any_asleep) = (true, true);
                    self.make_stale(row);
                }
            }
        }
        for row in 0..rows {
            if !self.resting[row] && !columns.row(row).any(|strip| self.is_awake(strip)) {
                let mut owners = row.saturating_sub(1)..row + 1;
                self.resting[row] =
                    owners.all(|row| search.moving_links(search.pipes.links.row(row)).next().is_none());
            }
        }
    }

    /// Whether a step works on a strip.
    fn is_awake(&self, strip: usize) -> bool {
        self.active[strip] && !self.asleep[strip]
    }

    /// Whether a strip, or one that a pipe leads to, is marked.
    fn is_marked_around(&self, columns: &Columns, strip: usize, marks: &[bool]) -> bool {
        let marked = |strip: usize| marks[strip];
        let beyond = |strip: u32| strip != NONE && marked(strip as usize);
        let links = self.linked_starts[strip] as usize..self.linked_starts[strip + 1] as usize;
        marked(strip)
            || columns.east(strip).is_some_and(marked)
            || columns.west(strip).is_some_and(marked)
            || beyond(columns.north(strip))
            || beyond(columns.south(strip))
            || self.linked[links].iter().any(|&other| marked(other as usize))
    }

    /// Finds the spans of rows that have changed.
    pub fn refresh(&mut self, columns: &Columns, depth: &[i32]) {
        if !std::mem::take(&mut self.any_stale) {
            return;
        }
        for row in 0..self.stale.len() {
            if std::mem::take(&mut self.stale[row]) {
                self.find_spans(columns, row);
                let asleep = columns.row(row).filter(|&strip| self.asleep[strip]);
                let deepest = |strip| strip_of(depth, strip).iter().copied().fold(0, i32::max);
                self.asleep_depths[row] = asleep.map(deepest).fold(0, i32::max);
            }
        }
    }

    fn find_spans(&mut self, columns: &Columns, row: usize) {
        let first = self.rows[row] as usize;
        let mut count = 0;
        for strip in columns.row(row) {
            if !self.is_awake(strip) {
                continue;
            }
            let at = |strip: u32| if strip == NONE { NONE } else { strip * STRIP as u32 };
            let north = columns.north(strip);
            let north = if north != NONE && self.is_awake(north as usize) { north } else { NONE };
            let own = Span {
                first: (strip * STRIP) as u32,
                len: STRIP as u32,
                south: at(columns.south(strip)),
                north: at(north),
            };
            // A span may bridge a gap of cells: the pipe over it is closed.
            let continues = |last: &Span| {
                let follows = |last_at: u32, at: u32| {
                    if last_at == NONE { at == NONE } else { at == last_at + last.len }
                };
                follows(last.first, own.first)
                    && follows(last.south, own.south)
                    && follows(last.north, own.north)
            };
            let spans = &mut self.spans[first..];
            if count > 0 && continues(&spans[count - 1]) {
                spans[count - 1].len += own.len;
            } else {
                spans[count] = own;
                count += 1;
            }
        }
        self.counts[row] = count as u32;
    }
}

fn has_room(columns: &Columns, strip: usize) -> bool {
    let (base, ceiling) = (strip_of(columns.bases(), strip), strip_of(columns.ceilings(), strip));
    base.iter().zip(ceiling).any(|(base, ceiling)| base < ceiling)
}
