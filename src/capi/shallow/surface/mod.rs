//! The surface of shallow liquid as a mesh, written into a host's buffers.

pub mod ledges;
pub mod minimum_heights;
pub(in crate::capi) mod prepared;

use self::prepared::{NeededFields, requested_heights};
use super::calls::informs;
use super::handle::{ShallowHandle, frz_shallow};
use crate::capi::ffi::*;
use crate::capi::mesh::triangles::no_flags;
use crate::capi::runtime::context::{enter_light, frz_context};
use crate::shallow::columns::Columns;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::{Counts, Depths, Indices, Layout, Surface, Target, Up, bound};

/// Flag of a layout: Z is up. The axes are then (x, -z, y) in terms of those with Y up.
pub const FRZ_SHALLOW_Z_UP: u32 = 1;

/// Flag of a layout: left-handed axes, as in Unity (Y up) and Unreal (Z up): the horizontal axis that is not x is reversed, and faces are
/// clockwise seen from above.
pub const FRZ_SHALLOW_LEFT_HANDED: u32 = 2;

/// Flag of a layout: films are shown at their minimum heights instead of frz_shallow_layout.least_depth. frz_shallow_find_lifts must have
/// found them since the ground or a body last moved.
pub const FRZ_SHALLOW_LIFTED: u32 = 4;

/// Flag of a layout: where the ground ends, the surface extends to the ground's edge and comes down to it, instead of ending at the centre
/// of the last cell, open below. frz_shallow_find_ledges must have found the edges since the ground or a body last moved.
pub const FRZ_SHALLOW_SKIRTED: u32 = 8;

/// How a surface is written.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_layout {
    /// sizeof(frz_shallow_layout).
    pub struct_size: u32,
    /// FRZ_SHALLOW_Z_UP, FRZ_SHALLOW_LEFT_HANDED, FRZ_SHALLOW_LIFTED, FRZ_SHALLOW_SKIRTED, several of them or 0; default 0: Y up,
    /// right-handed.
    pub flags: u32,
    /// The host's units of length per metre, over 0, for positions, depths and velocities; default 1. 100 for centimetres.
    pub scale: f64,
    /// Minimum height of the surface over wet ground (m), 0 or more, against flicker where the ground is drawn too; default 0. 0.05 of a
    /// cell in the thesis.
    pub least_depth: f64,
    /// Depth (m) from which frz_shallow_target.opacities are 1, over 0; default 0.01.
    pub opaque_depth: f64,
    /// Depth (m) from which a wet vertex has its full height, so that none jumps as its column wets or dries, 0 or more; default 0: at
    /// once. With FRZ_SHALLOW_LIFTED 0.02 of a cell is a good value.
    pub fade_depth: f64,
}

sized32!(frz_shallow_layout, [fade_depth], Layout::default().into());

fields_of!(Layout <=> frz_shallow_layout { scale, least_depth, opaque_depth, fade_depth });

impl frz_shallow_layout {
    /// The library's own layout, of which some flags may be set.
    fn layout(&self) -> Outcome<Layout> {
        no_flags(
            self.flags,
            FRZ_SHALLOW_Z_UP | FRZ_SHALLOW_LEFT_HANDED | FRZ_SHALLOW_LIFTED | FRZ_SHALLOW_SKIRTED,
        )?;
        Ok(Layout {
            up: if self.flags & FRZ_SHALLOW_Z_UP != 0 { Up::Z } else { Up::Y },
            left_handed: self.flags & FRZ_SHALLOW_LEFT_HANDED != 0,
            ..self.over(Layout::default())
        })
    }
}

/// Buffers that a surface is written to. Zero it, then set struct_size; buffers with data NULL are not written. They may be mapped memory
/// of a graphics device: each is written in order from its beginning, and never read. Elements are packed (a stride of 0, or their size)
/// and aligned to their components; buffers must not overlap. They may be longer than the surface; the rest is not touched.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_target {
    /// sizeof(frz_shallow_target).
    pub struct_size: u32,
    /// Bits of an index: 16, for at most 65536 vertices, or 32. 0 without indices.
    pub index_bits: u32,
    /// float[3] for each vertex: its position (m x scale).
    pub positions: frz_span,
    /// float[3] for each vertex: its unit normal.
    pub normals: frz_span,
    /// float for each vertex: depth (m x scale); 0 where it is dry.
    pub depths: frz_span,
    /// float for each vertex: depth divided by frz_shallow_layout.opaque_depth, at most 1.
    pub opacities: frz_span,
    /// float[3] for each vertex: velocity at the surface (m/s x scale), 1.5 times the mean one, horizontal.
    pub velocities: frz_span,
    /// uint32_t for each vertex: the layer of its column.
    pub layers: frz_span,
    /// uint32_t for each vertex: the index of its column; 0xffffffff for one next to a wall or on the ground's edge, which has none.
    pub columns: frz_span,
    /// uint16_t or uint32_t for each corner of each triangle: its vertex. Triangles face up.
    pub indices: frz_span,
    /// float for each vertex, for each scalar of frz_shallow_set_scalars: its concentration; for a vertex that is dry or has no column, the
    /// mean of the wet ones around it.
    pub scalars: [frz_span; 4],
}

