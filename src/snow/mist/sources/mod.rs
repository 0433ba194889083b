//! Sources of mist (thesis section 3.4.2): it is raised in a tube with twice the grain's radius along the path of each fast grain within
//! the frame.

pub(super) mod new_mist;

use rayon::prelude::*;

use super::{MIN_DENSITY, Params};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::flow::{Coord, Tile};
use crate::geometry::DVec3;
use crate::numeric::checks::ensure;

/// Maximum coordinate of a grain (cells).
const MAX_CELL: f64 = 1e7;
/// Maximum acceleration (m/s2) of a grain in free flight, under gravity and air drag. A grain with at least twice this acceleration is
/// assumed to collide.
const FREE_ACCELERATION: f64 = 20.0;
/// Largest radius of a grain (cells).
const MAX_RADIUS: f64 = 64.0;

/// A grain that raises mist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Position (m) at the end of the step.
    pub position: DVec3,
    /// Velocity (m/s).
    pub velocity: [f32; 3],
    /// Radius (m) of the grain.
    pub radius: f64,
    /// Its state at the beginning of the step; none: it moved at its velocity throughout.
    pub start: Option<Start>,
}

/// A grain at the beginning of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Position (m): the birth position if it was born in the step.
    pub position: DVec3,
    /// Velocity (m/s), 0 if it was born in the step.
    pub velocity: [f32; 3],
}

impl Source {
    /// Checks that it can raise mist in cells with the edge `cell` (m).
    ///
    /// # Errors
    /// A number that is not finite; a position that is too far from the origin; a radius that is negative or too large.
    pub(super) fn check(&self, cell: f64) -> Result<()> {
        let [x, y, z] = self.position.into();
        let at = format!("grain at ({x:.3}, {y:.3}, {z:.3}) m");
        ensure(
            self.position.iter().all(|x| x.abs() <= MAX_CELL * cell),
            format_args!("the {at} is farther than {MAX_CELL:.0} cells from the origin"),
        )?;
        if !self.velocity.iter().all(|speed| speed.is_finite()) {
            return Err(Error::argument(format!("the velocity of the {at} is not finite")));
        }
        if let Some(start) = self.start {
            let is_near = start.position.iter().all(|x| x.abs() <= MAX_CELL * cell);
            ensure(
                is_near && start.velocity.iter().all(|speed| speed.is_finite()),
                format_args!(
                    "the {at} began the step with a velocity that is not finite, or farther than {MAX_CELL:.0} cells from the origin"
                ),
            )?;
        }
        let max = MAX_RADIUS * cell;
        if !(0.0..=max).contains(&self.radius) {
            let radius = self.radius;
            return Err(Error::argument(format!(
                "the {at} has a radius of {radius} m, not within 0 to {max}"
            )));
        }
        Ok(())
    }

    /// Whether a grain is fast enough to raise mist at either end of a step, and is not falling there unless falling grains raise mist too.
    pub fn raises(&self, params: &Params) -> bool {
        raises(self.velocity, params) || self.start.is_some_and(|start| raises(start.velocity, params))
    }

    /// Its largest speed (m/s) on any axis.
    pub(super) fn fastest(&self) -> f32 {
        let start = self.start.map_or([0.0; 3], |start| start.velocity);
        self.velocity.iter().chain(&start).fold(0.0, |max, speed| max.max(speed.abs()))
    }

