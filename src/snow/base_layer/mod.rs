//! The base layer: snow that has not moved yet, a level set that objects press into (thesis section 3.2).
//!
//! The cost of a step depends on the motion: only blocks that hold snow and are near the swept volume are processed.

mod columns;
mod crumbs;
mod far_bodies;
mod grids;
pub mod initial;
mod marks;
mod noise;
mod saved_state;
mod subtraction;
mod sweep_region;
pub(super) mod voxel_fill;

use std::borrow::Borrow;
use std::collections::{BTreeSet, HashMap, HashSet};

use rayon::prelude::*;

pub use far_bodies::Reach;
pub use grids::{Changes, Grids};
pub use noise::displace;
pub(super) use voxel_fill::filled;

use crate::context::{Context, PhaseTime};
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::blocks::{BlockEdit, DIM, Origin};
use crate::numeric::checks::ensure;
use crate::snow::NoiseParams;
use crate::snow::base_layer::columns::ChangedBlock;
use crate::sweep::{
    Band, Body, Face, Lattice, Piece, Scratch, Settings, TOLERANCE, UNITS, Voxeliser, Window,
};
use crate::vdb::{FloatGrid, GridClass, MetaValue, Probe, distances};
use columns::Columns;
use noise::Displacement;
use subtraction::{Edit, Scale};
use sweep_region::snow_masks;

/// How objects press into the snow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Ragged edges; without them imprints are exact.
    pub noise: Option<NoiseParams>,
    /// Maximum error of the swept volume (cells), 0.001..=1.
    pub tolerance: f64,
}

impl Params {
    /// The thesis' look: noise with an amplitude of two cells.
    pub fn for_cell(cell: f64) -> Self {
        Self { noise: Some(NoiseParams::for_cell(cell)), tolerance: TOLERANCE }
    }

    /// Checks every field for a layer's cells.
    ///
    /// # Errors
    /// Names the field and its range.
    fn validate(&self, surface: &FloatGrid) -> Result<()> {
        let (voxel, half_width) = (surface.voxel_size(), half_width(surface).round());
        Settings { voxel, half_width, tolerance: self.tolerance }.validate()?;
        self.noise.as_ref().map_or(Ok(()), |noise| noise.validate(voxel))
    }
}

/// Results of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Snow removed in this step (m3).
    pub removed_volume: f64,
    /// Snow left (m3).
    pub base_volume: f64,
    /// Blocks of 8^3 voxels that changed.
    pub touched_blocks: usize,
    /// Triangles of the swept volume's boundary near the snow.
    pub sweep_faces: usize,
    /// Number of islands removed: see [`BaseLayer::set_min_crumb`].
    pub crumbs: usize,
    /// Wall-clock time of each phase.
    pub phases: Vec<PhaseTime>,
}

/// A layer of snow and its history.
pub struct BaseLayer {
    params: Params,
    grids: Grids,
    /// The changes of the last step, including the removed level set.
    changes: Changes,
    columns: Columns,
    /// Blocks that differ from the layer before the first step.
    changed: HashSet<Origin>,
    /// Fingerprint of the layer before the first step.
    initial: u128,
    /// Minimum and maximum voxel that can hold snow.
    low: [i32; 3],
    high: [i32; 3],
    half_width: f32,
    /// Islands of fewer voxels are removed.
    min_crumb: usize,
}

impl BaseLayer {
    /// A layer whose snow is the inside of a level set.
    ///
    /// # Errors
    /// When `surface` is not a level set, is empty or not world-fixed, its values are not distances in metres, or a parameter is out of
    /// range.
    pub fn new(ctx: &Context, surface: FloatGrid, params: Params) -> Result<Self> {
        if let Some(what) = distances::warning(&surface)? {
            return Err(Error::argument(format!("the snow's grid {what}")));
        }
        Self::with_volume(ctx, surface, params, None)
    }

