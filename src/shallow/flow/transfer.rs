//! Whole units move through the pipes (thesis Eq. 4.2); what truncation leaves is kept for the next step.
//!
//! Without it thin films freeze: blood of 1 um on a slope of 0.5 moves 0.03 units a step.

use super::scale::Around;
use crate::shallow::columns::STRIP;

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

/// What is left of a transfer (`flux::rounded`) behind its integer part.
#[inline(always)]
pub fn left(transfer: f32, whole: i32) -> f32 {
    if transfer == 0.0 { 0.0 } else { transfer - whole as f32 - 0.5f32.copysign(transfer) }
}

/// Moves what the pipes of a span transfer; returns the greatest new depth. `left_east` and `left_south` receive what truncation leaves.
#[inline(always)]
pub fn move_units(around: &Around, depth: &mut [i32], left_east: &mut [f32], left_south: &mut [f32]) -> i32 {
    let count = depth.len();
    let (east, west) = (&around.east[..count], &around.west[..count]);
    let (south, north) = (&around.south[..count], &around.north[..count]);
    let (left_east, left_south) = (&mut left_east[..count], &mut left_south[..count]);
    let mut deepest = 0;
    for x in 0..count {
        // SAFETY: all four were scaled by K, or need not be: they are within the depth of the column that gives.
        let [e, w, s, n] = unsafe { [whole(east[x]), whole(west[x]), whole(south[x]), whole(north[x])] };
        left_east[x] = left(east[x], e);
        left_south[x] = left(south[x], s);
        depth[x] += (w - e) + (n - s);
        deepest = depth[x].max(deepest);
    }
    deepest
}

/// Calls `got_wet` with the place of each strip that has liquid and was dry.
#[inline(always)]
pub fn find_wet(depth: &[i32], wet: &[bool], mut got_wet: impl FnMut(usize)) {
    for (place, (strip, wet)) in depth.as_chunks::<STRIP>().0.iter().zip(wet).enumerate() {
        if !wet && strip.iter().fold(0, |any, depth| any | depth) != 0 {
            got_wet(place);
        }
    }
}
