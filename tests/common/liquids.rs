//! Liquids whose motion is known, as particles, and meshes that ride on them.

use std::path::Path;

use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, TriMesh};
use frazil::io::{mesh, particles};
use frazil::surface::{Implicit, Isosurface, Params, Particles, SUPPORT, Tracker};
use frazil::{Context, Pool};

use super::shapes::sphere;

/// Writes particles at positions (m), numbered from `first_id` on.
pub fn write_numbered(path: &Path, positions: &[DVec3], first_id: i64) {
    let mut points = Points::at(1.0, positions).expect("points");
    points.set("id", Values::Long(Column::Each((first_id..first_id + positions.len() as i64).collect())));
    particles::write(path, &points, false).expect("a file");
}

/// A context with threads of its own.
pub fn context(threads: usize) -> Context {
    Context::new(Pool::new(threads).expect("threads"))
}

/// The surface of particles at these positions (m) with cells of half a spacing (m), as the tracker has it.
pub fn own_surface(ctx: &Context, positions: &[DVec3], spacing: f64) -> TriMesh {
    surface_on(ctx, positions, spacing, 0.5)
}

/// The surface of particles at these positions (m) on cells of an edge (spacings).
pub fn surface_on(ctx: &Context, positions: &[DVec3], spacing: f64, cell: f64) -> TriMesh {
    let phi = Implicit::new(ctx, positions, spacing, cell * spacing).expect("a surface");
    Isosurface::new(&phi).mesh(&phi)
}

/// Numbers from -1 to 1, the same in each run.
pub struct Random(pub u64);

impl Random {
    /// The next one.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    /// A vector in a cube of twice `size`.
    pub fn vector(&mut self, size: f64) -> DVec3 {
        let mut next = || size * self.next();
        DVec3::new(next(), next(), next())
    }
}

/// Positions of particles on a grid of a spacing (m), moved by up to `jitter` (spacings), where the grid's positions are inside.
pub fn filled(spacing: f64, jitter: f64, size: f64, is_inside: impl Fn(DVec3) -> bool) -> Vec<DVec3> {
    let mut random = Random(1);
    let count = (size / spacing).ceil() as i32;
    let mut out = Vec::new();
    for x in -count..=count {
        for y in -count..=count {
            for z in -count..=count {
                let position =
                    (DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + DVec3::repeat(0.5)) * spacing;
                let moved = random.vector(jitter * spacing);
                if is_inside(position) {
                    out.push(position + moved);
                }
            }
        }
    }
    out
}

/// Particles with ids from 0 on.
pub fn numbered(positions: Vec<DVec3>) -> Particles {
    let ids = (0..positions.len() as i64).collect();
    Particles { positions, ids, velocities: Vec::new() }
}

/// A ball of liquid: its spacing (m), particles, and a mesh around it with ripples of `detail` spacings.
pub struct Ball {
    pub spacing: f64,
    pub positions: Vec<DVec3>,
    pub mesh: TriMesh,
}

/// A ball with a radius of so many spacings, and a mesh of 12 n^2 triangles.
pub fn ball(radius: f64, n: usize, detail: f64) -> Ball {
    let spacing = 0.01;
    let size = radius * spacing;
    let positions = filled(spacing, 0.1, size, |position| position.norm() <= size);
    let mut mesh = sphere(1.0, n);
    for position in &mut mesh.positions {
        let unit = position.normalize();
        let wave = libm::sinf(9.0 * unit.x) * libm::sinf(9.0 * unit.y) * libm::sinf(9.0 * unit.z);
        *position = unit * (size + detail * f64::from(wave) * spacing) as f32;
    }
    Ball { spacing, positions, mesh }
}

/// The function of Solenthaler et al. (2007) at a position (m), with the thickness of thin liquids, summed over all particles; for
/// cells of half a spacing.
pub fn plain_phi(positions: &[DVec3], spacing: f64, at: DVec3) -> f64 {
    let radius = SUPPORT * spacing;
    let mean = |at: DVec3| {
        let weight =
            |position: &DVec3| (1.0 - (position - at).norm_squared() / (radius * radius)).max(0.0).powi(3);
        let sum: f64 = positions.iter().map(weight).sum();
        positions.iter().map(|position| position * weight(position)).sum::<DVec3>() / sum
    };
    // The derivative by differences.
    let step = 1e-5 * spacing;
    let column = |axis: usize| {
        let mut by = DVec3::zeros();
        by[axis] = step;
        (mean(at + by) - mean(at - by)) / (2.0 * step)
    };
    let rate = nalgebra::Matrix3::from_columns(&[column(0), column(1), column(2)]);
    let most = ((rate + rate.transpose()) * 0.5).symmetric_eigenvalues().max();
    let g = ((3.5 - most) / 3.1).clamp(0.0, 1.0);
    let share = if most < 0.4 { 1.0 } else { g.powi(3) - 3.0 * g * g + 3.0 * g };
    let (offset, away) = plain_offset(positions, spacing, at, mean(at) - at);
    away - offset.min(spacing * share)
}

