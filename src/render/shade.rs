//! Light on a surface: a low sun with a soft shadow, and the sky where it is not hidden.
//!
//! Everything is a function of the pixel alone, so a picture does not depend on the number of threads.

use std::sync::LazyLock;

use super::camera::{Camera, direction};
use crate::geometry::DVec3;

/// Linear red, green, blue.
pub(super) type Colour = nalgebra::Vector3<f64>;

/// Albedo of clean snow.
pub const SNOW: [f32; 3] = [0.90, 0.93, 0.97];

/// Sun and sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Unit vector towards the sun.
    pub sun: DVec3,
}

/// Radiance of a white surface that faces the sun.
pub(super) const SUN: Colour = Colour::new(1.75, 1.52, 1.22);
/// Radiance of the zenith and of the horizon.
const ZENITH: Colour = Colour::new(0.20, 0.30, 0.48);
const HORIZON: Colour = Colour::new(0.42, 0.50, 0.60);
/// Radiance from a blocked direction of the sky: light that snow has reflected several times.
const BOUNCED: Colour = Colour::new(0.085, 0.115, 0.165);
/// Mean radiance around a fog: half of it is sky, the other half snow.
pub(super) const SURROUNDINGS: Colour = Colour::new(0.50, 0.545, 0.61);
/// Angular radius of the sun's disc (radians), larger than in nature: the edges of shadows are soft.
const SUN_RADIUS: f64 = 0.02;
/// Exponent of the sun's specular reflection in a liquid, and its brightness relative to that of a surface in the sun.
const GLOSS: f64 = 350.0;
const SPOT: f64 = 1.0;
/// Sky rays at each sample of a pixel.
pub(super) const SKY_RAYS: usize = 4;
/// Count of stored points of the disc: enough for the 9 samples of a pixel.
const DISC_POINTS: usize = 9 * SKY_RAYS;

impl Light {
    /// A sun at an azimuth (from +z towards +x) and an elevation above the horizon (degrees).
    pub fn from_degrees(azimuth: f64, elevation: f64) -> Self {
        Self { sun: direction(azimuth, elevation) }
    }

    /// A low sun from the camera's left and slightly from ahead, which shows relief best.
    pub fn beside(camera: &Camera) -> Self {
        let back = camera.eye - camera.target;
        let azimuth = libm::atan2(back.x, back.z).to_degrees();
        Self::from_degrees(azimuth - 112.0, 27.0)
    }

    /// The light of a ray that hits nothing.
    pub(super) fn background(&self, toward: DVec3) -> Colour {
        let height = toward.y.clamp(-0.3, 1.0);
        // Below the horizon the haze darkens a little, so that a floating layer stands out.
        if height < 0.0 { HORIZON * (1.0 + 1.2 * height) } else { sky(height) }
    }
}

fn sky(height: f64) -> Colour {
    HORIZON.lerp(&ZENITH, height.sqrt())
}

/// Light that leaves a point towards the camera.
///
/// `blocked(direction)` returns whether something blocks that direction from the point, `transmittance(direction)` the share of sunlight
/// that the fog transmits, 0 to 1. `sample` is the index of the sample in its pixel; `wrap` is as in [`Hit`](super::model::Hit).
pub(super) fn shade(
    light: &Light,
    normal: DVec3,
    albedo: Colour,
    sample: usize,
    wrap: f64,
    blocked: impl Fn(DVec3) -> bool,
    transmittance: impl Fn(DVec3) -> f64,
) -> Colour {
    let (tangent, bitangent) = tangents(light.sun);
    let (x, y) = disc(sample);
    let toward_sun = (light.sun + (tangent * x + bitangent * y) * SUN_RADIUS).normalize();
    let facing = (normal.dot(&toward_sun) + wrap) / (1.0 + wrap);
    let is_lit = facing > 0.0 && !blocked(toward_sun);
    let sun = if is_lit { SUN * (facing * transmittance(toward_sun)) } else { Colour::zeros() };
    let (tangent, bitangent) = tangents(normal);
    let mut fill = Colour::zeros();
    for ray in 0..SKY_RAYS {
        // Directions are distributed with density cos / pi, so that the mean of their light is what the surface receives from the sky.
        let (x, y) = disc(sample * SKY_RAYS + ray);
        let toward = tangent * x + bitangent * y + normal * (1.0 - x * x - y * y).max(0.0).sqrt();
        let is_open = toward.y > -0.05 && !blocked(toward);
        fill += if is_open { sky(toward.y.max(0.0)) } else { BOUNCED };
    }
    albedo.component_mul(&(sun + fill / SKY_RAYS as f64))
}

