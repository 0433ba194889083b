//! Sources, drains and absorbers of a scene, frame by frame.

use crate::error::Result;
use crate::geometry::TriMesh;
use crate::scene::Scene;
use crate::scene::shallow::{Inputs, Shallow, TimedFlowPoint};
use crate::shallow;
use crate::shallow::sources::FlowPoint;

impl TimedFlowPoint {
    /// Its rate over the step to a frame (m3/s).
    fn rate(&self, frame: i32) -> f64 {
        if self.is_active(frame) { self.flow_point.rate } else { 0.0 }
    }
}

/// All points over the step to a frame. Points that follow the terrain lie on `mesh`, the terrain of that frame if it moves.
pub(in crate::scene::shallow) fn at_frame(
    setup: &Shallow,
    inputs: &Inputs,
    mesh: Option<&TriMesh>,
    frame: i32,
) -> Vec<FlowPoint> {
    let moved = |(index, point): (usize, &TimedFlowPoint)| {
        let on = inputs.attached.get(index).and_then(Option::as_ref).zip(mesh);
        let at = on.map_or(point.flow_point.at, |(on, mesh)| on.position(mesh));
        FlowPoint { at, rate: point.rate(frame), ..point.flow_point.clone() }
    };
    setup.points.iter().enumerate().map(moved).collect()
}

/// Adds the points to a liquid at the first frame.
///
/// # Errors
/// A point inside solid or outside the area, with its name.
pub(in crate::scene::shallow) fn add(
    scene: &Scene,
    setup: &Shallow,
    liquid: &mut shallow::Shallow,
    points: &[FlowPoint],
) -> Result<()> {
    let named = |index: usize| setup.points[index].title();
    liquid.set_flows(points, named).map_err(|error| error.in_file(&scene.path))
}

/// Updates the positions and rates of the points, from those of the last step to those of the next.
///
/// # Errors
/// None.
pub(in crate::scene::shallow) fn update(
    liquid: &mut shallow::Shallow,
    before: &[FlowPoint],
    now: &[FlowPoint],
) -> Result<()> {
    for (index, (before, now)) in before.iter().zip(now).enumerate() {
        if now.at != before.at {
            liquid.move_flow(index, now.at);
        }
        if now.rate != before.rate {
            liquid.set_rate(index, now.rate)?;
        }
    }
    Ok(())
}

/// The points that are active over the step to a frame but rest, as they lie inside solid or outside the area.
pub(in crate::scene::shallow) fn resting<'a>(
    setup: &'a Shallow,
    liquid: &'a shallow::Shallow,
    frame: i32,
) -> impl Iterator<Item = &'a TimedFlowPoint> {
    let rests =
        move |(index, point): &(usize, &TimedFlowPoint)| point.is_active(frame) && liquid.is_resting(*index);
    setup.points.iter().enumerate().filter(rests).map(|(_, point)| point)
}
