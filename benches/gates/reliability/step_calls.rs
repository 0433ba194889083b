//! Every step function of the C interface with random settings that it accepts: one that takes far longer than others ends when it is cancelled.

use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicUsize, Ordering};

use frazil::capi::frz_status::*;
use frazil::capi::shallow::flow_points::*;
use frazil::capi::shallow::handle::*;
use frazil::capi::shallow::liquid::*;
use frazil::capi::shallow::params::*;
use frazil::capi::shallow::sources::*;
use frazil::capi::shallow::terrain::*;
use frazil::capi::shallow_two_level::ground::*;
use frazil::capi::shallow_two_level::liquid::*;
use frazil::capi::snow::grains::*;
use frazil::capi::snow::grains_params::*;
use frazil::capi::snow::grains_points::*;
use frazil::capi::snow::mist::*;
use frazil::capi::snow::mist_params::*;
use frazil::capi::snow::mist_points::*;

use crate::capi::host::{defaults, sized, view};
use crate::harness::Harness;
use crate::reliability::step_meshes as meshes;
use crate::reliability::watch::{Judged, PARTS, Tried, Watch};

/// The gates, one of each function.
pub fn run(h: &mut Harness) {
    type Scenes = fn(&mut Tried);
    let functions: [(&'static str, Scenes); 10] = [
        ("shallow_step", shallow),
        ("shallow_replay", replay),
        ("shallow_detail_step", detail),
        ("grains_step", grains),
        ("mist_step_points", mist),
        ("base_step", meshes::base),
        ("grains_step_grids", meshes::grids),
        ("mist_step", meshes::mist),
        ("tracker_step", meshes::tracker),
        ("tracker_read_eased", meshes::eased),
    ];
    let gate = |name: &str| format!("reliability.step_calls.{name}");
    let wanted: Vec<_> = functions.into_iter().filter(|(name, _)| h.wants(&gate(name))).collect();
    if wanted.is_empty() {
        return;
    }
    let known = Known::of_this_program();
    let judged = |(name, scenes): (&'static str, Scenes), part: usize| {
        let earlier = known.part(name, part).inspect(|earlier| {
            println!(
                "# {name}, part {} of {PARTS}: {} too slow (measured by an earlier run)",
                part + 1,
                earlier.slow
            );
        });
        earlier.unwrap_or_else(|| {
            let watch = Watch::new();
            let mut tried = Tried::new(&watch, name, part);
            while !tried.is_done() {
                scenes(&mut tried);
            }
            let judged = tried.judged();
            known.keep(name, part, &judged);
            println!("# {name}, part {} of {PARTS}: {} too slow", part + 1, judged.slow);
            judged
        })
    };
    // Each part runs in a thread of its own, and is measured by the CPU time of that: one for each core, the next to whoever is done.
    let next = AtomicUsize::new(0);
    let worker = || {
        let part = || {
            let number = next.fetch_add(1, Ordering::SeqCst);
            wanted.get(number / PARTS).map(|function| (number / PARTS, *function, number % PARTS))
        };
        std::iter::from_fn(part).map(|(at, function, part)| (at, judged(function, part))).collect::<Vec<_>>()
    };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let results: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a worker")).collect()
    });
    for (at, (name, _)) in wanted.iter().enumerate() {
        let parts: Vec<_> = results.iter().filter(|(of, _)| *of == at).map(|(_, judged)| *judged).collect();
        let (slow, note) = Judged::all(&parts);
        h.gate(&gate(name), slow as f64, &note);
    }
}

/// Parts that an earlier run of this very program has measured: those of mist take hours, and a run that was stopped goes on with the next.
struct Known(PathBuf);