sized32!(frz_shallow_target, [scalars]);

/// A buffer: its name, the bytes of an element, and whether there is one for each vertex.
pub(in crate::capi) type Buffer<'a> = (&'static str, &'a frz_span, usize, bool);

/// Refuses buffers that overlap, and indices of an unknown size.
pub(in crate::capi) fn check_buffers(buffers: &[Buffer<'_>], index_bits: u32) -> Outcome {
    let ends = |span: &frz_span, bytes: usize| {
        let first = span.data as usize;
        [first, first.saturating_add(span.count.saturating_mul(bytes))]
    };
    for (at, (name, span, bytes, _)) in buffers.iter().enumerate() {
        let [first, end] = ends(span, *bytes);
        for (other, before, bytes, _) in &buffers[..at] {
            let [other_first, other_end] = ends(before, *bytes);
            let overlap = first < other_end && other_first < end;
            refuse(overlap && !span.data.is_null() && !before.data.is_null(), || {
                format!("{name} and {other} overlap")
            })?;
        }
    }
    let has_indices = buffers.iter().any(|(name, span, ..)| *name == "indices" && !span.data.is_null());
    refuse(has_indices && ![16, 32].contains(&index_bits), || {
        format!("index_bits = {index_bits} is not 16 or 32")
    })
}

/// Indices of a size that [`check_buffers`] has let pass.
///
/// # Safety
/// As of the span's other buffers: memory that can be written and that nothing else uses, for `'a`.
pub(in crate::capi) unsafe fn indices_in<'a>(span: &frz_span, index_bits: u32) -> Outcome<Indices<'a>> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        Ok(match index_bits {
            16 => span.numbers("indices", 1)?.map_or(Indices::None, Indices::U16),
            _ => span.numbers("indices", 1)?.map_or(Indices::None, Indices::U32),
        })
    }
}

/// Refuses buffers that are too small.
pub(in crate::capi) fn check_room(buffers: &[Buffer<'_>], counts: &Counts) -> Outcome {
    for (name, span, _, is_of_vertices) in buffers {
        let needed = if *is_of_vertices { counts.vertices } else { counts.indices };
        if !span.data.is_null() {
            span.check_room(name, needed)?;
        }
    }
    Ok(())
}

impl frz_shallow_target {
    /// The buffers.
    fn buffers(&self) -> [Buffer<'_>; 12] {
        let [a, b, c, d] = &self.scalars;
        [
            ("positions", &self.positions, 12, true),
            ("normals", &self.normals, 12, true),
            ("depths", &self.depths, 4, true),
            ("opacities", &self.opacities, 4, true),
            ("velocities", &self.velocities, 12, true),
            ("layers", &self.layers, 4, true),
            ("columns", &self.columns, 4, true),
            ("scalars", a, 4, true),
            ("scalars", b, 4, true),
            ("scalars", c, 4, true),
            ("scalars", d, 4, true),
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
                depths: self.depths.numbers("depths", 1)?,
                opacities: self.opacities.numbers("opacities", 1)?,
                velocities: self.velocities.numbers("velocities", 3)?,
                layers: self.layers.numbers("layers", 1)?,
                columns: self.columns.numbers("columns", 1)?,
                carried: {
                    let mut carried = [const { None }; MAX_SCALARS];
                    for (to, span) in carried.iter_mut().zip(&self.scalars) {
                        *to = span.numbers("scalars", 1)?;
                    }
                    carried
                },
                indices,
            })
        }
    }
}

/// Size of a surface.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_shallow_size {
    /// sizeof(frz_shallow_size), set by the caller.
    pub struct_size: u32,
    /// Reserved.
    pub reserved: u32,
    /// Number of vertices.
    pub vertices: u64,
    /// Number of indices: three for each triangle.
    pub indices: u64,
}

sized32!(frz_shallow_size);

fields_of!(Counts => frz_shallow_size { vertices, indices });

/// A host's request for a mesh: how it is written, and into which buffers.
pub(in crate::capi) struct MeshRequest<T> {
    pub(in crate::capi) layout: Layout,
    flags: u32,
    pub(in crate::capi) given: T,
    size: *mut frz_shallow_size,
}

/// The body of an interface function that writes a mesh of an object, in real time, as the host requests it.
///
/// # Safety
/// The pointers must be NULL or valid, and so must be the spans.
pub(in crate::capi) unsafe fn writes<N: HandleType, T: Sized32>(
    context: *mut frz_context,
    object: *mut N,
    (layout, target, size): (*const frz_shallow_layout, *const T, *mut frz_shallow_size),
    write: impl FnOnce(&mut N::Value, &MeshRequest<T>) -> Outcome,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        let request = MeshRequest::new(layout, target, size)?;
        let _call = enter_light(context)?;
        write(&mut *change(object)?, &request)
    })
}

