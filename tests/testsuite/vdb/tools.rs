//! OpenVDB's tools as we wrap them: the same bytes from any number of threads, the textbook's volumes, and
//! whole grids after a cancel or from a damaged file.

use crate::common::liquids::context;
use crate::common::shapes::{cuboid, sphere};
use crate::common::tools;
use crate::program::Folder;
use frazil::Context;
use frazil::geometry::TriMesh;
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::vdb::file::{self, WriteOptions, to_bytes};
use frazil::vdb::level_set::{self, Scheme};
use frazil::vdb::{FloatGrid, MetaValue};

fn at(mut mesh: TriMesh, [x, y, z]: [f32; 3]) -> TriMesh {
    mesh.positions.iter_mut().for_each(|p| *p += frazil::geometry::Vec3::new(x, y, z));
    mesh
}

fn near(value: f64, expected: f64, part: f64) {
    assert!((value - expected).abs() <= part * expected.abs(), "{value} is not near {expected}");
}

fn volume(ctx: &Context, grid: &FloatGrid) -> f64 {
    level_set::measure(ctx, grid).unwrap().volume
}

#[test]
fn numbers_that_16_bits_do_not_hold_are_refused() {
    let half = WriteOptions { half: true, ..WriteOptions::default() };
    let grid = |background: f32, value: f32, edit: fn(f32) -> BlockEdit| {
        let mut grid = FloatGrid::new(0.1, background).unwrap();
        grid.set_name("heat").unwrap();
        grid.replace_blocks(&context(1), &[edit(value)]).unwrap();
        grid
    };
    let dense: fn(f32) -> BlockEdit = |value| {
        let values = Box::new(std::array::from_fn(|voxel| if voxel == 77 { value } else { 1.0 }));
        BlockEdit::Dense(Block { origin: [8, 0, 0], values, mask: [u64::MAX; 8] })
    };
    let tile: fn(f32) -> BlockEdit = |value| BlockEdit::Constant([8, 0, 0], value);
    for (background, value, edit) in [(0.0, -65_520.0, dense), (0.0, 70_000.0, tile), (70_000.0, 1.0, dense)]
    {
        let grid = grid(background, value, edit);
        let error = to_bytes(&[&grid], &half).unwrap_err().to_string();
        assert_eq!(error, "grid \"heat\" has numbers over 65,504, which 16 bits do not hold");
        to_bytes(&[&grid], &WriteOptions::default()).unwrap();
    }
    for edit in [dense, tile] {
        to_bytes(&[&grid(65_504.0, -65_519.0, edit)], &half).unwrap();
    }
}

#[test]
fn every_tool_gives_the_same_bytes_from_1_2_and_8_threads() {
    let one = tools::outputs(&context(1));
    for threads in [2, 8] {
        for ((name, expected), (_, found)) in one.iter().zip(tools::outputs(&context(threads))) {
            assert!(*expected == found, "{name} differs with {threads} threads");
        }
    }
}

#[test]
fn boxes_join_meet_and_part_as_boxes_do() {
    let ctx = context(2);
    let volume = |ctx: &Context, grid: &FloatGrid| level_set::to_mesh(ctx, grid, 0.0, 0.0).unwrap().volume();
    let make = |x: f32| level_set::from_mesh(&ctx, &at(cuboid([0.4; 3]), [x, 0.0, 0.0]), 0.01, 3.0).unwrap();
    let (a, b) = (make(0.0), make(0.25));
    let (one, shared) = (0.4f64.powi(3), 0.15 * 0.16);
    near(volume(&ctx, &a), one, 0.005);
    near(volume(&ctx, &level_set::union_copy(&ctx, &a, &b).unwrap()), 2.0 * one - shared, 0.01);
    near(volume(&ctx, &level_set::intersection_copy(&ctx, &a, &b).unwrap()), shared, 0.01);
    near(volume(&ctx, &level_set::difference_copy(&ctx, &a, &b).unwrap()), one - shared, 0.005);
    for operation in [level_set::union, level_set::intersection, level_set::difference] {
        let mut grid = make(0.0);
        operation(&ctx, &mut grid, make(0.25)).unwrap();
        assert!(level_set::to_mesh(&ctx, &grid, 0.0, 0.0).unwrap().is_closed());
    }
}

#[test]
fn an_offset_ball_is_a_larger_ball_wherever_it_is() {
    let ctx = context(2);
    for centre in [[0.0; 3], [100.0, 50.0, -100.0]] {
        let mut ball = level_set::from_mesh(&ctx, &at(sphere(0.2, 48), centre), 0.01, 3.0).unwrap();
        level_set::offset(&ctx, &mut ball, 0.05, Scheme::Weno5).unwrap();
        let measure = level_set::measure(&ctx, &ball).unwrap();
        near(measure.volume, 4.0 / 3.0 * std::f64::consts::PI * 0.25f64.powi(3), 0.01);
        near(measure.area, 4.0 * std::f64::consts::PI * 0.25f64.powi(2), 0.01);
    }
}