impl Known {
    fn of_this_program() -> Self {
        let program = std::env::current_exe().and_then(std::fs::read).expect("the program");
        let folder = format!("target/step_calls/{:016x}", xxhash_rust::xxh3::xxh3_64(&program));
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        std::fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn part(&self, name: &str, part: usize) -> Option<Judged> {
        serde_json::from_slice(&std::fs::read(self.0.join(format!("{name}.{part}"))).ok()?).ok()
    }

    fn keep(&self, name: &str, part: usize, judged: &Judged) {
        let text = serde_json::to_vec(judged).expect("JSON");
        std::fs::write(self.0.join(format!("{name}.{part}")), text).expect("a file");
    }
}

/// Domains, grounds and parameters of shallow liquids.
fn liquid(tried: &mut Tried) -> (frz_shallow_params, frz_shallow_domain, Vec<f32>) {
    let mut params = defaults(frz_shallow_params_init);
    let mut domain: frz_shallow_domain = sized();
    domain.cell = tried.any(1e-4, 1e-1);
    domain.cells = [2 * (2 + tried.below(14)) as u32, 2 * (2 + tried.below(14)) as u32];
    let range = domain.cell * tried.any(1.0, 300.0);
    (domain.low, domain.high) = (-range, range);
    let [rough, lean] = [tried.any(1e-3, 0.5) * range, tried.between(-0.4, 0.4) * range];
    let count = (domain.cells[0] * domain.cells[1]) as usize;
    let across = domain.cells[0] as usize;
    let height = |tried: &mut Tried, at: usize| {
        (lean * (at % across) as f64 / across as f64 + rough * tried.between(-1.0, 1.0)) as f32
    };
    let heights = (0..count).map(|at| height(tried, at)).collect();
    vary(tried, &mut params);
    params.border = tried.below(3) as u32;
    params.friction = u32::from(tried.chance(0.2));
    (params.falls_most, params.section) =
        (if tried.chance(0.2) { 64 } else { 0 }, u32::from(tried.chance(0.1)));
    (params, domain, heights)
}

/// Changes what may change between frames.
fn vary(tried: &mut Tried, params: &mut frz_shallow_params) {
    params.viscosity = if tried.chance(0.1) { 0.0 } else { tried.any(1e-8, 1e-1) };
    (params.thinnest, params.thinning_time) = (0.0, 0.0);
    params.kept = tried.between(0.0, 1.0);
    params.gravity = [tried.between(-1.0, 1.0), -tried.any(1.1, 100.0), tried.between(-1.0, 1.0)];
    params.pace = tried.below(2) as u32;
    params.longest_step = tried.any(1e-6, 0.1);
    params.rest = if tried.chance(0.5) { 0.0 } else { tried.any(1e-7, 1e-2) };
}

/// Solids that lie over the ground, some of which it closes off.
fn bodies(tried: &mut Tried, domain: &frz_shallow_domain) -> Vec<frz_shallow_body> {
    let sides = domain.cells.map(|count| f64::from(count) * domain.cell);
    let mut one = || {
        let mut body: frz_shallow_body = sized();
        body.shape = 2 * u32::from(tried.chance(0.7));
        body.at = [
            tried.between(0.0, sides[0]),
            tried.between(domain.low, domain.high),
            tried.between(0.0, sides[1]),
        ];
        body.radius = tried.any(0.5, 5.0) * domain.cell;
        body.half = [sides[0], domain.high, sides[1]].map(|side| tried.between(0.02, 0.7) * side);
        body.half[1] *= 0.1;
        body
    };
    (0..6).map(|_| one()).collect()
}

fn flows(tried: &mut Tried, domain: &frz_shallow_domain) -> Vec<frz_shallow_flow> {
    let sides = domain.cells.map(|count| f64::from(count) * domain.cell);
    let mut one = || {
        let mut flow: frz_shallow_flow = sized();
        flow.kind = tried.below(2) as u32;
        flow.at = [
            tried.between(0.1, 0.9) * sides[0],
            tried.between(domain.low, domain.high),
            tried.between(0.1, 0.9) * sides[1],
        ];
        flow.radius = tried.any(0.5, 4.0) * domain.cell;
        flow.rate = tried.any(1e-3, 1e3) * domain.cell.powi(3);
        flow
    };
    (0..3).map(|_| one()).collect()
}

/// The length of a frame (s), mostly one of games.
fn length(tried: &mut Tried) -> f64 {
    if tried.chance(0.8) { tried.any(1e-3, 0.1) } else { tried.any(1e-12, 1e6) }
}

/// Liquids of random grounds, each for some frames.
fn each_liquid(tried: &mut Tried, frame: impl Fn(&mut Tried, *mut frz_shallow)) {
    let (mut params, domain, heights) = liquid(tried);
    let mut shallow = null_mut();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_shallow_create_heights(tried.ctx(), &params, &domain, view(&heights), &mut shallow) != FRZ_OK {
            return;
        }
        for _ in 0..8 {
            if tried.chance(0.4) {
                let solids = bodies(tried, &domain);
                let count = tried.below(solids.len() + 1);
                frz_shallow_set_bodies(tried.ctx(), shallow, solids.as_ptr(), count, null_mut());
            }
            if tried.chance(0.4) {
                frz_shallow_fill(shallow, tried.between(domain.low, domain.high));
            }
            if tried.chance(0.4) {
                let points = flows(tried, &domain);
                frz_shallow_set_flows(shallow, points.as_ptr(), points.len());
            }
            vary(tried, &mut params);
            frz_shallow_set_params(shallow, &params);
            for _ in 0..4 {
                frame(tried, shallow);
            }
        }
        frz_shallow_destroy(shallow);
    }
}

