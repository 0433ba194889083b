//! Points drawn as spheres, which are rasterised into a buffer of the nearest sphere at each sample of the picture. As no rays are
//! traced, a million points take about as long as the rest of the picture.

use rayon::prelude::*;

use super::camera::{Camera, Size};
use super::model::Hit;
use super::ramp::ramp;
use super::shade::{Colour, SNOW};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::geometry::points::{Column, Points, Values};

/// Samples along an edge of a tile; a task draws one tile.
const TILE: usize = 32;
/// Samples of a tile.
const TILE_SAMPLES: usize = TILE * TILE;
/// Spheres between two checks whether a tile is full.
const SPHERES_PER_CHECK: usize = 64;
/// As [`Hit::wrap`]: grains of snow let light through.
const WRAP: f64 = 0.5;
/// Minimum radius of a sphere in the picture (samples): a smaller one could fall between samples.
const MIN_RADIUS: f64 = 0.75;

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
    /// Points as spheres with the radius `pscale` (m), or of half a voxel if they have none. They have the colour of snow, or colours for
    /// the values of an attribute: from dark blue at the minimum to pale yellow at the maximum; vectors by their lengths.
    ///
    /// # Errors
    /// No such attribute (the error names those that exist).
    pub fn new(points: &Points, colour: Option<&str>) -> Result<Self> {
        let unknown = |name: &str| {
            let names: Vec<&str> =
                points.attributes.iter().map(|attribute| attribute.name.as_str()).collect();
            let available = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            Error::argument(format!("the points have no attribute \"{name}\"; they have {available}"))
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

    /// Centres and radii of its spheres (m).
    pub(super) fn spheres(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        self.spheres.iter().map(|sphere| (sphere.centre, sphere.radius))
    }

    /// Its minimum and maximum corner (m); none if it is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }
}

/// The nearest sphere at each sample of a picture.
pub(super) struct Splats<'a> {
    clouds: &'a [Cloud],
    /// Tiles in a row.
    across: usize,
    /// For each sample, tile by tile, the distance along its ray (m), and cloud and sphere; infinity if there is none.
    nearest: Vec<Nearest>,
}

/// Distance (m), cloud, sphere.
type Nearest = (f32, u32, u32);

/// The projection of a sphere: the samples that it may cover.
struct Splat {
    /// Lower bound of its distance from the eye (m).
    min_distance: f32,
    cloud: u32,
    sphere: u32,
    /// Radius (m), enlarged if necessary so that it covers a sample.
    radius: f64,
    columns: [u32; 2],
    rows: [u32; 2],
}

impl<'a> Splats<'a> {
    /// Draws clouds with `samples` samples along each edge of a pixel. The result is the same with any number of threads, as each tile
    /// draws its spheres in a fixed order.
    pub fn new(
        ctx: &Context,
        clouds: &'a [Cloud],
        camera: &Camera,
        size: Size,
        samples: usize,
    ) -> Result<Self> {
        let (width, height) = (size.width as usize * samples, size.height as usize * samples);
        let across = width.div_ceil(TILE);
        if clouds.iter().all(|cloud| cloud.spheres.is_empty()) {
            return Ok(Self { clouds, across, nearest: Vec::new() });
        }
        let view = View::new(camera, width, height);
        let mut splats: Vec<Splat> = Vec::new();
        for (cloud, number) in clouds.iter().zip(0..) {
            ctx.check()?;
            let spheres = cloud.spheres.par_iter().enumerate();
            splats.par_extend(spheres.filter_map(|(n, sphere)| view.project(sphere, number, n as u32)));
        }
        // Front to back: a hidden sphere then costs one comparison per sample. Equal distances keep the order of the points.
        splats.par_sort_unstable_by(|a, b| {
            a.min_distance.total_cmp(&b.min_distance).then((a.cloud, a.sphere).cmp(&(b.cloud, b.sphere)))
        });
        let mut tiles: Vec<Vec<u32>> = vec![Vec::new(); across * height.div_ceil(TILE)];
        for (splat, n) in splats.iter().zip(0..) {
            let [rows, columns] =
                [splat.rows, splat.columns].map(|[low, high]| low as usize / TILE..=high as usize / TILE);
            for row in rows {
                columns.clone().for_each(|column| tiles[row * across + column].push(n));
            }
        }
        let mut nearest = vec![(f32::INFINITY, 0, 0); tiles.len() * TILE_SAMPLES];
        nearest.par_chunks_mut(TILE_SAMPLES).zip(&tiles).enumerate().try_for_each(
            |(tile, (samples, list))| {
                ctx.check()?;
                let corner = [tile % across * TILE, tile / across * TILE];
                draw_tile(&view, clouds, list.iter().map(|&n| &splats[n as usize]), corner, samples);
                Ok::<(), Error>(())
            },
        )?;
        Ok(Self { clouds, across, nearest })
    }

