//! Points in pictures: spheres where they are, as large as they are, in front of and behind meshes.

use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, TriMesh};
use frazil::render::{Camera, Cloud, Light, Model, Models, Picture, Size};
use frazil::{Context, Pool};

const SIZE: Size = Size { width: 200, height: 120 };

/// Points with a radius (m).
fn cloud(positions: &[[f64; 3]], radius: f32) -> Cloud {
    let positions: Vec<DVec3> = positions.iter().map(|position| DVec3::from(*position)).collect();
    let mut points = Points::at(0.1, &positions).unwrap();
    points.set("pscale", Values::Float(Column::Uniform(radius)));
    points.set("id", Values::Long(Column::Each((0..positions.len() as i64).collect())));
    Cloud::new(&points, Some("id")).unwrap()
}

fn draw(threads: usize, models: Vec<Model>, clouds: Vec<Cloud>) -> Picture {
    let ctx = Context::new(Pool::new(threads).unwrap());
    let camera = Camera { eye: DVec3::new(0.0, 0.0, 10.0), target: DVec3::zeros(), fov_deg: 30.0 };
    let light = Light::from_degrees(0.0, 60.0);
    Models::new(models).with_clouds(clouds).draw(&ctx, &camera, &light, SIZE).unwrap()
}

/// Pixels that two pictures have different.
fn changed(a: &Picture, b: &Picture) -> Vec<(u32, u32)> {
    let pixels = a.rgb.chunks(3).zip(b.rgb.chunks(3)).zip(0..);
    let other = pixels.filter(|((a, b), _)| a != b);
    other.map(|(_, n): (_, u32)| (n % SIZE.width, n / SIZE.width)).collect()
}

#[test]
fn a_sphere_covers_what_a_sphere_covers() {
    let empty = draw(1, vec![], vec![cloud(&[[0.0, 0.0, 50.0]], 0.1)]);
    for centre in [[0.0; 3], [2.0, 1.0, 0.0], [-3.0, -1.5, 2.0]] {
        let seen = changed(&empty, &draw(1, vec![], vec![cloud(&[centre], 1.0)]));
        let camera = Camera { eye: DVec3::new(0.0, 0.0, 10.0), target: DVec3::zeros(), fov_deg: 30.0 };
        let offset = DVec3::from(centre) - camera.eye;
        let mut expected = 0;
        for (y, x) in (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| (y, x))) {
            let toward = camera.through(f64::from(x) + 0.5, f64::from(y) + 0.5, SIZE);
            let distance = offset.cross(&toward).norm();
            expected += u32::from(distance <= 1.0);
            // Pixels at the edge are covered in part.
            if !(0.95..=1.05).contains(&distance) {
                assert_eq!(seen.contains(&(x, y)), distance < 1.0, "{centre:?} at {x} {y}");
            }
        }
        assert!(expected > 300, "{expected}");
    }
}

#[test]
fn spheres_and_meshes_hide_each_other() {
    let wall = || Model::mesh(&TriMesh::cuboid([-1.0, -1.0, -0.5], [1.0, 1.0, 0.5]), [0.4, 0.1, 0.1]);
    let without = draw(1, vec![wall()], vec![]);
    let behind = draw(1, vec![wall()], vec![cloud(&[[0.0, 0.0, -3.0]], 0.4)]);
    assert!(changed(&without, &behind).is_empty());
    let before = draw(1, vec![wall()], vec![cloud(&[[0.0, 0.0, 3.0]], 0.4)]);
    assert!(changed(&without, &before).contains(&(100, 60)));
    // Half inside: only the part that sticks out is seen.
    let half = draw(1, vec![wall()], vec![cloud(&[[0.0, 0.0, 0.3]], 0.4)]);
    let (part, whole) = (changed(&without, &half).len(), changed(&without, &before).len());
    assert!(part > 0 && 2 * part < whole, "{part} of {whole}");
}

#[test]
fn the_picture_does_not_depend_on_threads_or_on_which_sphere_comes_first() {
    let positions: Vec<[f64; 3]> = (0..3000)
        .map(|n| [f64::from(n % 60) * 0.1 - 3.0, f64::from(n / 60) * 0.07 - 1.7, f64::from(n % 7)])
        .collect();
    let one = draw(1, vec![], vec![cloud(&positions, 0.08)]);
    for threads in [0, 2, 8] {
        assert!(draw(threads, vec![], vec![cloud(&positions, 0.08)]) == one, "{threads} threads");
    }
    // Grains far smaller than a pixel are seen all the same.
    let empty = draw(1, vec![], vec![]);
    assert!(changed(&empty, &draw(1, vec![], vec![cloud(&positions, 1e-6)])).len() > 2500);
}
