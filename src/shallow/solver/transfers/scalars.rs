//! Transport of scalars: a transfer moves the same share of a column's amounts as of its depth, at the concentration at the start of the
//! step (after the transfers of flooded passages, which come first).
//!
//! It follows the rows of a step (`rows/`): first the levels of the row in front, then, when the transfers of a row are final, their
//! amounts.

use super::whole_units::find_moved_amounts;
use crate::numeric::cpu::dispatch;
use crate::numeric::lists::refill;
use crate::shallow::columns::{NONE, STRIP, strip_mut, strip_of};
use crate::shallow::scalars::amounts::{Changes, LawEffect};
use crate::shallow::scalars::shares::{LEVELS, MAX_SCALARS, integer, level, nearest, share};
use crate::shallow::solver::overflow_edges::{Fall, OverflowEdges};
use crate::shallow::solver::pressurised::edges::PipeIndex;
use crate::shallow::solver::pressurised::network::Network;
use crate::shallow::solver::rows::StepInputs;
use crate::shallow::solver::rows::band_views::{BandView, indices};
use crate::shallow::solver::rows::buffers::{RING, ScalarBuffers, ScalarRows};
use crate::shallow::solver::rows::positions::RowPositions;

impl ScalarBuffers {
    /// Buffers for `count` scalars, in rows of `room` numbers.
    pub fn new(count: usize, room: usize) -> Self {
        let numbers = || vec![0.0; room];
        let rows = |_| ScalarRows {
            level: std::array::from_fn(|_| numbers()),
            south: std::array::from_fn(|_| numbers()),
            east: numbers(),
        };
        Self { list: (0..count).map(rows).collect(), zeros: if count > 0 { numbers() } else { Vec::new() } }
    }

    /// Whether there is no scalar.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Grows the buffers for rows of `room` numbers.
    pub fn widen(&mut self, room: usize) {
        for ScalarRows { level, south, east } in &mut self.list {
            level.iter_mut().chain(south).for_each(|numbers| numbers.resize(room, 0.0));
            east.resize(room, 0.0);
        }
        if !self.list.is_empty() {
            self.zeros.resize(room, 0.0);
        }
    }

    /// Memory (bytes).
    pub fn bytes(&self) -> usize {
        (self.list.len() * (RING + 3) + 1) * size_of_val(&self.zeros[..])
    }

    /// Finds the concentrations in a row, from the depths that its transfers are scaled by.
    #[inline(never)]
    pub fn find_levels(&mut self, inputs: &StepInputs, view: &BandView, row: usize) {
        let (part, position) = (view.part(row), RowPositions::new(inputs.columns, row));
        for (rows, amounts) in self.list.iter_mut().zip(&part.amounts) {
            let levels = &mut rows.level[row % RING];
            for span in inputs.active.row(row) {
                let (at, mine, len) =
                    (position.of(span.first), span.first as usize - part.start, span.len as usize);
                let own = mine..mine + len;
                find_levels(&amounts[own.clone()], &part.depth[own], &mut levels[at..at + len]);
            }
        }
    }

    /// Moves the scalars of a row's links, from and to the band's own columns.
    #[inline(never)]
    pub fn move_links(
        &self,
        inputs: &StepInputs,
        view: &mut BandView,
        row: usize,
        changes: &mut [Changes; MAX_SCALARS],
    ) {
        let links = &inputs.pipes.links;
        let (is_own, own) = (view.rows.contains(&row), indices(inputs.columns, &view.rows));
        let position = RowPositions::new(inputs.columns, row);
        let (part, mut next) = view.part_and_next(row);
        for (scalar, rows) in self.list.iter().enumerate() {
            let [levels, beyond] = [row, row + 1].map(|row| &rows.level[row % RING]);
            for link in links.row(row) {
                // The same whole units that the liquid moves.
                let units = part.links.transfer[link - part.links.first] as i32;
                if units == 0 {
                    continue;
                }
                let (from, to, fall) = (links.from[link], links.to[link], inputs.overflow_edges.at(link));
                // Liquid from outside has the concentrations of the liquid inside.
                let donor = if units > 0 || to == NONE { from } else { to };
                let moved = share(position.pick(levels, beyond, donor), f64::from(units));
                let mut change = |column: u32, amount: f64| {
                    let column = column as usize;
                    if own.contains(&column) {
                        match &mut next {
                            Some(next) if column >= next.start => {
                                next.amounts[scalar][column - next.start] += amount;
                            }
                            _ => part.amounts[scalar][column - part.start] += amount,
                        }
                    }
                };
                if fall != Fall::No {
                    let fallen = if units > 0 { moved } else { -moved };
                    change(donor, -fallen);
                    part.links.fallen[scalar][link - part.links.first] = fallen;
                    continue;
                }
                change(from, -moved);
                match to {
                    NONE if is_own && units > 0 => changes[scalar].lost += i128::from(integer(moved)),
                    NONE if is_own => changes[scalar].gained -= i128::from(integer(moved)),
                    NONE => {}
                    to => change(to, moved),
                }
            }
        }
    }

