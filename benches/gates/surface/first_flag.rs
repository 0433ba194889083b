//! Gate of sets that merge, split, tear and close: how many frames after the particles' own surface changes a vertex is flagged, or
//! a part listed that the mesh does not cover (it has no vertices).

use frazil::Context;
use frazil::geometry::TriMesh;
use frazil::geometry::check::topology::components;
use frazil::surface::{Params, Tracker};

use crate::common::liquids::{context, numbered, own_surface};
use crate::common::made_sets::{Set, sets};

/// Initial distance between particles (m), and time between frames (s).
const SPACING: f64 = 0.01;
const FRAME: f64 = 1.0 / 24.0;
/// Most frames of a set.
const FRAMES: usize = 60;

pub fn measure() -> (f64, String) {
    let ctx = context(2);
    let mut lags = Vec::new();
    for set in sets() {
        let (change, flag) = frames(&ctx, &set);
        println!(
            "# {}: the particles' surface changes at frame {change:?}, the first flag is at {flag:?}",
            set.name
        );
        lags.push(match (change, flag) {
            (Some(change), Some(flag)) => flag.saturating_sub(change) as f64,
            (None, _) | (_, None) => FRAMES as f64,
        });
    }
    let worst = lags.iter().copied().fold(0.0, f64::max);
    (worst, format!("balls, dumbbell, sheet, bubble: {lags:?}"))
}

/// The first frame at which the particles' own surface has other parts or handles, and the first at which a step tells of it.
fn frames(ctx: &Context, set: &Set) -> (Option<usize>, Option<usize>) {
    let at = |frame: usize| {
        numbered(
            set.positions.iter().map(|position| (set.motion)(*position, frame as f64) * SPACING).collect(),
        )
    };
    let kind = |surface: &TriMesh| (components(&surface.triangles).len(), surface.euler_characteristic());
    let first = own_surface(ctx, &at(0).positions, SPACING);
    let begin = kind(&first);
    let mut tracker = Tracker::new(ctx, Params::for_spacing(SPACING), &first, &at(0)).expect("a tracker");
    let (mut change, mut flag) = (None, None);
    for frame in 1..FRAMES {
        let (from, to) = (at(frame - 1), at(frame));
        if change.is_none() && kind(&own_surface(ctx, &to.positions, SPACING)) != begin {
            change = Some(frame);
        }
        let report = tracker.step(ctx, &from, &to, FRAME).expect("a step");
        if flag.is_none() && report.flagged() + report.uncovered_parts.len() > 0 {
            flag = Some(frame);
        }
        if change.is_some() && flag.is_some() {
            break;
        }
    }
    (change, flag)
}
