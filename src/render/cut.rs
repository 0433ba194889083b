//! Cuts: a plane through a field, coloured by its values, and the lines in which surfaces meet the plane.

use std::ops::Range;

use rayon::prelude::*;

use super::camera::{Camera, Lens, Size};
use super::picture::Picture;
use super::plane::Plane;
use super::ramp::ramp;
use super::shade::{Colour, to_bytes};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{DVec3, TriMesh};

/// Rows of the picture that are sampled together.
const ROWS: usize = 64;
/// Width of a line (pixels).
const LINE: f64 = 1.5;
/// Minimum depth at which lines are drawn, relative to the distance of their farther end: nearer parts project far outside any picture.
const NEAR_PLANE: f64 = 1.0e-9;
/// Colour of pixels without a field.
const EMPTY: [f32; 3] = [0.45, 0.47, 0.5];

/// Reads the values at positions (m) into a list, which it clears first.
type Read = dyn Fn(&Context, &[DVec3], &mut Vec<f32>) -> Result<()> + Send + Sync;
/// Minimum and maximum corner (m); none if there is nothing.
type Bounds = Option<(DVec3, DVec3)>;

/// A number at each position, such as a distance or a density.
pub struct Field {
    read: Box<Read>,
    range: [f32; 2],
    bounds: Bounds,
}

impl Field {
    /// A field that `read` samples: it gets positions (m) and puts their values into a list, which it clears first. The colours from dark
    /// blue to pale yellow span `range`; values outside have the colours of its ends. `bounds` are the minimum and maximum corner of the
    /// part to be drawn (m).
    pub fn new(
        bounds: Option<(DVec3, DVec3)>,
        range: [f32; 2],
        read: impl Fn(&Context, &[DVec3], &mut Vec<f32>) -> Result<()> + Send + Sync + 'static,
    ) -> Self {
        Self { read: Box::new(read), range, bounds }
    }

    /// The colour of a value.
    fn colour(&self, value: f32) -> [u8; 3] {
        let [low, high] = self.range.map(f64::from);
        bytes(ramp((f64::from(value) - low) / (high - low)))
    }
}

/// A plane with a field and surfaces that it cuts, ready to be drawn.
pub struct Cut {
    plane: Plane,
    field: Option<Field>,
    outlines: Vec<Outline>,
    bounds: Bounds,
}

/// The lines in which a surface meets the plane.
struct Outline {
    segments: Vec<[DVec3; 2]>,
    colour: [u8; 3],
}

impl Cut {
    /// A plane with nothing on it.
    pub fn new(plane: Plane) -> Self {
        Self { plane, field: None, outlines: Vec::new(), bounds: None }
    }

    /// Adds a field; the first of several gives the colours.
    pub fn with_field(mut self, field: Field) -> Self {
        self.bounds = united(self.bounds, field.bounds);
        self.field = self.field.or(Some(field));
        self
    }

    /// Adds the lines in which a mesh meets the plane, drawn over those of earlier meshes, in a colour (linear red, green, blue, 0 to 1).
    pub fn with_surface(mut self, mesh: &TriMesh, colour: [f32; 3]) -> Self {
        let bounds = mesh.bounds().map(|(low, high)| (low.cast(), high.cast()));
        self.bounds = united(self.bounds, bounds);
        self.outlines.push(Outline { segments: outline(mesh, self.plane), colour: bytes(colour) });
        self
    }

    /// Minimum and maximum corner of everything that is cut (m); none if it is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// The values of its field with the first and the last colour; none without a field.
    pub fn range(&self) -> Option<[f32; 2]> {
        self.field.as_ref().map(|field| field.range)
    }

    /// Draws what a camera sees of the plane, without light or shadow: the same bytes with any number of threads. A plane that contains the
    /// camera is not seen.
    ///
    /// # Errors
    /// A size outside 1 to 16,384 pixels; errors of the field; cancel.
    pub fn draw(&self, ctx: &Context, camera: &Camera, size: Size) -> Result<Picture> {
        size.check()?;
        let lens = camera.lens(size);
        let width = size.width as usize;
        let mut rgb = vec![0; 3 * width * size.height as usize];
        for (band, pixels) in rgb.chunks_mut(3 * width * ROWS).enumerate() {
            ctx.check()?;
            let first = band * ROWS * width;
            let intersect = |pixel: usize| {
                let [x, y] = [pixel % width, pixel / width].map(|at| at as f64 + 0.5);
                self.plane.intersection(camera.eye, lens.through(x, y))
            };
            let positions: Vec<Option<DVec3>> = (first..first + pixels.len() / 3).map(intersect).collect();
            self.fill(ctx, &positions, pixels)?;
        }
        for outline in &self.outlines {
            ctx.check()?;
            outline.draw(&mut rgb, camera.eye, &lens, size);
        }
        Ok(Picture { size, rgb })
    }

