//! Points drawn as spheres: each is put where the camera sees it, into a buffer with the nearest sphere of each sample of the
//! picture. Nothing is traced: a million points take about as long as the rest of the picture.

use rayon::prelude::*;

use super::camera::{Camera, Size};
use super::model::Hit;
use super::ramp::ramp;
use super::shade::{Colour, SNOW};
use crate::base::DVec3;
use crate::base::points::{Column, Points, Values};
use crate::context::Context;
use crate::error::{Error, Result};

/// Rows of samples that a task draws.
const BAND: usize = 32;
/// Least radius of a sphere on the picture (samples): a smaller one could slip between samples.
const LEAST_SEEN: f64 = 0.75;

/// Points, ready to be drawn.
pub struct Cloud {
    spheres: Vec<Sphere>,
    bounds: Option<(DVec3, DVec3)>,
}

#[derive(Clone, Copy)]
struct Sphere {
    centre: DVec3,
    radius: f64,
    albedo: [f32; 3],
}

impl Cloud {
    /// Points as spheres with the radius `pscale` (m), or of half a voxel where they have none. They have the colour of
    /// snow, or one for the values of an attribute: from dark blue at the least to pale yellow at the greatest; vectors by
    /// their lengths.
    ///
    /// # Errors
    /// No such attribute (those that are there are named).
    pub fn new(points: &Points, colour: Option<&str>) -> Result<Self> {
        let unknown = |name: &str| {
            let names: Vec<&str> =
                points.attributes.iter().map(|attribute| attribute.name.as_str()).collect();
            let there = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            Error::argument(format!("the points have no attribute \"{name}\"; they have {there}"))
        };
        let coloured = match colour {
            Some(name) => Some(points.attribute(name).ok_or_else(|| unknown(name))?),
            None => None,
        };
        let half = Column::Uniform((0.5 * points.voxel_size) as f32);
        let radii = match points.attribute("pscale") {
            Some(Values::Float(column)) => column,
            _ => &half,
        };
        let count = points.count();
        let numbers = coloured.map(|values| (0..count).map(|point| values.number(point)));
        let (low, high) = numbers.map_or((0.0, 0.0), |numbers| {
            numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), n| (low.min(n), high.max(n)))
        });
        let albedo = |point: usize| match coloured {
            Some(values) => ramp((values.number(point) - low) / (high - low)),
            None => SNOW,
        };
        let spheres: Vec<Sphere> = (0..count)
            .map(|point| Sphere {
                centre: points.position(point),
                radius: f64::from(radii.get(point)).max(0.0),
                albedo: albedo(point),
            })
            .collect();
        let boxes = spheres.iter().map(|sphere| {
            let reach = DVec3::repeat(sphere.radius);
            (sphere.centre - reach, sphere.centre + reach)
        });
        let bounds = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        Ok(Self { spheres, bounds })
    }

    /// Its least and greatest corner (m); none when it is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }
}

/// The nearest sphere at each sample of a picture.
pub(super) struct Splats<'a> {
    clouds: &'a [Cloud],
    /// Samples in a row.
    width: usize,
    /// For each sample the distance along its ray (m), and cloud and sphere; infinity where there is none.
    nearest: Vec<(f32, u32, u32)>,
}

/// A sphere on the picture: the samples that it may cover.
struct Seen {
    /// No point of it is nearer to the eye (m).
    least: f32,
    cloud: u32,
    sphere: u32,
    /// Radius (m) after it is made large enough to be seen.
    radius: f64,
    columns: [u32; 2],
    rows: [u32; 2],
}

