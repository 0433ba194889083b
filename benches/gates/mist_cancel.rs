//! Gate of mist that is cancelled through C: the time until its step returns, and that it left all as it was.

use std::cell::Cell;
use std::ptr::{null, null_mut};

use frazil::capi::body::{frz_body, frz_body_init};
use frazil::capi::context::*;
use frazil::capi::library::FRZ_ABI_VERSION;
use frazil::capi::mist::*;
use frazil::capi::mist_params::*;
use frazil::capi::pool::*;
use frazil::capi::{frz_status, frz_view};

use crate::cancel::{view, works};
use crate::cancel_latency::{Steps, measure};
use crate::common::shapes::sphere;
use crate::grains::{FRAME, Random};
use crate::harness::Harness;

/// Edge of a cell (m), and of the cube in which points raise mist.
const CELL: f64 = 0.01;
const CUBE: f64 = 0.9;

/// Mist that points raise around a ball, and a context on two threads.
struct Host {
    pool: *mut frz_pool,
    ctx: *mut frz_context,
    mist: *mut frz_mist,
    places: Vec<[f64; 3]>,
    speeds: Vec<[f32; 3]>,
    ball: [Vec<[f32; 3]>; 2],
    corners: Vec<[u32; 3]>,
    cells: Cell<u64>,
}

impl Host {
    fn new(random: &mut Random) -> Self {
        let mut params = std::mem::MaybeUninit::<frz_mist_params>::uninit();
        let mesh = sphere(0.15, 24);
        let at = |x: f32| {
            mesh.positions.iter().map(|place| [place.x + x, place.y + 0.45, place.z + 0.45]).collect()
        };
        let mut host = Self {
            pool: null_mut(),
            ctx: null_mut(),
            mist: null_mut(),
            places: (0..4000).map(|_| [0, 1, 2].map(|_| CUBE * random.next())).collect(),
            speeds: (0..4000).map(|_| [0, 1, 2].map(|_| 2.0 * random.next() as f32 - 0.5)).collect(),
            ball: [at(0.4), at(0.45)],
            corners: mesh.triangles.clone(),
            cells: Cell::new(0),
        };
        // SAFETY: the pointers are valid, and the parameters are filled before they are read.
        unsafe {
            works(frz_pool_create(2, &mut host.pool));
            works(frz_context_create(FRZ_ABI_VERSION, host.pool, &mut host.ctx));
            works(frz_mist_params_init(params.as_mut_ptr(), size_of::<frz_mist_params>()));
            let mut params = params.assume_init();
            (params.cell, params.from_speed, params.flags) = (CELL, 0.0, FRZ_MIST_FALLING);
            (params.turbulence, params.confinement) = (3.0, 0.3);
            works(frz_mist_create(host.ctx, &params, null(), 0, &mut host.mist));
        }
        host
    }

    fn body(&self) -> frz_body {
        let mut body = std::mem::MaybeUninit::<frz_body>::uninit();
        // SAFETY: the body is filled before it is read.
        let mut body = unsafe {
            works(frz_body_init(body.as_mut_ptr(), size_of::<frz_body>()));
            body.assume_init()
        };
        body.positions = view(&self.ball[0]);
        body.positions_end = view(&self.ball[1]);
        body.indices = view(self.corners.as_flattened());
        body
    }
}

impl Steps for Host {
    fn context(&self) -> *mut frz_context {
        self.ctx
    }

    fn step(&self) -> frz_status {
        let body = self.body();
        let [places, speeds]: [frz_view; 2] = [view(&self.places), view(&self.speeds)];
        let mut report = std::mem::MaybeUninit::<frz_mist_report>::zeroed();
        // SAFETY: the pointers are valid; all zeroes are a report.
        unsafe {
            (*report.as_mut_ptr()).struct_size = size_of::<frz_mist_report>() as u32;
            let status = frz_mist_step_points(
                self.ctx,
                self.mist,
                places,
                speeds,
                0.005,
                null(),
                null(),
                &body,
                1,
                0.0,
                FRAME,
                report.as_mut_ptr(),
            );
            self.cells.set(self.cells.get().max(report.assume_init().cells));
            status
        }
    }

    fn state(&self) -> Vec<u8> {
        let mut size = 0;
        // SAFETY: the pointers are valid, and the room is as large as the call before said.
        unsafe {
            works(frz_mist_save(self.ctx, self.mist, null_mut(), 0, &mut size));
            let mut out = vec![0u8; size];
            works(frz_mist_save(self.ctx, self.mist, out.as_mut_ptr().cast(), size, &mut size));
            out
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe {
            frz_mist_destroy(self.mist);
            frz_context_destroy(self.ctx);
            frz_pool_destroy(self.pool);
        }
    }
}

pub fn run(h: &mut Harness) {
    let name = "snow.mist.cancel_p99";
    if !h.wants(name) {
        return;
    }
    let mut random = Random(42);
    let host = Host::new(&mut random);
    (0..3).for_each(|_| works(host.step()));
    let what = format!("{:.1} million cells of air", host.cells.get() as f64 / 1e6);
    measure(h, name, &host, &mut random, &what);
}
