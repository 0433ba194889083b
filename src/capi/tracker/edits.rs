//! The current mesh of a tracker, and how the last step changed it.

use std::borrow::Cow;

use super::handle::{TrackerHandle, frz_tracker};
use crate::capi::ffi::*;
use crate::geometry::DVec3;
use crate::mesh_repair::Source;

/// Vertex arrays that frz_tracker_read copies, in the order of the mesh that the tracker was created with until a step or
/// frz_tracker_resculpt changes it.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_tracker_array {
    /// float[3]: its position (m).
    FRZ_TRACKER_POSITION = 0,
    /// double[3]: its position (m) in full precision, also far from the origin. The next step's positions minus these, divided by dt, are
    /// the velocities for motion blur; if that step changes the mesh, take FRZ_EDIT_BEFORE minus these.
    FRZ_TRACKER_POSITION_DOUBLE = 1,
    /// float: the distance that it keeps from the particles' surface (m), negative inside; NaN: it was too far away to have one.
    FRZ_TRACKER_DELTA = 2,
    /// int32_t: 1 if the last step could not project it, or found surface next to it that the mesh does not cover; else 0.
    FRZ_TRACKER_FLAGGED = 3,
}

use frz_tracker_array::*;

const ARRAYS: Meanings<frz_tracker_array, 4> = numbered! {
    FRZ_TRACKER_POSITION, FRZ_TRACKER_POSITION_DOUBLE, FRZ_TRACKER_DELTA, FRZ_TRACKER_FLAGGED
};

/// Reports the number of vertices of the mesh: that of the mesh that the tracker was created with, until a step
/// (frz_tracker_params.rebuild) or frz_tracker_resculpt changes it.
///
/// count: receives their number; 0 after a failure.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_count(tracker: *const frz_tracker, count: *mut usize) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { answer(count, "count", || Ok(read(tracker)?.tracker.vertices().len())) })
}

/// Copies an array of the mesh's vertices.
///
/// array: a frz_tracker_array, which states the type of the elements.
/// dst: room for as many elements as frz_tracker_count reports; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_read(
    tracker: *const frz_tracker,
    array: u32,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the tracker is NULL or alive; the span is valid.
    guard(|| unsafe {
        let array = meaning("array", "frz_tracker_array", array, &ARRAYS)?;
        let handle = read(tracker)?;
        let tracker = &handle.tracker;
        let positions = tracker.vertices().iter();
        match array {
            FRZ_TRACKER_POSITION => dst.put("dst", positions.map(|p| <[f32; 3]>::from(p.map(|x| x as f32)))),
            FRZ_TRACKER_POSITION_DOUBLE => dst.put("dst", positions.map(|&p| <[f64; 3]>::from(p))),
            FRZ_TRACKER_DELTA => dst.fill("dst", tracker.delta()),
            FRZ_TRACKER_FLAGGED => dst.put("dst", tracker.flags().iter().map(|&flag| i32::from(flag))),
        }
    })
}

/// Reports the number of triangles of the mesh: those into which the faces of the mesh that the tracker was created with were divided,
/// until a step changes it.
///
/// count: receives their number; 0 after a failure.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_triangle_count(
    tracker: *const frz_tracker,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { answer(count, "count", || Ok(read(tracker)?.tracker.triangles().len())) })
}

/// Copies the mesh's triangles, counter-clockwise seen from outside. Until a step changes the mesh they are the FRZ_MESH_TRIANGLES of the
/// mesh that the tracker was created with. Read them again if frz_tracker_report.changed is 1, and after frz_tracker_resculpt.
///
/// dst: room for as many uint32_t[3] as frz_tracker_triangle_count reports, the vertices of each; FRZ_ERROR_CAPACITY if it is too small,
///     and nothing is written.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_read_triangles(
    tracker: *const frz_tracker,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the tracker is NULL or alive; the span is valid.
    guard(|| unsafe { dst.fill("dst", read(tracker)?.tracker.triangles()) })
}

