//! Lateral friction along lines of adjacent pipes, each line solved at once.
//!
//! Each flux depends on those of the pipes before and behind it: w = r + a w(-1) + b w(+1). Where a and b are small, the last step's values
//! suffice. Otherwise both neighbours are eliminated, which leaves w = r' + a' w(-2) + b' w(+2), and again, at twice the distance each time
//! (cyclic reduction). Since the ground also causes friction, a' and b' soon are small: over a distance of twice the depth little is left.
//! The remaining terms use the last step's fluxes. So a steady flow is exact in any case. Before and behind are treated alike: a line gives
//! the same result from either end.

use std::ops::Range;

use super::buffers::{Lines, Numbers};
use super::{Liquid, numbers_of, spread, within};
use crate::numeric::cpu::dispatch;
use crate::numeric::lists::reset;
use crate::shallow::columns::{Columns, NONE, STRIP, strip_from, strip_mut, strip_of};
use crate::shallow::solver::fast_films::NORMAL;
use crate::shallow::solver::pressurised::network::Network;
use crate::shallow::solver::viscous_flux::{Step, max, min, unpacked};

/// Maximum reductions: a pipe is coupled to all within 16 cells.
const MAX_REDUCTIONS: usize = 4;
/// If a and b add up to at most this, the neighbours' values of the last step are used.
const LAG_LIMIT: f32 = 0.5;
const ZEROS: [f32; STRIP] = [0.0; STRIP];

/// The inputs of a pass over strips.
struct Pass<'a> {
    step: &'a Step,
    liquid: &'a Liquid<'a>,
    has_surroundings: &'a [bool],
    surroundings: &'a [[Numbers; 3]; 2],
    now: &'a [[Numbers; 3]; 2],
    /// Strips before and behind.
    far: [&'a [u32]; 2],
    /// Distance to them (cells).
    distance: usize,
}

impl Lines {
    pub fn fit(&mut self, columns: &Columns) {
        let (len, strips) = (columns.len(), columns.strips().len());
        let lists = self.now.iter_mut().chain(&mut self.next).flatten().chain(&mut self.solved);
        for (position, numbers) in lists.enumerate() {
            numbers.fit(6 + position, len);
        }
        for far in self.far.iter_mut().flatten() {
            reset(far, strips, NONE);
        }
    }

    pub fn bytes(&self) -> usize {
        let lists = self.now.iter().chain(&self.next).flatten().chain(&self.solved);
        lists.map(|numbers| size_of_val(&numbers.list[..])).sum::<usize>() + 16 * self.far[0][0].len()
    }

    pub fn solved(&self) -> [&[f32]; 2] {
        self.solved.each_ref().map(Numbers::all)
    }

    /// Solves the lines of some strips.
    pub fn solve(
        &mut self,
        step: &Step,
        liquid: &Liquid,
        strips: &[u32],
        has_surroundings: &[bool],
        surroundings: &[[Numbers; 3]; 2],
    ) {
        let len = liquid.columns.len();
        let count = reductions(step, liquid.row_depths.iter().copied().max().unwrap_or(0));
        let Self { now, next, solved, far: [far, farther] } = self;
        let thins = step.thinning.is_some();
        let solved = solved.each_mut().map(|numbers| &mut numbers.all_mut()[..len]);
        {
            // The first pass reads no coefficients.
            let pass = Pass {
                step,
                liquid,
                has_surroundings,
                surroundings,
                now: next,
                far: [&[], &[]],
                distance: 1,
            };
            if count == 0 {
                return pass.over(strips, solved, |pass, strips, start, out| {
                    solve_pass(pass, strips, start, out, thins);
                });
            }
            pass.over(strips, numbers_of(now, len), |pass, strips, start, out| {
                begin_pass(pass, strips, start, out, thins);
            });
        }
        set_flooded(now, liquid.network);
        for strip in 0..far[0].len() {
            (far[0][strip], far[1][strip]) = (liquid.columns.north(strip), liquid.columns.south(strip));
        }
        for reduction in 0..count {
            let pass = Pass {
                step,
                liquid,
                has_surroundings,
                surroundings,
                now,
                far: far.each_ref().map(|far| &far[..]),
                distance: 1 << reduction,
            };
            pass.over(strips, numbers_of(next, len), reduce_pass);
            std::mem::swap(now, next);
            for (far, farther) in far.iter().zip(&mut *farther) {
                for (position, &other) in farther.iter_mut().zip(far) {
                    *position = if other == NONE { NONE } else { far[other as usize] };
                }
            }
            std::mem::swap(far, farther);
        }
        let far = far.each_ref().map(|far| &far[..]);
        let pass = Pass { step, liquid, has_surroundings, surroundings, now, far, distance: 1 << count };
        pass.over(strips, solved, end_pass);
    }
}

