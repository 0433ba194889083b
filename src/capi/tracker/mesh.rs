//! Trackers: detailed meshes that follow the particles of a liquid.

use std::ffi::c_void;

use super::handle::{TrackerHandle, frz_tracker};
pub use super::params::{frz_tracker_params, frz_tracker_params_init};
use crate::capi::ffi::saved::{Restart, new_or_resumed, saves};
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::{frz_mesh, no_flags};
use crate::capi::runtime::context::{creates, enter, frz_context, steps};
use crate::capi::tracker::handle::Edits;
use crate::context::Context;
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::check::topology::Topology;
use crate::surface::{Change, Outlook, Params, Particles, StepReport, Tracker, estimate_spacing};

/// The particles of a liquid at one time. Their order does not matter.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_particles {
    /// sizeof(frz_particles).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// double[3] for each particle (m), finite.
    pub positions: frz_view,
    /// float[3] for each particle (m/s), finite; data NULL with a count of 0: unknown.
    pub velocities: frz_view,
    /// int64_t for each particle, all different: a particle keeps its id over time; data NULL with a count of 0: unknown.
    pub ids: frz_view,
}

sized32!(frz_particles);

/// What a step did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_tracker_report {
    /// sizeof(frz_tracker_report), set by the caller.
    pub struct_size: u32,
    /// Sub-steps of the step, enough that no particle moves farther than the particle spacing in one.
    pub parts: u32,
    /// Vertices whose projection jumped: the liquid merged or split there. They are flagged.
    pub jumped: u64,
    /// Vertices whose projection did not find the particles' surface. They are flagged.
    pub lost: u64,
    /// New particles.
    pub born: u64,
    /// Particles that disappeared.
    pub died: u64,
    /// Triangles of the particles' own surface.
    pub triangles: u64,
    /// Parts of that surface that the mesh does not cover: drops outside it.
    pub drops: u64,
    /// Parts of that surface inside the mesh that the mesh lacks: bubbles.
    pub bubbles: u64,
    /// Vertices next to surface that the mesh does not cover: the liquid begins to merge or to split there. They are flagged.
    pub uncovered: u64,
    /// 1 if the mesh now has other vertices or triangles (frz_tracker_read_edits); else 0, as are all fields below.
    pub changed: u32,
    /// Rebuild level: what was rebuilt beyond the cells in which the mesh no longer fitted the liquid and those that they require: 0
    /// nothing, 1 a ring of cells around them, 2 the whole parts of the mesh that pass through them, 3 everything.
    pub rung: u32,
    /// Cells in which the mesh no longer fitted the liquid.
    pub changed_cells: u64,
    /// Cells in which it was rebuilt; 0 if edges were only split, flipped or collapsed.
    pub rebuilt_cells: u64,
    /// Triangles that are new, or parts of previous ones.
    pub made_triangles: u64,
    /// Parts of the mesh that were removed because they held some particles, but fewer than frz_tracker_params.min_drop.
    pub specks: u64,
}

sized32!(frz_tracker_report, [uncovered, changed, specks]);

fields_of!(StepReport => frz_tracker_report { parts, jumped, lost, born, died, triangles, uncovered });

/// Refuses to rebuild a restored mesh that is not closed, as [`Tracker::new`] does at the first frame.
fn check_closed(tracker: &Tracker) -> Outcome {
    let triangles = tracker.triangles();
    // The mesh is empty once all of the liquid is gone.
    if triangles.is_empty() || Topology::of(tracker.vertices().len(), triangles).is_watertight() {
        return Ok(());
    }
    Err(Failure::argument("the mesh is not closed and 2-manifold by index, as it must be to be rebuilt"))
}