/// How far from the mean the surface of a thin liquid lies at a position, and how far that mean is if the way along a sheet counts less (m).
fn plain_offset(positions: &[DVec3], spacing: f64, at: DVec3, mean: DVec3) -> (f64, f64) {
    // Farther than a cell from any surface.
    if mean.norm() > 1.5 * spacing {
        return (spacing, mean.norm());
    }
    let square = (SUPPORT * spacing).powi(2);
    let near: Vec<(f64, DVec3)> = positions
        .iter()
        .map(|position| position - at)
        .filter(|d| d.norm_squared() < square)
        .map(|d| ((1.0 - d.norm_squared() / square).powi(2), d))
        .collect();
    let weight: f64 = near.iter().map(|(weight, _)| weight).sum();
    let middle = near.iter().map(|(weight, d)| d * *weight).sum::<DVec3>() / weight;
    let covariance = near
        .iter()
        .map(|(weight, d)| (d - middle) * (d - middle).transpose() * *weight)
        .sum::<nalgebra::Matrix3<f64>>()
        / weight;
    let eigen = covariance.symmetric_eigen();
    let mut along: Vec<f64> = eigen.eigenvalues.iter().map(|x| x.max(spacing * spacing / 12.0)).collect();
    along.sort_unstable_by(f64::total_cmp);
    let q = 1.0 - mean.norm_squared() / square;
    // A full sheet of thickness 1 has this weight, and these variances along it.
    let (sheet, full) = (std::f64::consts::PI * square * q.powi(3) / 3.0, square * q / 8.0);
    let thick = weight * spacing.powi(3) / sheet * full / (along[1] * along[2]).sqrt();
    // Of cells of half a spacing.
    let half = |variance: &f64| {
        (thick.max((12.0 * variance.max(0.0)).sqrt()) / 2.0).clamp(0.125f64.sqrt() * spacing, spacing)
    };
    let halves: Vec<f64> = eigen.eigenvalues.iter().map(half).collect();
    let least = halves.iter().copied().fold(spacing, f64::min);
    if least == spacing {
        return (spacing, mean.norm());
    }
    let [across, along] = [spacing, least].map(|other| {
        let of = |axis: usize| {
            let part = eigen.eigenvectors.column(axis).dot(&mean) / halves[axis];
            part * part * ((halves[axis] - other) / (spacing - least)).abs()
        };
        (0..3).map(of).sum::<f64>()
    });
    (least, least * (across + along.powf(spacing / least)).sqrt())
}

/// Two clouds of trembling particles with a gap between them, where the mean of the positions around moves fast.
pub fn two_clouds(spacing: f64) -> Vec<DVec3> {
    let mut positions = filled(spacing, 0.3, 5.0 * spacing, |position| position.norm() < 4.5 * spacing);
    let other = filled(spacing, 0.3, 5.0 * spacing, |position| position.norm() < 3.0 * spacing);
    positions.extend(other.iter().map(|at| at + DVec3::new(9.5, 1.0, 0.0) * spacing));
    positions
}

/// Writes a ball's cache, NAME.0001.bgeo and so on, in which it travels, and its mesh as NAME.ply.
pub fn write_cache(folder: &Path, name: &str, ball: &Ball, frames: i32) {
    for frame in 1..=frames {
        let by = DVec3::new(0.002, -0.001, 0.0) * f64::from(frame - 1);
        let positions: Vec<DVec3> = ball.positions.iter().map(|position| position + by).collect();
        write_numbered(&folder.join(format!("{name}.{frame:04}.bgeo")), &positions, 0);
    }
    mesh::write(&folder.join(format!("{name}.ply")), &ball.mesh).expect("a file");
}

/// How far vertices are from where they should be (spacings): mean, 95th percentile, greatest; and how many were flagged in all.
#[derive(Debug, Clone, Copy)]
pub struct Errors {
    pub mean: f64,
    pub p95: f64,
    pub most: f64,
    pub flagged: usize,
}

/// Lets a mesh follow particles for some frames; `motion` says where a position of the first frame is in another.
pub fn follow(
    ctx: &Context,
    ball: &Ball,
    params: Params,
    frames: usize,
    motion: impl Fn(DVec3, usize) -> DVec3,
) -> (Tracker, Errors) {
    let at =
        |frame: usize| numbered(ball.positions.iter().map(|position| motion(*position, frame)).collect());
    let mut tracker = Tracker::new(ctx, params, &ball.mesh, &at(0)).expect("a tracker");
    let mut flagged = 0;
    for frame in 0..frames {
        let report = tracker.step(ctx, &at(frame), &at(frame + 1), 1.0 / 24.0).expect("a step");
        flagged += report.flagged();
    }
    let mut off: Vec<f64> = tracker
        .vertices()
        .iter()
        .zip(&ball.mesh.positions)
        .map(|(vertex, first)| (vertex - motion(first.cast(), frames)).norm() / ball.spacing)
        .collect();
    off.sort_unstable_by(f64::total_cmp);
    let errors = Errors {
        mean: off.iter().sum::<f64>() / off.len() as f64,
        p95: off[off.len() * 95 / 100],
        most: off[off.len() - 1],
        flagged,
    };
    (tracker, errors)
}

/// Turns a position about an axis through the origin by an angle (rad), and moves it.
pub fn turned(position: DVec3, angle: f64, by: DVec3) -> DVec3 {
    let axis = DVec3::new(1.0, 2.0, 0.5).normalize();
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    position * cosine + axis.cross(&position) * sine + axis * (axis.dot(&position) * (1.0 - cosine)) + by
}

/// Where a position is after some of 100 frames in which all turns once and travels.
pub fn once_around(position: DVec3, frame: usize) -> DVec3 {
    let share = frame as f64 / 100.0;
    turned(position, std::f64::consts::TAU * share, DVec3::new(0.4, -0.3, 0.2) * share)
}