impl<'a> Splats<'a> {
    /// Draws clouds with `samples` samples along each edge of a pixel: the same at any number of threads, as each band of
    /// rows takes the spheres in the same order.
    pub fn new(
        ctx: &Context,
        clouds: &'a [Cloud],
        camera: &Camera,
        size: Size,
        samples: usize,
    ) -> Result<Self> {
        let (width, height) = (size.width as usize * samples, size.height as usize * samples);
        if clouds.iter().all(|cloud| cloud.spheres.is_empty()) {
            return Ok(Self { clouds, width, nearest: Vec::new() });
        }
        let view = View::new(camera, width, height);
        let mut seen: Vec<Seen> = Vec::new();
        for (cloud, number) in clouds.iter().zip(0..) {
            ctx.check()?;
            let spheres = cloud.spheres.par_iter().enumerate();
            seen.par_extend(spheres.filter_map(|(n, sphere)| view.see(sphere, number, n as u32)));
        }
        // From front to back: what is hidden then costs one comparison a sample. Equal distances keep the order of the points.
        seen.par_sort_unstable_by(|a, b| {
            a.least.total_cmp(&b.least).then((a.cloud, a.sphere).cmp(&(b.cloud, b.sphere)))
        });
        let mut bands: Vec<Vec<u32>> = vec![Vec::new(); height.div_ceil(BAND)];
        for (seen, n) in seen.iter().zip(0..) {
            (seen.rows[0] as usize / BAND..=seen.rows[1] as usize / BAND)
                .for_each(|band| bands[band].push(n));
        }
        let mut nearest = vec![(f32::INFINITY, 0, 0); width * height];
        nearest.par_chunks_mut(width * BAND).zip(&bands).enumerate().try_for_each(
            |(band, (rows, list))| {
                ctx.check()?;
                for &n in list {
                    let seen = &seen[n as usize];
                    let sphere = &clouds[seen.cloud as usize].spheres[seen.sphere as usize];
                    let first = (seen.rows[0] as usize).max(band * BAND);
                    let last = (seen.rows[1] as usize).min(band * BAND + rows.len() / width - 1);
                    for y in first..=last {
                        for x in seen.columns[0] as usize..=seen.columns[1] as usize {
                            let Some(distance) = view.meet(sphere.centre, seen.radius, x, y) else {
                                continue;
                            };
                            let place = &mut rows[(y - band * BAND) * width + x];
                            if (distance as f32) < place.0 {
                                *place = (distance as f32, seen.cloud, seen.sphere);
                            }
                        }
                    }
                }
                Ok::<(), Error>(())
            },
        )?;
        Ok(Self { clouds, width, nearest })
    }

    /// The sphere that a ray with this unit direction meets first; the ray goes through a sample of the picture.
    pub fn at(&self, x: usize, y: usize, eye: DVec3, toward: DVec3) -> Option<Hit> {
        let (distance, cloud, sphere) = *self.nearest.get(y * self.width + x)?;
        if distance.is_infinite() {
            return None;
        }
        let Sphere { centre, radius, albedo } = self.clouds[cloud as usize].spheres[sphere as usize];
        let distance = f64::from(distance);
        // Spheres that were made larger have the same normals as others.
        let normal = (eye + toward * distance - centre).try_normalize(0.0).unwrap_or(-toward);
        let skin = 0.01 * radius.max(1e-9);
        Some(Hit { distance, normal, albedo: Colour::from(albedo.map(f64::from)), skin })
    }
}

/// The camera's view of samples.
struct View {
    eye: DVec3,
    axes: [DVec3; 3],
    width: usize,
    height: usize,
    /// Samples in a length of 1 at a distance of 1.
    scale: f64,
}

impl View {
    fn new(camera: &Camera, width: usize, height: usize) -> Self {
        let half = libm::tan(camera.fov_deg.to_radians() * 0.5);
        Self { eye: camera.eye, axes: camera.axes(), width, height, scale: 0.5 * height as f64 / half }
    }

    /// The samples that a sphere may cover.
    fn see(&self, sphere: &Sphere, cloud: u32, index: u32) -> Option<Seen> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(&(sphere.centre - self.eye)));
        let radius = sphere.radius.max(LEAST_SEEN * z / self.scale);
        // A sphere that the camera is in, or beside, is left out: it would hide everything.
        if z <= radius {
            return None;
        }
        // Tangents from the eye to the circle of the sphere in the plane of an axis and the view.
        let range = |side: f64| {
            let root = radius * (side * side + z * z - radius * radius).sqrt();
            let below = z * z - radius * radius;
            [(side * z - root) / below * self.scale, (side * z + root) / below * self.scale]
        };
        let clip = |[low, high]: [f64; 2], middle: f64, count: usize| {
            let (low, high) =
                ((middle + low).floor().max(0.0), (middle + high).ceil().min(count as f64 - 1.0));
            (low <= high).then_some([low as u32, high as u32])
        };
        let columns = clip(range(x), 0.5 * self.width as f64, self.width)?;
        // Rows count downward.
        let rows = clip(range(-y), 0.5 * self.height as f64, self.height)?;
        // Rounded down, so that it is a bound of distances that are rounded too.
        let least = ((sphere.centre - self.eye).norm() - radius) as f32 * (1.0 - 1e-6);
        Some(Seen { least, cloud, sphere: index, radius, columns, rows })
    }

    /// The distance (m) at which the ray through a sample meets a sphere.
    fn meet(&self, centre: DVec3, radius: f64, x: usize, y: usize) -> Option<f64> {
        let across = (x as f64 + 0.5 - 0.5 * self.width as f64) / self.scale;
        let upward = (0.5 * self.height as f64 - y as f64 - 0.5) / self.scale;
        let toward = self.axes[2] + self.axes[0] * across + self.axes[1] * upward;
        let length = toward.norm();
        let offset = centre - self.eye;
        let along = offset.dot(&toward) / length;
        let beside = offset - toward * (along / length);
        let depth = radius * radius - beside.norm_squared();
        (depth >= 0.0).then(|| along - depth.sqrt()).filter(|&distance| distance > 0.0)
    }
}
