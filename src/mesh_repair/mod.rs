//! Makes a closed mesh from one with faults: broken parts are cut along the cells of a grid and rebuilt in them; the rest stays as it is,
//! triangle by triangle (thesis 2.5).
//!
//! After Wojtan et al. 2009, except that the cells to rebuild are chosen before anything is cut (as Heiss-Synak et al. 2024 do), and that
//! the mesh is cut exactly along their outer faces: no search for triangles that fit between the old and the new surface is needed, since
//! both share the cut.
//!
//! 1. `prepare/`: holes are closed, and parts turned outward: the solid is where the winding number is over 0.
//! 2. `cut/pierces.rs`, `cut/exact.rs`: where the mesh passes through the grid, decided without rounding.
//! 3. `region/faulty_cells.rs`: cells in which the mesh is at fault; `region/`: the cells that must be rebuilt with them.
//! 4. `cut/`: the mesh outside these cells; `fill/`: marching cubes inside, sewn to it point by point.
//! 5. `tidy/`: slivers among the new triangles are removed.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | pierce | where a triangle passes through an edge of the grid |
//! | passage, segment | where an edge of the mesh passes through a face of the grid; where a triangle does |
//! | outer | of a face or an edge of the grid: some of the cells around it are rebuilt, and some are not |
//! | rim | where the mesh passes through outer faces: the cut |
//! | sound | of an outer edge: the mesh crosses it once if one of its ends is inside and the other outside, else not at all |
//! | rebuild level | a step of the fall-backs: how much is rebuilt when less did not work |

mod attributes;
mod cut;
mod fill;
mod losses;
mod prepare;
mod region;
mod source;
mod tidy;

use self::cut::Trouble;
use self::cut::draft::{Draft, sewn};
use self::fill::{Rim, fill};
use self::prepare::{Closed, prepare};
use self::region::grow;
use crate::context::Context;
use crate::distance::lattice::Lattice;
use crate::error::{Error, Result, fail_if};
use crate::geometry::check::topology::Topology;
use crate::geometry::{Coord, DVec3, TriMesh, Vec3};
pub use source::Source;

pub use self::attributes::carried as carry_attributes;
pub use self::attributes::charts::Traced;
pub(super) use self::attributes::weights::weights;
pub(super) use self::cut::Shape;
pub(super) use self::cut::exact::{GridEdge, end};
pub(super) use self::cut::pierces::Pierces;
pub use self::losses::Losses;
pub use self::prepare::Prepared;
pub(super) use self::region::faulty_cells::add_overlaps;
pub(super) use self::region::{CellSet, Inside};

/// A repaired mesh.
#[derive(Debug, Clone)]
pub struct Repaired {
    /// Closed, 2-manifold by index, turned outward.
    pub mesh: TriMesh,
    /// For each vertex, its vertex in the input mesh; none: it is new.
    pub vertices: Vec<Option<u32>>,
    /// For each triangle, where it comes from.
    pub sources: Vec<Source>,
    /// What was done.
    pub report: RepairReport,
}

/// What a repair did.
#[derive(Debug, Clone, Default)]
pub struct RepairReport {
    /// What was done before anything was cut.
    pub prepared: Prepared,
    /// Edge of the cells (m): the requested one, or a fraction of it if nothing would have been left.
    pub cell: f64,
    /// Cells in which the mesh was at fault.
    pub flagged_cells: usize,
    /// Cells that were rebuilt.
    pub rebuilt_cells: usize,
    /// Triangles of the input mesh that are still there, whole.
    pub kept_triangles: usize,
    /// Rebuild level reached: 0 the cells themselves, 1 with a ring around them, 2 the parts of the mesh that they touch, 3 everything.
    pub rebuild_level: usize,
    /// New triangles with an altitude below 4e-4 of their longest edge.
    pub slivers: usize,
    /// Losses of area, volume and extent.
    pub losses: Losses,
}

