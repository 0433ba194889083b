//! The granular solver (thesis section 3.3.1): position based dynamics in small sub-steps, with two corrections per contact.
//!
//! Averaged or few-iteration position projections lose the weight of what lies above: piles come out at a few degrees and deep
//! heaps sink into themselves. Here each contact keeps an *impulse* from sub-step to sub-step (projected Gauss-Seidel with
//! warm start: Moreau 1988; small steps: Macklin et al. 2019), bounded by Coulomb's cone as a whole, and overlap is removed by a
//! *push*, a displacement that never becomes velocity (split impulse: Guendelman et al. 2003). Impulses are equal and opposite,
//! so a free heap keeps its momentum. Pushes move the upper of two grains, where a chain of contacts holds the lower one (mass
//! scaling by height: Macklin et al. 2014), so that a heap of any depth is as dense as its packing after one sweep upward.
//! What a push takes back of a sinking grain's motion, its velocity loses too.
//!
//! Columns are swept upward, in four sets that share no grain, in a fixed order: the same bytes from any number of threads.

use std::ops::Range;

use rayon::prelude::*;

use super::contacts::{Contacts, Pair, SKIN};
use super::layout::Layout;
use super::rows::{Row, Shared, V, add, dot, norm, scaled, sub};
use super::touch::Touch;

/// Share of an overlap that a sub-step removes.
const REMOVED: f32 = 0.8;
/// Most that a sub-step moves a grain out of an overlap (diameters).
const FARTHEST: f32 = 0.5;
/// Sweeps over the contacts in a sub-step.
const SWEEPS: usize = 2;
/// Gap (diameters) up to which a contact still supports and keeps its impulse.
const TOUCHING: f32 = 0.02;
/// Least upward part of the direction from a grain to one that it supports.
const STEEP: f32 = 0.2;

/// What a sub-step needs besides the grains.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// Length of the sub-step (s).
    pub dt: f32,
    /// Diameter (m).
    pub diameter: f32,
    /// Gravity (m/s2).
    pub gravity: V,
    /// Opposite of gravity's direction; 0 without gravity.
    pub up: V,
    /// Share of the velocity that air takes in a sub-step: 1 - beta^dt.
    pub air: f32,
    /// Friction between grains.
    pub friction: f32,
    /// Largest impulse of attraction in a sub-step (m/s).
    pub attraction: f32,
    /// Gap (diameters) up to which grains attract each other.
    pub band: f32,
}

/// One sub-step: forces, contacts, motion.
pub fn sub_step(
    rows: &mut [Row],
    contacts: &mut Contacts,
    touches: &mut [Touch],
    layout: &Layout,
    c: &Coefficients,
) {
    rows.par_iter_mut().with_min_len(1 << 12).for_each(|row| accelerate(row, c));
    for touch in touches.iter() {
        let row = &mut rows[touch.grain as usize];
        row.velocity = add(row.velocity, scaled(touch.total(), row.weight));
    }
    let colours = layout.colours().map(|colour| {
        let with_touches = |&column: &usize| (column, touches_of(touches, &layout.columns[column].grains));
        colour.iter().map(with_touches).collect::<Vec<_>>()
    });
    for sweep in 0..SWEEPS {
        let last = sweep == SWEEPS - 1;
        for colour in &colours {
            let shares = Shares {
                rows: Shared::new(rows),
                pairs: Shared::new(&mut contacts.pairs),
                touches: Shared::new(touches),
            };
            let starts = &contacts.starts;
            colour.par_iter().for_each(|&(column, ref touching)| {
                let grains = &layout.columns[column].grains;
                // SAFETY: the columns of a colour are no neighbours.
                unsafe { shares.column(grains, starts, touching.clone(), c, last) }
            });
        }
    }
    // What cannot move has the last word.
    for touch in touches.iter_mut() {
        resist(&mut rows[touch.grain as usize], touch, c, true);
    }
    rows.par_iter_mut().with_min_len(1 << 12).for_each(|row| advance(row, c));
}

/// The touches of a range of grains.
fn touches_of(touches: &[Touch], grains: &Range<usize>) -> Range<usize> {
    let before = |grain: usize| touches.partition_point(|touch| (touch.grain as usize) < grain);
    before(grains.start)..before(grains.end)
}

/// What tasks share while they sweep columns of one set.
///
/// Two columns of a set lie at least two apart. A task changes the grains of its own column and those that its pairs name, which
/// lay within a contact's reach of it when they were found, less than half a column's width; pairs and touches belong to one grain.
struct Shares<'a> {
    rows: Shared<'a, Row>,
    pairs: Shared<'a, Pair>,
    touches: Shared<'a, Touch>,
}

impl Shares<'_> {
    /// Solves the contacts that a column's grains own, upward.
    ///
    /// # Safety
    /// No column beside this one may be swept at the same time.
    unsafe fn column(
        &self,
        grains: &Range<usize>,
        starts: &[u32],
        touching: Range<usize>,
        c: &Coefficients,
        last: bool,
    ) {
        let mut touching = touching.peekable();
        for owner in grains.clone() {
            // SAFETY: the grain is of this column.
            let row = unsafe { self.rows.get(owner) };
            // SAFETY: the touch is of this grain.
            while let Some(touch) = touching.peek().map(|&at| unsafe { self.touches.get(at) })
                && touch.grain as usize == owner
            {
                resist(row, touch, c, last);
                touching.next();
            }
            for at in starts[owner] as usize..starts[owner + 1] as usize {
                // SAFETY: the pair is of this grain.
                let pair = unsafe { self.pairs.get(at) };
                // SAFETY: it is of this column or within reach of it, and another grain than its owner.
                let other = unsafe { self.rows.get(pair.other()) };
                collide(row, other, pair, c, last);
            }
        }
    }
}

