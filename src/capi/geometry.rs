//! The meshes and points of a file, lent as arrays: for hosts that show what a shot wrote.

use std::ffi::{CString, c_char};
use std::path::Path;

use super::ffi::*;
use super::runtime::context::{creates, frz_context};
use crate::error::Error;
use crate::geometry::mesh::attributes::On;
use crate::io::geometry::{self, ArrayValues, Part};
use crate::io::mesh::extension;
use crate::vdb::changes::{changes_since, partial};
use crate::vdb::points;

/// The meshes and points of a file.
pub struct frz_geometry {
    _opaque: [u8; 0],
}

/// The elements of a mesh that an array has values for.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_geometry_element {
    /// Vertices, or points.
    FRZ_GEOMETRY_VERTICES = 0,
    /// Corners of faces, in the order of frz_geometry_part.indices: an array with seams.
    FRZ_GEOMETRY_CORNERS = 1,
    /// Faces.
    FRZ_GEOMETRY_FACES = 2,
}

/// The type of an array's numbers.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_number {
    /// float.
    FRZ_NUMBER_FLOAT = 0,
    /// double.
    FRZ_NUMBER_DOUBLE = 1,
    /// int32_t.
    FRZ_NUMBER_INT32 = 2,
    /// uint32_t.
    FRZ_NUMBER_UINT32 = 3,
    /// int64_t.
    FRZ_NUMBER_INT64 = 4,
    /// uint8_t; also for truth values, 0 and 1.
    FRZ_NUMBER_UINT8 = 5,
}

/// Flag of a frz_geometry_part: it has a colour.
pub const FRZ_GEOMETRY_HAS_COLOR: u32 = 1;

/// A mesh, or points, of a file.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_geometry_part {
    /// sizeof(frz_geometry_part), set by the caller.
    pub struct_size: u32,
    /// 0 or FRZ_GEOMETRY_HAS_COLOR.
    pub flags: u32,
    /// Name of its prim in a USD file; empty for other files, which have one part. Lent.
    pub name: *const c_char,
    /// float[3] for each vertex or point, Y up; metres where the file states its unit.
    pub positions: frz_view,
    /// uint32_t for each face: its number of corners; none for points.
    pub face_counts: frz_view,
    /// uint32_t for each corner of each face: its vertex. Faces are counter-clockwise seen from outside.
    pub indices: frz_view,
    /// Number of arrays for frz_geometry_get_array.
    pub array_count: usize,
    /// With FRZ_GEOMETRY_HAS_COLOR: the colour of all of it, as the file has it; else zeroes.
    pub color: [f32; 3],
    /// 0.
    pub reserved: u32,
}

/// A named array of a part.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_geometry_array {
    /// sizeof(frz_geometry_array), set by the caller.
    pub struct_size: u32,
    /// A frz_geometry_element.
    pub element: u32,
    /// A frz_number.
    pub number: u32,
    /// Numbers of each element: 1, 2 or 3.
    pub components: u32,
    /// Name in UTF-8, not empty. Lent.
    pub name: *const c_char,
    /// As many numbers as components for each element, finite or not.
    pub values: frz_view,
}

sized32!(frz_geometry_part);
sized32!(frz_geometry_array);

/// The value of the handle: parts, with the texts that C reads.
pub(in crate::capi) struct Geometry(Vec<(CString, Part, Vec<CString>)>);

handle!(frz_geometry, Geometry, "geometry", 13);

impl Geometry {
    fn of(parts: Vec<Part>) -> Outcome<Self> {
        let text = |name: &str| {
            CString::new(name).map_err(|_| Failure::argument("the file has a name with a zero byte"))
        };
        let one = |part: Part| {
            let names = part.arrays.iter().map(|array| text(&array.name)).collect::<Outcome<_>>()?;
            Ok((text(&part.name)?, part, names))
        };
        parts.into_iter().map(one).collect::<Outcome<_>>().map(Self)
    }

    fn part(&self, index: usize) -> Outcome<&(CString, Part, Vec<CString>)> {
        let missing = || Failure::argument(format!("part = {index}, and there are {}", self.0.len()));
        self.0.get(index).ok_or_else(missing)
    }
}