fn shallow(tried: &mut Tried) {
    each_liquid(tried, |tried, shallow| {
        let dt = length(tried);
        let budget = if tried.chance(0.7) { 0.0 } else { tried.any(1e-5, 1e-2) };
        // SAFETY: the handle is there.
        tried.step(|ctx| unsafe { frz_shallow_step(ctx, shallow, dt, budget, null_mut()) });
    });
}

fn replay(tried: &mut Tried) {
    each_liquid(tried, |tried, shallow| {
        let [count, longest] = [tried.any(1.0, 2e3), tried.any(1e-5, 1.0)];
        let steps: Vec<f64> = (0..count as usize).map(|_| longest * tried.between(0.1, 1.0)).collect();
        // SAFETY: the handle is there.
        tried.step(|ctx| unsafe { frz_shallow_replay(ctx, shallow, view(&steps), null_mut()) });
    });
}

fn detail(tried: &mut Tried) {
    let (mut params, domain, heights) = liquid(tried);
    params.falls_most = 0;
    let [x, z] = domain.cells.map(|count| f64::from(count) * domain.cell);
    let near = [
        tried.between(0.0, 0.4) * x,
        tried.between(0.0, 0.4) * z,
        tried.between(0.5, 0.9) * x,
        tried.between(0.5, 0.9) * z,
    ];
    let mut detail = null_mut();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        let heights = view(&heights);
        if frz_shallow_detail_create_heights(
            tried.ctx(),
            &params,
            &domain,
            heights,
            near.as_ptr(),
            &mut detail,
        ) != FRZ_OK
        {
            return;
        }
        for _ in 0..8 {
            if tried.chance(0.3) {
                let solids = bodies(tried, &domain);
                let count = tried.below(solids.len() + 1);
                frz_shallow_detail_set_bodies(tried.ctx(), detail, solids.as_ptr(), count, null_mut());
            }
            if tried.chance(0.2) {
                frz_shallow_detail_fill(detail, tried.between(domain.low, domain.high));
            }
            // In one of the two only.
            let at = [tried.between(0.0, x), 0.0, tried.between(0.0, z)];
            let volume = tried.any(1e-2, 1e3) * domain.cell.powi(3);
            frz_shallow_detail_pour(detail, at.as_ptr(), 2.0 * domain.cell, volume, null_mut());
            if tried.chance(0.3) {
                let points = flows(tried, &domain);
                frz_shallow_detail_set_flows(detail, points.as_ptr(), points.len());
            }
            vary(tried, &mut params);
            frz_shallow_detail_set_params(detail, &params);
            for _ in 0..4 {
                let dt = length(tried);
                tried.step(|ctx| frz_shallow_detail_step(ctx, detail, dt, null_mut()));
            }
        }
        frz_shallow_detail_destroy(detail);
    }
}

/// Parameters of grains.
pub fn grain_params(tried: &mut Tried, radius: f64) -> frz_grains_params {
    let mut params = defaults(frz_grains_params_init);
    params.radius = radius;
    params.flags = FRZ_GRAINS_FLOOR * u32::from(tried.chance(0.7));
    params.flags |= FRZ_GRAINS_RESTLESS * u32::from(tried.chance(0.3));
    params.flags |= FRZ_GRAINS_AIR_BY_DENSITY * u32::from(tried.chance(0.3));
    (params.friction, params.restitution, params.air) =
        (tried.between(0.0, 1.0), tried.between(0.0, 1.0), tried.between(0.0, 1.0));
    params.attraction = if tried.chance(0.6) { 0.0 } else { tried.any(0.1, 1000.0) };
    params.gravity = tried.between(-20.0, 0.0);
    params.sub_steps = if tried.chance(0.8) { 0 } else { tried.below(1000) as u32 };
    params.lowest = -10.0;
    params
}

