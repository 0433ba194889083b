//! Models, points and fogs in one picture, and how it is drawn.

use super::camera::{Camera, Lens, Size};
use super::fog::{Fog, LitFogs, Veil};
use super::linear::{LinearPicture, LinearPixel};
use super::liquid::{MAX_FILMS, shade_liquid};
use super::model::{Hit, Model};
use super::picture::Picture;
use super::shade::{Colour, Light, shade, to_bytes};
use super::sphere_shadows::Shadows;
use super::spheres::{Cloud, Splats};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use rayon::prelude::*;

/// Samples along each edge of a pixel.
const SAMPLES: usize = 3;
/// Samples of a pixel.
const RAYS: usize = SAMPLES * SAMPLES;
/// Unit direction and nearest hit of the ray through each sample of a pixel.
type Rays = [(DVec3, Option<Hit>); RAYS];

/// The camera, the light, and everything prepared for them.
struct View<'a> {
    camera: &'a Camera,
    lens: Lens,
    light: &'a Light,
    /// The points as projected into the picture.
    splats: Splats<'a>,
    /// The points as shadow casters.
    shadows: Option<Shadows>,
    fogs: LitFogs<'a>,
    /// Whether one ray through the fogs suffices for all samples of a pixel.
    is_smooth: bool,
    /// Whether rays that hit nothing see the sky; else they see nothing.
    has_background: bool,
}

/// Light that arrives along a ray, and the share of the light from behind everything that passes, 0 to 1.
type Arriving = (Colour, f64);

/// Models, clouds of points and fogs in one picture.
pub struct Models {
    models: Vec<Model>,
    clouds: Vec<Cloud>,
    fogs: Vec<Fog>,
}

impl Models {
    /// Combines models.
    pub fn new(models: Vec<Model>) -> Self {
        Self { models, clouds: Vec::new(), fogs: Vec::new() }
    }

    /// Adds clouds of points, which are lit by the sun and the sky and cast shadows as models do.
    pub fn with_clouds(self, clouds: Vec<Cloud>) -> Self {
        Self { clouds, ..self }
    }

    /// Adds fogs, which are transparent. They are lit by the sun and the sky, and attenuate the sunlight that reaches the models.
    pub fn with_fogs(self, fogs: Vec<Fog>) -> Self {
        Self { fogs, ..self }
    }

