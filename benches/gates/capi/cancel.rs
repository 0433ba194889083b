//! Cancel and reset while a call runs: it answers FRZ_CANCELLED, or FRZ_OK with all of its work done.

use std::ptr::{null, null_mut};
use std::time::{Duration, Instant};

use frazil::capi::frz_status;
use frazil::capi::grid::bytes::*;
use frazil::capi::grid::sparse::*;
use frazil::capi::level_set::body::frz_body;
use frazil::capi::level_set::tools::*;
use frazil::capi::mesh::triangles::*;
use frazil::capi::runtime::context::*;
use frazil::capi::snow::base_layer::*;
use frazil::capi::snow::layer::*;

use crate::capi::host::{self, Threads, body_between, defaults, mesh, view, works, written};
use crate::common::shapes;
use crate::snow::grains::Random;

/// Rounds for each function.
const ROUNDS: usize = 2000;
const VOXEL: f64 = 0.04;

/// What a call answered, and all bytes of what it made or changed; none where it made nothing.
type Answer = (frz_status, Vec<u8>);

/// A function under test: `Host` is its work, the context that of the call.
struct Function {
    name: &'static str,
    call: fn(&Host, *mut frz_context) -> Answer,
    /// What is there after a cancel.
    before: fn(&Host) -> Vec<u8>,
}

const FUNCTIONS: [Function; 8] = [
    Function { name: "base_step", call: Host::base_step, before: Host::untouched },
    Function { name: "snow_layer", call: Host::snow_layer, before: Host::nothing },
    Function { name: "from_mesh", call: Host::mesh_to_grid, before: Host::nothing },
    Function { name: "sweep", call: Host::sweep, before: Host::nothing },
    Function { name: "offset", call: Host::offset, before: Host::snow_bytes },
    Function { name: "particles", call: Host::particles, before: Host::nothing },
    Function { name: "smooth", call: Host::smooth, before: Host::snow_bytes },
    Function { name: "displace", call: Host::displace, before: Host::snow_bytes },
];

/// Two contexts: one that is cancelled, and one that makes and looks.
struct Host {
    cancelled: Threads,
    calm: Threads,
    snow: *mut frz_grid,
    mesh: *mut frz_mesh,
    /// A ball before and after a step, and its triangles.
    ball: [Vec<[f32; 3]>; 2],
    triangles: Vec<[u32; 3]>,
    centres: Vec<[f32; 3]>,
    radii: Vec<f32>,
}

impl Host {
    fn new() -> Self {
        let mut ball = shapes::sphere(0.15, 8);
        ball.positions.iter_mut().for_each(|p| p.y += 0.3);
        let at =
            |by: [f32; 3]| ball.positions.iter().map(|p| [p.x + by[0], p.y + by[1], p.z + by[2]]).collect();
        let spread = |n: usize, step: usize| (n * step % 97) as f32 / 97.0;
        let mut host = Self {
            cancelled: Threads::new(2),
            calm: Threads::new(2),
            snow: null_mut(),
            mesh: null_mut(),
            ball: [at([0.0; 3]), at([0.1, -0.05, 0.05])],
            triangles: ball.triangles.clone(),
            centres: (0..60).map(|n| [spread(n, 13), spread(n, 29), spread(n, 53)]).collect(),
            radii: (0..60).map(|n| 0.08 + 0.08 * spread(n, 71)).collect(),
        };
        // SAFETY: the pointers are valid.
        unsafe { works(frz_snow_layer(host.calm.ctx, &host.layer(), &mut host.snow)) };
        host.mesh = mesh(host.calm.ctx, &host.ball[0], &host.triangles);
        host
    }

    /// A small layer.
    fn layer(&self) -> frz_snow_desc {
        let mut desc = defaults(frz_snow_desc_init);
        desc.voxel_size = VOXEL;
        desc.depth = 0.2;
        desc.area = [-0.3, -0.3, 0.3, 0.3];
        desc
    }

    fn body(&self) -> frz_body {
        body_between(self.ball.each_ref().map(Vec::as_slice), &self.triangles)
    }

    fn nothing(&self) -> Vec<u8> {
        Vec::new()
    }

    fn snow_bytes(&self) -> Vec<u8> {
        self.bytes(&[self.snow.cast_const()])
    }

    fn untouched(&self) -> Vec<u8> {
        let base = self.base();
        let bytes = self.base_bytes(base);
        // SAFETY: it is this function's own.
        unsafe { frz_base_destroy(base) };
        bytes
    }