    /// As [`BaseLayer::new`], with the volume (m3) if it is known.
    fn with_volume(ctx: &Context, surface: FloatGrid, params: Params, known: Option<f64>) -> Result<Self> {
        params.validate(&surface)?;
        ensure(surface.class() == GridClass::LevelSet, "the snow is not a level set")?;
        ensure(
            surface.is_world_fixed(),
            "the snow's grid is rotated or shifted relative to the world's axes",
        )?;
        let half_width = half_width(&surface);
        let (low, high) = surface.active_bbox().ok_or_else(|| Error::argument("the snow is empty"))?;
        let (volume, initial) = ctx.phase("measure", || {
            let volume = known.map_or_else(|| columns::volume(&surface, low, high), Ok)?;
            Ok((volume, saved_state::fingerprint(&surface)?))
        })?;
        let grids = Grids::new(surface, volume)?;
        let changes = Changes::none(&grids, half_width)?;
        let (columns, changed) = Default::default();
        Ok(Self { params, grids, changes, columns, changed, initial, low, high, half_width, min_crumb: 0 })
    }

    /// Resumes from the grids of an earlier step; `initial` is the layer before the first step.
    ///
    /// # Errors
    /// As [`BaseLayer::new`]; grids of another layer.
    pub fn resume(ctx: &Context, initial: FloatGrid, grids: Grids, params: Params) -> Result<Self> {
        let mut layer = Self::new(ctx, initial, params)?;
        let initial = std::mem::replace(&mut layer.grids, grids).surface;
        let same = layer.grids.surface.voxel_size() == initial.voxel_size()
            && layer.grids.surface.background() == initial.background();
        ensure(same, "the layer to resume from has other cells than the first one")?;
        layer.changes = Changes::none(&layer.grids, layer.half_width)?;
        let [low, high] = [layer.low[1], layer.high[1]];
        layer.changed = columns::changed(&initial, &layer.grids.surface)?;
        layer.columns = columns::touched(&initial, &layer.changed, low, high)?;
        Ok(layer)
    }

    /// Sets how objects press into the snow from the next step on.
    ///
    /// # Errors
    /// A parameter out of range; the old ones are then kept.
    pub fn set_params(&mut self, params: Params) -> Result<()> {
        params.validate(&self.grids.surface)?;
        self.params = params;
        Ok(())
    }

    /// From the next step on, removes islands with fewer voxels than this (crumbs left by ragged edges and thin walls) where a step changed
    /// the snow. Initially 0: all islands stay.
    pub fn set_min_crumb(&mut self, voxels: usize) {
        self.min_crumb = voxels;
    }

    /// How objects press into the snow.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Half width of the narrow band (cells).
    pub fn half_width(&self) -> f32 {
        self.half_width
    }

