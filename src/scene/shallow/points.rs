//! Sources, drains and absorbers of a scene, at its frames.

use super::{Point, Shallow};
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::shallow::{self, flows::FlowPoint};

impl Point {
    /// Its rate on the way to a frame (m3/s).
    fn rate(&self, frame: i32) -> f64 {
        if self.acts(frame) { self.point.rate } else { 0.0 }
    }
}

/// All of them, as they are on the way to a frame.
pub(super) fn at(of: &Shallow, frame: i32) -> Vec<FlowPoint> {
    of.points.iter().map(|point| FlowPoint { rate: point.rate(frame), ..point.point.clone() }).collect()
}

/// Puts them on a liquid's columns, as they are on the way to a frame.
///
/// # Errors
/// One that lies inside solid or beyond the area, with its name.
pub(super) fn place(scene: &Scene, of: &Shallow, liquid: &mut shallow::Shallow, frame: i32) -> Result<()> {
    let named = |index: usize| of.points[index].title();
    liquid.set_flows(&at(of, frame), named).map_err(|error| match error {
        Error::Argument(what) => Error::file(&scene.path, what),
        other => other,
    })
}

/// Opens and closes them, for the way to a frame.
///
/// # Errors
/// None.
pub(super) fn turn(of: &Shallow, liquid: &mut shallow::Shallow, frame: i32) -> Result<()> {
    for (index, point) in of.points.iter().enumerate() {
        if point.acts(frame) != point.acts(frame - 1) {
            liquid.set_rate(index, point.rate(frame))?;
        }
    }
    Ok(())
}
