//! Everything that is in the picture, and the drawing of it.

use super::camera::{Camera, Lens, Size};
use super::cloud::{Cloud, Splats};
use super::model::{Hit, Model};
use super::picture::Picture;
use super::shade::{Colour, Light, shade, to_bytes};
use super::shadows::Shadows;
use crate::base::DVec3;
use crate::context::Context;
use crate::error::{Error, Result};
use rayon::prelude::*;

/// Samples along each edge of a pixel.
const SAMPLES: usize = 3;
/// Longest edge of a picture (pixels).
const LONGEST: u32 = 16_384;

/// The light, and the points that are in its way.
#[derive(Clone, Copy)]
struct Lit<'a> {
    light: &'a Light,
    shadows: Option<&'a Shadows>,
}

/// The models in one picture.
pub struct Models {
    models: Vec<Model>,
    clouds: Vec<Cloud>,
}

impl Models {
    /// Puts models together.
    pub fn new(models: Vec<Model>) -> Self {
        Self { models, clouds: Vec::new() }
    }

    /// With clouds of points beside them, which get light from the sun and the sky and cast shadows as models do.
    pub fn with_clouds(self, clouds: Vec<Cloud>) -> Self {
        Self { clouds, ..self }
    }

    /// Least and greatest corner of everything (m); none when all is empty.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let boxes =
            self.models.iter().filter_map(Model::bounds).chain(self.clouds.iter().filter_map(Cloud::bounds));
        boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }

    /// Draws the picture: rows in parallel, the same bytes at any number of threads.
    ///
    /// # Errors
    /// A size outside 1 to 16,384 pixels, or a cancel.
    pub fn draw(&self, ctx: &Context, camera: &Camera, light: &Light, size: Size) -> Result<Picture> {
        if [size.width, size.height].iter().any(|edge| !(1..=LONGEST).contains(edge)) {
            let what = format!("a picture must have 1 to {LONGEST} pixels along each edge");
            return Err(Error::argument(what));
        }
        ctx.phase("draw", || {
            let splats = Splats::new(ctx, &self.clouds, camera, size, SAMPLES)?;
            let shadows = Shadows::new(&self.clouds);
            let scene = Lit { light, shadows: shadows.as_ref() };
            let lens = camera.lens(size);
            let row_bytes = 3 * size.width as usize;
            let mut rgb = vec![0; row_bytes * size.height as usize];
            rgb.par_chunks_mut(row_bytes).enumerate().try_for_each(|(y, row)| {
                ctx.check()?;
                for (x, pixel) in row.chunks_mut(3).enumerate() {
                    pixel.copy_from_slice(&self.pixel(&splats, &lens, camera.eye, scene, [x, y]));
                }
                Ok(())
            })?;
            Ok(Picture { size, rgb })
        })
    }

    fn pixel(
        &self,
        splats: &Splats<'_>,
        lens: &Lens,
        eye: DVec3,
        scene: Lit<'_>,
        [x, y]: [usize; 2],
    ) -> [u8; 3] {
        let mut sum = Colour::zeros();
        for sample in 0..SAMPLES * SAMPLES {
            let inside = |index: usize| (index as f64 + 0.5) / SAMPLES as f64;
            let (right, down) = (sample % SAMPLES, sample / SAMPLES);
            let toward = lens.through(x as f64 + inside(right), y as f64 + inside(down));
            let splat = splats.at(x * SAMPLES + right, y * SAMPLES + down, eye, toward);
            sum += self.seen(eye, toward, scene, sample, splat);
        }
        to_bytes(sum / (SAMPLES * SAMPLES) as f64)
    }

    /// Light that comes along a ray, which meets a point of a cloud or none.
    fn seen(&self, eye: DVec3, toward: DVec3, scene: Lit<'_>, sample: usize, splat: Option<Hit>) -> Colour {
        let hits = self.models.iter().filter_map(|model| model.hit(eye, toward)).chain(splat);
        let nearest = hits.reduce(|a: Hit, b| if b.distance < a.distance { b } else { a });
        let Some(hit) = nearest else { return scene.light.background(toward) };
        let point = eye + toward * hit.distance + hit.normal * hit.skin;
        let blocked = |direction| {
            self.models.iter().any(|model| model.blocks(point, direction))
                || scene.shadows.is_some_and(|shadows| shadows.block(point, direction))
        };
        shade(scene.light, hit.normal, hit.albedo, sample, hit.wrap, blocked)
    }
}
