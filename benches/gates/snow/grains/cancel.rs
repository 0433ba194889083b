//! Gate of grains that are cancelled through C: the time until their step returns, and that it left all as it was.

use std::ptr::{null, null_mut};

use frazil::capi::snow::grains::*;
use frazil::capi::snow::grains_params::*;
use frazil::capi::snow::grains_points::*;
use frazil::capi::{frz_status, frz_view};

use crate::capi::cancel_latency;
use crate::capi::host::{Threads, defaults, view, works, written};
use crate::snow::grains::{FRAME, Random};

/// Length (s) and sub-steps of a step: a part of a frame, as a whole one would take minutes to cancel so often.
const STEP: (f64, u32) = (FRAME / 3.0, 5);
/// Grains along each axis of the block that collapses: 200,000 of them.
const SIDES: [u32; 3] = [80, 32, 80];

/// Grains that are awake.
struct Host {
    threads: Threads,
    grains: *mut frz_grains,
}

impl Host {
    fn new(random: &mut Random) -> Self {
        let mut host = Self { threads: Threads::new(2), grains: null_mut() };
        let mut params = defaults(frz_grains_params_init);
        (params.radius, params.sub_steps) = (0.0025, STEP.1);
        params.flags = FRZ_GRAINS_FLOOR | FRZ_GRAINS_RESTLESS;
        let apart = 1.1 * 2.0 * 0.0025;
        let sites = (0..SIDES[0]).flat_map(|x| (0..SIDES[1]).map(move |y| [x, y]));
        let sites = sites.flat_map(|[x, y]| (0..SIDES[2]).map(move |z| [x, y, z]));
        let mut off = |at: u32| ((f64::from(at) + 0.5 + 0.05 * random.next()) * apart) as f32;
        let positions: Vec<[f32; 3]> = sites.map(|site| site.map(&mut off)).collect();
        let none = frz_view { data: null(), count: 0, stride: 0 };
        // SAFETY: the pointers are valid.
        unsafe {
            works(frz_grains_create(host.threads.ctx, &params, null(), 0, &mut host.grains));
            works(frz_grains_emit(host.threads.ctx, host.grains, view(&positions), none, 0, null_mut()));
        }
        host
    }

    fn step(&self) -> frz_status {
        // SAFETY: the pointers are valid.
        unsafe { frz_grains_step(self.threads.ctx, self.grains, null(), null(), 0, STEP.0, 1, null_mut()) }
    }

    fn state(&self) -> Vec<u8> {
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_grains_save(self.threads.ctx, self.grains, room, capacity, size)
        })
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe { frz_grains_destroy(self.grains) };
    }
}

pub fn measure() -> (f64, String) {
    let mut random = Random(42);
    let host = Host::new(&mut random);
    // Until they lie on each other.
    (0..12).for_each(|_| works(host.step()));
    cancel_latency::measure(
        &host.threads,
        || host.step(),
        || host.state(),
        &mut random,
        &format!("{} grains", SIDES.iter().product::<u32>()),
    )
}
