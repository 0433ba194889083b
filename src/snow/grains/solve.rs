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
//! Eight pairs are solved at a time (`contacts`).

use rayon::prelude::*;

use super::contacts::{Batch, SKIN};
use super::layout::{Block, Layout};
use super::rest::{self, Rest};
use super::rows::{Part, Row, SUPPORTED, Shared, V, add, dot, norm, scaled, sub};
use super::touch::Touch;
use crate::base::cpu::dispatch;
use crate::base::lanes::{LaneMask, Lanes};
use crate::context::Context;
use crate::error::Result;

/// Share of an overlap that a sub-step removes.
const REMOVED: f32 = 0.8;
/// Most that a sub-step moves a grain out of an overlap (diameters).
const FARTHEST: f32 = 0.5;
/// Gap (diameters) up to which a contact still supports and keeps its impulse.
const TOUCHING: f32 = 0.02;
/// Gap (diameters) that grains in contact do not close, and overlap that they may keep: pushed out of every last overlap, a heap
/// would never come to rest, as each push opens and closes contacts around it.
const SLACK: f32 = 0.01;
/// As above.
const SLOP: f32 = 0.005;
/// Least distance (diameters) at which two grains have a direction.
const LEAST: f32 = 1.0e-6;
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
    /// What gravity adds to a velocity in a sub-step (m/s).
    pub weight: f32,
    /// Share of its speed with which a grain bounces off.
    pub restitution: f32,
    /// Least speed of approach that bounces (m/s): contacts that carry a weight do not.
    pub bouncing: f32,
    /// Gap (diameters) up to which grains attract each other.
    pub band: f32,
    /// When grains rest; none: never.
    pub rest: Option<Rest>,
    /// Whether all contacts are visited, also where everything rests: the result is the same.
    pub visits_all: bool,
}

/// One sub-step: forces, contacts, motion.
///
/// # Errors
/// Cancel.
pub fn sub_step(ctx: &Context, rows: &mut [Row], layout: &mut Layout, c: &Coefficients) -> Result<()> {
    layout.reach(c.visits_all);
    let colours = layout.colours();
    accelerate(rows, layout, c);
    for pass in [Pass::Begin, Pass::Solve, Pass::SolveLast] {
        for colour in &colours {
            ctx.check()?;
            sweep(rows, layout, colour, pass, c);
        }
    }
    advance(rows, layout, c);
    Ok(())
}

/// A sweep over the contacts.
#[derive(Clone, Copy)]
enum Pass {
    /// Impulses of the last sub-step.
    Begin,
    /// Impulses.
    Solve,
    /// Impulses, pushes and what the next sub-step wants to know.
    SolveLast,
}

/// Visits the contacts of some columns, upward.
///
/// Two columns of a colour lie at least two apart. A task changes the members of its own column's blocks and the grains that their
/// pairs name, whose anchors lay within a contact's reach of it, less than half a column's width.
fn sweep(rows: &mut [Row], layout: &mut Layout, colour: &[u32], pass: Pass, c: &Coefficients) {
    let rows = Shared::new(rows);
    let (columns, blocks) = (&layout.columns, Shared::new(&mut layout.blocks));
    let batches = Shared::new(&mut layout.batches);
    colour.par_iter().with_max_len(1).for_each(|&column| {
        for &block in &columns[column as usize].blocks {
            // SAFETY: a block is in one column.
            let (block, batches) = unsafe { (blocks.get(block as usize), batches.get(block as usize)) };
            if !block.is_reached {
                continue;
            }
            let touches = &mut block.touches;
            match pass {
                Pass::Begin => begin(rows, batches),
                Pass::Solve => {
                    resist_all(rows, touches, false, c);
                    solve(rows, batches, c);
                }
                Pass::SolveLast => {
                    resist_all(rows, touches, true, c);
                    solve_last(rows, batches, c);
                }
            }
        }
    });
}

