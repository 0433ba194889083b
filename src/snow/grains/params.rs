//! Parameters of grains.

use super::solver::collide::Coefficients;
use super::solver::density;
use super::solver::rest::Rest;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::checks::ensure;
use crate::snow::grain_friction;

/// How snow becomes grains and how they behave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Radius of a grain (m), 1e-5..=1 (thesis table 3.1: a third of a cell).
    pub radius: f64,
    /// Compression ratio r_c (thesis section 3.3.2), 0..=1: the share of removed snow that does not become grains.
    pub compression: f64,
    /// Friction between grains, 0..=1: see [`grain_friction`].
    pub friction: f64,
    /// Largest attraction between two grains that almost touch, in weights of a grain, 0..=1000.
    pub attraction: f64,
    /// Share of the speed that grains keep when they bounce off each other or off a collider, 0..=1.
    pub restitution: f64,
    /// Share of the velocity that a grain keeps in a second (beta, thesis section 3.3.1), 0..=1.
    pub air: f64,
    /// Whether grains with neighbours feel less drag (thesis section 3.8): in proportion to how many of six neighbours are
    /// missing.
    pub air_by_density: bool,
    /// Gravity along y (m/s2), -1000..=1000; downward is negative.
    pub gravity: f64,
    /// Whether grains that lie still come to rest.
    pub rests: bool,
    /// Distance (m) from objects and fast grains beyond which slow grains rest at once (thesis section 3.3.3), 1e-5..=1e5;
    /// none: all grains lie still first. No effect if `rests` is false.
    pub active_distance: Option<f64>,
    /// Count of sub-steps in a step; none: the rule of [`Params::sub_steps`].
    pub sub_steps: Option<u32>,
    /// Age (s) at which a grain is removed, at the end of a frame; none: never.
    pub lifetime: Option<f64>,
    /// Minimum and maximum corner (m) of a box; grains outside are removed; none: no box.
    pub keep_box: Option<[DVec3; 2]>,
    /// Maximum number of grains; more are an error.
    pub max_grains: usize,
    /// Seed of the positions of new grains.
    pub seed: u64,
}

/// Maximum g dt^2 / d of a sub-step: a grain that starts to fall moves by at most this fraction of its diameter.
const FALL: f64 = 0.02;
/// Maximum displacement of an object in a sub-step (diameters).
const MAX_OBJECT_STEP: f64 = 2.0;
/// Maximum factor by which fast objects raise the count of sub-steps.
const MAX_FACTOR: usize = 8;