/// Particles from a host's arrays, checked.
///
/// # Safety
/// The pointer must be NULL or valid, and its views must describe memory that can be read.
pub(in crate::capi) unsafe fn particles(pointer: *const frz_particles) -> Outcome<Particles> {
    // SAFETY: guaranteed by the caller.
    let (positions, velocities, ids) = unsafe {
        let given = given(pointer)?;
        no_flags(given.flags, 0)?;
        (
            given.positions.elements::<[f64; 3]>("positions")?,
            given.velocities.elements::<[f32; 3]>("velocities")?,
            given.ids.elements::<i64>("ids")?,
        )
    };
    let particles = Particles { positions: positions.into_iter().map(Into::into).collect(), velocities, ids };
    particles.validate()?;
    Ok(particles)
}

impl TrackerHandle {
    /// A tracker at the first frame, or in a saved state.
    ///
    /// # Safety
    /// The pointers must be NULL or valid.
    unsafe fn new(
        ctx: &Context,
        params: Params,
        mesh: *const frz_mesh,
        particles: *const frz_particles,
        restart: Restart,
    ) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        let mesh = unsafe { read(mesh) }?;
        let triangles = &mesh.triangles;
        let new = || -> Outcome<Tracker> {
            // SAFETY: as above.
            let particles = unsafe { self::particles(particles) }?;
            if params.rebuild && !Orientation::of_mesh(triangles, Closing::Caps).is_unchanged() {
                ctx.warn("the mesh: parts of it are inside out: reverse their faces");
            }
            Ok(Tracker::new(ctx, params, triangles, &particles)?)
        };
        let resume = |state: &[u8]| Tracker::resume(params, triangles, state);
        // SAFETY: as above.
        let mut tracker =
            unsafe { new_or_resumed(ctx, "a tracker", restart, new, Tracker::unpacked_size, resume) }?;
        if params.rebuild && !restart.0.is_null() {
            check_closed(&tracker)?;
        }
        // The state of a rebuilt mesh contains the mesh.
        if !tracker.is_rebuilt() {
            tracker.set_detail_retention(mesh.attribute("detail", 1).unwrap_or_default().to_vec())?;
        }
        let (outlook, saved) = Default::default();
        Ok(Self { tracker, edits: None, outlook, saved, has_warned: false })
    }

    /// Moves the mesh through a step of `dt` seconds.
    fn step(
        &mut self,
        ctx: &Context,
        from: &Particles,
        to: &Particles,
        dt: f64,
    ) -> Outcome<frz_tracker_report> {
        // Taking a step that was computed in advance does not check for a cancel.
        ctx.check()?;
        let mut done = match self.outlook.take(from, to, dt) {
            Some((tracker, done)) => {
                self.tracker = tracker;
                done
            }
            None => self.tracker.step(ctx, from, to, dt)?,
        };
        self.saved.take();
        done.new_warnings(&mut self.has_warned).for_each(|warning| ctx.warn(warning));
        let drops = done.uncovered_parts.iter().filter(|part| part.volume >= 0.0).count();
        let bubbles = done.uncovered_parts.len() - drops;
        let change = done.change.take();
        let of_change = |count: fn(&Change) -> usize| change.as_ref().map_or(0, count) as u64;
        let report = frz_tracker_report {
            drops: drops as u64,
            bubbles: bubbles as u64,
            changed: u32::from(change.is_some()),
            rung: of_change(|change| change.rebuild_level) as u32,
            changed_cells: of_change(|change| change.flagged_cells),
            rebuilt_cells: of_change(|change| change.rebuilt_cells),
            made_triangles: of_change(Change::made_triangles),
            specks: of_change(|change| change.specks),
            ..done.into()
        };
        self.edits = change.map(Edits::from);
        Ok(report)
    }
}

/// Estimates the initial distance between particles: from the median of the mean distances to the six nearest particles.
///
/// particles: those of the first frame.
/// spacing: receives it (m); 0 if there are too few particles for an estimate, or too many at one position, and after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_particles_spacing(
    context: *mut frz_context,
    particles: *const frz_particles,
    spacing: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        answer(spacing, "spacing", || {
            let call = enter(context)?;
            let particles = self::particles(particles)?;
            let estimate = call.ctx().phase("spacing", || Ok(estimate_spacing(&particles.positions)))?;
            Ok(estimate.unwrap_or(0.0))
        })
    })
}