/// Gravity, air (thesis section 3.3.1), and the impulses that touches had in the last sub-step.
fn accelerate(rows: &mut [Row], layout: &mut Layout, c: &Coefficients) {
    let rows = Shared::new(rows);
    layout.blocks.par_iter_mut().filter(|block| block.is_awake).for_each(|block| {
        for &slot in &block.members {
            // SAFETY: a grain is a member of one block.
            let row = unsafe { rows.get(slot as usize) };
            if !row.rests() {
                let velocity = add(row.velocity, scaled(c.gravity, c.dt));
                row.velocity = sub(velocity, scaled(velocity, c.air));
            }
        }
        for touch in &mut block.touches {
            // SAFETY: a touch's grain is a member of its block.
            let row = unsafe { rows.get(touch.grain as usize) };
            begin_touch(row, touch, c);
        }
    });
}

/// The impulse that a touch had in the last sub-step; or a bounce, after which there is none.
fn begin_touch(row: &mut Row, touch: &mut Touch, c: &Coefficients) {
    touch.forget_bounce();
    if c.restitution > 0.0 && !row.rests() {
        let approach = -dot(sub(row.velocity, touch.velocity), touch.normal);
        let gap = dot(touch.normal, row.place) - touch.offset;
        if approach > c.bouncing.max(gap * c.diameter / c.dt) {
            touch.bounce = c.restitution * approach;
        }
    }
    row.velocity = add(row.velocity, scaled(touch.total(), row.weight()));
}

/// Moves the grains: what cannot move has the last word.
fn advance(rows: &mut [Row], layout: &mut Layout, c: &Coefficients) {
    let rows = Shared::new(rows);
    layout.blocks.par_iter_mut().filter(|block| block.is_reached).for_each(|block| {
        resist_all(rows, &mut block.touches, true, c);
        let Block { members, anchors, .. } = block;
        (block.is_awake, block.has_strayed) = (false, false);
        for (member, &slot) in members.iter().enumerate() {
            // SAFETY: a grain is a member of one block.
            let row = unsafe { rows.get(slot as usize) };
            if !row.rests() {
                move_on(row, c);
            }
            rest::judge(row, c.rest);
            let strayed = [0, 1, 2].map(|axis| row.place[axis] - anchors[axis][member]);
            block.has_strayed |= dot(strayed, strayed) > (0.5 * SKIN).powi(2);
            block.is_awake |= !row.rests();
        }
    });
}

/// Moves a grain; what its push took back of its motion, its velocity loses where something holds it.
fn move_on(row: &mut Row, c: &Coefficients) {
    let way = add(scaled(row.velocity, c.dt / c.diameter), row.push);
    row.place = add(row.place, way);
    row.limit -= norm(way);
    let square = dot(row.push, row.push);
    if row.is_supported() && square > 0.0 {
        let back = scaled(row.push, c.diameter / c.dt);
        let share = (-dot(row.velocity, back) / dot(back, back)).clamp(0.0, 1.0);
        row.velocity = add(row.velocity, scaled(back, share));
    }
}

/// Corrections of the grains that touch something that they cannot move.
fn resist_all(rows: Shared<'_, Row>, touches: &mut [Touch], last: bool, c: &Coefficients) {
    for touch in touches {
        // SAFETY: a touch's grain is a member of its block, which one task has.
        resist(unsafe { rows.get(touch.grain as usize) }, touch, c, last);
    }
}

/// One correction of such a grain.
fn resist(row: &mut Row, touch: &mut Touch, c: &Coefficients, last: bool) {
    if row.rests() {
        return;
    }
    let normal = touch.normal;
    let gap = dot(normal, row.place) - touch.offset;
    let relative = sub(row.velocity, touch.velocity);
    let along = dot(relative, normal);
    let least = if gap < c.band { -touch.stick * c.weight } else { 0.0 };
    let closing = if gap > 0.0 && least == 0.0 { -gap * c.diameter / c.dt } else { 0.0 };
    let wanted = if touch.bounce > 0.0 { touch.bounce } else { closing };
    let total = (touch.impulse + wanted - along).max(least);
    let sliding = sub(relative, scaled(normal, along));
    let across = bounded(sub(touch.across, sliding), touch.friction * (total - least));
    let impulse = add(scaled(normal, total - touch.impulse), sub(across, touch.across));
    (touch.impulse, touch.across) = (total, across);
    row.velocity = add(row.velocity, impulse);
    if gap < TOUCHING && dot(normal, c.up) > STEEP && (row.marks == 0.0 || row.marks == rest::WOKEN) {
        row.marks += 1.0;
    }
    if last {
        let missing = (if gap > 0.0 { -gap } else { (-gap).min(FARTHEST) }) - dot(row.push, normal);
        if missing > 0.0 {
            row.push = add(row.push, scaled(normal, missing));
        }
    }
}