    /// Minimum and maximum corner (m) of the box of voxels that can hold snow.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let cell = self.grids.surface.voxel_size();
        let corner = |voxel: [i32; 3], half: f64| DVec3::from(voxel.map(|at| (f64::from(at) + half) * cell));
        (corner(self.low, -0.5), corner(self.high, 0.5))
    }

    /// The grids: everything that the next step depends on, besides the layer before the first step.
    pub fn grids(&self) -> &Grids {
        &self.grids
    }

    /// Takes the changes of the last step; [`BaseLayer::removed`] and [`BaseLayer::before`] are empty afterwards.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn take_changes(&mut self) -> Result<Changes> {
        let none = Changes::none(&self.grids, self.half_width)?;
        // A caller that takes the changes has the grids as they were before the step.
        Ok(Changes { before: Vec::new(), ..std::mem::replace(&mut self.changes, none) })
    }

    /// The snow (level set).
    pub fn surface(&self) -> &FloatGrid {
        &self.grids.surface
    }

    /// Blocks (their minimum corners) that the last step changed, in any of the grids.
    pub fn dirty(&self) -> impl Iterator<Item = Origin> {
        // `touched` changes where the snow changes, `compression` in the whole columns there.
        self.changes
            .surface
            .iter()
            .chain(&self.changes.compression)
            .map(BlockEdit::origin)
            .collect::<BTreeSet<_>>()
            .into_iter()
    }

    /// Blocks of the snow that the last step changed, as they were before it: the difference becomes grains. Empty before the first step
    /// and after a restore.
    pub fn before(&self) -> &[BlockEdit] {
        &self.changes.before
    }

    /// The snow that the last step removed (level set).
    pub fn removed(&self) -> &FloatGrid {
        &self.changes.removed
    }

    /// Fraction of the column's height that was removed, at touched surface voxels, 0..=1.
    pub fn compression(&self) -> &FloatGrid {
        &self.grids.compression
    }

    /// Frame of the last change, at touched surface voxels.
    pub fn touched(&self) -> &FloatGrid {
        &self.grids.touched
    }

    /// Snow (m3).
    pub fn volume(&self) -> f64 {
        self.changes.volume
    }

    /// Removes what bodies sweep from `from` to `to` (s), or what they fill if the two times are equal. A step that fails or is cancelled
    /// leaves the layer unchanged.
    ///
    /// # Errors
    /// A pose that cannot be computed, a body that is too far away, cancel, memory.
    pub fn step(
        &mut self,
        ctx: &Context,
        bodies: &[impl Borrow<Body>],
        from: f64,
        to: f64,
        frame: i32,
    ) -> Result<StepReport> {
        let noise = self.params.noise.map(|noise| Displacement::new(&noise, self.grids.surface.voxel_size()));
        let (ragged, exact): (Vec<_>, Vec<_>) = bodies
            .iter()
            .map(Borrow::borrow)
            .enumerate()
            .partition(|(_, body): &(_, &Body)| body.has_noise());
        let sweeps = sweep_phases(&ragged, noise.is_some()) + sweep_phases(&exact, false);
        let phases = sweeps + ["subtract", "columns", "commit"].len() + usize::from(self.min_crumb > 1);
        let (report, phases) = ctx.step(phases, || {
            let (ragged, ragged_faces) = self.sweep(ctx, &ragged, from, to, noise.as_ref())?;
            let (exact, exact_faces) = self.sweep(ctx, &exact, from, to, None)?;
            let pieces = merge_sweeps(ragged, exact);
            let mut edits = ctx.phase("subtract", || self.edits(ctx, &pieces))?;
            let crumbs = match self.min_crumb {
                0 | 1 => 0,
                min => ctx.phase("crumbs", || {
                    crumbs::remove(ctx, &mut edits, &self.grids.surface, self.scale(), min)
                })?,
            };
            let (changes, columns, removed_volume) =
                ctx.phase("columns", || self.changes(ctx, edits, frame))?;
            let touched_blocks = changes.surface.len();
            self.commit(ctx, changes, columns)?;
            let (base_volume, sweep_faces) = (self.changes.volume, ragged_faces + exact_faces);
            let phases = Vec::new();
            Ok(StepReport { removed_volume, base_volume, touched_blocks, sweep_faces, crumbs, phases })
        })?;
        Ok(StepReport { phases, ..report })
    }

    fn scale(&self) -> Scale {
        Scale { cell: self.grids.surface.voxel_size() as f32, background: self.grids.surface.background() }
    }

    /// Distances of the volume that bodies sweep, with noise, in the blocks that hold snow, and the number of its faces.
    fn sweep(
        &self,
        ctx: &Context,
        bodies: &[(usize, &Body)],
        from: f64,
        to: f64,
        noise: Option<&Displacement>,
    ) -> Result<(Vec<Piece>, usize)> {
        if bodies.is_empty() {
            return Ok((Vec::new(), 0));
        }
        let voxeliser = ctx.phase("sweep", || self.voxeliser(ctx, bodies, from, to, noise))?;
        let mut pieces = ctx.phase("distance", || self.pieces(ctx, &voxeliser, noise.is_some()))?;
        if let Some(noise) = noise {
            ctx.phase("noise", || {
                noise.apply(ctx, &mut pieces, self.half_width);
                Ok(())
            })?;
        }
        Ok((pieces, voxeliser.face_count()))
    }

    /// The swept volume's boundary near the snow, sorted into blocks.
    fn voxeliser(
        &self,
        ctx: &Context,
        bodies: &[(usize, &Body)],
        from: f64,
        to: f64,
        noise: Option<&Displacement>,
    ) -> Result<Voxeliser> {
        let cell = self.grids.surface.voxel_size();
        let middle = [0, 1, 2].map(|a| (f64::from(self.low[a]) + f64::from(self.high[a])) * 0.5 * cell);
        let lattice = Lattice::near(cell, DVec3::from(middle))?;
        let outside = self.half_width + noise.map_or(0.0, |noise| noise.amplitude);
        // Whether a face bounds the swept volume depends on the winding numbers of the voxels around it. A block without facets counts as
        // inside if its first voxel is inside, and that voxel may lie outside the snow.
        let margin = outside.ceil() as i32 + 3 + DIM as i32;
        let relative = |voxel: [i32; 3], grow: i32| [0, 1, 2].map(|a| voxel[a] - lattice.origin[a] + grow);
        let fixed = |voxel: [i32; 3]| voxel.map(|cells| cells.saturating_mul(UNITS));
        let window =
            Window { min: fixed(relative(self.low, -margin)), max: fixed(relative(self.high, margin)) };
        ctx.expect(bodies.len() + Voxeliser::PARTS);
        let faces: Vec<Vec<Face>> = bodies
            .iter()
            .map(|(index, body)| {
                ctx.check()?;
                let faces = self.faces(ctx, body, (from, to), &lattice, &window);
                ctx.advance();
                faces.map_err(|error| match error {
                    Error::Argument(what) if body.name().is_none() => {
                        Error::Argument(format!("body {index}: {what}"))
                    }
                    other => other,
                })
            })
            .collect::<Result<_>>()?;
        let band = Band { inside: self.half_width, outside };
        let has_snow = |origins: &[Origin]| {
            Ok(self.grids.surface.probe(origins)?.iter().map(subtraction::has_snow).collect())
        };
        let bounds = [relative(self.low, 0), relative(self.high, 0)];
        Voxeliser::new(ctx, faces.concat(), lattice, band, bounds, has_snow)
    }

    /// Faces of what a body sweeps near the snow.
    fn faces(
        &self,
        ctx: &Context,
        body: &Body,
        (from, to): (f64, f64),
        lattice: &Lattice,
        window: &Window,
    ) -> Result<Vec<Face>> {
        let faces = |from: f64, to: f64| body.faces(ctx, from, to, lattice, self.params.tolerance, window);
        match faces(from, to) {
            // A vertex may be out of range: only the times at which the body is near the snow are then swept.
            Err(Error::Argument(_)) => {
                let spans = Reach::new(*lattice, window).spans(ctx, body, from, to)?;
                let parts: Vec<Vec<Face>> =
                    spans.into_iter().map(|(from, to)| faces(from, to)).collect::<Result<_>>()?;
                Ok(parts.concat())
            }
            other => other,
        }
    }

    /// Distances of the swept volume where there is snow; with `rim`, also one voxel around it.
    fn pieces(&self, ctx: &Context, voxeliser: &Voxeliser, rim: bool) -> Result<Vec<Piece>> {
        let near = voxeliser.near_blocks();
        let wanted = snow_masks(&self.grids.surface, &near, rim)?;
        ctx.expect(near.len());
        let mut pieces: Vec<Piece> = (0..near.len())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, index| {
                ctx.advance();
                if ctx.check().is_err() { None } else { voxeliser.piece(index, &wanted[index], scratch) }
            })
            .flatten_iter()
            .collect();
        pieces.extend(voxeliser.inside_blocks().into_iter().map(Piece::Inside));
        Ok(pieces)
    }

    /// The snow minus the pieces; nothing is applied yet.
    fn edits(&self, ctx: &Context, pieces: &[Piece]) -> Result<Vec<Edit>> {
        let origins: Vec<Origin> = pieces.iter().map(Piece::origin).collect();
        let snow: Vec<Probe<'_>> = self.grids.surface.probe(&origins)?;
        let scale = self.scale();
        ctx.expect(pieces.len());
        Ok(pieces
            .par_iter()
            .zip(&snow)
            .filter_map(|(piece, snow)| {
                ctx.advance();
                if ctx.check().is_err() { None } else { subtraction::subtract(piece, snow, scale) }
            })
            .collect())
    }

    /// Everything that the commit applies, and the volume removed (m3).
    fn changes(&self, ctx: &Context, edits: Vec<Edit>, frame: i32) -> Result<(Changes, Columns, f64)> {
        let cell = self.grids.surface.voxel_size();
        let mut removed = empty_removed(cell, self.half_width)?;
        // An empty sum is -0.
        let volume = edits.iter().map(Edit::volume).sum::<f64>() * cell.powi(3) + 0.0;
        let fresh = self.new_columns(edits.iter().map(|edit| edit.surface.origin()))?;
        let blocks: Vec<ChangedBlock<'_>> = edits
            .iter()
            .map(|edit| ChangedBlock { surface: &edit.surface, changed: &edit.changed })
            .collect();
        let touched = self.touched_edits(&blocks, frame)?;
        let surfaces: Vec<&BlockEdit> = edits.iter().map(|edit| &edit.surface).collect();
        let compression = self.compression_edits(ctx, &fresh, &surfaces, &touched)?;
        let origins: Vec<Origin> = surfaces.iter().map(|edit| edit.origin()).collect();
        let snow = self.grids.surface.probe(&origins)?;
        let before = snow.par_iter().zip(&origins).map(|(probe, origin)| probe.to_edit(*origin)).collect();
        let (surface, taken): (Vec<BlockEdit>, Vec<Option<BlockEdit>>) =
            edits.into_iter().map(|edit| (edit.surface, edit.removed)).unzip();
        removed.replace_blocks(ctx, &taken.into_iter().flatten().collect::<Vec<_>>())?;
        // The sum includes shells thinner than a cell, which leave no trace in the level set.
        removed.set_metadata("volume_m3", MetaValue::Double(volume))?;
        let left = self.changes.volume - volume;
        Ok((Changes { surface, touched, compression, before, removed, volume: left }, fresh, volume))
    }

    /// Applies a step's changes.
    fn commit(&mut self, ctx: &Context, changes: Changes, columns: Columns) -> Result<()> {
        ctx.commit(|| self.grids.apply(ctx, &changes))?;
        self.columns.extend(columns);
        self.changed.extend(changes.surface.iter().map(BlockEdit::origin));
        self.changes = changes;
        Ok(())
    }
}

