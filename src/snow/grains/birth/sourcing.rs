//! Creates grains from the snow that a step removed (thesis section 3.3.2).
//!
//! Candidate positions are the jittered sites of a face-centred cubic lattice fixed in world space. In a block that the step cleared, as
//! many sites become grains as its removed volume pays for. Grains paid for beyond the available sites are owed and carried over, so that
//! no snow is lost from slices thinner than a grain, few of which contain a site.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::claims::Claims;
use super::removed_snow::Removal;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::numeric::blocks::{DIM, Origin, VOXELS};
use crate::snow::grains::colliders::field::Window;
use crate::vdb::FloatGrid;

/// Packing of new grains: the share of space that they fill.
pub const PACKING: f64 = 0.55;
/// Jitter of a site, relative to the distance between neighbouring sites, which is 1.10 diameters.
const JITTER: f64 = 0.04;

/// A position where a grain may be created.
struct Site {
    hash: u64,
    position: DVec3,
    /// Share of the snow there that becomes grains.
    share: f64,
    /// Sites are chosen in ascending order of this random number, which makes the choice proportional to the shares
    /// (exponential race).
    priority: f64,
}

impl Site {
    fn new(hash: u64, position: DVec3, share: f64) -> Self {
        let random = (hash >> 11) as f64 / (1u64 << 53) as f64;
        Self { hash, position, share, priority: -libm::log1p(-random) / share }
    }
}

/// How removed snow becomes grains.
pub struct Sourcing {
    /// Diameter of a grain (m).
    pub diameter: f64,
    /// The object that took the snow at each position, and the share of it that becomes grains.
    pub claims: Claims,
    /// Seed of the positions.
    pub seed: u64,
    /// The frame.
    pub frame: i32,
}

impl Sourcing {
    /// Count of grains for a volume (m3) without compression.
    fn paid(&self, volume: f64) -> f64 {
        volume * PACKING / (std::f64::consts::PI / 6.0 * self.diameter.powi(3))
    }

    /// Memory (bytes) of [`Sourcing::positions`] for the sites of `blocks` blocks with voxels of `cell` m.
    pub fn bytes(&self, blocks: usize, cell: f64) -> u64 {
        let sites = (cell / self.diameter).powi(3) * VOXELS as f64 * PACKING * 6.0 / std::f64::consts::PI;
        (blocks as f64 * sites * size_of::<Site>() as f64) as u64
    }

    /// Positions (m) of new grains, of which none is behind ground (`is_behind`): interpolated between cells, the layer extends into the
    /// ground. `owed` holds the grains that each block has paid for but that do not exist yet.
    ///
    /// # Errors
    /// When a grid cannot be read.
    pub fn positions(
        &self,
        [before, after]: [&FloatGrid; 2],
        removals: &[Removal],
        owed: &mut BTreeMap<Origin, f64>,
        is_behind: impl Fn(DVec3) -> bool + Sync,
    ) -> Result<Vec<DVec3>> {
        let around = |removal: &Removal| {
            [removal.origin.map(|at| (at >> 3) - 1), removal.origin.map(|at| (at >> 3) + 1)]
        };
        let bounds: Vec<[[i32; 3]; 2]> = removals.iter().map(around).collect();
        let windows = [Window::all(before, &bounds)?, Window::all(after, &bounds)?];
        let cell = after.voxel_size();
        let sourced: Vec<(f64, Vec<Site>)> = removals
            .par_iter()
            .enumerate()
            .map(|(index, removal)| {
                let windows = [&windows[0][index], &windows[1][index]];
                let low = DVec3::from(removal.origin.map(|at| (f64::from(at) - 0.5) * cell));
                let high = low + DVec3::repeat(DIM as f64 * cell);
                let claims = self.claims.in_box(&[low, high]);
                let mut sites = self.sites(removal.origin, cell, windows, |position| claims.share(position));
                sites.retain(|site| !is_behind(site.position));
                let share = match sites.len() {
                    0 => claims.share((low + high) * 0.5),
                    count => sites.iter().map(|site| site.share).sum::<f64>() / count as f64,
                };
                (share, sites)
            })
            .collect();
        let mut out = Vec::new();
        for (removal, (share, mut sites)) in removals.iter().zip(sourced) {
            let paid = share * self.paid(removal.volume) + owed.remove(&removal.origin).unwrap_or(0.0);
            sites.retain(|site| site.share > 0.0);
            let count = (paid.floor().max(0.0) as usize).min(sites.len());
            // A random choice that does not depend on the order of computation.
            sites.sort_unstable_by(|a, b| a.priority.total_cmp(&b.priority).then(a.hash.cmp(&b.hash)));
            out.extend(sites[..count].iter().map(|site| site.position));
            let left = paid - count as f64;
            if left != 0.0 {
                owed.insert(removal.origin, left);
            }
        }
        Ok(out)
    }

    /// Sites in a block that were in snow before and are not after.
    fn sites(
        &self,
        origin: Origin,
        cell: f64,
        [before, after]: [&Window<'_>; 2],
        share: impl Fn(DVec3) -> f64,
    ) -> Vec<Site> {
        // Half the edge of the lattice's cube; neighbours are half a face diagonal apart.
        let apart =
            self.diameter * libm::cbrt(std::f64::consts::SQRT_2 * std::f64::consts::PI / 6.0 / PACKING);
        let half = apart / std::f64::consts::SQRT_2;
        // A voxel extends half a cell around its centre.
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
                    let position =
                        DVec3::new(x as f64 * half, y as f64 * half, z as f64 * half) + DVec3::from(shift);
                    let at = [position.x / cell, position.y / cell, position.z / cell];
                    if before.sample(at).0 < 0.0 && after.sample(at).0 > 0.0 {
                        out.push(Site::new(hash, position, share(position)));
                    }
                }
            }
        }
        out
    }
}

/// A random number for a site (splitmix64: Steele et al. 2014).
pub fn hash(seed: u64, frame: i32, site: [i64; 3]) -> u64 {
    let mix = |mut x: u64| {
        x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    };
    let [x, y, z] = site.map(|part| part as u64);
    [frame as u64, x, y, z].into_iter().fold(mix(seed), |hash, part| mix(hash ^ part))
}
