//! Grains from the snow that a step removed (thesis section 3.3.2).
//!
//! Places are sites of a face-centred cubic lattice that is fixed in the world and jittered. Of those in a block that the step
//! laid bare, as many become grains as the block's removed volume pays for; what it pays for beyond the sites that there are is
//! owed and carried over, so that slices thinner than a grain, of which only some hold a site, starve nothing.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::base::DVec3;
use crate::base::blocks::{DIM, Origin, VOXELS};
use crate::error::Result;
use crate::snow::base_layer::filled;
use crate::vdb::{FloatGrid, Probe};

use super::field::Window;

/// Packing of new grains: the share of space that they fill.
pub const PACKING: f64 = 0.55;
/// Jitter of a site (distances of neighbouring sites). The lattice's neighbours are 1.10 diameters apart.
const JITTER: f64 = 0.04;

/// Snow that a step removed from a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Removal {
    /// The block.
    pub origin: Origin,
    /// Volume (m3).
    pub volume: f64,
}

/// What was removed between two states of a layer, block by block, ascending.
///
/// # Errors
/// When a grid cannot be read.
pub fn removals(before: &FloatGrid, after: &FloatGrid) -> Result<Vec<Removal>> {
    let cell = before.voxel_size() as f32;
    let volume = |origins: &[Origin]| -> Result<Vec<Removal>> {
        let (old, new) = (before.probe(origins)?, after.probe(origins)?);
        let removed = origins.par_iter().zip(old.par_iter().zip(&new)).map(|(origin, (old, new))| {
            let volume = lost(old, new, cell) * f64::from(cell).powi(3);
            Removal { origin: *origin, volume }
        });
        Ok(removed.filter(|removal| removal.volume > 0.0).collect())
    };
    let mut leaves: Vec<Origin> =
        before.leaves()?.iter().chain(&after.leaves()?).map(|leaf| leaf.origin).collect();
    leaves.par_sort_unstable();
    leaves.dedup();
    let mut out = volume(&leaves)?;
    // Blocks without a surface before and after, deep snow that is gone, lie within the bounds of the others.
    let Some(first) = out.first() else { return Ok(out) };
    let bounds = out.iter().fold([first.origin; 2], |[low, high], removal| {
        let at = removal.origin;
        [[0, 1, 2].map(|axis| low[axis].min(at[axis])), [0, 1, 2].map(|axis| high[axis].max(at[axis]))]
    });
    let span = |axis: usize| (bounds[0][axis]..=bounds[1][axis]).step_by(DIM);
    let all = span(0).flat_map(|x| span(1).flat_map(move |y| span(2).map(move |z| [x, y, z])));
    let deep: Vec<Origin> = all.filter(|origin| leaves.binary_search(origin).is_err()).collect();
    out.extend(volume(&deep)?);
    out.par_sort_unstable_by_key(|removal| removal.origin);
    Ok(out)
}

/// Cells of snow that a block lost.
fn lost(old: &Probe<'_>, new: &Probe<'_>, cell: f32) -> f64 {
    let value = |probe: &Probe<'_>, index: usize| match probe {
        Probe::Leaf(leaf) => leaf.values[index],
        Probe::Tile { value, .. } => *value,
    };
    match (old, new) {
        (Probe::Tile { value: old, .. }, Probe::Tile { value: new, .. }) => {
            f64::from(filled(*old, cell) - filled(*new, cell)) * VOXELS as f64
        }
        (Probe::Leaf(old), Probe::Leaf(new)) if old.values == new.values => 0.0,
        _ => (0..VOXELS)
            .map(|index| f64::from(filled(value(old, index), cell) - filled(value(new, index), cell)))
            .sum(),
    }
}

/// How removed snow becomes grains.
pub struct Sourcing {
    /// Diameter of a grain (m).
    pub diameter: f64,
    /// Share of the snow that becomes none.
    pub compression: f64,
    /// Seed of the scatter.
    pub seed: u64,
    /// The frame.
    pub frame: i32,
}