    fn bytes(&self, grids: &[*const frz_grid]) -> Vec<u8> {
        let none = frz_compression::FRZ_COMPRESSION_NONE as u32;
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_grid_to_bytes(self.calm.ctx, grids.as_ptr(), grids.len(), none, 0, room, capacity, size)
        })
    }

    fn base(&self) -> *mut frz_base {
        // SAFETY: the pointers are valid.
        host::made(|base| unsafe { frz_base_create(self.calm.ctx, null(), self.snow, null(), 0, base) })
    }

    fn base_bytes(&self, base: *const frz_base) -> Vec<u8> {
        // SAFETY: the layer is there.
        unsafe { self.bytes(&[frz_base_grid(base), frz_base_removed(base), frz_base_compression(base)]) }
    }

    fn base_step(&self, ctx: *mut frz_context) -> Answer {
        let base = self.base();
        // SAFETY: the pointers are valid.
        let status = unsafe { frz_base_step(ctx, base, &self.body(), 1, 1.0 / 24.0, 1, null_mut()) };
        let bytes = self.base_bytes(base);
        // SAFETY: it is this function's own.
        unsafe { frz_base_destroy(base) };
        (status, bytes)
    }

    /// Makes a grid, looks at it, and destroys it.
    fn made(&self, make: impl FnOnce(*mut *mut frz_grid) -> frz_status) -> Answer {
        let mut grid = null_mut();
        let status = make(&mut grid);
        let bytes = if grid.is_null() { Vec::new() } else { self.bytes(&[grid.cast_const()]) };
        // SAFETY: it is this function's own.
        unsafe { frz_grid_destroy(grid) };
        (status, bytes)
    }

    /// Changes a copy of the snow, looks at it, and destroys it.
    fn changed(&self, change: impl FnOnce(*mut frz_grid) -> frz_status) -> Answer {
        self.made(|out| {
            // SAFETY: the pointers are valid.
            unsafe {
                works(frz_grid_copy(self.calm.ctx, self.snow, out));
                change(*out)
            }
        })
    }

    fn snow_layer(&self, ctx: *mut frz_context) -> Answer {
        // SAFETY: the pointers are valid.
        self.made(|out| unsafe { frz_snow_layer(ctx, &self.layer(), out) })
    }

    fn mesh_to_grid(&self, ctx: *mut frz_context) -> Answer {
        // SAFETY: the pointers are valid.
        self.made(|out| unsafe { frz_levelset_from_mesh(ctx, self.mesh, VOXEL, 3.0, out) })
    }

    fn sweep(&self, ctx: *mut frz_context) -> Answer {
        // SAFETY: the pointers are valid.
        self.made(|out| unsafe { frz_levelset_sweep(ctx, &self.body(), 1, 1.0 / 24.0, VOXEL, 3.0, out) })
    }

    fn particles(&self, ctx: *mut frz_context) -> Answer {
        let (centres, radii) = (view(&self.centres), view(&self.radii));
        // SAFETY: the pointers are valid.
        self.made(|out| unsafe { frz_levelset_from_particles(ctx, centres, radii, VOXEL, 3.0, out) })
    }

    fn offset(&self, ctx: *mut frz_context) -> Answer {
        let scheme = frz_scheme::FRZ_SCHEME_FIRST_ORDER as u32;
        // SAFETY: the pointers are valid.
        self.changed(|grid| unsafe { frz_levelset_offset(ctx, grid, 0.01, scheme) })
    }

    fn smooth(&self, ctx: *mut frz_context) -> Answer {
        let (mean, scheme) =
            (frz_smoothing::FRZ_SMOOTH_MEAN as u32, frz_scheme::FRZ_SCHEME_FIRST_ORDER as u32);
        // SAFETY: the pointers are valid.
        self.changed(|grid| unsafe { frz_levelset_smooth(ctx, grid, mean, 1, 1, scheme) })
    }

    fn displace(&self, ctx: *mut frz_context) -> Answer {
        let noise = frz_noise { amplitude: -1.0, size: -1.0, octaves: 3, seed: 0 };
        // SAFETY: the pointers are valid.
        self.changed(|grid| unsafe { frz_levelset_displace(ctx, grid, &noise) })
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe {
            frz_mesh_destroy(self.mesh);
            frz_grid_destroy(self.snow);
        }
    }
}

/// What the rounds of one function answered.
#[derive(Default)]
struct Counts {
    done: usize,
    cancelled: usize,
    /// FRZ_OK, but not all of the work.
    wrong: usize,
    /// FRZ_CANCELLED, but something was made or changed.
    changed: usize,
}

/// Cancels and resets during calls of a function, at random moments.
fn rounds(host: &Host, function: &Function, random: &mut Random) -> Counts {
    let (status, whole) = (function.call)(host, host.calm.ctx);
    works(status);
    let before = (function.before)(host);
    assert_ne!(whole, before, "{}", function.name);
    let start = Instant::now();
    (0..5).for_each(|_| drop((function.call)(host, host.calm.ctx)));
    let most = start.elapsed() / 5;
    let mut counts = Counts::default();
    for _ in 0..ROUNDS {
        let [moment, hold] = [most.mul_f64(random.next()), Duration::from_secs_f64(20e-6 * random.next())];
        let ctx = host.cancelled.ctx as usize;
        let canceller = std::thread::spawn(move || {
            let ctx = ctx as *mut frz_context;
            spin(moment);
            // SAFETY: the context outlives this thread, which is joined.
            unsafe { frz_context_cancel(ctx) };
            spin(hold);
            // SAFETY: as above.
            unsafe { frz_context_reset(ctx) };
        });
        let (status, bytes) = (function.call)(host, host.cancelled.ctx);
        canceller.join().expect("the thread");
        if status == frz_status::FRZ_CANCELLED {
            counts.cancelled += 1;
            counts.changed += usize::from(bytes != before);
        } else {
            works(status);
            counts.done += 1;
            counts.wrong += usize::from(bytes != whole);
        }
    }
    counts
}

/// Waits without sleeping: a sleep is far longer than these moments.
fn spin(time: Duration) {
    let start = Instant::now();
    while start.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// Runs the gates.
pub fn measure() -> [(f64, String); 2] {
    let host = Host::new();
    let mut random = Random(42);
    let (mut wrong, mut changed, mut notes) = (0, 0, Vec::new());
    for function in &FUNCTIONS {
        let counts = rounds(&host, function, &mut random);
        wrong += counts.wrong;
        changed += counts.changed;
        notes.push(format!("{} {}+{}", function.name, counts.done, counts.cancelled));
    }
    let note = format!("{ROUNDS} rounds each, done + cancelled: {}", notes.join(", "));
    [(wrong as f64, note), (changed as f64, "FRZ_CANCELLED with something made or changed".into())]
}
