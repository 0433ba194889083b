//! Loads of shallow liquid on the bodies in it.

use super::handle::{ShallowHandle, frz_shallow};
use crate::capi::ffi::*;
use crate::shallow::Load;

/// The load of a liquid on a body.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_load {
    /// sizeof(frz_shallow_load), set by the caller, the same in all loads of a call.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// Force (N) of the liquid's weight: buoyancy, and the push of deeper liquid on one side.
    pub pressure: [f64; 3],
    /// Force (N) of its motion relative to the body, an estimate.
    pub drag: [f64; 3],
    /// Torque (N m) of both forces about the body's centre.
    pub torque: [f64; 3],
    /// Volume (m3) of the body below the surface of the liquid.
    pub displaced: f64,
    /// Area (m2) of its faces that touch liquid.
    pub wetted: f64,
}

sized32!(frz_shallow_load);

fields_of!(Load => frz_shallow_load { pressure, drag, torque, displaced, wetted });

/// Writes a host's loads, which are contiguous and all of one size.
///
/// # Safety
/// `dst` must be NULL or point to as many structs as there are loads.
unsafe fn put(dst: *mut frz_shallow_load, loads: impl ExactSizeIterator<Item = Load>) -> Outcome {
    // SAFETY: guaranteed by the caller.
    let stride = unsafe { stride_of(dst.cast_const(), loads.len(), "loads", |failure| failure) }?;
    for (at, load) in loads.enumerate() {
        // SAFETY: as above.
        unsafe { fill(dst.byte_add(at * stride), None, load.into())? };
    }
    Ok(())
}

/// Reports the current load of the liquid on each body of frz_shallow_set_bodies (a real-time call: see frz_shallow): the weight that buoys
/// or pushes it, the drag of the flow over it and of its own motion, and how much of it is submerged. The liquid below a body is that found
/// by the last step: make a step after frz_shallow_set_bodies first.
///
/// density: of the liquid (kg/m3), over 0, finite: blood 1060, water 1000.
/// velocities: double[3] for each body (m/s), finite, in their order; data NULL with a count of 0: none of them moves.
/// loads: receives a load for each body, all zeroes after a failure. The struct_size of each is set by the caller.
/// count: number of bodies, as in frz_shallow_set_bodies.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_loads(
    shallow: *mut frz_shallow,
    density: f64,
    velocities: frz_view,
    loads: *mut frz_shallow_load,
    count: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    guard(|| unsafe {
        put(loads, (0..count).map(|_| Load::default()))?;
        let ShallowHandle { shallow, velocities_of_bodies: own, loads: computed, .. } =
            &mut *change(shallow)?;
        let bodies = shallow.bodies().len();
        refuse(count != bodies, || format!("count = {count}, but there are {bodies} bodies"))?;
        own.clear();
        if velocities.data.is_null() && velocities.count == 0 {
            own.resize(bodies, [0.0; 3]);
        } else {
            own.extend(one_for_each::<[f64; 3]>(&velocities, "velocities", bodies, ["there are", "bodies"])?);
        }
        computed.clear();
        computed.resize(bodies, Load::default());
        shallow.loads(density, own, computed)?;
        put(loads, computed.iter().copied())
    })
}
