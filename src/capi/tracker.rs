//! A detailed mesh that follows the particles of a liquid.

use std::ffi::c_void;

use super::context::{creates, enter, frz_context};
use super::guard::{Failure, Outcome, frz_status, guard};
use super::handle::{Noun, change, clear, destroy, read, required};
use super::mesh::{frz_mesh, no_flags};
use super::saved::{Saved, resumed};
use super::tracker_edits::Edits;
use super::views::{Sized32, fill, finite, frz_view, meaning, sized, within};
use crate::base::topology::Topology;
use crate::surface::{Change, Params, Particles, Tracker, Weighting, estimate_spacing};

/// A detailed mesh that follows the particles of a liquid.
pub struct frz_tracker {
    _opaque: [u8; 0],
}

/// The particles of a liquid at one time. Their order does not matter.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_particles {
    /// sizeof(frz_particles).
    pub struct_size: u32,
    /// 0.
    pub flags: u32,
    /// double[3] for each particle (m), finite.
    pub positions: frz_view,
    /// float[3] for each particle (m/s), finite; data NULL with a count of 0: not known.
    pub velocities: frz_view,
    /// int64_t for each particle, no two the same: a particle keeps its own from time to time; data NULL with a count of 0: not
    /// known.
    pub ids: frz_view,
}

// SAFETY: numbers and pointers.
unsafe impl Sized32 for frz_particles {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_particles";
}

/// How particles carry vertices.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_weighting {
    /// By affine maps: exact where the liquid turns and stretches.
    FRZ_TRACKER_AFFINE = 0,
    /// By their mean, as in the thesis: it lags behind.
    FRZ_TRACKER_MEAN = 1,
}

use frz_tracker_weighting::*;

const WEIGHTINGS: [(u32, Weighting); 2] =
    [(FRZ_TRACKER_AFFINE as u32, Weighting::Affine), (FRZ_TRACKER_MEAN as u32, Weighting::Mean)];

/// How a mesh follows particles. All of it but the spacing, the cell and whether it is rebuilt may change between steps.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_tracker_params {
    /// sizeof(frz_tracker_params).
    pub struct_size: u32,
    /// 0.
    pub flags: u32,
    /// Initial distance r between particles (m), 1e-9 to 1e6: see frz_particles_spacing. No usual one: it must be set.
    pub spacing: f64,
    /// Edge of a cell of the particles' surface (r), 0.125 to 2; 0.5 is usual.
    pub cell: f64,
    /// Vertices that would be moved farther (r) to keep their detail are flagged, 0.001 to 100: the liquid has merged or split
    /// there. 0.5 is usual.
    pub change: f64,
    /// Time (s) in which half of the detail fades, above 0; infinite, as is usual: it stays. It stays anyway where the mesh's attribute
    /// "detail" of one float is 1, and fades as fast as this says where that is 0. A vertex that a step makes has the mean of those of
    /// its neighbours that were there, 0 without any.
    pub half_life: f64,
    /// How much detail fades where the mesh is strained: to exp(-fade) of it while lengths change by a factor of e, 0 to 1000; 0,
    /// as is usual: not at all.
    pub fade: f64,
    /// A frz_tracker_weighting; FRZ_TRACKER_AFFINE is usual.
    pub weighting: u32,
    /// 0.
    pub reserved: u32,
    /// 1: where the liquid merges or splits the mesh is rebuilt, and merges or splits with it; where it is stretched or squeezed, edges
    /// are divided or go. It must be closed, a 2-manifold by its indices. 0, as is usual: the mesh keeps the vertices and the faces
    /// that it was made with, and is flagged where it no longer fits. With 1 any step may change both (frz_tracker_report.changed): a
    /// host has to read the triangles anew, and to take its own arrays along (frz_tracker_read_edits), which one that knows nothing of
    /// it does not do.
    pub rebuild: u32,
    /// 0.
    pub reserved2: u32,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_tracker_params {
    const SIZES: &'static [usize] = &[std::mem::offset_of!(frz_tracker_params, rebuild), size_of::<Self>()];
    const NAME: &'static str = "frz_tracker_params";
}

