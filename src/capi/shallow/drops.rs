//! Shallow liquid in the air: drops and their mesh.

use super::calls::informs;
use super::handle::frz_shallow;
use super::snapshot::frz_shallow_snapshot;
use super::surface::{
    Buffer, MeshRequest, check_buffers, check_room, frz_shallow_layout, frz_shallow_size, indices_in, writes,
};
use crate::capi::ffi::*;
use crate::capi::runtime::context::frz_context;
use crate::shallow::free_fall::Droplet;
use crate::shallow::free_fall::mesh::{Balls, Target, bound};

/// A drop of liquid in the air.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_drop {
    /// Its position (m).
    pub position: [f64; 3],
    /// Its velocity (m/s).
    pub velocity: [f64; 3],
    /// Its volume (m3).
    pub volume: f64,
    /// Radius of a sphere of its volume (m).
    pub radius: f64,
    /// Time since it left the edge that it fell from (s).
    pub age: f64,
    /// Id of the edge that it fell from: the same for all drops from one side of one column.
    pub source: u64,
    /// Sequence number at its edge: one more than that of the previous drop, if nothing interrupted the flow there.
    pub number: u64,
    /// Concentrations of the scalars of frz_shallow_set_scalars; 0 for the remaining elements.
    pub concentrations: [f32; 4],
}

// SAFETY: numbers, without padding.
unsafe impl Plain for frz_shallow_drop {}

impl From<Droplet> for frz_shallow_drop {
    fn from(drop: Droplet) -> Self {
        let Droplet {
            position,
            velocity,
            volume,
            radius,
            age,
            source,
            number,
            concentrations,
            overflow_edge: _,
        } = drop;
        Self { position, velocity, volume, radius, age, source, number, concentrations }
    }
}

/// Lists the drops in the air, in the order in which they left their edges (a real-time call: see frz_shallow).
///
/// dst: room for a frz_shallow_drop for each, at most frz_shallow_params.falls_most. With data NULL only the count is reported.
///     FRZ_ERROR_CAPACITY if it is too small.
/// count: receives their number; 0 after other failures.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_drops(
    shallow: *const frz_shallow,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { lists(count, || list(read(shallow)?.shallow.drops().map(frz_shallow_drop::from), &dst, count)) }
}

/// Lists the drops that were in the air when a snapshot was taken, as frz_shallow_drops does (a real-time call: see frz_shallow).
///
/// dst: as in frz_shallow_drops.
/// count: as in frz_shallow_drops.
///
/// Any number of threads may read a snapshot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_drops(
    snapshot: *const frz_shallow_snapshot,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        lists(count, || {
            list(read(snapshot)?.snapshot.drops().iter().copied().map(frz_shallow_drop::from), &dst, count)
        })
    }
}

/// Buffers that a mesh of drops is written to, as in frz_shallow_target. Zero it, then set struct_size.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_drops_target {
    /// sizeof(frz_shallow_drops_target).
    pub struct_size: u32,
    /// Bits of an index: 16, for at most 65536 vertices, or 32. 0 without indices.
    pub index_bits: u32,
    /// float[3] for each vertex: its position (m x scale).
    pub positions: frz_span,
    /// float[3] for each vertex: its unit normal.
    pub normals: frz_span,
    /// float[3] for each vertex: velocity of its drop (m/s x scale).
    pub velocities: frz_span,
    /// uint32_t for each vertex: index of its drop in the list of frz_shallow_drops.
    pub drops: frz_span,
    /// uint16_t or uint32_t for each corner of each triangle: its vertex. Triangles face outward.
    pub indices: frz_span,
}

sized32!(frz_shallow_drops_target);

impl frz_shallow_drops_target {
    fn buffers(&self) -> [Buffer<'_>; 5] {
        [
            ("positions", &self.positions, 12, true),
            ("normals", &self.normals, 12, true),
            ("velocities", &self.velocities, 12, true),
            ("drops", &self.drops, 4, true),
            ("indices", &self.indices, self.index_bits as usize / 8, false),
        ]
    }

    /// The library's own buffers.
    ///
    /// # Safety
    /// The spans must describe memory that can be written and that nothing else uses, for `'a`.
    unsafe fn target<'a>(&self) -> Outcome<Target<'a>> {
        check_buffers(&self.buffers(), self.index_bits)?;
        // SAFETY: guaranteed by the caller, and they do not overlap.
        unsafe {
            let indices = indices_in(&self.indices, self.index_bits)?;
            Ok(Target {
                positions: self.positions.numbers("positions", 3)?,
                normals: self.normals.numbers("normals", 3)?,
                velocities: self.velocities.numbers("velocities", 3)?,
                drops: self.drops.numbers("drops", 1)?,
                indices,
            })
        }
    }
}

impl MeshRequest<frz_shallow_drops_target> {
    /// Writes the mesh and its size.
    fn write_drops(&self, balls: &mut Balls, drops: &[Droplet]) -> Outcome {
        // SAFETY: guaranteed by the caller of `MeshRequest::new`.
        let mut target = unsafe { self.given.target() }?;
        let counts = balls.count(drops);
        self.report_size(counts)?;
        check_room(&self.given.buffers(), &counts)?;
        balls.build(drops, &self.layout, &mut target)?;
        Ok(())
    }
}

/// Reports the maximum size of the mesh of the liquid in the air, so that buffers can be allocated once.
///
/// size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_drops_bound(
    shallow: *const frz_shallow,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        informs(size, || {
            let max_packets = read(shallow)?.shallow.params().falls.map_or(0, |falls| falls.max_packets);
            Ok(bound(max_packets))
        })
    }
}

/// Writes the liquid in the air as triangles (a real-time call: see frz_shallow): a sphere for each drop, and strands between consecutive
/// drops from one edge. The spheres' vertices come first, in the order of their drops.
///
/// layout: NULL for the defaults; its depths and FRZ_SHALLOW_LIFTED are ignored.
/// target: the buffers. FRZ_ERROR_CAPACITY if one is too small: nothing is written, and size receives what is needed. With all data NULL
///     only the size is reported.
/// size: receives the size of the mesh, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_drops_mesh(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    layout: *const frz_shallow_layout,
    target: *const frz_shallow_drops_target,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the spans.
    unsafe {
        writes(context, shallow, (layout, target, size), |liquid, request| {
            liquid.drops.clear();
            liquid.drops.extend(liquid.shallow.drops());
            request.write_drops(&mut liquid.balls, &liquid.drops)
        })
    }
}

/// Writes the liquid that was in the air when a snapshot was taken, as frz_shallow_drops_mesh does (a real-time call: see frz_shallow).
///
/// context: not the one of the thread that computes.
/// layout: NULL for the defaults.
/// target: the buffers, as in frz_shallow_drops_mesh.
/// size: receives the size of the mesh, as in frz_shallow_drops_mesh; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_snapshot_drops_mesh(
    context: *mut frz_context,
    snapshot: *mut frz_shallow_snapshot,
    layout: *const frz_shallow_layout,
    target: *const frz_shallow_drops_target,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the spans.
    unsafe {
        writes(context, snapshot, (layout, target, size), |handle, request| {
            request.write_drops(&mut handle.balls, handle.snapshot.drops())
        })
    }
}
