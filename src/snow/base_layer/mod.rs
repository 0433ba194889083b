//! The base layer: snow that nothing has moved yet, a level set that objects press into (thesis section 3.2).
//!
//! A step costs what moves: only blocks that hold snow and lie near the swept volume are looked at.

mod columns;
mod edit;
mod grids;
pub mod initial;
mod noise;
mod wanted;

use std::collections::{BTreeSet, HashMap};

use rayon::prelude::*;

pub use grids::{Changes, Grids};
pub use noise::{NoiseParams, displace};

use crate::base::DVec3;
use crate::base::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};
use crate::context::{Context, StageTime};
use crate::error::{Error, Result};
use crate::sweep::{Band, Body, Face, Lattice, Piece, Scratch, Settings, UNITS, Voxeliser, Window};
use crate::vdb::{FloatGrid, GridClass, MetaValue, Probe};
use columns::{Column, Columns, Heights};
use edit::{Edit, Scale};
use noise::Displacement;
use wanted::snow_masks;

/// How objects press into the snow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Ragged edges; none leaves exact imprints.
    pub noise: Option<NoiseParams>,
    /// Largest error of the swept volume (cells), 0.001..=1.
    pub tolerance: f64,
}

impl Params {
    /// The thesis' look: noise of two cells.
    pub fn for_cell(cell: f64) -> Self {
        Self { noise: Some(NoiseParams::for_cell(cell)), tolerance: 0.02 }
    }
}

/// What a step did.
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
    /// Wall-clock time of each stage.
    pub stages: Vec<StageTime>,
}

/// A layer of snow and what has happened to it.
pub struct BaseLayer {
    params: Params,
    grids: Grids,
    /// The last step's, the removed level set among them.
    changes: Changes,
    columns: Columns,
    /// Voxels that snow can be in.
    low: [i32; 3],
    high: [i32; 3],
    half_width: f32,
}

impl BaseLayer {
    /// A layer whose snow is the inside of a level set.
    ///
    /// # Errors
    /// When `surface` is no level set, holds nothing or is not world-fixed, or a parameter is out of range.
    pub fn new(ctx: &Context, surface: FloatGrid, params: Params) -> Result<Self> {
        let cell = surface.voxel_size();
        if surface.class() != GridClass::LevelSet {
            return Err(Error::argument("the snow is not a level set"));
        }
        if !surface.is_world_fixed() {
            return Err(Error::argument("the snow's grid is rotated or shifted against the world's axes"));
        }
        let half_width = (f64::from(surface.background()) / cell) as f32;
        Settings { voxel: cell, half_width: half_width.round(), tolerance: params.tolerance }.validate()?;
        if let Some(noise) = &params.noise {
            noise.validate(cell)?;
        }
        let (low, high) = surface.active_bbox().ok_or_else(|| Error::argument("the snow is empty"))?;
        let volume = ctx.pool().install(|| columns::volume(&surface, low, high))?;
        let grids = Grids::new(surface, volume)?;
        let changes = Changes::none(&grids, half_width)?;
        Ok(Self { params, grids, changes, columns: HashMap::new(), low, high, half_width })
    }

    /// Goes on from the grids that an earlier step left; `initial` is the layer before the first step.
    ///
    /// # Errors
    /// As [`BaseLayer::new`]; grids of another layer.
    pub fn resume(ctx: &Context, initial: FloatGrid, grids: Grids, params: Params) -> Result<Self> {
        let mut layer = Self::new(ctx, initial, params)?;
        let initial = std::mem::replace(&mut layer.grids, grids).surface;
        let same = layer.grids.surface.voxel_size() == initial.voxel_size()
            && layer.grids.surface.background() == initial.background();
        if !same {
            return Err(Error::argument("the layer to go on from has other cells than the first one"));
        }
        layer.changes = Changes::none(&layer.grids, layer.half_width)?;
        layer.columns = columns::touched(&initial, &layer.grids.surface, layer.low[1], layer.high[1])?;
        Ok(layer)
    }

    /// Half width of the snow's narrow band (cells).
    pub fn half_width(&self) -> f32 {
        self.half_width
    }

    /// The grids: all that the next step depends on, besides the layer before the first step.
    pub fn grids(&self) -> &Grids {
        &self.grids
    }

