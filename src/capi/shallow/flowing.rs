//! What liquids in cells of one size and of two have in common: flow points, pouring, filling.

use super::flow_points::{Attached, frz_shallow_flow};
use super::ground::Terrain;
use crate::capi::ffi::guard::{Failure, Outcome};
use crate::capi::ffi::handle::{HandleType, change, clear, read, required};
use crate::capi::ffi::views::finite;
use crate::error::Result;
use crate::shallow::sources::FlowPoint;

/// A liquid with flow points.
pub(in crate::capi) trait Flowing {
    fn terrain(&self) -> &Terrain;
    /// The host's flow points, in its order.
    fn flows(&self) -> &[Attached];
    /// Replaces them; `points` are where they are now.
    fn set_flows(&mut self, flows: Vec<Attached>, points: &[FlowPoint]) -> Result<()>;
    fn moved(&self, flow: usize) -> f64;
    fn pour_at(&mut self, at: [f64; 3], radius: f64, volume: f64) -> Result<f64>;
    fn fill(&mut self, height: f64);
}

/// Sets flow points from a host's array.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn set_flows<N: HandleType<Value: Flowing>>(
    liquid: *mut N,
    flows: *const frz_shallow_flow,
    count: usize,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    let mut liquid = unsafe { change(liquid) }?;
    // SAFETY: as above.
    let attached = unsafe { Attached::all(flows, count, liquid.terrain()) }?;
    let points: Vec<FlowPoint> = attached.iter().map(|flow| flow.point.clone()).collect();
    Ok(liquid.set_flows(attached, &points)?)
}

/// Writes the volume that a flow point has moved.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn moved<N: HandleType<Value: Flowing>>(
    liquid: *const N,
    flow: usize,
    volume: *mut f64,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        clear(volume);
        let volume = required(volume, "volume")?;
        let liquid = read(liquid)?;
        let count = liquid.flows().len();
        if flow >= count {
            return Err(Failure::argument(format!("flow = {flow} is none of the {count} that were set")));
        }
        volume.write_unaligned(liquid.moved(flow));
    }
    Ok(())
}

/// Pours a volume, and writes how much of it.
///
/// # Safety
/// The pointers must be NULL or valid.
pub(in crate::capi) unsafe fn pour<N: HandleType<Value: Flowing>>(
    liquid: *mut N,
    at: *const f64,
    radius: f64,
    volume: f64,
    poured: *mut f64,
) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe {
        clear(poured);
        let mut liquid = change(liquid)?;
        let at = required(at.cast_mut(), "at")?.cast::<[f64; 3]>().read_unaligned();
        finite("volume", volume)?;
        let moved = liquid.pour_at(at, radius, volume)?;
        if !poured.is_null() {
            poured.write_unaligned(moved);
        }
    }
    Ok(())
}

/// Fills columns up to a height.
///
/// # Safety
/// The liquid must be NULL or alive.
pub(in crate::capi) unsafe fn fill_up<N: HandleType<Value: Flowing>>(liquid: *mut N, height: f64) -> Outcome {
    // SAFETY: guaranteed by the caller.
    let mut liquid = unsafe { change(liquid) }?;
    finite("height", height)?;
    liquid.fill(height);
    Ok(())
}