/// Share of the light that a wet surface reflects (Schlick 1994, for water), and the light that it reflects towards the camera: the sky,
/// and a spot of the sun, blurred as by ripples.
///
/// `toward` is the unit vector from the camera; `blocked(direction)` as in [`shade`].
pub(super) fn gloss(
    light: &Light,
    normal: DVec3,
    toward: DVec3,
    blocked: impl Fn(DVec3) -> bool,
) -> (f64, Colour) {
    let facing = -normal.dot(&toward);
    let grazing = 1.0 - facing.clamp(0.0, 1.0);
    let share = 0.02 + 0.98 * (grazing * grazing) * (grazing * grazing) * grazing;
    let mirror = toward + normal * (2.0 * facing);
    let is_blocked = blocked(mirror);
    let sky = if is_blocked || mirror.y < -0.05 { BOUNCED } else { sky(mirror.y.clamp(0.0, 1.0)) };
    let spot = libm::pow(mirror.dot(&light.sun).max(0.0), GLOSS);
    let sun = if is_blocked { Colour::zeros() } else { SUN * (spot * SPOT) };
    (share, sky * share + sun)
}

/// A point of the unit disc, from the plastic sequence (Roberts 2018). All pixels use the same points, so that flat walls show no noise.
fn disc(index: usize) -> (f64, f64) {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    static POINTS: LazyLock<[(f64, f64); DISC_POINTS]> = LazyLock::new(|| {
        std::array::from_fn(|index| {
            let step = index as f64 + 1.0;
            let radius = (step / PLASTIC).fract().sqrt();
            let angle = std::f64::consts::TAU * (step / (PLASTIC * PLASTIC)).fract();
            (radius * libm::cos(angle), radius * libm::sin(angle))
        })
    });
    POINTS[index % DISC_POINTS]
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    let not_parallel = if normal.x.abs() < 0.7 { DVec3::x() } else { DVec3::y() };
    let tangent = normal.cross(&not_parallel).normalize();
    (tangent, normal.cross(&tangent))
}

/// Linear light to the 8 bits of a picture: exposure, a shoulder that keeps white snow below 255, sRGB.
pub(super) fn to_bytes(light: Colour) -> [u8; 3] {
    let byte = |value: f64| {
        let value = value * 0.92;
        // Linear up to the shoulder, then towards 1, starting with the same slope.
        let shoulder = 0.6;
        let value = if value < shoulder {
            value
        } else {
            let over = (value - shoulder) / (1.0 - shoulder);
            shoulder + (1.0 - shoulder) * (over / (1.0 + over))
        };
        let coded =
            if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * libm::pow(value, 1.0 / 2.4) - 0.055 };
        (coded.clamp(0.0, 1.0) * 255.0).round() as u8
    };
    [byte(light.x), byte(light.y), byte(light.z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_is_darker_and_bluer_than_the_sunny_side() {
        let light = Light::from_degrees(90.0, 45.0);
        let albedo = Colour::new(0.9, 0.9, 0.9);
        let lit = shade(&light, DVec3::y(), albedo, 0, 0.0, |_| false, |_| 1.0);
        let hidden = |toward: DVec3| toward.dot(&light.sun) > 0.99;
        let shadowed = shade(&light, DVec3::y(), albedo, 0, 0.0, hidden, |_| 1.0);
        let veiled = shade(&light, DVec3::y(), albedo, 0, 0.0, |_| false, |_| 0.5);
        assert!((veiled - (lit + shadowed) * 0.5).norm() < 1e-9);
        assert!(lit.x > 2.0 * shadowed.x);
        assert!(shadowed.z / shadowed.x > lit.z / lit.x);
    }

    #[test]
    fn brighter_light_is_never_a_darker_byte() {
        let mut before = 0;
        for step in 0..1000 {
            let byte = to_bytes(Colour::repeat(f64::from(step) * 0.004))[0];
            assert!(byte >= before);
            before = byte;
        }
        assert!(before > 220);
    }
}
