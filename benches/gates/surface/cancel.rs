//! Gates of a mesh's step that is cancelled through C, also of one that rebuilds it, and of the look at one to come: the time until it
//! returns, and that it left all as it was.

use std::cell::Cell;
use std::ptr::{null, null_mut};

use frazil::capi::mesh::triangles::*;
use frazil::capi::tracker::eased::frz_tracker_read_eased;
use frazil::capi::tracker::handle::*;
use frazil::capi::tracker::mesh::*;
use frazil::capi::{frz_span, frz_status};
use frazil::geometry::{DVec3, TriMesh, Vec3};

use crate::capi::cancel_latency;
use crate::capi::host::{self, Threads, defaults, made, sized, view, works, written};
use crate::common::liquids::{ball, context, filled, own_surface, turned};
use crate::harness::Harness;
use crate::snow::grains::Random;

/// Initial distance between particles (m), and time between frames (s).
const SPACING: f64 = 0.01;
const FRAME: f64 = 1.0 / 24.0;
/// Frames ahead, the default.
const AHEAD: u32 = 4;
/// Two blocks of liquid that meet face to face in one step: their edge, and how far apart their outermost particles are before it and
/// after it (spacings). All of both faces is then rebuilt.
const EDGE: f64 = 36.0;
const GAPS: [f64; 2] = [4.0, 1.0];

/// Particles that move, with a mesh around them; each step is the same, as a tracker that has made one is put back.
struct Host {
    threads: Threads,
    /// Trackers are put back on these: no cancel reaches them.
    others: Threads,
    params: frz_tracker_params,
    mesh: *mut frz_mesh,
    tracker: Cell<*mut frz_tracker>,
    /// The tracker's state before a step.
    first: Vec<u8>,
    /// Before a step and after it (m).
    positions: [Vec<[f64; 3]>; 2],
    ids: Vec<i64>,
}

impl Host {
    fn new(places: [Vec<DVec3>; 2], mesh: &TriMesh, is_rebuilt: bool) -> Self {
        let mut params = defaults(frz_tracker_params_init);
        params.spacing = SPACING;
        params.rebuild = u32::from(is_rebuilt);
        let mut host = Self {
            threads: Threads::new(2),
            others: Threads::new(2),
            params,
            mesh: null_mut(),
            tracker: Cell::new(null_mut()),
            first: Vec::new(),
            ids: (0..places[0].len() as i64).collect(),
            positions: places.map(|places| places.iter().map(|place| (*place).into()).collect()),
        };
        let corners: Vec<[f32; 3]> = mesh.positions.iter().map(|place| (*place).into()).collect();
        host.mesh = host::mesh(host.threads.ctx, &corners, &mesh.triangles);
        let (first, ctx) = (host.particles(0), host.threads.ctx);
        // SAFETY: the pointers are valid.
        let create =
            |out| unsafe { frz_tracker_create(ctx, &host.params, host.mesh, &first, null(), 0, out) };
        host.tracker.set(made(create));
        host.first = host.state();
        host
    }

    fn particles(&self, frame: usize) -> frz_particles {
        let mut particles: frz_particles = sized();
        (particles.positions, particles.ids) = (view(&self.positions[frame]), view(&self.ids));
        particles
    }

    /// Makes a step, and puts the tracker back if it was not cancelled; `report` may be null.
    fn step_told(&self, report: *mut frz_tracker_report) -> frz_status {
        let (from, to) = (self.particles(0), self.particles(1));
        // SAFETY: the pointers are valid, or null where that is allowed.
        let status =
            unsafe { frz_tracker_step(self.threads.ctx, self.tracker.get(), &from, &to, FRAME, report) };
        if status == frz_status::FRZ_OK {
            self.put_back();
        }
        status
    }

    /// Reads the vertices as they are shown before the step, which is made for it, into room for each (m), and puts the tracker back if
    /// that was not cancelled, so that the step is to be made again.
    fn look(&self, shown: &mut [[f64; 3]]) -> frz_status {
        let (now, to) = (self.particles(0), self.particles(1));
        let coming: [*const frz_particles; 1] = [&to];
        let room = frz_span { data: shown.as_mut_ptr().cast(), count: shown.len(), stride: 0 };
        // SAFETY: the pointers are valid.
        let status = unsafe {
            frz_tracker_read_eased(
                self.threads.ctx,
                self.tracker.get(),
                &now,
                coming.as_ptr(),
                coming.len(),
                AHEAD,
                FRAME,
                room,
            )
        };
        if status == frz_status::FRZ_OK {
            self.put_back();
        }
        status
    }

