//! Cancel and reset while a call runs: it answers FRZ_CANCELLED, or FRZ_OK with all of its work done.

use std::ptr::{null, null_mut};
use std::time::{Duration, Instant};

use frazil::capi::grid::bytes::*;
use frazil::capi::grid::sparse::*;
use frazil::capi::level_set::body::frz_body;
use frazil::capi::level_set::tools::*;
use frazil::capi::mesh::triangles::*;
use frazil::capi::runtime::context::*;
use frazil::capi::runtime::library::FRZ_ABI_VERSION;
use frazil::capi::runtime::pool::*;
use frazil::capi::snow::base_layer::*;
use frazil::capi::snow::layer::*;
use frazil::capi::{frz_status, frz_view};
use frazil::geometry::TriMesh;

use crate::capi::host::{view, works};
use crate::common::shapes;
use crate::harness::Harness;

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

/// Two contexts on one pool: one that is cancelled, and one that makes and looks.
struct Host {
    pool: *mut frz_pool,
    cancelled: *mut frz_context,
    calm: *mut frz_context,
    snow: *mut frz_grid,
    mesh: *mut frz_mesh,
    ball: TriMesh,
    ball_end: Vec<[f32; 3]>,
    centres: Vec<[f32; 3]>,
    radii: Vec<f32>,
}

impl Host {
    fn new() -> Self {
        let mut ball = shapes::sphere(0.15, 8);
        ball.positions.iter_mut().for_each(|p| p.y += 0.3);
        let moved = |p: &frazil::geometry::Vec3| [p.x + 0.1, p.y - 0.05, p.z + 0.05];
        let spread = |n: usize, step: usize| (n * step % 97) as f32 / 97.0;
        let mut host = Self {
            pool: null_mut(),
            cancelled: null_mut(),
            calm: null_mut(),
            snow: null_mut(),
            mesh: null_mut(),
            ball_end: ball.positions.iter().map(moved).collect(),
            ball,
            centres: (0..60).map(|n| [spread(n, 13), spread(n, 29), spread(n, 53)]).collect(),
            radii: (0..60).map(|n| 0.08 + 0.08 * spread(n, 71)).collect(),
        };
        // SAFETY: the pointers are valid, and the arrays outlive the host.
        unsafe {
            works(frz_pool_create(2, &mut host.pool));
            works(frz_context_create(FRZ_ABI_VERSION, host.pool, &mut host.cancelled));
            works(frz_context_create(FRZ_ABI_VERSION, host.pool, &mut host.calm));
            works(frz_snow_layer(host.calm, &host.layer(), &mut host.snow));
            let desc = frz_mesh_desc {
                struct_size: size_of::<frz_mesh_desc>() as u32,
                flags: 0,
                positions: view(&host.ball.positions),
                face_counts: frz_view { data: null(), count: 0, stride: 0 },
                indices: view(host.ball.triangles.as_flattened()),
                attributes: null(),
                attribute_count: 0,
            };
            works(frz_mesh_create(host.calm, &desc, &mut host.mesh));
        }
        host
    }

    /// A small layer.
    fn layer(&self) -> frz_snow_desc {
        // SAFETY: plain numbers and pointers, of which zero is a value.
        let mut desc: frz_snow_desc = unsafe { std::mem::zeroed() };
        // SAFETY: it has its size.
        works(unsafe { frz_snow_desc_init(&mut desc, size_of::<frz_snow_desc>()) });
        desc.voxel_size = VOXEL;
        desc.depth = 0.2;
        desc.area = [-0.3, -0.3, 0.3, 0.3];
        desc
    }

    fn body(&self) -> frz_body {
        frz_body {
            struct_size: size_of::<frz_body>() as u32,
            flags: 0,
            id: 1,
            positions: view(&self.ball.positions),
            positions_end: view(&self.ball_end),
            between: null(),
            between_count: 0,
            face_counts: frz_view { data: null(), count: 0, stride: 0 },
            indices: view(self.ball.triangles.as_flattened()),
            friction: 0.3,
            stick: 0.0,
            compression: 0.0,
        }
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
        let (list, count) = (grids.as_ptr(), grids.len());
        let mut size = 0;
        // SAFETY: the pointers are valid, and the room is as large as the call before said.
        unsafe {
            works(frz_grid_to_bytes(self.calm, list, count, none, 0, null_mut(), 0, &mut size));
            let mut out = vec![0u8; size];
            let room = out.as_mut_ptr().cast();
            works(frz_grid_to_bytes(self.calm, list, count, none, 0, room, size, &mut size));
            out.truncate(size);
            out
        }
    }

    fn base(&self) -> *mut frz_base {
        let mut base = null_mut();
        // SAFETY: the pointers are valid.
        works(unsafe { frz_base_create(self.calm, null(), self.snow, null(), 0, &mut base) });
        base
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
                works(frz_grid_copy(self.calm, self.snow, out));
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
            frz_context_destroy(self.cancelled);
            frz_context_destroy(self.calm);
            frz_pool_destroy(self.pool);
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
fn rounds(host: &Host, function: &Function, random: &mut impl FnMut() -> f64) -> Counts {
    let (status, whole) = (function.call)(host, host.calm);
    works(status);
    let before = (function.before)(host);
    assert_ne!(whole, before, "{}", function.name);
    let start = Instant::now();
    (0..5).for_each(|_| drop((function.call)(host, host.calm)));
    let most = start.elapsed() / 5;
    let mut counts = Counts::default();
    for _ in 0..ROUNDS {
        let [moment, hold] = [most.mul_f64(random()), Duration::from_secs_f64(20e-6 * random())];
        let ctx = host.cancelled as usize;
        let canceller = std::thread::spawn(move || {
            let ctx = ctx as *mut frz_context;
            spin(moment);
            // SAFETY: the context outlives this thread, which is joined.
            unsafe { frz_context_cancel(ctx) };
            spin(hold);
            // SAFETY: as above.
            unsafe { frz_context_reset(ctx) };
        });
        let (status, bytes) = (function.call)(host, host.cancelled);
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
pub fn run(h: &mut Harness) {
    if !h.wants("reliability.cancel_reset") {
        return;
    }
    let host = Host::new();
    let mut state = 42u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    };
    let (mut wrong, mut changed, mut notes) = (0, 0, Vec::new());
    for function in &FUNCTIONS {
        let counts = rounds(&host, function, &mut random);
        wrong += counts.wrong;
        changed += counts.changed;
        notes.push(format!("{} {}+{}", function.name, counts.done, counts.cancelled));
    }
    let note = format!("{ROUNDS} rounds each, done + cancelled: {}", notes.join(", "));
    h.gate("reliability.cancel_reset", wrong as f64, &note);
    h.gate(
        "reliability.cancel_reset_changed",
        changed as f64,
        "FRZ_CANCELLED with something made or changed",
    );
}