/// A vector of at most a length.
#[inline(always)]
fn bounded(vector: V, most: f32) -> V {
    let square = dot(vector, vector);
    if square > most * most { scaled(vector, most / square.sqrt()) } else { vector }
}

fn begin(rows: Shared<'_, Row>, batches: &[Batch]) {
    dispatch!(begin_batches(rows: Shared<'_, Row>, batches: &[Batch]))
}

fn solve(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients) {
    dispatch!(solve_batches(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients))
}

fn solve_last(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients) {
    dispatch!(solve_batches_last(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients))
}

/// Gives grains the impulses of the last sub-step.
#[inline(always)]
fn begin_batches(rows: Shared<'_, Row>, batches: &[Batch]) {
    for (index, batch) in batches.iter().enumerate() {
        prefetch(rows, batches.get(index + AHEAD));
        if batch.impulse == [Lanes::all(0.0); 3] {
            continue;
        }
        // SAFETY: see `sweep`; the pairs of a batch share no grain.
        unsafe {
            let others = batch.others();
            let (a, b) = (Eight::load(rows, &batch.owners), Eight::load(rows, &others));
            a.kicked(batch.impulse, a.weight).store(rows, &batch.owners);
            b.kicked(batch.impulse, Lanes::all(0.0) - b.weight).store(rows, &others);
        }
    }
}

#[inline(always)]
fn solve_batches(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients) {
    for index in 0..batches.len() {
        prefetch(rows, batches.get(index + AHEAD));
        let batch = &mut batches[index];
        let others = batch.others();
        // SAFETY: as in `begin_batches`.
        unsafe {
            let (a, b) = (Eight::load(rows, &batch.owners), Eight::load(rows, &others));
            let (a, b, ..) = collide(a, b, batch, c);
            a.store(rows, &batch.owners);
            b.store(rows, &others);
        }
    }
}

#[inline(always)]
fn solve_batches_last(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients) {
    for index in 0..batches.len() {
        prefetch(rows, batches.get(index + AHEAD));
        let batch = &mut batches[index];
        let others = batch.others();
        // SAFETY: as in `begin_batches`.
        unsafe {
            let (a, b) = (Eight::load(rows, &batch.owners), Eight::load(rows, &others));
            let (mut a, mut b, contact) = collide(a, b, batch, c);
            // Two grains that meet in the air do not meet again: what they gave each other says nothing of the next sub-step.
            let mut is_held = a.supported & b.supported;
            is_held = is_held | (a.supported | b.supported) & contact.gap.is_less(Lanes::all(TOUCHING));
            if c.attraction > 0.0 {
                is_held = is_held | contact.gap.is_less(Lanes::all(c.band));
            }
            if c.restitution > 0.0 {
                (a, b) = contact.bounce(a, b, is_held, &batch.impulse, c);
            }
            a.store(rows, &batch.owners);
            b.store(rows, &others);
            let pushes = [rows.gather(&batch.owners, Part::Push), rows.gather(&others, Part::Push)];
            let pushes = contact.push(&a, &b, pushes, c);
            rows.scatter(&batch.owners, Part::Push, &pushes[0]);
            rows.scatter(&others, Part::Push, &pushes[1]);
            for impulse in &mut batch.impulse {
                *impulse = is_held.choose(*impulse, Lanes::all(0.0));
            }
        }
    }
}

/// How many batches ahead rows are asked for.
const AHEAD: usize = 8;

#[inline(always)]
fn prefetch(rows: Shared<'_, Row>, batch: Option<&Batch>) {
    if let Some(batch) = batch {
        rows.prefetch(&batch.owners);
        rows.prefetch(&batch.others());
    }
}

type V8 = [Lanes; 3];

#[inline(always)]
fn add8(a: V8, b: V8) -> V8 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn sub8(a: V8, b: V8) -> V8 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn scaled8(a: V8, s: Lanes) -> V8 {
    [a[0] * s, a[1] * s, a[2] * s]
}

#[inline(always)]
fn dot8(a: V8, b: V8) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Eight grains of a batch.
#[derive(Clone, Copy)]
struct Eight {
    place: V8,
    weight: Lanes,
    supported: LaneMask,
    velocity: V8,
    still: Lanes,
}

impl Eight {
    /// # Safety
    /// As for [`Shared::gather`].
    #[inline(always)]
    unsafe fn load(rows: Shared<'_, Row>, slots: &[u32; 8]) -> Self {
        // SAFETY: the caller's promise.
        let ([x, y, z, hold], [u, v, w, still]) =
            unsafe { (rows.gather(slots, Part::Place), rows.gather(slots, Part::Velocity)) };
        let free = hold.is_less(Lanes::all(SUPPORTED));
        let weight = free.choose(hold, hold - Lanes::all(SUPPORTED));
        let supported = Lanes::all(1.5).is_less(hold);
        Self { place: [x, y, z], weight, supported, velocity: [u, v, w], still }
    }

    /// Writes the velocities.
    ///
    /// # Safety
    /// As for [`Shared::scatter`].
    #[inline(always)]
    unsafe fn store(&self, rows: Shared<'_, Row>, slots: &[u32; 8]) {
        let [u, v, w] = self.velocity;
        // SAFETY: the caller's promise.
        unsafe { rows.scatter(slots, Part::Velocity, &[u, v, w, self.still]) };
    }

    /// With an impulse.
    #[inline(always)]
    fn kicked(self, impulse: V8, weight: Lanes) -> Self {
        Self { velocity: add8(self.velocity, scaled8(impulse, weight)), ..self }
    }
}

/// How eight pairs lie to each other.
struct Contact {
    /// From the others to the owners.
    normal: V8,
    gap: Lanes,
    /// Sum of the weights, and its inverse.
    weights: Lanes,
    inverse: Lanes,
}

/// One correction of the velocities and impulses of eight pairs.
#[inline(always)]
fn collide(a: Eight, b: Eight, batch: &mut Batch, c: &Coefficients) -> (Eight, Eight, Contact) {
    let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
    let weights = a.weight + b.weight;
    // 1 / weights, of 1 and 2.
    let inverse = Lanes::all(1.5) - Lanes::all(0.5) * weights;
    let apart = sub8(sub8(a.place, batch.shift()), b.place);
    let distance = dot8(apart, apart).sqrt();
    let gap = distance - one;
    let [x, y, z] = scaled8(apart, one / distance.max(Lanes::all(LEAST)));
    // Two grains at one place part upward.
    let is_none = distance.is_less(Lanes::all(LEAST));
    let normal = [is_none.choose(zero, x), is_none.choose(one, y), is_none.choose(zero, z)];
    let relative = sub8(a.velocity, b.velocity);
    let along = dot8(relative, normal);
    let is_apart = zero.is_less(gap);
    let closing = zero - gap * Lanes::all(c.diameter / c.dt);
    let (least, wanted) = if c.attraction > 0.0 {
        let attracts = gap.is_less(Lanes::all(c.band));
        let least = attracts.choose(Lanes::all(-c.attraction), zero);
        (least, attracts.choose(zero, is_apart.choose(closing, zero)))
    } else {
        let is_open = Lanes::all(SLACK).is_less(gap);
        (zero, is_open.choose(closing, zero))
    };
    let before = batch.impulse;
    let before_along = dot8(before, normal);
    let total = (before_along + (wanted - along) * inverse).max(least);
    let sliding = sub8(relative, scaled8(normal, along));
    let across = sub8(sub8(before, scaled8(normal, before_along)), scaled8(sliding, inverse));
    let most = Lanes::all(c.friction) * (total - least);
    let square = dot8(across, across);
    let exceeds = (most * most).is_less(square);
    let share = exceeds.choose(most / square.sqrt().max(Lanes::all(1.0e-30)), one);
    let impulse = add8(scaled8(normal, total), scaled8(across, share));
    let moves = zero.is_less(weights);
    for (axis, impulse) in impulse.into_iter().enumerate() {
        batch.impulse[axis] = moves.choose(impulse, before[axis]);
    }
    let change = sub8(batch.impulse, before);
    let (push, back) = (a.weight, zero - b.weight);
    (a.kicked(change, push), b.kicked(change, back), Contact { normal, gap, weights, inverse })
}

impl Contact {
    /// Grains that nothing holds bounce: what stopped them (the impulses so far) tells how fast they met (Poisson's hypothesis).
    #[inline(always)]
    fn bounce(
        &self,
        a: Eight,
        b: Eight,
        is_held: LaneMask,
        impulse: &V8,
        c: &Coefficients,
    ) -> (Eight, Eight) {
        let zero = Lanes::all(0.0);
        let stopped = dot8(*impulse, self.normal) * self.weights;
        let closing = self.gap.max(zero) * Lanes::all(c.diameter / c.dt);
        let approach = stopped + closing;
        let meets = zero.is_less(stopped) & Lanes::all(c.bouncing).is_less(approach);
        let wanted = is_held.choose(zero, meets.choose(approach * Lanes::all(c.restitution) + closing, zero));
        let change = scaled8(self.normal, wanted * self.inverse);
        (a.kicked(change, a.weight), b.kicked(change, zero - b.weight))
    }

    /// Pushes of eight pairs, and what they find out: which grains are supported, and which something wakes.
    #[inline(always)]
    fn push(&self, a: &Eight, b: &Eight, pushes: [[Lanes; 4]; 2], c: &Coefficients) -> [[Lanes; 4]; 2] {
        let (zero, one) = (Lanes::all(0.0), Lanes::all(1.0));
        let [x, y, z] = c.up;
        let upward = dot8(self.normal, [Lanes::all(x), Lanes::all(y), Lanes::all(z)]);
        let moves = zero.is_less(self.weights);
        let [[ax, ay, az, a_marks], [bx, by, bz, b_marks]] = pushes;
        let (a_push, b_push) = ([ax, ay, az], [bx, by, bz]);
        // Overlap is removed, and a gap stays one.
        let overlap = zero - self.gap;
        let some = ((overlap - Lanes::all(SLOP)).max(zero) * Lanes::all(REMOVED)).min(Lanes::all(FARTHEST));
        let removed = zero.is_less(self.gap).choose(overlap, some);
        let missing = removed - dot8(sub8(a_push, b_push), self.normal);
        let is_up = zero.is_less(upward);
        let (a_holds, b_holds) = (a.supported.choose(one, zero), b.supported.choose(one, zero));
        let share = upward * is_up.choose(b_holds, a_holds) * a.weight * b.weight;
        let amount = (zero.is_less(missing) & moves).choose(missing * self.inverse, zero);
        let push = scaled8(self.normal, amount);
        let [ax, ay, az] = add8(a_push, scaled8(push, a.weight * (one + share)));
        let [bx, by, bz] = sub8(b_push, scaled8(push, b.weight * (one - share)));
        // Chains of contacts that lead down to something fixed.
        let (half, woken) = (Lanes::all(0.5), Lanes::all(rest::WOKEN));
        let (a_rests, b_rests) = (a.weight.is_less(half), b.weight.is_less(half));
        let (a_wakes, b_wakes) = (Lanes::all(1.5).is_less(a_marks), Lanes::all(1.5).is_less(b_marks));
        let a_stands = a_wakes.choose(a_marks - woken, a_marks);
        let b_stands = b_wakes.choose(b_marks - woken, b_marks);
        let touching = self.gap.is_less(Lanes::all(TOUCHING));
        let steep = if c.attraction > 0.0 { -2.0 } else { STEEP };
        let up = touching & Lanes::all(steep).is_less(upward) & (half.is_less(b_stands) | b_rests);
        let down = touching & upward.is_less(Lanes::all(-steep)) & (half.is_less(a_stands) | a_rests);
        let (a_stands, b_stands) = (up.choose(one, a_stands), down.choose(one, b_stands));
        // A grain that moves wakes its neighbours.
        let near = self.gap.is_less(Lanes::all(rest::NEAR));
        let moving = Lanes::all(c.rest.map_or(0.0, |rule| rule.moving));
        let a_moves = half.is_less(a.weight) & a.still.is_less(moving);
        let b_moves = half.is_less(b.weight) & b.still.is_less(moving);
        let a_marks = a_stands + (a_wakes | (near & a_rests & b_moves)).choose(woken, zero);
        let b_marks = b_stands + (b_wakes | (near & b_rests & a_moves)).choose(woken, zero);
        [[ax, ay, az, a_marks], [bx, by, bz, b_marks]]
    }
}