#[test]
fn a_level_set_measures_the_same_wherever_it_is_and_nothing_without_voxels() {
    let ctx = context(2);
    let size = |centre: [f32; 3]| {
        let ball = level_set::from_mesh(&ctx, &at(sphere(2.0, 48), centre), 0.125, 3.0).unwrap();
        level_set::measure(&ctx, &ball).unwrap()
    };
    let near_origin = size([0.0; 3]);
    for centre in [[1e4, 0.0, 0.0], [0.0, -1e4, 2e4]] {
        let far = size(centre);
        near(far.volume, near_origin.volume, 1e-3);
        near(far.area, near_origin.area, 1e-3);
    }
    let none = level_set::measure(&ctx, &FloatGrid::level_set(0.1, 3.0).unwrap()).unwrap();
    assert_eq!((none.area, none.volume), (0.0, 0.0));
}

#[test]
fn a_layer_with_faces_on_voxels_has_its_volume_near_the_origin_and_far_from_it() {
    use frazil::snow::base_layer::initial::{Cover, Ground, layer};
    let ctx = context(2);
    for far in [0.0, 100.0] {
        let ground = Ground::Plane { height: 0.0, area: [far - 1.0, -1.0, far + 1.0, 1.0] };
        let snow = layer(&ctx, &ground, &[], &Cover::Depth(0.3), 0.05, 3.0).unwrap();
        near(volume(&ctx, &snow), 1.2, 0.005);
    }
}

#[test]
fn level_sets_of_other_cells_or_shifted_ones_are_refused() {
    let ctx = context(1);
    let make = |cell: f64| level_set::from_mesh(&ctx, &sphere(0.2, 12), cell, 3.0).unwrap();
    let error = level_set::union_copy(&ctx, &make(0.02), &make(0.03)).err().unwrap();
    assert!(error.to_string().contains("0.02 m and of 0.03 m"), "{error}");
}

#[test]
fn a_cancelled_tool_leaves_its_grid_as_it_was() {
    let ctx = context(2);
    let mut grid = level_set::from_mesh(&ctx, &sphere(0.2, 24), 0.01, 3.0).unwrap();
    let before = to_bytes(&[&grid], &WriteOptions::default()).unwrap();
    let speed = grid.deep_copy().unwrap();
    ctx.cancel();
    type Tool<'a> = &'a dyn Fn(&mut FloatGrid) -> frazil::Result<()>;
    let tools: [Tool<'_>; 5] = [
        &|grid| level_set::offset(&ctx, grid, 0.01, Scheme::Weno5),
        &|grid| level_set::mean_filter(&ctx, grid, 1, 1, Scheme::Weno5),
        &|grid| level_set::gaussian_filter(&ctx, grid, 1, 1, Scheme::Weno5),
        &|grid| level_set::renormalise(&ctx, grid, Scheme::Weno5, 1),
        &|grid| level_set::advect_outward(&ctx, grid, &speed),
    ];
    for tool in tools {
        let error = tool(&mut grid).unwrap_err();
        assert!(matches!(error, frazil::Error::Cancelled), "{error}");
        assert!(to_bytes(&[&grid], &WriteOptions::default()).unwrap() == before);
    }
}

#[test]
fn a_file_cut_at_any_of_20_positions_is_refused_in_a_sentence() {
    let ctx = context(1);
    let folder = Folder::empty();
    let mut grid = level_set::from_mesh(&ctx, &sphere(0.2, 24), 0.02, 3.0).unwrap();
    grid.set_name("ball").unwrap();
    grid.set_metadata("who", MetaValue::Text("nobody".into())).unwrap();
    let bytes = to_bytes(&[&grid], &WriteOptions::default()).unwrap();
    let path = folder.join("cut.vdb");
    for part in 0..20 {
        std::fs::write(&path, &bytes[..bytes.len() * part / 20]).unwrap();
        let error =
            file::read(&path).err().unwrap_or_else(|| panic!("{part}/20 of a file was read")).to_string();
        assert!(error.contains("cut.vdb") && error.lines().count() == 1 && error.len() < 400, "{error}");
    }
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(file::read(&path).unwrap().len(), 1);
}

#[test]
fn values_that_are_not_finite_are_refused_with_the_grid() {
    let ctx = context(2);
    let folder = Folder::empty();
    let path = folder.join("nan.vdb");
    let mut grid = level_set::from_mesh(&ctx, &sphere(0.2, 6), 0.05, 3.0).unwrap();
    grid.leaves_mut().unwrap()[1].values[77] = f32::NAN;
    file::write(&path, &[&grid], &WriteOptions::default()).unwrap();
    let what = file::read_named(&path, None).map(|_| ()).unwrap_err().to_string();
    assert!(what.contains("nan.vdb") && what.contains("not finite"), "{what}");
}
