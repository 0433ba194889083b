//! The snow before anything moves: from a vertical depth, or from its top surface (thesis section 3.2).
//!
//! Each upward triangle of the ground and of static objects carries a prism of snow. A prism adds 1 to the winding number, and a solid
//! subtracts more than all prisms can add. A single pass of winding numbers then gives the layer, without the ghost surfaces that CSG of
//! coincident faces leaves.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::mesh::coincident;
use crate::geometry::mesh::weld::Weld;
use crate::geometry::{DVec3, TriMesh};
use crate::numeric::checks::ensure;
use crate::sweep::{Face, Fixed, Lattice, Topology, Weights, Window, boundary, fill};
use crate::vdb::FloatGrid;

/// The ground under the snow.
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

/// Amount of snow.
pub enum Cover {
    /// Vertical depth above the ground and above static objects (m).
    Depth(f64),
    /// The snow's top surface; the space between it and the ground is snow.
    Top(TriMesh),
}

/// Cosine of the steepest slope that holds snow, 89 degrees. A vertical wall with rounded corner coordinates leans outward slightly: snow
/// on it would be a film far thinner than a cell.
const STEEPEST: f64 = 0.01745;
/// Weight of a solid in the winding number: of larger magnitude than the number of prisms that can overlap.
const SOLID: i32 = -(1 << 20);
const EVERYWHERE: Window = Window { min: [i32::MIN; 3], max: [i32::MAX; 3] };

/// Level set of the snow on a ground and on static objects.
///
/// # Errors
/// A depth, or a side of the area, that is not positive or is less than a cell; an empty mesh, no snow at all, a layer that is too large,
/// cancel.
pub fn layer(
    ctx: &Context,
    ground: &Ground,
    statics: &[TriMesh],
    cover: &Cover,
    cell: f64,
    half_width: f32,
) -> Result<FloatGrid> {
    check_thickness(ground, cover, cell)?;
    let ground = upright(ctx, sheet_of(ground)?);
    let statics: Vec<Sheet> = statics.iter().map(|mesh| upright(ctx, Sheet::of(mesh))).collect();
    let lattice = Lattice::near(cell, centre(&ground)?)?;
    let faces = ctx.phase("prisms", || {
        let mut faces = Vec::new();
        match cover {
            Cover::Depth(depth) => {
                ensure(*depth > 0.0 && depth.is_finite(), format_args!("depth = {depth} m is not above 0"))?;
                for mesh in std::iter::once(&ground).chain(&statics).map(Sheet::without_walls) {
                    let raised = |p: DVec3| p + DVec3::y() * *depth;
                    prisms(ctx, &lattice, &mesh, |p| p, raised, 1, &mut faces)?;
                }
            }
            Cover::Top(top) => {
                let top = &upright(ctx, Sheet::of(top));
                centre(top)?;
                let floor = ground.lowest().min(top.lowest()) - 16.0 * cell;
                let sunk = |p: DVec3| DVec3::new(p.x, floor, p.z);
                prisms(ctx, &lattice, top, sunk, |p| p, 1, &mut faces)?;
                prisms(ctx, &lattice, &ground, sunk, |p| p, SOLID, &mut faces)?;
            }
        }
        for mesh in std::iter::once(&ground).filter(|mesh| mesh.is_solid()).chain(&statics) {
            solid(ctx, &lattice, mesh, &mut faces)?;
        }
        Ok(faces)
    })?;
    let mut layer = fill(ctx, faces, lattice, half_width)?;
    ensure(
        layer.active_voxels() > 0,
        "there is no snow: is the depth below a cell, or the top below the ground?",
    )?;
    layer.prune_level_set()?;
    layer.set_name("surface")?;
    let warning = match cover {
        Cover::Depth(depth) => thin_warning(*depth, cell),
        Cover::Top(_) => thin_everywhere(&layer)?,
    };
    if let Some(what) = warning {
        log::warn!("{what}");
    }
    Ok(layer)
}