/// Maximum times that a set of cells grows by cells that cannot be cut.
const TRIES: usize = 32;
/// Maximum rounds of sliver removal.
const ROUNDS: usize = 4;
/// Memory (bytes) for the area of a cell's face: a mesh of that area pierces up to 1.7 edges of the grid, some 150 bytes each while they
/// are sorted.
const FACE: f64 = 256.0;
/// Number of cell sizes tried if nothing would be left: the requested one, then half of the previous one each time.
const HALVINGS: u32 = 6;

/// Repairs a mesh in cells with edges of `cell` (m): the solid is where, with each part turned outward, the winding number is over 0. Holes
/// are closed first. Broken parts are rebuilt within a cell of that solid; solids thinner than a cell may be lost where they are rebuilt.
///
/// # Errors
/// A mesh that is not valid, or too large for the cell; one that encloses nothing, or of which nearly all would be lost; more memory than
/// the context allows; cancel.
pub fn repair(ctx: &Context, mesh: &TriMesh, cell: f64) -> Result<Repaired> {
    mesh.validate()?;
    fail_if(!(cell > 0.0 && cell.is_finite()), || Error::argument(format!("cell = {cell} is not over 0 m")))?;
    let closed = ctx.phase("prepare", || Ok(prepare(mesh)))?;
    let mut lost = None;
    let area = closed.mesh.area();
    for halving in 0..HALVINGS {
        let cell = cell / f64::from(1u32 << halving);
        let allowed = allow(ctx, area, cell);
        if halving > 0 && allowed.is_err() {
            let what = format!(
                "nothing is left of the mesh in cells of {} m, and smaller ones need more memory than there is",
                2.0 * cell
            );
            return Err(Error::argument(what));
        }
        allowed?;
        let repaired = ctx.phase("rebuild", || rebuild(ctx, &closed, mesh.positions.len(), cell))?;
        if let Some(mut repaired) = repaired {
            let losses = Losses::of(mesh, &closed, &repaired.mesh);
            if !losses.is_nearly_all() {
                repaired.report.losses = losses;
                return Ok(repaired);
            }
            lost.get_or_insert_with(|| losses.refusal(cell));
        }
    }
    Err(Error::argument(lost.unwrap_or_else(|| "nothing in the mesh encloses a volume".into())))
}

/// Refuses cells (m) so small that there is not enough memory for all of those that a surface of an area (m2) passes through.
fn allow(ctx: &Context, area: f64, cell: f64) -> Result<()> {
    let needed = (area / (cell * cell) * FACE).min(1e18) as u64;
    ctx.allow(&format!("a repair with cells of {cell} m"), needed)
}

/// Tries the rebuild levels, for a mesh whose first `own` vertices are those of the input. None if nothing is left.
fn rebuild(ctx: &Context, closed: &Closed, own: usize, cell: f64) -> Result<Option<Repaired>> {
    let Some((low, high)) = closed.mesh.bounds() else { return Ok(None) };
    let lattice = Lattice::near(cell, (low.cast::<f64>() + high.cast::<f64>()) / 2.0)?;
    let mut in_cells = vec![DVec3::zeros(); closed.mesh.positions.len()];
    // Unused vertices may be anywhere.
    for &vertex in closed.mesh.triangles.as_flattened() {
        in_cells[vertex as usize] = lattice.to_cells(closed.mesh.positions[vertex as usize].cast());
    }
    let fixed = in_cells.iter().map(|position| lattice.fix(*position)).collect::<Result<Vec<_>>>()?;
    let pierces = Pierces::of(&fixed, &closed.mesh.triangles);
    let shape = Shape { fixed, triangles: closed.mesh.triangles.clone(), pierces };
    ctx.check()?;
    let flagged = region::faulty_cells::flagged(ctx, closed, &shape)?;
    let rebuilt = rebuild_by_levels(ctx, &shape, (&in_cells, &lattice), &flagged, &shape.pierces)?;
    if rebuilt.draft.triangles.is_empty() {
        return Ok(None);
    }
    let report = RepairReport {
        prepared: closed.prepared,
        cell,
        flagged_cells: flagged.count(),
        rebuilt_cells: rebuilt.cells,
        rebuild_level: rebuilt.rebuild_level,
        slivers: rebuilt.slivers,
        ..RepairReport::default()
    };
    Ok(Some(finished(rebuilt.draft, closed, own, &lattice, report)))
}

