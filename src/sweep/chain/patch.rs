//! The surface of a stack of sheets.
//!
//! A body that turns about an axis of near symmetry sweeps hundreds of nearly coincident sheets; its surface is a mosaic of slivers, too
//! small to be sampled one by one. But it is smooth except at its edges, and lines through voxels meet it at least once per cell. Around
//! the spot of each meeting the plane of the exposed face approximates the surface, as far as the volume lies close behind the plane and
//! not in front of it.

use rayon::prelude::*;

use super::facet::Facet;
use super::prism::{Point, Prisms};
use crate::context::Context;
use crate::distance::lattice::{Fixed, UNITS};
use crate::distance::vectors::{cross, difference, dot};
use crate::error::Result;
use crate::sweep::signed_distance::bins::Bins;
use crate::sweep::signed_distance::exposure::{Exposure, Spot};

/// Maximum distance (cells) of the surface from a patch's plane.
const OFF: f64 = 0.04;
/// The same on the neighbouring lines, which are a cell away: the patch reaches only half as far.
const OFF_BESIDE: f64 = 2.0 * OFF;
/// Half the edge (cells, seen along its line) of a square patch, used where the neighbouring lines agree with its plane.
const HALF: f64 = 0.51;
/// Maximum radius (cells) of other patches.
const REACH: f64 = 1.0;
/// Bisections that find where the surface leaves a patch's plane: to 1/64 of [`REACH`].
const HALVINGS: usize = 4;
/// If a patch's mean radius, relative to [`REACH`], is less than this, its whole face becomes a facet too.
const MIN_REACH: f64 = 0.25;
/// Spots per task: fixed, so that nothing depends on the number of threads.
const GRAIN: usize = 32;
/// Number of directions in the patch's plane in which its radius is measured.
const DIRECTIONS: usize = 12;

/// Makes patches, on one thread.
struct Patches<'a> {
    bins: &'a Bins,
    exposure: &'a Exposure,
    prisms: Prisms,
}

/// Patches of the surface around the spots of stacks.
///
/// # Errors
/// Cancel.
pub fn patches(ctx: &Context, bins: &Bins, exposure: &Exposure) -> Result<Vec<Facet>> {
    let patches = || Patches { bins, exposure, prisms: Prisms::default() };
    let make = |patches: &mut Patches<'_>, spots: &[Spot]| {
        let mut out = Vec::with_capacity(spots.len() * 2);
        spots.iter().take_while(|_| ctx.check().is_ok()).for_each(|spot| patches.patch(spot, &mut out));
        out
    };
    let parts: Vec<Vec<Facet>> =
        exposure.spots_of_bundles(bins).par_chunks(GRAIN).map_init(patches, make).collect();
    ctx.check()?;
    Ok(parts.concat())
}

impl Patches<'_> {
    /// Adds the patch around a spot.
    fn patch(&mut self, spot: &Spot, out: &mut Vec<Facet>) {
        let face = spot.face;
        let normal = unit(self.bins.normals[face as usize]);
        if self.neighbours_agree(spot, &normal) {
            let corner = |[p, q]: [f64; 2]| fixed(on_plane(spot, &normal, [p * HALF, q * HALF]));
            let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(corner);
            let facets = [[a, b, c], [a, c, d]];
            out.extend(facets.map(|v| Facet { v: facing(v, &normal), face, sure: true }));
            return;
        }
        let (centre, [u, v]) = (spot.at(), across(normal));
        let position = |[a, b]: [f64; 2], part: f64| {
            [0, 1, 2].map(|axis| centre[axis] + (a * u[axis] + b * v[axis]) * part * REACH)
        };
        let directions: [[f64; 2]; DIRECTIONS] = std::array::from_fn(|index| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / DIRECTIONS as f64);
            [cos, sin]
        });
        let reaches = directions.map(|direction| self.reach(&normal, |part| position(direction, part)));
        let rim: [Point; DIRECTIONS] =
            std::array::from_fn(|index| position(directions[index], reaches[index]));
        let facet = |index: usize| [centre, rim[index], rim[(index + 1) % DIRECTIONS]].map(fixed);
        out.extend((0..DIRECTIONS).map(|index| Facet { v: facet(index), face, sure: true }));
        if reaches.iter().sum::<f64>() < MIN_REACH * DIRECTIONS as f64 {
            out.push(Facet { v: self.bins.faces[face as usize].v, face, sure: false });
        }
    }

    /// Whether all eight neighbouring lines meet the surface in the plane of a spot's face.
    fn neighbours_agree(&self, spot: &Spot, normal: &Point) -> bool {
        let slope = normal[spot.axis.index()].abs();
        let beside = (-1..=1).flat_map(|p| (-1..=1).map(move |q| [p, q])).filter(|beside| *beside != [0, 0]);
        beside.into_iter().all(|[p, q]| {
            let position = on_plane(spot, normal, [p, q].map(f64::from))[spot.axis.index()];
            self.exposure.has_meeting_near(
                spot,
                [spot.line[0] + p, spot.line[1] + q],
                position,
                OFF_BESIDE / slope,
            )
        })
    }

    /// The fraction (0 to 1) of a path from the spot along which the plane is the surface.
    fn reach(&mut self, normal: &Point, position: impl Fn(f64) -> Point) -> f64 {
        let (mut first, mut last) = (0.0, 0.5);
        if self.is_surface(position(0.5), normal) {
            if self.is_surface(position(1.0), normal) {
                return 1.0;
            }
            (first, last) = (0.5, 1.0);
        }
        for _ in 0..HALVINGS {
            let half = (first + last) / 2.0;
            let good = self.is_surface(position(half), normal);
            (first, last) = if good { (half, last) } else { (first, half) };
        }
        (first + last) / 2.0
    }

    /// Whether the volume lies close behind a point of a plane, and not in front.
    fn is_surface(&mut self, at: Point, normal: &Point) -> bool {
        let mut winding = |side: f64| {
            let position = [0, 1, 2].map(|axis| (at[axis] + side * OFF * normal[axis]) * f64::from(UNITS));
            self.bins.windings(position, position, &mut self.prisms)[0]
        };
        winding(1.0) < 1 && winding(-1.0) >= 1
    }
}

/// The point of a spot's plane on the line at this offset (cells) from the spot's own line.
fn on_plane(spot: &Spot, normal: &Point, [p, q]: [f64; 2]) -> Point {
    let offset = spot.axis.offset([p, q]);
    let mut at = spot.at();
    let rise = -dot(*normal, offset) / normal[spot.axis.index()];
    (0..3).for_each(|axis| at[axis] += offset[axis]);
    at[spot.axis.index()] += rise;
    at
}

fn fixed(at: Point) -> Fixed {
    at.map(|cells| (cells * f64::from(UNITS)).round() as i32)
}

/// A triangle, flipped if it faces against a normal.
fn facing([a, b, c]: [Fixed; 3], normal: &Point) -> [Fixed; 3] {
    let own = cross(difference(b, a), difference(c, a));
    if dot(own, *normal) < 0.0 { [a, c, b] } else { [a, b, c] }
}

fn unit(v: Point) -> Point {
    let length = dot(v, v).sqrt();
    v.map(|value| value / length)
}

/// Two unit vectors perpendicular to a unit vector and to each other.
fn across(normal: Point) -> [Point; 2] {
    let smallest = (1..3)
        .fold(0, |smallest, axis| if normal[axis].abs() < normal[smallest].abs() { axis } else { smallest });
    let mut axis = [0.0; 3];
    axis[smallest] = 1.0;
    let u = unit(cross(normal, axis));
    [u, cross(normal, u)]
}
