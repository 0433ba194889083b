//! The camera: set by the user, or placed automatically with everything in the picture.

use super::plane::Plane;
use crate::error::{Error, Result};
use crate::geometry::DVec3;

/// Maximum edge of a picture (pixels).
const MAX_EDGE: u32 = 16_384;

/// Width and height of a picture (pixels), each at least 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Size {
    /// Checks both edges.
    ///
    /// # Errors
    /// One outside 1 to 16,384 pixels.
    pub(super) fn check(self) -> Result<()> {
        if [self.width, self.height].iter().all(|edge| (1..=MAX_EDGE).contains(edge)) {
            return Ok(());
        }
        let what = format!("a picture must have 1 to {MAX_EDGE} pixels along each edge");
        Err(Error::argument(what))
    }
}

/// A pinhole camera; Y is up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Its position (m).
    pub eye: DVec3,
    /// The point in the middle of the picture (m).
    pub target: DVec3,
    /// Angle between the picture's upper and lower edge (degrees), over 0, below 180.
    pub fov_deg: f64,
}

/// Default angle of view: about the vertical angle of a 50 mm lens (degrees).
const FOV_DEG: f64 = 30.0;
/// Part of the picture left free at each edge by the automatic camera.
const MARGIN: f64 = 0.04;
/// Angle between the automatic camera and the longer horizontal axis of what it sees (degrees).
const AZIMUTH_DEG: f64 = 35.0;
/// Elevation of the automatic camera above the horizon (degrees).
const ELEVATION_DEG: f64 = 33.0;

/// Margin around what moves, as a share of its size along x and z and of its height.
const SURROUNDINGS: f64 = 0.15;

impl Camera {
    /// A three-quarter view from above with the whole box in the picture.
    pub fn framing(bounds: (DVec3, DVec3), size: Size) -> Self {
        let extent = bounds.1 - bounds.0;
        let azimuth = if extent.x > extent.z { 90.0 - AZIMUTH_DEG } else { AZIMUTH_DEG };
        let toward_eye = direction(azimuth, ELEVATION_DEG);
        let mut camera = Self { eye: toward_eye, target: DVec3::zeros(), fov_deg: FOV_DEG };
        camera.look_from(bounds, toward_eye, size);
        camera
    }

    /// Grows a box around what moves (m) by a share of its size, so that a view that frames it shows its surroundings too.
    pub fn surroundings((low, high): (DVec3, DVec3)) -> (DVec3, DVec3) {
        let extent = high - low;
        let margin = SURROUNDINGS * DVec3::new(extent.x, 0.0, extent.z).add_scalar(extent.y);
        (low - margin, high + margin)
    }

    /// A view straight at a plane, from the side to which its axis points, with the whole box in the picture. Upward in the picture
    /// is +y, or -z if the plane lies across y.
    pub fn facing(bounds: (DVec3, DVec3), plane: Plane, size: Size) -> Self {
        let mut target = (bounds.0 + bounds.1) * 0.5;
        target[plane.axis] = plane.at;
        let mut toward_eye = DVec3::zeros();
        toward_eye[plane.axis] = 1.0;
        let camera = Self { eye: target + toward_eye, target, fov_deg: FOV_DEG };
        let [right, up, _] = camera.axes();
        let extent = bounds.1 - bounds.0;
        let half = |axis: DVec3| 0.5 * extent.dot(&axis).abs();
        let aspect = f64::from(size.width) / f64::from(size.height);
        let tangent = libm::tan(FOV_DEG.to_radians() * 0.5) * (1.0 - 2.0 * MARGIN);
        let distance = (half(right) / aspect).max(half(up)) / tangent;
        Self { eye: target + toward_eye * distance.max(1.0e-6), ..camera }
    }

    /// Moves the camera along `toward_eye`, a unit vector from the target to the camera, until the box fills the picture.
    fn look_from(&mut self, bounds: (DVec3, DVec3), toward_eye: DVec3, size: Size) {
        let corners: Vec<DVec3> = (0..8).map(|index| corner(bounds, index)).collect();
        let reach = ((bounds.1 - bounds.0).norm() * 0.5).max(1.0e-6);
        let aspect = f64::from(size.width) / f64::from(size.height);
        let tangent = libm::tan(self.fov_deg.to_radians() * 0.5) * (1.0 - 2.0 * MARGIN);
        self.target = (bounds.0 + bounds.1) * 0.5;
        // Perspective shifts the middle of the projected box: centring and fitting converge in a few iterations.
        for _ in 0..8 {
            self.eye = self.target + toward_eye;
            let [right, up, ahead] = self.axes();
            let nearest = |axis: DVec3, tangent: f64, corner: &DVec3| {
                let offset = corner - self.target;
                offset.dot(&axis).abs() / tangent - offset.dot(&ahead)
            };
            let distance = corners.iter().fold(reach * 0.1, |distance, corner| {
                let wide = nearest(right, tangent * aspect, corner);
                distance.max(wide).max(nearest(up, tangent, corner))
            });
            self.eye = self.target + toward_eye * distance;
            let shift = |axis: DVec3| {
                let seen = corners.iter().map(|corner| {
                    let offset = corner - self.eye;
                    offset.dot(&axis) / offset.dot(&ahead).max(1.0e-9)
                });
                let (low, high) =
                    seen.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)));
                (low + high) * 0.5 * distance
            };
            let step = right * shift(right) + up * shift(up);
            self.target += step;
            self.eye += step;
        }
    }

    /// Unit vectors to the right, upward and ahead of the camera.
    pub fn axes(&self) -> [DVec3; 3] {
        let ahead = (self.target - self.eye).try_normalize(0.0).unwrap_or(-DVec3::z());
        let right = ahead.cross(&DVec3::y()).try_normalize(1.0e-9);
        // Looking straight down, the picture's upper edge is -z.
        let right = right.unwrap_or_else(DVec3::x);
        [right, right.cross(&ahead), ahead]
    }

    /// Unit direction through a point of the picture, in pixels from its upper left corner.
    pub fn through(&self, x: f64, y: f64, size: Size) -> DVec3 {
        self.lens(size).through(x, y)
    }

    /// Its projection to a picture of this size.
    pub(super) fn lens(&self, size: Size) -> Lens {
        let half = libm::tan(self.fov_deg.to_radians() * 0.5);
        Lens { axes: self.axes(), half, size }
    }
}

