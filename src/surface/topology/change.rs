//! Changes the mesh where the liquid has merged or split: it is matched to the particles' surface (thesis 2.4) and rebuilt (2.5) in the
//! cells in which it no longer fits; elsewhere it stays as it is.

use super::hidden::Everywhere;
use super::mesh_distance::Gamma;
use super::particle_count::ParticleCountTest;
use crate::context::Context;
use crate::distance::lattice::Lattice;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::geometry::check::topology::around;
use crate::geometry::coords::{cell_of, cells_at, plus};
use crate::geometry::mesh::compact;
use crate::geometry::shape::normal;
use crate::mesh_repair::{CellSet, Pierces, Rebuilt, Shape, Source, ladder, overlaps};
use crate::surface::level_set::band::Distances;
use crate::surface::level_set::implicit::Implicit;
use crate::surface::level_set::sampler::Sampler;
use crate::surface::remesh::{Improvable, Improvements, Size, improve};
use crate::surface::track::project::foot;

/// A mesh, and where it no longer fits.
pub struct Unfit<'a> {
    /// Positions of vertices (m).
    pub vertices: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    /// Vertices whose triangles are rebuilt.
    pub flags: &'a [bool],
    /// Positions of the particles' surface that the mesh should cover, and does not (cells).
    pub bare: &'a [DVec3],
    /// Data for finding all other cells in which it does not fit; none: these are not searched for.
    pub everywhere: Option<Everywhere<'a>>,
}

/// A changed mesh.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// Positions of vertices (m): those that stayed, in their order, then new ones.
    pub vertices: Vec<DVec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex, its vertex before the change; none: it is new.
    pub origins: Vec<Option<u32>>,
    /// For each triangle, where it comes from.
    pub sources: Vec<Source>,
    /// Positions (m), after the step's motion, of the vertices that existed before the change. For several steps combined, those of the
    /// first step that changed the mesh.
    pub before: Vec<DVec3>,
    /// For each new vertex, its signed distance from the particles' surface (m); after several steps, in the last.
    pub delta: Vec<f32>,
    /// For each vertex, the lengths (m) of the shortest and of the longest edge around it at its birth.
    pub sizes: Vec<[f32; 2]>,
    /// For each vertex, its displacement (m) since the reference of [`crate::surface::Tracker`], by which edges at rest are recognised.
    pub drifts: Vec<[f32; 3]>,
    /// Counts of improvements; after several steps, of the last.
    pub improvements: Improvements,
    /// Count of parts without particles that were removed.
    pub dry: usize,
    /// Count of parts with some particles, but fewer than [`crate::surface::Params::min_drop`], that were removed.
    pub specks: usize,
    /// Cells in which the mesh did not fit.
    pub flagged_cells: usize,
    /// Cells that were rebuilt.
    pub rebuilt_cells: usize,
    /// Rebuild level: how much was rebuilt beyond those cells and what they need: 0 nothing, 1 a ring around them, 2 whole parts, 3
    /// everything.
    pub rung: usize,
    /// Iterations of the matching.
    pub iterations: usize,
}

/// Maximum change of lengths where particles only jitter (spacings).
const TREMBLE: f64 = 0.01;
/// Where the mesh has passed through itself by less than this (cells) it is left alone: mending would lose more of it than that is worth.
const DEEP: f64 = 0.25;
/// Lengths of the shortest and of the longest edge around a new vertex (cells).
const BORN: [f64; 2] = [1.0, 1.0];

impl Change {
    /// The change of a mesh that is removed entirely.
    pub(in crate::surface) fn to_nothing(unfit: &Unfit<'_>) -> Self {
        Self { before: unfit.vertices.to_vec(), ..Self::default() }
    }

    /// The change of a mesh that stays as it is.
    fn nothing(unfit: &Unfit<'_>) -> Self {
        Self {
            vertices: unfit.vertices.to_vec(),
            triangles: unfit.triangles.to_vec(),
            origins: (0..unfit.vertices.len() as u32).map(Some).collect(),
            sources: (0..unfit.triangles.len() as u32).map(Source::Whole).collect(),
            ..Self::to_nothing(unfit)
        }
    }