    /// Finds the amounts that a row's transfers to the east and to the south move, and applies them, if the row is the band's own; then the
    /// laws act.
    #[inline(never)]
    pub fn move_row(
        &mut self,
        inputs: &StepInputs,
        view: &mut BandView,
        row: usize,
        [east, south]: [&[f32]; 2],
        changes: &mut [Changes; MAX_SCALARS],
    ) {
        let is_own = view.rows.contains(&row);
        let (part, position) = (view.part_mut(row), RowPositions::new(inputs.columns, row));
        let Self { list, zeros } = self;
        for (scalar, (rows, effect)) in list.iter_mut().zip(inputs.law_effects).enumerate() {
            let [levels, beyond] =
                [&rows.level[row % RING], &rows.level[(row + 1) % RING]].map(|levels| &levels[..]);
            let [own_south, north] = rows.south.get_disjoint_mut([row % 2, (row + 1) % 2]).expect("two rows");
            for span in inputs.active.row(row) {
                let (at, len) = (position.of(span.first), span.len as usize);
                let beside = position.beside(levels, beyond, zeros, span);
                find_moved_amounts(beside.own, beside.south, &south[at..], &mut own_south[at..at + len]);
                if is_own {
                    find_moved_amounts(
                        beside.own,
                        &beside.own[1..],
                        &east[at..],
                        &mut rows.east[at..at + len],
                    );
                }
            }
            if !is_own {
                continue;
            }
            let (mut end, changes) = (0, &mut changes[scalar]);
            for span in inputs.active.row(row) {
                let (at, mine, len) =
                    (position.of(span.first), span.first as usize - part.start, span.len as usize);
                if at != end {
                    rows.east[at - 1] = 0.0;
                }
                end = at + len;
                let around = [
                    &rows.east[at..at + len],
                    &rows.east[at - 1..at - 1 + len],
                    &own_south[at..at + len],
                    &position.north(north, zeros, span)[..len],
                ];
                let (depth, amount) =
                    (&part.depth[mine..mine + len], &mut part.amounts[scalar][mine..mine + len]);
                changes.dried += i128::from(move_amounts(&around, depth, amount));
                if *effect != LawEffect::default() {
                    changes.grown += i128::from(apply_law(*effect, depth, amount));
                }
            }
        }
    }
}

/// Concentrations of columns. A plain loop: with strips in a loop, as elsewhere, the compiler would gather single numbers.
fn find_levels(amount: &[f64], depth: &[i32], levels: &mut [f64]) {
    dispatch!(body(amount: &[f64], depth: &[i32], levels: &mut [f64]));

    #[inline(always)]
    fn body(amount: &[f64], depth: &[i32], levels: &mut [f64]) {
        for ((out, amount), depth) in levels.iter_mut().zip(amount).zip(depth) {
            *out = level(*amount, *depth);
        }
    }
}

