//! Level sets: from meshes, particles and motion, and tools that change them.

use super::body::{Role, Shapes, bodies, frz_body};
use crate::capi::ffi::*;
use crate::capi::grid::sparse::{check_voxel, frz_grid};
use crate::capi::mesh::triangles::frz_mesh;
use crate::capi::runtime::context::{creates, enter, frz_context};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::motion::{Keys, Rigid};
use crate::snow::{NoiseParams, base_layer};
use crate::sweep::{self, Body, Settings, surface_bytes};
use crate::vdb::level_set::{self, Scheme};
use crate::vdb::{FloatGrid, GridClass, distances};

/// Operations of frz_levelset_csg.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_csg {
    /// Points in either one.
    FRZ_CSG_UNION = 0,
    /// Points in the first but not in the second.
    FRZ_CSG_DIFFERENCE = 1,
    /// Points in both.
    FRZ_CSG_INTERSECTION = 2,
}

/// Filters of frz_levelset_smooth.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_smoothing {
    /// Mean over cubes.
    FRZ_SMOOTH_MEAN = 0,
    /// Mean over cubes, applied four times in a row.
    FRZ_SMOOTH_GAUSSIAN = 1,
}

/// Accuracy of the tools that renormalise distances as they go.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_scheme {
    /// First order in space and time: about seven times faster.
    FRZ_SCHEME_FIRST_ORDER = 0,
    /// Fifth-order WENO.
    FRZ_SCHEME_WENO5 = 1,
}

/// Irregularity of a surface, which moves outward where the noise is positive.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_noise {
    /// Maximum displacement (m), 0 to 32 voxels; 0: none; -1: two voxels. An amplitude that would cut off islands is refused, and the error
    /// states the largest that would not.
    pub amplitude: f64,
    /// Size of the largest clumps (m), 2 to 10000 voxels; -1: eight voxels.
    pub size: f64,
    /// Number of octaves, each of half the size and a quarter of the strength, 1 to 8.
    pub octaves: u32,
    /// Seed of the pattern, which is fixed in world space.
    pub seed: i32,
}

impl frz_noise {
    /// The defaults for hosts.
    pub(in crate::capi) const DEFAULTS: Self = Self { amplitude: -1.0, size: -1.0, octaves: 3, seed: 0 };

    /// The library's own parameters for voxels of a size (m); `None` for no noise.
    pub(in crate::capi) fn params(&self, cell: f64) -> Outcome<Option<NoiseParams>> {
        finite("noise amplitude", self.amplitude)?;
        finite("noise size", self.size)?;
        let defaults = NoiseParams::for_cell(cell);
        let or = |value: f64, default: f64| if value == -1.0 { default } else { value };
        let params = NoiseParams {
            amplitude: or(self.amplitude, defaults.amplitude),
            size: or(self.size, defaults.size),
            octaves: self.octaves,
            seed: self.seed,
        };
        Ok((params.amplitude != 0.0).then_some(params))
    }
}

fn settings(voxel: f64, half_width: f32) -> Outcome<Settings> {
    check_voxel(voxel)?;
    finite("half_width", f64::from(half_width))?;
    let settings = Settings { half_width, ..Settings::new(voxel) };
    settings.validate()?;
    Ok(settings)
}

fn scheme_of(number: u32) -> Outcome<Scheme> {
    let known = [
        (frz_scheme::FRZ_SCHEME_FIRST_ORDER as u32, Scheme::FirstOrder),
        (frz_scheme::FRZ_SCHEME_WENO5 as u32, Scheme::Weno5),
    ];
    meaning("scheme", "frz_scheme", number, &known)
}

type Combine = fn(&Context, &FloatGrid, &FloatGrid) -> Result<FloatGrid>;
type Filter = fn(&Context, &mut FloatGrid, u32, u32, Scheme) -> Result<()>;

/// Refuses a grid that is not a level set, and warns if its values are not distances in metres.
fn level_set_of<'a>(ctx: &Context, grid: &'a FloatGrid) -> Outcome<&'a FloatGrid> {
    refuse(grid.class() != GridClass::LevelSet, || "the grid is not a level set")?;
    if let Some(what) = distances::warning(grid)? {
        ctx.warn(&format!("the grid {what}"));
    }
    Ok(grid)
}

/// The body of an interface function that changes a level set owned by the caller.
///
/// # Safety
/// The pointers must be NULL or handles that were not destroyed.
unsafe fn changes(
    context: *const frz_context,
    inout: *mut frz_grid,
    work: impl FnOnce(&Context, &mut FloatGrid) -> Outcome,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        let call = enter(context)?;
        let mut held = change(inout)?;
        let grid = held.own_floats()?;
        level_set_of(call.ctx(), grid)?;
        work(call.ctx(), grid)
    })
}

