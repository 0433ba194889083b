//! What shallow liquid leaves on the ground: stains, and what the ground absorbs.

use std::ffi::c_void;

use super::liquid::frz_shallow;
use super::params::FRZ_SHALLOW_NO_SCALAR;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{Noun, change, destroy, read, required};
use crate::capi::ffi::views::{Sized32, fill, frz_span, frz_view, sized, write_bytes};
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
    /// 0.
    pub flags: u32,
    /// The scalar that stains (frz_shallow_set_scalars), counted from 0, by its concentration over its range, from 0 to 1: clear liquid washes it off.
    /// FRZ_SHALLOW_NO_SCALAR, as is usual: any liquid stains, fully.
    pub scalar: u32,
    /// 0.
    pub reserved: u32,
    /// Depth (m) from which liquid wets the ground, 0 or more; 1e-5 is usual.
    pub film: f64,
    /// Time (s) in which 63 % of a stain comes or is washed off, 0 or more; 0.2 is usual.
    pub takes: f64,
    /// Time (s) in which half of a stain on dry ground fades, 0.001 or more; 60 is usual. Infinity: it stays.
    pub half_life: f64,
    /// The most that ground absorbs (m: m3 for each m2 of its mesh), 0 to 1000: gauze some 1e-3. 0, as is usual: nothing.
    pub capacity: f64,
    /// How fast dry ground absorbs (m/s), 0 or more; as it fills, less. Only with a capacity.
    pub rate: f64,
}

// SAFETY: numbers.
unsafe impl Sized32 for frz_shallow_staining {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "frz_shallow_staining";
}

impl frz_shallow_staining {
    fn defaults() -> Self {
        let Staining { film, takes, half_life, .. } = Staining::default();
        Self {
            struct_size: 0,
            flags: 0,
            scalar: FRZ_SHALLOW_NO_SCALAR,
            reserved: 0,
            film,
            takes,
            half_life,
            capacity: 0.0,
            rate: 0.0,
        }
    }

    fn staining(&self) -> Outcome<Staining> {
        no_flags(self.flags, 0)?;
        if self.reserved != 0 {
            return Err(Failure::argument(format!("reserved = {} is not 0", self.reserved)));
        }
        let absorbing = Absorbing { capacity: self.capacity, rate: self.rate };
        let staining = Staining {
            scalar: (self.scalar != FRZ_SHALLOW_NO_SCALAR).then_some(self.scalar as usize),
            film: self.film,
            takes: self.takes,
            half_life: self.half_life,
            absorbs: (self.capacity != 0.0).then_some(absorbing),
        };
        staining.validate()?;
        Ok(staining)
    }
}

/// Fills a description of stains with the usual values.
///
/// staining: receives them.
/// size: sizeof(frz_shallow_staining).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_staining_init(
    staining: *mut frz_shallow_staining,
    size: usize,
) -> frz_status {
    // SAFETY: the description is NULL or has so many bytes.
    guard(|| unsafe { fill(staining, Some(size), frz_shallow_staining::defaults()) })
}

/// Stains on the vertices of a mesh, and what it has absorbed: they go with ground that deforms. The mesh need not be the one that the liquid was made
/// with, but lies where its ground is.
pub struct frz_shallow_stains {
    _opaque: [u8; 0],
}

/// The value of the handle of stains.
pub(in crate::capi) struct Stained {
    stains: Stains,
    /// Positions on their way in.
    positions: Vec<Vec3>,
}

impl Noun for frz_shallow_stains {
    type Value = Stained;
    const NAME: &'static str = "stains";
    const TAG: u32 = 0x6672_7a0b;
}

/// Makes stains: none yet, and nothing is absorbed.
///
/// shallow: the liquid that will stain; it is only read, and need not outlive them.
/// positions: float[3] for each vertex (m), finite.
/// triangles: uint32_t[3] for each triangle: its vertices. They stay, and a state knows them.
/// staining: NULL for the usual one; FRZ_ERROR_ARGUMENT names a field that is out of range.
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
    // SAFETY: the pointers are NULL or the caller's; so is what the views describe.
    unsafe {
        creates(context, out, |ctx| {
            let staining = match staining.is_null() {
                true => frz_shallow_staining::defaults(),
                false => sized(staining, frz_shallow_staining::defaults())?,
            };
            let staining = staining.staining()?;
            let spill = read(shallow)?;
            let vertices = positions.count as u64;
            ctx.allow("the stains", vertices.saturating_mul(BYTES))?;
            let positions: Vec<Vec3> = positions.finite("positions")?.into_iter().map(Vec3::from).collect();
            let triangles = triangles.elements::<[u32; 3]>("triangles")?;
            let stains = Stains::new(&spill.shallow, &positions, &triangles, staining)?;
            Ok(Stained { stains, positions })
        })
    }
}