/// Applies amounts that move to the east, from the west, to the south and from the north. Removes what remains in columns that ran dry, at
/// most half a unit of amount for each pipe, and returns its sum.
fn move_amounts(around: &[&[f64]; 4], depth: &[i32], amount: &mut [f64]) -> i64 {
    return dispatch!(body(around: &[&[f64]; 4], depth: &[i32], amount: &mut [f64]) -> i64);

    #[inline(always)]
    fn body([east, west, south, north]: &[&[f64]; 4], depth: &[i32], amount: &mut [f64]) -> i64 {
        let mut dried = [0.0; STRIP];
        for strip in 0..amount.len() / STRIP {
            let along = [strip_of(east, strip), strip_of(west, strip)];
            let across = [strip_of(south, strip), strip_of(north, strip)];
            move_strip(along, across, strip_of(depth, strip), strip_mut(amount, strip), &mut dried);
        }
        integer(dried.iter().sum())
    }

    #[inline(always)]
    fn move_strip(
        [east, west]: [&[f64; STRIP]; 2],
        [south, north]: [&[f64; STRIP]; 2],
        depth: &[i32; STRIP],
        amount: &mut [f64; STRIP],
        dried: &mut [f64; STRIP],
    ) {
        for x in 0..STRIP {
            let now = amount[x] + ((west[x] - east[x]) + (north[x] - south[x]));
            let is_dry = depth[x] == 0;
            amount[x] = if is_dry { 0.0 } else { now };
            dried[x] += if is_dry { now } else { 0.0 };
        }
    }
}

/// Changes amounts by a law; returns the growth of their sum.
fn apply_law(effect: LawEffect, depth: &[i32], amount: &mut [f64]) -> i64 {
    return dispatch!(body(effect: LawEffect, depth: &[i32], amount: &mut [f64]) -> i64);

    #[inline(always)]
    fn body(effect: LawEffect, depth: &[i32], amount: &mut [f64]) -> i64 {
        let mut grown = [0; STRIP];
        for strip in 0..amount.len() / STRIP {
            apply_to_strip(effect, strip_of(depth, strip), strip_mut(amount, strip), &mut grown);
        }
        grown.iter().sum()
    }

    #[inline(always)]
    fn apply_to_strip(
        effect: LawEffect,
        depth: &[i32; STRIP],
        amount: &mut [f64; STRIP],
        grown: &mut [i64; STRIP],
    ) {
        for x in 0..STRIP {
            let depth = f64::from(depth[x]);
            let before = amount[x];
            let kept = before - nearest(before * effect.loses);
            let older = kept + depth * effect.grows;
            let max = depth * LEVELS;
            let now = if effect.grows > 0.0 && older > max { max } else { older };
            amount[x] = now;
            grown[x] += integer(now - before);
        }
    }
}

impl Network {
    /// Moves the scalars of the network's units, at the concentrations before the transfer; `depth` is that before the transfer, too.
    /// `fallen` receives what goes over overflow edges.
    pub fn move_scalars(
        &self,
        depth: &[i32],
        (overflow_edges, fallen): (&OverflowEdges, &mut [f64]),
        amounts: &mut [f64],
        levels: &mut Vec<f64>,
        changes: &mut Changes,
    ) {
        let of = |column: u32| level(amounts[column as usize], depth[column as usize]);
        refill(levels, self.parties.iter().map(|party| of(party.column)));
        for edge in self.edges.iter().filter(|edge| edge.units != 0) {
            let [from, to] = edge.ends;
            if let PipeIndex::Link(link) = edge.at
                && overflow_edges.at(link as usize) != Fall::No
            {
                let donor = if from == NONE { to } else { from } as usize;
                let moved = share(levels[donor], edge.units.abs() as f64);
                amounts[self.parties[donor].column as usize] -= moved;
                fallen[link as usize] = moved;
                continue;
            }
            let donor = if edge.units > 0 || to == NONE { from } else { to };
            let moved = share(levels[donor as usize], edge.units as f64);
            amounts[self.parties[from as usize].column as usize] -= moved;
            match self.parties.get(to as usize) {
                Some(party) => amounts[party.column as usize] += moved,
                None if edge.units > 0 => changes.lost += i128::from(integer(moved)),
                None => changes.gained -= i128::from(integer(moved)),
            }
        }
    }
}
