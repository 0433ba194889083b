//! The length of steps, and the coefficients that all pipes share in a step (thesis 4.3, Fig. 4.12).

use std::ops::RangeInclusive;

use super::columns::grid::TOP;
use super::params::{Friction, Params, Section, TimeStepping};
use super::solver::fast_films::FAST_WAVES;
use super::solver::rest::Bounds;
use super::solver::viscous_flux::{Step, Thinning};

/// Steps are shorter than the stability limit by this factor.
const SAFETY: f64 = 0.9;
/// Maximum count of steps in a frame: a frame that needs more is refused.
pub const MAX_STEPS: u32 = 1_000_000;
/// Range of lengths of frames, and of the steps of a replay (s). In shorter ones nothing would move, and coefficients would exceed single
/// precision.
pub const LENGTHS: RangeInclusive<f64> = 1e-12..=1e6;

/// Properties of the domain that steps depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Edge of a cell (m).
    pub cell: f64,
    /// A unit of height (m).
    pub unit: f64,
    /// Maximum count of pipes of a column.
    pub pipes: usize,
    /// Surface of the liquid at rest beyond the border (units), or BOTTOMLESS.
    pub still_level: i32,
}

/// The longest stable step (s) for liquid of a depth (m): the largest dt with P g A' dt^2 / dx^2 <= 1/q + zeta, for P pipes a column, with
/// 1/q = 1 + 3 dt nu / H^2 and A' = H (dx with [`Section::Whole`]). With four pipes and no loss this is dt = dx / (c sqrt 2). Infinite
/// where nothing limits it, as on dry ground. `frame` is the time left in the frame (s).
pub fn longest_stable(params: &Params, measures: &Measures, depth: f64, frame: f64) -> f64 {
    let g = -params.gravity[1];
    let height = if params.section == Section::Wetted { depth } else { measures.cell };
    let a = measures.pipes as f64 * g * height / (measures.cell * measures.cell);
    let b = if depth > 0.0 { 3.0 * min_viscosity(params) / (depth * depth) } else { 0.0 };
    let c = 1.0 + libm::pow(params.kept, frame);
    if a <= 0.0 || !b.is_finite() {
        return f64::INFINITY;
    }
    SAFETY * (b + (b * b + 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// The minimum viscosity (m2/s) of the liquid.
fn min_viscosity(params: &Params) -> f64 {
    let times = params.thickening.map_or(1.0, |law| law.times.min(1.0));
    params.liquid.min_viscosity() * times
}

/// The maximum depth (m) in a pipe's section at which steps of `dt` are stable without viscosity.
fn deepest_section(params: &Params, measures: &Measures, dt: f64) -> f64 {
    let waves = measures.pipes as f64 * -params.gravity[1] * dt * dt / (measures.cell * measures.cell);
    SAFETY * SAFETY * (1.0 + libm::pow(params.kept, dt)) / waves
}

/// State of the frame when its next step is chosen.
pub struct FrameProgress<'a> {
    /// Parameters.
    pub params: &'a Params,
    /// Measures of the domain.
    pub measures: &'a Measures,
    /// Time left in the frame (s).
    pub left: f64,
    /// Maximum depth (m).
    pub deepest: f64,
    /// Steps made in this frame.
    pub steps: u32,
    /// Length of the last step (s).
    pub last: f64,
    /// How many times steps are halved, for fast films.
    pub halvings: u32,
}

/// A step is as long as the last one while that is stable and at least this part of the longest stable length: each change of the length
/// adds energy to waves.
const STEADY: f64 = 0.45;

/// The length of the next step (s).
pub fn next_length(progress: &FrameProgress) -> f64 {
    let halved = f64::from(1 << progress.halvings);
    let longest = match progress.params.pace {
        TimeStepping::Exact => {
            let longest =
                longest_stable(progress.params, progress.measures, progress.deepest, progress.left) / halved;
            if (STEADY * longest..=longest).contains(&progress.last) { progress.last } else { longest }
        }
        TimeStepping::Realtime(longest) => longest / halved,
    };
    // Rounding of the time left must not add a step. Where nothing limits a step, it takes all the time left.
    progress.left / (progress.left / longest - 1e-9).ceil().max(1.0)
}

/// Maximum count of halvings of a step, which keep a disturbance in a fast film within a cell. Where they cannot, the film is limited.
pub fn max_halvings(params: &Params) -> u32 {
    if params.pace == TimeStepping::Exact { 3 } else { 0 }
}

/// Maximum transfer of a pipe of a fast film in a step, as part of the donor's depth. A disturbance travels at three times the film's speed
/// or, where that speed no longer grows with depth, at the film's own speed. If it travelled more than a cell in a step, it would grow.
const MAX_FILM_TRANSFER: f32 = 1.0 / 3.0;

/// Mean of phi^2, where phi is the profile of a film's velocity over its depth (`solver::lateral_friction`).
const MEAN_SQUARE_PROFILE: f64 = 1.2;

/// g unit dt^2 / dx^2 of a step (1 / units).
pub fn drive(params: &Params, measures: &Measures, dt: f64) -> f64 {
    let Measures { cell, unit, .. } = *measures;
    dt * dt * -params.gravity[1] * unit / (cell * cell)
}

/// Time (s) in which a surface that just counts as level brings liquid from rest to [`Params::rest`].
const LEVEL_TIME: f64 = 1.0 / 60.0;

/// Speed (m/s) below which liquid comes to rest. With wall friction, none does: flowing liquid drags along what is beside it.
fn rest_speed(params: &Params) -> f64 {
    if params.friction == Friction::Walls { 0.0 } else { params.rest }
}

/// Maximum difference of the surfaces of adjacent cells at which liquid comes to rest (units): at least a unit, or 0 if it never does.
fn rest_drop(params: &Params, measures: &Measures) -> i32 {
    let fall = rest_speed(params) * measures.cell / (LEVEL_TIME * -params.gravity[1]);
    if rest_speed(params) > 0.0 { (fall / measures.unit).round().clamp(1.0, 1e6) as i32 } else { 0 }
}

/// Maximum flux, divided by the depth in its section, at which liquid comes to rest in a step of `dt` (s). A surface that counts as level
/// never brings liquid from rest to a larger flux.
fn rest_flux(params: &Params, measures: &Measures, dt: f64) -> f64 {
    let driven = 1.001 * drive(params, measures, dt) * f64::from(rest_drop(params, measures));
    (rest_speed(params) * dt / measures.cell).max(driven)
}

/// What tilted gravity adds to the drop of the surface over a cell, along x and along z (units).
fn tilt(params: &Params, measures: &Measures) -> [i32; 2] {
    let [x, y, z] = params.gravity;
    [x, z].map(|along| (along / -y * measures.cell / measures.unit).round().clamp(-1e9, 1e9) as i32)
}

/// The bounds below which liquid rests, the same for all steps.
pub fn rest_bounds(params: &Params, measures: &Measures) -> Bounds {
    Bounds {
        rest_drop: rest_drop(params, measures),
        tilt: tilt(params, measures),
        still_level: measures.still_level,
    }
}

/// The coefficients that the pipes share in a step of `dt` after one of `last` (s).
pub fn step(params: &Params, measures: &Measures, dt: f64, last: f64) -> Step {
    let Measures { cell, unit, .. } = *measures;
    let y = params.gravity[1];
    let section = match (params.section, params.pace) {
        (Section::Whole, _) => cell / unit,
        (Section::Wetted, TimeStepping::Exact) => f64::from(TOP),
        (Section::Wetted, TimeStepping::Realtime(_)) => deepest_section(params, measures, dt) / unit,
    };
    Step {
        kept: (libm::pow(params.kept, dt) * dt / last) as f32,
        drive: drive(params, measures, dt) as f32,
        drag: (3.0 * dt * params.liquid.viscosity / (unit * unit)).min(1e36) as f32,
        section: section as f32,
        light_depth: (f64::from(FAST_WAVES) / drive(params, measures, dt)).min(1e36) as f32,
        max_film_transfer: MAX_FILM_TRANSFER,
        is_whole: params.section == Section::Whole,
        thinning: params.liquid.thinning.map(|law| Thinning {
            shear: (3.0 * law.time * cell / (last * unit)).min(1e30) as f32,
            thinnest: (law.thinnest / params.liquid.viscosity) as f32,
            power: ((law.power - 1.0) / 2.0) as f32,
        }),
        still_level: measures.still_level,
        wave: (dt / cell * (-y * unit).sqrt()) as f32,
        tilt: tilt(params, measures),
        lateral: match (params.friction, params.section) {
            (Friction::Walls, Section::Wetted) => {
                (MEAN_SQUARE_PROFILE * dt * params.liquid.viscosity / (cell * cell)).min(1e12) as f32
            }
            _ => 0.0,
        },
        step_ratio: (dt / last) as f32,
        cell: (cell / unit) as f32,
        rest_drop: rest_drop(params, measures),
        rest_flux: rest_flux(params, measures, dt) as f32,
    }
}