/// Checks that cells can represent a layer: the volume of a level set thinner than a cell is wrong.
///
/// # Errors
/// A depth or a plane of less than a cell; the message names it.
pub fn check_thickness(ground: &Ground, cover: &Cover, cell: f64) -> Result<()> {
    let check = |name: &str, size: f64| {
        // Values that are not positive are rejected where they are used.
        if size > 0.0 && size < cell {
            return Err(Error::argument(format!(
                "{name} = {size} m is less than a cell of {cell} m, which cannot hold it: take cells of {} m or less",
                rounded(size / THICK)
            )));
        }
        Ok(())
    };
    if let Cover::Depth(depth) = cover {
        check("depth", *depth)?;
    }
    if let Ground::Plane { area: [x0, z0, x1, z1], .. } = ground {
        check("the area's extent in x", x1 - x0)?;
        check("the area's extent in z", z1 - z0)?;
    }
    Ok(())
}

/// Thickness (cells) below which prints in a layer are rough.
const THICK: f64 = 3.0;

/// A length rounded to two significant digits.
fn rounded(length: f64) -> f64 {
    format!("{length:.1e}").parse().unwrap_or(length)
}

/// The warning for a vertical depth (m) of only a few cells.
pub fn thin_warning(depth: f64, cell: f64) -> Option<String> {
    let cells = depth / cell;
    (cells < THICK).then(|| {
        format!(
            "the snow is {cells:.1} cells thick: its volume and its prints are rough; cells of {} m or less hold it well",
            rounded(depth / THICK)
        )
    })
}

/// The warning for a layer that is thin everywhere.
fn thin_everywhere(layer: &FloatGrid) -> Result<Option<String>> {
    let cell = layer.voxel_size() as f32;
    let min = |values: &[f32; 512]| values.iter().copied().fold(f32::INFINITY, f32::min);
    let deepest = layer.leaves()?.iter().map(|leaf| min(leaf.values)).fold(f32::INFINITY, f32::min);
    // A layer of three cells has voxels at least a cell below its surface, at any position of the voxels.
    Ok((deepest > -(THICK as f32 - 1.0) / 2.0 * cell).then(|| {
        format!(
            "the snow is nowhere {THICK} cells of {cell} m thick: its volume and its prints are rough; take smaller cells"
        )
    }))
}

/// A mesh with 64-bit positions, so that the corners of a plane are exact however far from the origin. Welded vertices have the same
/// position.
struct Sheet {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Sheet {
    fn of(mesh: &TriMesh) -> Self {
        // Vertices that no triangle uses are not part of the snow.
        let mesh = mesh.clone().without_unused();
        let mut positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.cast()).collect();
        Weld::of(&positions, &mesh.triangles).unify(&mut positions);
        Self { positions, triangles: mesh.triangles }
    }

    /// The mesh without triangles steeper than [`STEEPEST`].
    fn without_walls(&self) -> Self {
        let holds = |[a, b, c]: &[DVec3; 3]| {
            let normal = (b - a).cross(&(c - a));
            normal.y.abs() >= STEEPEST * normal.norm()
        };
        let triangles = self.triangles.iter().zip(self.corners()).filter(|(_, corners)| holds(corners));
        Self {
            positions: self.positions.clone(),
            triangles: triangles.map(|(triangle, _)| *triangle).collect(),
        }
    }

    fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|index| self.positions[index as usize]))
    }

    fn topology(&self, close: bool) -> Topology {
        let same = coincident(self.positions.iter().copied());
        Topology::new(&self.triangles, self.positions.len(), &same, close)
    }

    fn is_solid(&self) -> bool {
        self.topology(false).is_closed()
    }

    fn lowest(&self) -> f64 {
        self.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min)
    }
}

