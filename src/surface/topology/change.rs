//! The change of a mesh in a step. Where the liquid has merged or split, the mesh is matched to the particles' surface (thesis 2.4) and
//! rebuilt (2.5) in the cells in which it no longer fits; then it is improved (2.6).

use super::full_check::FullCheck;
use super::mesh_distance::Gamma;
use super::particle_count::ParticleCountTest;
use crate::context::Context;
use crate::distance::lattice::Lattice;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::geometry::check::topology::neighbour_sums;
use crate::geometry::coords::{cell_of, cells_at, plus};
use crate::geometry::mesh::compact;
use crate::geometry::shape::normal;
use crate::mesh_repair::{CellSet, Pierces, Rebuilt, Shape, Source, add_overlaps, rebuild_by_levels};
use crate::surface::level_set::band::Distances;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::sampler::Sampler;
use crate::surface::remesh::{Improvable, Improvements, Size, improve};
use crate::surface::track::project::foot;

/// A mesh after projection, and where it no longer fits its liquid.
pub struct FlaggedMesh<'a> {
    /// Positions of vertices (m).
    pub vertices: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    /// Vertices whose triangles are rebuilt.
    pub flags: &'a [bool],
    /// Uncovered positions of the particles' surface that the mesh should cover (cells).
    pub uncovered: &'a [DVec3],
    /// The check for all other cells in which the mesh does not fit; none: no check.
    pub full_check: Option<FullCheck<'a>>,
}

/// A changed mesh.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Positions of vertices (m): those that stayed, in their order, then new ones.
    pub vertices: Vec<DVec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex, its index before the change; none: it is new.
    pub origins: Vec<Option<u32>>,
    /// For each triangle, where it comes from.
    pub sources: Vec<Source>,
    /// Positions (m), after the step's motion, of the vertices that existed before the change. For several steps combined, those of the
    /// first step that changed the mesh.
    pub before: Vec<DVec3>,
    /// For each new vertex, its signed distance from the particles' surface (m). For several steps combined, those of the last.
    pub delta: Vec<f32>,
    /// For each vertex, the lengths (m) of the shortest and of the longest edge around it at its birth.
    pub sizes: Vec<[f32; 2]>,
    /// For each vertex, its displacement (m) since a reference step of [`crate::surface::Tracker`], by which edges at rest are recognised.
    pub drifts: Vec<[f32; 3]>,
    /// Counts of improvements. For several steps combined, those of the last.
    pub improvements: Improvements,
    /// Count of parts without particles that were removed.
    pub dry: usize,
    /// Count of parts with some particles, but fewer than [`crate::surface::Params::min_drop`], that were removed.
    pub specks: usize,
    /// Cells in which the mesh did not fit.
    pub flagged_cells: usize,
    /// Cells that were rebuilt.
    pub rebuilt_cells: usize,
    /// How much was rebuilt beyond the flagged cells and those that must be rebuilt with them: 0 nothing, 1 a ring of cells around, 2 the
    /// affected parts of the mesh, 3 everything.
    pub rebuild_level: usize,
    /// Iterations of the matching.
    pub iterations: usize,
}

/// Maximum change of lengths where particles only jitter (spacings).
const JITTER: f64 = 0.01;
/// Overlaps of the mesh with itself that are shallower than this (cells) are left alone: rebuilding would lose more detail than it gains.
const MIN_OVERLAP: f64 = 0.25;
/// Lengths of the shortest and of the longest edge around a new vertex (cells).
const NEW_SIZE: [f64; 2] = [1.0, 1.0];

impl Change {
    /// The change of a mesh that is removed entirely.
    pub(in crate::surface) fn to_nothing(mesh: &FlaggedMesh<'_>) -> Self {
        Self { before: mesh.vertices.to_vec(), ..Self::default() }
    }

    /// The change of a mesh that stays as it is.
    fn nothing(mesh: &FlaggedMesh<'_>) -> Self {
        Self {
            vertices: mesh.vertices.to_vec(),
            triangles: mesh.triangles.to_vec(),
            origins: (0..mesh.vertices.len() as u32).map(Some).collect(),
            sources: (0..mesh.triangles.len() as u32).map(Source::Whole).collect(),
            ..Self::to_nothing(mesh)
        }
    }

    /// The change of a mesh that was rebuilt in some cells.
    fn of(
        mesh: &FlaggedMesh<'_>,
        Rebuilt { draft, cells, rebuild_level, .. }: Rebuilt,
        lattice: &Lattice,
    ) -> Self {
        let own = mesh.vertices.len();
        let (kept, triangles) = compact(draft.positions.len(), &draft.triangles);
        let origin = DVec3::from(lattice.origin.map(f64::from));
        let position = |index: &u32| match mesh.vertices.get(*index as usize) {
            Some(position) => *position,
            None => (draft.positions[*index as usize] + origin) * lattice.voxel,
        };
        Self {
            vertices: kept.iter().map(position).collect(),
            triangles,
            origins: kept.iter().map(|index| ((*index as usize) < own).then_some(*index)).collect(),
            sources: draft.sources,
            rebuilt_cells: cells,
            rebuild_level,
            ..Self::to_nothing(mesh)
        }
    }