impl<T: Sized32> MeshRequest<T> {
    /// # Safety
    /// The pointers must be NULL or valid, and so must be the spans, as long as the request exists.
    unsafe fn new(
        layout: *const frz_shallow_layout,
        target: *const T,
        size: *mut frz_shallow_size,
    ) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        unsafe {
            if !size.is_null() {
                fill(size, None, frz_shallow_size::zeroed())?;
            }
            let layout = given_or_defaults(layout)?;
            let flags = layout.flags;
            Ok(Self { layout: layout.layout()?, flags, given: given(target)?, size })
        }
    }

    /// Whether a flag of the layout is set.
    pub(in crate::capi) fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }

    /// Writes the size of the mesh, unless the host passed NULL for it.
    pub(in crate::capi) fn report_size(&self, counts: Counts) -> Outcome {
        // SAFETY: guaranteed by the caller of `new`.
        if self.size.is_null() { Ok(()) } else { unsafe { fill(self.size, None, counts.into()) } }
    }
}

impl MeshRequest<frz_shallow_target> {
    /// The fields of the flow that have a buffer.
    pub(in crate::capi) fn needed_fields(&self) -> NeededFields {
        let is_given = |span: &frz_span| !span.data.is_null();
        NeededFields {
            velocities: is_given(&self.given.velocities),
            scalars: self.given.scalars.each_ref().map(is_given),
        }
    }

    /// Writes the surface and its size.
    pub(in crate::capi) fn write(
        &self,
        surface: &mut Surface,
        columns: &Columns,
        depths: &Depths<'_>,
    ) -> Outcome {
        self.write_with(|target| match target {
            Some(target) => surface.build(columns, depths, &self.layout, target),
            None => surface.count(columns, depths),
        })
    }

    /// Writes a surface and its size; `make` builds it, or only counts it if there is no target.
    pub(in crate::capi) fn write_with(
        &self,
        mut make: impl FnMut(Option<&mut Target<'_>>) -> crate::Result<Counts>,
    ) -> Outcome {
        // SAFETY: guaranteed by the caller of `new`.
        let mut target = unsafe { self.given.target() }?;
        // Too small a buffer is detected afterwards, so that a surface that fits is traversed once.
        let (counts, fits) = match make(Some(&mut target)) {
            Ok(counts) => (counts, Ok(())),
            Err(error) => {
                let counts = make(None)?;
                match check_room(&self.given.buffers(), &counts) {
                    Ok(()) => return Err(error.into()),
                    short => (counts, short),
                }
            }
        };
        self.report_size(counts)?;
        fits
    }
}

/// Fills a layout with the defaults.
///
/// layout: receives the defaults.
/// size: sizeof(frz_shallow_layout).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_layout_init(layout: *mut frz_shallow_layout, size: usize) -> frz_status {
    // SAFETY: the layout is NULL or has `size` bytes.
    guard(|| unsafe { fill(layout, Some(size), Sized32::defaults()) })
}

/// Reports the maximum size of the surface of any liquid on this ground, so that buffers can be allocated once. It holds until the ground
/// or a body moves. On ground with uneven ceilings it is several times the size of an actual surface. With FRZ_SHALLOW_SKIRTED add what
/// frz_shallow_find_ledges reports.
///
/// size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
///
/// Any number of threads may read a shallow liquid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_surface_bound(
    shallow: *const frz_shallow,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { informs(size, || Ok(bound(read(shallow)?.shallow.columns()))) }
}

/// Writes the liquid's surface as triangles (a real-time call: see frz_shallow): the wet columns and the dry ones around them. It ends at
/// the centres of the outermost cells. Vertices are in the order of their columns' indices, followed by those next to walls, and last those
/// on the ground's edges.
///
/// layout: NULL for the defaults.
/// target: the buffers. FRZ_ERROR_CAPACITY if one is too small: nothing is written, and size receives what is needed. With all data NULL
///     only the size is reported.
/// size: receives the size of the surface, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_shallow_surface(
    context: *mut frz_context,
    shallow: *mut frz_shallow,
    layout: *const frz_shallow_layout,
    target: *const frz_shallow_target,
    size: *mut frz_shallow_size,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and so are the spans.
    unsafe {
        writes(context, shallow, (layout, target, size), |liquid, request| liquid.write_surface(request))
    }
}

impl ShallowHandle {
    fn write_surface(&mut self, request: &MeshRequest<frz_shallow_target>) -> Outcome {
        let Self { shallow, surface, flow_fields, found_heights, found_ledges, .. } = self;
        let since = "since the ground or a body moved";
        let (least, sunk) = requested_heights(request.has(FRZ_SHALLOW_LIFTED), found_heights.known(), since)?;
        let ledges = found_ledges.requested(request.has(FRZ_SHALLOW_SKIRTED), since)?;
        let depths = Depths { least, sunk, ledges, ..flow_fields.depths(shallow, &request.needed_fields())? };
        request.write(surface, shallow.columns(), &depths)
    }
}