/// Number of phases of [`BaseLayer::sweep`] for these bodies.
fn sweep_phases(bodies: &[(usize, &Body)], noise: bool) -> usize {
    if bodies.is_empty() { 0 } else { ["sweep", "distance"].len() + usize::from(noise) }
}

/// Half width of a level set's narrow band (cells).
fn half_width(surface: &FloatGrid) -> f32 {
    (f64::from(surface.background()) / surface.voxel_size()) as f32
}

/// The union of two sweeps, block by block.
fn merge_sweeps(mut pieces: Vec<Piece>, others: Vec<Piece>) -> Vec<Piece> {
    if pieces.is_empty() {
        return others;
    }
    let indices: HashMap<Origin, usize> =
        pieces.iter().enumerate().map(|(index, p)| (p.origin(), index)).collect();
    for other in others {
        match indices.get(&other.origin()) {
            None => pieces.push(other),
            Some(&index) => match (&mut pieces[index], other) {
                (Piece::Near(_, values), Piece::Near(_, others)) => {
                    values
                        .iter_mut()
                        .zip(others.iter())
                        .for_each(|(value, other)| *value = value.min(*other));
                }
                (piece, inside @ Piece::Inside(_)) => *piece = inside,
                (Piece::Inside(_), Piece::Near(..)) => {}
            },
        }
    }
    pieces
}

fn empty_removed(cell: f64, half_width: f32) -> Result<FloatGrid> {
    let mut removed = FloatGrid::level_set(cell, half_width)?;
    removed.set_name("removed")?;
    Ok(removed)
}