    /// Carries shares (0..=1) over from the vertices before the change to those after it. A new vertex gets the mean of its neighbours that
    /// stayed, 0 if there are none.
    pub(in crate::surface) fn carried_shares(&self, values: &[f32]) -> Vec<f32> {
        let old = |vertex: u32| self.origins[vertex as usize].map(|at| values[at as usize]);
        let sums: Vec<(f32, u32)> = neighbour_sums(self.origins.len(), &self.triangles, old);
        let mean = |(vertex, (sum, count)): (u32, (f32, u32))| {
            old(vertex).unwrap_or(if count > 0 { (sum / count as f32).clamp(0.0, 1.0) } else { 0.0 })
        };
        (0..).zip(sums).map(mean).collect()
    }

    /// Count of new triangles, and of parts of cut ones.
    pub fn made_triangles(&self) -> usize {
        self.sources.iter().filter(|source| !matches!(source, Source::Whole(_))).count()
    }

    /// Count of triangles that are neither triangles of the previous mesh nor parts of one.
    pub(in crate::surface) fn rebuilt_triangles(&self) -> usize {
        self.sources.iter().filter(|source| **source == Source::New).count()
    }

    /// The combination of two successive changes.
    pub fn after(mut self, first: &Self) -> Self {
        self.origins.iter_mut().for_each(|at| *at = at.and_then(|at| first.origins[at as usize]));
        self.sources.iter_mut().for_each(|source| *source = source.after(&first.sources));
        self.flagged_cells += first.flagged_cells;
        self.rebuilt_cells += first.rebuilt_cells;
        self.rebuild_level = self.rebuild_level.max(first.rebuild_level);
        self.before.clone_from(&first.before);
        self.iterations += first.iterations;
        self.dry += first.dry;
        self.specks += first.specks;
        self
    }
}

/// Rebuilds a closed mesh where it no longer fits. None if it fits everywhere.
///
/// # Errors
/// Vertices too far apart for the grid; more memory than the context allows; cancel.
pub fn rebuild(
    ctx: &Context,
    mesh: &FlaggedMesh<'_>,
    phi: &Implicit,
    distances: &Distances,
) -> Result<Option<Change>> {
    let cell = distances.cell();
    let Some(first) = mesh.vertices.first().copied().or_else(|| Some(mesh.uncovered.first()? * cell)) else {
        return Ok(None);
    };
    let low = mesh.vertices.iter().fold(first, |low, position| low.inf(position));
    let high = mesh.vertices.iter().fold(first, |high, position| high.sup(position));
    let lattice = Lattice::near(cell, 0.5 * (low + high))?;
    let in_cells: Vec<DVec3> = mesh.vertices.iter().map(|position| lattice.to_cells(*position)).collect();
    let (shape, flagged) =
        ctx.phase("flag", || find_unfit_cells(ctx, mesh, (&in_cells, &lattice), (phi, distances)))?;
    if flagged.count() == 0 {
        return Ok(None);
    }
    let gamma =
        ctx.phase("match", || Gamma::matched(ctx, &shape, &in_cells, &lattice, &flagged, (phi, distances)))?;
    let mut set = flagged.clone();
    for node in gamma.nodes_that_changed_sides() {
        cells_at(node).into_iter().for_each(|cell| _ = set.add(cell));
    }
    let rebuilt =
        ctx.phase("rebuild", || rebuild_by_levels(ctx, &shape, (&in_cells, &lattice), &set, &gamma))?;
    let (flagged_cells, iterations) = (flagged.count(), gamma.iterations);
    Ok(Some(Change { flagged_cells, iterations, ..Change::of(mesh, rebuilt, &lattice) }))
}

/// The mesh in the grid, with vertices at these positions (cells), and the cells in which it does not fit.
fn find_unfit_cells(
    ctx: &Context,
    mesh: &FlaggedMesh<'_>,
    (in_cells, lattice): (&[DVec3], &Lattice),
    (phi, distances): (&Implicit, &Distances),
) -> Result<(Shape, CellSet)> {
    let fixed = in_cells.iter().map(|position| lattice.fix(*position)).collect::<Result<Vec<_>>>()?;
    // Some 100 bytes for each edge of the grid that the mesh pierces: up to 1.7 edges per area of a cell's face.
    let area = |corners: &[u32; 3]| normal(&corners.map(|corner| in_cells[corner as usize])).norm() / 2.0;
    let faces: f64 = mesh.triangles.iter().map(area).sum();
    ctx.allow("the mesh's cells (larger ones need less)", (170.0 * faces).min(1e18) as u64)?;
    let pierces = Pierces::of(&fixed, mesh.triangles);
    let shape = Shape { fixed, triangles: mesh.triangles.to_vec(), pierces };
    ctx.check()?;
    let mut flagged = cells_to_rebuild(mesh, &shape, lattice);
    if let Some(full_check) = &mesh.full_check {
        full_check.flag(ctx, &shape, (in_cells, lattice), (phi, distances), &mut flagged)?;
    }
    Ok((shape, flagged))
}

