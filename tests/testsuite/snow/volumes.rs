//! Densities and the united surface against formulas, and the same bytes whatever does the work.

use crate::common::liquids::context;
use frazil::Context;
use frazil::geometry::DVec3;
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::render_volumes::{fog, united};
use frazil::vdb::file::to_bytes;
use frazil::vdb::{FloatGrid, GridClass, MetaValue, level_set};

const CELL: f64 = 0.02;
const RADIUS: f64 = CELL / 3.0;

/// Snow 0.15 m deep on a square.
fn snow(ctx: &Context) -> FloatGrid {
    let ground = Ground::Plane { height: 0.0, area: [-0.4, -0.3, 0.4, 0.5] };
    layer(ctx, &ground, &[], &Cover::Depth(0.15), CELL, 3.0).unwrap()
}

/// Positions that fill a box of 2 x 0.6 x 0.6 grains' radii times ten, also across the origin: the same ones every time.
fn scattered(count: usize) -> Vec<DVec3> {
    let mut seed = 7u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    (0..count).map(|_| DVec3::new(40.0 * next(), 12.0 * next(), 12.0 * next()) * RADIUS).collect()
}

fn bytes(grid: &FloatGrid) -> Vec<u8> {
    to_bytes(&[grid], &Default::default()).unwrap()
}

#[test]
fn grains_are_full_in_their_spheres_and_fade_over_half_a_radius() {
    let ctx = context(2);
    let (centres, voxel) = (scattered(40), 0.4 * RADIUS);
    let grid = fog::grains(&ctx, &centres, RADIUS, voxel).unwrap();
    assert_eq!(grid.class(), GridClass::Fog);
    let scale = (frazil::vdb::DENSITY_SCALE_KEY.to_string(), MetaValue::Float(100.0));
    assert!(grid.metadata().unwrap().contains(&scale));
    let (mut full, mut fading, mut active) = (0, 0, 0);
    for x in -70..=70 {
        for (y, z) in (-25..=25).flat_map(|y| (-25..=25).map(move |z| (y, z))) {
            let at = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * voxel;
            let nearest = centres.iter().map(|centre| (centre - at).norm()).fold(f64::INFINITY, f64::min);
            let left = (1.0 - (nearest - RADIUS) / (0.5 * RADIUS)).clamp(0.0, 1.0);
            let (want, value) = (left * left * (3.0 - 2.0 * left), f64::from(grid.value([x, y, z])));
            assert!((value - want).abs() < 1e-4, "{value} at {at:?}, where {want} should be");
            // Rounding decides on the sphere itself.
            assert!(value == 1.0 || nearest > RADIUS * (1.0 - 1e-5));
            active += u64::from(value > 0.0);
            full += usize::from(value == 1.0);
            fading += usize::from(value > 0.0 && value < 1.0);
        }
    }
    assert!(full > 1000 && fading > 1000, "{full} {fading}");
    assert_eq!(grid.active_voxels(), active, "what is active has a density, and all that has one was seen");
}

#[test]
fn the_density_of_the_base_sums_to_its_volume_and_is_tiles_inside() {
    let ctx = context(2);
    let deep = Ground::Plane { height: 0.0, area: [-0.4, -0.3, 0.4, 0.5] };
    let surface = layer(&ctx, &deep, &[], &Cover::Depth(0.6), CELL, 3.0).unwrap();
    let grid = fog::base(&ctx, &surface).unwrap();
    assert_eq!(grid.class(), GridClass::Fog);
    assert_eq!(grid.voxel_size(), CELL);
    let of_leaves: f64 =
        grid.leaves().unwrap().iter().flat_map(|leaf| leaf.values).map(|x| f64::from(*x)).sum();
    let tiles = grid.tiles().unwrap();
    let of_tiles: f64 = tiles.iter().map(|tile| f64::from(tile.value) * f64::from(tile.edge).powi(3)).sum();
    let volume = (of_leaves + of_tiles) * CELL.powi(3);
    assert!((volume / (0.8 * 0.8 * 0.6) - 1.0).abs() < 0.01, "{volume}");
    assert!(
        of_tiles > 0.3 * of_leaves && tiles.iter().all(|tile| tile.active && tile.value == 1.0),
        "{of_tiles} {of_leaves}"
    );
    let middle = grid.value([0, 15, 5]);
    assert_eq!((middle, grid.value([0, 40, 5]), grid.value([0, -10, 5])), (1.0, 0.0, 0.0));
}

#[test]
fn without_grains_the_united_surface_is_the_base() {
    let ctx = context(2);
    let base = snow(&ctx);
    let fine = united::unite(&ctx, &base, &[], RADIUS).unwrap();
    assert_eq!((fine.class(), fine.voxel_size()), (GridClass::LevelSet, CELL / 5.0));
    let leaves = fine.leaves().unwrap();
    let width = f64::from(fine.background());
    let mut positions = Vec::new();
    for leaf in leaves.iter().step_by(7) {
        let at = |voxel: usize| {
            let voxel = [voxel >> 6, voxel >> 3 & 7, voxel & 7];
            DVec3::from([0, 1, 2].map(|axis| f64::from(leaf.origin[axis] + voxel[axis] as i32))) * CELL / 5.0
        };
        positions.extend((0..512).map(at));
    }
    let [mut of_base, mut of_fine] = [Vec::new(), Vec::new()];
    base.sample_linear(&ctx, &positions, &mut of_base).unwrap();
    fine.sample_linear(&ctx, &positions, &mut of_fine).unwrap();
    for (at, (a, b)) in positions.iter().zip(of_base.iter().zip(&of_fine)) {
        let want = f64::from(*a).clamp(-width, width);
        assert!((want - f64::from(*b)).abs() < 1e-6, "{b} at {at:?}, where {want} should be");
    }
    // A mesh cuts the edges of the layer, by less on smaller voxels.
    let volume = level_set::to_mesh(&ctx, &fine, 0.0, 0.0).unwrap().volume();
    assert!((volume / (0.8 * 0.8 * 0.15) - 1.0).abs() < 0.005, "{volume}");
    // Deep inside and far outside too.
    assert!(fine.value([0, 18, 0]) < 0.0 && fine.value([0, 100, 0]) > 0.0 && fine.value([300, 18, 0]) > 0.0);
}

