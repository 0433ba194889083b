//! Pictures for compositing: over the sky they are the usual picture, and their depth is that along the view direction.

use frazil::geometry::{DVec3, TriMesh};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::render::{Camera, Fog, Light, LinearPicture, Model, Models, Picture, Size};
use frazil::vdb::{FloatGrid, GridClass};
use frazil::{Context, Pool};

const SIZE: Size = Size { width: 48, height: 36 };

fn ctx(threads: usize) -> Context {
    Context::new(Pool::new(threads).unwrap())
}

/// In front of the origin, at its height.
fn camera() -> Camera {
    Camera { eye: DVec3::new(0.0, 0.0, 4.0), target: DVec3::zeros(), fov_deg: 40.0 }
}

fn light() -> Light {
    Light::from_degrees(40.0, 50.0)
}

/// A fog of 0.8 m, around a point.
fn fog(x: i32, extinction: f64) -> Fog {
    let mut grid = FloatGrid::new(0.1, 0.0).unwrap();
    let block = Block { origin: [x, 0, 0], values: Box::new([1.0; 512]), mask: [u64::MAX; 8] };
    grid.replace_blocks(&ctx(1), &[BlockEdit::Dense(block)]).unwrap();
    grid.set_class(GridClass::Fog).unwrap();
    Fog::grid(&ctx(1), &grid, extinction).unwrap()
}

/// A cube, a film of liquid beside it, and fog before both and before the sky.
fn models() -> Models {
    let cube = TriMesh::cuboid([-0.9, -0.7, -0.5], [-0.1, 0.1, 0.5]);
    let film = TriMesh::cuboid([0.2, -0.7, 0.0], [0.9, 0.0, 0.01]);
    let opacities = vec![0.4; film.positions.len()];
    let models = vec![Model::mesh(&cube, [0.5, 0.3, 0.2]), Model::liquid(&film, [0.1, 0.3, 0.5], opacities)];
    Models::new(models).with_fogs(vec![fog(-8, 1.0), fog(0, 2.0)])
}

fn linear(models: &Models, threads: usize) -> LinearPicture {
    models.draw_linear(&ctx(threads), &camera(), &light(), SIZE).unwrap()
}

/// Linear light as it is shown: exposure, shoulder, sRGB.
fn shown(light: f64) -> u8 {
    let value = 0.92 * light;
    let over = (value - 0.6) / 0.4;
    let value = if over < 0.0 { value } else { 0.6 + 0.4 * over / (1.0 + over) };
    let coded = if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (255.0 * coded).round() as u8
}

/// The light of the sky, from a picture of it alone.
fn sky(picture: &Picture, at: usize) -> f64 {
    let coded = f64::from(picture.rgb[at]) / 255.0;
    let value = if coded <= 0.04045 { coded / 12.92 } else { ((coded + 0.055) / 1.055).powf(2.4) };
    assert!(value < 0.6, "under the shoulder: {value}");
    value / 0.92
}

#[test]
fn over_the_sky_it_is_the_usual_picture() {
    let models = models();
    let usual = models.draw(&ctx(2), &camera(), &light(), SIZE).unwrap();
    let behind = Models::new(Vec::new()).draw(&ctx(2), &camera(), &light(), SIZE).unwrap();
    let drawn = linear(&models, 2);
    let mut partly = 0;
    for (n, pixel) in drawn.pixels.iter().enumerate() {
        assert!((0.0..=1.0).contains(&pixel.alpha), "{pixel:?}");
        partly += usize::from(pixel.alpha > 0.02 && pixel.alpha < 0.98);
        for channel in 0..3 {
            let at = 3 * n + channel;
            let over = f64::from(pixel.light[channel]) + (1.0 - f64::from(pixel.alpha)) * sky(&behind, at);
            let off = i32::from(shown(over)) - i32::from(usual.rgb[at]);
            assert!(off.abs() <= 2, "pixel {n}: {over} is {off} off, {pixel:?}");
        }
    }
    // The fogs, the film and the edges.
    assert!(partly > 200, "{partly}");
    assert_eq!(drawn, linear(&models, 3), "by any number of threads");
}

#[test]
fn a_film_and_a_fog_hide_what_they_should() {
    let alpha_of = |models: Models| linear(&models, 1).pixels[18 * 48 + 24].alpha;
    // Two walls of a film that the camera looks at straight: each passes 0.6 but for the 2 % that it mirrors.
    let film = TriMesh::cuboid([-0.5, -0.5, 0.0], [0.5, 0.5, 0.01]);
    let film = Model::liquid(&film, [0.1, 0.3, 0.5], vec![0.4; 8]);
    let alpha = alpha_of(Models::new(vec![film]));
    assert!((f64::from(alpha) - (1.0 - (0.6f64 * 0.98).powi(2))).abs() < 0.02, "{alpha}");
    let ctx = ctx(1);
    let camera =
        Camera { eye: DVec3::new(0.35, 0.35, 4.0), target: DVec3::new(0.35, 0.35, 0.0), fov_deg: 10.0 };
    let through = Models::new(Vec::new()).with_fogs(vec![fog(0, 1.0)]);
    let pixel = through.draw_linear(&ctx, &camera, &light(), SIZE).unwrap().pixels[18 * 48 + 24];
    assert!((f64::from(pixel.alpha) - (1.0 - (-0.8f64).exp())).abs() < 0.02, "{pixel:?}");
    assert_eq!(pixel.depth, f32::INFINITY, "fog has no depth");
}

#[test]
fn depth_is_along_the_view_direction() {
    // A wall across the view is equally deep everywhere, though its corners are farther away.
    let wall = TriMesh::cuboid([-0.9, -0.9, -1.0], [0.9, 0.9, 0.5]);
    let drawn = linear(&Models::new(vec![Model::mesh(&wall, [0.5; 3])]), 2);
    let solid: Vec<f32> =
        drawn.pixels.iter().filter(|pixel| pixel.alpha == 1.0).map(|pixel| pixel.depth).collect();
    assert!(solid.len() > 500, "{}", solid.len());
    assert!(solid.iter().all(|depth| (depth - 3.5).abs() < 1e-4), "{solid:?}");
    let empty = drawn.pixels[0];
    assert_eq!((empty.light, empty.alpha, empty.depth), ([0.0; 3], 0.0, f32::INFINITY));
    // A pixel at the rim has the depth of what covers a part of it.
    let rim = drawn.pixels.iter().find(|pixel| pixel.alpha > 0.0 && pixel.alpha < 1.0).unwrap();
    assert!((rim.depth - 3.5).abs() < 1e-4, "{rim:?}");
}
