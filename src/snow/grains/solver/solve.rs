//! The granular solver (thesis section 3.3.1): position based dynamics in small sub-steps, with two corrections per contact.
//!
//! Averaged position projections, or ones with few iterations, lose the weight of the grains above: piles end at a few degrees and deep
//! heaps collapse into themselves. Here each contact keeps an *impulse* from sub-step to sub-step (projected Gauss-Seidel with warm start:
//! Moreau 1988; small steps: Macklin et al. 2019), whose total is bounded by Coulomb's cone, and overlap is removed by a *push*, a
//! displacement that never becomes velocity (split impulse: Guendelman et al. 2003). Impulses are equal and opposite, so a free heap keeps
//! its momentum. Pushes move the upper of two grains if a chain of contacts supports the lower one (mass scaling by height: Macklin et al.
//! 2014), so that one upward sweep gives a heap of any depth the density of its packing. Impulses favour the upper grain slightly if chains
//! support both, so that a deep bed keeps its slope. A sinking grain also loses the part of its velocity that its push undid.
//!
//! Columns are swept upward in a fixed order, in four sets within which they share no grain: any number of threads gives the same bytes.
//! Eight pairs are solved at a time (`contacts`).

use rayon::prelude::*;

use super::blocks::Block;
use super::collide::{Coefficients, Contact, EightGrains, MAX_CORRECTION, MIN_UPWARD, TOUCHING, collide};
use super::layout::Layout;
use super::pairs::Batch;
use super::rest;
use super::rows::{Part, Row, Shared, V, add, dot, norm, scaled, sub};
use crate::context::Context;
use crate::error::Result;
use crate::numeric::cpu::dispatch;
use crate::numeric::lanes::Lanes;
use crate::snow::grains::colliders::touch::Touch;

/// Limits of the motion of grains in a sub-step.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Common displacement of the meshes (diameters).
    pub mesh_displacement: V,
    /// Maximum speed (m/s) that contacts may give a grain, not counting gravity.
    pub fastest: f32,
}

/// One sub-step: forces, contacts, motion. Returns the largest speed (m/s) at its end.
///
/// # Errors
/// Cancel.
pub fn sub_step(
    ctx: &Context,
    rows: &mut [Row],
    layout: &mut Layout,
    c: &Coefficients,
    motion: Motion,
) -> Result<f32> {
    let colours = layout.colours();
    accelerate(rows, layout, c);
    for pass in [Pass::Begin, Pass::Solve, Pass::SolveLast] {
        for colour in &colours {
            ctx.check()?;
            sweep(rows, layout, colour, pass, c);
        }
    }
    Ok(advance(rows, layout, c, motion))
}

/// A sweep over the contacts.
#[derive(Clone, Copy)]
enum Pass {
    /// Applies the impulses of the last sub-step.
    Begin,
    /// Corrects the impulses.
    Solve,
    /// Corrects the impulses, and computes pushes and the data that the next sub-step needs.
    SolveLast,
}

