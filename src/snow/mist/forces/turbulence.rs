//! Turbulence: eddies of a given size push the air. Their acceleration is the curl of three smooth noises, which has no divergence
//! (Bridson, Houriham and Nordenstam 2007). The wind carries them along, and each set of noises fades into an independent one, so that
//! eddies come and go: noises that only move would keep the same eddies for ever.

use fastnoise_lite::{FastNoiseLite, NoiseType};
use rayon::prelude::*;

use super::coarse_grid;
use crate::context::Context;
use crate::error::Result;
use crate::flow::Flow;
use crate::geometry::DVec3;
use crate::snow::mist::Params;

/// Inverse of the root mean square of the noises' curl, with lengths in units of their size (the test measures it).
const CURL_SCALE: f64 = 0.231_8;
/// Finite-difference step, as a share of the size.
const STEP: f64 = 0.05;
/// Time (s) over which one set of noises fades into the next.
const LIFETIME: f64 = 0.7;

/// Accelerates the air by the eddies for `dt` (s), from a time (s) on.
///
/// # Errors
/// Cancel.
pub fn stir(ctx: &Context, flow: &mut Flow, params: &Params, time: f64, dt: f64) -> Result<()> {
    if params.turbulence == 0.0 {
        return Ok(());
    }
    let eddies = Eddies::new(params, time);
    let cell = f64::from(flow.cell());
    let tiles = &flow.tiles().coords()[..flow.tiles().active()];
    let at = |tile: &_| {
        ctx.check()?;
        Ok(coarse_grid::positions(*tile, cell).map(|position| {
            let push = eddies.curl(position) * (params.turbulence * dt);
            [push.x as f32, push.y as f32, push.z as f32]
        }))
    };
    let values: Result<Vec<[[f32; 3]; coarse_grid::POSITIONS]>> =
        tiles.par_iter().with_min_len(8).map(at).collect();
    coarse_grid::change(flow, &values?, |old, push| old + push);
    Ok(())
}

/// The noises at a time.
struct Eddies {
    /// Two sets of three, each with its weight: the squares of the weights sum to 1, so that the strength is constant.
    sets: [([FastNoiseLite; 3], f64); 2],
    size: f64,
    /// Displacement by the wind (m).
    shift: DVec3,
}

impl Eddies {
    fn new(params: &Params, time: f64) -> Self {
        let lives = time / LIFETIME;
        let first = lives.floor();
        let share = lives - first;
        // Both the weights and their rates of change are continuous.
        let angle = std::f64::consts::FRAC_PI_2 * share * share * (3.0 - 2.0 * share);
        let (rising, falling) = libm::sincos(angle);
        let set = |life: f64| [0, 1, 2].map(|component| noise(params.seed, life as i64, component));
        Self {
            sets: [(set(first), falling), (set(first + 1.0), rising)],
            size: params.turbulence_size,
            shift: DVec3::from(params.wind) * time,
        }
    }

    /// A noise at a position (m).
    fn potential(&self, component: usize, position: DVec3) -> f64 {
        let [x, y, z] = ((position - self.shift) / self.size).into();
        let of_set = |(noises, weight): &([FastNoiseLite; 3], f64)| match *weight {
            0.0 => 0.0,
            weight => weight * f64::from(noises[component].get_noise_3d(x, y, z)),
        };
        of_set(&self.sets[0]) + of_set(&self.sets[1])
    }

    /// The curl of the noises at a position (m), with a root mean square of 1.
    fn curl(&self, position: DVec3) -> DVec3 {
        let half = 0.5 * STEP * self.size;
        let slope = |component: usize, axis: usize| {
            let mut off = DVec3::zeros();
            off[axis] = half;
            (self.potential(component, position + off) - self.potential(component, position - off)) / STEP
        };
        CURL_SCALE
            * DVec3::new(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1))
    }
}

/// The noise of a component in a lifetime, independent of all others.
fn noise(seed: i32, life: i64, component: u64) -> FastNoiseLite {
    let mut noise = FastNoiseLite::with_seed(mixed(seed, life, component));
    noise.set_noise_type(Some(NoiseType::OpenSimplex2));
    noise.set_frequency(Some(1.0));
    noise
}

