//! Gate of mist that is cancelled through C: the time until its step returns, and that it left all as it was.

use std::cell::Cell;
use std::ptr::{null, null_mut};

use frazil::capi::snow::mist::*;
use frazil::capi::snow::mist_params::*;
use frazil::capi::snow::mist_points::*;
use frazil::capi::{frz_status, frz_view};

use crate::capi::cancel_latency;
use crate::capi::host::{Threads, body_between, defaults, sized, view, works, written};
use crate::common::shapes::sphere;
use crate::snow::grains::{FRAME, Random};

/// Edge of a cell (m), and of the cube in which points raise mist.
const CELL: f64 = 0.01;
const CUBE: f64 = 0.9;

/// Mist that points raise around a ball.
struct Host {
    threads: Threads,
    mist: *mut frz_mist,
    positions: Vec<[f64; 3]>,
    speeds: Vec<[f32; 3]>,
    ball: [Vec<[f32; 3]>; 2],
    corners: Vec<[u32; 3]>,
    cells: Cell<u64>,
}

impl Host {
    fn new(random: &mut Random) -> Self {
        let mut params = defaults(frz_mist_params_init);
        (params.cell, params.from_speed, params.flags) = (CELL, 0.0, FRZ_MIST_FALLING);
        (params.turbulence, params.confinement) = (3.0, 0.3);
        let mesh = sphere(0.15, 24);
        let at = |x: f32| {
            mesh.positions
                .iter()
                .map(|position| [position.x + x, position.y + 0.45, position.z + 0.45])
                .collect()
        };
        let mut host = Self {
            threads: Threads::new(2),
            mist: null_mut(),
            positions: (0..4000).map(|_| [0, 1, 2].map(|_| CUBE * random.next())).collect(),
            speeds: (0..4000).map(|_| [0, 1, 2].map(|_| 2.0 * random.next() as f32 - 0.5)).collect(),
            ball: [at(0.4), at(0.45)],
            corners: mesh.triangles.clone(),
            cells: Cell::new(0),
        };
        // SAFETY: the pointers are valid.
        unsafe { works(frz_mist_create(host.threads.ctx, &params, null(), 0, &mut host.mist)) };
        host
    }

    fn step(&self) -> frz_status {
        let body = body_between(self.ball.each_ref().map(Vec::as_slice), &self.corners);
        let [positions, speeds]: [frz_view; 2] = [view(&self.positions), view(&self.speeds)];
        let mut report: frz_mist_report = sized();
        // SAFETY: the pointers are valid.
        let status = unsafe {
            frz_mist_step_points(
                self.threads.ctx,
                self.mist,
                positions,
                speeds,
                0.005,
                null(),
                null(),
                &body,
                1,
                0.0,
                FRAME,
                &mut report,
            )
        };
        self.cells.set(self.cells.get().max(report.cells));
        status
    }

    fn state(&self) -> Vec<u8> {
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_mist_save(self.threads.ctx, self.mist, room, capacity, size)
        })
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe { frz_mist_destroy(self.mist) };
    }
}

pub fn measure() -> (f64, String) {
    let mut random = Random(42);
    let host = Host::new(&mut random);
    (0..3).for_each(|_| works(host.step()));
    let what = format!("{:.1} million cells of air", host.cells.get() as f64 / 1e6);
    cancel_latency::measure(&host.threads, || host.step(), || host.state(), &mut random, &what)
}