impl Pass<'_> {
    /// Calls `work` with strips, the first strip of the output, and their part of it; on several threads if the liquid is divided.
    fn over<const N: usize>(
        &self,
        strips: &[u32],
        out: [&mut [f32]; N],
        work: impl Fn(&Self, &[u32], usize, &mut [&mut [f32]; N]) + Sync,
    ) {
        let all = 0..self.liquid.columns.len() / STRIP;
        spread(self.liquid.is_divided, all, out, &|range: Range<usize>, mut out: [&mut [f32]; N]| {
            work(self, within(strips, &range), range.start, &mut out);
        });
    }
}

/// Count of reductions that a step needs, given the maximum depth (units).
fn reductions(step: &Step, deepest: i32) -> usize {
    let deepest = max(deepest as f32, 1.0);
    // a in a line of equal pipes without walls.
    let mut a = step.lateral / (1.0 + 2.0 * step.lateral + step.drag / (deepest * deepest));
    let mut count = 0;
    while 2.0 * a > LAG_LIMIT && count < MAX_REDUCTIONS {
        a = a * a / (1.0 - 2.0 * a * a);
        count += 1;
    }
    count
}

/// Sets the known fluxes of the network's pipes.
fn set_flooded(now: &mut [[Numbers; 3]; 2], network: &Network) {
    for (axis, at, flux) in network.fluxes() {
        let [rest, before, behind] = now[axis].each_mut().map(|numbers| &mut numbers.all_mut()[at]);
        (*rest, *before, *behind) = (flux, 0.0, 0.0);
    }
}

fn solve_pass(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2], thins: bool) {
    if thins {
        dispatch!(solve_strips::<true>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]));
    } else {
        dispatch!(solve_strips::<false>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]));
    }
}

fn begin_pass(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6], thins: bool) {
    if thins {
        dispatch!(begin_strips::<true>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]));
    } else {
        dispatch!(begin_strips::<false>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]));
    }
}

fn reduce_pass(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]) {
    dispatch!(reduce_strips(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]));
}

fn end_pass(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]) {
    dispatch!(end_strips(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]));
}

/// r, a and b of a strip's pipes.
type System = [[f32; STRIP]; 3];

#[inline(always)]
fn solve_strips<const THINS: bool>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]) {
    let ([east, south], step_ratio) = (out, pass.step.step_ratio);
    for &strip in strips {
        let (strip, position) = (strip as usize, strip as usize - start);
        let ([rest, a, b], [before, behind]) = pass.begin_east::<THINS>(strip);
        end_strip(&rest, &a, &b, &before, &behind, step_ratio, strip_mut(east, position));
        let ([rest, a, b], [before, behind]) = pass.begin_south::<THINS>(strip);
        end_strip(&rest, &a, &b, &before, &behind, step_ratio, strip_mut(south, position));
    }
}

#[inline(always)]
fn begin_strips<const THINS: bool>(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]) {
    for &strip in strips {
        let ([rest, a, b], _) = pass.begin_east::<THINS>(strip as usize);
        let at = (strip as usize - start) * STRIP;
        for (out, numbers) in out.iter_mut().zip([&rest, &a, &b]) {
            out[at..at + STRIP].copy_from_slice(numbers);
        }
        let ([rest, a, b], _) = pass.begin_south::<THINS>(strip as usize);
        for (out, numbers) in out[3..].iter_mut().zip([&rest, &a, &b]) {
            out[at..at + STRIP].copy_from_slice(numbers);
        }
    }
}

