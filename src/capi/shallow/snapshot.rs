//! Snapshots: copies of a shallow liquid after a frame, for another thread.

use super::handle::{ShallowHandle, frz_shallow};
use super::read::probe;
use super::surface::prepared::{FoundLedges, requested_heights};
use super::surface::{
    FRZ_SHALLOW_LIFTED, FRZ_SHALLOW_SKIRTED, MeshRequest, frz_shallow_layout, frz_shallow_size,
    frz_shallow_target, writes,
};
use crate::capi::ffi::*;
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::shallow::Snapshot;
use crate::shallow::free_fall::mesh::Balls;
use crate::shallow::surface::{Depths, Surface};

/// A copy of a liquid as it was after a frame: another thread may draw it while the next frame is computed. A host uses two: one is taken
/// while the other is drawn.
pub struct frz_shallow_snapshot {
    _opaque: [u8; 0],
}

/// The value of a snapshot's handle.
pub(in crate::capi) struct SnapshotHandle {
    pub snapshot: Snapshot,
    surface: Surface,
    /// Builds meshes of the liquid in the air.
    pub balls: Balls,
    /// Minimum and sunk depths; empty if they did not match the ground.
    least: Vec<i32>,
    sunk: Vec<i32>,
    found_ledges: FoundLedges,
}

impl SnapshotHandle {
    fn new(ctx: &Context, liquid: &Reading<'_, ShallowHandle>) -> Outcome<Self> {
        ctx.allow("the snapshot", liquid.shallow.columns().len() as u64 * BYTES_PER_INDEX)?;
        let snapshot = Snapshot::new(&liquid.shallow);
        let mut surface = Surface::default();
        surface.reserve(snapshot.columns());
        let mut balls = Balls::default();
        balls.reserve(liquid.shallow.params().falls.map_or(0, |falls| falls.max_packets));
        let (least, sunk, found_ledges) = Default::default();
        let mut handle = Self { snapshot, surface, balls, least, sunk, found_ledges };
        handle.copy_found(liquid);
        Ok(handle)
    }

    fn take(&mut self, liquid: &Reading<'_, ShallowHandle>) {
        self.snapshot.take(&liquid.shallow);
        self.copy_found(liquid);
    }

    /// Copies the minimum heights and the ledges of a liquid, if they match its current ground.
    fn copy_found(&mut self, liquid: &ShallowHandle) {
        self.found_ledges.copy_from(&liquid.found_ledges);
        let (least, sunk) = liquid.found_heights.known().unwrap_or_default();
        self.least.clear();
        self.least.extend_from_slice(least);
        self.sunk.clear();
        self.sunk.extend_from_slice(sunk);
    }
}

handle!(frz_shallow_snapshot, SnapshotHandle, "snapshot", 10);

/// Creates a snapshot of a liquid in its current state.
///
/// out: receives the snapshot, to be destroyed with frz_shallow_snapshot_destroy; NULL after a failure. It may outlive the liquid.
///
/// Any number of threads may read a shallow liquid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_create(
    context: *mut frz_context,
    shallow: *const frz_shallow,
    out: *mut *mut frz_shallow_snapshot,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| SnapshotHandle::new(ctx, &read(shallow)?)) }
}

/// Memory (bytes) of a snapshot for each column index: bases, ceilings, undersides, depth, velocity, scalars, minimum heights, and for a
/// surface.
const BYTES_PER_INDEX: u64 = 72;

/// Replaces the contents of a snapshot by a liquid's current state (a real-time call: see frz_shallow).
///
/// snapshot: of this liquid or any other. FRZ_ERROR_BUSY while another thread draws it.
///
/// One thread at a time; any number may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_take(
    snapshot: *mut frz_shallow_snapshot,
    shallow: *const frz_shallow,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        change(snapshot)?.take(&read(shallow)?);
        Ok(())
    })
}

/// Destroys a snapshot; NULL is ignored.
///
/// snapshot: may be NULL. It is not destroyed while a call uses it.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_destroy(snapshot: *mut frz_shallow_snapshot) {
    // SAFETY: the snapshot is NULL or alive.
    guard(|| unsafe { destroy(snapshot) });
}

/// Writes the surface that the liquid had when the snapshot was taken, as frz_shallow_surface does (a real-time call: see frz_shallow).
///
/// context: not the one of the thread that computes.
/// layout: NULL for the defaults.
/// target: the buffers, as in frz_shallow_surface; their bound is that of the liquid at that time.
/// size: receives the size of the surface, as in frz_shallow_surface; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_surface(
    context: *mut frz_context,
    snapshot: *mut frz_shallow_snapshot,
    layout: *const frz_shallow_layout,
    target: *const frz_shallow_target,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the spans.
    unsafe {
        writes(context, snapshot, (layout, target, size), |handle, request| handle.write_surface(request))
    }
}

impl SnapshotHandle {
    fn write_surface(&mut self, request: &MeshRequest<frz_shallow_target>) -> Outcome {
        let Self { snapshot, surface, least, sunk, found_ledges, .. } = self;
        let when = "for the ground of this snapshot";
        let known = (!least.is_empty()).then_some((&least[..], &sunk[..]));
        let (least, sunk) = requested_heights(request.has(FRZ_SHALLOW_LIFTED), known, when)?;
        let depths = Depths {
            depth: snapshot.depths(),
            velocity: snapshot.velocities(),
            active: Some(snapshot.active()),
            least,
            sunk,
            carried: std::array::from_fn(|scalar| snapshot.concentrations(scalar)),
            ledges: found_ledges.requested(request.has(FRZ_SHALLOW_SKIRTED), when)?,
        };
        request.write(surface, snapshot.columns(), &depths)
    }
}

/// Reads the liquid at points as it was when the snapshot was taken, as frz_shallow_probe does (a real-time call: see frz_shallow).
///
/// points: double[3] for each (m).
/// dst: room for a frz_shallow_sample for each; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a snapshot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_probe(
    snapshot: *const frz_shallow_snapshot,
    points: frz_view,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the snapshot is NULL or alive; view and span are valid.
    guard(|| unsafe { probe(&read(snapshot)?.snapshot.view(), &points, &dst) })
}
