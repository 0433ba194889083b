//! Gate of collapsing columns, against the experiments of Lube, Huppert, Sparks and Hallworth, "Axisymmetric collapses of
//! granular columns", Journal of Fluid Mechanics 508 (2004).
//!
//! Their final radius is the edge of the deposit, not the farthest stray. Here it is the mean over 36 sectors of the farthest
//! grain that a chain of touching grains connects to the middle.

use frazil::geometry::DVec3;
use frazil::snow::grain_friction::of_repose;

use crate::bins::Bins;
use crate::harness::Harness;
use crate::snow::grains::{Experiment, walls};

/// Diameter of a grain (m).
pub const D: f64 = 0.005;
/// Angle of repose (degrees): that of the materials in the paper.
const REPOSE: f64 = 31.0;
/// Approximate count of grains of a column.
const GRAINS: f64 = 20_000.0;
/// Largest distance (diameters) at which grains of the deposit touch.
const TOUCHING: f64 = 1.1;
/// Count of sectors of the deposit's edge.
const SECTORS: usize = 36;

pub fn run(h: &mut Harness) {
    compare(h, "snow.grains.column_runout", &[1.0, 2.0, 4.0], collapse);
}

/// Gate of the largest error (%) of run-outs. `collapse` returns that (radii) of a column of about an aspect ratio, and its own aspect
/// ratio.
pub fn compare(h: &mut Harness, name: &str, aspects: &[f64], collapse: impl Fn(f64) -> (f64, f64)) {
    if !h.wants(name) {
        return;
    }
    let error = |&aspect: &f64| {
        let (ran, aspect) = collapse(aspect);
        let expected = expected(aspect);
        println!("# aspect {aspect:.3}: {ran:.3} radii, after Lube et al. {expected:.3}");
        (ran / expected - 1.0) * 100.0
    };
    let errors: Vec<f64> = aspects.iter().map(error).collect();
    let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
    h.gate(name, worst, &format!("aspects {aspects:?}: {errors:.1?} %"));
}

/// Runout (radii) after Lube et al.
fn expected(aspect: f64) -> f64 {
    if aspect < 1.7 { 1.24 * aspect } else { 1.6 * aspect.sqrt() }
}

/// A column of about an aspect ratio and count of grains that has settled in a cylinder, the cylinder's radius and the mean height
/// of its top (m).
pub fn settled(aspect: f64, grains: f64) -> (Experiment, f64, f64) {
    let mut column = Experiment::new(2, D, of_repose(REPOSE, false), 3);
    column.params.air = 1.0;
    // The grains fill a cylinder of that aspect ratio at a packing of 0.6.
    let radius = (grains / (6.0 * 0.6 * aspect)).cbrt() * D;
    let corner = |n: usize| {
        let angle = n as f64 / 64.0 * std::f64::consts::TAU;
        [angle.cos() * radius, angle.sin() * radius]
    };
    let corners: Vec<[f64; 2]> = (0..64).map(corner).collect();
    column.colliders.shells = vec![walls(&corners, 20.0 * aspect * radius)];
    let across = (2.0 * radius / (1.16 * D)).ceil() as u32 + 1;
    let inside = |position: DVec3| position.xz().norm() < radius - 0.7 * D;
    let each = across * across * 4 / 5;
    column.scatter([across, 2 * grains as u32 / each, across], |position| {
        inside(position)
            && position.y < 1.16 * D * grains / (std::f64::consts::PI * (radius / (1.16 * D) - 0.6).powi(2))
    });
    let mut frames = 0;
    while frames < 24 || column.heap.fastest() > 0.02 && frames < 96 {
        column.step();
        frames += 1;
    }
    // Mean height of the top.
    let mut tops = std::collections::HashMap::new();
    for position in column.heap.positions() {
        let at = [position.x, position.z].map(|x| (x / (1.5 * D)).floor() as i32);
        let top = tops.entry(at).or_insert(0.0f64);
        *top = top.max(position.y + 0.5 * D);
    }
    let height = tops.values().sum::<f64>() / tops.len() as f64;
    println!("# {} grains, {:.1} radii high after {frames} frames", column.heap.count(), height / radius);
    column.colliders.shells.clear();
    (column, radius, height)
}

/// Runout (radii) of a column of about an aspect ratio, and its aspect ratio once settled.
fn collapse(aspect: f64) -> (f64, f64) {
    let (mut column, radius, height) = settled(aspect, GRAINS);
    column.stand_on_snow();
    let mut frames = 0;
    while frames < 24 || column.heap.fastest() > 0.02 && frames < 144 {
        column.step();
        frames += 1;
    }
    let positions: Vec<DVec3> = column.heap.positions().collect();
    let edge = edge(&positions);
    println!(
        "# {frames} frames later the edge lies at {:.2} radii, the slope is {:.1}",
        edge / radius,
        column.slope()
    );
    (edge / radius - 1.0, height / radius)
}

/// Radius (m) of the deposit of grains at some places.
pub fn edge(positions: &[DVec3]) -> f64 {
    let bins = Bins::new(positions, TOUCHING * D);
    let mut is_part = vec![false; positions.len()];
    let mut open: Vec<usize> =
        (0..positions.len()).filter(|index| positions[*index].xz().norm() < 3.0 * D).collect();
    open.iter().for_each(|index| is_part[*index] = true);
    while let Some(index) = open.pop() {
        bins.near(&positions[index], |other| {
            if !is_part[other] {
                is_part[other] = true;
                open.push(other);
            }
        });
    }
    let mut sectors = [0.0f64; SECTORS];
    for (position, _) in positions.iter().zip(&is_part).filter(|(_, is_part)| **is_part) {
        let angle = position.z.atan2(position.x) / std::f64::consts::TAU + 0.5;
        let sector = &mut sectors[(angle * SECTORS as f64) as usize % SECTORS];
        *sector = sector.max(position.xz().norm() + 0.5 * D);
    }
    let strays = is_part.iter().filter(|is_part| !**is_part).count();
    let most = far(positions, 0.99) / D;
    println!(
        "# {strays} strays; 99 % of the grains lie within {most:.1} diameters, all within {:.1}",
        far(positions, 1.0) / D
    );
    sectors.iter().sum::<f64>() / SECTORS as f64
}

/// Distance (m) from the axis within which a share of the grains lies.
fn far(positions: &[DVec3], share: f64) -> f64 {
    let mut distances: Vec<f64> = positions.iter().map(|position| position.xz().norm()).collect();
    distances.sort_by(f64::total_cmp);
    distances[((distances.len() - 1) as f64 * share) as usize]
}
