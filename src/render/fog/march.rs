//! Fog along view rays: its transmittance, and the light that it adds.
//!
//! Light scattered once comes from the sun through the fog (Henyey and Greenstein 1941). Light scattered more often is added as one wider
//! and weaker lobe that reaches deeper (after Wrenninge, Kulla and Lundqvist 2013), since the crystals of powder snow absorb next to
//! nothing. The sky lights the fog from all sides.

use super::light::LitFogs;
use super::traversal;
use crate::geometry::DVec3;
use crate::render::camera::{Camera, Size};
use crate::render::shade::{Colour, SUN, SURROUNDINGS};

/// Maximum step (voxels).
const MAX_STEP: f64 = 1.0;
/// Mean cosine of the scattering angle: slightly forward.
const ASYMMETRY: f64 = 0.3;
/// Weight of light scattered several times, relative to that of light scattered once.
const MULTIPLE_SCATTERING: f64 = 0.9;
/// A fog that transmits less than this is opaque.
const OPAQUE: f64 = 0.002;

/// Effect of the fog along a ray up to some distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::render) struct Veil {
    /// Share of the light that passes, 0 to 1.
    pub transmittance: f64,
    /// Light that the fog adds.
    pub light: Colour,
}

impl Veil {
    /// The veil without fog.
    pub const NONE: Self = Self { transmittance: 1.0, light: Colour::new(0.0, 0.0, 0.0) };
}

impl LitFogs<'_> {
    /// Whether one ray through the middle of a pixel suffices for all its samples: no voxel is smaller than a pixel at the middle of its
    /// fog.
    pub fn is_smooth(&self, camera: &Camera, size: Size) -> bool {
        let pixel = 2.0 * libm::tan(camera.fov_deg.to_radians() * 0.5) / f64::from(size.height);
        let is_smooth =
            |(low, high): (DVec3, DVec3), cell: f64| cell >= pixel * ((low + high) * 0.5 - camera.eye).norm();
        self.fogs
            .iter()
            .all(|fog| fog.bounds().is_none_or(|bounds| is_smooth(bounds, fog.placement().cell())))
    }

    /// The effects of the fogs along a ray (a unit vector) from a point (m), up to each of some distances (m).
    pub fn veils<const N: usize>(&self, eye: DVec3, toward: DVec3, distances: [f64; N]) -> [Veil; N] {
        let mut order: [usize; N] = std::array::from_fn(|n| n);
        order.sort_unstable_by(|a, b| distances[*a].total_cmp(&distances[*b]).then(a.cmp(b)));
        let mut veils = [Veil::NONE; N];
        let Some(farthest) = order.last().map(|last| distances[*last]) else { return veils };
        let phase = phase(self.sun.dot(&toward));
        let mut march = March { transmittance: 1.0, sun: 0.0, sky: 0.0 };
        let mut remaining = &order[..];
        traversal::march(self.fogs, (eye, toward), farthest, MAX_STEP, |from, to, positions| {
            let (mut extinction, mut sun, mut sky) = (0.0f64, 0.0, 0.0);
            for position in positions {
                let fog_extinction =
                    f64::from(self.fogs[position.fog].extinction(position.block, position.local));
                if fog_extinction > 0.0 {
                    let lit = self.at(*position);
                    // The fourth root is the transmittance of a quarter of the path.
                    let deep = f64::from(lit.sun).sqrt().sqrt();
                    sun += fog_extinction
                        * f64::from(lit.unblocked)
                        * (phase * f64::from(lit.sun) + MULTIPLE_SCATTERING * deep);
                    sky += fog_extinction * f64::from(lit.sky);
                    extinction += fog_extinction;
                }
            }
            let to_end = |march: &March, end: f64| match extinction > 0.0 {
                true => march.after(extinction * (end - from), sun / extinction, sky / extinction),
                false => *march,
            };
            while let [next, others @ ..] = remaining
                && distances[*next] < to
            {
                veils[*next] = to_end(&march, distances[*next].max(from)).veil();
                remaining = others;
            }
            march = to_end(&march, to);
            march.transmittance > OPAQUE
        });
        if march.transmittance <= OPAQUE {
            march.transmittance = 0.0;
        }
        remaining.iter().for_each(|n| veils[*n] = march.veil());
        veils
    }
}