impl frz_tracker_params {
    fn usual() -> Self {
        let usual = Params::for_spacing(0.0);
        Self {
            struct_size: 0,
            flags: 0,
            spacing: usual.spacing,
            cell: usual.cell,
            change: usual.change,
            half_life: usual.half_life,
            fade: usual.fade,
            weighting: FRZ_TRACKER_AFFINE as u32,
            reserved: 0,
            rebuild: u32::from(usual.rebuild),
            reserved2: 0,
        }
    }

    /// The library's own parameters; what is out of range is named.
    fn params(&self) -> Outcome<Params> {
        no_flags(self.flags, 0)?;
        within("reserved", f64::from(self.reserved), 0.0..=0.0, "")?;
        within("rebuild", f64::from(self.rebuild), 0.0..=1.0, "")?;
        within("reserved2", f64::from(self.reserved2), 0.0..=0.0, "")?;
        let numbers = [self.spacing, self.cell, self.change, self.fade];
        for (name, value) in ["spacing", "cell", "change", "fade"].into_iter().zip(numbers) {
            finite(name, value)?;
        }
        let weighting = meaning("weighting", "frz_tracker_weighting", self.weighting, &WEIGHTINGS)?;
        let params = Params {
            spacing: self.spacing,
            cell: self.cell,
            change: self.change,
            weighting,
            half_life: self.half_life,
            fade: self.fade,
            rebuild: self.rebuild == 1,
        };
        params.validate()?;
        Ok(params)
    }
}

/// What a step did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_tracker_report {
    /// sizeof(frz_tracker_report), set by the caller.
    pub struct_size: u32,
    /// Parts into which the step was divided, for no particle to move farther than its spacing in one.
    pub parts: u32,
    /// Vertices whose projection jumped: the liquid merged or split there. They are flagged.
    pub jumped: u64,
    /// Vertices whose projection did not find the particles' surface. They are flagged.
    pub lost: u64,
    /// Particles that are new.
    pub born: u64,
    /// Particles that are gone.
    pub died: u64,
    /// Triangles of the particles' own surface.
    pub triangles: u64,
    /// Parts of that surface that the mesh does not cover: drops outside of it.
    pub drops: u64,
    /// The same: bubbles inside.
    pub bubbles: u64,
    /// Vertices beside which there is surface that the mesh does not cover: the liquid begins to merge or to split there. They are
    /// flagged.
    pub uncovered: u64,
    /// 1 where the mesh has other vertices or triangles now (frz_tracker_read_edits); else 0, and so is all below.
    pub changed: u32,
    /// How much more was rebuilt than the cells in which the mesh no longer fitted, and what they need: 0 nothing, 1 a ring of cells
    /// around them, 2 the whole parts of the mesh that pass through them, 3 everything.
    pub rung: u32,
    /// Cells in which the mesh no longer fitted.
    pub changed_cells: u64,
    /// Cells in which it was rebuilt; 0 where edges were only divided, turned, or went.
    pub rebuilt_cells: u64,
    /// Triangles that are new, or parts of others.
    pub made_triangles: u64,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_tracker_report {
    const SIZES: &'static [usize] = &[
        std::mem::offset_of!(frz_tracker_report, uncovered),
        std::mem::offset_of!(frz_tracker_report, changed),
        size_of::<Self>(),
    ];
    const NAME: &'static str = "frz_tracker_report";
}

impl frz_tracker_report {
    const NOTHING: Self = Self {
        struct_size: 0,
        parts: 0,
        jumped: 0,
        lost: 0,
        born: 0,
        died: 0,
        triangles: 0,
        drops: 0,
        bubbles: 0,
        uncovered: 0,
        changed: 0,
        rung: 0,
        changed_cells: 0,
        rebuilt_cells: 0,
        made_triangles: 0,
    };
}

/// The value of a tracker's handle.
pub(super) struct Follower {
    /// The mesh.
    pub tracker: Tracker,
    /// What the last step made of it; none: it changed no triangle, or there was none yet.
    pub edits: Option<Edits>,
    saved: Saved,
}

/// Refuses to rebuild a mesh of a state that is not closed, as [`Tracker::new`] does one at the first frame.
fn check_closed(tracker: &Tracker) -> Outcome {
    let triangles = tracker.triangles();
    // Nothing is left where all of the liquid has gone.
    if triangles.is_empty() || Topology::of(tracker.vertices().len(), triangles).is_watertight() {
        return Ok(());
    }
    Err(Failure::argument("the mesh is not closed and 2-manifold by index, as it must be to be rebuilt"))
}