impl Sourcing {
    /// Grains for a volume (m3).
    pub fn paid(&self, volume: f64) -> f64 {
        let grain = std::f64::consts::PI / 6.0 * self.diameter.powi(3);
        (1.0 - self.compression) * volume * PACKING / grain
    }

    /// Places (m) of new grains. `owed` has the grains that blocks have paid for and not got.
    ///
    /// # Errors
    /// When a grid cannot be read.
    pub fn places(
        &self,
        before: &FloatGrid,
        after: &FloatGrid,
        removals: &[Removal],
        owed: &mut BTreeMap<Origin, f64>,
    ) -> Result<Vec<DVec3>> {
        let around = |removal: &Removal| {
            [removal.origin.map(|at| (at >> 3) - 1), removal.origin.map(|at| (at >> 3) + 1)]
        };
        let bounds: Vec<[[i32; 3]; 2]> = removals.iter().map(around).collect();
        let windows = [Window::all(before, &bounds)?, Window::all(after, &bounds)?];
        let cell = before.voxel_size();
        let sites: Vec<Vec<(u64, DVec3)>> = removals
            .par_iter()
            .enumerate()
            .map(|(index, removal)| {
                self.sites(removal.origin, cell, [&windows[0][index], &windows[1][index]])
            })
            .collect();
        let mut out = Vec::new();
        for (removal, mut sites) in removals.iter().zip(sites) {
            let paid = self.paid(removal.volume) + owed.remove(&removal.origin).unwrap_or(0.0);
            let count = (paid.floor().max(0.0) as usize).min(sites.len());
            // A random choice that no order of computation changes.
            sites.sort_unstable_by_key(|(hash, _)| *hash);
            out.extend(sites[..count].iter().map(|(_, place)| *place));
            let left = paid - count as f64;
            if left != 0.0 {
                owed.insert(removal.origin, left);
            }
        }
        Ok(out)
    }

    /// Sites in a block that held snow before and hold none after, each with a random number.
    fn sites(&self, origin: Origin, cell: f64, [before, after]: [&Window<'_>; 2]) -> Vec<(u64, DVec3)> {
        // Half of the lattice's cube: its diagonal is the distance of neighbours.
        let apart =
            self.diameter * libm::cbrt(std::f64::consts::SQRT_2 * std::f64::consts::PI / 6.0 / PACKING);
        let half = apart / std::f64::consts::SQRT_2;
        // A voxel reaches half a cell around its centre.
        let low = origin.map(|at| (f64::from(at) - 0.5) * cell);
        let high = origin.map(|at| (f64::from(at + DIM as i32) - 0.5) * cell);
        let range = |axis: usize| (low[axis] / half).ceil() as i64..(high[axis] / half).ceil() as i64;
        let mut out = Vec::new();
        for x in range(0) {
            for y in range(1) {
                for z in range(2).filter(|z| (x + y + z) % 2 == 0) {
                    let hash = hash(self.seed, self.frame, [x, y, z]);
                    let shift = [0, 21, 42]
                        .map(|bit| ((hash >> bit & 0x1f_ffff) as f64 / 1_048_576.0 - 1.0) * JITTER * apart);
                    let place =
                        DVec3::new(x as f64 * half, y as f64 * half, z as f64 * half) + DVec3::from(shift);
                    let at = [place.x / cell, place.y / cell, place.z / cell];
                    if before.sample(at).0 < 0.0 && after.sample(at).0 > 0.0 {
                        out.push((hash, place));
                    }
                }
            }
        }
        out
    }
}

/// A random number for a site (splitmix64: Steele et al. 2014).
fn hash(seed: u64, frame: i32, site: [i64; 3]) -> u64 {
    let mix = |mut x: u64| {
        x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    };
    let [x, y, z] = site.map(|part| part as u64);
    [frame as u64, x, y, z].into_iter().fold(mix(seed), |hash, part| mix(hash ^ part))
}