/// The projection of a camera to a picture.
pub(super) struct Lens {
    axes: [DVec3; 3],
    /// Tangent of half the angle of view.
    half: f64,
    size: Size,
}

impl Lens {
    /// As [`Camera::through`].
    pub fn through(&self, x: f64, y: f64) -> DVec3 {
        let [right, up, ahead] = self.axes;
        let (width, height) = (f64::from(self.size.width), f64::from(self.size.height));
        let across = (2.0 * x - width) / height * self.half;
        let upward = (height - 2.0 * y) / height * self.half;
        (ahead + right * across + up * upward).normalize()
    }

    /// Pixels in a row of the picture.
    pub fn width(&self) -> usize {
        self.size.width as usize
    }

    /// Depth of a point (m), negative behind the eye; `offset` is its offset from the eye (m).
    pub fn depth(&self, offset: DVec3) -> f64 {
        offset.dot(&self.axes[2])
    }

    /// Projection of a point, in pixels from the picture's upper left corner; `offset` is its offset from the eye (m). None for
    /// points that are not ahead.
    pub fn pixel(&self, offset: DVec3) -> Option<[f64; 2]> {
        let [right, up, _] = self.axes;
        let depth = self.depth(offset);
        let scale = f64::from(self.size.height) / (self.half * depth);
        let (across, upward) = (offset.dot(&right) * scale, offset.dot(&up) * scale);
        let (width, height) = (f64::from(self.size.width), f64::from(self.size.height));
        (depth > 0.0).then_some([0.5 * (width + across), 0.5 * (height - upward)])
    }
}

/// Unit vector at an azimuth (from +z towards +x) and an elevation above the horizon (degrees).
pub(super) fn direction(azimuth_deg: f64, elevation_deg: f64) -> DVec3 {
    let (azimuth, elevation) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let ((side, ahead), (up, level)) = (libm::sincos(azimuth), libm::sincos(elevation));
    DVec3::new(side * level, up, ahead * level)
}

/// The corner of a box with this index, 0 to 7.
pub(in crate::render) fn corner(bounds: (DVec3, DVec3), index: usize) -> DVec3 {
    let pick = |axis: usize| if index >> axis & 1 == 0 { bounds.0[axis] } else { bounds.1[axis] };
    DVec3::new(pick(0), pick(1), pick(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_automatic_camera_has_everything_in_the_picture() {
        let size = Size { width: 320, height: 180 };
        let shapes = [[1.0, 0.3, 4.5], [1.0, 1.0, 1.0], [6.0, 0.1, 0.5], [0.1, 3.0, 0.1]];
        for extent in shapes {
            let low = DVec3::new(-3.0, 2.0, 10.0);
            let bounds = (low, low + DVec3::from(extent));
            let camera = Camera::framing(bounds, size);
            let [right, up, ahead] = camera.axes();
            let half = libm::tan(camera.fov_deg.to_radians() * 0.5);
            let mut largest: f64 = 0.0;
            for index in 0..8 {
                let offset = corner(bounds, index) - camera.eye;
                let depth = offset.dot(&ahead);
                assert!(depth > 0.0, "behind the camera: {extent:?}");
                let x = (offset.dot(&right) / depth / half / (320.0 / 180.0)).abs();
                let y = (offset.dot(&up) / depth / half).abs();
                assert!(x <= 1.0 && y <= 1.0, "outside at {x} {y}: {extent:?}");
                largest = largest.max(x).max(y);
            }
            assert!(largest > 0.8, "too small: {largest} {extent:?}");
        }
    }

    #[test]
    fn a_point_is_seen_at_the_pixel_whose_ray_leads_to_it() {
        let camera =
            Camera { eye: DVec3::new(1.0, 2.0, 3.0), target: DVec3::new(0.0, 0.5, 0.0), fov_deg: 40.0 };
        let lens = camera.lens(Size { width: 64, height: 48 });
        for [x, y] in [[0.0, 0.0], [12.5, 40.0], [64.0, 3.0]] {
            let [right, down] = lens.pixel(lens.through(x, y) * 7.0).unwrap();
            assert!((right - x).abs() < 1e-9 && (down - y).abs() < 1e-9, "{x} {y}: {right} {down}");
        }
        assert_eq!(lens.pixel(camera.eye - camera.target), None);
    }

    #[test]
    fn the_middle_of_the_picture_shows_the_target() {
        let camera =
            Camera { eye: DVec3::new(1.0, 2.0, 3.0), target: DVec3::new(0.0, 0.5, 0.0), fov_deg: 40.0 };
        let size = Size { width: 64, height: 48 };
        let seen = camera.through(32.0, 24.0, size);
        assert!((seen - (camera.target - camera.eye).normalize()).norm() < 1.0e-12);
        let [right, up, _] = camera.axes();
        assert!(camera.through(60.0, 24.0, size).dot(&right) > 0.0);
        assert!(camera.through(32.0, 2.0, size).dot(&up) > 0.0);
    }
}
