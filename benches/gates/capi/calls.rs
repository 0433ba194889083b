//! Gates of the C interface, called as a host calls it.

use std::ffi::{c_int, c_void};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use frazil::capi::frz_status;
use frazil::capi::grid::bytes::*;
use frazil::capi::grid::sparse::*;
use frazil::capi::level_set::body::frz_body;
use frazil::capi::runtime::context::*;
use frazil::capi::snow::base_layer::*;
use frazil::geometry::DVec3;
use frazil::motion::Motion;
use frazil::snow::base_layer::BaseLayer;
use frazil::sweep::Body;

use crate::capi::cancel_latency::latency;
use crate::capi::host::{Threads, body_between, sized, works, written};
use crate::harness::{Harness, median, timed};
use crate::process::said;
use crate::scenes::{self, FRAMES, context};
use crate::snow::grains::Random;

/// A body's poses in 32 bits at whole frames, as a host has them.
struct Poses {
    triangles: Vec<[u32; 3]>,
    frames: Vec<Vec<[f32; 3]>>,
}

impl Poses {
    fn of(body: &Body) -> Self {
        let mut pose = Vec::new();
        let mut frame = |frame: i32| {
            body.motion().pose(f64::from(frame), &mut pose).expect("pose");
            pose.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect()
        };
        Self { frames: (0..=FRAMES).map(&mut frame).collect(), triangles: body.motion().triangles().to_vec() }
    }

    fn body(&self, frame: i32) -> frz_body {
        let pose = |frame: i32| self.frames[frame as usize].as_slice();
        body_between([pose((frame - 1).max(0)), pose(frame)], &self.triangles)
    }
}

/// The same motion in Rust: straight from pose to pose.
struct Straight(Poses);

impl Motion for Straight {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }
    fn vertex_count(&self) -> usize {
        self.0.frames[0].len()
    }
    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> frazil::Result<()> {
        let (first, part) = (time.floor() as usize, time - time.floor());
        let next = &self.0.frames[(first + 1).min(FRAMES as usize)];
        let lerp = |(p, q): (&[f32; 3], &[f32; 3])| {
            DVec3::from(p.map(f64::from)).lerp(&DVec3::from(q.map(f64::from)), part)
        };
        out.clear();
        out.extend(self.0.frames[first].iter().zip(next).map(lerp));
        Ok(())
    }
    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        (from.floor() as i64 + 1..to.ceil() as i64).map(|frame| frame as f64).collect()
    }
}

/// A host with a context, a layer and a body.
struct Host {
    threads: Threads,
    snow: *mut frz_grid,
    base: *mut frz_base,
    poses: Poses,
}

impl Host {
    fn new((layer, body): (BaseLayer, Body), threads: u32) -> Self {
        let mut host = Self {
            threads: Threads::new(threads),
            snow: null_mut(),
            base: null_mut(),
            poses: Poses::of(&body),
        };
        let options = frazil::vdb::file::WriteOptions::default();
        let bytes = frazil::vdb::file::to_bytes(&[layer.surface()], &options).expect("bytes");
        drop(layer);
        // SAFETY: the pointers are valid.
        unsafe {
            let bytes = (bytes.as_ptr().cast(), bytes.len());
            works(frz_grid_from_bytes(host.threads.ctx, bytes.0, bytes.1, std::ptr::null(), &mut host.snow));
        }
        host.base = host.make(&[]);
        host
    }

    fn make(&self, state: &[u8]) -> *mut frz_base {
        let mut base = null_mut();
        let restart = if state.is_empty() { std::ptr::null() } else { state.as_ptr().cast() };
        // SAFETY: the pointers are valid.
        unsafe {
            works(frz_base_create(
                self.threads.ctx,
                std::ptr::null(),
                self.snow,
                restart,
                state.len(),
                &mut base,
            ))
        };
        base
    }

    fn restore(&mut self, state: &[u8]) {
        // SAFETY: nobody uses the layer any more.
        unsafe { frz_base_destroy(self.base) };
        self.base = self.make(state);
    }

    fn step(&self, frame: i32) -> frz_status {
        let body = self.poses.body(frame);
        let dt = if frame == 0 { 0.0 } else { 1.0 };
        // SAFETY: the pointers are valid.
        unsafe { frz_base_step(self.threads.ctx, self.base, &body, 1, dt, frame, null_mut()) }
    }