    fn put_back(&self) {
        let (ctx, state, size) = (self.others.ctx, self.first.as_ptr().cast(), self.first.len());
        // SAFETY: the pointers are valid, or null where that is allowed.
        let create =
            |out| unsafe { frz_tracker_create(ctx, &self.params, self.mesh, null(), state, size, out) };
        // SAFETY: nobody uses the old tracker any more.
        unsafe { frz_tracker_destroy(self.tracker.replace(made(create))) };
    }

    fn state(&self) -> Vec<u8> {
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_tracker_save(self.threads.ctx, self.tracker.get(), room, capacity, size)
        })
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe {
            frz_tracker_destroy(self.tracker.get());
            frz_mesh_destroy(self.mesh);
        }
    }
}

pub fn run(h: &mut Harness) {
    h.measure("surface.cancel_p99", following);
    rebuilding(h);
}

/// Cancels of a step, or of the look at it.
fn cancels(host: &Host, step: impl Fn() -> frz_status, seed: u64, what: &str) -> (f64, String) {
    cancel_latency::measure(&host.threads, step, || host.state(), &mut Random(seed), what)
}

/// A ball that turns.
fn following() -> (f64, String) {
    let ball = ball(26.0, 100, 0.25);
    let at = |angle: f64| {
        ball.positions.iter().map(|position| turned(*position, angle, Default::default())).collect()
    };
    let host = Host::new([at(0.0), at(0.02)], &ball.mesh, false);
    cancels(&host, || host.step_told(null_mut()), 42, &format!("{} particles", host.ids.len()))
}

/// Two blocks that meet: the step, and the look at it.
fn rebuilding(h: &mut Harness) {
    let names @ [step, look] = ["surface.cancel_rebuilt_p99", "surface.cancel_eased_p99"];
    if !names.iter().any(|name| h.wants(name)) {
        return;
    }
    let half = 0.5 * EDGE * SPACING;
    let block = filled(SPACING, 0.1, half, |position| position.amax() < half);
    let at = |gap: f64| -> Vec<DVec3> {
        // Particles lie half a spacing below a block's faces.
        let by = DVec3::new(half + 0.5 * (gap - 1.0) * SPACING, 0.0, 0.0);
        block.iter().map(|position| position - by).chain(block.iter().map(|position| position + by)).collect()
    };
    let positions = GAPS.map(at);
    let mesh = own_surface(&context(2), &positions[0], SPACING);
    let host = Host::new(positions, &mesh, true);
    let mut report: frz_tracker_report = sized();
    works(host.step_told(&mut report));
    if report.rebuilt_cells == 0 {
        return h.measure_all(names, || [(f64::NAN, "nothing was rebuilt"); 2]);
    }
    let what = format!(
        "{} particles and {} triangles, {} cells flagged and {} rebuilt, {} triangles made",
        host.ids.len(),
        mesh.triangles.len(),
        report.changed_cells,
        report.rebuilt_cells,
        report.made_triangles
    );
    h.measure(step, || cancels(&host, || host.step_told(null_mut()), 43, &what));
    h.measure(look, || looking(&host, &mesh, &what));
}

/// The look at a step to come, from a mesh.
fn looking(host: &Host, mesh: &TriMesh, what: &str) -> (f64, String) {
    let mut shown = vec![[0.0; 3]; mesh.positions.len()];
    works(host.look(&mut shown));
    let is_moved = |(shown, own): &(&[f64; 3], &Vec3)| DVec3::from(**shown) != own.cast::<f64>();
    let moved = shown.iter().zip(&mesh.positions).filter(is_moved).count();
    if moved == 0 {
        return (f64::NAN, "no vertex is eased".into());
    }
    let what = format!("{what}; it is only looked at, and {moved} vertices are eased");
    cancels(host, || host.look(&mut vec![[0.0; 3]; mesh.positions.len()]), 44, &what)
}
