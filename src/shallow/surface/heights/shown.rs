//! Heights at which columns are shown: wet ones at least a minimum above their base, dry ones somewhat below it, so that the rim of the
//! surface is hidden under the ground; in between, the height follows the depth.

use crate::numeric::cpu::dispatch;
use crate::numeric::lists::reset;
use crate::shallow::columns::grid::TOP;
use crate::shallow::columns::{Columns, STRIP, strip_mut, strip_of};
use crate::shallow::surface::quartets::strips::Found;
use crate::shallow::surface::{Depths, Layout};

/// What determines heights, with the depths (units).
struct Rule<'a> {
    /// Minimum depth of all columns, and how far dry ones are lowered, unless an array gives them.
    least: i32,
    /// Depth from which a column is at its full height.
    fade: i32,
    /// 1 / `fade`.
    per_fade: f32,
    depth: &'a [i32],
    least_of: &'a [i32],
    sunk_of: &'a [i32],
}

/// Reserves memory for the heights of columns.
pub(in crate::shallow::surface) fn reserve(columns: &Columns, heights: &mut Vec<i32>) {
    if heights.len() != columns.len() {
        reset(heights, columns.len(), 0);
    }
}

/// Finds the heights of the columns in all strips listed in `found`.
pub(in crate::shallow::surface) fn find_heights(
    columns: &Columns,
    found: &Found,
    depths: &Depths<'_>,
    layout: &Layout,
    heights: &mut Vec<i32>,
) {
    reserve(columns, heights);
    let units = |length: f64| (length / columns.heights.unit).round().min(f64::from(TOP)) as i32;
    let fade = units(layout.fade_depth);
    let rule = Rule {
        least: units(layout.least_depth),
        fade,
        per_fade: 1.0 / fade.max(1) as f32,
        depth: depths.depth,
        least_of: depths.least,
        sunk_of: depths.sunk,
    };
    let rule = &rule;
    dispatch!(find_strips(columns: &Columns, found: &Found, rule: &Rule<'_>, heights: &mut [i32]))
}

/// The height of one column.
pub fn height_of(columns: &Columns, depths: &Depths<'_>, layout: &Layout, index: usize) -> i32 {
    let units = |length: f64| (length / columns.heights.unit).round().min(f64::from(TOP)) as i32;
    let (least, fade) = (units(layout.least_depth), units(layout.fade_depth));
    let of = |numbers: &[i32]| [numbers.get(index).copied().unwrap_or(least); STRIP];
    let all = [columns.bases(), columns.unders(), depths.depth, depths.least, depths.sunk].map(of);
    let mut out = [0; STRIP];
    if fade > 0 {
        find_strip::<true>(all.each_ref(), [fade as f32, 1.0 / fade as f32], &mut out);
    } else {
        find_strip::<false>(all.each_ref(), [0.0; 2], &mut out);
    }
    out[0]
}

#[inline(always)]
fn find_strips(columns: &Columns, found: &Found, rule: &Rule<'_>, heights: &mut [i32]) {
    let (bases, unders) = (columns.bases(), columns.unders());
    for span in &found.spans {
        for strip in span.first..span.first + span.len {
            let (base, depth) = (strip_of(bases, strip), strip_of(rule.depth, strip));
            let out = strip_mut(heights, strip);
            if found.states[strip].wet == u16::MAX && are_over(depth, rule.fade) {
                match rule.least_of {
                    [] => find_full(base, depth, &[rule.least; STRIP], out),
                    least => find_full(base, depth, strip_of(least, strip), out),
                }
                continue;
            }
            let of = |numbers: &[i32]| {
                if numbers.is_empty() { [rule.least; STRIP] } else { *strip_of(numbers, strip) }
            };
            let (least, sunk) = (of(rule.least_of), of(rule.sunk_of));
            let columns = [base, strip_of(unders, strip), depth, &least, &sunk];
            if rule.fade > 0 {
                find_strip::<true>(columns, [rule.fade as f32, rule.per_fade], out);
            } else {
                find_strip::<false>(columns, [0.0; 2], out);
            }
        }
    }
}

/// Whether all depths of a strip are at least `least`.
#[inline(always)]
fn are_over(depth: &[i32; STRIP], least: i32) -> bool {
    let mut under = [0; STRIP];
    for position in 0..STRIP {
        under[position] = i32::from(depth[position] < least);
    }
    under == [0; STRIP]
}

/// Finds the heights of a strip whose columns are all at their full height.
#[inline(always)]
fn find_full(base: &[i32; STRIP], depth: &[i32; STRIP], least: &[i32; STRIP], out: &mut [i32; STRIP]) {
    for position in 0..STRIP {
        out[position] = base[position].wrapping_add(depth[position].max(least[position]));
    }
}

/// Finds the heights of a strip. Impossible depths may wrap around, but never panic.
#[inline(always)]
fn find_strip<const FADES: bool>(
    [base, under, depth, least, sunk]: [&[i32; STRIP]; 5],
    [fade, per_fade]: [f32; 2],
    out: &mut [i32; STRIP],
) {
    for position in 0..STRIP {
        let (base, depth) = (base[position], depth[position]);
        // Never below the underside of the solid.
        let dry = base.wrapping_sub(sunk[position]).max(under[position]);
        let full = base.wrapping_add(depth.max(least[position]));
        let wet = if FADES {
            let share = depth as f32 * per_fade;
            let risen = dry.wrapping_add((full.wrapping_sub(dry) as f32 * share) as i32);
            if depth as f32 >= fade { full } else { risen }
        } else {
            full
        };
        out[position] = if depth > 0 { wet } else { dry };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights over a base of 1000 with an underside of -50, a minimum depth of 300, and 200 below the base where dry.
    fn heights<const FADES: bool>(depth: [i32; STRIP]) -> [i32; STRIP] {
        let mut out = [7; STRIP];
        let all = [[1000; STRIP], [-50; STRIP], depth, [300; STRIP], [200; STRIP]];
        find_strip::<FADES>(all.each_ref(), [128.0, 1.0 / 128.0], &mut out);
        out
    }

    #[test]
    fn heights_rise_with_the_depth_from_where_they_are_dry() {
        let mut depth = [0; STRIP];
        depth[..9].copy_from_slice(&[-5, 0, 1, 32, 64, 127, 128, 300, 301]);
        assert_eq!(heights::<true>(depth)[..9], [800, 800, 803, 925, 1050, 1296, 1300, 1300, 1301]);
        assert_eq!(heights::<false>(depth)[..9], [800, 800, 1300, 1300, 1300, 1300, 1300, 1300, 1301]);
    }

    #[test]
    fn dry_columns_stay_over_the_underside_of_their_solid() {
        let mut out = [7; STRIP];
        let all = [[1000; STRIP], [950; STRIP], [0; STRIP], [300; STRIP], [200; STRIP]];
        find_strip::<true>(all.each_ref(), [100.0, 0.01], &mut out);
        assert_eq!(out, [950; STRIP]);
    }
}
