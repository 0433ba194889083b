//! The steps of a tracker, from one frame to the next.

use std::sync::Arc;

use rayon::prelude::*;

use super::Particles;
use super::level_set::band::Distances;
use super::level_set::implicit::Implicit;
use super::level_set::isosurface::Isosurface;
use super::level_set::sampler::Sampler;
use super::params::Params;
use super::particles::agreement::warn_of_lost_mesh;
use super::particles::paths::Paths;
use super::remesh::drift::Drift;
use super::remesh::sizes;
use super::report::StepReport;
use super::topology::coverage::Cover;
use super::topology::lost_vertices::move_lost_vertices;
use super::topology::particle_count::ParticleCountTest;
use super::topology::uncovered_parts::{MissingParts, Parts, UncoveredPart, Wanted};
use super::track::advect::{advect, validate_step};
use super::track::deep_detail::{Deep, covers, sorted};
use super::track::fade::fade;
use super::track::prefetch::Prefetch;
use super::track::project::foot;
use super::tracked_mesh::{REACH, Tracker};
use crate::context::Context;
use crate::error::{Error, Result, fail_if};
use crate::geometry::check::topology::Topology;
use crate::geometry::coords::cell_of;
use crate::geometry::{DVec3, TriMesh};

/// Reaches of the band (r) that are tried one after the other at the first frame, around vertices that have not found the surface.
const TRIES: [f64; 2] = [5.0, REACH[1]];

/// The band's reach covers the deltas of this fraction of the vertices, so that a spike does not widen the band everywhere.
const REACHED: f64 = 0.999;
/// If `REACHED` would need a reach above `WIDE` (r), the reach covers only the fraction `REACHED_IF_WIDE`, but is at least `WIDE`; around
/// the remaining vertices the band is widened locally.
const WIDE: f64 = 2.5;
const REACHED_IF_WIDE: f64 = 0.95;
/// Minimum displacement of a vertex by projection (r): anything less is rounding.
const STILL: f64 = 1e-5;
/// Minimum fraction of the vertices that must lie near the particles' surface at the first frame.
const OVERLAP: f64 = 0.5;

impl Tracker {
    /// Starts to track a mesh as it is at the first frame, in the particles' space.
    ///
    /// # Errors
    /// Parameters out of range; a mesh or particles that are not valid; over half of the vertices far from the particles' surface; a mesh
    /// to be rebuilt that is not closed and 2-manifold by index; cancel.
    pub fn new(ctx: &Context, params: Params, mesh: &TriMesh, particles: &Particles) -> Result<Self> {
        Ok(Self::begin(ctx, params, mesh, particles)?.0)
    }

    /// As [`Tracker::new`], with a report of the first frame: vertices too far from the particles' surface to keep a distance count as
    /// lost.
    ///
    /// # Errors
    /// As [`Tracker::new`].
    pub fn begin(
        ctx: &Context,
        params: Params,
        mesh: &TriMesh,
        particles: &Particles,
    ) -> Result<(Self, StepReport)> {
        params.validate()?;
        mesh.validate()?;
        particles.validate()?;
        fail_if(particles.positions.is_empty(), || Error::argument("there are no particles"))?;
        fail_if(
            params.rebuild && !Topology::of(mesh.positions.len(), &mesh.triangles).is_watertight(),
            || Error::argument("the mesh is not closed and 2-manifold by index, as it must be to be rebuilt"),
        )?;
        let vertices: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
        let mut tracker = Self::of(params, vertices, mesh.triangles.clone());
        tracker.flags = vec![false; mesh.positions.len()];
        if params.rebuild {
            tracker.sizes = sizes(&tracker.vertices, &mesh.triangles);
            tracker.drift = Drift::at_reference(mesh.positions.len());
        }
        let surface = ctx.phase("phi", || tracker.surface_of(ctx, particles))?;
        let (mut deep, mut tries) = (Deep::new(), TRIES.into_iter());
        loop {
            let distances = ctx.phase("distance", || tracker.distances(ctx, &surface, deep.clone()))?;
            let (delta, feet) = ctx.phase("measure", || Ok(tracker.measure(&distances)))?;
            tracker.delta = delta;
            let known = feet.iter().flatten().count();
            let wanted = tracker.required_reach();
            let farther = if known < tracker.delta.len() { tries.next() } else { None };
            let wider = tracker.deep(&tracker.vertices, farther.unwrap_or_default());
            if wanted <= tracker.reach && covers(&deep, &wider) {
                tracker.check_overlap(known)?;
                let Coverage { uncovered_parts, uncovered, .. } = ctx.phase("cover", || {
                    tracker.coverage(ctx, &surface, &feet, (&particles.positions, true))
                })?;
                tracker.never_covered = uncovered;
                let (lost, triangles) = (tracker.vertices.len() - known, surface.1.triangle_count());
                return Ok((
                    tracker,
                    StepReport { lost, triangles, uncovered_parts, ..StepReport::default() },
                ));
            }
            // Measured again with the wider band: later steps use it, and must find the same values.
            if wanted > tracker.reach {
                tracker.reach = wanted.max(1.25 * tracker.reach).min(REACH[1]);
            }
            deep = sorted([deep, wider].concat());
        }
    }

