//! The layer of snow before anything moves.

use crate::capi::ffi::*;
use crate::capi::grid::sparse::{check_voxel, frz_grid};
use crate::capi::mesh::triangles::{frz_mesh, no_flags};
use crate::capi::runtime::context::{creates, frz_context};
use crate::context::Context;
use crate::geometry::TriMesh;
use crate::snow::base_layer::initial::{Cover, Ground, layer};
use crate::sweep::surface_bytes;
use crate::vdb::FloatGrid;

/// Description of a layer of snow: the ground and the depth.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_snow_desc {
    /// sizeof(frz_snow_desc).
    pub struct_size: u32,
    /// Must be 0.
    pub flags: u32,
    /// Edge of a voxel (m), 1e-6 to 1000.
    pub voxel_size: f64,
    /// Half width of the band of distances (voxels), 3 to 64.
    pub half_width: f64,
    /// Vertical depth above the ground and above static objects (m), above 0; not used with a top.
    pub depth: f64,
    /// The top surface of the snow; the space between it and the ground is snow. NULL: depth is used.
    pub top: *const frz_mesh,
    /// The ground, a surface or a solid; NULL: a horizontal rectangle.
    pub ground: *const frz_mesh,
    /// Height of the rectangle, its y (m).
    pub ground_height: f64,
    /// x0, z0, x1, z1 of the rectangle (m), x0 < x1, z0 < z1.
    pub area: [f64; 4],
    /// Pointers to static objects that snow lies on, each a solid; NULL for none.
    pub statics: *const *const frz_mesh,
    /// Number of static objects.
    pub static_count: usize,
}

sized32!(frz_snow_desc, [statics], {
    let area = [-1.0, -1.0, 1.0, 1.0];
    Self { voxel_size: 0.01, half_width: 3.0, depth: 0.3, area, ..Self::zeroed() }
});

/// Fills a description with the defaults: voxels of 1 cm, 0.3 m of snow on a square of 2 m at y = 0.
///
/// desc: receives the defaults.
/// size: sizeof(frz_snow_desc).
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_snow_desc_init(desc: *mut frz_snow_desc, size: usize) -> frz_status {
    // SAFETY: the description is NULL or has `size` bytes.
    guard(|| unsafe { fill(desc, Some(size), frz_snow_desc::defaults()) })
}

/// Creates a layer of snow as a level set named "surface", for frz_base_create.
///
/// desc: its ground and depth. Y is up.
/// out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
///
/// Any number of threads may read a mesh; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_snow_layer(
    context: *mut frz_context,
    desc: *const frz_snow_desc,
    out: *mut *mut frz_grid,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe { creates(context, out, |ctx| layer_of(ctx, &given(desc)?)) }
}

/// A layer of snow from its description.
///
/// # Safety
/// The description must describe memory that can be read.
unsafe fn layer_of(ctx: &Context, desc: &frz_snow_desc) -> Outcome<FloatGrid> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        no_flags(desc.flags, 0)?;
        check_voxel(desc.voxel_size)?;
        within("half_width", desc.half_width, 3.0..=64.0, "")?;
        finite("depth", desc.depth)?;
        finite("ground_height", desc.ground_height)?;
        for (at, &side) in desc.area.iter().enumerate() {
            finite(&format!("area: element {at}"), side)?;
        }
        let statics = read_each(desc.statics, desc.static_count, "statics")?;
        let statics: Vec<TriMesh> = statics.iter().map(|mesh| mesh.triangles.clone()).collect();
        let ground = match desc.ground.is_null() {
            true => Ground::Plane { height: desc.ground_height, area: desc.area },
            false => Ground::Mesh(read(desc.ground)?.triangles.clone()),
        };
        let cover = match desc.top.is_null() {
            true => Cover::Depth(desc.depth),
            false => Cover::Top(read(desc.top)?.triangles.clone()),
        };
        let area = surfaces(&ground, &cover, &statics);
        ctx.allow("the layer of snow", surface_bytes(area, desc.voxel_size))?;
        let (voxel_size, half_width) = (desc.voxel_size, desc.half_width as f32);
        Ok(ctx.polled(|| layer(ctx, &ground, &statics, &cover, voxel_size, half_width))?)
    }
}

/// Surface area (m2) of the layer: bottom and top.
fn surfaces(ground: &Ground, cover: &Cover, statics: &[TriMesh]) -> f64 {
    let ground = match ground {
        Ground::Plane { area: [x0, z0, x1, z1], .. } => ((x1 - x0) * (z1 - z0)).abs(),
        Ground::Mesh(mesh) => mesh.area(),
    };
    let top = match cover {
        Cover::Depth(_) => ground,
        Cover::Top(mesh) => mesh.area(),
    };
    ground + top + 2.0 * statics.iter().map(TriMesh::area).sum::<f64>()
}