/// The seed of a component in a lifetime (Steele, Lea and Flood 2014: SplitMix64).
fn mixed(seed: i32, life: i64, component: u64) -> i32 {
    let mut state = (life as u64).wrapping_mul(3).wrapping_add(component);
    state = state.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ u64::from(seed as u32).wrapping_mul(0xd6e8_feb8_6659_fd93);
    state = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    state = (state ^ state >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (state ^ state >> 31) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_eddies_have_unit_strength_and_no_divergence() {
        let params = Params { turbulence: 1.0, turbulence_size: 0.2, ..Params::for_cell(0.01) };
        let eddies = Eddies::new(&params, 0.3);
        let (mut squares, mut count) = (0.0, 0.0);
        for index in 0..8000 {
            let at = DVec3::new(f64::from(index % 20), f64::from(index / 20 % 20), f64::from(index / 400));
            squares += eddies.curl(at * 0.083).norm_squared();
            count += 1.0;
        }
        let strength = f64::sqrt(squares / count);
        assert!((strength - 1.0).abs() < 0.03, "{strength}");
        let h = 0.5 * STEP * 0.2;
        let position = DVec3::new(0.31, 0.12, 0.77);
        let divergence: f64 = (0..3)
            .map(|axis| {
                let mut off = DVec3::zeros();
                off[axis] = h;
                (eddies.curl(position + off)[axis] - eddies.curl(position - off)[axis]) / (2.0 * h)
            })
            .sum();
        // In a unit field of this size, slopes are about 1 / size = 5.
        assert!(divergence.abs() < 0.02, "{divergence}");
    }

    /// The field (m/s2) at 24^3 points, a sixth of the size apart, at a time (s).
    fn sampled(params: &Params, time: f64) -> Vec<DVec3> {
        let eddies = Eddies::new(params, time);
        let at =
            |index: usize| DVec3::new((index / 576) as f64, (index / 24 % 24) as f64, (index % 24) as f64);
        (0..24usize.pow(3)).map(|index| eddies.curl(at(index) * (params.turbulence_size / 6.0))).collect()
    }

    /// The maximum correlation of two such fields over all shifts by up to 8 points on each axis.
    fn best_correlation(one: &[DVec3], other: &[DVec3]) -> f64 {
        let shifts =
            (-8i32..=8).flat_map(|x| (-8i32..=8).flat_map(move |y| (-8i32..=8).map(move |z| [x, y, z])));
        let of_shift = |[x, y, z]: [i32; 3]| {
            let (mut both, mut first, mut second) = (0.0, 0.0, 0.0);
            let range = |by: i32| (0.max(-by)..24.min(24 - by)).step_by(2);
            for i in range(x) {
                for j in range(y) {
                    for k in range(z) {
                        let a = one[(576 * i + 24 * j + k) as usize];
                        let b = other[(576 * (i + x) + 24 * (j + y) + k + z) as usize];
                        both += a.dot(&b);
                        first += a.norm_squared();
                        second += b.norm_squared();
                    }
                }
            }
            both / f64::sqrt(first * second)
        };
        shifts.map(of_shift).fold(-1.0, f64::max)
    }

    #[test]
    fn eddies_change_and_do_not_only_move() {
        let params = Params { turbulence: 1.0, turbulence_size: 0.2, seed: 3, ..Params::for_cell(0.01) };
        let first = sampled(&params, 0.25);
        let later = [0.05, 0.35, 0.7, 2.0].map(|by| best_correlation(&first, &sampled(&params, 0.25 + by)));
        assert!(later[0] > 0.95 && later.is_sorted_by(|a, b| a >= b), "{later:?}");
        // The rest is the chance correlation of two fields with this many eddies, at the best of 4,913 shifts.
        assert!(later[2] < 0.6 && later[3] < 0.4, "{later:?}");
        // From one set of noises to the next without a jump.
        for time in [0.0, LIFETIME, -LIFETIME, 3.0 * LIFETIME] {
            let [before, after] = [-1.0e-5, 1.0e-5].map(|by| sampled(&params, time + by));
            let farthest = before.iter().zip(&after).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(farthest < 1.0e-3, "{time}: {farthest}");
        }
        // The wind carries them along.
        let blown = Params { wind: [0.2 / 6.0 * 4.0, 0.0, 0.0], ..params };
        let best = best_correlation(&first, &sampled(&blown, 0.25));
        assert!(best > 0.8, "{best}");
    }
}