    fn state(&self) -> Vec<u8> {
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_base_save(self.threads.ctx, self.base, room, capacity, size)
        })
    }

    fn bytes(&self) -> Vec<u8> {
        let none = frz_compression::FRZ_COMPRESSION_NONE as u32;
        // SAFETY: the layer is there.
        let grids = unsafe {
            [frz_base_grid(self.base), frz_base_removed(self.base), frz_base_compression(self.base)]
        };
        // SAFETY: the pointers are valid.
        written(|room, capacity, size| unsafe {
            frz_grid_to_bytes(self.threads.ctx, grids.as_ptr(), 3, none, 0, room, capacity, size)
        })
    }

    fn voxels(&self) -> u64 {
        let mut info: frz_grid_info = sized();
        // SAFETY: the pointers are valid.
        unsafe { works(frz_grid_get_info(frz_base_grid(self.base), &mut info)) };
        info.active_voxels
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nobody uses them any more.
        unsafe {
            frz_base_destroy(self.base);
            frz_grid_destroy(self.snow);
        }
    }
}

/// Where `make install` put the library for these gates, and where its tests were built.
fn built(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("target").join(name)
}

/// All gates of the C interface.
pub fn run(h: &mut Harness) {
    if h.wants("capi.cancel") {
        cancel(h);
    }
    if h.wants("capi.state") {
        state(h);
    }
    h.measure("capi.border_cost", border);
    programs(h);
}

/// Cancels at random moments of a step of `large`, from another thread and from the poll.
fn cancel(h: &mut Harness) {
    let mut host = Host::new(scenes::large(&context(2), 6.0), 2);
    works(host.step(0));
    works(host.step(1));
    let state = host.state();
    let (whole, _) = timed(|| works(host.step(2)));
    let after = host.bytes();
    host.restore(&state);
    let mut random = Random(42);
    let mut latencies = Vec::new();
    let mut same = true;
    for attempt in 0..200 {
        let moment = Duration::from_secs_f64(whole * random.next());
        match if attempt % 2 == 0 {
            latency(&host.threads, moment, || host.step(2))
        } else {
            from_the_poll(&host, moment)
        } {
            Some(latency) => latencies.push(latency),
            // The step ended first.
            None => host.restore(&state),
        }
        same &= attempt % 10 > 0 || host.state() == state;
    }
    works(host.step(2));
    same &= host.bytes() == after;
    latencies.sort_unstable_by(f64::total_cmp);
    let (p99, count) = (latencies[latencies.len() * 99 / 100], latencies.len());
    let note = format!("{count} cancels of a step of {whole:.3} s; median {:.4} s", median(latencies));
    h.gate("capi.cancel_latency", p99, &note);
    h.holds("capi.cancel_state", same, "the state after cancels, and the grids of the step made in the end");
}

/// When the poll is to cancel (microseconds of [`clock`]).
static DUE: AtomicU64 = AtomicU64::new(0);

/// Microseconds since the first call.
fn clock() -> u64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_micros() as u64
}

/// Cancels when its time has come.
unsafe extern "C" fn poll(_: *mut c_void, _: *const frz_progress) -> c_int {
    c_int::from(clock() >= DUE.load(Ordering::Relaxed))
}

/// As [`latency`]; the time until the poll is asked counts.
fn from_the_poll(host: &Host, moment: Duration) -> Option<f64> {
    let due = clock() + moment.as_micros() as u64;
    DUE.store(due, Ordering::Relaxed);
    // SAFETY: the context is the host's.
    unsafe { works(frz_context_set_poll(host.threads.ctx, Some(poll), null_mut())) };
    let status = host.step(2);
    let ended = clock();
    // SAFETY: as above.
    unsafe { works(frz_context_set_poll(host.threads.ctx, None, null_mut())) };
    host.threads.reset();
    (status == frz_status::FRZ_CANCELLED).then(|| ended.saturating_sub(due) as f64 / 1e6)
}

/// Time and size of states of `large`: after its frames, and with the whole surface touched.
fn state(h: &mut Harness) {
    let host = Host::new(scenes::large(&context(2), 6.0), 2);
    (0..=FRAMES).for_each(|frame| works(host.step(frame)));
    measure(h, &host, "capi.state", "after its frames");
    drop(host);
    // A plate that is pressed 2 cm into all of the surface: every block of it changes.
    let ends = [DVec3::new(0.0, 0.45, 0.0), DVec3::new(0.0, 0.38, 0.0)];
    let (layer, _) = scenes::large(&context(2), 6.0);
    let plate = crate::common::shapes::cuboid([6.5, 0.2, 6.5]);
    let body = scenes::body(plate, ends, [DVec3::zeros(); 2], f64::from(FRAMES));
    let host = Host::new((layer, body), 2);
    (0..=FRAMES).for_each(|frame| works(host.step(frame)));
    measure(h, &host, "capi.state_all", "with the whole surface touched");
}

