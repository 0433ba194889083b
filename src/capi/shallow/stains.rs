//! Stains that shallow liquid leaves on the ground, and the liquid that the ground absorbs.

use std::ffi::c_void;

use super::calls::answer_some;
use super::handle::frz_shallow;
use super::params::FRZ_SHALLOW_NO_SCALAR;
use crate::capi::ffi::saved::{restores, write_bytes};
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{creates, enter_light, frz_context};
use crate::geometry::Vec3;
use crate::shallow::stains::Absorbing;
use crate::shallow::{Staining, Stains};

/// How liquid stains the ground, and what the ground absorbs.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_staining {
    /// sizeof(frz_shallow_staining).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Index of the scalar that stains (frz_shallow_set_scalars), from 0. A stain approaches the concentration of this scalar
    /// divided by its range, clamped to 0 to 1, so that clear liquid washes stains off. Default FRZ_SHALLOW_NO_SCALAR: any liquid stains,
    /// fully.
    pub scalar: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Depth (m) from which liquid wets the ground, 0 or more; default 1e-5.
    pub film: f64,
    /// Time (s) in which 63 % of a stain forms or is washed off, 0 or more; default 0.2.
    pub takes: f64,
    /// Time (s) in which half of a stain on dry ground fades, 0.001 or more; infinity: it stays. Default 60.
    pub half_life: f64,
    /// Maximum that the ground absorbs (m: m3 for each m2 of its mesh), 0 to 1000; about 1e-3 for gauze. Default 0: nothing.
    pub capacity: f64,
    /// Rate at which dry ground absorbs (m/s), 0 or more; it decreases as the ground fills. Only with a capacity.
    pub rate: f64,
}

sized32!(frz_shallow_staining, [], Self { scalar: FRZ_SHALLOW_NO_SCALAR, ..Staining::default().into() });

fields_of!(Staining <=> frz_shallow_staining { film, takes, half_life });

impl frz_shallow_staining {
    fn staining(&self) -> Outcome<Staining> {
        no_flags(self.flags, 0)?;
        refuse(self.reserved != 0, || format!("reserved = {} is not 0", self.reserved))?;
        let absorbing = Absorbing { capacity: self.capacity, rate: self.rate };
        let staining = Staining {
            scalar: (self.scalar != FRZ_SHALLOW_NO_SCALAR).then_some(self.scalar as usize),
            absorbs: (self.capacity != 0.0).then_some(absorbing),
            ..self.over(Staining::default())
        };
        staining.validate()?;
        Ok(staining)
    }
}

/// Fills a description of stains with the defaults.
///
/// staining: receives the defaults.
/// size: sizeof(frz_shallow_staining).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_staining_init(
    staining: *mut frz_shallow_staining,
    size: usize,
) -> frz_status {
    // SAFETY: the description is NULL or has `size` bytes.
    guard(|| unsafe { fill(staining, Some(size), Sized32::defaults()) })
}

/// Stains on the vertices of a mesh, and the liquid that it has absorbed: they move with ground that deforms. The mesh need not be the one
/// that the liquid was created with, but must lie on the liquid's ground.
pub struct frz_shallow_stains {
    _opaque: [u8; 0],
}

/// The value of the handle of stains.
pub(in crate::capi) struct StainsHandle {
    stains: Stains,
    /// The vertices' positions (m) of the last update.
    positions: Vec<Vec3>,
}

handle!(frz_shallow_stains, StainsHandle, "stains", 11);

/// Creates stains: none yet, and nothing absorbed.
///
/// shallow: the liquid that will stain; it is only read, and need not outlive the stains.
/// positions: float[3] for each vertex (m), finite.
/// triangles: uint32_t[3] for each triangle: its vertices. They cannot change, and a saved state is tied to them.
/// staining: NULL for the defaults; FRZ_ERROR_ARGUMENT names a field that is out of range.
/// out: receives the stains, to be destroyed with frz_shallow_stains_destroy; NULL after a failure.
///
/// Any number of threads may read a shallow liquid; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_create(
    context: *mut frz_context,
    shallow: *const frz_shallow,
    positions: frz_view,
    triangles: frz_view,
    staining: *const frz_shallow_staining,
    out: *mut *mut frz_shallow_stains,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the views.
    unsafe {
        creates(context, out, |ctx| {
            let staining = given_or_defaults(staining)?.staining()?;
            let liquid = read(shallow)?;
            let vertices = positions.count as u64;
            ctx.allow("the stains", vertices.saturating_mul(BYTES_PER_VERTEX))?;
            let positions: Vec<Vec3> = positions.finite("positions")?.into_iter().map(Vec3::from).collect();
            let triangles = triangles.elements::<[u32; 3]>("triangles")?;
            let stains = Stains::new(&liquid.shallow, &positions, &triangles, staining)?;
            Ok(StainsHandle { stains, positions })
        })
    }
}

