//! Bounding boxes.

use std::borrow::Borrow;

use crate::geometry::DVec3;

/// Minimum and maximum corner of the box around positions; minimum above maximum if there are none.
pub(super) fn bounds(positions: impl IntoIterator<Item = impl Borrow<DVec3>>) -> [DVec3; 2] {
    let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
    let with = |[low, high]: [DVec3; 2], position: &DVec3| [low.inf(position), high.sup(position)];
    positions.into_iter().fold(none, |bounds, position| with(bounds, position.borrow()))
}
