//! Gate of a mesh's step that is cancelled through C: the time until it returns, and that it left all as it was.

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use frazil::capi::mesh::*;
use frazil::capi::tracker::*;
use frazil::capi::{frz_status, frz_view};

use crate::cancel_latency::{Steps, measure};
use crate::common::liquids::{ball, turned};
use crate::grains::Random;
use crate::harness::Harness;
use crate::host::{Threads, view, works, written};

const NO_VIEW: frz_view = frz_view { data: null(), count: 0, stride: 0 };

/// A ball of particles that turns to and fro, with a mesh around it.
struct Host {
    threads: Threads,
    mesh: *mut frz_mesh,
    tracker: *mut frz_tracker,
    places: [Vec<[f64; 3]>; 2],
    ids: Vec<i64>,
}

impl Host {
    fn new() -> Self {
        let ball = ball(26.0, 100, 0.25);
        let at = |angle: f64| {
            let turned = ball.places.iter().map(|place| turned(*place, angle, Default::default()));
            turned.map(|place| place.into()).collect()
        };
        let mut host = Self {
            threads: Threads::new(2),
            mesh: null_mut(),
            tracker: null_mut(),
            places: [at(0.0), at(0.02)],
            ids: (0..ball.places.len() as i64).collect(),
        };
        let corners: Vec<[f32; 3]> = ball.mesh.positions.iter().map(|place| (*place).into()).collect();
        let desc = frz_mesh_desc {
            struct_size: size_of::<frz_mesh_desc>() as u32,
            flags: 0,
            positions: view(&corners),
            face_counts: NO_VIEW,
            indices: view(ball.mesh.triangles.as_flattened()),
            attributes: null(),
            attribute_count: 0,
        };
        let mut params = MaybeUninit::<frz_tracker_params>::uninit();
        // SAFETY: the pointers are valid, and the parameters are filled before they are read.
        unsafe {
            works(frz_mesh_create(host.threads.ctx, &desc, &mut host.mesh));
            works(frz_tracker_params_init(params.as_mut_ptr(), size_of::<frz_tracker_params>()));
            let mut params = params.assume_init();
            params.spacing = ball.spacing;
            let first = host.particles(0);
            works(frz_tracker_create(
                host.threads.ctx,
                &params,
                host.mesh,
                &first,
                null(),
                0,
                &mut host.tracker,
            ));
        }
        host
    }

    fn particles(&self, frame: usize) -> frz_particles {
        frz_particles {
            struct_size: size_of::<frz_particles>() as u32,
            flags: 0,
            positions: view(&self.places[frame]),
            velocities: NO_VIEW,
            ids: view(&self.ids),
        }
    }
}

impl Steps for Host {
    fn threads(&self) -> &Threads {
        &self.threads
    }

    fn step(&self) -> frz_status {
        let (from, to) = (self.particles(0), self.particles(1));
        // SAFETY: the pointers are valid.
        unsafe { frz_tracker_step(self.threads.ctx, self.tracker, &from, &to, 1.0 / 24.0, null_mut()) }
    }

    fn state(&self) -> Vec<u8> {
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_tracker_save(self.threads.ctx, self.tracker, room, capacity, size)
        })
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe {
            frz_tracker_destroy(self.tracker);
            frz_mesh_destroy(self.mesh);
        }
    }
}

pub fn run(h: &mut Harness) {
    let name = "surface.cancel_p99";
    if !h.wants(name) {
        return;
    }
    let host = Host::new();
    let what = format!("{} particles", host.ids.len());
    measure(h, name, &host, &mut Random(42), &what);
}