    /// The change of a mesh of which cells were rebuilt.
    fn of(unfit: &Unfit<'_>, Rebuilt { draft, cells, rung, .. }: Rebuilt, lattice: &Lattice) -> Self {
        let own = unfit.vertices.len();
        let (names, triangles) = compact(draft.positions.len(), &draft.triangles);
        let origin = DVec3::from(lattice.origin.map(f64::from));
        let position = |name: &u32| match unfit.vertices.get(*name as usize) {
            Some(position) => *position,
            None => (draft.positions[*name as usize] + origin) * lattice.voxel,
        };
        Self {
            vertices: names.iter().map(position).collect(),
            triangles,
            origins: names.iter().map(|name| ((*name as usize) < own).then_some(*name)).collect(),
            sources: draft.sources,
            rebuilt_cells: cells,
            rung,
            ..Self::to_nothing(unfit)
        }
    }

    /// Carries shares (0..=1) over from the vertices before the change to those after it. A new vertex gets the mean of its neighbours that
    /// stayed, 0 if there are none.
    pub(in crate::surface) fn carried_shares(&self, values: &[f32]) -> Vec<f32> {
        let old = |vertex: u32| self.origins[vertex as usize].map(|at| values[at as usize]);
        let sums: Vec<(f32, u32)> = around(self.origins.len(), &self.triangles, old);
        let mean = |(vertex, (sum, count)): (u32, (f32, u32))| {
            old(vertex).unwrap_or(if count > 0 { (sum / count as f32).clamp(0.0, 1.0) } else { 0.0 })
        };
        (0..).zip(sums).map(mean).collect()
    }