/// Gravity, air (thesis section 3.3.1), and the impulses of pairs in the last sub-step.
fn accelerate(row: &mut Row, c: &Coefficients) {
    (row.supported, row.supports, row.push) = (row.supports, 0.0, [0.0; 3]);
    if row.weight == 0.0 {
        (row.velocity, row.carried) = ([0.0; 3], [0.0; 3]);
        return;
    }
    let before = add(row.velocity, scaled(c.gravity, c.dt));
    let before = sub(before, scaled(before, c.air));
    (row.velocity, row.carried) = (add(before, row.carried), [0.0; 3]);
}

/// One correction of a pair: impulses, and in the last sweep the push.
#[inline(always)]
fn collide(row: &mut Row, other: &mut Row, pair: &mut Pair, c: &Coefficients, last: bool) {
    let weights = row.weight + other.weight;
    let apart = sub(sub(row.place, pair.shift()), other.place);
    let distance = norm(apart);
    let gap = distance - 1.0;
    if weights == 0.0 || (gap > SKIN && pair.normal == 0.0) {
        return;
    }
    let normal = scaled(apart, 1.0 / distance.max(1.0e-6));
    let relative = sub(row.velocity, other.velocity);
    let along = dot(relative, normal);
    let attracts = c.attraction > 0.0 && gap < c.band;
    let least = if attracts { -c.attraction } else { 0.0 };
    let wanted = if gap > 0.0 && !attracts { -gap * c.diameter / c.dt } else { 0.0 };
    let total = (pair.normal + (wanted - along) / weights).max(least);
    if total != 0.0 || pair.normal != 0.0 {
        let sliding = sub(relative, scaled(normal, along));
        let across = bounded(sub(pair.across, scaled(sliding, 1.0 / weights)), c.friction * (total - least));
        let impulse = add(scaled(normal, total - pair.normal), sub(across, pair.across));
        (pair.normal, pair.across) = (total, across);
        row.velocity = add(row.velocity, scaled(impulse, row.weight));
        other.velocity = sub(other.velocity, scaled(impulse, other.weight));
        let is_held = row.supported.min(other.supported) > 0.0;
        if last && !is_held {
            // Two grains that meet in the air do not meet again: what they gave each other says nothing of the next sub-step.
            (pair.normal, pair.across) = (0.0, [0.0; 3]);
        } else if last {
            let carried = add(scaled(normal, total), across);
            row.carried = add(row.carried, scaled(carried, row.weight));
            other.carried = sub(other.carried, scaled(carried, other.weight));
        }
    }
    let upward = dot(normal, c.up);
    if gap < TOUCHING {
        if upward > STEEP && (other.supports > 0.0 || other.weight == 0.0) {
            row.supports = 1.0;
        }
        if upward < -STEEP && (row.supports > 0.0 || row.weight == 0.0) {
            other.supports = 1.0;
        }
    }
    if last {
        let missing = removed(gap, REMOVED) - dot(sub(row.push, other.push), normal);
        if missing > 0.0 {
            let holds = if upward > 0.0 { other.supported } else { row.supported };
            let share = if row.weight * other.weight > 0.0 { upward * holds } else { 0.0 };
            let push = scaled(normal, missing / weights);
            row.push = add(row.push, scaled(push, row.weight * (1.0 + share)));
            other.push = sub(other.push, scaled(push, other.weight * (1.0 - share)));
        }
    }
}

/// One correction of a grain that touches something that it cannot move.
fn resist(row: &mut Row, touch: &mut Touch, c: &Coefficients, last: bool) {
    if row.weight == 0.0 {
        return;
    }
    let normal = touch.normal;
    let gap = dot(normal, row.place) - touch.offset;
    let relative = sub(row.velocity, touch.velocity);
    let along = dot(relative, normal);
    let wanted = if gap > 0.0 { -gap * c.diameter / c.dt } else { 0.0 };
    let total = (touch.impulse + wanted - along).max(0.0);
    let sliding = sub(relative, scaled(normal, along));
    let across = bounded(sub(touch.across, sliding), touch.friction * total);
    let impulse = add(scaled(normal, total - touch.impulse), sub(across, touch.across));
    (touch.impulse, touch.across) = (total, across);
    row.velocity = add(row.velocity, impulse);
    if gap < TOUCHING && dot(normal, c.up) > STEEP {
        row.supports = 1.0;
    }
    if last {
        let missing = removed(gap, 1.0) - dot(row.push, normal);
        if missing > 0.0 {
            row.push = add(row.push, scaled(normal, missing));
        }
    }
}

/// By how much a sub-step widens a gap (diameters), or may narrow it.
#[inline(always)]
fn removed(gap: f32, share: f32) -> f32 {
    if gap > 0.0 { -gap } else { (-share * gap).min(FARTHEST) }
}

/// A vector of at most a length.
#[inline(always)]
fn bounded(vector: V, most: f32) -> V {
    let square = dot(vector, vector);
    if square > most * most { scaled(vector, most / square.sqrt()) } else { vector }
}

/// Moves a grain; what its push took back of its motion, its velocity loses where something holds it.
fn advance(row: &mut Row, c: &Coefficients) {
    if row.weight == 0.0 {
        return;
    }
    row.place = add(add(row.place, scaled(row.velocity, c.dt / c.diameter)), row.push);
    let square = dot(row.push, row.push);
    if row.supported * square > 0.0 {
        let back = scaled(row.push, c.diameter / c.dt);
        let share = (-dot(row.velocity, back) / dot(back, back)).clamp(0.0, 1.0);
        row.velocity = add(row.velocity, scaled(back, share));
    }
}
