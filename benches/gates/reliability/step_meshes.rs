//! Scenes for `step_calls.rs` with meshes and layers of snow.

use std::ptr::{null, null_mut};

use frazil::capi::frz_span;
use frazil::capi::frz_status::*;
use frazil::capi::grid::sparse::*;
use frazil::capi::level_set::body::*;
use frazil::capi::mesh::triangles::*;
use frazil::capi::snow::base_layer::*;
use frazil::capi::snow::grains::*;
use frazil::capi::snow::layer::*;
use frazil::capi::snow::mist::*;
use frazil::capi::tracker::eased::*;
use frazil::capi::tracker::handle::*;
use frazil::capi::tracker::mesh::*;
use frazil::geometry::TriMesh;

use crate::capi::host::{self, body_between, defaults, sized, view, works};
use crate::reliability::step_calls::{grain_params, mist_params, step_length};
use crate::reliability::watch::Tried;

/// Voxels of the snow (m), which is 0.4 x 0.1 x 0.4 m.
const VOXEL: f64 = 0.02;

/// A cube at two moments, and its triangles.
struct Cube([Vec<[f32; 3]>; 2], Vec<[u32; 3]>);

impl Cube {
    fn new(tried: &mut Tried) -> Self {
        let half = tried.any(0.02, 0.15) as f32;
        let mut at = || [0; 3].map(|_| tried.between(-0.15, 0.15) as f32);
        let (corners, faces) = cube(half);
        let moved = |by: [f32; 3]| corners.iter().map(|p| [0, 1, 2].map(|axis| by[axis] + p[axis])).collect();
        let [from, to] = [at(), at()];
        Self([from, to].map(moved), faces)
    }

    fn body(&self) -> frz_body {
        body_between(self.0.each_ref().map(Vec::as_slice), &self.1)
    }
}

/// A cube of half an edge around the origin: its corners and triangles.
fn cube(half: f32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let TriMesh { positions, triangles } = TriMesh::cuboid([-half; 3], [half; 3]);
    (positions.into_iter().map(Into::into).collect(), triangles)
}

fn snow(tried: &Tried) -> *mut frz_grid {
    let mut desc = defaults(frz_snow_desc_init);
    (desc.voxel_size, desc.depth, desc.area) = (VOXEL, 0.1, [-0.2, -0.2, 0.2, 0.2]);
    // SAFETY: the pointers are valid.
    host::made(|snow| unsafe { frz_snow_layer(tried.ctx(), &desc, snow) })
}

/// A layer and a cube for each of some frames.
fn each_press(
    tried: &mut Tried,
    frames: i32,
    mut frame: impl FnMut(&mut Tried, *mut frz_base, &frz_body, i32),
) {
    let (snow, mut base) = (snow(tried), null_mut());
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        works(frz_base_create(tried.ctx(), null(), snow, null(), 0, &mut base));
        for at in 1..=frames {
            let cube = Cube::new(tried);
            frame(tried, base, &cube.body(), at);
        }
        frz_base_destroy(base);
        frz_grid_destroy(snow);
    }
}

pub fn base(tried: &mut Tried) {
    each_press(tried, 16, |tried, base, body, frame| {
        let mut params = defaults(frz_base_params_init);
        let dt = step_length(tried);
        params.tolerance = tried.any(1e-3, 1.0);
        params.noise.amplitude = tried.between(0.0, 3.0) * VOXEL;
        // SAFETY: the pointers are valid.
        unsafe {
            frz_base_set_params(base, &params);
            tried.step(|ctx| frz_base_step(ctx, base, body, 1, dt, frame, null_mut()));
        }
    });
}

pub fn grids(tried: &mut Tried) {
    let params = grain_params(tried, VOXEL / 3.0);
    let mut grains = null_mut();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_grains_create(tried.ctx(), &params, null(), 0, &mut grains) != FRZ_OK {
            return;
        }
        each_press(tried, 16, |tried, base, body, frame| {
            let mut before = null_mut();
            works(frz_grid_copy(tried.ctx(), frz_base_grid(base), &mut before));
            works(frz_base_step(tried.ctx(), base, body, 1, 1.0 / 24.0, frame, null_mut()));
            frz_grains_set_params(grains, &grain_params(tried, VOXEL / 3.0));
            let (after, dt) = (frz_base_grid(base), step_length(tried));
            tried.step(|ctx| {
                frz_grains_step_grids(ctx, grains, before, after, body, 1, dt, frame, null_mut())
            });
            frz_grid_destroy(before);
        });
        frz_grains_destroy(grains);
    }
}

pub fn mist(tried: &mut Tried) {
    let cell = tried.any(0.5, 4.0) * VOXEL;
    let (params, mut grain) = (mist_params(tried, cell), grain_params(tried, VOXEL / 3.0));
    // Grains that fly apart spread mist over hundreds of tiles.
    grain.attraction = 0.0;
    let (mut mist, mut grains) = (null_mut(), null_mut());
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_grains_create(tried.ctx(), &grain, null(), 0, &mut grains) != FRZ_OK {
            return;
        }
        works(frz_mist_create(tried.ctx(), &params, null(), 0, &mut mist));
        each_press(tried, 4, |tried, base, body, frame| {
            works(frz_base_step(tried.ctx(), base, body, 1, 1.0 / 24.0, frame, null_mut()));
            works(frz_grains_step(tried.ctx(), grains, base, body, 1, 1.0 / 24.0, frame, null_mut()));
            frz_mist_set_params(mist, &mist_params(tried, cell));
            let (time, dt) = (f64::from(frame), step_length(tried));
            tried.step(|ctx| frz_mist_step(ctx, mist, grains, base, null(), body, 1, time, dt, null_mut()));
        });
        frz_mist_destroy(mist);
        frz_grains_destroy(grains);
    }
}