fn measure(h: &mut Harness, host: &Host, name: &str, note: &str) {
    let state = host.state();
    let round = || {
        timed(|| {
            let state = host.state();
            let base = host.make(&state);
            // SAFETY: it is this round's own.
            unsafe { frz_base_destroy(base) };
        })
        .0
    };
    round();
    let seconds = median((0..5).map(|_| round()).collect());
    let note = format!("threads=2, {} bytes {note}", state.len());
    h.gate(&format!("{name}_seconds"), seconds, &note);
    let bytes = state.len() as f64 / host.voxels() as f64;
    h.gate(&format!("{name}_bytes"), bytes, &note);
}

/// Steps of `small` through C over the same steps in Rust, in turn.
fn border() -> (f64, String) {
    let ctx = context(2);
    let (layer, body) = scenes::small(&ctx, 2.0);
    let params = *layer.params();
    let snow = layer.surface().deep_copy().expect("copy");
    let straight = Body::new(Box::new(Straight(Poses::of(&body))), 0.0).expect("body");
    let bodies = std::slice::from_ref(&straight);
    let mut host = Host::new((layer, body), 2);
    let (mut through_c, mut in_rust) = (Vec::new(), Vec::new());
    for round in 0..12 {
        // Each round from untouched snow, so that all rounds do the same.
        let mut base = BaseLayer::new(&ctx, snow.deep_copy().expect("copy"), params).expect("layer");
        host.restore(&[]);
        let (mut c, mut rust) = (0.0, 0.0);
        for frame in 0..=FRAMES {
            let time = f64::from(frame);
            let mut rust_step = || {
                timed(|| drop(base.step(&ctx, bodies, (time - 1.0).max(0.0), time, frame).expect("step"))).0
            };
            let c_step = || timed(|| works(host.step(frame))).0;
            let (one, other) = match (round + frame) % 2 {
                0 => (rust_step(), c_step()),
                _ => {
                    let c = c_step();
                    (rust_step(), c)
                }
            };
            // The first pose and a frame to warm up do not count.
            if frame > 1 {
                rust += one;
                c += other;
            }
        }
        if round > 1 {
            through_c.push(c);
            in_rust.push(rust);
        }
    }
    let (c, rust) = (median(through_c), median(in_rust));
    let note = format!("threads=2, {} frames in {c:.4} s through C, in {rust:.4} s in Rust", FRAMES - 1);
    (c / rust, note)
}

/// What a program of tests/ctest says; nothing when it was not built. The C library keeps one heap for all of its
/// threads: with one for each, what stays resident depends on which thread came by which, more than on what is kept.
fn host_says(program: &str, arguments: &[&str]) -> String {
    let folder = built("ctest");
    said(Command::new(folder.join(program)).env("MALLOC_ARENA_MAX", "1").args(arguments).current_dir(folder))
}

/// The number after a word; infinity without it.
fn number_after(text: &str, word: &str) -> f64 {
    let number = text.split_whitespace().skip_while(|part| *part != word).nth(1);
    number.and_then(|number| number.parse().ok()).unwrap_or(f64::INFINITY)
}

/// Gates that are programs of their own, linked with the installed library.
fn programs(h: &mut Harness) {
    h.measure_all(["capi.load_threads", "capi.load_memory"], || {
        let text = host_says("load_cycles", &[]);
        let note = "100 cycles, growth from the 10th on, in one heap";
        [(number_after(&text, "threads"), "100 cycles"), (number_after(&text, "memory_kB") / 1024.0, note)]
    });
    h.measure("capi.symbols", || {
        let library = built("install/lib/libfrazil.so");
        let text = said(Command::new("nm").args(["-D", "--defined-only"]).arg(&library));
        let names = text.lines().filter_map(|line| line.split_whitespace().last());
        let (ours, others): (Vec<&str>, Vec<&str>) = names.partition(|name| name.starts_with("frz_"));
        let count = if ours.is_empty() { f64::INFINITY } else { others.len() as f64 };
        (count, format!("{} functions", ours.len()))
    });
    h.measure("capi.misuse_crashes", || {
        (number_after(&host_says("misuse", &["100000", "20261121"]), "crashes"), "100000 calls")
    });
    h.measure("capi.sanitizers_errors", || {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/sanitize");
        (number_after(&said(&mut Command::new(script)), "errors"), "ASan, UBSan, valgrind")
    });
}