/// Reads the meshes or points of a file: .usdc and .usd (a part for each mesh or, if there is none, for the points), .ply, .obj, .stl, .bgeo,
/// .vtk, .vtu, .xyz, and the points of a .vdb.
///
/// Arrays have the same names and types in every format: the components `vx`, `vy` and `vz` of a .ply are `v`, float[3], like the velocities
/// in USD; `red`, `green` and `blue` are `color`, of which bytes are divided by 255; texture coordinates are `uv`, float[2]. Points have `v`
/// (m/s), `id`, `pscale` (radius, m) and whatever else their file has.
///
/// path: UTF-8.
/// out: receives the parts, to be destroyed with frz_geometry_destroy; NULL after a failure. FRZ_ERROR_FILE for a file that is empty, cut
///     short or damaged, holds neither meshes nor points, or only the points that changed since another frame (`grains_mode = "delta"`).
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_geometry_load(
    context: *mut frz_context,
    path: *const c_char,
    out: *mut *mut frz_geometry,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        creates(context, out, |ctx| {
            let path = Path::new(required_text(path, "path")?);
            // The file itself is read into memory; how large its arrays are is known only then.
            ctx.allow(&path.display().to_string(), path.metadata().map_or(0, |data| data.len()))?;
            let parts = ctx.phase("read", || match &*extension(path) {
                "vdb" => match changes_since(path)? {
                    Some(since) => Err(Error::file(path, partial(since))),
                    None => Ok(vec![points::read(path, None)?.into()]),
                },
                _ => geometry::read(path),
            })?;
            ctx.allow(&path.display().to_string(), parts.iter().map(Part::memory_bytes).sum())?;
            Geometry::of(parts)
        })
    }
}

/// Destroys what frz_geometry_load made, and with it all that was lent; NULL is ignored.
///
/// geometry: may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_geometry_destroy(geometry: *mut frz_geometry) {
    // SAFETY: it is NULL or alive.
    guard(|| unsafe { destroy(geometry) });
}

/// Reports the number of parts.
///
/// count: receives it.
///
/// Any number of threads may read it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_geometry_count(geometry: *const frz_geometry, count: *mut usize) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe { answer(count, "count", || Ok(read(geometry)?.0.len())) })
}

/// Lends a part's name, positions and faces, until frz_geometry_destroy.
///
/// index: less than frz_geometry_count reports; FRZ_ERROR_ARGUMENT otherwise.
/// part: receives them. The caller sets its struct_size.
///
/// Any number of threads may read it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_geometry_get_part(
    geometry: *const frz_geometry,
    index: usize,
    part: *mut frz_geometry_part,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let geometry = read(geometry)?;
        let (name, own, _) = geometry.part(index)?;
        let value = frz_geometry_part {
            struct_size: 0,
            flags: if own.color.is_some() { FRZ_GEOMETRY_HAS_COLOR } else { 0 },
            name: name.as_ptr(),
            positions: lent(&own.positions),
            face_counts: lent(&own.face_counts),
            indices: lent(&own.corners),
            array_count: own.arrays.len(),
            color: own.color.unwrap_or_default(),
            reserved: 0,
        };
        fill(part, None, value)
    })
}

/// Lends an array of a part, until frz_geometry_destroy.
///
/// part: less than frz_geometry_count reports; index: less than frz_geometry_part.array_count. FRZ_ERROR_ARGUMENT otherwise.
/// array: receives it. The caller sets its struct_size.
///
/// Any number of threads may read it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_geometry_get_array(
    geometry: *const frz_geometry,
    part: usize,
    index: usize,
    array: *mut frz_geometry_array,
) -> frz_status {
    use frz_number::*;
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let geometry = read(geometry)?;
        let (_, own, names) = geometry.part(part)?;
        let missing =
            || Failure::argument(format!("index = {index}, and the part has {} arrays", names.len()));
        let (name, found) = names.get(index).zip(own.arrays.get(index)).ok_or_else(missing)?;
        let (number, data, count) = match &found.values {
            ArrayValues::F32(all) => (FRZ_NUMBER_FLOAT, all.as_ptr().cast(), all.len()),
            ArrayValues::F64(all) => (FRZ_NUMBER_DOUBLE, all.as_ptr().cast(), all.len()),
            ArrayValues::I32(all) => (FRZ_NUMBER_INT32, all.as_ptr().cast(), all.len()),
            ArrayValues::U32(all) => (FRZ_NUMBER_UINT32, all.as_ptr().cast(), all.len()),
            ArrayValues::I64(all) => (FRZ_NUMBER_INT64, all.as_ptr().cast(), all.len()),
            ArrayValues::U8(all) => (FRZ_NUMBER_UINT8, all.as_ptr().cast(), all.len()),
        };
        let element = match found.on {
            On::Vertices => frz_geometry_element::FRZ_GEOMETRY_VERTICES,
            On::Corners => frz_geometry_element::FRZ_GEOMETRY_CORNERS,
            On::Faces => frz_geometry_element::FRZ_GEOMETRY_FACES,
        };
        let value = frz_geometry_array {
            struct_size: 0,
            element: element as u32,
            number: number as u32,
            components: found.components as u32,
            name: name.as_ptr(),
            values: frz_view { data, count: count / found.components, stride: 0 },
        };
        fill(array, None, value)
    })
}

/// An array of the library, lent.
fn lent<T>(values: &[T]) -> frz_view {
    frz_view { data: values.as_ptr().cast(), count: values.len(), stride: 0 }
}
