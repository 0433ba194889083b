//! Polygon meshes with vertex attributes.

use std::ffi::c_char;

use crate::capi::ffi::*;
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::geometry::{PolygonMesh, TriMesh, Vec3};

/// A polygon mesh with vertex attributes.
pub struct frz_mesh {
    _opaque: [u8; 0],
}

/// A named vertex attribute.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_attribute {
    /// Name in UTF-8, not empty.
    pub name: *const c_char,
    /// Number of floats for each vertex, 1 to 4.
    pub components: u32,
    /// As many floats as components for each vertex of the mesh, finite or not.
    pub values: frz_view,
}

/// Description of a new mesh.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_mesh_desc {
    /// sizeof(frz_mesh_desc).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// float[3] for each vertex (m), finite.
    pub positions: frz_view,
    /// uint32_t for each face: its number of corners. data NULL: all faces are triangles. Faces of fewer than three corners are skipped.
    pub face_counts: frz_view,
    /// uint32_t for each corner of each face: its vertex. Faces are counter-clockwise seen from outside.
    pub indices: frz_view,
    /// Attributes; NULL for none.
    pub attributes: *const frz_attribute,
    /// Number of attributes.
    pub attribute_count: usize,
}

// SAFETY: numbers and pointers; padding between fields is never read.
unsafe impl Plain for frz_attribute {}

sized32!(frz_mesh_desc, [attributes]);

/// Properties of a mesh.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_mesh_info {
    /// sizeof(frz_mesh_info), set by the caller.
    pub struct_size: u32,
    /// 1 if every edge is used equally often in both directions, else 0.
    pub closed: u32,
    /// Number of vertices.
    pub vertex_count: u64,
    /// Number of faces.
    pub face_count: u64,
    /// Number of corners of all faces.
    pub corner_count: u64,
    /// Number of triangles into which the faces are divided.
    pub triangle_count: u64,
    /// Number of attributes.
    pub attribute_count: u64,
    /// Minimum corner of the vertices' bounding box (m).
    pub box_min: [f32; 3],
    /// Maximum corner (m).
    pub box_max: [f32; 3],
    /// Surface area (m2).
    pub area: f64,
    /// Enclosed volume (m3); meaningful for closed meshes only.
    pub volume: f64,
}

sized32!(frz_mesh_info);

/// Arrays that frz_mesh_read copies.
#[repr(u32)]
#[derive(Clone, Copy)]
pub enum frz_mesh_part {
    /// float[3] for each vertex (m).
    FRZ_MESH_POSITIONS = 0,
    /// uint32_t for each face: its number of corners.
    FRZ_MESH_FACE_COUNTS = 1,
    /// uint32_t for each corner: its vertex.
    FRZ_MESH_INDICES = 2,
    /// uint32_t[3] for each triangle into which the faces are divided: its vertices.
    FRZ_MESH_TRIANGLES = 3,
    /// float[3] for each vertex: the outward unit normal, an area-weighted mean over the triangles around it; zeroes where there is none.
    FRZ_MESH_NORMALS = 4,
}

/// The value of a mesh's handle.
pub(in crate::capi) struct Mesh {
    polygons: PolygonMesh,
    /// The triangles into which its faces are divided.
    pub triangles: TriMesh,
    attributes: Vec<Attribute>,
}

struct Attribute {
    name: String,
    components: usize,
    values: Vec<f32>,
}

handle!(frz_mesh, Mesh, "mesh", 3);

impl Mesh {
    /// A mesh from its description.
    ///
    /// # Safety
    /// The description must describe memory that can be read.
    unsafe fn of_desc(ctx: &Context, desc: &frz_mesh_desc) -> Outcome<Self> {
        no_flags(desc.flags, 0)?;
        // SAFETY: guaranteed by the caller.
        let polygons = unsafe { polygons(&desc.positions, &desc.face_counts, &desc.indices) }?;
        ctx.allow("a mesh", (polygons.positions.len() + polygons.corners.len()) as u64 * 28)?;
        // SAFETY: as above.
        let attributes = unsafe { attributes(desc, polygons.positions.len()) }?;
        let triangles = ctx.phase("triangles", || Ok(polygons.clone().into_triangles()))?;
        Ok(Self { polygons, triangles, attributes })
    }

    /// A mesh made by the library.
    pub(in crate::capi) fn of_triangles(triangles: TriMesh) -> Self {
        let mut polygons = PolygonMesh { positions: triangles.positions.clone(), ..PolygonMesh::default() };
        triangles.triangles.iter().for_each(|triangle| polygons.push(*triangle));
        Self { polygons, triangles, attributes: Vec::new() }
    }

    /// The values of an attribute; `None` if there is none with this name and number of components.
    pub(in crate::capi) fn attribute(&self, name: &str, components: usize) -> Option<&[f32]> {
        let is_it = |attribute: &&Attribute| attribute.name == name && attribute.components == components;
        self.attributes.iter().find(is_it).map(|attribute| &attribute.values[..])
    }

