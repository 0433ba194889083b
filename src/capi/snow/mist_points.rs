//! Mist that a host's own points raise.

use super::grains::check_snow;
use super::mist::{HostInputs, frz_mist, frz_mist_report};
use crate::capi::ffi::*;
use crate::capi::grid::sparse::{Grid, frz_grid};
use crate::capi::level_set::body::frz_body;
use crate::capi::runtime::context::{frz_context, steps};
use crate::snow::mist::{Source, Start};

/// Moves mist through a step, and adds what points raise along their paths. Like frz_mist_step, but for a host that has its own grains or
/// base layer, or only files of them.
///
/// Each point is assumed to have moved at its final velocity for all of dt, even if it was hit or born during the step: where points begin
/// to fly this raises too much mist, and more with longer steps. A host that knows where points were should call frz_mist_step_paths.
///
/// positions: double[3] for each point at the step's end (m), finite, within 1e7 cells of the origin along each axis.
/// velocities: float[3] for each point (m/s), finite.
/// radius: of the points (m), above 0 and at most 64 cells.
/// snow: the snow around which the air flows, as it was before bodies pressed into it in this step: a level set whose grid is neither
///     rotated nor shifted relative to the world's axes. NULL: there is none.
/// wind: as for frz_mist_step.
/// bodies: as for frz_mist_step.
/// count: as for frz_mist_step.
/// time: as for frz_mist_step.
/// dt: as for frz_mist_step.
/// report: as for frz_mist_step.
///
/// One thread at a time; any number may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_step_points(
    context: *mut frz_context,
    mist: *mut frz_mist,
    positions: frz_view,
    velocities: frz_view,
    radius: f64,
    snow: *const frz_grid,
    wind: *const frz_grid,
    bodies: *const frz_body,
    count: usize,
    time: f64,
    dt: f64,
    report: *mut frz_mist_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        let raised = || sources(&points(("positions", positions), ("velocities", velocities))?, None, radius);
        step_along(context, mist, report, raised, [snow, wind], (bodies, count), [time, dt])
    }
}

/// Moves mist through a step, and adds what points raise along their paths. Like frz_mist_step_points, but for a host that knows where
/// points were before the step. For the same points and snow, the mist is the same as that of frz_mist_step, bit for bit.
///
/// positions_before: double[3] for each point at the step's beginning (m), as positions; for a point born in the step its position at
///     birth.
/// velocities_before: float[3] for each point at the step's beginning (m/s), finite; 0 for a point born in the step.
/// positions: as for frz_mist_step_points, of the same points in the same order.
/// velocities: as for frz_mist_step_points.
/// radius: as for frz_mist_step_points.
/// snow: as for frz_mist_step_points.
/// wind: as for frz_mist_step.
/// bodies: as for frz_mist_step.
/// count: as for frz_mist_step.
/// time: as for frz_mist_step.
/// dt: as for frz_mist_step.
/// report: as for frz_mist_step.
///
/// One thread at a time; any number may read a grid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_mist_step_paths(
    context: *mut frz_context,
    mist: *mut frz_mist,
    positions_before: frz_view,
    velocities_before: frz_view,
    positions: frz_view,
    velocities: frz_view,
    radius: f64,
    snow: *const frz_grid,
    wind: *const frz_grid,
    bodies: *const frz_body,
    count: usize,
    time: f64,
    dt: f64,
    report: *mut frz_mist_report,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        let raised = || {
            let starts =
                points(("positions_before", positions_before), ("velocities_before", velocities_before))?;
            let ends = points(("positions", positions), ("velocities", velocities))?;
            if starts.len() != ends.len() {
                let (before, after) = (starts.len(), ends.len());
                let text = format!("positions_before: {before} elements, but there are {after} positions");
                return Err(Failure::argument(text));
            }
            sources(&ends, Some(&starts), radius)
        };
        step_along(context, mist, report, raised, [snow, wind], (bodies, count), [time, dt])
    }
}

/// The body of an interface function that moves mist through a step, and adds what points raise.
///
/// # Safety
/// The pointers must be NULL or valid.
unsafe fn step_along(
    context: *mut frz_context,
    mist: *mut frz_mist,
    report: *mut frz_mist_report,
    raised: impl FnOnce() -> Outcome<Vec<Source>>,
    [snow, wind]: [*const frz_grid; 2],
    bodies: (*const frz_body, usize),
    [time, dt]: [f64; 2],
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    unsafe {
        steps(context, mist, report, |ctx, handle| {
            let snow = read_some(snow)?;
            let snow = snow.as_deref().map(Grid::floats).transpose()?;
            snow.map_or(Ok(()), |snow| check_snow("snow", snow))?;
            let wind = read_some(wind)?;
            let wind = wind.as_deref().map(Grid::vectors).transpose()?;
            handle.step(ctx, &raised()?, &HostInputs { snow, wind, bodies, time, dt })
        })
    }
}

/// Reads positions (m) and velocities (m/s) of points; their names are for messages.
///
/// # Safety
/// The views must describe memory that can be read.
unsafe fn points(
    (position_name, positions): (&str, frz_view),
    (velocity_name, velocities): (&str, frz_view),
) -> Outcome<Vec<Start>> {
    // SAFETY: guaranteed by the caller.
    let (positions, velocities) = unsafe {
        (positions.elements::<[f64; 3]>(position_name)?, velocities.elements::<[f32; 3]>(velocity_name)?)
    };
    if velocities.len() != positions.len() {
        let (velocities, positions) = (velocities.len(), positions.len());
        let text =
            format!("{velocity_name}: {velocities} elements, but there are {positions} {position_name}");
        return Err(Failure::argument(text));
    }
    let point = |(position, velocity): (&[f64; 3], &[f32; 3])| Start {
        position: (*position).into(),
        velocity: *velocity,
    };
    Ok(positions.iter().zip(&*velocities).map(point).collect())
}

/// Sources of mist from points of a radius (m) at the end of a step, and, if known, at its beginning.
fn sources(ends: &[Start], starts: Option<&[Start]>, radius: f64) -> Outcome<Vec<Source>> {
    within("radius", radius, f64::MIN_POSITIVE..=f64::MAX, " m")?;
    let source = |(index, end): (usize, &Start)| Source {
        position: end.position,
        velocity: end.velocity,
        radius,
        start: starts.map(|starts| starts[index]),
    };
    Ok(ends.iter().enumerate().map(source).collect())
}
