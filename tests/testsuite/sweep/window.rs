//! Only what can touch the window costs anything.

use crate::common::shapes;
use frazil::geometry::DVec3;
use frazil::motion::{Key, Keys, Rigid};
use frazil::sweep::{Body, Lattice, Settings, UNITS, Window, voxelise, voxelise_within};
use frazil::{Context, Pool};

const CELL: f64 = 0.02;

#[test]
fn what_rolls_out_of_the_window_is_cut_no_finer_within() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let at = |time: f64| DVec3::new(0.0, 0.0, 1.2 * time);
    let key = |time: f64| Key { time, at: at(time), turn: DVec3::x() * (std::f64::consts::TAU * time) };
    let keys = Keys::new(vec![key(0.0), key(1.0)]).unwrap();
    let body = Body::new(Box::new(Rigid::new(shapes::globe(0.2, 48, 24), keys)), 0.0).unwrap();
    let lattice = Lattice::near(CELL, DVec3::zeros()).unwrap();
    let faces = |cells: i32| {
        let window = Window { min: [-cells * UNITS; 3], max: [cells * UNITS; 3] };
        body.faces(&ctx, 0.0, 1.0, &lattice, 0.02, &window).unwrap().len()
    };
    // The first half of the way lies in the smaller one.
    let [part, all] = [faces(30), faces(200)];
    assert!(part < all && part > all / 10, "{part} faces in a part of the way, {all} in all of it");
}

#[test]
fn in_a_box_of_voxels_a_solid_is_as_the_whole_one() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let globe = shapes::globe(0.2, 48, 24);
    let settings = Settings::new(CELL);
    let whole = voxelise(&ctx, globe.clone(), &settings).unwrap();
    // From outside to the depth, below its top; wholly inside; beside it.
    for [low, high] in [[[-3, -4, -20], [12, 2, 5]], [[-1; 3], [1; 3]], [[20; 3], [30; 3]]] {
        let part = voxelise_within(&ctx, globe.clone(), &settings, [low, high]).unwrap();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let [one, two] = [&whole, &part].map(|grid| grid.value([x, y, z]));
                    assert!((one - two).abs() < 1e-3 * CELL as f32, "{one} is not {two} at {x} {y} {z}");
                }
            }
        }
    }
}