    /// Gives pixels the colours of the field at their positions.
    fn fill(&self, ctx: &Context, positions: &[Option<DVec3>], pixels: &mut [u8]) -> Result<()> {
        let empty = bytes(EMPTY);
        let Some(field) = &self.field else {
            pixels.chunks_exact_mut(3).for_each(|pixel| pixel.copy_from_slice(&empty));
            return Ok(());
        };
        let sampled: Vec<DVec3> = positions.iter().map(|position| position.unwrap_or_default()).collect();
        let mut values = Vec::new();
        (field.read)(ctx, &sampled, &mut values)?;
        let paint = |(pixel, (position, value)): (&mut [u8], (&Option<DVec3>, &f32))| {
            pixel.copy_from_slice(&position.map_or(empty, |_| field.colour(*value)));
        };
        let numbers = positions.par_iter().zip(&values);
        ctx.pool().install(|| pixels.par_chunks_exact_mut(3).zip(numbers).for_each(paint));
        Ok(())
    }
}

impl Outline {
    /// Draws the lines onto a picture.
    fn draw(&self, rgb: &mut [u8], eye: DVec3, lens: &Lens, size: Size) {
        let coverage = self.coverage(eye, lens, size);
        for (pixel, coverage) in rgb.chunks_exact_mut(3).zip(coverage.into_iter().map(u32::from)) {
            for (value, colour) in pixel.iter_mut().zip(self.colour) {
                let mixed = u32::from(*value) * (255 - coverage) + u32::from(colour) * coverage;
                *value = ((mixed + 127) / 255) as u8;
            }
        }
    }

    /// How much of each pixel the lines cover, 0 to 255.
    fn coverage(&self, eye: DVec3, lens: &Lens, size: Size) -> Vec<u8> {
        let (width, height) = (size.width as usize, size.height as usize);
        let mut coverage = vec![0u8; width * height];
        for segment in &self.segments {
            let Some([a, b]) = project(lens, segment.map(|end| end - eye)) else { continue };
            for y in pixel_range(a[1], b[1], height) {
                for x in pixel_range(a[0], b[0], width) {
                    let distance = distance(a, b, [x as f64 + 0.5, y as f64 + 0.5]);
                    let share = (0.5 * (LINE + 1.0) - distance).clamp(0.0, 1.0);
                    let pixel = &mut coverage[y * width + x];
                    *pixel = (*pixel).max((255.0 * share).round() as u8);
                }
            }
        }
        coverage
    }
}

/// Projects the part of a segment ahead of the eye (pixels); none if all of it is behind. Its ends are relative to the eye (m).
fn project(lens: &Lens, [a, b]: [DVec3; 2]) -> Option<[[f64; 2]; 2]> {
    let [from, to] = [a, b].map(|end| lens.depth(end));
    let near_depth = NEAR_PLANE * a.norm().max(b.norm());
    let position = |depth: f64| a.lerp(&b, (depth - from) / (to - from));
    let (a, b) = match (from >= near_depth, to >= near_depth) {
        (true, true) => (a, b),
        (true, false) => (a, position(near_depth)),
        (false, true) => (position(near_depth), b),
        (false, false) => return None,
    };
    Some([lens.pixel(a)?, lens.pixel(b)?])
}

/// The pixels of a row or column of `count` pixels that a line from `a` to `b` may cover.
fn pixel_range(a: f64, b: f64, count: usize) -> Range<usize> {
    let first = (a.min(b) - LINE).floor().max(0.0) as usize;
    let last = (a.max(b) + LINE).ceil().max(0.0) as usize;
    first..last.min(count)
}