    fn check_overlap(&self, known: usize) -> Result<()> {
        let share = known as f64 / self.vertices.len() as f64;
        if share >= OVERLAP {
            return Ok(());
        }
        Err(Error::argument(format!(
            "only {:.0} % of the mesh lies within {} spacings (of {} m) of the particles' surface: are both in the same space and unit?",
            100.0 * share,
            REACH[1],
            self.params.spacing
        )))
    }

    /// Follows the particles from one frame to the next, `dt` (s) later. A step that fails or is cancelled leaves the mesh as it was.
    ///
    /// Either frame may have no particles. A mesh that is rebuilt then has no vertices, and gets its parts from the particles when these
    /// reappear; one that is not rebuilt stays where it was, with all of its vertices lost.
    ///
    /// # Errors
    /// A time that is not positive; particles that are not valid, or have neither ids nor velocities; if the mesh is rebuilt, vertices too
    /// far apart for the grid, or more memory than the context allows; cancel.
    pub fn step(&mut self, ctx: &Context, from: &Particles, to: &Particles, dt: f64) -> Result<StepReport> {
        validate_step(from, to, dt)?;
        if to.positions.is_empty() {
            return self.dry_up(ctx, from, dt);
        }
        let ((next, prefetch), phases) = ctx.step(10, || {
            let paths = Paths::between(from, to, dt)?;
            let (carried, parts) = ctx.phase("advect", || self.carried(ctx, &paths))?;
            let surface = match self.prefetch.ready(&to.positions) {
                Some(surface) => surface,
                None => Arc::new(ctx.phase("phi", || self.surface_of(ctx, to))?),
            };
            let distances =
                ctx.phase("distance", || self.distances(ctx, &surface, self.deep(&carried, 0.0)))?;
            let (mut next, projections) = self.projected_mesh(ctx, carried, dt, &distances)?;
            let feet: Vec<Option<DVec3>> = projections.iter().map(Projection::foot).collect();
            let mut coverage =
                ctx.phase("cover", || self.coverage(ctx, &surface, &feet, (&to.positions, false)))?;
            coverage.uncovered.iter_mut().zip(&self.never_covered).for_each(|(now, ever)| *now &= !ever);
            let is_flagged = |(projection, is_uncovered): (&Projection, &bool)| {
                projection.foot().is_none() || *is_uncovered
            };
            next.flags = projections.iter().zip(&coverage.uncovered).map(is_flagged).collect();
            let counts = self.counts(&projections, &coverage.uncovered, &paths);
            next.report = StepReport { parts, triangles: surface.1.triangle_count(), ..counts };
            let mut prefetch = Prefetch::default();
            if self.params.rebuild {
                let change = || {
                    self.changed_mesh(ctx, &next, &feet, &coverage, (&surface.0, &distances), &to.positions)
                };
                (next.report.change, prefetch) = self.with_next(ctx, change)?;
            }
            next.report.uncovered_parts = coverage.uncovered_parts;
            let lost = projections
                .iter()
                .zip(&self.delta)
                .filter(|(projection, delta)| projection.has_lost_surface(**delta))
                .count();
            warn_of_lost_mesh(
                &mut next.report,
                (lost, projections.len()),
                (from, to, dt),
                self.params.spacing,
            )?;
            Ok((next, prefetch))
        })?;
        self.prefetch = prefetch;
        Ok(StepReport { phases, ..self.adopt(next) })
    }

    /// The mesh after a step, before it is rebuilt: the carried vertices are projected. Also the result of the projection of each vertex.
    fn projected_mesh(
        &self,
        ctx: &Context,
        carried: Vec<DVec3>,
        dt: f64,
        distances: &Distances,
    ) -> Result<(Next, Vec<Projection>)> {
        let delta = fade(self, &carried, dt);
        // Strain is measured on the carried vertices: on a thin sheet projection moves them much farther than the particles jitter.
        let drifts = self.drift.after(&self.vertices, &carried);
        let (mut vertices, projections) =
            ctx.phase("project", || self.projected(ctx, carried, &delta, distances))?;
        if self.params.rebuild {
            let is_lost: Vec<bool> = projections
                .iter()
                .zip(&delta)
                .map(|(projection, delta)| projection.has_lost_surface(*delta))
                .collect();
            move_lost_vertices(&self.vertices, &self.triangles, &is_lost, &mut vertices);
        }
        Ok((Next { vertices, delta, drifts, ..Next::default() }, projections))
    }