#[inline(always)]
fn reduce_strips(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 6]) {
    let [east, east_a, east_b, south, south_a, south_b] = out;
    for &strip in strips {
        let (strip, position) = (strip as usize, strip as usize - start);
        let out = (strip_mut(east, position), strip_mut(east_a, position), strip_mut(east_b, position));
        reduce_strip(pass.own(0, strip), pass.far::<0>(strip, 0), pass.far::<0>(strip, 1), out);
        let out = (strip_mut(south, position), strip_mut(south_a, position), strip_mut(south_b, position));
        reduce_strip(pass.own(1, strip), pass.far::<1>(strip, 0), pass.far::<1>(strip, 1), out);
    }
}

/// One reduction of a strip.
#[inline(always)]
fn reduce_strip(
    [rest, a, b]: [&[f32; STRIP]; 3],
    [rest_before, a_before, b_before]: [&[f32; STRIP]; 3],
    [rest_behind, a_behind, b_behind]: [&[f32; STRIP]; 3],
    (new_rest, new_a, new_b): (&mut [f32; STRIP], &mut [f32; STRIP], &mut [f32; STRIP]),
) {
    for x in 0..STRIP {
        let (a, b) = (a[x], b[x]);
        let own = 1.0 / (1.0 - (a * b_before[x] + b * a_behind[x]));
        new_rest[x] = (rest[x] + (a * rest_before[x] + b * rest_behind[x])) * own;
        new_a[x] = a * a_before[x] * own;
        new_b[x] = b * b_behind[x] * own;
    }
}

#[inline(always)]
fn end_strips(pass: &Pass, strips: &[u32], start: usize, out: &mut [&mut [f32]; 2]) {
    for &strip in strips {
        let strip = strip as usize;
        for (axis, out) in out.iter_mut().enumerate() {
            let [rest, a, b] = pass.own(axis, strip);
            let (before, behind) = (pass.last_far(axis, strip, 0), pass.last_far(axis, strip, 1));
            end_strip(rest, a, b, &before, &behind, pass.step.step_ratio, strip_mut(out, strip - start));
        }
    }
}

/// Fluxes, from the last fluxes of the pipes before and behind.
#[inline(always)]
fn end_strip(
    rest: &[f32; STRIP],
    a: &[f32; STRIP],
    b: &[f32; STRIP],
    before: &[f32; STRIP],
    behind: &[f32; STRIP],
    step_ratio: f32,
    out: &mut [f32; STRIP],
) {
    for x in 0..STRIP {
        out[x] = rest[x] + (a[x] * before[x] + b[x] * behind[x]) * step_ratio;
    }
}

