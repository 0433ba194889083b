//! Where shallow liquid enters and leaves, and the balance of its volume.

use super::calls::{answer_some, informs};
use super::flow_points::frz_shallow_flow;
use super::handle::{ShallowHandle, frz_shallow};
use crate::capi::ffi::*;
use crate::shallow::Balance;

/// Sets sources, drains and absorbers, replacing the previous ones; what those moved remains in frz_shallow_balance. An absorber that is
/// set again is dry. The next frame may allocate.
///
/// flows: count flow points; NULL with a count of 0: none. FRZ_ERROR_ARGUMENT names the index of one that is out of range, or lies inside a
///     solid or outside the domain; the old ones are then kept.
/// count: number of flow points.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_flows(
    shallow: *mut frz_shallow,
    flows: *const frz_shallow_flow,
    count: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let ShallowHandle { shallow, surroundings, .. } = &mut *change(shallow)?;
        surroundings.set_flows(flows, count, |points| shallow.set_flows(points, |at| format!("flow {at}")))
    })
}

/// Reports the volume that entered or left through a flow point since it was set.
///
/// flow: its index, from 0.
/// volume: receives it (m3); 0 after a failure.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_flow_moved(
    shallow: *const frz_shallow,
    flow: usize,
    volume: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(volume, "volume", || {
            let liquid = read(shallow)?;
            Ok(liquid.shallow.moved(check_index("flow", flow, liquid.surroundings.flows.len())?))
        })
    })
}

/// Pours a volume at a position, shared by the columns that a flow point there would act on; each takes what it has room for, or gives what
/// it has.
///
/// at: double[3], the position (m): FRZ_ERROR_ARGUMENT if it lies inside a solid or outside the domain.
/// radius: as in frz_shallow_flow (m).
/// volume: volume to pour in (m3); negative: to take out.
/// poured: receives the volume poured in (m3), negative if taken out; 0 after a failure. May be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_pour(
    shallow: *mut frz_shallow,
    at: *const f64,
    radius: f64,
    volume: f64,
    poured: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer_some(poured, || {
            let mut liquid = change(shallow)?;
            let at = numbers(at, "at")?;
            finite("volume", volume)?;
            Ok(liquid.shallow.pour_at(at, radius, volume)?)
        })
    })
}

/// Fills all columns up to a height, or to their ceiling; fuller ones are unchanged.
///
/// height: height of the surface (m).
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_fill(shallow: *mut frz_shallow, height: f64) -> frz_status {
    // SAFETY: the liquid is NULL or alive.
    guard(|| unsafe {
        let mut liquid = change(shallow)?;
        finite("height", height)?;
        liquid.shallow.fill(height);
        Ok(())
    })
}

/// Sets the depths of all columns: an initial state from a host, or the liquid of the host's own solver, for its surface. What this adds
/// and removes counts as poured; fluxes are unchanged.
///
/// depths: float for each column index (m), in the order of frz_shallow_read: 0 or more, finite; above its ceiling a column is full.
///     Ignored for an index without a column.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_set_depths(shallow: *mut frz_shallow, depths: frz_view) -> frz_status {
    // SAFETY: the liquid is NULL or alive; the view is valid.
    guard(|| unsafe {
        let shallow = &mut change(shallow)?.shallow;
        let (count, heights) = (shallow.columns().len(), shallow.columns().heights);
        let given = one_for_each::<f32>(&depths, "depths", count, ["there are", "column indices"])?;
        let is_bad = |&(index, depth): &(usize, f32)| {
            shallow.columns().is_column(index) && !(depth >= 0.0 && depth.is_finite())
        };
        if let Some((at, depth)) = given.clone().enumerate().find(is_bad) {
            return Err(Failure::argument(format!("depths: element {at}, {depth} m, is not 0 or more")));
        }
        for (index, depth) in given.enumerate() {
            if shallow.columns().is_column(index) {
                let now = heights.length(f64::from(shallow.depths()[index]));
                shallow.pour(index, f64::from(depth) - now);
            }
        }
        Ok(())
    })
}

/// Where all liquid is, and where it came from (m3; 1 ml is 1e-6). inside + held + falling = poured + sourced + gained - drained - absorbed
/// - lost.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_balance {
    /// sizeof(frz_shallow_balance), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// In the columns.
    pub inside: f64,
    /// Poured in so far, minus what was taken out.
    pub poured: f64,
    /// From sources.
    pub sourced: f64,
    /// To drains.
    pub drained: f64,
    /// To absorbers.
    pub absorbed: f64,
    /// Lost over the border, or where there is no ground.
    pub lost: f64,
    /// From beyond an absorbing border.
    pub gained: f64,
    /// Waiting for room, where ground or a body displaced it.
    pub held: f64,
    /// Error of the balance above, in units of volume (2^-30 of the range of heights, times the area of a cell): always 0, since all
    /// amounts are integers.
    pub error: i64,
    /// In the air.
    pub falling: f64,
}

sized32!(frz_shallow_balance, [falling]);

fields_of!(Balance => frz_shallow_balance {
    inside, poured, sourced, drained, absorbed, lost, gained, held, error, falling
});

/// Reports where all liquid is, and where it came from.
///
/// balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_get_balance(
    shallow: *const frz_shallow,
    balance: *mut frz_shallow_balance,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { informs(balance, || Ok(read(shallow)?.shallow.balance())) }
}