/// Bytes of a vertex: its stain, when it was wet, what it holds and may hold, and its position, twice while it is read.
const BYTES: u64 = 52;

/// Lets the liquid stain the ground, and the ground absorb it, for the time since the last call: once a frame, in real time (frz_shallow).
///
/// shallow: the liquid, after its frame; only ground with a capacity changes it. What it absorbs is a part of frz_shallow_balance.absorbed.
/// positions: float[3] for each vertex (m), finite, where they are now. After a failure all is as it was.
/// absorbed: receives the volume (m3) that the ground has absorbed in this call, 0 after a failure; may be NULL.
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
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's; so is what the view describes.
        unsafe {
            if !absorbed.is_null() {
                absorbed.write_unaligned(0.0);
            }
            let _call = enter_light(context)?;
            let mut stained = change(stains)?;
            let mut spill = change(shallow)?;
            let Stained { stains, positions: own } = &mut *stained;
            let given = positions.in_place::<[f32; 3]>("positions")?;
            if given.len() != stains.len() {
                let text = format!(
                    "positions: {} elements, but the mesh has {} vertices",
                    given.len(),
                    stains.len()
                );
                return Err(Failure::argument(text));
            }
            own.clear();
            own.extend(given.map(Vec3::from));
            let volume = stains.update(&mut spill.shallow, own)?;
            if !absorbed.is_null() {
                absorbed.write_unaligned(volume);
            }
            Ok(())
        }
    })
}

/// Copies how stained each vertex is, 0 to 1, in real time (frz_shallow).
///
/// dst: room for a float for each vertex; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_read(
    stains: *const frz_shallow_stains,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the stains are NULL or were not destroyed; the span is the caller's.
    guard(|| unsafe { dst.put("dst", read(stains)?.stains.each()) })
}

/// Copies how soaked each vertex is, 0 to 1 of its capacity, in real time (frz_shallow); 0 where the ground does not absorb.
///
/// dst: as in frz_shallow_stains_read.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_soaked(
    stains: *const frz_shallow_stains,
    dst: frz_span,
) -> frz_status {
    // SAFETY: the stains are NULL or were not destroyed; the span is the caller's.
    guard(|| unsafe { dst.put("dst", read(stains)?.stains.each_soaked()) })
}

/// Reports how much the ground has absorbed in all.
///
/// volume: receives it (m3); 0 after a failure.
///
/// Any number of threads may read stains.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_absorbed(
    stains: *const frz_shallow_stains,
    volume: *mut f64,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            let volume = required(volume, "volume")?;
            volume.write_unaligned(0.0);
            volume.write_unaligned(read(stains)?.stains.absorbed());
            Ok(())
        }
    })
}

/// Writes stains as bytes, for frz_shallow_stains_restore. How liquid stains is not part of them, nor is the liquid (frz_shallow_save).
///
/// dst: room for capacity bytes. NULL: size receives how many are needed, and nothing is written.
/// capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
/// size: receives the bytes that were written, or are needed; 0 after other failures.
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
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's; so is the room at dst.
        unsafe {
            required(size, "size")?.write_unaligned(0);
            let _call = enter_light(context)?;
            let stained = read(stains)?;
            write_bytes(dst, capacity, size, || stained.stains.save_size(), || Ok(stained.stains.save()))
        }
    })
}

/// Puts saved stains in place: with the liquid's state of the same frame everything goes on to the same bytes.
///
/// state: bytes bytes of frz_shallow_stains_save. FRZ_ERROR_FILE, and the stains are as they were, where they are damaged, of other triangles, of a
///     liquid with other cells or heights, or of ground that absorbs where this does not.
/// bytes: their number.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_restore(
    context: *mut frz_context,
    stains: *mut frz_shallow_stains,
    state: *const c_void,
    bytes: usize,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's; so are the bytes.
        unsafe {
            let _call = enter_light(context)?;
            let mut stained = change(stains)?;
            required(state.cast_mut(), "state")?;
            let state = frz_view { data: state, count: bytes, stride: 0 }.bytes("state")?;
            Ok(stained.stains.restore(state)?)
        }
    })
}

/// Destroys stains; NULL is fine.
///
/// stains: may be NULL. Not while a call uses them: they then stay.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_stains_destroy(stains: *mut frz_shallow_stains) {
    // SAFETY: the stains are NULL or were not destroyed.
    guard(|| unsafe { destroy(stains) });
}