/// Distance of a position from a segment (pixels).
fn distance(a: [f64; 2], b: [f64; 2], position: [f64; 2]) -> f64 {
    let [segment, offset] = [b, position].map(|end| [end[0] - a[0], end[1] - a[1]]);
    let length = segment[0] * segment[0] + segment[1] * segment[1];
    let along = (segment[0] * offset[0] + segment[1] * offset[1]) / length;
    let along = if length > 0.0 { along.clamp(0.0, 1.0) } else { 0.0 };
    let off = [0, 1].map(|axis| offset[axis] - along * segment[axis]);
    (off[0] * off[0] + off[1] * off[1]).sqrt()
}

/// The segments in which triangles meet a plane. Corners in the plane count as beyond it, so that no segment occurs twice.
fn outline(mesh: &TriMesh, plane: Plane) -> Vec<[DVec3; 2]> {
    let intersect = |triangle: usize| {
        let corners = mesh.corners(triangle);
        let heights = corners.map(|corner| corner[plane.axis] - plane.at);
        let mut ends = [[0, 1], [1, 2], [2, 0]].into_iter().filter_map(|[a, b]| {
            let share = heights[a] / (heights[a] - heights[b]);
            ((heights[a] < 0.0) != (heights[b] < 0.0)).then(|| corners[a].lerp(&corners[b], share))
        });
        Some([ends.next()?, ends.next()?])
    };
    (0..mesh.triangles.len()).filter_map(intersect).collect()
}

/// The box around two boxes.
fn united(a: Bounds, b: Bounds) -> Bounds {
    match (a, b) {
        (Some(a), Some(b)) => Some((a.0.inf(&b.0), a.1.sup(&b.1))),
        _ => a.or(b),
    }
}