    /// The counts of vertices and particles for the report of a step.
    fn counts(&self, projections: &[Projection], uncovered: &[bool], paths: &Paths) -> StepReport {
        let count = |projection: Projection| projections.iter().filter(|other| **other == projection).count();
        StepReport {
            jumped: count(Projection::Jumped),
            lost: count(Projection::Lost),
            uncovered: uncovered.iter().filter(|is| **is).count(),
            born: paths.born,
            died: paths.died,
            particle_warning: paths.mismatch.and_then(|mismatch| mismatch.sentence(self.params.spacing)),
            ..StepReport::default()
        }
    }

    /// Replaces the mesh by the one after a step; returns the report.
    fn adopt(&mut self, next: Next) -> StepReport {
        (self.vertices, self.delta, self.flags) = (next.vertices, next.delta, next.flags);
        self.drift.vertices = next.drifts;
        if let Some(change) = &next.report.change {
            self.apply_change(change);
        }
        if self.params.rebuild {
            let drifts = std::mem::take(&mut self.drift.vertices);
            self.drift = self.drift.next(drifts);
        }
        next.report
    }

    /// Prefetches the particles of the step after next: while the mesh is rebuilt, their surface is computed on idle threads. The results
    /// of steps are the same without it.
    pub fn prefetch(&mut self, particles: Arc<Particles>) {
        self.prefetch.wanted = Some(particles);
    }

    /// Drops the prefetched surface: for a tracker whose clone makes the next step instead.
    pub fn forget_prefetched(&mut self) {
        self.prefetch = Prefetch::default();
    }

    /// Runs `work`, and computes the surface of the coming particles at the same time.
    fn with_next<R>(&self, ctx: &Context, work: impl FnOnce() -> Result<R>) -> Result<(R, Prefetch)> {
        let wanted = self.prefetch.wanted.clone().filter(|_| ctx.pool().threads() > 1);
        std::thread::scope(|scope| {
            let surface_of = |particles: &Particles| ctx.pool().install(|| self.surface_of(ctx, particles));
            let making = wanted.as_ref().map(|particles| scope.spawn(move || surface_of(particles)));
            let done = work()?;
            let (Some(making), Some(particles)) = (making, &wanted) else {
                return Ok((done, Prefetch::default()));
            };
            let made = making.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            // An error here will occur again in that frame's own step, and is reported there.
            let ready = made.ok().map(|surface| (particles.clone(), Arc::new(surface)));
            Ok((done, Prefetch { wanted: None, ready }))
        })
    }

    /// The uncovered part of the particles' surface: whole connected parts, uncovered positions of the others, and the vertices beside
    /// these.
    fn coverage(
        &self,
        ctx: &Context,
        (phi, surface): &(Implicit, Isosurface),
        feet: &[Option<DVec3>],
        (particles, is_first): (&[DVec3], bool),
    ) -> Result<Coverage> {
        let parts = Parts::new(phi, surface, feet.iter().flatten().map(cell_of).collect());
        ctx.check()?;
        let spacing = 1.0 / self.params.cell;
        let cover = Cover { feet, triangles: &self.triangles, spacing, is_first };
        let (uncovered, positions) = cover.beside_uncovered(ctx, phi, surface, &parts)?;
        let min_bubble = if self.params.every { spacing.powi(3) } else { f64::INFINITY };
        let missing = match self.params.rebuild {
            true => parts.missing(
                phi,
                surface,
                &Wanted { particle_count: self.particle_count_test(particles), min_bubble },
            ),
            false => MissingParts::default(),
        };
        Ok(Coverage {
            uncovered_parts: parts.uncovered(phi, surface),
            uncovered,
            positions,
            reach: cover.reach(),
            missing,
        })
    }