/// Finishes a change, or the unchanged mesh: removes parts with too few particles, improves the mesh (thesis 2.6), and measures the deltas
/// of new vertices. `sizes` and `drifts` are those of the vertices before the change. Deltas of new vertices are clamped to `max_delta`
/// (m): anything farther from the particles' surface is no detail; the next frame moves it nearer, or rebuilds it. None if nothing has
/// changed.
///
/// # Errors
/// Cancel.
pub fn finish(
    ctx: &Context,
    mesh: &FlaggedMesh<'_>,
    (sizes, drifts): (&[Size], &[[f32; 3]]),
    change: Option<Change>,
    distances: &Distances,
    particle_count: &ParticleCountTest<'_>,
    max_delta: f64,
) -> Result<Option<Change>> {
    let mut is_changed = change.is_some();
    let cell = distances.cell();
    let mut change = change.unwrap_or_else(|| Change::nothing(mesh));
    [change.dry, change.specks] = ctx.phase("dry", || Ok(change.drop_dry(particle_count)))?;
    is_changed |= change.dry + change.specks > 0;
    let new_size = NEW_SIZE.map(|share| (share * cell) as f32);
    change.sizes = change.origins.iter().map(|at| at.map_or(new_size, |at| sizes[at as usize])).collect();
    change.drifts = change.origins.iter().map(|at| at.map_or([0.0; 3], |at| drifts[at as usize])).collect();
    let mut flags: Vec<bool> =
        change.origins.iter().map(|at| at.is_some_and(|at| mesh.flags[at as usize])).collect();
    let mut improvable = Improvable {
        positions: &mut change.vertices,
        triangles: &mut change.triangles,
        sizes: &mut change.sizes,
        drifts: &mut change.drifts,
        origins: &mut change.origins,
        sources: &mut change.sources,
        flags: &mut flags,
        jitter: JITTER * particle_count.spacing,
    };
    change.improvements = ctx.phase("improve", || improve(ctx, &mut improvable))?;
    if !is_changed && change.improvements == Improvements::default() {
        return Ok(None);
    }
    let mut sampler = Sampler::new(distances);
    let new_vertices = change.vertices.iter().zip(&change.origins).filter(|(_, origin)| origin.is_none());
    let mut distance = |position: DVec3| match foot(&mut sampler, position) {
        Some(foot) => foot.distance,
        None => sampler.at(position).map_or(0.0, |(distance, _)| f64::from(distance)),
    };
    change.delta = new_vertices
        .map(|(position, _)| (distance(*position / cell) * cell).clamp(-max_delta, max_delta) as f32)
        .collect();
    Ok(Some(change))
}

/// The cells with triangles around flagged vertices, those with positions that the mesh should cover, and those in which it has passed
/// through itself.
fn cells_to_rebuild(mesh: &FlaggedMesh<'_>, shape: &Shape, lattice: &Lattice) -> CellSet {
    let mut set = CellSet::default();
    for (triangle, corners) in (0..).zip(mesh.triangles) {
        if corners.iter().any(|corner| mesh.flags[*corner as usize]) {
            shape.cells_of(triangle).into_iter().for_each(|cell| _ = set.add(cell));
        }
    }
    for position in mesh.uncovered {
        set.add(plus(cell_of(position), lattice.origin.map(|at| -at)));
    }
    add_overlaps(shape, MIN_OVERLAP, &mut set);
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::check::faults::Faults;
    use crate::surface::test_particles::{context, rebuilt, two_balls};

    #[test]
    fn two_balls_become_one_and_part_again() {
        let ctx = context(2);
        // The balls approach for 24 frames until they overlap, and then part again.
        let away = |frame: i32| 9.0 - 0.25 * f64::from(if frame < 24 { frame } else { 48 - frame });
        let at = |frame: i32| two_balls(5.5, DVec3::new(away(frame), 0.1, 0.2));
        let mut from = at(0);
        let mut tracker = rebuilt(&ctx, &from);
        let mut parts = Vec::new();
        for frame in 1..=48 {
            let to = at(frame);
            tracker.step(&ctx, &from, &to, 1.0 / 24.0).unwrap();
            from = to;
            let faults = Faults::of(&tracker.mesh());
            assert!(faults.by_index.is_watertight(), "{frame}: {faults:?}");
            parts.push(faults.parts);
        }
        assert!(parts.contains(&1) && parts[0] == 2 && parts[47] == 2, "{parts:?}");
    }
}