    /// Minimum and maximum corner of everything (m); none if all is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let boxes =
            self.models.iter().filter_map(Model::bounds).chain(self.clouds.iter().filter_map(Cloud::bounds));
        let boxes = boxes.chain(self.fogs.iter().filter_map(Fog::bounds));
        boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }

    /// Draws the picture: rows in parallel, the same bytes with any number of threads.
    ///
    /// # Errors
    /// A size outside 1 to 16,384 pixels, or a cancel.
    pub fn draw(&self, ctx: &Context, camera: &Camera, light: &Light, size: Size) -> Result<Picture> {
        size.check()?;
        ctx.phase("draw", || {
            let view = self.view(ctx, camera, light, size)?;
            let mut rgb = vec![[0; 3]; size.width as usize * size.height as usize];
            self.fill(ctx, &view, &mut rgb, |_, (light, _)| to_bytes(light))?;
            Ok(Picture { size, rgb: rgb.into_flattened() })
        })
    }

    /// Draws the picture for compositing, without the sky behind it: linear light, opacity and depth. The same values with any number of
    /// threads.
    ///
    /// # Errors
    /// As [`Models::draw`]; more memory than is allowed.
    pub fn draw_linear(
        &self,
        ctx: &Context,
        camera: &Camera,
        light: &Light,
        size: Size,
    ) -> Result<LinearPicture> {
        size.check()?;
        ctx.phase("draw", || {
            let count = size.width as usize * size.height as usize;
            ctx.allow("a picture for compositing", count as u64 * LinearPicture::BYTES_PER_PIXEL)?;
            let view = View { has_background: false, ..self.view(ctx, camera, light, size)? };
            let mut pixels = vec![LinearPixel::EMPTY; count];
            self.fill(ctx, &view, &mut pixels, |rays, (light, passed)| {
                let depths = rays.iter().filter_map(|(toward, hit)| {
                    hit.as_ref().map(|hit| view.lens.depth(*toward * hit.distance))
                });
                LinearPixel {
                    light: [light.x as f32, light.y as f32, light.z as f32],
                    alpha: (1.0 - passed) as f32,
                    depth: depths.fold(f64::INFINITY, f64::min) as f32,
                }
            })?;
            Ok(LinearPicture { size, pixels })
        })
    }

    /// Fills pixels, row by row in parallel, with what `finish` makes of a pixel's rays and of their mean.
    fn fill<P: Send>(
        &self,
        ctx: &Context,
        view: &View<'_>,
        pixels: &mut [P],
        finish: impl Fn(&Rays, Arriving) -> P + Sync,
    ) -> Result<()> {
        pixels.par_chunks_mut(view.lens.width()).enumerate().try_for_each(|(y, row)| {
            ctx.check()?;
            for (x, pixel) in row.iter_mut().enumerate() {
                let rays = self.rays(view, [x, y]);
                *pixel = finish(&rays, self.mean(view, &rays));
            }
            Ok(())
        })
    }

    fn view<'a>(
        &'a self,
        ctx: &Context,
        camera: &'a Camera,
        light: &'a Light,
        size: Size,
    ) -> Result<View<'a>> {
        let splats = Splats::new(ctx, &self.clouds, camera, size, SAMPLES)?;
        let shadows = Shadows::new(&self.clouds);
        let blocked = |point, toward| self.is_blocked(shadows.as_ref(), point, toward);
        let fogs = LitFogs::new(ctx, &self.fogs, light.sun, blocked)?;
        let is_smooth = fogs.is_smooth(camera, size);
        let lens = camera.lens(size);
        Ok(View { camera, lens, light, splats, shadows, fogs, is_smooth, has_background: true })
    }

    /// The rays through the samples of a pixel.
    fn rays(&self, view: &View<'_>, [x, y]: [usize; 2]) -> Rays {
        let eye = view.camera.eye;
        std::array::from_fn(|sample| {
            let inside = |index: usize| (index as f64 + 0.5) / SAMPLES as f64;
            let (right, down) = (sample % SAMPLES, sample / SAMPLES);
            let toward = view.lens.through(x as f64 + inside(right), y as f64 + inside(down));
            let splat = view.splats.at(x * SAMPLES + right, y * SAMPLES + down, eye, toward);
            (toward, self.hit(eye, toward, splat))
        })
    }

    /// The mean of the light along the rays of a pixel, and of the share that passes.
    fn mean(&self, view: &View<'_>, rays: &Rays) -> Arriving {
        let eye = view.camera.eye;
        let veils = self.veils(view, rays);
        let (mut sum, mut passed) = (Colour::zeros(), 0.0);
        for (sample, ((toward, hit), veil)) in rays.iter().zip(&veils).enumerate() {
            if veil.transmittance > 0.0 {
                let (light, share) = self.radiance(view, (eye, *toward), hit.as_ref(), sample, MAX_FILMS);
                sum += light * veil.transmittance;
                passed += share * veil.transmittance;
            }
            sum += veil.light;
        }
        (sum / RAYS as f64, passed / RAYS as f64)
    }

    /// The nearest hit on a ray; `splat` is the ray's hit with a point of a cloud, if any.
    fn hit(&self, eye: DVec3, toward: DVec3, splat: Option<Hit>) -> Option<Hit> {
        let hits = self.models.iter().filter_map(|model| model.hit(eye, toward)).chain(splat);
        hits.reduce(|a: Hit, b| if b.distance < a.distance { b } else { a })
    }

    /// Effect of the fogs on the samples of a pixel.
    fn veils(&self, view: &View<'_>, rays: &Rays) -> [Veil; RAYS] {
        if self.fogs.is_empty() {
            return [Veil::NONE; RAYS];
        }
        let distance = |hit: &Option<Hit>| hit.as_ref().map_or(f64::INFINITY, |hit| hit.distance);
        if view.is_smooth {
            let distances = std::array::from_fn(|sample| distance(&rays[sample].1));
            return view.fogs.veils(view.camera.eye, rays[RAYS / 2].0, distances);
        }
        std::array::from_fn(|sample| {
            let (toward, hit) = &rays[sample];
            let [veil] = view.fogs.veils(view.camera.eye, *toward, [distance(hit)]);
            veil
        })
    }

    /// Whether a model or a point of a cloud blocks a direction from a point.
    fn is_blocked(&self, shadows: Option<&Shadows>, point: DVec3, toward: DVec3) -> bool {
        self.models.iter().any(|model| model.blocks(point, toward))
            || shadows.is_some_and(|shadows| shadows.blocks(point, toward))
    }

    /// Light that arrives along a ray, given by its origin, direction and nearest hit, without the fogs in between; through at most `films`
    /// liquid surfaces.
    fn radiance(
        &self,
        view: &View<'_>,
        (origin, toward): (DVec3, DVec3),
        hit: Option<&Hit>,
        sample: usize,
        films: usize,
    ) -> Arriving {
        let Some(hit) = hit else {
            let behind = if view.has_background { view.light.background(toward) } else { Colour::zeros() };
            return (behind, 1.0);
        };
        let point = origin + toward * hit.distance + hit.normal * hit.shadow_bias;
        let blocked = |direction| self.is_blocked(view.shadows.as_ref(), point, direction);
        let transmittance =
            |direction| if self.fogs.is_empty() { 1.0 } else { view.fogs.sunlight(point, direction) };
        let surface = shade(view.light, hit.normal, hit.albedo, sample, hit.wrap, blocked, transmittance);
        let Some(opacity) = hit.opacity else { return (surface, 0.0) };
        if films == 0 || opacity >= 1.0 {
            let (light, _) = shade_liquid(view.light, hit, 1.0, [surface, surface], toward, blocked);
            return (light, 0.0);
        }
        let behind = origin + toward * (hit.distance + hit.shadow_bias);
        let next = self.hit(behind, toward, None);
        let (below, passed) = self.radiance(view, (behind, toward), next.as_ref(), sample, films - 1);
        let (light, share) = shade_liquid(view.light, hit, opacity, [surface, below], toward, blocked);
        (light, share * passed)
    }
}
