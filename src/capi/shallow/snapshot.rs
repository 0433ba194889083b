//! Shallow liquid as it was after a frame, for another thread.

use super::read::probe;
use super::spill::{ShallowHandle, frz_shallow};
use super::surface::prepared::{Ledged, wanted_lifts};
use super::surface::{
    FRZ_SHALLOW_LIFTED, FRZ_SHALLOW_SKIRTED, frz_shallow_layout, frz_shallow_size, frz_shallow_target, writes,
};
use crate::capi::ffi::*;
use crate::capi::runtime::context::{creates, frz_context};
use crate::shallow::Snapshot;
use crate::shallow::free_fall::mesh::Balls;
use crate::shallow::surface::{Depths, Surface};

/// A copy of a liquid as it was after a frame: another thread may draw it while the next frame is computed. A host has two: one being
/// taken, and one being drawn.
pub struct frz_shallow_snapshot {
    _opaque: [u8; 0],
}

/// The value of a snapshot's handle.
pub(in crate::capi) struct Taken {
    pub snapshot: Snapshot,
    surface: Surface,
    /// Builds meshes of the liquid in the air.
    pub balls: Balls,
    /// Minimum heights, if there were any.
    least: Vec<i32>,
    sunk: Vec<i32>,
    /// Ledges, if there were any.
    ledged: Ledged,
}

impl Taken {
    /// Takes the minimum heights and the ledges of a liquid, if they match its current ground.
    fn fit(&mut self, spill: &ShallowHandle) {
        self.ledged.copy_from(&spill.ledged);
        let (least, sunk) = spill.lifted.known().unwrap_or_default();
        self.least.clear();
        self.least.extend_from_slice(least);
        self.sunk.clear();
        self.sunk.extend_from_slice(sunk);
    }
}

impl HandleType for frz_shallow_snapshot {
    type Value = Taken;
    const NAME: &'static str = "snapshot";
    const TAG: u32 = 0x6672_7a0a;
}

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
    unsafe {
        creates(context, out, |ctx| {
            let spill = read(shallow)?;
            ctx.allow("the snapshot", spill.shallow.columns().len() as u64 * BYTES)?;
            let snapshot = Snapshot::new(&spill.shallow);
            let mut surface = Surface::default();
            surface.reserve(snapshot.columns());
            let mut balls = Balls::default();
            balls.reserve(spill.shallow.params().falls.map_or(0, |falls| falls.max_packets));
            let mut taken = Taken {
                snapshot,
                surface,
                balls,
                least: Vec::new(),
                sunk: Vec::new(),
                ledged: Ledged::default(),
            };
            taken.fit(&spill);
            Ok(taken)
        })
    }
}

/// Memory (bytes) of a snapshot for each column index: bases, ceilings, undersides, depth, velocity, scalars, minimum heights, and for a
/// surface.
const BYTES: u64 = 72;

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
        let mut taken = change(snapshot)?;
        let spill = read(shallow)?;
        taken.snapshot.take(&spill.shallow);
        taken.fit(&spill);
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
        writes(context, snapshot, (layout, target, size), |taken, wanted| {
            let Taken { snapshot, surface, least, sunk, ledged, .. } = taken;
            let when = "when the snapshot was taken";
            let known = (!least.is_empty()).then_some((&least[..], &sunk[..]));
            let (least, sunk) = wanted_lifts(wanted.has(FRZ_SHALLOW_LIFTED), known, when)?;
            let depths = Depths {
                depth: snapshot.depths(),
                velocity: snapshot.velocities(),
                active: Some(snapshot.active()),
                least,
                sunk,
                carried: std::array::from_fn(|scalar| snapshot.concentrations(scalar)),
                ledges: ledged.wanted(wanted.has(FRZ_SHALLOW_SKIRTED), when)?,
            };
            wanted.write(surface, snapshot.columns(), &depths)
        })
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
