//! Turbulence: eddies of a size push the air about. Their acceleration is the curl of three smooth noises, which neither gathers
//! nor spreads the air (Bridson, Houriham and Nordenstam 2007), carried along by the wind and changing with time.

use fastnoise_lite::{FastNoiseLite, NoiseType};
use rayon::prelude::*;

use super::{Params, coarse};
use crate::base::DVec3;
use crate::context::Context;
use crate::error::Result;
use crate::flow::Flow;

/// Curl of the noises, in units of their size, whose root mean square is 1 (measured by the test).
const UNIT: f64 = 0.231_8;
/// Share of its size over which a difference is taken.
const STEP: f64 = 0.05;
/// Way that an eddy's noise goes in a second, in units of its size, so that eddies come and go.
const CHANGE: f64 = 0.7;

/// The eddies act on the air for `dt` (s) from a time (s) on.
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
        Ok(coarse::places(*tile, cell).map(|place| {
            let push = eddies.curl(place) * (params.turbulence * dt);
            [push.x as f32, push.y as f32, push.z as f32]
        }))
    };
    let values: Result<Vec<[[f32; 3]; coarse::PLACES]>> = tiles.par_iter().with_min_len(8).map(at).collect();
    coarse::change(flow, &values?, |old, push| old + push);
    Ok(())
}

/// The noises at a time.
struct Eddies {
    noises: [FastNoiseLite; 3],
    size: f64,
    /// Where the noises have gone (m).
    shift: DVec3,
}

impl Eddies {
    fn new(params: &Params, time: f64) -> Self {
        let noise = |component: i32| {
            let mut noise = FastNoiseLite::with_seed(params.seed.wrapping_mul(3).wrapping_add(component));
            noise.set_noise_type(Some(NoiseType::OpenSimplex2));
            noise.set_frequency(Some(1.0));
            noise
        };
        let size = params.turbulence_size;
        // Each noise goes its own way: at rest, they would be the same eddies for ever.
        let shift = DVec3::from(params.wind) * time;
        Self { noises: [0, 1, 2].map(noise), size, shift: shift - DVec3::new(0.0, CHANGE * size * time, 0.0) }
    }

    /// A noise at a place (m), which goes along an axis of its own.
    fn potential(&self, component: usize, place: DVec3) -> f64 {
        let [x, y, z] = ((place - self.shift) / self.size).into();
        let turned = [[x, y, z], [y, z, x], [z, x, y]][component];
        f64::from(self.noises[component].get_noise_3d(turned[0], turned[1], turned[2]))
    }

    /// Their curl at a place (m), with a root mean square of 1.
    fn curl(&self, place: DVec3) -> DVec3 {
        let half = 0.5 * STEP * self.size;
        let slope = |component: usize, axis: usize| {
            let mut off = DVec3::zeros();
            off[axis] = half;
            (self.potential(component, place + off) - self.potential(component, place - off)) / STEP
        };
        UNIT * DVec3::new(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1))
    }
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
        let place = DVec3::new(0.31, 0.12, 0.77);
        let divergence: f64 = (0..3)
            .map(|axis| {
                let mut off = DVec3::zeros();
                off[axis] = h;
                (eddies.curl(place + off)[axis] - eddies.curl(place - off)[axis]) / (2.0 * h)
            })
            .sum();
        // Of a unit field of this size, slopes are about 1 / size = 5.
        assert!(divergence.abs() < 0.02, "{divergence}");
    }
}
