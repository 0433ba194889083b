//! The snow before anything moves: from a vertical depth, or from its top surface (thesis section 3.2).
//!
//! Each upward triangle of the ground and of static objects carries a prism of snow. Prisms are layers of
//! a chain that count +1, solids count so far below zero that no prism fills them: one pass of winding
//! numbers then gives the layer, without the ghost surfaces that CSG of coincident faces leaves.

use crate::base::mesh::coincident;
use crate::base::{DVec3, TriMesh, Vec3};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::sweep::{Face, Fixed, Lattice, Topology, Weights, Window, boundary, fill};
use crate::vdb::FloatGrid;

/// What the snow lies on.
pub enum Ground {
    /// A horizontal plane.
    Plane {
        /// y (m).
        height: f64,
        /// x0, z0, x1, z1 (m).
        area: [f64; 4],
    },
    /// A mesh: a sheet, or a solid.
    Mesh(TriMesh),
}

/// How much snow there is.
pub enum Cover {
    /// Vertical depth above the ground and above static objects (m).
    Depth(f64),
    /// The snow's top surface; what lies between it and the ground is snow.
    Top(TriMesh),
}

/// Layers that a solid takes away: more than prisms can lie over each other.
const SOLID: i32 = -(1 << 20);
const EVERYWHERE: Window = Window { min: [i32::MIN; 3], max: [i32::MAX; 3] };

/// Level set of the snow on a ground and on static objects.
///
/// # Errors
/// A depth or an area that is not positive, an empty mesh, no snow at all, a layer too large, cancel.
pub fn layer(
    ctx: &Context,
    ground: &Ground,
    statics: &[TriMesh],
    cover: &Cover,
    cell: f64,
    half_width: f32,
) -> Result<FloatGrid> {
    let ground = upright(ground_mesh(ground)?);
    let statics: Vec<TriMesh> = statics.iter().map(|mesh| upright(mesh.clone())).collect();
    let lattice = Lattice::near(cell, centre(&ground)?)?;
    let faces = ctx.stage("prisms", || {
        let mut faces = Vec::new();
        match cover {
            Cover::Depth(depth) => {
                if !(*depth > 0.0 && depth.is_finite()) {
                    return Err(Error::argument(format!("depth = {depth} m is not above 0")));
                }
                for mesh in std::iter::once(&ground).chain(&statics) {
                    let raised = |p: DVec3| p + DVec3::y() * *depth;
                    prisms(&lattice, mesh, |p| p, raised, 1, &mut faces)?;
                }
            }
            Cover::Top(top) => {
                centre(top)?;
                let top = &upright(top.clone());
                let floor = lowest(&ground).min(lowest(top)) - 16.0 * cell;
                let sunk = |p: DVec3| DVec3::new(p.x, floor, p.z);
                prisms(&lattice, top, sunk, |p| p, 1, &mut faces)?;
                prisms(&lattice, &ground, sunk, |p| p, SOLID, &mut faces)?;
            }
        }
        for mesh in std::iter::once(&ground).filter(|mesh| is_solid(mesh)).chain(&statics) {
            solid(&lattice, mesh, &mut faces)?;
        }
        Ok(faces)
    })?;
    let mut layer = fill(ctx, faces, lattice, half_width)?;
    if layer.active_voxels() == 0 {
        return Err(Error::argument(
            "there is no snow: is the depth below a cell, or the top below the ground?",
        ));
    }
    layer.prune_level_set()?;
    layer.set_name("surface")?;
    Ok(layer)
}

fn ground_mesh(ground: &Ground) -> Result<TriMesh> {
    let (height, [x0, z0, x1, z1]) = match ground {
        Ground::Mesh(mesh) => return Ok(mesh.clone()),
        Ground::Plane { height, area } => (*height, *area),
    };
    if !(x1 > x0 && z1 > z0 && height.is_finite() && (x1 - x0).is_finite() && (z1 - z0).is_finite()) {
        return Err(Error::argument(format!(
            "area = [{x0}, {z0}, {x1}, {z1}] is not [x0, z0, x1, z1] with x1 > x0, z1 > z0"
        )));
    }
    let at = |x: f64, z: f64| Vec3::new(x as f32, height as f32, z as f32);
    Ok(TriMesh {
        positions: vec![at(x0, z0), at(x1, z0), at(x1, z1), at(x0, z1)],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    })
}

fn centre(mesh: &TriMesh) -> Result<DVec3> {
    if mesh.positions.is_empty() || mesh.triangles.is_empty() {
        return Err(Error::argument("a mesh of the snow's ground or top is empty"));
    }
    let sum: DVec3 = mesh.positions.iter().map(|p| p.cast::<f64>()).sum();
    Ok(sum / mesh.positions.len() as f64)
}

fn lowest(mesh: &TriMesh) -> f64 {
    mesh.positions.iter().map(|p| f64::from(p.y)).fold(f64::INFINITY, f64::min)
}

fn topology(mesh: &TriMesh, close: bool) -> Topology {
    let same = coincident(mesh.positions.iter().map(|p| p.cast()));
    Topology::new(&mesh.triangles, mesh.positions.len(), &same, close)
}

/// A mesh as it is meant: a solid with its faces outward, a sheet with its faces upward.
fn upright(mesh: TriMesh) -> TriMesh {
    let up: f64 = (0..mesh.triangles.len())
        .map(|triangle| mesh.corners(triangle))
        .map(|[a, b, c]| (b - a).cross(&(c - a)).y)
        .sum();
    let inward = if is_solid(&mesh) { mesh.volume() < 0.0 } else { up < 0.0 };
    if inward { mesh.reversed() } else { mesh }
}

fn is_solid(mesh: &TriMesh) -> bool {
    topology(mesh, false).is_closed()
}

/// Prisms between two places of each triangle that moves along its normal from the first to the second.
fn prisms(
    lattice: &Lattice,
    mesh: &TriMesh,
    from: impl Fn(DVec3) -> DVec3,
    to: impl Fn(DVec3) -> DVec3,
    layers: i32,
    faces: &mut Vec<Face>,
) -> Result<()> {
    let topology = topology(mesh, false);
    let first = level(lattice, &topology, mesh, from)?;
    let last = level(lattice, &topology, mesh, to)?;
    let mut made = boundary(&topology, &[first, last], Weights { solid: 0, swept: 1 }, &EVERYWHERE);
    made.iter_mut().for_each(|face| weigh(face, layers));
    faces.extend(made);
    Ok(())
}

fn solid(lattice: &Lattice, mesh: &TriMesh, faces: &mut Vec<Face>) -> Result<()> {
    let topology = topology(mesh, true);
    let pose = level(lattice, &topology, mesh, |p| p)?;
    faces.extend(boundary(&topology, &[pose], Weights { solid: SOLID, swept: 0 }, &EVERYWHERE));
    Ok(())
}

/// Multiplies a face's layers, turning it round for a negative factor.
fn weigh(face: &mut Face, factor: i32) {
    face.coef *= factor;
    if face.coef < 0 {
        face.coef = -face.coef;
        face.v.swap(1, 2);
    }
}

fn level(
    lattice: &Lattice,
    topology: &Topology,
    mesh: &TriMesh,
    place: impl Fn(DVec3) -> DVec3,
) -> Result<Vec<Fixed>> {
    let mut pose: Vec<DVec3> = mesh.positions.iter().map(|p| lattice.to_cells(place(p.cast()))).collect();
    topology.complete(&mut pose);
    pose.into_iter().map(|cells| lattice.fix(cells)).collect()
}