/// A mesh that was rebuilt in some cells.
pub(super) struct Rebuilt {
    /// Closed, and 2-manifold by index; its vertices begin with the mesh's own, whether they are still used or not.
    pub draft: Draft,
    /// Cells that were rebuilt.
    pub cells: usize,
    /// See [`RepairReport::rebuild_level`].
    pub rebuild_level: usize,
    /// See [`RepairReport::slivers`].
    pub slivers: usize,
}

/// Rebuilds a mesh, whose vertices have these positions (cells of the lattice), in the flagged cells and in as many more as it takes: one
/// rebuild level after the other, until the result is a closed 2-manifold.
///
/// # Errors
/// Cancel.
pub(super) fn rebuild_by_levels(
    ctx: &Context,
    shape: &Shape,
    (in_cells, lattice): (&[DVec3], &Lattice),
    flagged: &CellSet,
    inside: &impl Inside,
) -> Result<Rebuilt> {
    for rebuild_level in 0..4 {
        ctx.check()?;
        let set = match rebuild_level {
            0 => flagged.clone(),
            1 => flagged.with_ring(),
            2 => region::faulty_cells::with_parts(shape, flagged),
            _ => {
                let mut all = region::faulty_cells::all_cells(shape);
                flagged.iter().for_each(|cell| _ = all.add(cell));
                all
            }
        };
        let Some((mut draft, cells)) = rebuild_in(ctx, shape, set, in_cells, inside)? else { continue };
        let slivers = tidied(&mut draft, lattice);
        let is_whole = Topology::of(draft.positions.len(), &draft.triangles).is_watertight();
        if draft.triangles.is_empty() || (is_whole && (slivers == 0 || rebuild_level == 3)) {
            return Ok(Rebuilt { draft, cells, rebuild_level, slivers });
        }
    }
    Err(Error::Internal("a mesh could not be rebuilt".into()))
}

/// Removes slivers until none reappears when positions are rounded to the 32 bits that files have. Returns how many are left.
fn tidied(draft: &mut Draft, lattice: &Lattice) -> usize {
    let origin = DVec3::from(lattice.origin.map(f64::from));
    let mut slivers = usize::MAX;
    for _ in 0..ROUNDS {
        let made = draft.positions.iter_mut().zip(&draft.is_made).filter(|(_, is_made)| **is_made);
        let mut is_round = true;
        for (position, _) in made {
            let world: Vec3 = ((*position + origin) * lattice.voxel).cast();
            let round = world.cast::<f64>() / lattice.voxel - origin;
            is_round &= (round - *position).amax() < 1e-9;
            *position = round;
        }
        if is_round && slivers == 0 {
            break;
        }
        slivers = tidy::tidy(draft);
    }
    slivers
}

/// Cuts the mesh along a set of cells and fills these; the set grows where that fails. None if it fails however far the set grows.
fn rebuild_in(
    ctx: &Context,
    shape: &Shape,
    mut set: CellSet,
    in_cells: &[DVec3],
    inside: &impl Inside,
) -> Result<Option<(Draft, usize)>> {
    let mut added: Vec<Coord> = set.iter().collect();
    for _ in 0..TRIES {
        ctx.check()?;
        grow(&mut set, added, &shape.pierces, inside);
        match cut_and_fill(shape, &set, in_cells, inside) {
            Ok(draft) => return Ok(Some((draft, set.count()))),
            Err(Trouble(cells)) => {
                added = cells.iter().copied().filter(|cell| set.add(*cell)).collect();
                // If adding these cells changes nothing, those around them are added.
                if added.is_empty() {
                    let mut around = CellSet::default();
                    cells.iter().for_each(|cell| _ = around.add(*cell));
                    added = around.with_ring().iter().filter(|cell| set.add(*cell)).collect();
                }
                if added.is_empty() {
                    return Ok(None);
                }
            }
        }
    }
    Ok(None)
}