impl Noun for frz_tracker {
    type Value = Follower;
    const NAME: &'static str = "tracker";
    const TAG: u32 = 0x6672_7a08;
}

/// Particles from a host's arrays, checked.
///
/// # Safety
/// The pointer must be NULL or the caller's, and its views describe memory that can be read.
unsafe fn particles(pointer: *const frz_particles) -> Outcome<Particles> {
    let none = frz_view::NONE;
    let usual = frz_particles { struct_size: 0, flags: 0, positions: none, velocities: none, ids: none };
    // SAFETY: the caller's promise.
    let (places, velocities, ids) = unsafe {
        let given = sized(pointer, usual)?;
        no_flags(given.flags, 0)?;
        (
            given.positions.elements::<[f64; 3]>("positions")?,
            given.velocities.elements::<[f32; 3]>("velocities")?,
            given.ids.elements::<i64>("ids")?,
        )
    };
    let particles = Particles { places: places.into_iter().map(Into::into).collect(), velocities, ids };
    particles.validate()?;
    Ok(particles)
}

/// Fills parameters with the usual values; the spacing must be set.
///
/// params: receives them.
/// size: sizeof(frz_tracker_params).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_params_init(params: *mut frz_tracker_params, size: usize) -> frz_status {
    // SAFETY: the parameters are NULL or have so many bytes.
    guard(|| unsafe { fill(params, Some(size), frz_tracker_params::usual()) })
}

/// Estimates the initial distance between particles: from the median of the mean distances to the six nearest ones.
///
/// particles: as they are at the first frame.
/// spacing: receives it (m); 0 where there are too few particles, or too many at one place, to tell, and after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_particles_spacing(
    context: *mut frz_context,
    particles: *const frz_particles,
    spacing: *mut f64,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(spacing);
            required(spacing, "spacing")?;
            let call = enter(context)?;
            let particles = self::particles(particles)?;
            let estimate = call.ctx().phase("spacing", || Ok(estimate_spacing(&particles.places)))?;
            spacing.write_unaligned(estimate.unwrap_or(0.0));
            Ok(())
        }
    })
}

/// Makes a mesh that follows particles: as it is at the first frame, or in a state that frz_tracker_save wrote.
///
/// params: see frz_tracker_params.
/// mesh: at the first frame, in the particles' space; also with a restart. It is copied, and may be open, cross itself and repeat
///     vertices; with params.rebuild it must be closed, each edge with two triangles that agree about which side is out, each
///     vertex with one fan of them: see frz_mesh_repair. FRZ_ERROR_ARGUMENT says where it is not, or is not where the particles
///     are.
/// particles: at the first frame; NULL with a restart.
/// restart: restart_bytes bytes of frz_tracker_save of a tracker of the same mesh, spacing and cell: it comes back bit for bit, on
///     any number of threads. NULL: none. Bytes that are damaged, of another version, mesh, spacing or cell are FRZ_ERROR_FILE.
/// restart_bytes: 0 without a restart.
/// out: receives the tracker, to be destroyed with frz_tracker_destroy; NULL after a failure.
///
/// One thread at a time for each context; any number may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_create(
    context: *mut frz_context,
    params: *const frz_tracker_params,
    mesh: *const frz_mesh,
    particles: *const frz_particles,
    restart: *const c_void,
    restart_bytes: usize,
    out: *mut *mut frz_tracker,
) -> frz_status {
    // SAFETY: the pointers are NULL or the caller's.
    unsafe {
        creates(context, out, |ctx| {
            let params = sized(params, frz_tracker_params::usual())?.params()?;
            let mesh = read(mesh)?;
            let triangles = &mesh.triangles;
            let state =
                frz_view { data: restart, count: restart_bytes, stride: 0 }.elements::<u8>("restart")?;
            let mut tracker = match restart.is_null() {
                true => {
                    let particles = self::particles(particles)?;
                    Tracker::new(ctx, params, triangles, &particles)?
                }
                false => resumed(ctx, "a tracker", Tracker::unpacked(&state), || {
                    Tracker::resume(params, triangles, &state)
                })?,
            };
            if params.rebuild && !restart.is_null() {
                check_closed(&tracker)?;
            }
            // A mesh that was rebuilt has it in its state.
            if !tracker.is_rebuilt() {
                tracker.set_lasting(mesh.attribute("detail", 1).unwrap_or_default().to_vec())?;
            }
            Ok(Follower { tracker, edits: None, saved: Saved::default() })
        })
    }
}

