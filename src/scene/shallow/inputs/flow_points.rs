//! Sources, drains and absorbers of a scene, frame by frame.

use crate::error::Result;
use crate::geometry::TriMesh;
use crate::scene::Scene;
use crate::scene::shallow::{Inputs, Point, Shallow};
use crate::shallow;
use crate::shallow::sources::FlowPoint;

impl Point {
    /// Its rate over the step to a frame (m3/s).
    fn rate(&self, frame: i32) -> f64 {
        if self.acts(frame) { self.point.rate } else { 0.0 }
    }
}

/// All points, as they are over the step to a frame; those that follow the terrain lie on its mesh of that frame, which is given if it
/// moves.
pub(in crate::scene::shallow) fn at(
    of: &Shallow,
    inputs: &Inputs,
    mesh: Option<&TriMesh>,
    frame: i32,
) -> Vec<FlowPoint> {
    let at = |(index, point): (usize, &Point)| {
        let on = inputs.attached.get(index).and_then(Option::as_ref).zip(mesh);
        let at = on.map_or(point.point.at, |(on, mesh)| on.position(mesh));
        FlowPoint { at, rate: point.rate(frame), ..point.point.clone() }
    };
    of.points.iter().enumerate().map(at).collect()
}

/// Sets the points on a liquid's columns at the first frame.
///
/// # Errors
/// A point inside solid or outside the area, with its name.
pub(in crate::scene::shallow) fn position(
    scene: &Scene,
    of: &Shallow,
    liquid: &mut shallow::Shallow,
    points: &[FlowPoint],
) -> Result<()> {
    let named = |index: usize| of.points[index].title();
    liquid.set_flows(points, named).map_err(|error| error.in_file(&scene.path))
}

/// Moves, opens and closes the points, from their last state to that over the step to the next frame.
///
/// # Errors
/// None.
pub(in crate::scene::shallow) fn turn(
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

/// The points that should act over the step to a frame but cannot, as they lie inside solid or outside the area.
pub(in crate::scene::shallow) fn resting<'a>(
    of: &'a Shallow,
    liquid: &'a shallow::Shallow,
    frame: i32,
) -> impl Iterator<Item = &'a Point> {
    let rests = move |(index, point): &(usize, &Point)| point.acts(frame) && liquid.is_resting(*index);
    of.points.iter().enumerate().filter(rests).map(|(_, point)| point)
}
