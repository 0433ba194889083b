//! Wind that varies in space.

use super::coarse_grid;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::flow::Flow;
use crate::geometry::DVec3;
use crate::snow::mist::params::FASTEST_WIND;

/// Half-life (s) of the difference between the air and the wind.
const RESPONSE: f64 = 0.1;

/// The wind's velocity (m/s) at positions (m).
pub type Sampler<'a> = dyn Fn(&Context, &[DVec3]) -> Result<Vec<[f32; 3]>> + Sync + 'a;

/// Wind that varies in space: where there is mist, the difference between the air and the wind halves in a tenth of a second. It is sampled
/// at every fourth cell.
pub struct Wind<'a>(pub &'a Sampler<'a>);

impl Wind<'_> {
    /// Relaxes the air towards the wind's velocity for `dt` (s).
    ///
    /// # Errors
    /// A velocity that is not finite or is over [`FASTEST_WIND`]; errors of the sampler.
    pub fn blow(&self, ctx: &Context, flow: &mut Flow, dt: f64) -> Result<()> {
        let cell = f64::from(flow.cell());
        let tiles = &flow.tiles().coords()[..flow.tiles().active()];
        let positions: Vec<DVec3> =
            tiles.iter().flat_map(|tile| coarse_grid::positions(*tile, cell)).collect();
        let values = (self.0)(ctx, &positions)?;
        let is_calm = |value: &[f32; 3]| value.iter().all(|speed| speed.abs() <= FASTEST_WIND as f32);
        if let Some(at) = values.iter().position(|value| !is_calm(value)) {
            let [x, y, z] = positions[at].into();
            let what =
                format!("the wind at ({x:.3}, {y:.3}, {z:.3}) m is not within {FASTEST_WIND} m/s of 0");
            return Err(Error::argument(what));
        }
        let values: Vec<[[f32; 3]; coarse_grid::POSITIONS]> = values.as_chunks().0.to_vec();
        let share = 1.0 - libm::exp2(-dt / RESPONSE) as f32;
        coarse_grid::change(flow, &values, |old, wind| old + share * (wind - old));
        Ok(())
    }
}