/// Positions (m) in a box, and velocities (m/s).
pub fn points(tried: &mut Tried, count: usize, side: f64, fastest: f64) -> [Vec<[f32; 3]>; 2] {
    let mut triples = |low: f64, high: f64| {
        (0..count).map(|_| [0; 3].map(|_| tried.between(low, high) as f32)).collect::<Vec<[f32; 3]>>()
    };
    [triples(0.0, side), triples(-fastest, fastest)]
}

/// The length of a step of grains and mist (s).
pub fn step_length(tried: &mut Tried) -> f64 {
    if tried.chance(0.9) { tried.any(1e-3, 0.1) } else { tried.any(1e-6, 3600.0) }
}

fn grains(tried: &mut Tried) {
    let radius = tried.any(1e-4, 0.1);
    let params = grain_params(tried, radius);
    let mut grains = null_mut();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_grains_create(tried.ctx(), &params, null(), 0, &mut grains) != FRZ_OK {
            return;
        }
        for frame in 1..=8 {
            let (count, side, fastest) =
                (tried.any(1.0, 200.0) as usize, radius * tried.any(1.0, 60.0), tried.any(1e-3, 100.0));
            let [positions, speeds] = points(tried, count, side, fastest);
            frz_grains_emit(tried.ctx(), grains, view(&positions), view(&speeds), frame, null_mut());
            let params = grain_params(tried, radius);
            frz_grains_set_params(grains, &params);
            for _ in 0..4 {
                let dt = step_length(tried);
                tried.step(|ctx| frz_grains_step(ctx, grains, null(), null(), 0, dt, frame, null_mut()));
            }
        }
        frz_grains_destroy(grains);
    }
}

/// Parameters of mist.
pub fn mist_params(tried: &mut Tried, cell: f64) -> frz_mist_params {
    let mut params = defaults(frz_mist_params_init);
    params.cell = cell;
    (params.turbulence_size, params.noise_size) = (cell * tried.any(8.0, 100.0), cell * tried.any(1.0, 20.0));
    params.from_speed = tried.any(1e-2, 10.0);
    params.half_life = tried.any(1e-2, 100.0);
    params.gravity = tried.between(-10.0, 10.0);
    // Mostly calm: a storm fills hundreds of tiles, and ten thousand of them take hours.
    let strongest = if tried.chance(0.9) { 1.0 } else { 100.0 };
    params.turbulence = if tried.chance(0.5) { 0.0 } else { tried.any(0.01, strongest) };
    params.confinement = if tried.chance(0.5) { 0.0 } else { tried.any(0.01, strongest) };
    params.flags =
        (FRZ_MIST_FLOOR * u32::from(tried.chance(0.4))) | (FRZ_MIST_FALLING * u32::from(tried.chance(0.5)));
    params
}

fn mist(tried: &mut Tried) {
    let cell = tried.any(5e-3, 0.2);
    let params = mist_params(tried, cell);
    let mut mist = null_mut();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_mist_create(tried.ctx(), &params, null(), 0, &mut mist) != FRZ_OK {
            return;
        }
        for frame in 0..8 {
            let (count, side) = (tried.any(1.0, 50.0) as usize, cell * tried.any(0.1, 8.0));
            let fastest = if tried.chance(0.9) { tried.any(0.1, 3.0) } else { tried.any(3.0, 50.0) };
            let [positions, speeds] = points(tried, count, side, fastest);
            let positions: Vec<[f64; 3]> = positions.iter().map(|position| position.map(f64::from)).collect();
            let params = mist_params(tried, cell);
            frz_mist_set_params(mist, &params);
            let dt = step_length(tried);
            let (radius, time) = (cell * tried.any(0.05, 2.0), f64::from(frame));
            tried.step(|ctx| {
                let [positions, speeds] = [view(&positions), view(&speeds)];
                frz_mist_step_points(
                    ctx,
                    mist,
                    positions,
                    speeds,
                    radius,
                    null(),
                    null(),
                    null(),
                    0,
                    time,
                    dt,
                    null_mut(),
                )
            });
        }
        frz_mist_destroy(mist);
    }
}