fn cut_and_fill(
    shape: &Shape,
    set: &CellSet,
    in_cells: &[DVec3],
    inside: &impl Inside,
) -> std::result::Result<Draft, Trouble> {
    let cut = shape.cut(set)?;
    let rim = Rim::of(&cut, set)?;
    let fill = fill(shape, set, inside, &rim)?;
    sewn(shape, in_cells, &cut, &fill)
}

/// The result, with the indices and positions of the input mesh.
fn finished(
    draft: Draft,
    closed: &Closed,
    own: usize,
    lattice: &Lattice,
    mut report: RepairReport,
) -> Repaired {
    let original = |source: &Source| match *source {
        Source::Whole(triangle) => closed.sources[triangle as usize].map_or(Source::New, Source::Whole),
        Source::Part(triangle) => closed.sources[triangle as usize].map_or(Source::New, Source::Part),
        Source::New => Source::New,
    };
    let sources: Vec<Source> = draft.sources.iter().map(original).collect();
    let origin = DVec3::from(lattice.origin.map(f64::from));
    let position = |(at, position): (usize, &DVec3)| match closed.mesh.positions.get(at) {
        Some(position) => *position,
        None => ((position + origin) * lattice.voxel).cast(),
    };
    let positions = draft.positions.iter().enumerate().map(position).collect();
    let mesh = TriMesh { positions, triangles: draft.triangles };
    let used = crate::geometry::mesh::used(mesh.positions.len(), &mesh.triangles);
    let kept: Vec<u32> = used.unwrap_or_else(|| (0..mesh.positions.len() as u32).collect());
    let original = |vertex: &u32| ((*vertex as usize) < own).then_some(*vertex);
    let vertices = kept.iter().map(original).collect();
    report.kept_triangles = sources.iter().filter(|source| matches!(source, Source::Whole(_))).count();
    Repaired { mesh: mesh.without_unused(), vertices, sources, report }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Pool;
    use crate::geometry::check::faults::Faults;
    use crate::geometry::test_meshes::{self, both};

    /// A sphere of 2048 triangles.
    fn sphere(centre: [f32; 3], radius: f32) -> TriMesh {
        let (unit_sphere, triangles) = test_meshes::sphere(4);
        let positions =
            unit_sphere.iter().map(|position| position.cast::<f32>() * radius + Vec3::from(centre)).collect();
        TriMesh { positions, triangles }
    }

    #[test]
    fn spheres_that_overlap_become_one_and_keep_what_they_had() {
        let ctx = Context::new(Pool::new(2).unwrap());
        let mesh = both(sphere([0.0; 3], 1.0), &sphere([1.2, 0.1, 0.05], 0.8));
        let repaired = repair(&ctx, &mesh, 0.06).unwrap();
        let faults = Faults::of(&repaired.mesh);
        assert!(faults.by_index.is_watertight() && faults.is_embedded(), "{faults:?}");
        assert_eq!(
            (faults.parts, faults.genus, repaired.report.rebuild_level),
            (1, Some(0), 0),
            "{:?}",
            repaired.report
        );
        assert!(repaired.report.kept_triangles > 2000, "{:?}", repaired.report);
        // The lens that both contained.
        let (d, a, b) = (1.205f64, 1.0, 0.8);
        let lens =
            std::f64::consts::PI * (a + b - d).powi(2) * (d * d + 2.0 * d * (a + b) - 3.0 * (a - b).powi(2))
                / (12.0 * d);
        let volume = mesh.volume() - lens;
        assert!((repaired.mesh.volume() / volume - 1.0).abs() < 3e-3, "{} {volume}", repaired.mesh.volume());
    }
}