    /// Takes what the last step changed; [`BaseLayer::removed`] is empty afterwards.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn take_changes(&mut self) -> Result<Changes> {
        let none = Changes::none(&self.grids, self.half_width)?;
        Ok(std::mem::replace(&mut self.changes, none))
    }

    /// The snow (level set).
    pub fn surface(&self) -> &FloatGrid {
        &self.grids.surface
    }

    /// What the last step removed (level set).
    pub fn removed(&self) -> &FloatGrid {
        &self.changes.removed
    }

    /// Part of its column's height that was removed, at touched surface voxels, 0..=1.
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

    /// Removes what bodies sweep from `from` to `to` (s), or their pose where the two are equal.
    /// A step that fails or is cancelled leaves the layer as it was.
    ///
    /// # Errors
    /// A pose that cannot be had, a body too far away, cancel, memory.
    pub fn step(
        &mut self,
        ctx: &Context,
        bodies: &[Body],
        from: f64,
        to: f64,
        frame: i32,
    ) -> Result<StepReport> {
        ctx.take_timings();
        let displacement =
            self.params.noise.map(|noise| Displacement::new(&noise, self.grids.surface.voxel_size()));
        let (ragged, exact): (Vec<&Body>, Vec<&Body>) = bodies.iter().partition(|body| body.has_noise());
        let (ragged, ragged_faces) = self.sweep(ctx, &ragged, from, to, displacement.as_ref())?;
        let (exact, exact_faces) = self.sweep(ctx, &exact, from, to, None)?;
        let pieces = united(ragged, exact);
        let edits = ctx.stage("subtract", || self.edits(&pieces))?;
        let (changes, columns, removed_volume) = ctx.stage("columns", || self.changes(ctx, edits, frame))?;
        let touched_blocks = changes.surface.len();
        self.commit(ctx, changes, columns)?;
        Ok(StepReport {
            removed_volume,
            base_volume: self.changes.volume,
            touched_blocks,
            sweep_faces: ragged_faces + exact_faces,
            stages: ctx.take_timings(),
        })
    }

    fn scale(&self) -> Scale {
        Scale { cell: self.grids.surface.voxel_size() as f32, background: self.grids.surface.background() }
    }

    /// Distances of the volume that bodies sweep, displaced, in the blocks that hold snow; and its faces.
    fn sweep(
        &self,
        ctx: &Context,
        bodies: &[&Body],
        from: f64,
        to: f64,
        noise: Option<&Displacement>,
    ) -> Result<(Vec<Piece>, usize)> {
        if bodies.is_empty() {
            return Ok((Vec::new(), 0));
        }
        let voxeliser = ctx.stage("sweep", || self.voxeliser(ctx, bodies, from, to, noise))?;
        let mut pieces = ctx.stage("distance", || self.pieces(ctx, &voxeliser, noise.is_some()))?;
        if let Some(noise) = noise {
            ctx.stage("noise", || {
                noise.apply(&mut pieces, self.half_width);
                Ok(())
            })?;
        }
        Ok((pieces, voxeliser.face_count()))
    }

    /// The swept volume's boundary near the snow, sorted into blocks.
    fn voxeliser(
        &self,
        ctx: &Context,
        bodies: &[&Body],
        from: f64,
        to: f64,
        noise: Option<&Displacement>,
    ) -> Result<Voxeliser> {
        let cell = self.grids.surface.voxel_size();
        let middle = [0, 1, 2].map(|a| (f64::from(self.low[a]) + f64::from(self.high[a])) * 0.5 * cell);
        let lattice = Lattice::near(cell, DVec3::from(middle))?;
        let outside = self.half_width + noise.map_or(0.0, |noise| noise.amplitude);
        // Sides of faces in reach are told with the voxels around them.
        let margin = outside.ceil() as i32 + 3;
        let relative = |voxel: [i32; 3], grow: i32| [0, 1, 2].map(|a| voxel[a] - lattice.base[a] + grow);
        let fixed = |voxel: [i32; 3]| voxel.map(|cells| cells.saturating_mul(UNITS));
        let window =
            Window { min: fixed(relative(self.low, -margin)), max: fixed(relative(self.high, margin)) };
        let parts: Vec<Vec<Face>> = bodies
            .iter()
            .map(|body| {
                ctx.check()?;
                body.chain(from, to, &lattice, self.params.tolerance, &window)
            })
            .collect::<Result<_>>()?;
        let band = Band { inside: self.half_width, outside };
        let snowy =
            |origins: &[Origin]| Ok(self.grids.surface.probe(origins)?.iter().map(edit::has_snow).collect());
        let bounds = [relative(self.low, 0), relative(self.high, 0)];
        Voxeliser::new(ctx, parts.concat(), lattice, band, bounds, snowy)
    }

    /// Distances where there is snow.
    fn pieces(&self, ctx: &Context, voxeliser: &Voxeliser, margin: bool) -> Result<Vec<Piece>> {
        let near = voxeliser.near_blocks();
        let wanted = snow_masks(&self.grids.surface, &near, margin)?;
        let mut pieces: Vec<Piece> = (0..near.len())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, index| {
                if ctx.is_cancelled() { None } else { voxeliser.piece(index, &wanted[index], scratch) }
            })
            .flatten_iter()
            .collect();
        ctx.check()?;
        pieces.extend(voxeliser.inside_blocks().into_iter().map(Piece::Inside));
        Ok(pieces)
    }

    fn edits(&self, pieces: &[Piece]) -> Result<Vec<Edit>> {
        let origins: Vec<Origin> = pieces.iter().map(Piece::origin).collect();
        let snow: Vec<Probe<'_>> = self.grids.surface.probe(&origins)?;
        let scale = self.scale();
        Ok(pieces
            .par_iter()
            .zip(&snow)
            .filter_map(|(piece, snow)| edit::subtract(piece, snow, scale))
            .collect())
    }

    /// Everything that the commit puts in place, and the volume removed (m3).
    fn changes(&self, ctx: &Context, edits: Vec<Edit>, frame: i32) -> Result<(Changes, Columns, f64)> {
        let cell = self.grids.surface.voxel_size();
        let mut removed = empty_removed(cell, self.half_width)?;
        let volume = edits.iter().map(Edit::volume).sum::<f64>() * cell.powi(3);
        let fresh = self.new_columns(&edits)?;
        let touched = self.touched_edits(&edits, frame)?;
        let compression = self.compression_edits(&fresh, &edits, &touched)?;
        let (surface, taken): (Vec<BlockEdit>, Vec<Option<BlockEdit>>) =
            edits.into_iter().map(|edit| (edit.surface, edit.removed)).unzip();
        removed.replace_blocks(ctx, &taken.into_iter().flatten().collect::<Vec<_>>())?;
        // Shells thinner than a cell leave no trace in the level set: the sum over the columns has them.
        removed.set_metadata("volume_m3", MetaValue::Double(volume))?;
        let left = self.changes.volume - volume;
        Ok((Changes { surface, touched, compression, removed, volume: left }, fresh, volume))
    }

    /// Heights before the first touch of the column blocks that nothing touched before these edits.
    fn new_columns(&self, edits: &[Edit]) -> Result<Columns> {
        let places: BTreeSet<[i32; 2]> = edits.iter().map(|edit| column_of(edit.surface.origin())).collect();
        let new = places.into_iter().filter(|place| !self.columns.contains_key(place));
        new.map(|place| {
            let original = columns::heights(&self.grids.surface, place, self.low[1], self.high[1])?;
            Ok((place, Column { original }))
        })
        .collect()
    }

    /// Frame numbers at the surface voxels of the changed blocks.
    fn touched_edits(&self, edits: &[Edit], frame: i32) -> Result<Vec<BlockEdit>> {
        let origins: Vec<Origin> = edits.iter().map(|edit| edit.surface.origin()).collect();
        let before = self.grids.touched.probe(&origins)?;
        let edit_one = |(edit, before): (&Edit, &Probe<'_>)| {
            let BlockEdit::Dense(surface) = &edit.surface else {
                return BlockEdit::Constant(edit.surface.origin(), 0.0);
            };
            let (mut values, known) = match before {
                Probe::Leaf(leaf) => (Box::new(*leaf.values), *leaf.mask),
                Probe::Tile { .. } => (Box::new([0.0; VOXELS]), [0; 8]),
            };
            for index in (0..VOXELS).filter(|&index| edit.changed[index >> 6] >> (index & 63) & 1 == 1) {
                values[index] = frame as f32;
            }
            let mask: Mask = std::array::from_fn(|x| surface.mask[x] & (known[x] | edit.changed[x]));
            masked(surface.origin, values, mask)
        };
        Ok(edits.par_iter().zip(&before).map(edit_one).collect())
    }

    /// Compression at every touched surface voxel of the columns that the edits change.
    fn compression_edits(
        &self,
        fresh: &Columns,
        edits: &[Edit],
        touched: &[BlockEdit],
    ) -> Result<Vec<BlockEdit>> {
        let now: HashMap<Origin, (&Edit, &BlockEdit)> = edits
            .iter()
            .zip(touched)
            .map(|(edit, touched)| (edit.surface.origin(), (edit, touched)))
            .collect();
        let places: BTreeSet<[i32; 2]> = now.keys().map(|origin| column_of(*origin)).collect();
        let cell = self.grids.surface.voxel_size() as f32;
        let levels = columns::levels(self.low[1], self.high[1]);
        let column_edits = |&[x, z]: &[i32; 2]| -> Result<Vec<BlockEdit>> {
            let column = fresh.get(&[x, z]).or_else(|| self.columns.get(&[x, z]));
            let column = column.ok_or_else(|| Error::Internal("a changed column is not known".into()))?;
            let origins: Vec<Origin> = levels.clone().map(|y| [x, y, z]).collect();
            let mut heights = Heights::default();
            for (origin, before) in origins.iter().zip(self.grids.surface.probe(&origins)?) {
                match now.get(origin).map(|(edit, _)| &edit.surface) {
                    Some(BlockEdit::Dense(block)) => heights.add(&block.values, cell),
                    Some(BlockEdit::Constant(_, value)) => heights.add_constant(*value),
                    None => heights.add_probe(&before, cell),
                }
            }
            let compression = column.compression(&heights);
            let mut out = Vec::new();
            for (origin, before) in origins.iter().zip(self.grids.touched.probe(&origins)?) {
                let mask = match (now.get(origin).map(|(_, touched)| touched), before) {
                    (Some(BlockEdit::Dense(block)), _) => block.mask,
                    (Some(BlockEdit::Constant(..)), _) => [0; 8],
                    (None, Probe::Leaf(leaf)) => *leaf.mask,
                    (None, Probe::Tile { .. }) => continue,
                };
                let values = std::array::from_fn(|index| compression[columns::cell_of(index)]);
                out.push(masked(*origin, Box::new(values), mask));
            }
            Ok(out)
        };
        let places: Vec<[i32; 2]> = places.into_iter().collect();
        let parts: Vec<Vec<BlockEdit>> = places.par_iter().map(column_edits).collect::<Result<_>>()?;
        Ok(parts.into_iter().flatten().collect())
    }

    /// Puts a step's changes in place.
    fn commit(&mut self, ctx: &Context, changes: Changes, columns: Columns) -> Result<()> {
        self.grids.apply(ctx, &changes)?;
        self.columns.extend(columns);
        self.changes = changes;
        Ok(())
    }
}

/// x and z of the column block that a block stands in.
fn column_of([x, _, z]: Origin) -> [i32; 2] {
    [x, z]
}

/// A block whose inactive values are 0; constant when no voxel is active.
fn masked(origin: Origin, mut values: Box<Values>, mask: Mask) -> BlockEdit {
    if mask == [0; 8] {
        return BlockEdit::Constant(origin, 0.0);
    }
    for (index, value) in values.iter_mut().enumerate() {
        if mask[index >> 6] >> (index & 63) & 1 == 0 {
            *value = 0.0;
        }
    }
    BlockEdit::Dense(Block { origin, values, mask })
}

/// The union of two sweeps, block by block.
fn united(mut pieces: Vec<Piece>, others: Vec<Piece>) -> Vec<Piece> {
    if pieces.is_empty() {
        return others;
    }
    let places: HashMap<Origin, usize> =
        pieces.iter().enumerate().map(|(index, p)| (p.origin(), index)).collect();
    for other in others {
        match places.get(&other.origin()) {
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