/// Arrays that frz_tracker_read_edits copies.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_edit_array {
    /// int64_t for each vertex (frz_tracker_count): its index before the step, which no other vertex shares; -1: it is new.
    FRZ_EDIT_ORIGIN = 0,
    /// int64_t for each triangle (frz_tracker_triangle_count): the index of the triangle that it was before the step, or is a part of; -1:
    /// neither.
    FRZ_EDIT_SOURCE = 1,
    /// uint32_t for each triangle: a frz_edit_kind.
    FRZ_EDIT_KIND = 2,
    /// double[3] for each vertex that existed before the step (frz_tracker_edits): the position (m) to which the step took it, before the
    /// mesh was rebuilt. Remaining vertices are at this position.
    FRZ_EDIT_BEFORE = 3,
}

/// The origin of a triangle.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_edit_kind {
    /// It existed before, with the same vertices in the same cyclic order.
    FRZ_EDIT_WHOLE = 0,
    /// A part of a triangle that existed before and was cut or divided.
    FRZ_EDIT_PART = 1,
    /// A new triangle.
    FRZ_EDIT_NEW = 2,
}

use frz_edit_array::*;
use frz_edit_kind::*;

const EDITS: Meanings<frz_edit_array, 4> = numbered! {
    FRZ_EDIT_ORIGIN, FRZ_EDIT_SOURCE, FRZ_EDIT_KIND, FRZ_EDIT_BEFORE
};

/// Reports whether the last step, or frz_tracker_resculpt since, changed the mesh's vertices and triangles. 0 for a tracker that was just
/// created or restored.
///
/// changed: receives 1 if so, else 0; 0 after a failure.
/// before: receives the number of vertices before the step; 0 after a failure. May be NULL.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_edits(
    tracker: *const frz_tracker,
    changed: *mut u32,
    before: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(before);
        answer(changed, "changed", || {
            let handle = read(tracker)?;
            write_some(before, handle.before().len());
            Ok(u32::from(handle.edits.is_some()))
        })
    })
}

/// Copies how the last step changed the mesh, so that a host can carry its own arrays along. If nothing changed, every vertex and every
/// triangle is its own origin.
///
/// array: a frz_edit_array, which states the type and the number of the elements.
/// dst: room for that many; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read a tracker.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_tracker_read_edits(
    tracker: *const frz_tracker,
    array: u32,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the tracker is NULL or alive; the span is valid.
    guard(|| unsafe {
        let array = meaning("array", "frz_edit_array", array, &EDITS)?;
        let handle = read(tracker)?;
        match array {
            FRZ_EDIT_ORIGIN => dst.fill("dst", &handle.origins()),
            FRZ_EDIT_SOURCE => {
                let source = |source: &Source| match *source {
                    Source::Whole(triangle) | Source::Part(triangle) => i64::from(triangle),
                    Source::New => -1,
                };
                dst.put("dst", handle.sources().iter().map(source))
            }
            FRZ_EDIT_KIND => {
                let kind = |source: &Source| match source {
                    Source::Whole(_) => FRZ_EDIT_WHOLE as u32,
                    Source::Part(_) => FRZ_EDIT_PART as u32,
                    Source::New => FRZ_EDIT_NEW as u32,
                };
                dst.put("dst", handle.sources().iter().map(kind))
            }
            FRZ_EDIT_BEFORE => dst.put("dst", handle.before().iter().map(|&p| <[f64; 3]>::from(p))),
        }
    })
}

impl TrackerHandle {
    /// Positions (m), at the end of the last step, of the vertices that existed before it.
    fn before(&self) -> &[DVec3] {
        match &self.edits {
            Some(edits) => &edits.before,
            None => self.tracker.vertices(),
        }
    }

    /// For each vertex its index before the step; -1: it is new.
    fn origins(&self) -> Vec<i64> {
        match &self.edits {
            Some(edits) => edits.origins.iter().map(|at| at.map_or(-1, i64::from)).collect(),
            None => (0..self.tracker.vertices().len() as i64).collect(),
        }
    }

    /// The origin of each triangle.
    fn sources(&self) -> Cow<'_, [Source]> {
        match &self.edits {
            Some(edits) => Cow::from(&edits.sources),
            None => (0..self.tracker.triangles().len() as u32).map(Source::Whole).collect(),
        }
    }
}
