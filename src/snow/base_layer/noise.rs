//! Ragged edges: the swept volume is displaced outward by noise that is fixed in world space
//! (thesis section 3.2: v = grad phi / |grad phi| max(noise, 0)).
//!
//! No advection is needed: phi -= max(noise, 0) in the band. Along a normal phi rises with slope 1, so as long as the noise is less steep,
//! everything that it removes is connected to the sweep: no islands.

use std::collections::HashMap;

use fastnoise_lite::{FastNoiseLite, NoiseType};
use rayon::prelude::*;

use super::subtraction::{self, Scale};
use crate::context::Context;
use crate::error::Result;
use crate::numeric::blocks::{Block, BlockEdit, Origin, Values, offset};
use crate::snow::NoiseParams;
use crate::sweep::{Piece, Settings};
use crate::vdb::{FloatGrid, Leaf, level_set};

/// Strength of an octave relative to the one before it.
const GAIN: f32 = 0.25;
/// Noise cells after which the pattern repeats: the library indexes them with 32 bits.
const PERIOD: f64 = 4_294_967_296.0;

/// The displacement field of a layer.
pub struct Displacement {
    /// Each octave with its weight in the sum.
    octaves: Vec<(FastNoiseLite, f32)>,
    /// Maximum displacement (cells).
    pub amplitude: f32,
    /// Width of a voxel in noise cells of the largest octave.
    step: f64,
}

impl Displacement {
    /// A field for validated parameters.
    pub fn new(params: &NoiseParams, cell: f64) -> Self {
        let mut strengths = vec![1.0; params.octaves as usize];
        (1..strengths.len()).for_each(|octave| strengths[octave] = strengths[octave - 1] * GAIN);
        let sum: f32 = strengths.iter().sum();
        let octave = |(strength, number): (f32, i32)| {
            let mut noise = FastNoiseLite::with_seed(params.seed.wrapping_add(number));
            noise.set_noise_type(Some(NoiseType::Perlin));
            noise.set_fractal_type(None);
            noise.set_frequency(Some(1.0));
            (noise, strength / sum)
        };
        let octaves = strengths.into_iter().zip(0..).map(octave).collect();
        Self { octaves, amplitude: (params.amplitude / cell) as f32, step: cell / params.size }
    }

    /// Outward displacement (cells) at a voxel of the world's lattice, 0..=amplitude.
    ///
    /// Voxels are integers, and the noise takes the integer part and the fraction of a position separately, both from 64 bits: the pattern
    /// is as fine 100 km from the origin as near it.
    fn at(&self, voxel: [i32; 3]) -> f32 {
        let mut position = voxel.map(|index| f64::from(index) * self.step);
        let mut sum = 0.0;
        for (noise, strength) in &self.octaves {
            let [x, y, z] = position.map(|along| along - PERIOD * (along / PERIOD).round());
            sum += noise.get_noise_3d(x, y, z) * strength;
            position = position.map(|along| 2.0 * along);
        }
        self.amplitude * sum.clamp(0.0, 1.0)
    }

    /// Displaces pieces outward, then scales their values back to distances (first order). This is the work of one phase; after a cancel
    /// it is incomplete.
    pub fn apply(&self, ctx: &Context, pieces: &mut [Piece], half_width: f32) {
        if self.amplitude == 0.0 {
            return;
        }
        let reach = half_width + self.amplitude;
        // The last unit of progress is `normalise`.
        ctx.expect(pieces.len() + 1);
        pieces.par_iter_mut().for_each(|piece| {
            ctx.advance();
            if ctx.check().is_err() {
                return;
            }
            let Piece::Near(origin, values) = piece else { return };
            for (index, value) in values.iter_mut().enumerate() {
                if *value > -half_width && *value < reach {
                    let at = [index >> 6, index >> 3 & 7, index & 7];
                    *value -= self.at([0, 1, 2].map(|axis| origin[axis] + at[axis] as i32));
                }
            }
        });
        normalise(pieces);
    }
}

