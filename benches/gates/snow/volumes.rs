//! Gates of volumes to render: the density of grains against the union of their spheres, and the seam between the base and the
//! grains that rest on it.

use std::collections::HashMap;

use frazil::Context;
use frazil::geometry::DVec3;
use frazil::snow::base_layer::BaseLayer;
use frazil::snow::grains::Grains;
use frazil::snow::render_volumes::{fog, united};
use frazil::vdb::FloatGrid;

use crate::harness::Harness;
use crate::scenes::{self, context};
use crate::snow::grains::Random;
use crate::snow::grains::births::ploughed_snow;

/// Frames after which a plough's grains have come to rest.
const FRAMES: i32 = 48;

pub fn run(h: &mut Harness) {
    let names @ [volume, seams] = ["snow.shot.fog_volume", "snow.shot.snow_seam"];
    if names.iter().any(|name| h.wants(name)) {
        let ctx = context(2);
        let (base, grains) = ploughed_snow(&ctx, FRAMES);
        h.measure(volume, || density(&ctx, &grains));
        h.measure(seams, || seam(&ctx, &base, &grains));
    }
}

/// Volume of full density against that of the union of spheres: of a heap whose spheres overlap, and of grains at rest.
fn density(ctx: &Context, grains: &Grains) -> (f64, String) {
    let real: Vec<DVec3> = grains.positions().collect();
    let off = |centres: &[DVec3], radius: f64, what: &str| {
        let grid = fog::grains(ctx, centres, radius, fog::VOXEL * radius).expect("a grid");
        assert!(grid.voxel_size() <= 0.5 * radius * (1.0 + 1.0e-9));
        let (ours, want) = (full(&grid), union(centres, radius));
        let alone = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) * centres.len() as f64;
        let off = 100.0 * (ours / want - 1.0);
        println!(
            "# {what}: {} spheres, {:.1} % of their volume in the union, full density {off:+.3} % of it",
            centres.len(),
            100.0 * want / alone
        );
        off.abs()
    };
    let heap = off(&heap(4000, 0.0025), 0.0025, "a heap");
    let real = off(&real, grains.params().radius, "ploughed snow");
    (heap.max(real), format!("heap {heap:.3}, ploughed {real:.3}"))
}

/// Overlapping spheres in a cube, the same ones every time.
fn heap(count: usize, radius: f64) -> Vec<DVec3> {
    let mut random = Random(12);
    let edge = radius * (4.0 / 3.0 * std::f64::consts::PI * count as f64 / 0.8).cbrt();
    (0..count).map(|_| DVec3::new(random.next(), random.next(), random.next()) * edge).collect()
}

/// Volume (m3) of the voxels with a density of 1.
fn full(grid: &FloatGrid) -> f64 {
    let leaves = grid.leaves().expect("leaves");
    let of_leaves =
        leaves.iter().flat_map(|leaf| leaf.values).filter(|density| **density == 1.0).count() as f64;
    let tiles = grid.tiles().expect("tiles").into_iter().filter(|tile| tile.value == 1.0);
    (of_leaves + tiles.map(|tile| f64::from(tile.edge).powi(3)).sum::<f64>()) * grid.voxel_size().powi(3)
}

/// Volume (m3) of the union of spheres: points 1/8 of a radius apart, in no relation to the grid's voxels.
fn union(centres: &[DVec3], radius: f64) -> f64 {
    let step = radius / 8.0;
    let cell = |at: DVec3| -> [i64; 3] { at.map(|x| (x / (2.0 * radius)).floor() as i64).into() };
    let mut cells: HashMap<[i64; 3], Vec<DVec3>> = HashMap::new();
    // Of each sphere, the cells that it may reach into.
    for centre in centres {
        let [low, high] = [-radius, radius].map(|reach| cell(centre.add_scalar(reach)));
        for x in low[0]..=high[0] {
            for (y, z) in (low[1]..=high[1]).flat_map(|y| (low[2]..=high[2]).map(move |z| (y, z))) {
                cells.entry([x, y, z]).or_default().push(*centre);
            }
        }
    }
    let inside = |cell: &[i64; 3], centres: &[DVec3]| {
        let low = DVec3::from(cell.map(|x| x as f64 * 2.0 * radius));
        let points = (0..16usize.pow(3)).map(|n| {
            low + DVec3::new((n >> 8) as f64 + 0.37, (n >> 4 & 15) as f64 + 0.61, (n & 15) as f64 + 0.17)
                * step
        });
        points.filter(|point| centres.iter().any(|c| (c - point).norm_squared() <= radius * radius)).count()
    };
    cells.iter().map(|(cell, centres)| inside(cell, centres)).sum::<usize>() as f64 * step.powi(3)
}