/// Destroys a tracker; NULL is fine.
///
/// tracker: may be NULL. Not while a call uses it: it then stays.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_destroy(tracker: *mut frz_tracker) {
    // SAFETY: the tracker is NULL or was not destroyed.
    guard(|| unsafe { destroy(tracker) });
}

/// Sets how a mesh follows from the next step on. The spacing, the cell and whether it is rebuilt must stay.
///
/// params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_set_params(
    tracker: *mut frz_tracker,
    params: *const frz_tracker_params,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let mut follower = change(tracker)?;
            let params = sized(params, frz_tracker_params::usual())?.params()?;
            Ok(follower.tracker.set_params(params)?)
        }
    })
}

/// Hands over the particles to which the step after the coming one goes, early: with frz_tracker_params.rebuild their surface is made
/// while the coming step rebuilds the mesh, on threads that have nothing to do. It makes no difference to what comes out; particles that
/// then do not come cost time.
///
/// particles: as they will be; they are copied.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_ahead(
    tracker: *mut frz_tracker,
    particles: *const frz_particles,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let mut follower = change(tracker)?;
            let particles = self::particles(particles)?;
            particles.validate()?;
            follower.tracker.set_ahead(std::sync::Arc::new(particles));
            Ok(())
        }
    })
}

/// Moves the mesh with its particles from one time to another. After a failure or a cancel it is as it was before. With
/// frz_tracker_params.rebuild it may have other vertices and triangles afterwards.
///
/// from: the particles as they were at the last step's end.
/// to: the particles at this step's end. Those of the same id are the same; where one of the two has no ids, from must have
///     velocities.
/// dt: time between them (s), above 0.
/// report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_step(
    context: *mut frz_context,
    tracker: *mut frz_tracker,
    from: *const frz_particles,
    to: *const frz_particles,
    dt: f64,
    report: *mut frz_tracker_report,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            if !report.is_null() {
                fill(report, None, frz_tracker_report::NOTHING)?;
            }
            let call = enter(context)?;
            let mut follower = change(tracker)?;
            finite("dt", dt)?;
            let (from, to) = (particles(from)?, particles(to)?);
            let done = follower.tracker.step(call.ctx(), &from, &to, dt)?;
            follower.saved.take();
            let drops = done.apart.iter().filter(|apart| apart.volume >= 0.0).count();
            let of_change = |count: fn(&Change) -> usize| done.change.as_ref().map_or(0, count);
            let told = frz_tracker_report {
                struct_size: 0,
                parts: done.parts as u32,
                jumped: done.jumped as u64,
                lost: done.lost as u64,
                born: done.born as u64,
                died: done.died as u64,
                triangles: done.triangles as u64,
                drops: drops as u64,
                bubbles: (done.apart.len() - drops) as u64,
                uncovered: done.uncovered as u64,
                changed: u32::from(done.change.is_some()),
                rung: of_change(|change| change.rung) as u32,
                changed_cells: of_change(|change| change.flagged_cells) as u64,
                rebuilt_cells: of_change(|change| change.rebuilt_cells) as u64,
                made_triangles: of_change(Change::made_triangles) as u64,
            };
            follower.edits = done.change.map(Edits::from);
            if report.is_null() { Ok(()) } else { fill(report, None, told) }
        }
    })
}

/// Writes all that the next step depends on, besides the parameters, the mesh and the particles: for a host's own cache. The bytes
/// are the same on any number of threads.
///
/// dst: room for capacity bytes. NULL: size receives their number, and nothing is written.
/// capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
/// size: receives the bytes that were written, or are needed; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_save(
    context: *mut frz_context,
    tracker: *const frz_tracker,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(size);
            required(size, "size")?;
            let call = enter(context)?;
            let follower = read(tracker)?;
            let tracker = &follower.tracker;
            let save = || call.ctx().phase("save", || Ok(tracker.save()));
            follower.saved.write((dst, capacity, size), save)
        }
    })
}