/// State of a march along a ray.
#[derive(Clone, Copy)]
struct March {
    /// Share of the light that passes so far.
    transmittance: f64,
    /// Light of the sun and of the sky added so far, relative to their full strength.
    sun: f64,
    sky: f64,
}

impl March {
    /// The state after a segment with this optical depth and these sources of light.
    fn after(self, depth: f64, sun: f64, sky: f64) -> Self {
        let passed = libm::exp(-depth);
        let added = self.transmittance * (1.0 - passed);
        Self {
            transmittance: self.transmittance * passed,
            sun: self.sun + added * sun,
            sky: self.sky + added * sky,
        }
    }

    fn veil(self) -> Veil {
        // A white surface that faces the sun has the radiance E / pi = `SUN`; light that is scattered evenly into all
        // directions has E / (4 pi).
        Veil { transmittance: self.transmittance, light: SUN * (0.25 * self.sun) + SURROUNDINGS * self.sky }
    }
}

/// Light that is scattered by an angle with this cosine, relative to the mean over all angles.
fn phase(cosine: f64) -> f64 {
    let g = ASYMMETRY;
    let spread = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (spread * spread.sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::blocks::{Fog, Part, Placement};
    use super::*;
    use crate::numeric::blocks::{Mask, Origin, Values};
    use crate::{Context, Pool};

    const CELL: f64 = 0.05;
    const EXTINCTION: f64 = 1.5;

    fn ctx(threads: usize) -> Context {
        Context::new(Pool::new(threads).unwrap())
    }

    /// A slab of density 1 that is 16 voxels thick along x, and 64 wide: from (0, 0, 0) to (16, 64, 64).
    fn slab(ctx: &Context, density: &Values, mask: &Mask) -> Fog {
        let positions = (0..2).flat_map(|x| (0..8).flat_map(move |y| (0..8).map(move |z| [x, y, z])));
        let part = |at: [i32; 3]| (at.map(|at| 8 * at), Part::Dense(density, mask));
        fog(ctx, positions.map(part).collect())
    }

    fn fog(ctx: &Context, parts: Vec<(Origin, Part<'_>)>) -> Fog {
        let axes = [DVec3::x() * CELL, DVec3::y() * CELL, DVec3::z() * CELL];
        Fog::of_parts(ctx, Placement::new(DVec3::zeros(), axes).unwrap(), parts, EXTINCTION).unwrap()
    }

    fn lit<'a>(ctx: &Context, fogs: &'a [Fog]) -> LitFogs<'a> {
        let sun = DVec3::new(1.0, 2.0, 0.5).normalize();
        LitFogs::new(ctx, fogs, sun, |_, _| false).unwrap()
    }

    #[test]
    fn the_transmittance_of_a_slab_follows_beer_and_lambert() {
        let ctx = ctx(1);
        let fogs = [slab(&ctx, &[1.0; 512], &[u64::MAX; 8])];
        let lit = lit(&ctx, &fogs);
        for toward in [DVec3::x(), DVec3::new(1.0, 0.2, -0.3).normalize()] {
            let middle = DVec3::new(7.5, 31.5, 31.5) * CELL;
            let eye = middle - toward * 3.0;
            let thickness = 16.0 * CELL / toward.x;
            // Behind the slab, and in the middle of it.
            let [behind, inside, before] = lit.veils(eye, toward, [f64::INFINITY, 3.0, 1.0]);
            for (veil, path) in [(behind, thickness), (inside, 0.5 * thickness), (before, 0.0)] {
                let expected = libm::exp(-EXTINCTION * path);
                assert!(
                    (veil.transmittance / expected - 1.0).abs() < 0.01,
                    "{} {expected}",
                    veil.transmittance
                );
            }
            assert_eq!(before, Veil::NONE);
            assert!(behind.light.x > inside.light.x && inside.light.x > 0.1);
        }
    }

    #[test]
    fn overlapping_fogs_add_up_and_even_blocks_are_as_others() {
        let ctx = ctx(1);
        let even = |density: f32| {
            let positions = (0..2).flat_map(|x| (0..8).flat_map(move |y| (0..8).map(move |z| [x, y, z])));
            fog(&ctx, positions.map(|at| (at.map(|at| 8 * at), Part::Uniform(density))).collect())
        };
        let one = [even(0.75)];
        let three = [even(0.25), slab(&ctx, &[0.25; 512], &[u64::MAX; 8]), even(0.25)];
        let toward = DVec3::new(0.9, -0.3, 0.2).normalize();
        let eye = DVec3::new(7.5, 31.5, 31.5) * CELL - toward * 3.0;
        let [of_one, of_three] =
            [&one[..], &three].map(|fogs| lit(&ctx, fogs).veils(eye, toward, [3.1, 9.0]));
        for (a, b) in of_one.iter().zip(&of_three) {
            assert!(
                (a.transmittance - b.transmittance).abs() < 1e-5 && (a.light - b.light).norm() < 1e-4,
                "{a:?} {b:?}"
            );
        }
    }

    #[test]
    fn the_sun_comes_through_to_what_is_behind_a_fog() {
        let ctx = ctx(1);
        let fogs = [slab(&ctx, &[1.0; 512], &[u64::MAX; 8])];
        let lit = LitFogs::new(&ctx, &fogs, DVec3::x(), |_, _| false).unwrap();
        let at = |x: f64| lit.sunlight(DVec3::new(x, 31.5, 31.5) * CELL, DVec3::x());
        let expected = libm::exp(-EXTINCTION * 16.0 * CELL);
        assert!((at(-10.0) / expected - 1.0).abs() < 0.01, "{} {expected}", at(-10.0));
        assert_eq!(at(40.0), 1.0);
        assert_eq!(lit.sunlight(DVec3::new(-1.0, 9.0, 0.0), DVec3::x()), 1.0);
    }

    #[test]
    fn voxels_that_are_not_active_are_empty_and_far_ones_are_refused() {
        let ctx = ctx(1);
        let fogs = [slab(&ctx, &[1.0; 512], &[0; 8])];
        assert!(fogs[0].is_empty() && fogs[0].bounds().is_none());
        let eye = DVec3::new(-1.0, 1.6, 1.6);
        for toward in [DVec3::x(), DVec3::new(1.0, 0.3, 0.2).normalize()] {
            assert_eq!(lit(&ctx, &fogs).veils(eye, toward, [9.0]), [Veil::NONE]);
        }
        let axes = [DVec3::x(), DVec3::y(), DVec3::z()];
        let placement = Placement::new(DVec3::zeros(), axes).unwrap();
        let far = vec![([0; 3], Part::Uniform(1.0)), ([1 << 28; 3], Part::Uniform(1.0))];
        assert!(Fog::of_parts(&ctx, placement, far, 1.0).is_err());
        let edge = vec![([i32::MIN; 3], Part::Uniform(1.0))];
        assert!(Fog::of_parts(&ctx, placement, edge, 1.0).is_err());
        assert!(Placement::new(DVec3::zeros(), [DVec3::x(), DVec3::x(), DVec3::z()]).is_none());
    }

    #[test]
    fn the_phase_function_conserves_energy() {
        let steps = 20_000;
        let mean: f64 = (0..steps).map(|n| phase((f64::from(n) + 0.5) / f64::from(steps) * 2.0 - 1.0)).sum();
        assert!((mean / f64::from(steps) - 1.0).abs() < 1e-6);
        assert!(phase(1.0) > phase(0.0) && phase(0.0) > phase(-1.0));
    }
}
