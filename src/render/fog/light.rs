//! The light in fogs: how much of the sun and of the sky reaches each part, computed once per picture.

use rayon::prelude::*;

use super::blocks::Fog;
use super::traversal::{FogPosition, first_entry, march};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::numeric::blocks::DIM;

/// Voxels between two samples of light, which varies less from position to position than the density does.
const SPACING: usize = 2;
/// Samples along an edge of a block.
const EDGE: usize = DIM / SPACING + 1;
/// The light in a block; sample (x, y, z) lies at `(x * 5 + y) * 5 + z`.
type Lattice = [Lit; EDGE * EDGE * EDGE];
/// Maximum step (voxels) of rays towards the light.
const MAX_STEP: f64 = 2.0;
/// Optical depth beyond which no light arrives.
const OPAQUE: f64 = 12.0;
/// A block whose samples all have less sun and sky than this counts as dark.
const DARK: f32 = 1.0e-4;
/// Share of the sky's light that arrives in the thickest fog: it comes from the sides, scattered many times.
const MIN_SKY: f32 = 0.35;

/// The light at a position, each as a share of the unobstructed light, 0 to 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lit {
    /// Sun that the fogs let through.
    pub sun: f32,
    /// Sun that models and points do not block.
    pub unblocked: f32,
    /// Sky.
    pub sky: f32,
}

/// Fogs with their light.
pub(in crate::render) struct LitFogs<'a> {
    pub(super) fogs: &'a [Fog],
    /// Unit vector towards the sun.
    pub(super) sun: DVec3,
    /// For each fog and block the index of its lattice.
    block_lattices: Vec<Vec<u32>>,
    /// The first one is for dark blocks.
    lattices: Vec<Lattice>,
}

impl<'a> LitFogs<'a> {
    /// Lights fogs by a sun in a direction (a unit vector); `blocked` returns whether something other than fog blocks a direction from a
    /// point (m).
    ///
    /// # Errors
    /// Cancel.
    pub fn new(
        ctx: &Context,
        fogs: &'a [Fog],
        sun: DVec3,
        blocked: impl Fn(DVec3, DVec3) -> bool + Sync,
    ) -> Result<Self> {
        let all: Vec<(usize, usize)> = fogs
            .iter()
            .enumerate()
            .flat_map(|(fog, lit_fog)| (0..lit_fog.blocks().len()).map(move |block| (fog, block)))
            .collect();
        let light = |(fog, block): &(usize, usize)| {
            ctx.check()?;
            Ok(lattice(fogs, *fog, *block, sun, &blocked))
        };
        let lit: Vec<Option<Box<Lattice>>> = all.par_iter().map(light).collect::<Result<_>>()?;
        let dark = Lit { sun: 0.0, unblocked: 0.0, sky: MIN_SKY };
        let mut lattices = Vec::with_capacity(1 + lit.iter().flatten().count());
        lattices.push([dark; EDGE * EDGE * EDGE]);
        let mut block_lattices: Vec<Vec<u32>> = vec![Vec::new(); fogs.len()];
        for ((fog, _), lattice) in all.iter().zip(lit) {
            block_lattices[*fog].push(if lattice.is_some() { lattices.len() as u32 } else { 0 });
            lattices.extend(lattice.map(|lattice| *lattice));
        }
        Ok(Self { fogs, sun, block_lattices, lattices })
    }

    /// Share of the sun's light, 0 to 1, that the fogs transmit to a point (m); `toward` is the direction of the sun (a unit vector).
    pub fn sunlight(&self, point: DVec3, toward: DVec3) -> f64 {
        // Where the ray enters the first fog, the light accounts for that fog and all behind it.
        first_entry(self.fogs, (point, toward)).map_or(1.0, |position| f64::from(self.at(position).sun))
    }

    /// The light at a position.
    #[inline]
    pub(super) fn at(&self, position: FogPosition) -> Lit {
        let lattice = &self.lattices[self.block_lattices[position.fog][position.block] as usize];
        let scaled = position.local.map(|at| at / SPACING as f32);
        let whole = scaled.map(|at| (at as usize).min(EDGE - 2));
        let [x, y, z] = [0, 1, 2].map(|axis| scaled[axis] - whole[axis] as f32);
        let mix = |a: Lit, b: Lit, part: f32| Lit {
            sun: a.sun + (b.sun - a.sun) * part,
            unblocked: a.unblocked + (b.unblocked - a.unblocked) * part,
            sky: a.sky + (b.sky - a.sky) * part,
        };
        let corner = (whole[0] * EDGE + whole[1]) * EDGE + whole[2];
        let along_z = |at: usize| mix(lattice[at], lattice[at + 1], z);
        let along_y = |at: usize| mix(along_z(at), along_z(at + EDGE), y);
        mix(along_y(corner), along_y(corner + EDGE * EDGE), x)
    }
}

/// The light of a block; none where it is dark.
fn lattice(
    fogs: &[Fog],
    fog: usize,
    block: usize,
    sun: DVec3,
    blocked: &impl Fn(DVec3, DVec3) -> bool,
) -> Option<Box<Lattice>> {
    let lit_fog = &fogs[fog];
    let corner = DVec3::from(lit_fog.blocks()[block].origin.map(f64::from));
    // Shadow rays start slightly off the point, so that fog on the ground is not in the ground's shadow.
    let shadow_bias = sun * (SPACING as f64 * lit_fog.placement().cell());
    let lit = |n: usize| {
        let voxel = [n / (EDGE * EDGE), n / EDGE % EDGE, n % EDGE].map(|at| (at * SPACING) as i32);
        let point = lit_fog.placement().to_world(corner + DVec3::from(voxel.map(f64::from)));
        let sun_left = transmittance(fogs, point, sun);
        // Where there is no fog around, only [`LitFogs::sunlight`] asks for light.
        let is_visible = sun_left > DARK && lit_fog.max_near(block, voxel, SPACING as i32) > 0.0;
        let unblocked = if is_visible && blocked(point + shadow_bias, sun) { 0.0 } else { 1.0 };
        Lit { sun: sun_left, unblocked, sky: transmittance(fogs, point, DVec3::y()) }
    };
    let mut lattice: Box<Lattice> = Box::new(std::array::from_fn(lit));
    if lattice.iter().all(|lit| lit.sun < DARK && lit.sky < DARK) {
        return None;
    }
    lattice.iter_mut().for_each(|lit| lit.sky = MIN_SKY + (1.0 - MIN_SKY) * lit.sky.sqrt());
    Some(lattice)
}

/// Share of the light, 0 to 1, that arrives from far away at a point (m) from a direction (a unit vector).
fn transmittance(fogs: &[Fog], point: DVec3, toward: DVec3) -> f32 {
    let mut depth = 0.0f64;
    march(fogs, (point, toward), f64::INFINITY, MAX_STEP, |from, to, positions| {
        let extinction: f32 = positions.iter().map(|at| fogs[at.fog].extinction(at.block, at.local)).sum();
        depth += f64::from(extinction) * (to - from);
        depth < OPAQUE
    });
    if depth < OPAQUE { libm::exp(-depth) as f32 } else { 0.0 }
}