    /// Its motion in a step of `dt` (s) from a start.
    fn motion(&self, start: &Start, dt: f64) -> Motion {
        let now = DVec3::from(self.velocity.map(f64::from)) * dt;
        let before = DVec3::from(start.velocity.map(f64::from)) * dt;
        let (gain, off) = (now - before, start.position + now - self.position);
        let middle = (off.dot(&gain) / gain.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        // The displacement that the velocities do not explain is spread over the step.
        let rest = gain * middle - off;
        let free = 2.0 - gain.norm() / (FREE_ACCELERATION * dt * dt);
        let width = 2.0 * middle.min(1.0 - middle) * free.clamp(0.0, 1.0);
        Motion { from: start.position, before: before + rest, gain, middle, width }
    }
}

/// The motion of a grain in a step: its velocity changes once, uniformly over an interval. The interval is centred on the moment for which
/// both velocities lead as close as possible to the grain's end position; it is the whole step for a grain in flight and an instant for one
/// that collides.
struct Motion {
    /// Position (m) at the beginning.
    from: DVec3,
    /// Displacement (m) over a whole step at the first velocity; at the last velocity it is larger by `gain`.
    before: DVec3,
    gain: DVec3,
    /// Centre and length of the interval: shares 0..=1 of the step.
    middle: f64,
    width: f64,
}

impl Motion {
    /// Position (m) at a share 0..=1 of the step.
    fn position(&self, share: f64) -> DVec3 {
        let into = share - (self.middle - 0.5 * self.width);
        let gained = if into <= 0.0 {
            0.0
        } else if into < self.width {
            0.5 * into * into / self.width
        } else {
            share - self.middle
        };
        self.from + self.before * share + self.gain * gained
    }
}

/// Whether a grain at a velocity (m/s) raises mist.
fn raises(velocity: [f32; 3], params: &Params) -> bool {
    let speed = velocity.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    speed > params.from_speed && (params.falling || velocity[1] >= 0.0)
}

/// New mist in a tile.
pub struct Seed {
    /// Its tile.
    pub coord: Coord,
    /// Density 0..=1 at the cells' centres.
    pub density: Box<Tile>,
    /// Velocity (m/s) there: the mean of the grains' velocities, weighted by how much of the cell each one's tube covers.
    pub velocity: Box<[Tile; 3]>,
}

/// The paths (m) of grains that raise mist in the part of a step of `dt` (s) between two shares 0..=1 of it, at their mean velocity in that
/// part.
pub fn paths(sources: &[Source], params: &Params, dt: f64, [first, last]: [f64; 2]) -> Vec<Path> {
    let time = (last - first) * dt;
    let path = |source: &Source| {
        let (velocity, ends) = match &source.start {
            None => {
                let now = DVec3::from(source.velocity.map(f64::from)) * dt;
                (source.velocity, [first, last].map(|share| source.position - now * (1.0 - share)))
            }
            Some(start) => {
                let motion = source.motion(start, dt);
                let ends = [first, last].map(|share| motion.position(share));
                let mean = (ends[1] - ends[0]) / time;
                ([mean.x as f32, mean.y as f32, mean.z as f32], ends)
            }
        };
        raises(velocity, params).then_some(Path { ends, velocity, radius: source.radius })
    };
    sources.iter().filter_map(path).collect()
}

/// The path of a grain.
pub struct Path {
    /// Its ends (m).
    ends: [DVec3; 2],
    /// Velocity (m/s) and radius (m) of the grain.
    velocity: [f32; 3],
    radius: f64,
}

/// The new mist along paths, by tile, sorted.
///
/// # Errors
/// More memory than the context allows.
pub fn seeds(ctx: &Context, paths: &[Path], params: &Params) -> Result<Vec<Seed>> {
    const WHAT: &str = "new mist";
    let tiles_in_box = |path: &Path| {
        let [low, high] = tile_bounds(path, params.cell);
        (0..3).map(|axis| u64::from(high[axis].abs_diff(low[axis])) + 1).product::<u64>()
    };
    ctx.allow(
        WHAT,
        paths.iter().map(tiles_in_box).sum::<u64>().saturating_mul(size_of::<(Coord, u32)>() as u64),
    )?;
    let mut touched: Vec<(Coord, u32)> = paths
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, path)| {
            tiles_of(path, params.cell).into_iter().map(move |coord| (coord, index as u32))
        })
        .collect();
    touched.par_sort_unstable();
    let groups: Vec<&[(Coord, u32)]> = touched.chunk_by(|a, b| a.0 == b.0).collect();
    ctx.allow(WHAT, groups.len() as u64 * SEED_BYTES)?;
    let seeds = groups.into_par_iter().map(|group| seed(group, paths, params));
    // Many of the tiles are missed by the tubes, or covered only to a negligible part.
    Ok(seeds.filter(|seed| seed.density.iter().any(|density| *density > MIN_DENSITY)).collect())
}