/// Memory (bytes) of a vertex: its stain, when it was wet, its content and capacity, and its position, twice while it is read.
const BYTES_PER_VERTEX: u64 = 52;

/// Lets the liquid stain the ground, and the ground absorb liquid, for the time since the last call (a real-time call: see frz_shallow).
/// Call it once a frame.
///
/// shallow: the liquid, after its frame; only ground with a capacity changes it. What it absorbs is part of frz_shallow_balance.absorbed.
/// positions: float[3] for each vertex (m), finite: the current ones. After a failure all is as it was.
/// absorbed: receives the volume (m3) that the ground absorbed in this call, 0 after a failure; may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_update(
    context: *mut frz_context,
    stains: *mut frz_shallow_stains,
    shallow: *mut frz_shallow,
    positions: frz_view,
    absorbed: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the view.
    guard(|| unsafe {
        answer_some(absorbed, || {
            let _call = enter_light(context)?;
            let StainsHandle { stains, positions: own } = &mut *change(stains)?;
            let mut liquid = change(shallow)?;
            let count = stains.len();
            let given =
                one_for_each::<[f32; 3]>(&positions, "positions", count, ["the mesh has", "vertices"])?;
            own.clear();
            own.extend(given.map(Vec3::from));
            Ok(stains.update(&mut liquid.shallow, own)?)
        })
    })
}

/// Copies how stained each vertex is, 0 to 1 (a real-time call: see frz_shallow).
///
/// dst: room for a float for each vertex; FRZ_ERROR_CAPACITY if it is too small, and nothing is written.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_read(
    stains: *const frz_shallow_stains,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the stains are NULL or alive; the span is valid.
    guard(|| unsafe { dst.put("dst", read(stains)?.stains.each()) })
}

/// Copies how soaked each vertex is, as a fraction of its capacity, 0 to 1 (a real-time call: see frz_shallow); 0 where the ground does not
/// absorb.
///
/// dst: as in frz_shallow_stains_read.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_soaked(
    stains: *const frz_shallow_stains,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the stains are NULL or alive; the span is valid.
    guard(|| unsafe { dst.put("dst", read(stains)?.stains.each_soaked()) })
}

/// Reports the total volume that the ground has absorbed.
///
/// volume: receives it (m3); 0 after a failure.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_absorbed(
    stains: *const frz_shallow_stains,
    volume: *mut f64,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { answer(volume, "volume", || Ok(read(stains)?.stains.absorbed())) })
}

/// Saves stains as bytes, for frz_shallow_stains_restore. The frz_shallow_staining parameters are not part of them, nor is the liquid
/// (frz_shallow_save).
///
/// dst: room for capacity bytes. NULL: only the size is reported.
/// capacity: size of dst (bytes). FRZ_ERROR_CAPACITY if it is too small.
/// size: receives the number of bytes written, or needed; 0 after other failures.
///
/// One thread at a time for each context; any number may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_save(
    context: *mut frz_context,
    stains: *const frz_shallow_stains,
    dst: *mut c_void,
    capacity: usize,
    size: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so is the memory at dst.
    guard(|| unsafe {
        required(size, "size")?.write_unaligned(0);
        let _call = enter_light(context)?;
        let stains = &read(stains)?.stains;
        write_bytes(dst, capacity, size, || stains.save_size(), || Ok(stains.save()))
    })
}

/// Restores saved stains: with the liquid's state of the same frame everything continues to the same bytes.
///
/// state: bytes bytes of frz_shallow_stains_save. FRZ_ERROR_FILE, with the stains unchanged, if they are damaged, or of other triangles, of
///     a liquid with other cells or heights, or of ground that absorbs where this ground does not.
/// bytes: size of state.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_restore(
    context: *mut frz_context,
    stains: *mut frz_shallow_stains,
    state: *const c_void,
    bytes: usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the bytes.
    unsafe { restores(context, stains, (state, bytes), |handle, state| handle.stains.restore(state)) }
}

/// Destroys stains; NULL is ignored.
///
/// stains: may be NULL. They are not destroyed while a call uses them.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_destroy(stains: *mut frz_shallow_stains) {
    // SAFETY: the stains are NULL or alive.
    guard(|| unsafe { destroy(stains) });
}