    /// The test for the minimum count of particles in each part of the mesh, with particles at these positions.
    pub(super) fn particle_count_test<'a>(&self, positions: &'a [DVec3]) -> ParticleCountTest<'a> {
        ParticleCountTest { positions, spacing: self.params.spacing, min_count: self.params.min_drop.max(1) }
    }

    pub(super) fn carried(&self, ctx: &Context, paths: &Paths) -> Result<(Vec<DVec3>, usize)> {
        let mut vertices = self.vertices.clone();
        let parts = advect(ctx, &mut vertices, paths, self.params.spacing, self.params.weighting)?;
        Ok((vertices, parts))
    }

    pub(super) fn surface_of(&self, ctx: &Context, particles: &Particles) -> Result<(Implicit, Isosurface)> {
        let Params { spacing, cell, .. } = self.params;
        let phi = Implicit::new(ctx, &particles.positions, spacing, cell * spacing)?;
        let surface = Isosurface::new(&phi);
        Ok((phi, surface))
    }

    fn distances(&self, ctx: &Context, surface: &(Implicit, Isosurface), deep: Deep) -> Result<Distances> {
        Distances::with_deep_blocks(ctx, &surface.0, &surface.1, (self.reach / self.params.cell) as f32, deep)
    }

    /// Required reach of the band everywhere (r): see [`REACHED`] and [`WIDE`].
    fn required_reach(&self) -> f64 {
        let mut far: Vec<f32> =
            self.delta.iter().filter(|delta| !delta.is_nan()).map(|delta| delta.abs()).collect();
        if far.is_empty() {
            return REACH[0];
        }
        let mut of = |share: f64| {
            let position = ((far.len() - 1) as f64 * share) as usize;
            let far = *far.select_nth_unstable_by(position, f32::total_cmp).1;
            self.reach_for(f64::from(far) / self.params.spacing)
        };
        let reach = of(REACHED);
        if reach <= WIDE { reach } else { of(REACHED_IF_WIDE).max(WIDE) }
    }

    /// The distance of each vertex from the surface (m), and its foot (cells).
    fn measure(&self, distances: &Distances) -> (Vec<f32>, Vec<Option<DVec3>>) {
        let cell = distances.cell();
        let one = |sampler: &mut Sampler<'_>, position: &DVec3| match foot(sampler, position / cell) {
            Some(foot) => ((foot.distance * cell) as f32, Some(foot.position)),
            None => (f32::NAN, None),
        };
        let vertices = self.vertices.par_iter().with_min_len(1024);
        vertices.map_init(|| Sampler::new(distances), one).unzip()
    }

    /// Moves vertices (m) to their kept distance, unless that would move them too far.
    fn projected(
        &self,
        ctx: &Context,
        mut vertices: Vec<DVec3>,
        delta: &[f32],
        distances: &Distances,
    ) -> Result<(Vec<DVec3>, Vec<Projection>)> {
        let Params { spacing, change, .. } = self.params;
        let cell = distances.cell();
        let chunks = vertices.par_chunks_mut(1024).zip(delta.par_chunks(1024));
        let flags: Vec<Vec<Projection>> = chunks
            .map_init(
                || Sampler::new(distances),
                |sampler, (vertices, delta)| {
                    ctx.check()?;
                    let position = |(vertex, delta): (&mut DVec3, &f32)| {
                        let Some(foot) = foot(sampler, *vertex / cell).filter(|_| !delta.is_nan()) else {
                            return Projection::Lost;
                        };
                        let to = foot.at(f64::from(*delta) / cell) * cell;
                        let moved = (to - *vertex).norm() / spacing;
                        if moved > change {
                            return Projection::Jumped;
                        }
                        if moved > STILL {
                            *vertex = to;
                        }
                        Projection::Placed(foot.position)
                    };
                    Ok(vertices.iter_mut().zip(delta).map(position).collect())
                },
            )
            .collect::<Result<_>>()?;
        Ok((vertices, flags.into_iter().flatten().collect()))
    }
}

/// The mesh after a step, before it is rebuilt.
#[derive(Default)]
pub(super) struct Next {
    pub vertices: Vec<DVec3>,
    pub delta: Vec<f32>,
    pub flags: Vec<bool>,
    /// See [`Drift`].
    pub drifts: Vec<[f32; 3]>,
    pub report: StepReport,
}

/// The uncovered part of the particles' surface.
pub(super) struct Coverage {
    /// Connected parts on which no vertex has its foot.
    pub uncovered_parts: Vec<UncoveredPart>,
    /// Whether each vertex is beside an uncovered position of one of the other parts.
    pub uncovered: Vec<bool>,
    /// The uncovered positions of the other parts (cells).
    pub positions: Vec<DVec3>,
    /// Distance between a foot and an uncovered position up to which the vertex is beside it (cells).
    pub reach: f64,
    /// Uncovered parts that the mesh should cover.
    pub missing: MissingParts,
}

/// Result of projecting a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Projection {
    /// It was put at its distance from this foot (cells).
    Placed(DVec3),
    /// It would have been moved too far.
    Jumped,
    /// The surface was not found.
    Lost,
}

impl Projection {
    /// Whether a vertex that had a distance to keep has lost the surface.
    fn has_lost_surface(&self, delta: f32) -> bool {
        *self == Self::Lost && !delta.is_nan()
    }

    /// The foot of the vertex (cells); none if it could not be projected.
    fn foot(&self) -> Option<DVec3> {
        if let Self::Placed(foot) = self { Some(*foot) } else { None }
    }
}