/// Creates a tracker, a mesh that follows particles: at the first frame, or in a state that frz_tracker_save wrote.
///
/// params: see frz_tracker_params.
/// mesh: the mesh at the first frame, in the particles' space; also with a restart. It is copied. It may be open, intersect itself and
///     repeat vertices; with params.rebuild it must be closed, each edge with two consistently oriented triangles, and the triangles around
///     each vertex a single ring: see frz_mesh_repair. The message of FRZ_ERROR_ARGUMENT says where it is not, or that mesh and particles
///     lie apart.
/// particles: those of the first frame; NULL with a restart.
/// restart: restart_bytes bytes that frz_tracker_save wrote for a tracker with the same mesh, spacing and cell: it is restored bit for bit,
///     on any number of threads. NULL: none. FRZ_ERROR_FILE if they are damaged, or of another version, mesh, spacing or cell.
/// restart_bytes: size of restart; 0 without one.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        let restart = (restart, restart_bytes);
        creates(context, out, |ctx| {
            TrackerHandle::new(ctx, given(params)?.params()?, mesh, particles, restart)
        })
    }
}

/// Destroys a tracker; NULL is ignored.
///
/// tracker: may be NULL. It is not destroyed while a call uses it.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_destroy(tracker: *mut frz_tracker) {
    // SAFETY: the tracker is NULL or alive.
    guard(|| unsafe { destroy(tracker) });
}

/// Sets the parameters from the next step on. spacing, cell and rebuild cannot change.
///
/// params: the new parameters. FRZ_ERROR_ARGUMENT names a field that is out of range, and its range; the old ones are then kept.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_set_params(
    tracker: *mut frz_tracker,
    params: *const frz_tracker_params,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let mut handle = change(tracker)?;
        handle.tracker.set_params(given(params)?.params()?)?;
        handle.outlook = Outlook::default();
        Ok(())
    })
}

/// Prefetches the particles of the step after the next: with frz_tracker_params.rebuild their surface is computed on idle threads while the
/// next step rebuilds the mesh. The result is identical; if that step then gets other particles, the work was wasted. Unnecessary with
/// frz_tracker_read_eased, which computes the coming steps itself.
///
/// particles: those of that step; they are copied.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_ahead(
    tracker: *mut frz_tracker,
    particles: *const frz_particles,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let mut handle = change(tracker)?;
        let particles = self::particles(particles)?;
        handle.tracker.prefetch(std::sync::Arc::new(particles));
        Ok(())
    })
}

/// Moves the mesh with its particles from one time to another. After a failure or a cancel it is as it was before. With
/// frz_tracker_params.rebuild its vertices and triangles may change.
///
/// from, to or both may have no particles: the mesh then loses its vertices, and gets new ones from the particles' surface once there are
/// particles again; without rebuild it stays where it was. The context logs a warning once if ids and velocities contradict each other, and
/// for each step in which over half of the mesh is lost or remade.
///
/// from: the particles at the end of the last step.
/// to: the particles at the end of this step. Equal ids mark the same particle; if from or to has no ids, from must have velocities.
/// dt: time between them (s), above 0.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        steps(context, tracker, report, |ctx, handle| {
            finite("dt", dt)?;
            handle.step(ctx, &particles(from)?, &particles(to)?, dt)
        })
    }
}

/// Saves all that the next step depends on besides the parameters, the mesh and the particles, for a host's own cache. The bytes are the
/// same on any number of threads.
///
/// dst: room for capacity bytes. NULL: only the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
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
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        saves(context, tracker, (dst, capacity, size), |held| (&held.saved, &held.tracker), Tracker::save)
    }
}