/// Visits the contacts of some columns, upward.
///
/// No two columns of a colour are adjacent. A task changes the members of its own column and their partners in pairs, whose anchors lie
/// within the reach of a contact of the column, which is less than half a column's width.
fn sweep(rows: &mut [Row], layout: &mut Layout, colour: &[u32], pass: Pass, c: &Coefficients) {
    let rows = Shared::new(rows);
    let (columns, blocks) = (&layout.columns, Shared::new(&mut layout.blocks));
    let batches = Shared::new(&mut layout.batches);
    colour.par_iter().with_max_len(1).for_each(|&column| {
        for &block in &columns[column as usize].blocks {
            // SAFETY: a block is in one column, which only one task visits.
            let (block, batches) = unsafe { (blocks.get(block as usize), batches.get(block as usize)) };
            if !block.is_reached {
                continue;
            }
            let touches = &mut block.touches;
            match pass {
                Pass::Begin => {
                    dispatch!(begin_batches(rows: Shared<'_, Row>, batches: &[Batch], c: &Coefficients));
                }
                Pass::Solve => {
                    correct_touches(rows, touches, false, c);
                    dispatch!(solve_batches::<false>(
                        rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients
                    ));
                }
                Pass::SolveLast => {
                    correct_touches(rows, touches, true, c);
                    dispatch!(solve_batches::<true>(
                        rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients
                    ));
                }
            }
        }
    });
}

/// Applies gravity, drag (thesis section 3.3.1) and the impulses of touches from the last sub-step.
fn accelerate(rows: &mut [Row], layout: &mut Layout, c: &Coefficients) {
    let rows = Shared::new(rows);
    let Layout { blocks, neighbours, .. } = layout;
    let air =
        |slot: u32| c.air_by_neighbours.map_or(c.air, |air| air[usize::from(neighbours[slot as usize])]);
    blocks.par_iter_mut().filter(|block| block.is_awake).for_each(|block| {
        for &slot in &block.members {
            // SAFETY: a grain is a member of one block, which only one task visits.
            let row = unsafe { rows.get(slot as usize) };
            if !row.rests() {
                let velocity = add(row.velocity, scaled(c.gravity, c.dt));
                row.velocity = sub(velocity, scaled(velocity, air(slot)));
            }
        }
        for touch in &mut block.touches {
            // SAFETY: a touch's grain is a member of its block, as above.
            let row = unsafe { rows.get(touch.grain as usize) };
            begin_touch(row, touch, c);
        }
    });
}

/// Applies the impulse of a touch from the last sub-step, none after a bounce; a fast approach starts a bounce.
fn begin_touch(row: &mut Row, touch: &mut Touch, c: &Coefficients) {
    touch.clear_bounce();
    touch.friction_now = friction(row, touch, c);
    if c.restitution > 0.0 && !row.rests() {
        let approach = -dot(sub(row.velocity, touch.velocity), touch.normal);
        let gap = dot(touch.normal, row.position) - touch.offset;
        if approach > c.bouncing.max(gap * c.diameter / c.dt) {
            touch.bounce = c.restitution * approach;
        }
    }
    row.velocity = add(row.velocity, scaled(touch.total(), row.weight()));
}

/// Friction of a touch in this sub-step.
///
/// A collider holds a grain with its own friction until the grain slides: a resting grain stays, up to the angle whose tangent is that
/// friction. A real grain that slides would roll, which these cannot. A sliding grain therefore gets the friction between grains, which is
/// lower for the same reason, plus the slope of the surface. So it stops wherever a grain can lie, and slides by Coulomb's law where none
/// can. With full friction, columns that collapse run out a third less far than in experiments, where the ground does not matter (Lube et
/// al. 2004): their lowest layer never moves. Two kinds of grains keep full friction: those that attract each other, which stick together
/// and do not roll, and those on a moving collider, which carries them along with its own friction.
fn friction(row: &Row, touch: &Touch, c: &Coefficients) -> f32 {
    if c.attraction > 0.0 || touch.velocity != [0.0; 3] {
        return touch.friction;
    }
    let velocity = sub(sub(row.velocity, scaled(c.gravity, c.dt)), touch.velocity);
    let sliding = sub(velocity, scaled(touch.normal, dot(velocity, touch.normal)));
    let cosine = dot(touch.normal, c.up);
    if dot(sliding, sliding) <= c.slides || cosine < MIN_UPWARD {
        return touch.friction;
    }
    let slope = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    touch.friction.min(c.friction + slope)
}

/// Moves the grains, after a last correction of touches. Returns the largest speed (m/s).
fn advance(rows: &mut [Row], layout: &mut Layout, c: &Coefficients, motion: Motion) -> f32 {
    let rows = Shared::new(rows);
    let reached = layout.blocks.par_iter_mut().filter(|block| block.is_reached);
    let fastest = reached.map(|block| {
        correct_touches(rows, &mut block.touches, true, c);
        for touch in block.touches.iter().filter(|touch| touch.is_ground) {
            // SAFETY: a touch's grain is a member of its block, which only one task visits.
            keep_outside_ground(unsafe { rows.get(touch.grain as usize) }, touch, c);
        }
        let far = (0.5 * block.skin).powi(2);
        let mut fastest = 0.0f32;
        let Block { members, anchors, .. } = block;
        (block.is_awake, block.has_strayed) = (false, false);
        for (member, &slot) in members.iter().enumerate() {
            // SAFETY: a grain is a member of one block, which only one task visits.
            let row = unsafe { rows.get(slot as usize) };
            if !row.rests() {
                advance_grain(row, c, &motion);
                fastest = fastest.max(dot(row.velocity, row.velocity));
            }
            rest::update(row, c.rest);
            let strayed = [0, 1, 2].map(|axis| row.position[axis] - anchors[axis][member]);
            block.has_strayed |= dot(strayed, strayed) > far;
            block.is_awake |= !row.rests();
        }
        fastest
    });
    fastest.reduce(|| 0.0, f32::max).sqrt()
}

/// Moves a grain; a supported one loses the part of its velocity that its push undid.
///
/// Each contact removes part of its own overlap, so the pushes on a grain that is pressed from all sides add up to more than is needed to
/// resolve them all: their sum is bounded too.
fn advance_grain(row: &mut Row, c: &Coefficients, motion: &Motion) {
    row.push = bounded(row.push, MAX_CORRECTION);
    // The limit excludes the speed that gravity adds in this sub-step: a grain that falls or slides down a slope keeps accelerating.
    let fall = scaled(c.gravity, c.dt);
    let driven = sub(row.velocity, fall);
    let max = motion.fastest * motion.fastest;
    if dot(row.velocity, row.velocity) > max && dot(driven, driven) > max + dot(fall, fall) {
        row.velocity = add(bounded(driven, motion.fastest), fall);
    }
    let displacement = add(scaled(row.velocity, c.dt / c.diameter), row.push);
    row.position = add(row.position, displacement);
    // The travel that is compared with the limit includes that of the common displacement, though the grain may move along.
    row.travel_limit += norm(motion.mesh_displacement) - norm(sub(displacement, motion.mesh_displacement));
    // The square of a push may be over 0 in diameters and underflow to 0 in m/s.
    let back = scaled(row.push, c.diameter / c.dt);
    let square = dot(back, back);
    if row.is_supported() && square > 0.0 {
        let share = (-dot(row.velocity, back) / square).clamp(0.0, 1.0);
        row.velocity = add(row.velocity, scaled(back, share));
    }
}

/// Corrects the touches of a block.
fn correct_touches(rows: Shared<'_, Row>, touches: &mut [Touch], last: bool, c: &Coefficients) {
    for touch in touches {
        // SAFETY: a touch's grain is a member of its block, which only one task visits.
        correct_touch(unsafe { rows.get(touch.grain as usize) }, touch, c, last);
    }
}

/// One correction of a touch.
fn correct_touch(row: &mut Row, touch: &mut Touch, c: &Coefficients, last: bool) {
    if row.rests() {
        return;
    }
    let normal = touch.normal;
    let gap = dot(normal, row.position) - touch.offset;
    let relative = sub(row.velocity, touch.velocity);
    let along = dot(relative, normal);
    let min_impulse = if gap < c.band { -touch.stick * c.weight } else { 0.0 };
    let closing = if gap > 0.0 && min_impulse == 0.0 { -gap * c.diameter / c.dt } else { 0.0 };
    let wanted = if touch.bounce > 0.0 { touch.bounce } else { closing };
    let total = (touch.impulse + wanted - along).max(min_impulse);
    let sliding = sub(relative, scaled(normal, along));
    let tangential = bounded(sub(touch.tangential, sliding), touch.friction_now * (total - min_impulse));
    let impulse = add(scaled(normal, total - touch.impulse), sub(tangential, touch.tangential));
    (touch.impulse, touch.tangential) = (total, tangential);
    row.velocity = add(row.velocity, impulse);
    if gap < TOUCHING && dot(normal, c.up) > MIN_UPWARD && (row.marks == 0.0 || row.marks == rest::WOKEN) {
        row.marks += 1.0;
    }
    if last {
        let missing = (if gap > 0.0 { -gap } else { (-gap).min(MAX_CORRECTION) }) - dot(row.push, normal);
        if missing > 0.0 {
            row.push = add(row.push, scaled(normal, missing));
        }
    }
}

/// Keeps a grain in front of ground, whatever else presses on it: a grain between the ground and an object, or the underside of the base
/// layer, stays on the ground.
fn keep_outside_ground(row: &mut Row, touch: &Touch, c: &Coefficients) {
    if row.rests() {
        return;
    }
    let gap = dot(touch.normal, row.position) - touch.offset;
    let moves = dot(row.velocity, touch.normal) * (c.dt / c.diameter) + dot(row.push, touch.normal);
    let missing = (-gap).min(MAX_CORRECTION) - moves;
    if missing > MAX_GROUND_DEPTH {
        row.push = add(row.push, scaled(touch.normal, missing));
    }
}

/// Depth (diameters) to which other contacts may press a grain into ground.
const MAX_GROUND_DEPTH: f32 = 1.0e-3;

/// A vector shortened to at most a length `max`.
#[inline(always)]
fn bounded(vector: V, max: f32) -> V {
    let square = dot(vector, vector);
    if square > max * max { scaled(vector, max / square.sqrt()) } else { vector }
}

/// Applies the impulses of the last sub-step.
#[inline(always)]
fn begin_batches(rows: Shared<'_, Row>, batches: &[Batch], c: &Coefficients) {
    for (index, batch) in batches.iter().enumerate() {
        prefetch(rows, batches.get(index + AHEAD));
        if batch.impulse == [Lanes::all(0.0); 3] {
            continue;
        }
        // SAFETY: no other task has these grains (see `sweep`); the pairs of a batch share none.
        unsafe {
            let others = batch.others();
            let (a, b) = (EightGrains::load(rows, &batch.owners), EightGrains::load(rows, &others));
            let (a, b) = Contact::between(&a, &b, batch, c).kick(a, b, batch.impulse);
            a.store(rows, &batch.owners);
            b.store(rows, &others);
        }
    }
}

/// Corrects the impulses; in the last sweep of a sub-step also computes pushes.
#[inline(always)]
fn solve_batches<const LAST: bool>(rows: Shared<'_, Row>, batches: &mut [Batch], c: &Coefficients) {
    for index in 0..batches.len() {
        prefetch(rows, batches.get(index + AHEAD));
        let batch = &mut batches[index];
        let others = batch.others();
        // SAFETY: as in `begin_batches`.
        unsafe {
            let (a, b) = (EightGrains::load(rows, &batch.owners), EightGrains::load(rows, &others));
            let (mut a, mut b, contact) = collide(a, b, batch, c);
            if !LAST {
                a.store(rows, &batch.owners);
                b.store(rows, &others);
                continue;
            }
            // Two grains that collide in the air then separate: their impulse is a poor guess for the next sub-step.
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

/// Count of batches by which rows are prefetched ahead.
const AHEAD: usize = 8;

#[inline(always)]
fn prefetch(rows: Shared<'_, Row>, batch: Option<&Batch>) {
    if let Some(batch) = batch {
        rows.prefetch(&batch.owners);
        rows.prefetch(&batch.others());
    }
}

#[cfg(test)]
mod tests {
    use super::super::rows::SUPPORTED;
    use super::*;
    use crate::numeric::cpu::FlushDenormals;
    use crate::snow::grains::Params;
    use crate::snow::grains::params::Division;

    #[test]
    fn a_push_of_any_length_leaves_a_finite_velocity() {
        let params = Params { radius: 0.000_75, ..Params::for_cell(0.005) };
        let c = params.coefficients(&Division { dt: 1.0 / 24.0, sub_steps: 24 });
        let motion = Motion { mesh_displacement: [0.0; 3], fastest: f32::INFINITY };
        let _flush = FlushDenormals::begin();
        let mut push = 1.0e-24;
        while push < 1.0 {
            for velocity in [[0.0, -0.1, 0.0], [0.1, 0.0, 0.0], [0.0; 3]] {
                let mut row = Row { mass_state: 1.0 + SUPPORTED, velocity, ..Row::default() };
                row.push = [0.0, push, 0.0];
                advance_grain(&mut row, &c, &motion);
                assert!(row.velocity.iter().all(|x| x.is_finite()), "{push} {velocity:?}");
            }
            push *= 1.01;
        }
    }
}