/// Creates a level set of the solid that a mesh bounds: the points around which its faces wind.
///
/// The mesh may be open (open loops are closed), intersect itself, and have duplicate or reversed faces: closed parts are turned outward,
/// duplicate faces count once, and ambiguous cases cause a warning.
///
/// mesh: with at least one face.
/// voxel_size: edge of a voxel (m), 1e-6 to 1000.
/// half_width: half width of the band of distances (voxels), 3 to 64.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// Any number of threads may read a mesh; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_from_mesh(
    context: *mut frz_context,
    mesh: *const frz_mesh,
    voxel_size: f64,
    half_width: f32,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let mesh = read(mesh)?;
            let settings = settings(voxel_size, half_width)?;
            ctx.allow("a level set of the mesh", surface_bytes(mesh.triangles.area(), voxel_size))?;
            let solid = mesh.triangles.clone();
            Ok(ctx.polled(|| {
                let still = Body::new(Box::new(Rigid::new(solid, Keys::default())), 0.0)?;
                if let Some(what) = still.warning() {
                    ctx.warn(&format!("the mesh: {what}"));
                }
                sweep::chain(ctx, &[still], 0.0, 0.0, &settings)
            })?)
        })
    }
}

/// Creates a level set of the union of spheres.
///
/// positions: float[3] for each sphere (m), finite.
/// radii: float for each sphere (m), finite, above 0, as large as memory allows. Spheres smaller than one and a half voxels are left out:
///     the grid cannot represent them.
/// voxel_size: edge of a voxel (m), 1e-6 to 1000.
/// half_width: half width of the band of distances (voxels), 3 to 64.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_from_particles(
    context: *mut frz_context,
    positions: frz_view,
    radii: frz_view,
    voxel_size: f64,
    half_width: f32,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let settings = settings(voxel_size, half_width)?;
            let positions = positions.finite("positions")?;
            let radii = radii.elements::<f32>("radii")?;
            if let Some(at) = radii.iter().position(|radius| !radius.is_finite()) {
                return Err(Failure::argument(format!("radii: element {at} is not finite")));
            }
            if let Some(at) = radii.iter().position(|radius| *radius <= 0.0) {
                let text = format!("radii: element {at} = {} m is not above 0", radii[at]);
                return Err(Failure::argument(text));
            }
            let area: f64 =
                radii.iter().map(|&radius| 4.0 * std::f64::consts::PI * f64::from(radius).powi(2)).sum();
            ctx.allow("a level set of the spheres", surface_bytes(area, voxel_size))?;
            reachable(&positions, &radii, voxel_size)?;
            let positions: Vec<DVec3> = positions.iter().map(|&p| DVec3::from(p.map(f64::from))).collect();
            Ok(ctx.phase("spheres", || {
                level_set::from_particles(ctx, &positions, &radii, voxel_size, settings.half_width)
            })?)
        })
    }
}

/// Refuses spheres whose voxels are outside the range of coordinates.
fn reachable(positions: &[[f32; 3]], radii: &[f32], voxel: f64) -> Outcome {
    let far = |(p, &radius): (&[f32; 3], &f32)| {
        p.iter().any(|&x| (f64::from(x).abs() + f64::from(radius)) / voxel > f64::from(1 << 29))
    };
    match positions.iter().zip(radii).position(far) {
        Some(at) => Err(Failure::argument(format!("positions: element {at} is too far from the origin"))),
        None => Ok(()),
    }
}

/// Combines two level sets.
///
/// operation: a frz_csg.
/// inout: owned by the caller; becomes the result, and is unchanged after a failure.
/// other: with voxels of the same size and position; it is not modified.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_csg(
    context: *mut frz_context,
    operation: u32,
    inout: *mut frz_grid,
    other: *const frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, inout, |ctx, first| {
            let other = read(other)?;
            let second = level_set_of(ctx, other.floats()?)?;
            ctx.allow("the joined level sets", first.memory_bytes().saturating_add(second.memory_bytes()))?;
            let known: [(u32, Combine); 3] = [
                (frz_csg::FRZ_CSG_UNION as u32, level_set::union_copy),
                (frz_csg::FRZ_CSG_DIFFERENCE as u32, level_set::difference_copy),
                (frz_csg::FRZ_CSG_INTERSECTION as u32, level_set::intersection_copy),
            ];
            let tool = meaning("operation", "frz_csg", operation, &known)?;
            let mut joined = ctx.phase("csg", || tool(ctx, first, second))?;
            joined.set_name(&first.name())?;
            *first = joined;
            Ok(())
        })
    }
}

/// Moves the surface of a level set along its normals.
///
/// inout: owned by the caller; unchanged after a failure.
/// distance: outward (m), negative inward; at most 1000 voxels.
/// scheme: a frz_scheme.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_offset(
    context: *mut frz_context,
    inout: *mut frz_grid,
    distance: f32,
    scheme: u32,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, inout, |ctx, grid| {
            let scheme = scheme_of(scheme)?;
            finite("distance", f64::from(distance))?;
            let voxels = f64::from(distance) / grid.voxel_size();
            refuse(!(-1000.0..=1000.0).contains(&voxels), || {
                format!("distance = {distance} m is more than 1000 voxels")
            })?;
            ctx.allow("the moved level set", grown_bytes(grid, voxels))?;
            Ok(ctx.phase_in_place("offset", || level_set::offset(ctx, grid, distance, scheme))?)
        })
    }
}