#[test]
fn grains_that_touch_the_base_or_each_other_are_joined_to_it() {
    let ctx = context(2);
    let base = snow(&ctx);
    let top = level_set::to_mesh(&ctx, &base, 0.0, 0.0).unwrap().bounds().unwrap().1.y;
    // A grain a tenth of a diameter above the snow, and another one on it; at several positions within a voxel.
    for shift in [0.0, 0.31, 0.57, 0.83] {
        let at = |height: f64| {
            DVec3::new(0.1 + shift * CELL / 5.0, f64::from(top) + height * RADIUS, 0.1 + 0.5 * shift * CELL)
        };
        let parts = |centres: &[DVec3]| {
            let grid = united::unite(&ctx, &base, centres, RADIUS).unwrap();
            let mesh = level_set::to_mesh(&ctx, &grid, 0.0, 0.0).unwrap();
            assert!(mesh.is_closed());
            (level_set::components(&ctx, &grid).unwrap().len(), mesh.volume())
        };
        let (bare, joined, far) = (parts(&[]), parts(&[at(1.2), at(3.2)]), parts(&[at(4.0)]));
        assert_eq!((bare.0, joined.0, far.0), (1, 1, 2), "{shift}");
        let grown = 4.0 / 3.0 * std::f64::consts::PI * (1.25 * RADIUS).powi(3);
        // A mesh on voxels of half a radius lies inside the sphere.
        let one = (far.1 - bare.1) / grown;
        assert!((0.65..1.0).contains(&one), "{one}");
        let two = (joined.1 - bare.1) / (far.1 - bare.1);
        assert!((1.8..2.5).contains(&two), "{two}");
    }
}

#[test]
fn voxels_divide_a_cell_and_resolve_a_grain() {
    assert_eq!(united::division(0.0075, 0.0025), 5);
    assert_eq!(united::division(0.3, 0.15), 3);
    for (cell, radius) in [(0.01, 0.0033), (0.02, 0.001), (0.005, 0.0025)] {
        let voxel = cell / united::division(cell, radius) as f64;
        assert!(
            voxel <= radius / 1.5 * (1.0 + 1e-9) && voxel > radius / 1.5 - 0.3 * radius,
            "{voxel} {radius}"
        );
    }
}

#[test]
fn threads_and_the_order_of_grains_change_no_byte() {
    let [one, two] = [context(1), context(2)];
    let (centres, base) = (scattered(500), snow(&two));
    let above: Vec<DVec3> = centres.iter().map(|centre| centre + DVec3::new(0.0, 0.16, 0.0)).collect();
    let reversed: Vec<DVec3> = above.iter().rev().copied().collect();
    let grains =
        |ctx: &Context, centres: &[DVec3]| bytes(&fog::grains(ctx, centres, RADIUS, 0.5 * RADIUS).unwrap());
    assert!(grains(&one, &above) == grains(&two, &reversed));
    let unite =
        |ctx: &Context, centres: &[DVec3]| bytes(&united::unite(ctx, &base, centres, RADIUS).unwrap());
    assert!(unite(&one, &above) == unite(&two, &reversed));
    assert!(bytes(&fog::base(&one, &base).unwrap()) == bytes(&fog::base(&two, &base).unwrap()));
}

#[test]
fn what_no_volume_can_be_made_from_is_refused() {
    let ctx = context(1);
    let base = snow(&ctx);
    let at = |position: DVec3| [position];
    let fog =
        |positions: &[DVec3], radius: f64, voxel: f64| fog::grains(&ctx, positions, radius, voxel).err();
    let said = |error: Option<frazil::Error>| error.expect("an error").to_string();
    let near = at(DVec3::zeros());
    assert!(said(fog(&near, RADIUS, 0.51 * RADIUS)).contains("at most half"));
    assert!(said(fog(&near, RADIUS, 0.0)).contains("at most half"));
    assert!(said(fog(&near, f64::NAN, 0.001)).contains("radius"));
    assert!(said(fog(&at(DVec3::new(0.0, f64::NAN, 0.0)), RADIUS, 0.001)).contains("sphere 1 of 1"));
    assert!(said(fog(&at(DVec3::new(0.0, 0.0, 1e12)), RADIUS, 0.001)).contains("sphere 1 of 1"));
    assert!(said(united::unite(&ctx, &base, &near, 1e-6).err()).contains("too small"));
    let plain = FloatGrid::new(CELL, 0.0).unwrap();
    assert!(said(united::unite(&ctx, &plain, &near, RADIUS).err()).contains("level set"));
    // Nothing at all is no fault.
    assert_eq!(fog::grains(&ctx, &[], RADIUS, 0.5 * RADIUS).unwrap().active_voxels(), 0);
    ctx.cancel();
    assert!(matches!(fog(&near, RADIUS, 0.5 * RADIUS), Some(frazil::Error::Cancelled)));
}