    /// Name, components and values of each attribute.
    pub(in crate::capi) fn attributes(&self) -> impl Iterator<Item = (&str, usize, &[f32])> {
        self.attributes.iter().map(|one| (&*one.name, one.components, &one.values[..]))
    }

    /// Adds an attribute, replacing one of the same name.
    pub(in crate::capi) fn set_attribute(&mut self, name: &str, components: usize, values: Vec<f32>) {
        self.attributes.retain(|attribute| attribute.name != name);
        self.attributes.push(Attribute { name: name.into(), components, values });
    }
}

/// Polygons from a host's arrays, checked.
///
/// # Safety
/// The views must describe memory that can be read.
pub(in crate::capi) unsafe fn polygons(
    positions: &frz_view,
    counts: &frz_view,
    indices: &frz_view,
) -> Outcome<PolygonMesh> {
    // SAFETY: guaranteed by the caller.
    let (positions, counts, corners) = unsafe {
        (positions.finite("positions")?, face_counts(counts)?, indices.elements::<u32>("indices")?)
    };
    check_corners(&corners, positions.len())?;
    let positions = positions.into_iter().map(Vec3::from).collect();
    let mut mesh = PolygonMesh { positions, ..PolygonMesh::default() };
    match counts {
        None => set_triangles(&mut mesh, corners)?,
        Some(counts) => push_faces(&mut mesh, &corners, counts)?,
    }
    refuse(mesh.ends.is_empty(), || "indices: the mesh has no faces")?;
    Ok(mesh)
}

/// The corner count of each face; `None` if all are triangles.
///
/// # Safety
/// As [`polygons`].
unsafe fn face_counts(counts: &frz_view) -> Outcome<Option<Vec<u32>>> {
    if counts.data.is_null() && counts.count == 0 {
        return Ok(None);
    }
    // SAFETY: guaranteed by the caller.
    unsafe { counts.elements::<u32>("face_counts") }.map(Some)
}

/// Refuses too many vertices or corners, and corners out of range.
fn check_corners(corners: &[u32], vertices: usize) -> Outcome {
    if u32::try_from(vertices).is_err() || u32::try_from(corners.len()).is_err() {
        return Err(Failure::argument("a mesh has at most 4294967295 vertices and corners"));
    }
    match corners.iter().position(|&vertex| vertex as usize >= vertices) {
        None => Ok(()),
        Some(at) => {
            Err(Failure::argument(format!("indices: corner {at} names vertex {} of {vertices}", corners[at])))
        }
    }
}

fn set_triangles(mesh: &mut PolygonMesh, corners: Vec<u32>) -> Outcome {
    refuse(!corners.len().is_multiple_of(3), || {
        format!("indices: {} corners are not a multiple of 3", corners.len())
    })?;
    mesh.ends = (3..=corners.len() as u32).step_by(3).collect();
    mesh.corners = corners;
    Ok(())
}

fn push_faces(mesh: &mut PolygonMesh, corners: &[u32], counts: Vec<u32>) -> Outcome {
    let sum: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    refuse(sum != corners.len() as u64, || {
        format!("face_counts: the faces have {sum} corners, indices {}", corners.len())
    })?;
    let mut rest = corners;
    for count in counts {
        let (face, left) = rest.split_at(count as usize);
        mesh.push(face.iter().copied());
        rest = left;
    }
    Ok(())
}

/// Creates a mesh from a host's arrays, which are copied.
///
/// Faces may have any number of corners and may be concave; meshes may be open, intersect themselves and repeat vertices. The faces are
/// divided into triangles once.
///
/// desc: its description. Counts, strides, indices and positions are checked: the error names the first invalid one, counted from 0.
/// out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
///
/// One thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_create(
    context: *mut frz_context,
    desc: *const frz_mesh_desc,
    out: *mut *mut frz_mesh,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| Mesh::of_desc(ctx, &given(desc)?)) }
}

/// Refuses unknown flags.
pub(in crate::capi) fn no_flags(flags: u32, known: u32) -> Outcome {
    refuse(flags & !known != 0, || format!("flags = {flags:#x} has bits without a meaning"))
}

unsafe fn attributes(desc: &frz_mesh_desc, vertices: usize) -> Outcome<Vec<Attribute>> {
    let view = frz_view::packed(desc.attributes, desc.attribute_count);
    // SAFETY: the caller of `frz_mesh_create` guarantees `attribute_count` attributes.
    let list = unsafe { view.elements::<frz_attribute>("attributes") }?;
    let mut out: Vec<Attribute> = Vec::with_capacity(list.len());
    for attribute in list {
        // SAFETY: as above.
        let name = unsafe { text(attribute.name, "an attribute's name") }?.filter(|name| !name.is_empty());
        let name = name.ok_or_else(|| Failure::argument("an attribute has no name"))?.to_string();
        refuse(out.iter().any(|other| other.name == name), || {
            format!("two attributes are named \"{name}\"")
        })?;
        let values = attribute.values;
        refuse(values.count != vertices, || {
            format!("attribute \"{name}\" has {} elements, the mesh {vertices} vertices", values.count)
        })?;
        let components = attribute.components as usize;
        // SAFETY: as above.
        let values: Vec<f32> = unsafe {
            match components {
                1 => values.elements::<f32>(&name)?,
                2 => values.elements::<[f32; 2]>(&name)?.into_flattened(),
                3 => values.elements::<[f32; 3]>(&name)?.into_flattened(),
                4 => values.elements::<[f32; 4]>(&name)?.into_flattened(),
                other => {
                    let text = format!("attribute \"{name}\": components = {other} is not within 1 to 4");
                    return Err(Failure::argument(text));
                }
            }
        };
        out.push(Attribute { name, components, values });
    }
    Ok(out)
}