impl Params {
    /// The look of the thesis for a layer with cells of `cell` m: the radius is a third of a cell.
    pub fn for_cell(cell: f64) -> Self {
        Self {
            radius: cell / 3.0,
            compression: 0.75,
            friction: grain_friction::of_repose(32.0, false),
            attraction: 0.0,
            restitution: 0.0,
            air: 0.5,
            air_by_density: false,
            gravity: -9.81,
            rests: true,
            active_distance: None,
            sub_steps: None,
            lifetime: None,
            keep_box: None,
            max_grains: 20_000_000,
            seed: 0,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the field and its range.
    pub fn validate(&self) -> Result<()> {
        let checks = [
            ("radius", self.radius, 1.0e-5, 1.0),
            ("compression", self.compression, 0.0, 1.0),
            ("friction", self.friction, 0.0, 1.0),
            ("attraction", self.attraction, 0.0, 1000.0),
            ("restitution", self.restitution, 0.0, 1.0),
            ("air", self.air, 0.0, 1.0),
            ("gravity", self.gravity, -1000.0, 1000.0),
        ];
        let wrong = checks.into_iter().find(|(_, value, low, high)| !(*low..=*high).contains(value));
        if let Some((name, value, low, high)) = wrong {
            return Err(Error::argument(format!("{name} = {value} must lie in {low} to {high}")));
        }
        if let Some(distance) = self.active_distance.filter(|distance| !(1.0e-5..=1.0e5).contains(distance)) {
            return Err(Error::argument(format!(
                "active_distance = {distance} must lie in 0.00001 to 100000"
            )));
        }
        if let Some(lifetime) = self.lifetime.filter(|lifetime| lifetime.is_nan() || *lifetime <= 0.0) {
            return Err(Error::argument(format!("lifetime = {lifetime} must be over 0")));
        }
        let is_box = |[low, high]: &[DVec3; 2]| (0..3).all(|axis| low[axis] < high[axis]);
        ensure(
            self.keep_box.is_none_or(|bounds| is_box(&bounds)),
            "keep_box must be x0, y0, z0, x1, y1, z1 with x0 < x1, y0 < y1, z0 < z1",
        )?;
        ensure(self.sub_steps != Some(0), "sub_steps must be at least 1")?;
        Ok(())
    }

    /// Count of sub-steps in a step of `dt` (s) in which objects move by at most `displacement` (m). A grain falls by at most 0.02 of
    /// its diameter in a sub-step, which keeps deep heaps dense; an object moves by at most two diameters, unless that needs
    /// more than eight times as many sub-steps.
    pub fn sub_steps(&self, dt: f64, displacement: f64) -> usize {
        if let Some(count) = self.sub_steps {
            return count as usize;
        }
        let diameter = 2.0 * self.radius;
        let for_fall = (dt * (self.gravity.abs() / (FALL * diameter)).sqrt()).ceil().max(1.0) as usize;
        let for_objects = (displacement / (MAX_OBJECT_STEP * diameter)).ceil() as usize;
        for_objects.clamp(for_fall, for_fall.saturating_mul(MAX_FACTOR))
    }

    /// Friction against the base layer. The base is snow too: grains stay on it up to their own angle of repose.
    pub fn friction_of_base(&self) -> f64 {
        libm::tan(grain_friction::repose_of(self.friction, self.attraction > 0.0).to_radians())
    }

    /// Constants of a sub-step.
    #[doc(hidden)]
    pub fn coefficients(&self, division: &Division) -> Coefficients {
        let dt = division.dt / division.sub_steps as f64;
        let up = if self.gravity == 0.0 { 0.0 } else { -self.gravity.signum() as f32 };
        let friction_of_sliding = if self.attraction > 0.0 { 1.0 } else { SLIDING_SHARE } * self.friction;
        Coefficients {
            dt: dt as f32,
            diameter: (2.0 * self.radius) as f32,
            gravity: [0.0, self.gravity as f32, 0.0],
            up: [0.0, up, 0.0],
            air: (1.0 - libm::pow(self.air, dt)) as f32,
            air_by_neighbours: self.air_by_density.then(|| density::air_by_neighbours(self.air, dt)),
            friction: self.friction as f32,
            friction_of_sliding: friction_of_sliding as f32,
            slides: (SLIDES * self.gravity.abs() * 2.0 * self.radius) as f32,
            attraction: (self.attraction * self.gravity.abs() * dt) as f32,
            weight: (self.gravity.abs() * dt) as f32,
            restitution: self.restitution as f32,
            bouncing: (BOUNCING * self.gravity.abs() * dt) as f32,
            band: ATTRACTION_GAP,
            rest: self.rests.then(|| Rest::new(2.0 * self.radius, self.gravity, dt)),
            visits_all: false,
        }
    }
}

/// Friction between loose grains that slide over each other, as a share of that between grains that do not slide yet.
const SLIDING_SHARE: f64 = 0.8;
/// Square of the speed above which a grain slides, in diameters times gravity: the speed is a tenth of that at which it could rise by half
/// a diameter.
const SLIDES: f64 = 0.01;
/// Minimum approach speed of a bounce, as a multiple of the speed that gravity adds in a sub-step.
const BOUNCING: f64 = 4.0;
/// Maximum gap (diameters) at which grains attract each other.
const ATTRACTION_GAP: f32 = 0.05;

/// How a step is divided.
#[derive(Debug, Clone, Copy)]
pub struct Division {
    /// Length of the step (s).
    pub dt: f64,
    /// Count of sub-steps.
    pub sub_steps: usize,
}