/// The bytes of a colour (linear red, green, blue).
fn bytes(colour: [f32; 3]) -> [u8; 3] {
    to_bytes(Colour::from(colour.map(f64::from)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pool;

    const SIZE: Size = Size { width: 120, height: 90 };

    /// Distances from a sphere around a centre, in a box of 2 m around the origin.
    fn ball(centre: DVec3, radius: f64) -> Field {
        let bounds = Some((DVec3::repeat(-1.0), DVec3::repeat(1.0)));
        Field::new(bounds, [-0.2, 0.2], move |_, positions, out| {
            out.clear();
            out.extend(positions.iter().map(|position| ((position - centre).norm() - radius) as f32));
            Ok(())
        })
    }

    /// The position that a pixel of a picture of that box shows, by the directions to the right and upward.
    fn position(plane: Plane, [x, y]: [usize; 2], [right, up]: [DVec3; 2]) -> DVec3 {
        // The box fills the height except for 4 % at each edge.
        let pixel = 2.0 / 0.92 / 90.0;
        let mut position = right * ((x as f64 + 0.5 - 60.0) * pixel) + up * ((45.0 - y as f64 - 0.5) * pixel);
        position[plane.axis] = plane.at;
        position
    }

    #[test]
    fn a_field_changes_its_colour_where_its_values_do() {
        let ctx = Context::new(Pool::new(2).unwrap());
        let centre = DVec3::new(0.2, -0.1, 0.3);
        let axes = [[-DVec3::z(), DVec3::y()], [DVec3::x(), -DVec3::z()], [DVec3::x(), DVec3::y()]];
        for (axis, axes) in axes.into_iter().enumerate() {
            let plane = Plane { axis, at: 0.15 };
            let field = ball(centre, 0.5);
            let cut = Cut::new(plane).with_field(ball(centre, 0.5));
            let camera = Camera::facing(cut.bounds().unwrap(), plane, SIZE);
            let picture = cut.draw(&ctx, &camera, SIZE).unwrap();
            for (pixel, rgb) in picture.rgb.as_chunks::<3>().0.iter().enumerate() {
                let at = position(plane, [pixel % 120, pixel / 120], axes);
                let expected = field.colour(((at - centre).norm() - 0.5) as f32);
                let off = (0..3).map(|n| expected[n].abs_diff(rgb[n])).max().unwrap();
                assert!(off <= 1, "axis {axis}, {at:?}: {rgb:?} is not {expected:?}");
            }
        }
    }

    #[test]
    fn a_surface_is_a_line_where_it_meets_the_plane() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let plane = Plane { axis: 2, at: 0.25 };
        let mesh = TriMesh::cuboid([-0.6, -0.4, -0.5], [0.5, 0.3, 0.5]);
        let length: f64 = outline(&mesh, plane).iter().map(|[a, b]| (a - b).norm()).sum();
        assert!((length - 2.0 * (1.1 + 0.7)).abs() < 1e-6, "{length}");
        let field_only = Cut::new(plane).with_field(ball(DVec3::zeros(), 0.3));
        let camera = Camera::facing(field_only.bounds().unwrap(), plane, SIZE);
        let before = field_only.draw(&ctx, &camera, SIZE).unwrap();
        let after = field_only.with_surface(&mesh, [0.0; 3]).draw(&ctx, &camera, SIZE).unwrap();
        let mut covered = 0;
        for (pixel, rgb) in after.rgb.as_chunks::<3>().0.iter().enumerate() {
            let at = position(plane, [pixel % 120, pixel / 120], [DVec3::x(), DVec3::y()]);
            let (x, y) = (at.x, at.y);
            // Signed distance from the rectangle (pixels): exact inside, and at most the true one outside.
            let off = (-0.6 - x).max(x - 0.5).max((-0.4 - y).max(y - 0.3)) * 0.92 * 90.0 / 2.0;
            if (-0.25..=0.0).contains(&off) {
                assert_eq!(rgb, &[0; 3], "{x} {y}");
                covered += 1;
            } else if off.abs() > 2.0 {
                assert_eq!(rgb[..], before.rgb[3 * pixel..3 * pixel + 3], "{x} {y}");
            }
        }
        assert!(covered > 50, "{covered}");
        // A plane beside the box does not meet it, nor does that of its lowest face, whose corners count as beyond it.
        assert!(outline(&mesh, Plane { axis: 2, at: 0.6 }).is_empty());
        assert!(outline(&mesh, Plane { axis: 2, at: -0.5 }).is_empty());
    }

    #[test]
    fn a_line_that_passes_the_camera_is_seen_ahead_of_it() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let plane = Plane { axis: 1, at: 0.0 };
        // Its lines along z have no ends between z = 0 and 5 m; the camera stands at 1 m between two of them.
        let mesh = TriMesh::cuboid([-0.6, -1.0, -5.0], [0.6, 1.0, 5.0]);
        let camera = Camera { eye: DVec3::new(0.0, 0.5, 1.0), target: DVec3::zeros(), fov_deg: 100.0 };
        let picture = Cut::new(plane).with_surface(&mesh, [0.0; 3]).draw(&ctx, &camera, SIZE).unwrap();
        let (lens, empty) = (camera.lens(SIZE), bytes(EMPTY));
        let pixel = |[x, y]: [f64; 2]| {
            let is_inside = (0.0..120.0).contains(&x) && (0.0..90.0).contains(&y);
            is_inside.then(|| picture.rgb.as_chunks::<3>().0[y as usize * 120 + x as usize])
        };
        let mut beside = 0;
        for step in 0..500 {
            let z = -4.0 + 0.01 * f64::from(step);
            for x in [-0.6, 0.6] {
                let Some(at) = lens.pixel(DVec3::new(x, 0.0, z) - camera.eye) else { continue };
                let Some(rgb) = pixel(at) else { continue };
                assert_ne!(rgb, empty, "{x} {z}");
                beside += usize::from(z > 0.0);
            }
            let between = lens.pixel(DVec3::new(0.0, 0.0, z) - camera.eye).and_then(&pixel);
            assert!(z < -1.0 || between.is_none_or(|rgb| rgb == empty), "{z}");
        }
        assert!(beside > 50, "{beside}");
    }

    #[test]
    fn a_camera_that_looks_away_sees_nothing() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let plane = Plane { axis: 1, at: 0.0 };
        let mesh = TriMesh::cuboid([-0.5; 3], [0.5; 3]);
        let cut = Cut::new(plane).with_field(ball(DVec3::zeros(), 0.5)).with_surface(&mesh, [0.0; 3]);
        let eye = DVec3::new(0.0, 2.0, 0.1);
        let camera = Camera { eye, target: eye + DVec3::y(), fov_deg: 40.0 };
        let picture = cut.draw(&ctx, &camera, SIZE).unwrap();
        assert!(picture.rgb.as_chunks::<3>().0.iter().all(|pixel| *pixel == bytes(EMPTY)));
        assert!(cut.draw(&ctx, &camera, Size { width: 0, height: 9 }).is_err());
    }
}
