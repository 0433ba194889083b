//! Whole units move through the pipes (thesis Eq. 4.2); what truncation leaves is kept for the next step.
//!
//! Without it thin films freeze: blood of 1 um on a slope of 0.5 moves 0.03 units a step.

use super::scale::Around;
use crate::numeric::cpu::dispatch;
use crate::shallow::columns::{STRIP, strip_mut};
use crate::shallow::scalars::shares::nearest;

/// The integer part of a transfer (units), toward zero.
///
/// # Safety
/// It is at most 2^30 either way: K has been applied.
#[inline(always)]
pub unsafe fn whole(transfer: f32) -> i32 {
    debug_assert!(transfer.abs() <= (1u32 << 30) as f32, "{transfer}");
    // SAFETY: the caller's promise.
    unsafe { transfer.to_int_unchecked() }
}

/// Moves what the pipes of a span transfer; `deepest`, of the positions of a strip, grows to the greatest new depths there.
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
        // SAFETY: all four were scaled by K, or need not be: they are within the depth of the column that gives.
        let [e, w, s, n] = unsafe { [whole(east[x]), whole(west[x]), whole(south[x]), whole(north[x])] };
        depth[x] += (w - e) + (n - s);
        deepest[x] = depth[x].max(deepest[x]);
    }
}

/// Calls `woken` with the position of each strip that has liquid and was dry, or that rested and from or to which something moves.
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

/// Finds what transfers between columns and their neighbours, of these concentrations (levels), take along.
pub fn take_along(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]) {
    dispatch!(body(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]));

    #[inline(always)]
    fn body(own: &[f64], other: &[f64], transfer: &[f32], moved: &mut [f64]) {
        for (((moved, own), other), transfer) in moved.iter_mut().zip(own).zip(other).zip(transfer) {
            // SAFETY: it was scaled by K, as where its units move.
            let units = unsafe { whole(*transfer) };
            // One of both is 0. To choose one of two concentrations, the compiler would gather them.
            let (goes, comes) = (f64::from(units.max(0)), f64::from(units.min(0)));
            *moved = nearest(own * goes + other * comes);
        }
    }
}