/// Bytes of a seed.
const SEED_BYTES: u64 = 4 * size_of::<Tile>() as u64;

/// Minimum and maximum tile of the box around a path's tube.
fn tile_bounds(path: &Path, cell: f64) -> [Coord; 2] {
    let [from, to] = path.ends;
    let reach = DVec3::repeat(2.0 * path.radius + cell);
    let tile = |position: DVec3| [0, 1, 2].map(|axis| (position[axis] / (8.0 * cell)).floor() as i32);
    [tile(from.inf(&to) - reach), tile(from.sup(&to) + reach)]
}

/// Coordinates of the tiles that a path's tube may touch.
fn tiles_of(path: &Path, cell: f64) -> Vec<Coord> {
    let ([from, to], [low, high]) = (path.ends, tile_bounds(path, cell));
    let mut out = Vec::new();
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                let middle = DVec3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, f64::from(z) + 0.5);
                let apart = distance(middle * (8.0 * cell), from, to);
                if apart < 2.0 * path.radius + cell * (1.0 + 4.0 * 3f64.sqrt()) {
                    out.push([x, y, z]);
                }
            }
        }
    }
    out
}

/// Distance (m) of a position from a segment.
fn distance(position: DVec3, from: DVec3, to: DVec3) -> f64 {
    let (along, off) = (to - from, position - from);
    let share = (off.dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (off - along * share).norm()
}

fn seed(group: &[(Coord, u32)], paths: &[Path], params: &Params) -> Seed {
    let coord = group[0].0;
    let (mut density, mut velocity) = (Box::new([0.0f32; 512]), Box::new([[0.0f32; 512]; 3]));
    let mut weights = [0.0f32; 512];
    for (_, index) in group {
        let Path { ends: [from, to], velocity: speed, radius } = paths[*index as usize];
        let reach = DVec3::repeat(2.0 * radius + params.cell);
        let low = (from.inf(&to) - reach) / params.cell;
        let high = (from.sup(&to) + reach) / params.cell;
        // The cells of the tile that the tube may cover.
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let first = f64::from(coord[axis] * 8);
            (low[axis] - first).clamp(0.0, 8.0) as usize..(high[axis] - first).ceil().clamp(0.0, 8.0) as usize
        });
        let rows = x.flat_map(|x| y.clone().map(move |y| x << 6 | y << 3));
        for cell in rows.flat_map(|row| z.clone().map(move |z| row | z)) {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let position =
                [0, 1, 2].map(|axis| (f64::from(coord[axis] * 8 + at[axis] as i32) + 0.5) * params.cell);
            let apart = distance(DVec3::from(position), from, to);
            let cover = (0.5 + (2.0 * radius - apart) / params.cell).clamp(0.0, 1.0) as f32;
            if cover > 0.0 {
                density[cell] = density[cell].max(cover);
                weights[cell] += cover;
                for axis in 0..3 {
                    velocity[axis][cell] += cover * speed[axis];
                }
            }
        }
    }
    let noise = noise(params);
    for cell in (0..512usize).filter(|cell| weights[*cell] > 0.0) {
        for speeds in velocity.iter_mut() {
            speeds[cell] /= weights[cell];
        }
        if params.noise > 0.0 {
            let at = [cell >> 6, cell >> 3 & 7, cell & 7];
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(coord[axis] * 8 + at[axis] as i32) + 0.5);
            let share = 0.5 + 0.5 * noise.get_noise_3d(x, y, z).clamp(-1.0, 1.0);
            density[cell] *= 1.0 - params.noise as f32 * share;
        }
    }
    Seed { coord, density, velocity }
}

/// The noise, as a function of cell coordinates.
fn noise(params: &Params) -> fastnoise_lite::FastNoiseLite {
    let mut noise = fastnoise_lite::FastNoiseLite::with_seed(params.seed);
    noise.set_noise_type(Some(fastnoise_lite::NoiseType::OpenSimplex2));
    noise.set_frequency(Some((params.cell / params.noise_size) as f32));
    noise
}