/// Destroys a mesh; NULL is ignored.
///
/// mesh: may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_destroy(mesh: *mut frz_mesh) {
    // SAFETY: the mesh is NULL or alive.
    guard(|| unsafe { destroy(mesh) });
}

/// Reports the properties of a mesh: the element counts for frz_mesh_read, its bounding box, area and volume.
///
/// info: receives them. The caller sets its struct_size.
///
/// Any number of threads may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_get_info(mesh: *const frz_mesh, info: *mut frz_mesh_info) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let mesh = read(mesh)?;
        let triangles = &mesh.triangles;
        let (low, high) = triangles.bounds().unwrap_or_default();
        let value = frz_mesh_info {
            struct_size: 0,
            closed: u32::from(triangles.is_closed()),
            vertex_count: mesh.polygons.positions.len() as u64,
            face_count: mesh.polygons.ends.len() as u64,
            corner_count: mesh.polygons.corners.len() as u64,
            triangle_count: triangles.triangles.len() as u64,
            attribute_count: mesh.attributes.len() as u64,
            box_min: low.into(),
            box_max: high.into(),
            area: triangles.area(),
            volume: triangles.volume(),
        };
        fill(info, None, value)
    })
}

/// # Safety
/// The span must describe memory that can be written.
unsafe fn triples(dst: &frz_span, triples: &[Vec3]) -> Outcome {
    // SAFETY: guaranteed by the caller.
    unsafe { dst.put("dst", triples.iter().map(|&triple| <[f32; 3]>::from(triple))) }
}

/// Copies an array of a mesh into the caller's memory.
///
/// part: a frz_mesh_part.
/// dst: room for as many elements as frz_mesh_get_info reports, of the type that the part states; FRZ_ERROR_CAPACITY if it is too small,
///     and nothing is written.
///
/// Any number of threads may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_read(mesh: *const frz_mesh, part: u32, dst: frz_span) -> frz_status {
    use frz_mesh_part::*;
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        let mesh = read(mesh)?;
        let known = numbered! {
            FRZ_MESH_POSITIONS, FRZ_MESH_FACE_COUNTS, FRZ_MESH_INDICES, FRZ_MESH_TRIANGLES, FRZ_MESH_NORMALS
        };
        match meaning("part", "frz_mesh_part", part, &known)? {
            FRZ_MESH_POSITIONS => triples(&dst, &mesh.polygons.positions),
            FRZ_MESH_NORMALS => triples(&dst, &mesh.triangles.normals()),
            FRZ_MESH_FACE_COUNTS => {
                dst.collect("dst", mesh.polygons.polygons().map(|face| face.len() as u32))
            }
            FRZ_MESH_INDICES => dst.fill("dst", &mesh.polygons.corners),
            FRZ_MESH_TRIANGLES => dst.fill("dst", &mesh.triangles.triangles),
        }
    })
}

/// Copies an attribute of a mesh into the caller's memory.
///
/// name: its name. FRZ_ERROR_ARGUMENT, with a list of the existing names, if there is none of this name.
/// dst: room for one element for each vertex, of as many floats as components reports; with data NULL only components is reported.
/// components: receives the number of floats for each vertex, 1 to 4; 0 after a failure. May be NULL.
///
/// Any number of threads may read a mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_attribute(
    mesh: *const frz_mesh,
    name: *const c_char,
    dst: frz_span,
    components: *mut u32,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(components);
        let mesh = read(mesh)?;
        let name = required_text(name, "name")?;
        let found = mesh.attributes.iter().find(|attribute| attribute.name == name);
        let attribute = found.ok_or_else(|| {
            let names: Vec<&str> = mesh.attributes.iter().map(|other| other.name.as_str()).collect();
            let there =
                if names.is_empty() { "it has none".into() } else { format!("it has {}", names.join(", ")) };
            Failure::argument(format!("the mesh has no attribute \"{name}\": {there}"))
        })?;
        if !dst.data.is_null() {
            let values = &attribute.values;
            match attribute.components {
                1 => dst.fill("dst", values)?,
                2 => dst.fill("dst", values.as_chunks::<2>().0)?,
                3 => dst.fill("dst", values.as_chunks::<3>().0)?,
                _ => dst.fill("dst", values.as_chunks::<4>().0)?,
            }
        }
        write_some(components, attribute.components as u32);
        Ok(())
    })
}