/// Displaces a whole level set outward by noise; its band keeps its width.
///
/// # Errors
/// Parameters out of range; cancel.
pub fn displace(ctx: &Context, grid: &mut FloatGrid, params: &NoiseParams) -> Result<()> {
    let cell = grid.voxel_size();
    params.validate(cell)?;
    let noise = Displacement::new(params, cell);
    let half_width = (f64::from(grid.background()) / cell) as f32;
    // Rebuilt with a band that contains the displaced surface and the band around it; from a mesh, whose positions are 32-bit, and
    // therefore near the world's origin.
    let (near, shift) = near_origin(ctx, grid)?;
    let mesh = level_set::to_mesh(ctx, near.as_ref().unwrap_or(grid), 0.0, 0.0)?;
    let settings = Settings { half_width: half_width + noise.amplitude.ceil(), ..Settings::new(cell) };
    let wide = crate::sweep::voxelise(ctx, mesh, &settings)?;
    let back = |origin: Origin| [0, 1, 2].map(|axis| origin[axis] + shift[axis]);
    let mut pieces: Vec<Piece> = wide
        .leaves()?
        .iter()
        .map(|leaf| Piece::Near(back(leaf.origin), Box::new(leaf.values.map(|value| value / cell as f32))))
        .collect();
    ctx.phase("noise", || {
        noise.apply(ctx, &mut pieces, half_width);
        Ok(())
    })?;
    let scale = Scale { cell: cell as f32, background: half_width * cell as f32 };
    let mut displaced = FloatGrid::level_set(cell, half_width)?;
    let edits: Vec<BlockEdit> = pieces
        .into_iter()
        .filter_map(|piece| match piece {
            Piece::Near(origin, cells) => Some(subtraction::from_cells(origin, cells, scale)),
            Piece::Inside(_) => None,
        })
        .collect();
    displaced.replace_blocks(ctx, &edits)?;
    displaced.flood_fill()?;
    *grid = displaced;
    Ok(())
}

/// A copy of a level set on the world's lattice, moved by whole blocks so that its centre is at the origin, and the offset (voxels)
/// that moves it back; none if it is there already or on another lattice.
fn near_origin(ctx: &Context, grid: &FloatGrid) -> Result<(Option<FloatGrid>, [i32; 3])> {
    let nothing = (None, [0; 3]);
    let Some((low, high)) = grid.active_bbox().filter(|_| grid.is_world_fixed()) else { return Ok(nothing) };
    let shift = [0, 1, 2].map(|axis| ((i64::from(low[axis]) + i64::from(high[axis])) / 2) as i32 & !7);
    if shift == [0; 3] {
        return Ok(nothing);
    }
    let cell = grid.voxel_size();
    let mut near = FloatGrid::level_set(cell, (f64::from(grid.background()) / cell) as f32)?;
    let leaf = |leaf: &Leaf<'_>| {
        let origin = [0, 1, 2].map(|axis| leaf.origin[axis] - shift[axis]);
        BlockEdit::Dense(Block { origin, ..leaf.to_block() })
    };
    near.replace_blocks(ctx, &grid.leaves()?.iter().map(leaf).collect::<Vec<_>>())?;
    near.flood_fill()?;
    Ok((Some(near), shift))
}

/// Divides each value by the length of the gradient there, so that values near the surface are distances again.
fn normalise(pieces: &mut [Piece]) {
    let indices: HashMap<Origin, usize> =
        pieces.iter().enumerate().map(|(index, piece)| (piece.origin(), index)).collect();
    let scaled: Vec<Option<Box<Values>>> = pieces
        .par_iter()
        .map(|piece| match piece {
            Piece::Near(origin, values) => Some(Box::new(normalised(*origin, values, pieces, &indices))),
            Piece::Inside(_) => None,
        })
        .collect();
    for (piece, scaled) in pieces.iter_mut().zip(scaled) {
        if let (Piece::Near(_, values), Some(scaled)) = (piece, scaled) {
            *values = scaled;
        }
    }
}

fn normalised(origin: Origin, values: &Values, pieces: &[Piece], indices: &HashMap<Origin, usize>) -> Values {
    let neighbour = |axis: usize, step: i32| {
        let mut position = origin;
        position[axis] += step * 8;
        indices.get(&position).and_then(|&index| match &pieces[index] {
            Piece::Near(_, values) => Some(values),
            Piece::Inside(_) => None,
        })
    };
    let neighbours: Vec<[Option<&Box<Values>>; 2]> =
        (0..3).map(|axis| [neighbour(axis, -1), neighbour(axis, 1)]).collect();
    let mut out = *values;
    for (index, out) in out.iter_mut().enumerate() {
        let at = [index >> 6, index >> 3 & 7, index & 7];
        let mut squared = 0.0;
        for axis in 0..3 {
            let value = |coordinate: i32| {
                let mut position = at;
                position[axis] = (coordinate & 7) as usize;
                let block = match coordinate {
                    -1 => neighbours[axis][0].map_or(values, |block| block),
                    8 => neighbours[axis][1].map_or(values, |block| block),
                    _ => values,
                };
                let outside = (coordinate == -1 && neighbours[axis][0].is_none())
                    || (coordinate == 8 && neighbours[axis][1].is_none());
                if outside { values[index] } else { block[offset(position[0], position[1], position[2])] }
            };
            let here = values[index];
            let (below, above) = (here - value(at[axis] as i32 - 1), value(at[axis] as i32 + 1) - here);
            squared += upwind_squared(below, above, here > 0.0);
        }
        *out /= squared.sqrt().clamp(0.5, 2.0);
    }
    out
}