fn sheet_of(ground: &Ground) -> Result<Sheet> {
    let (height, [x0, z0, x1, z1]) = match ground {
        Ground::Mesh(mesh) => return Ok(Sheet::of(mesh)),
        Ground::Plane { height, area } => (*height, *area),
    };
    ensure(
        x1 > x0 && z1 > z0 && height.is_finite() && (x1 - x0).is_finite() && (z1 - z0).is_finite(),
        format_args!("area = [{x0}, {z0}, {x1}, {z1}] is not [x0, z0, x1, z1] with x1 > x0, z1 > z0"),
    )?;
    let at = |x: f64, z: f64| DVec3::new(x, height, z);
    Ok(Sheet {
        positions: vec![at(x0, z0), at(x1, z0), at(x1, z1), at(x0, z1)],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    })
}

fn centre(sheet: &Sheet) -> Result<DVec3> {
    if sheet.positions.is_empty() || sheet.triangles.is_empty() {
        return Err(Error::argument("a mesh of the snow's ground or top is empty"));
    }
    Ok(sheet.positions.iter().sum::<DVec3>() / sheet.positions.len() as f64)
}

/// A mesh with its intended orientation: closed components with their faces outward, sheets with their faces upward. What remains
/// ambiguous is reported as a warning.
fn upright(ctx: &Context, mut sheet: Sheet) -> Sheet {
    let same = coincident(sheet.positions.iter().copied());
    let mut orientation = Orientation::of(&sheet.positions, &sheet.triangles, &same, Closing::Caps);
    let up = |(at, [a, b, c]): (usize, [DVec3; 3])| {
        let up = (b - a).cross(&(c - a)).y;
        if orientation.is_turned(at) { -up } else { up }
    };
    let is_open = |(at, _): &(usize, [DVec3; 3])| orientation.is_open(*at);
    if sheet.corners().enumerate().filter(is_open).map(up).sum::<f64>() < 0.0 {
        orientation.turn_open();
    }
    if let Some(what) = orientation.warning() {
        ctx.warn(&format!("a mesh of the ground, of the snow's top or a static one: {what}"));
    }
    if !orientation.is_unchanged() {
        sheet.triangles = orientation.applied(&sheet.triangles);
    }
    sheet
}

/// Adds the prism that each triangle sweeps outward (along its normal) from one position to the other; `weight` is what the prism adds to
/// winding numbers.
fn prisms(
    ctx: &Context,
    lattice: &Lattice,
    sheet: &Sheet,
    from: impl Fn(DVec3) -> DVec3,
    to: impl Fn(DVec3) -> DVec3,
    weight: i32,
    faces: &mut Vec<Face>,
) -> Result<()> {
    let topology = sheet.topology(false);
    let first = fixed_pose(lattice, &topology, sheet, from)?;
    let last = fixed_pose(lattice, &topology, sheet, to)?;
    let mut made = boundary(ctx, &topology, &[first, last], Weights { solid: 0, swept: 1 }, &EVERYWHERE)?;
    made.iter_mut().for_each(|face| weigh(face, weight));
    faces.extend(made);
    Ok(())
}

fn solid(ctx: &Context, lattice: &Lattice, sheet: &Sheet, faces: &mut Vec<Face>) -> Result<()> {
    let topology = sheet.topology(true);
    let pose = fixed_pose(lattice, &topology, sheet, |p| p)?;
    faces.extend(boundary(ctx, &topology, &[pose], Weights { solid: SOLID, swept: 0 }, &EVERYWHERE)?);
    Ok(())
}

/// Multiplies a face's coefficient; a negative factor flips the face.
fn weigh(face: &mut Face, factor: i32) {
    face.coef *= factor;
    if face.coef < 0 {
        face.coef = -face.coef;
        face.v.swap(1, 2);
    }
}

fn fixed_pose(
    lattice: &Lattice,
    topology: &Topology,
    sheet: &Sheet,
    position: impl Fn(DVec3) -> DVec3,
) -> Result<Vec<Fixed>> {
    let mut pose: Vec<DVec3> = sheet.positions.iter().map(|&p| lattice.to_cells(position(p))).collect();
    topology.complete(&mut pose);
    pose.into_iter().map(|cells| lattice.fix(cells)).collect()
}
