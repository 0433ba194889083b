//! The mesh from frame to frame: it steps with the liquid, keeps its arrays through changes, and is replaced by an edited mesh if there is
//! one. Some frames are computed ahead, for velocities and to ease vertices towards coming changes.

use std::cmp::Ordering;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use super::frame_report::report_of;
use super::saved_arrays::SavedMesh;
use super::vertex_paths::{VertexPaths, VertexVelocities};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::deviation::NearestTree;
use crate::geometry::{DVec3, DetailedMesh, TriMesh, Vec3};
use crate::io::usd;
use crate::mesh_repair::{Traced, carry_attributes};
use crate::scene::run::{Reads, Report};
use crate::scene::surface::inputs::particle_times::Liquid;
use crate::scene::surface::inputs::sculpts::{path_at, read_sculpt};
use crate::scene::surface::{Inputs, Surface};
use crate::scene::{Frames, Scene};
use crate::surface::{
    Change, Displaced, Eased, EasingTargets, Params, Particles, Rest, StepReport, TOO_FAR, Tracker,
    displaced, eased, uncrossed,
};

/// A scene's liquid, and the mesh that follows it.
pub struct TrackedShot<'a> {
    scene: &'a Scene,
    surface: &'a Surface,
    inputs: &'a Inputs,
    liquid: Liquid<'a>,
    /// The current frame: the first of `frames`.
    frame: i32,
    /// The current frame, and the following ones that were computed ahead.
    frames: VecDeque<TrackedFrame>,
    /// The first frame that could not be computed ahead because of an error.
    end: Option<i32>,
    /// Whether warnings about the particles were logged.
    has_warned: bool,
}

/// A mesh made by an artist: that of the first frame, or an edited one.
#[derive(Clone)]
pub(in crate::scene::surface) struct Source {
    /// The frame, if it is an edited mesh.
    pub sculpted: Option<i32>,
    mesh: Arc<DetailedMesh>,
    /// The particles at its frame and a tree of its triangles, if the particles have ids and the mesh carries data and may be rebuilt.
    rest: Option<Arc<(Rest, NearestTree)>>,
}

/// The mesh at a frame, with the step that led there.
pub struct TrackedFrame {
    pub tracker: Tracker,
    /// The data that it carries; `None`: those of the first mesh.
    pub detail: Option<Arc<DetailedMesh>>,
    /// The frame's report.
    pub report: Report,
    velocities: VertexVelocities,
    easing: EasingTargets,
    pub(in crate::scene::surface) source: Source,
    /// Whether the frame has no particles: its files then hold no mesh.
    pub(in crate::scene::surface) is_dry: bool,
}

impl TrackedFrame {
    /// A frame that no step led to, with the data of the first mesh.
    fn new(tracker: Tracker, source: Source, report: Report) -> Self {
        let (velocities, easing) = (VertexVelocities::default(), EasingTargets::default());
        Self { tracker, detail: None, report, velocities, easing, source, is_dry: false }
    }
}

impl<'a> TrackedShot<'a> {
    /// The mesh at the first frame; none if that has no particles.
    ///
    /// # Errors
    /// A mesh that is not near the first particles, and anything that a tracker refuses; cancel.
    pub fn begin(ctx: &Context, scene: &'a Scene, surface: &'a Surface, inputs: &'a Inputs) -> Result<Self> {
        let first = scene.shot.frames.first;
        // Even if particles appear later: a mesh that does not match them is refused before anything is written.
        let begun = first_mesh(ctx, surface, inputs)?;
        let tracked = if inputs.begins == first { begun } else { without_mesh(surface, inputs)? };
        Ok(Self::new((scene, surface, inputs), first, tracked))
    }