/// Upper bound of the memory (bytes) of a level set whose surface moved outward by some voxels: that of its bounding box.
fn grown_bytes(grid: &FloatGrid, voxels: f64) -> u64 {
    let (low, high) = grid.active_bbox().unwrap_or_default();
    let size = [0, 1, 2].map(|a| f64::from(high[a]) - f64::from(low[a]) + 1.0 + 2.0 * voxels.max(0.0));
    let area = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
    grid.memory_bytes().saturating_add(if voxels > 0.0 { surface_bytes(area, 1.0) } else { 0 })
}

/// Smooths a level set.
///
/// inout: owned by the caller; unchanged after a failure.
/// smoothing: a frz_smoothing.
/// width: 1 to 32; means are taken over cubes with an edge of 2 width + 1 voxels.
/// times: number of passes, 1 to 1000.
/// scheme: a frz_scheme.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_smooth(
    context: *mut frz_context,
    inout: *mut frz_grid,
    smoothing: u32,
    width: u32,
    times: u32,
    scheme: u32,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, inout, |ctx, grid| {
            let scheme = scheme_of(scheme)?;
            for (name, value, max) in [("width", width, 32), ("times", times, 1000)] {
                refuse(!(1..=max).contains(&value), || format!("{name} = {value} is not within 1 to {max}"))?;
            }
            ctx.allow("the smoothed level set", grid.memory_bytes())?;
            let known: [(u32, Filter); 2] = [
                (frz_smoothing::FRZ_SMOOTH_MEAN as u32, level_set::mean_filter),
                (frz_smoothing::FRZ_SMOOTH_GAUSSIAN as u32, level_set::gaussian_filter),
            ];
            let filter = meaning("smoothing", "frz_smoothing", smoothing, &known)?;
            Ok(ctx.phase_in_place("smooth", || filter(ctx, grid, width, times, scheme))?)
        })
    }
}

/// Moves the surface of a level set outward by noise.
///
/// inout: owned by the caller, with voxels fixed in world space; unchanged after a failure.
/// noise: its parameters.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_displace(
    context: *mut frz_context,
    inout: *mut frz_grid,
    noise: *const frz_noise,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        changes(context, inout, |ctx, grid| {
            refuse(
                !grid.is_world_fixed(),
                || "the grid's voxels are rotated or shifted relative to the world's axes",
            )?;
            let noise = required(noise.cast_mut(), "noise")?.read_unaligned();
            let Some(params) = noise.params(grid.voxel_size())? else { return Ok(()) };
            params.validate(grid.voxel_size())?;
            ctx.allow("the displaced level set", grid.memory_bytes().saturating_mul(4))?;
            Ok(ctx.polled(|| base_layer::displace(ctx, grid, &params))?)
        })
    }
}

/// Creates a level set of all the space that bodies pass through in a step.
///
/// It is exact to 0.02 voxel: no dents between poses, no ripples.
///
/// bodies: count bodies, at least one. A vertex farther than 131064 voxels from the first vertex of the first body is out of reach:
///     FRZ_ERROR_ARGUMENT names the index of its body.
/// dt: length of the step (s); 0: the bodies at their positions at its beginning.
/// voxel_size: edge of a voxel (m), 1e-6 to 1000.
/// half_width: half width of the band of distances (voxels), 3 to 64.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_levelset_sweep(
    context: *mut frz_context,
    bodies: *const frz_body,
    count: usize,
    dt: f64,
    voxel_size: f64,
    half_width: f32,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let settings = settings(voxel_size, half_width)?;
            let bodies = self::bodies(ctx, bodies, count, dt, Role::Sweep, &mut Shapes::new())?;
            let bodies: Vec<Body> = bodies.into_iter().map(|(body, _)| body).collect();
            ctx.polled(|| check_reach(&bodies, dt, voxel_size))?;
            Ok(ctx.polled(|| sweep::chain(ctx, &bodies, 0.0, dt, &settings))?)
        })
    }
}

/// Maximum distance of a sweep from its first vertex (voxels): the reach of the lattice, minus one block for its origin.
const REACH: f64 = 131_064.0;

/// Refuses bodies that move beyond the reach of a sweep's lattice; the error names the first one by its index.
fn check_reach(bodies: &[Body], dt: f64, voxel: f64) -> Result<()> {
    let mut pose = Vec::new();
    let mut first = None;
    for (index, body) in bodies.iter().enumerate() {
        let times = [vec![0.0], body.motion().breaks(0.0, dt), vec![dt]].concat();
        for time in times {
            body.motion().pose(time, &mut pose)?;
            let first = *first.get_or_insert(pose[0]);
            let far = pose.iter().map(|p| (p - first).amax()).fold(0.0, f64::max);
            if far > REACH * voxel {
                let what = format!("body {index}: a vertex lies");
                return Err(Error::argument(sweep::too_far(&what, far, "the first one", voxel)));
            }
        }
    }
    Ok(())
}
