//! Repair: meshes with faults become solids.

use super::triangles::{Mesh, frz_mesh};
use crate::capi::ffi::*;
use crate::capi::runtime::context::{enter, frz_context};
use crate::context::Context;
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{DetailedMesh, MeshArray};
use crate::mesh_repair::{Prepared, RepairReport, Repaired, carry_attributes, repair};

/// What frz_mesh_repair did.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_repair_report {
    /// sizeof(frz_repair_report), set by the caller.
    pub struct_size: u32,
    /// Rebuild level: what was rebuilt beyond the cells at fault and those that they require: 0 nothing, 1 a ring of cells around them, 2
    /// the whole parts of the mesh that pass through them, 3 everything.
    pub rung: u32,
    /// Vertices joined with others at the same corner: at the same position, or, on open edges, within rounding of it.
    pub joined_vertices: u64,
    /// Triangles dropped: degenerate, duplicate or isolated ones, and those of parts that coincide with another part.
    pub dropped_triangles: u64,
    /// Triangles reversed to agree with their neighbours.
    pub turned_triangles: u64,
    /// Parts reversed as a whole to face outward.
    pub turned_parts: u64,
    /// Holes closed.
    pub holes: u64,
    /// Triangles that close them.
    pub added_triangles: u64,
    /// Cells in which the mesh had faults.
    pub flagged_cells: u64,
    /// Cells in which the mesh was rebuilt.
    pub rebuilt_cells: u64,
    /// Triangles kept unchanged.
    pub kept_triangles: u64,
    /// New triangles with an altitude below 4e-4 of their longest edge.
    pub slivers: u64,
    /// Edge of the cells (m): the one requested, or a fraction of it if nothing would have been left.
    pub cell: f64,
}

sized32!(frz_repair_report);

fields_of!(Prepared => frz_repair_report {
    joined_vertices, dropped_triangles, turned_triangles, turned_parts, holes, added_triangles
});

impl From<RepairReport> for frz_repair_report {
    fn from(report: RepairReport) -> Self {
        Self {
            rung: report.rebuild_level as u32,
            flagged_cells: report.flagged_cells as u64,
            rebuilt_cells: report.rebuilt_cells as u64,
            kept_triangles: report.kept_triangles as u64,
            slivers: report.slivers as u64,
            cell: report.cell,
            ..report.prepared.into()
        }
    }
}

/// Creates a closed mesh from one that is open, intersects itself, or is inside out in parts: the solid of all points that lie inside at
/// least one part, with each part turned outward. Overlapping parts are united, holes are closed, cavities are filled.
///
/// Where the mesh has faults it is rebuilt in the cells of a grid, within a cell of that solid's surface; all other triangles are kept
/// unchanged. Remaining vertices keep their order and their attributes; new ones take the attributes that the mesh had at the nearest
/// position. All faces of the result are triangles, each edge belongs to two consistently oriented triangles, and the triangles around each
/// vertex form a single ring.
///
/// mesh: not modified.
/// cell: edge of a cell (m), 1e-9 to 1e6, about as long as the mesh's edges: where the mesh is rebuilt, thinner features may be lost.
///     FRZ_ERROR_ARGUMENT if the mesh reaches farther than 131072 cells from its middle, encloses nothing, or would be lost almost
///     entirely. Smaller losses cause a warning: if less than half of the volume is left, or a side of the bounding box has moved inward
///     by more than two cells and more than a twentieth of the longest side.
/// out: receives the new mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
/// report: receives what the call did, all zeroes after a failure; may be NULL. The caller sets its struct_size.
///
/// Any number of threads may read a mesh; one thread at a time for each context.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mesh_repair(
    context: *mut frz_context,
    mesh: *const frz_mesh,
    cell: f64,
    out: *mut *mut frz_mesh,
    report: *mut frz_repair_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(out);
        reports(report, || {
            let call = enter(context)?;
            required(out, "out")?;
            let mesh = read(mesh)?;
            within("cell", cell, 1e-9..=1e6, " m")?;
            let (repaired, done) = repaired(call.ctx(), &mesh, cell)?;
            give(out, repaired)?;
            Ok(done)
        })
    })
}

/// A repaired mesh with its attributes, and the report.
fn repaired(ctx: &Context, mesh: &Mesh, cell: f64) -> Outcome<(Mesh, RepairReport)> {
    let Repaired { mesh: solid, vertices, sources, report } = repair(ctx, &mesh.triangles, cell)?;
    if let Some(what) = report.losses.warning(report.cell) {
        ctx.warn(&what);
    }
    // One array for each component: they are carried separately.
    let arrays = mesh.attributes().flat_map(|(name, components, values)| {
        (0..components).map(move |component| {
            let values = values.iter().skip(component).step_by(components).map(|value| f64::from(*value));
            MeshArray { name: name.into(), on: On::Vertices, number: Number::F32, values: values.collect() }
        })
    });
    let detail = DetailedMesh { mesh: mesh.triangles.clone(), uvs: None, arrays: arrays.collect() };
    let carry = || Ok(carry_attributes(&detail, solid, &vertices, &sources, None));
    let DetailedMesh { mesh: solid, arrays, .. } = ctx.phase("carry", carry)?;
    let count = solid.positions.len();
    let mut out = Mesh::of_triangles(solid);
    let mut arrays = &arrays[..];
    for (name, components, _) in mesh.attributes() {
        let (own, rest) = arrays.split_at(components);
        let of_vertex = |vertex: usize| own.iter().map(move |array| array.values[vertex] as f32);
        out.set_attribute(name, components, (0..count).flat_map(of_vertex).collect());
        arrays = rest;
    }
    Ok((out, report))
}
