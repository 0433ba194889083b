//! Transfers through pipes in whole units (thesis Eq. 4.2); the remainder is kept for the next step.
//!
//! Without remainders thin films freeze: a film of blood 1 um thick on a slope of 0.5 moves 0.03 units per step.

use super::scale::Around;
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{STRIP, strip_mut};
use crate::shallow::scalars::shares::nearest;

/// A transfer (units), truncated toward zero.
///
/// # Safety
/// It must be within +-2^30: K has been applied.
#[inline(always)]
pub unsafe fn whole(transfer: f32) -> i32 {
    debug_assert!(transfer.abs() <= (1u32 << 30) as f32, "{transfer}");
    // SAFETY: guaranteed by the caller.
    unsafe { transfer.to_int_unchecked() }
}

/// Applies the transfers of a span's pipes; raises `deepest`, by position in a strip, to the maximum of the new depths.
#[inline(always)]
pub fn move_units(around: &Around, depth: &mut [i32], deepest: &mut [i32; STRIP]) {
    for strip in 0..depth.len() / STRIP {
        move_strip(&around.strip(strip), strip_mut(depth, strip), deepest);
    }
}

#[inline(always)]
fn move_strip(around: &[&[f32; STRIP]; 4], depth: &mut [i32; STRIP], deepest: &mut [i32; STRIP]) {
    let [east, west, south, north] = around;
    for x in 0..STRIP {
        // SAFETY: all four were scaled by K, or need not be: they are within the donor's depth.
        let [e, w, s, n] = unsafe { [whole(east[x]), whole(west[x]), whole(south[x]), whole(north[x])] };
        depth[x] += (w - e) + (n - s);
        deepest[x] = depth[x].max(deepest[x]);
    }
}

/// Calls `woken` with the position of each strip that was dry and has liquid, or that was at rest and has a transfer in or out.
#[inline(always)]
pub fn find_woken(around: &Around, depth: &[i32], [wet, moving]: [&[bool]; 2], mut woken: impl FnMut(usize)) {
    for (position, ((strip, wet), moving)) in
        depth.as_chunks::<STRIP>().0.iter().zip(wet).zip(moving).enumerate()
    {
        if !wet && strip.iter().fold(0, |any, depth| any | depth) != 0
            || !moving && is_stirred(around, position)
        {
            woken(position);
        }
    }
}

fn is_stirred(around: &Around, strip: usize) -> bool {
    let any = |any: u32, transfer: &f32| any | transfer.to_bits() << 1;
    around.strip(strip).iter().any(|transfers| transfers.iter().fold(0, any) != 0)
}

/// Finds the amounts that transfers between columns and their neighbours move, given the concentrations (levels) of both.
pub fn find_moved_amounts(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]) {
    dispatch!(body(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]));

    #[inline(always)]
    fn body(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]) {
        for (((moved, own), other), transfer) in moved.iter_mut().zip(own).zip(other).zip(transfer) {
            // SAFETY: it was scaled by K, as for its whole units.
            let units = unsafe { whole(*transfer) };
            // One of the two is 0. Selecting one of two concentrations would make the compiler gather them.
            let (goes, comes) = (f64::from(units.max(0)), f64::from(units.min(0)));
            *moved = nearest(own * goes + other * comes);
        }
    }
}