    /// The sphere that a ray with this unit direction meets first; the ray goes through a sample of the picture.
    pub fn at(&self, x: usize, y: usize, eye: DVec3, toward: DVec3) -> Option<Hit> {
        let tile = y / TILE * self.across + x / TILE;
        let (distance, cloud, sphere) =
            *self.nearest.get(tile * TILE_SAMPLES + y % TILE * TILE + x % TILE)?;
        if distance.is_infinite() {
            return None;
        }
        let Sphere { centre, radius, albedo } = self.clouds[cloud as usize].spheres[sphere as usize];
        let distance = f64::from(distance);
        // Enlarged spheres have the same normals as others.
        let normal = (eye + toward * distance - centre).try_normalize(0.0).unwrap_or(-toward);
        let shadow_bias = 0.01 * radius.max(1e-9);
        let albedo = Colour::from(albedo.map(f64::from));
        Some(Hit { distance, normal, albedo, shadow_bias, wrap: WRAP, opacity: None })
    }
}

/// Draws the spheres of a tile from front to back; stops when no further one can be seen.
fn draw_tile<'s>(
    view: &View,
    clouds: &[Cloud],
    list: impl Iterator<Item = &'s Splat>,
    corner: [usize; 2],
    tile: &mut [Nearest],
) {
    // Samples of the last tiles outside the picture never fill.
    let [right, bottom] = [(view.width - corner[0]).min(TILE), (view.height - corner[1]).min(TILE)];
    for (n, splat) in list.enumerate() {
        if n.is_multiple_of(SPHERES_PER_CHECK) {
            let rows = tile.chunks(TILE).take(bottom);
            if rows.flat_map(|row| &row[..right]).all(|sample| sample.0 <= splat.min_distance) {
                return;
            }
        }
        let centre = clouds[splat.cloud as usize].spheres[splat.sphere as usize].centre;
        let inside = |[low, high]: [u32; 2], corner: usize, count: usize| {
            (low as usize).max(corner) - corner..=(high as usize - corner).min(count - 1)
        };
        for y in inside(splat.rows, corner[1], bottom) {
            for x in inside(splat.columns, corner[0], right) {
                let sample = &mut tile[y * TILE + x];
                if sample.0 <= splat.min_distance {
                    continue;
                }
                let Some(distance) = view.intersect(centre, splat.radius, corner[0] + x, corner[1] + y)
                else {
                    continue;
                };
                if (distance as f32) < sample.0 {
                    *sample = (distance as f32, splat.cloud, splat.sphere);
                }
            }
        }
    }
}

/// The camera's view of samples.
struct View {
    eye: DVec3,
    axes: [DVec3; 3],
    width: usize,
    height: usize,
    /// Samples per length of 1 at a distance of 1.
    scale: f64,
}

impl View {
    fn new(camera: &Camera, width: usize, height: usize) -> Self {
        let half = libm::tan(camera.fov_deg.to_radians() * 0.5);
        Self { eye: camera.eye, axes: camera.axes(), width, height, scale: 0.5 * height as f64 / half }
    }

    /// The samples that a sphere may cover.
    fn project(&self, sphere: &Sphere, cloud: u32, index: u32) -> Option<Splat> {
        let [x, y, z] = self.axes.map(|axis| axis.dot(&(sphere.centre - self.eye)));
        let radius = sphere.radius.max(MIN_RADIUS * z / self.scale);
        // A sphere that contains the camera, or is beside it, is left out: it would hide everything.
        if z <= radius {
            return None;
        }
        // Tangents from the eye to the sphere's circle in the plane of an axis and the view.
        let range = |side: f64| {
            let root = radius * (side * side + z * z - radius * radius).sqrt();
            let denominator = z * z - radius * radius;
            [(side * z - root) / denominator * self.scale, (side * z + root) / denominator * self.scale]
        };
        let clip = |[low, high]: [f64; 2], middle: f64, count: usize| {
            let (low, high) =
                ((middle + low).floor().max(0.0), (middle + high).ceil().min(count as f64 - 1.0));
            (low <= high).then_some([low as u32, high as u32])
        };
        let columns = clip(range(x), 0.5 * self.width as f64, self.width)?;
        // Rows count downward.
        let rows = clip(range(-y), 0.5 * self.height as f64, self.height)?;
        // Rounded down, so that it bounds distances that are rounded too.
        let min_distance = ((sphere.centre - self.eye).norm() - radius) as f32 * (1.0 - 1e-6);
        Some(Splat { min_distance, cloud, sphere: index, radius, columns, rows })
    }

    /// The distance (m) at which the ray through a sample meets a sphere.
    fn intersect(&self, centre: DVec3, radius: f64, x: usize, y: usize) -> Option<f64> {
        let across = (x as f64 + 0.5 - 0.5 * self.width as f64) / self.scale;
        let upward = (0.5 * self.height as f64 - y as f64 - 0.5) / self.scale;
        let toward = self.axes[2] + self.axes[0] * across + self.axes[1] * upward;
        let length = toward.norm();
        let offset = centre - self.eye;
        let along = offset.dot(&toward) / length;
        let beside = offset - toward * (along / length);
        let half_chord_squared = radius * radius - beside.norm_squared();
        (half_chord_squared >= 0.0)
            .then(|| along - half_chord_squared.sqrt())
            .filter(|&distance| distance > 0.0)
    }
}