/// The pipes of a strip: both of their ends.
struct Pipe<'a> {
    base: [&'a [i32; STRIP]; 2],
    depth: [&'a [i32; STRIP]; 2],
    open: &'a [f32; STRIP],
    light: &'a [u32; STRIP],
    flux: &'a [f32; STRIP],
    /// Total contact and walls of the columns; contact before them and behind.
    all: [&'a [f32; STRIP]; 2],
    contact: [[&'a [f32; STRIP]; 2]; 2],
    /// Depths at both ends of the pipes before and behind.
    before: [&'a [i32; STRIP]; 2],
    behind: [&'a [i32; STRIP]; 2],
}

impl Pass<'_> {
    /// Coefficients of a strip's pipes to the east, and the last fluxes of those before and behind.
    ///
    /// Written without `map` over arrays: closures that are not inlined are compiled without the caller's instruction set.
    #[inline(always)]
    fn begin_east<const THINS: bool>(&self, strip: usize) -> (System, [[f32; STRIP]; 2]) {
        let Liquid { columns, pipes, depth, flux, .. } = *self.liquid;
        let (at, bases) = (strip * STRIP, columns.bases());
        let [total, first, second] = &self.surroundings[0];
        let own = self.contacts::<0>(strip);
        // The columns to the east, and those of the rows before and behind. Pipes beyond the last column are closed.
        let is_known = columns.east(strip).is_none_or(|east| self.has_surroundings[east]);
        let (mut far_total, mut far_first, mut far_second) = (ZEROS, ZEROS, ZEROS);
        let far = if is_known {
            [
                strip_from(total.all(), at + 1),
                strip_from(first.all(), at + 1),
                strip_from(second.all(), at + 1),
            ]
        } else {
            far_total[..STRIP - 1].copy_from_slice(&own[0][1..]);
            far_first[..STRIP - 1].copy_from_slice(&own[1][1..]);
            far_second[..STRIP - 1].copy_from_slice(&own[2][1..]);
            [&far_total, &far_first, &far_second]
        };
        let [north, south] = [columns.north(strip), columns.south(strip)];
        let before = if north == NONE { strip } else { north as usize };
        let behind = if south == NONE { strip } else { south as usize };
        let pipe = Pipe {
            base: [strip_of(bases, strip), strip_from(bases, at + 1)],
            depth: [strip_of(depth, strip), strip_from(depth, at + 1)],
            open: strip_of(&pipes.east, strip),
            light: self.light(strip),
            flux: strip_of(flux[0], strip),
            all: [own[0], far[0]],
            contact: [
                if north == NONE { [&ZEROS; 2] } else { [own[1], far[1]] },
                if south == NONE { [&ZEROS; 2] } else { [own[2], far[2]] },
            ],
            before: [strip_of(depth, before), strip_from(depth, before * STRIP + 1)],
            behind: [strip_of(depth, behind), strip_from(depth, behind * STRIP + 1)],
        };
        let mut system = [ZEROS; 3];
        let [rest, a, b] = &mut system;
        begin_strip::<THINS, 0>(self.step, &pipe, rest, a, b);
        (system, [*strip_of(flux[0], before), *strip_of(flux[0], behind)])
    }

    /// As [`Pass::begin_east`], for pipes to the south.
    #[inline(always)]
    fn begin_south<const THINS: bool>(&self, strip: usize) -> (System, [[f32; STRIP]; 2]) {
        let Liquid { columns, pipes, depth, flux, .. } = *self.liquid;
        let (at, bases) = (strip * STRIP, columns.bases());
        let own = self.contacts::<1>(strip);
        // The columns to the south, and those to the west and east of both.
        let south = columns.south(strip);
        let far = if south == NONE { strip } else { south as usize };
        let far_own =
            if south != NONE && self.has_surroundings[far] { self.contacts::<1>(far) } else { [&ZEROS; 3] };
        let (own_west, far_west) = (shifted(depth, strip, -1), shifted(depth, far, -1));
        let pipe = Pipe {
            base: [strip_of(bases, strip), strip_of(bases, far)],
            depth: [strip_of(depth, strip), strip_of(depth, far)],
            open: strip_of(&pipes.south, strip),
            light: self.light(strip),
            flux: strip_of(flux[1], strip),
            all: [own[0], far_own[0]],
            contact: [[own[1], far_own[1]], [own[2], far_own[2]]],
            before: [&own_west, &far_west],
            behind: [strip_from(depth, at + 1), strip_from(depth, far * STRIP + 1)],
        };
        let mut system = [ZEROS; 3];
        let [rest, a, b] = &mut system;
        begin_strip::<THINS, 1>(self.step, &pipe, rest, a, b);
        if columns.west(strip).is_none() {
            a[0] = 0.0;
        }
        if columns.east(strip).is_none() {
            b[STRIP - 1] = 0.0;
        }
        (system, [shifted(flux[1], strip, -1), shifted(flux[1], strip, 1)])
    }

    /// Total contact and walls of a strip's columns, the contact before them and behind.
    #[inline(always)]
    fn contacts<const AXIS: usize>(&self, strip: usize) -> [&[f32; STRIP]; 3] {
        let [total, first, second] = &self.surroundings[AXIS];
        [total.before(strip, 0), first.before(strip, 0), second.before(strip, 0)]
    }

    /// Inertia divisors of a strip's pipes.
    #[inline(always)]
    fn light(&self, strip: usize) -> &[u32; STRIP] {
        let Liquid { columns, fast, .. } = *self.liquid;
        let row = columns.strips()[strip].row as usize;
        if fast.row(row) { strip_of(&fast.light, strip) } else { &[NORMAL; STRIP] }
    }

    /// r, a and b of a strip.
    #[inline(always)]
    fn own(&self, axis: usize, strip: usize) -> [&[f32; STRIP]; 3] {
        let [rest, a, b] = &self.now[axis];
        [rest.before(strip, 0), a.before(strip, 0), b.before(strip, 0)]
    }

    /// r, a and b of the pipes before (or behind) those of a strip, at the distance of this pass; 0 for absent pipes.
    #[inline(always)]
    fn far<const AXIS: usize>(&self, strip: usize, side: usize) -> [&[f32; STRIP]; 3] {
        let [rest, a, b] = &self.now[AXIS];
        if AXIS == 0 {
            match self.far[side][strip] {
                NONE => [&ZEROS; 3],
                other => self.own(0, other as usize),
            }
        } else if side == 0 {
            let positions = self.distance;
            [rest.before(strip, positions), a.before(strip, positions), b.before(strip, positions)]
        } else {
            let at = strip * STRIP + self.distance;
            [strip_from(rest.all(), at), strip_from(a.all(), at), strip_from(b.all(), at)]
        }
    }

    /// As [`Pass::far`], of the last fluxes.
    #[inline(always)]
    fn last_far(&self, axis: usize, strip: usize, side: usize) -> [f32; STRIP] {
        let flux = self.liquid.flux[axis];
        match (axis, side) {
            (0, _) => match self.far[side][strip] {
                NONE => ZEROS,
                other => *strip_of(flux, other as usize),
            },
            (_, 0) => shifted(flux, strip, -(self.distance as isize)),
            _ => shifted(flux, strip, self.distance as isize),
        }
    }
}

/// The numbers `positions` after those of a strip; 0 where there is none.
#[inline(always)]
fn shifted<T: Copy + Default>(numbers: &[T], strip: usize, positions: isize) -> [T; STRIP] {
    let at = (strip * STRIP) as isize + positions;
    if at >= 0 && at as usize + STRIP <= numbers.len() {
        *strip_from(numbers, at as usize)
    } else {
        std::array::from_fn(|x| {
            usize::try_from(at + x as isize).ok().and_then(|at| numbers.get(at)).copied().unwrap_or_default()
        })
    }
}

/// Coefficients of a strip's pipes. Without lateral friction a pipe has the flux of `flux_of`, to the last bit.
#[inline(always)]
fn begin_strip<const THINS: bool, const AXIS: usize>(
    step: &Step,
    pipe: &Pipe,
    rest: &mut [f32; STRIP],
    a: &mut [f32; STRIP],
    b: &mut [f32; STRIP],
) {
    let Pipe { base, depth, open, light, flux, all, contact, before, behind } = pipe;
    let per_cell = 1.0 / step.cell;
    for x in 0..STRIP {
        let rise = base[0][x] - base[1][x];
        let fall = base[0][x] + depth[0][x] - (base[1][x] + depth[1][x]) + step.tilt[AXIS];
        let depth = [depth[0][x] as f32, depth[1][x] as f32];
        let light = unpacked(light[x])[AXIS];
        let mean = 0.5 * (depth[0] + depth[1]);
        let driven = step.kept * flux[x] + step.drive * light * fall as f32 * min(mean, step.section);
        // Without drive, only neighbours move the liquid: the smaller depth is the same from either end.
        let donor = if driven > 0.0 { depth[0] } else { depth[1] };
        let donor = if driven == 0.0 { min(depth[0], depth[1]) } else { donor };
        let square = donor * donor;
        let thinned = if THINS { step.thinned(flux[x], square) } else { 1.0 };
        let drag = light * if THINS { step.drag * thinned } else { step.drag };
        // On a slope a film is thinner than its vertical depth; for friction at the ground this is in `open`.
        let slope = rise as f32 * per_cell;
        let steep = 1.0 + min(slope * slope, 3.0);
        let lateral = if THINS { step.lateral * light * thinned } else { step.lateral * light } * steep;
        let open = square * open[x];
        let lateral_drag = lateral * (0.5 * (all[0][x] + all[1][x])) / max(mean, 1.0);
        let part = open / (open + drag + lateral_drag * open);
        rest[x] = driven * part;
        let part = part * lateral;
        a[x] = part * contact_share([contact[0][0][x], contact[0][1][x]], [before[0][x], before[1][x]]);
        b[x] = part * contact_share([contact[1][0][x], contact[1][1][x]], [behind[0][x], behind[1][x]]);
    }
}

/// The part of a pipe's section that is in contact, from the contact and the depths at both ends.
#[inline(always)]
fn contact_share(contact: [f32; 2], depth: [i32; 2]) -> f32 {
    min((contact[0] + contact[1]) / max(depth[0] as f32 + depth[1] as f32, 1.0), 1.0)
}