    /// Count of triangles that are not unchanged old ones: new ones, and parts of old ones.
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
        self.rung = self.rung.max(first.rung);
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
pub fn change(
    ctx: &Context,
    unfit: &Unfit<'_>,
    phi: &Implicit,
    distances: &Distances,
) -> Result<Option<Change>> {
    let cell = distances.cell();
    let Some(first) = unfit.vertices.first().copied().or_else(|| Some(unfit.bare.first()? * cell)) else {
        return Ok(None);
    };
    let low = unfit.vertices.iter().fold(first, |low, position| low.inf(position));
    let high = unfit.vertices.iter().fold(first, |high, position| high.sup(position));
    let lattice = Lattice::near(cell, 0.5 * (low + high))?;
    let in_cells: Vec<DVec3> = unfit.vertices.iter().map(|position| lattice.to_cells(*position)).collect();
    let (shape, flagged) =
        ctx.phase("flag", || surveyed(ctx, unfit, (&in_cells, &lattice), (phi, distances)))?;
    if flagged.count() == 0 {
        return Ok(None);
    }
    let gamma =
        ctx.phase("match", || Gamma::matched(ctx, &shape, &in_cells, &lattice, &flagged, (phi, distances)))?;
    let mut set = flagged.clone();
    for node in gamma.turned() {
        cells_at(node).into_iter().for_each(|cell| _ = set.add(cell));
    }
    let rebuilt = ctx.phase("rebuild", || ladder(ctx, &shape, (&in_cells, &lattice), &set, &gamma))?;
    let (flagged_cells, iterations) = (flagged.count(), gamma.iterations);
    Ok(Some(Change { flagged_cells, iterations, ..Change::of(unfit, rebuilt, &lattice) }))
}

/// A mesh in the grid, at these positions (cells), and the cells in which it does not fit.
fn surveyed(
    ctx: &Context,
    unfit: &Unfit<'_>,
    (in_cells, lattice): (&[DVec3], &Lattice),
    (phi, distances): (&Implicit, &Distances),
) -> Result<(Shape, CellSet)> {
    let fixed = in_cells.iter().map(|position| lattice.fix(*position)).collect::<Result<Vec<_>>>()?;
    // Some 100 bytes for each edge of the grid that the mesh pierces: up to 1.7 edges for each cell face's worth of its area.
    let area = |names: &[u32; 3]| normal(&names.map(|name| in_cells[name as usize])).norm() / 2.0;
    let faces: f64 = unfit.triangles.iter().map(area).sum();
    ctx.allow("the mesh's cells (larger ones need less)", (170.0 * faces).min(1e18) as u64)?;
    let pierces = Pierces::of(&fixed, unfit.triangles);
    let shape = Shape { fixed, triangles: unfit.triangles.to_vec(), pierces };
    ctx.check()?;
    let mut flagged = flagged(unfit, &shape, lattice);
    if let Some(everywhere) = &unfit.everywhere {
        everywhere.flag(ctx, &shape, (in_cells, lattice), (phi, distances), &mut flagged)?;
    }
    Ok((shape, flagged))
}

/// Removes parts with too few particles, improves a mesh (thesis 2.6), including where it was changed, and measures the new vertices.
/// `sizes`, and `drifts` up to now, are those of the mesh before the change; new vertices keep a distance of at most `most` (m): anything
/// farther from the particles' surface is no detail, and is moved there, or rebuilt again, in the next frame. None if nothing has changed.
///
/// # Errors
/// Cancel.
pub fn improved(
    ctx: &Context,
    unfit: &Unfit<'_>,
    (sizes, drifts): (&[Size], &[[f32; 3]]),
    change: Option<Change>,
    distances: &Distances,
    crowd: &ParticleCountTest<'_>,
    most: f64,
) -> Result<Option<Change>> {
    let mut is_changed = change.is_some();
    let cell = distances.cell();
    let mut change = change.unwrap_or_else(|| Change::nothing(unfit));
    [change.dry, change.specks] = ctx.phase("dry", || Ok(change.drop_dry(crowd)))?;
    is_changed |= change.dry + change.specks > 0;
    let born = BORN.map(|share| (share * cell) as f32);
    change.sizes = change.origins.iter().map(|at| at.map_or(born, |at| sizes[at as usize])).collect();
    change.drifts = change.origins.iter().map(|at| at.map_or([0.0; 3], |at| drifts[at as usize])).collect();
    let mut flags: Vec<bool> =
        change.origins.iter().map(|at| at.is_some_and(|at| unfit.flags[at as usize])).collect();
    let mut mesh = Improvable {
        positions: &mut change.vertices,
        triangles: &mut change.triangles,
        sizes: &mut change.sizes,
        drifts: &mut change.drifts,
        origins: &mut change.origins,
        sources: &mut change.sources,
        flags: &mut flags,
        tremble: TREMBLE * crowd.spacing,
    };
    change.improvements = ctx.phase("improve", || improve(ctx, &mut mesh))?;
    if !is_changed && change.improvements == Improvements::default() {
        return Ok(None);
    }
    let mut sampler = Sampler::new(distances);
    let made = change.vertices.iter().zip(&change.origins).filter(|(_, origin)| origin.is_none());
    let mut distance = |position: DVec3| match foot(&mut sampler, position) {
        Some(foot) => foot.distance,
        None => sampler.at(position).map_or(0.0, |(distance, _)| f64::from(distance)),
    };
    change.delta =
        made.map(|(position, _)| (distance(*position / cell) * cell).clamp(-most, most) as f32).collect();
    Ok(Some(change))
}

/// The cells in which the mesh does not fit: those of triangles around flagged vertices, those of the positions that it should cover, and
/// those in which it has passed through itself.
fn flagged(unfit: &Unfit<'_>, shape: &Shape, lattice: &Lattice) -> CellSet {
    let mut set = CellSet::default();
    for (triangle, names) in (0..).zip(unfit.triangles) {
        if names.iter().any(|name| unfit.flags[*name as usize]) {
            shape.cells_of(triangle).into_iter().for_each(|cell| _ = set.add(cell));
        }
    }
    for position in unfit.bare {
        set.add(plus(cell_of(position), lattice.origin.map(|at| -at)));
    }
    overlaps(shape, DEEP, &mut set);
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