/// Holes between the base and resting grains in their united surface: positions without snow that are a voxel long on the way from
/// a grain that touches the base to it, and balls of a cell of the base that have base below and a grain above them.
fn seam(ctx: &Context, base: &BaseLayer, grains: &Grains) -> (f64, String) {
    let radius = grains.params().radius;
    let there = grains.positions().zip(grains.awake());
    let resting: Vec<DVec3> = there.filter(|(_, awake)| !awake).map(|(position, _)| position).collect();
    let grid = united::unite(ctx, base.surface(), &resting, radius).expect("a grid");
    let (touching, gaps) = gaps(ctx, base.surface(), &grid, &resting, radius);
    let (positions, balls) = balls(ctx, base.surface(), &grid);
    assert!(touching > 100, "only {touching} grains touch the base");
    let note = format!(
        "{} resting, {touching} touch the base, {gaps} of them apart from it; {balls} balls of {positions} places",
        resting.len()
    );
    ((gaps + balls) as f64, note)
}

/// Count of grains within a tenth of their diameter of the base, and of those from which no unbroken snow leads to it.
fn gaps(ctx: &Context, base: &FloatGrid, snow: &FloatGrid, centres: &[DVec3], radius: f64) -> (usize, usize) {
    let sampled = |grid: &FloatGrid, positions: &[DVec3]| {
        let mut out = Vec::new();
        grid.sample_linear(ctx, positions, &mut out).expect("samples");
        out
    };
    let distances = sampled(base, centres);
    let step = 0.5 * base.voxel_size();
    let (mut touching, mut apart) = (0, 0);
    for (centre, distance) in centres.iter().zip(distances).filter(|(_, d)| f64::from(*d) < 1.2 * radius) {
        touching += 1;
        let axes = [DVec3::x(), DVec3::y(), DVec3::z()].map(|axis| axis * step);
        let sides =
            sampled(base, &axes.iter().flat_map(|axis| [centre + axis, centre - axis]).collect::<Vec<_>>());
        let normal =
            DVec3::from_iterator(sides.chunks(2).map(|pair| f64::from(pair[0] - pair[1]))).normalize();
        let part = 0.25 * snow.voxel_size();
        let steps = (f64::from(distance).max(0.0) / part).ceil() as usize;
        let way: Vec<DVec3> = (0..=steps).map(|step| centre - normal * (step as f64 * part)).collect();
        let bare = sampled(snow, &way);
        let longest = bare.split(|distance| *distance <= 0.0).map(<[f32]>::len).max().unwrap_or(0);
        apart += usize::from(longest as f64 * part >= snow.voxel_size());
    }
    (touching, apart)
}

/// Count of voxels that a ball as wide as a cell of the base fits around, and of those with base below and a grain above.
fn balls(ctx: &Context, base: &FloatGrid, snow: &FloatGrid) -> (usize, usize) {
    let (cell, voxel) = (base.voxel_size(), snow.voxel_size());
    let half = (0.5 * cell) as f32;
    assert!(half < snow.background(), "the band is too narrow for balls");
    let mut positions = Vec::new();
    for leaf in snow.leaves().expect("leaves") {
        for index in
            (0..512).filter(|index| leaf.values[*index] >= half && leaf.values[*index] < snow.background())
        {
            positions.push(scenes::voxel(leaf.origin, index));
        }
    }
    // Up to six cells away.
    let steps = (6.0 * cell / voxel) as i32;
    let hit = |[x, y, z]: [i32; 3], way: i32| {
        (1..=steps).map(|step| [x, y + way * step, z]).find(|at| snow.value(*at) <= 0.0)
    };
    let is_base = |[x, y, z]: [i32; 3]| {
        let at = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * voxel;
        let mut out = Vec::new();
        base.sample_linear(ctx, &[at], &mut out).expect("samples");
        out[0] <= voxel as f32
    };
    let is_between = |at: &&[i32; 3]| {
        hit(**at, 1).is_some_and(|above| !is_base(above)) && hit(**at, -1).is_some_and(is_base)
    };
    (positions.len(), positions.iter().filter(is_between).count())
}
