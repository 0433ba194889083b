//! Liquid at rest: steps skip the strips in which they would change nothing.
//!
//! A pipe *rests* when nothing has flowed through it and nothing will: its flux and the remainder of its transfers are 0, and it is closed,
//! or its donor is dry, or the surfaces at its ends differ by at most [`Bounds::rest_drop`], which drives nothing. A strip rests when all
//! its pipes do, including those that its neighbours own. It sleeps when its neighbours rest, too (`active.rs`). A step would leave it as
//! it is, to the bit: so results do not depend on which strips sleep.

use std::ops::Range;

use super::full::full_of;
use super::link_flow::{LinkFlow, beyond};
use crate::shallow::columns::{Columns, NONE, STRIP, strip_of};
use crate::shallow::pipes::{Links, Pipes};

/// The liquid that is searched for strips at rest.
#[derive(Clone, Copy)]
pub struct RestSearch<'a> {
    /// Columns.
    pub columns: &'a Columns,
    /// Pipes between them.
    pub pipes: &'a Pipes,
    /// H (units).
    pub depth: &'a [i32],
    /// Fluxes and remainders of transfers, each to the east and to the south.
    pub numbers: [&'a [f32]; 4],
    /// Flow through links.
    pub links: &'a LinkFlow,
    /// Heads above the surface of full columns (units).
    pub heads: &'a [f32],
    /// Bounds of rest in the next steps.
    pub bounds: Bounds,
}

/// The quantities of a step that rest depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Surfaces that differ by at most this drive nothing (units); 0: nothing comes to rest.
    pub rest_drop: i32,
    /// What gravity adds to the drop of the surface over a cell, along x and along z (units).
    pub tilt: [i32; 2],
    /// Surface of the liquid at rest beyond the border (units), or BOTTOMLESS: there is none.
    pub still_level: i32,
}

impl RestSearch<'_> {
    /// Whether the columns of a strip rest, with all their pipes except links.
    pub fn rests(&self, strip: usize) -> bool {
        let [east, south, remainder_east, remainder_south] =
            self.numbers.map(|numbers| strip_of(numbers, strip));
        // Moving strips mostly fail this first test.
        if has_nonzero(east)
            || has_nonzero(south)
            || has_nonzero(remainder_east)
            || has_nonzero(remainder_south)
        {
            return false;
        }
        let (first, columns) = (strip * STRIP, self.columns);
        let numbers =
            [columns.bases(), columns.ceilings(), self.depth].map(|numbers| strip_of(numbers, strip));
        // Full columns form a network, which steps handle.
        if full_of(numbers) != [0; STRIP] || has_nonzero(strip_of(self.heads, strip)) {
            return false;
        }
        let rests_east = |i: usize| self.stays_at_rest([i, i + 1], self.pipes.east[i], 0);
        let rests_south = |i: usize, south: u32| {
            self.stays_at_rest([i, south as usize * STRIP + i % STRIP], self.pipes.south[i], 1)
        };
        let is_empty = |i: usize| [0, 2].iter().all(|&east| self.numbers[east][i].to_bits() == 0);
        let (north, below) = (columns.north(strip), columns.south(strip));
        let mut own = first..first + STRIP;
        own.all(|i| rests_east(i) && (below == NONE || rests_south(i, below)))
            && (columns.west(strip).is_none() || is_empty(first - 1) && rests_east(first - 1))
            && (north == NONE || self.north_pipes_rest(strip, north as usize))
    }

    /// Whether the pipes from the northern neighbour of a strip rest.
    fn north_pipes_rest(&self, strip: usize, north: usize) -> bool {
        let [_, south, _, remainder_south] = self.numbers.map(|numbers| strip_of(numbers, north));
        let from = north * STRIP;
        let stays_at_rest =
            |x: usize| self.stays_at_rest([from + x, strip * STRIP + x], self.pipes.south[from + x], 1);
        !has_nonzero(south) && !has_nonzero(remainder_south) && (0..STRIP).all(stays_at_rest)
    }

    /// Whether nothing will flow through a pipe whose flux is 0.
    fn stays_at_rest(&self, [i, j]: [usize; 2], open: f32, axis: usize) -> bool {
        let base = self.columns.bases();
        let fall = base[i] + self.depth[i] - (base[j] + self.depth[j]) + self.bounds.tilt[axis];
        open == 0.0 || fall.abs() <= self.bounds.rest_drop || self.depth[if fall > 0 { i } else { j }] == 0
    }

    /// The ends of those links of a range that do not rest.
    pub fn moving_links(&self, links: Range<usize>) -> impl Iterator<Item = [u32; 2]> {
        let Links { from, to, .. } = &self.pipes.links;
        links.filter(|&link| !self.link_rests(link)).map(|link| [from[link], to[link]])
    }

    fn link_rests(&self, link: usize) -> bool {
        let (links, flow, base) = (&self.pipes.links, self.links, self.columns.bases());
        if has_nonzero(&[flow.flux[link], flow.remainder[link], flow.transfer[link]]) {
            return false;
        }
        let i = links.from[link] as usize;
        let (eta, receiver, is_still) = match links.to[link] {
            NONE => beyond(links, self.columns, link, self.bounds.still_level),
            j => (base[j as usize] + self.depth[j as usize], self.depth[j as usize], false),
        };
        let fall = (base[i] + self.depth[i]).saturating_sub(eta);
        let donor = if fall > 0 { self.depth[i] } else { receiver };
        links.open[link] == 0.0 || fall.saturating_abs() <= self.bounds.rest_drop || donor == 0 && !is_still
    }
}

/// Whether a number is not +0: a step would change -0 into 0.
fn has_nonzero<const N: usize>(numbers: &[f32; N]) -> bool {
    numbers.iter().fold(0, |any, number| any | number.to_bits()) != 0
}