/// Particles of a cube of 8 x 8 x 8.
const SIDE: usize = 8;
const PARTICLES: usize = SIDE * SIDE * SIDE;

/// Particles at a moment.
struct Particles {
    positions: Vec<[f64; 3]>,
    ids: Vec<i64>,
}

impl Particles {
    fn new() -> Self {
        let position = |at: usize| [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE].map(|at| at as f64 - 3.5);
        Self { positions: (0..PARTICLES).map(position).collect(), ids: (0..PARTICLES as i64).collect() }
    }

    /// These a moment later: they turn, stretch, part and jitter.
    fn moved(&self, tried: &mut Tried) -> Self {
        let mut map = [0; 3].map(|_| [0; 3].map(|_| tried.between(-0.1, 0.1)));
        (0..3).for_each(|axis| map[axis][axis] += 1.0);
        let [part, jitter] = [tried.any(1e-3, 4.0), tried.any(1e-4, 0.5)];
        let parts = tried.chance(0.3);
        let position = |position: &[f64; 3]| {
            let away = if parts && position[0] > 0.0 { part } else { 0.0 };
            let along = |axis: usize| (0..3).map(|from| map[axis][from] * position[from]).sum::<f64>();
            [along(0) + away, along(1), along(2)].map(|at| at + jitter * tried.between(-1.0, 1.0))
        };
        Self { positions: self.positions.iter().map(position).collect(), ids: self.ids.clone() }
    }

    fn given(&self) -> frz_particles {
        let mut particles: frz_particles = sized();
        (particles.positions, particles.ids) = (view(&self.positions), view(&self.ids));
        particles
    }
}

fn tracker_params(tried: &mut Tried) -> frz_tracker_params {
    let mut params = defaults(frz_tracker_params_init);
    (params.spacing, params.cell) = (1.0, 0.5);
    params.change = tried.any(1e-3, 100.0);
    params.half_life = if tried.chance(0.5) { f64::INFINITY } else { tried.any(1e-2, 10.0) };
    params.fade = if tried.chance(0.5) { 0.0 } else { tried.any(1e-2, 1000.0) };
    params.weighting = tried.below(2) as u32;
    params.r#match = tried.below(2) as u32;
    params.min_drop = tried.below(20) as u32;
    params
}

/// A tracker of a cube, for some frames.
fn each_tracker(tried: &mut Tried, frame: impl Fn(&mut Tried, *mut frz_tracker, [&Particles; 2], f64)) {
    let (mut params, rebuild) = (tracker_params(tried), u32::from(tried.chance(0.5)));
    params.rebuild = rebuild;
    let cell = tried.between(0.3, 1.0);
    params.cell = cell;
    let (corners, faces) = cube(4.0);
    let (mesh, mut tracker) = (host::mesh(tried.ctx(), &corners, &faces), null_mut());
    let mut now = Particles::new();
    // SAFETY: the pointers are valid, and handles are destroyed once.
    unsafe {
        if frz_tracker_create(tried.ctx(), &params, mesh, &now.given(), null(), 0, &mut tracker) == FRZ_OK {
            for _ in 0..8 {
                let next = now.moved(tried);
                let changed = frz_tracker_params { rebuild, cell, ..tracker_params(tried) };
                frz_tracker_set_params(tracker, &changed);
                let dt = tried.any(1e-3, 1.0);
                frame(tried, tracker, [&now, &next], dt);
                // What could not be followed begins anew.
                now = next;
            }
        }
        frz_tracker_destroy(tracker);
        frz_mesh_destroy(mesh);
    }
}

pub fn tracker(tried: &mut Tried) {
    each_tracker(tried, |tried, tracker, [now, next], dt| {
        let (from, to) = (now.given(), next.given());
        // SAFETY: the pointers are valid.
        tried.step(|ctx| unsafe { frz_tracker_step(ctx, tracker, &from, &to, dt, null_mut()) });
    });
}

pub fn eased(tried: &mut Tried) {
    each_tracker(tried, |tried, tracker, [now, next], dt| {
        let later = next.moved(tried);
        let (from, coming) = (now.given(), [next.given(), later.given()]);
        let coming = coming.each_ref().map(std::ptr::from_ref);
        let mut room = vec![[0.0f64; 3]; 200_000];
        let span = frz_span { data: room.as_mut_ptr().cast(), count: room.len(), stride: 0 };
        // SAFETY: the pointers are valid.
        unsafe {
            tried.step(|ctx| frz_tracker_read_eased(ctx, tracker, &from, coming.as_ptr(), 2, 2, dt, span));
            // It may be refused: then the frame is passed over.
            frz_tracker_step(tried.ctx(), tracker, &from, coming[0], dt, null_mut());
        }
    });
}