    /// Resumes from a mesh saved at a frame.
    ///
    /// # Errors
    /// Particles or an edited mesh that can no longer be read.
    pub fn resume(
        ctx: &Context,
        context @ (_, surface, inputs): (&'a Scene, &'a Surface, &'a Inputs),
        frame: i32,
        SavedMesh { mut tracker, detail, sculpted }: SavedMesh,
    ) -> Result<Self> {
        if !tracker.is_rebuilt() {
            let result = tracker.set_detail_retention(inputs.detail_retention.clone());
            result.map_err(|error| in_first_file(surface, error))?;
        }
        let detail = detail.map(|detail| {
            let triangles = tracker.triangles().to_vec();
            Arc::new(DetailedMesh { mesh: TriMesh { positions: Vec::new(), triangles }, ..detail })
        });
        let source = Source::of(ctx, surface.rebuild, None, inputs.mesh.clone(), &inputs.particles);
        // The frame's files and report exist: this report is not used.
        let tracked = TrackedFrame { detail, ..TrackedFrame::new(tracker, source, Report::default()) };
        let mut shot = Self::new(context, frame, tracked);
        if let Some(sculpted) = sculpted {
            let source = match read_sculpt(ctx, surface, inputs, sculpted)? {
                Some(sculpt) => {
                    let particles = shot.liquid.at(surface.time(shot.scene.shot.frames, sculpted))?;
                    Source::of(ctx, surface.rebuild, Some(sculpted), Arc::new(sculpt.mesh), &particles)
                }
                None => {
                    log::warn!(
                        "the edited mesh of frame {sculpted} is gone: new triangles take their texture from the mesh beside them"
                    );
                    Source { sculpted: Some(sculpted), rest: None, ..shot.current().source.clone() }
                }
            };
            shot.frames[0].source = source;
        }
        Ok(shot)
    }

    fn new(
        (scene, surface, inputs): (&'a Scene, &'a Surface, &'a Inputs),
        frame: i32,
        tracked: TrackedFrame,
    ) -> Self {
        let (liquid, frames) =
            (Liquid::new(surface, scene.shot, &inputs.input_hashes), VecDeque::from([tracked]));
        Self { scene, surface, inputs, liquid, frame, frames, end: None, has_warned: false }
    }

    /// Advances to a frame, and computes as many frames ahead as it depends on.
    ///
    /// # Errors
    /// Files that cannot be read; errors of a step; cancel.
    pub fn advance_to(&mut self, ctx: &Context, frame: i32) -> Result<()> {
        while self.frame < frame {
            if self.frames.len() == 1 {
                let next = self.next(ctx, self.frame + 1)?;
                self.frames.push_back(next);
            }
            self.frames.pop_front();
            self.frame += 1;
        }
        for coming in frame + self.frames.len() as i32..=frame + self.surface.frames_ahead() {
            match self.look_ahead(ctx, coming)? {
                Some(next) => self.frames.push_back(next),
                None => break,
            }
        }
        Ok(())
    }

    /// The mesh at the current frame.
    pub fn current(&self) -> &TrackedFrame {
        &self.frames[0]
    }

    /// Positions (m) of the current vertices for output: those that a coming change will remove are already eased towards its result. Also
    /// returns their velocities (m/s) to the next frame, or from the previous one if the next is not known.
    ///
    /// # Errors
    /// Cancel.
    pub fn output_vertices(&self, ctx: &Context) -> Result<(Vec<DVec3>, Vec<Vec3>)> {
        let current = self.current();
        let mut positions = current.tracker.vertices().to_vec();
        let mut velocities = match self.frames.get(1) {
            Some(next) => next.velocities.before.clone(),
            None if current.velocities.after.is_empty() => vec![Vec3::zeros(); positions.len()],
            None => current.velocities.after.clone(),
        };
        let displacements = self.displaced(ctx, 0)?;
        displacements.iter().for_each(|(vertex, by)| positions[*vertex as usize] += by);
        let Some(next) = self.frames.get(1) else { return Ok((positions, velocities)) };
        let next_displacements = self.displaced(ctx, 1)?.into_iter();
        let mut next_displacements: Vec<Displaced> =
            next_displacements.filter_map(|(vertex, by)| Some((next.easing.before(vertex)?, by))).collect();
        next_displacements.sort_unstable_by_key(|(vertex, _)| *vertex);
        let displacement_of = |list: &[Displaced], vertex: u32| {
            let at = list.binary_search_by_key(&vertex, |(vertex, _)| *vertex);
            at.map_or(DVec3::zeros(), |at| list[at].1)
        };
        for Eased { vertex, now: wanted, next: wanted_next } in self.eased(0) {
            let displacement = displacement_of(&displacements, vertex);
            // A vertex that the next step removes gets the same fraction of its next wanted displacement as of the current one.
            let to = match next.easing.is_replaced(vertex) {
                true if wanted != DVec3::zeros() => wanted_next * (displacement.norm() / wanted.norm()),
                true => wanted_next,
                false => displacement_of(&next_displacements, vertex),
            };
            velocities[vertex as usize] += ((to - displacement) * self.scene.shot.fps).cast::<f32>();
        }
        Ok((positions, velocities))
    }

    /// The vertices of the frame at `index` that are eased towards coming changes.
    fn eased(&self, index: usize) -> Vec<Eased> {
        eased(self.frames.iter().skip(index + 1).map(|tracked| &tracked.easing), self.surface.ahead as usize)
    }

    /// The displacements of the vertices that [`Self::eased`] returns, reduced where the mesh would intersect itself.
    fn displaced(&self, ctx: &Context, index: usize) -> Result<Vec<Displaced>> {
        let tracker = &self.frames[index].tracker;
        uncrossed(ctx, tracker.vertices(), tracker.triangles(), displaced(&self.eased(index)))
    }

    /// Computes the frame after those in `frames`, if possible: beyond the shot's end the particle files need not exist.
    fn look_ahead(&mut self, ctx: &Context, frame: i32) -> Result<Option<TrackedFrame>> {
        let last = self.scene.shot.frames.last;
        if self.end.is_some_and(|end| frame >= end) {
            return Ok(None);
        }
        if frame > last {
            let files = self.surface.files_between(self.scene.shot.frames, frame - 1, frame);
            if !self.surface.reads_ahead() || !files.iter().all(|path| path.is_file()) {
                return Ok(None);
            }
        }
        let error = match self.next(ctx, frame) {
            Err(error) if !matches!(error, Error::Cancelled) => error,
            next => return next.map(Some),
        };
        self.end = Some(frame);
        // Within the shot the error counts only when the frame is due: the frames before it exist and are written first.
        match frame - last {
            ..=0 => {}
            1 => log::warn!("{error}; frame {last} has the velocities of the frame before"),
            _ => log::warn!("{error}; changes from frame {frame} on are not eased in"),
        }
        Ok(None)
    }

    /// The mesh at a frame, from the last of `frames`, which is the previous frame.
    fn next(&mut self, ctx: &Context, frame: i32) -> Result<TrackedFrame> {
        match frame.cmp(&self.inputs.begins) {
            Ordering::Less => without_mesh(self.surface, self.inputs),
            Ordering::Equal => self.appear(ctx, frame),
            Ordering::Greater => self.follow(ctx, frame),
        }
    }

    /// The mesh at the first frame that has particles, after frames without.
    fn appear(&self, ctx: &Context, frame: i32) -> Result<TrackedFrame> {
        let mut tracked = first_mesh(ctx, self.surface, self.inputs)?;
        tracked.easing = EasingTargets::unrelated(tracked.tracker.vertices().len());
        let particles = &self.inputs.particles;
        if let Some(report) = self.resculpt(ctx, &mut tracked, frame, particles)? {
            tracked.report = report_of(&report, particles.positions.len(), &tracked.tracker, true);
        }
        Ok(tracked)
    }

    /// The mesh at a frame, carried along by the particles.
    fn follow(&mut self, ctx: &Context, frame: i32) -> Result<TrackedFrame> {
        let phases = ctx.collect();
        let last = self.frames.len() - 1;
        let before = &mut self.frames[last];
        let begin = TrackedFrame::new(before.tracker.clone(), before.source.clone(), Report::default());
        let mut tracked = TrackedFrame { detail: before.detail.clone(), ..begin };
        // The particles' surface that was computed ahead moves on to the clone.
        before.tracker.forget_prefetched();
        let mut paths = VertexPaths::of(tracked.tracker.vertices());
        let times = self.liquid.step_times(frame);
        let mut report = StepReport::default();
        let mut from = self.liquid.at(times[0])?;
        // For each step, the end of the step after it, whose particles need not exist beyond the shot.
        let next_end = self.liquid.step_times(frame + 1)[1];
        let has_next = self.surface.rebuild && frame < self.scene.shot.frames.last;
        let following_end = times[2..].iter().copied().map(Some).chain([has_next.then_some(next_end)]);
        for (ends, following_end) in times.windows(2).zip(following_end) {
            let to = self.liquid.at(ends[1])?;
            let dt = (ends[1] - ends[0]) * self.liquid.file_time();
            if let Some(Ok(particles)) = following_end.map(|following_end| self.liquid.at(following_end)) {
                tracked.tracker.prefetch(particles);
            }
            let triangles = self.surface.eases().then(|| tracked.tracker.triangles().to_vec());
            let step = tracked.tracker.step(ctx, &from, &to, dt);
            let step = step.map_err(|error| self.liquid.with_path(ends[0], error))?;
            let share = (ends[1] - times[0]) / (times[times.len() - 1] - times[0]);
            match &step.change {
                Some(change) => {
                    paths.record(&change.before, share);
                    self.carry(ctx, &mut tracked, change, triangles, &to)?;
                    paths.apply_change(change);
                }
                None => paths.record(tracked.tracker.vertices(), share),
            }
            report = report.followed_by(step);
            from = to;
        }
        tracked.velocities =
            paths.velocities(tracked.tracker.vertices(), tracked.tracker.triangles(), self.scene.shot.fps);
        tracked.is_dry = from.positions.is_empty();
        let sculpted = self.resculpt(ctx, &mut tracked, frame, &from)?;
        let is_resculpted = sculpted.is_some();
        let report = sculpted.into_iter().fold(report, StepReport::followed_by);
        let report = StepReport { phases: phases.times(), ..report };
        report.new_warnings(&mut self.has_warned).for_each(|warning| log::warn!("frame {frame}: {warning}"));
        tracked.report = report_of(&report, from.positions.len(), &tracked.tracker, is_resculpted);
        Ok(tracked)
    }

    /// Carries a mesh's data and its easing targets over a change; `triangles` are those before it, if changes are eased.
    fn carry(
        &self,
        ctx: &Context,
        tracked: &mut TrackedFrame,
        change: &Change,
        triangles: Option<Vec<[u32; 3]>>,
        particles: &Particles,
    ) -> Result<()> {
        if let Some(triangles) = triangles {
            let targets = EasingTargets::of(ctx, change, &triangles, self.inputs.spacing)?;
            tracked.easing = std::mem::take(&mut tracked.easing).then(&targets);
        }
        let data = tracked.detail.as_deref().unwrap_or(&self.inputs.mesh);
        tracked.detail = Some(Arc::new(match tracked.tracker.vertices() {
            [] => data.emptied(),
            _ => carry_data(ctx, data, &tracked.source, (&tracked.tracker, change), particles)?,
        }));
        Ok(())
    }

    /// Replaces the mesh by the edited mesh of the frame, if there is one; returns the report.
    fn resculpt(
        &self,
        ctx: &Context,
        tracked: &mut TrackedFrame,
        frame: i32,
        particles: &Particles,
    ) -> Result<Option<StepReport>> {
        let Some(sculpt) = read_sculpt(ctx, self.surface, self.inputs, frame)? else { return Ok(None) };
        if particles.positions.is_empty() {
            log::warn!("{}: is left out, as frame {frame} has no particles", sculpt.path.display());
            return Ok(None);
        }
        let old = ctx.pool().install(|| NearestTree::new(&tracked.tracker.mesh()));
        let triangles = tracked.tracker.triangles().to_vec();
        let report = tracked.tracker.resculpt(ctx, &sculpt.mesh.mesh, sculpt.detail_retention, particles);
        let report = report.map_err(|error| error.in_file(&sculpt.path))?;
        // Vertices of the edited mesh move like those of the previous mesh near them.
        let velocity = |position: &DVec3| {
            let corner = old.nearest(*position).map(|near| triangles[near.triangle][0] as usize);
            corner.and_then(|corner| tracked.velocities.after.get(corner).copied()).unwrap_or_default()
        };
        tracked.velocities.after = tracked.tracker.vertices().iter().map(velocity).collect();
        tracked.easing = std::mem::take(&mut tracked.easing)
            .then(&EasingTargets::unrelated(tracked.tracker.vertices().len()));
        let mesh = Arc::new(sculpt.mesh);
        tracked.source = Source::of(ctx, self.surface.rebuild, Some(frame), mesh.clone(), particles);
        tracked.detail = Some(mesh);
        Ok(Some(report))
    }
}

/// The mesh at the first frame that has particles.
fn first_mesh(ctx: &Context, surface: &Surface, inputs: &Inputs) -> Result<TrackedFrame> {
    let params = surface.params(inputs.spacing);
    let begun = ctx.step(4, || Tracker::begin(ctx, params, &inputs.mesh.mesh, &inputs.particles));
    let ((mut tracker, report), phases) = begun.map_err(|error| in_first_file(surface, error))?;
    let result = tracker.set_detail_retention(inputs.detail_retention.clone());
    result.map_err(|error| in_first_file(surface, error))?;
    let report = StepReport { phases, ..report };
    let report = report_of(&report, inputs.particles.positions.len(), &tracker, false);
    let source = Source::of(ctx, surface.rebuild, None, inputs.mesh.clone(), &inputs.particles);
    Ok(TrackedFrame::new(tracker, source, report))
}

/// A frame before the first particles.
fn without_mesh(surface: &Surface, inputs: &Inputs) -> Result<TrackedFrame> {
    let tracker = Tracker::without_mesh(surface.params(inputs.spacing))?;
    let report = report_of(&StepReport::default(), 0, &tracker, false);
    let source = Source { sculpted: None, mesh: inputs.mesh.clone(), rest: None };
    let detail = Some(Arc::new(inputs.mesh.emptied()));
    Ok(TrackedFrame { detail, is_dry: true, ..TrackedFrame::new(tracker, source, report) })
}

/// An error of the first mesh, with its file.
fn in_first_file(surface: &Surface, error: Error) -> Error {
    let is_far = matches!(&error, Error::Argument(what) if what.starts_with(TOO_FAR));
    error.in_file(surface.mesh.as_ref().filter(|_| !is_far).unwrap_or(&surface.particles))
}

impl Source {
    fn of(
        ctx: &Context,
        is_rebuilt: bool,
        sculpted: Option<i32>,
        mesh: Arc<DetailedMesh>,
        particles: &Particles,
    ) -> Self {
        let is_traced = is_rebuilt && (mesh.uvs.is_some() || !mesh.arrays.is_empty());
        let rest = if is_traced { Rest::of(particles) } else { None };
        let tree = || ctx.pool().install(|| NearestTree::new(&mesh.mesh));
        let rest = rest.map(|rest| Arc::new((rest, tree())));
        Self { sculpted, mesh, rest }
    }
}

/// The data that a mesh carries after a change, without positions.
fn carry_data(
    ctx: &Context,
    data: &DetailedMesh,
    source: &Source,
    (tracker, change): (&Tracker, &Change),
    particles: &Particles,
) -> Result<DetailedMesh> {
    let triangles = data.mesh.triangles.clone();
    let mesh = TriMesh { positions: usd::to_floats(&change.before), triangles };
    let old = DetailedMesh { mesh, uvs: data.uvs.clone(), arrays: data.arrays.clone() };
    let spacing = tracker.params().spacing;
    let (positions, tree) = match source.rest.as_deref() {
        Some((rest, tree)) => (rest.of_change(ctx, particles, spacing, change)?, Some(tree)),
        None => (Vec::new(), None),
    };
    let traced = Traced { first: &source.mesh, tree, positions: &positions, spacing };
    let (origins, sources) = (&change.origins, &change.sources);
    ctx.phase("carry", || {
        let mut out = carry_attributes(&old, tracker.mesh(), origins, sources, Some(&traced));
        // The tracker has the positions.
        out.mesh.positions = Vec::new();
        Ok(out)
    })
}

impl Surface {
    /// Parameters of the mesh for particles of a spacing (m).
    pub(in crate::scene::surface) fn params(&self, spacing: f64) -> Params {
        Params {
            spacing,
            cell: self.cell,
            change: self.change,
            weighting: self.weighting,
            half_life: self.half_life.unwrap_or(f64::INFINITY),
            fade: self.fade,
            rebuild: self.rebuild,
            every: self.every,
            min_drop: self.min_drop,
        }
    }

    /// Number of frames computed ahead: one for velocities; with easing one more than `ahead`, as velocities need the next frame's eased
    /// vertices too.
    pub(in crate::scene::surface) fn frames_ahead(&self) -> i32 {
        if self.eases() { self.ahead + 1 } else { 1 }
    }

    /// Whether coming frames affect a frame's files.
    pub(in crate::scene::surface) fn reads_ahead(&self) -> bool {
        self.output.velocities || self.output.usd || self.eases()
    }

    fn eases(&self) -> bool {
        self.rebuild && self.ahead > 0
    }

    /// The files between two frames of the shot.
    pub(in crate::scene::surface) fn files_between(&self, shot: Frames, from: i32, to: i32) -> Vec<PathBuf> {
        self.files(self.time(shot, from), self.time(shot, to))
    }
}

/// The files that are read for a frame.
pub(in crate::scene::surface) fn reads(
    scene: &Scene,
    surface: &Surface,
    inputs: &Inputs,
    frame: i32,
) -> Reads {
    let frames = scene.shot.frames;
    let before = if frame == frames.first { frame } else { frame - 1 };
    let particles = surface.files_between(frames, before, frame);
    let sculpt = |frame: i32| path_at(surface, &inputs.sculpts, frame);
    let mut ahead = Vec::new();
    if surface.reads_ahead() {
        let last = frame + surface.frames_ahead();
        ahead = surface.files_between(frames, frame, last);
        // Files that the frame itself reads are not files ahead.
        ahead.retain(|path| !particles.contains(path));
        ahead.extend((frame + 1..=last).filter_map(sculpt));
    }
    Reads { files: particles.into_iter().chain(sculpt(frame)).collect(), ahead }
}
