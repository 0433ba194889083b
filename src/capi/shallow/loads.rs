//! Loads of shallow liquid on the bodies in it.

use super::spill::{ShallowHandle, frz_shallow};
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::change;
use crate::capi::ffi::views::{Sized32, check_size, fill, frz_view};
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

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_load {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_load";
}

impl From<Load> for frz_shallow_load {
    fn from(load: Load) -> Self {
        let Load { pressure, drag, torque, displaced, wetted } = load;
        Self { struct_size: 0, reserved: 0, pressure, drag, torque, displaced, wetted }
    }
}

/// Writes a host's loads, which are contiguous and all of one size.
///
/// # Safety
/// `dst` must be NULL or point to as many structs as there are loads.
unsafe fn put(dst: *mut frz_shallow_load, loads: impl ExactSizeIterator<Item = Load>) -> Outcome {
    if loads.len() == 0 {
        return Ok(());
    }
    if dst.is_null() {
        return Err(Failure::argument(format!("loads: the data is NULL, but the count is {}", loads.len())));
    }
    // SAFETY: guaranteed by the caller: at least the size of one is there.
    let stride = unsafe { dst.cast::<u32>().read_unaligned() } as usize;
    check_size::<frz_shallow_load>(stride)?;
    let sizes = frz_view { data: dst.cast_const().cast(), count: loads.len(), stride };
    // SAFETY: as above; the sizes must be equal for the structs to be contiguous.
    if unsafe { sizes.in_place::<u32>("loads") }?.any(|size| size as usize != stride) {
        return Err(Failure::argument("loads: their struct_size differs"));
    }
    for (at, load) in loads.enumerate() {
        // SAFETY: as above.
        unsafe { fill(dst.byte_add(at * stride), None, load.into())? };
    }
    Ok(())
}

/// Reports the current load of the liquid on each body of frz_shallow_set_bodies, in real time (frz_shallow): the weight that buoys or
/// pushes it, the drag of the flow over it and of its own motion, and how much of it is submerged. The liquid below a body is that found by
/// the last step: make a step after frz_shallow_set_bodies first.
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
    guard(|| {
        // SAFETY: the pointers are NULL or valid, and so is the view.
        unsafe {
            put(loads, (0..count).map(|_| Load::default()))?;
            let mut spill = change(shallow)?;
            let ShallowHandle { shallow, velocities_of_bodies: own, loads: felt, .. } = &mut *spill;
            let bodies = shallow.bodies().len();
            if count != bodies {
                return Err(Failure::argument(format!("count = {count} is not that of the {bodies} bodies")));
            }
            own.clear();
            if velocities.data.is_null() && velocities.count == 0 {
                own.resize(bodies, [0.0; 3]);
            } else {
                let given = velocities.in_place::<[f64; 3]>("velocities")?;
                if given.len() != bodies {
                    let text = format!("velocities: {} elements, but there are {bodies} bodies", given.len());
                    return Err(Failure::argument(text));
                }
                own.extend(given);
            }
            felt.clear();
            felt.resize(bodies, Load::default());
            shallow.loads(density, own, felt)?;
            put(loads, felt.iter().copied())
        }
    })
}