/// Square of the one-sided difference on the side of the surface (Godunov's choice).
fn upwind_squared(below: f32, above: f32, outside: bool) -> f32 {
    let (below, above) = if outside { (below, above) } else { (-below, -above) };
    let (below, above) = (below.max(0.0), above.min(0.0));
    (below * below).max(above * above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snow::noise::MAX_SLOPE;

    #[test]
    fn one_octave_is_nowhere_steeper_than_the_bound() {
        let mut noise = FastNoiseLite::with_seed(3);
        noise.set_noise_type(Some(NoiseType::Perlin));
        noise.set_frequency(Some(1.0));
        let (mut max_slope, step) = (0.0f32, 1e-2);
        for index in 0..400_000u32 {
            let at = [7919, 104_729, 1_299_709]
                .map(|prime: u32| f64::from(index.wrapping_mul(prime) % 20_000) * 1e-3);
            let sample = |d: [f64; 3]| noise.get_noise_3d(at[0] + d[0], at[1] + d[1], at[2] + d[2]);
            let here = sample([0.0; 3]);
            let slope: f32 = [[step, 0.0, 0.0], [0.0, step, 0.0], [0.0, 0.0, step]]
                .map(|d| ((sample(d) - here) / step as f32).powi(2))
                .iter()
                .sum();
            max_slope = max_slope.max(slope.sqrt());
        }
        assert!(f64::from(max_slope) < MAX_SLOPE, "{max_slope}");
        assert!(f64::from(max_slope) > MAX_SLOPE * 0.6, "the bound is far from tight: {max_slope}");
    }

    /// Displacements along a line of voxels on x, of clumps of 100 cells: adjacent voxels always differ, but only slightly.
    fn line(at: i32) -> Vec<f32> {
        let cell = 0.0075;
        let params = NoiseParams { amplitude: 2.0 * cell, size: 100.0 * cell, octaves: 1, seed: 0 };
        let noise = Displacement::new(&params, cell);
        (0..20_000).map(|x| noise.at([at + x, 40, -at + 37])).collect()
    }

    #[test]
    fn the_noise_is_as_smooth_far_away_as_near_the_origin() {
        // 0, 1.2 km, 100 km and the limit of voxel indices.
        for at in [0, 160_000, 13_333_333, i32::MAX / 2, -i32::MAX / 2] {
            let line = line(at);
            let bent = line.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs());
            let unclamped = line.windows(3).map(|v| v.iter().all(|v| *v > 0.0));
            let bend = bent
                .zip(unclamped)
                .filter(|(_, unclamped)| *unclamped)
                .fold(0.0, |max: f32, (bend, _)| max.max(bend));
            assert!(bend < 0.005, "at {at} it bends by {bend} of a cell");
            let equal = line.windows(2).filter(|v| v[0] > 0.05 && v[0] == v[1]).count();
            assert!(equal < 20, "at {at}, {equal} voxels have their neighbour's value");
        }
    }

    #[test]
    fn one_octave_has_the_whole_strength_and_octaves_share_it() {
        let strengths = |octaves| {
            let field = Displacement::new(&NoiseParams { octaves, ..NoiseParams::for_cell(0.01) }, 0.01);
            field.octaves.iter().map(|octave| octave.1).collect::<Vec<f32>>()
        };
        assert_eq!(strengths(1), [1.0]);
        let three = strengths(3);
        assert!((three.iter().sum::<f32>() - 1.0).abs() < 1e-6 && three[1] == three[0] * 0.25, "{three:?}");
    }

    #[test]
    fn defaults_are_accepted_and_steep_noise_is_refused() {
        let cell = 0.0075;
        let params = NoiseParams::for_cell(cell);
        assert!(params.validate(cell).is_ok(), "{:?}", params.validate(cell));
        let steep = NoiseParams { amplitude: 4.0 * cell, ..params };
        assert!(steep.validate(cell).unwrap_err().to_string().contains("at most"));
    }
}
