//! Every wrapped tool of OpenVDB, run once on the same small input: what it makes, as bytes.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh};
use frazil::vdb::file::{WriteOptions, to_bytes};
use frazil::vdb::level_set::{self, Scheme};
use frazil::vdb::{FloatGrid, MetaValue};

use super::shapes::{blob, sphere};

const CELL: f64 = 0.01;

fn ball(ctx: &Context) -> FloatGrid {
    level_set::from_mesh(ctx, &sphere(0.2, 24), CELL, 3.0).expect("ball")
}

fn bump(ctx: &Context) -> FloatGrid {
    let mut mesh = blob(0.35, 24);
    mesh.positions.iter_mut().for_each(|p| p.x += 0.13);
    level_set::from_mesh(ctx, &mesh, CELL, 3.0).expect("bump")
}

fn bytes(grid: &FloatGrid) -> Vec<u8> {
    to_bytes(&[grid], &WriteOptions::default()).expect("bytes")
}

fn mesh_bytes(mesh: &TriMesh) -> Vec<u8> {
    let positions =
        mesh.positions.iter().flat_map(|p| p.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    positions.chain(mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes())).collect()
}

/// The name of each tool, and what it makes.
pub fn outputs(ctx: &Context) -> Vec<(&'static str, Vec<u8>)> {
    let edited = |tool: &dyn Fn(&mut FloatGrid)| {
        let mut grid = ball(ctx);
        tool(&mut grid);
        bytes(&grid)
    };
    let mut speed = ball(ctx);
    speed.set_metadata("use", MetaValue::Text("a speed".into())).expect("metadata");
    let points: Vec<DVec3> =
        (0..5000).map(|i| DVec3::new((f64::from(i) * 0.37).sin(), 0.1, f64::from(i) * 1e-4 - 0.2)).collect();
    let sampled = |linear: bool| {
        let mut out = Vec::new();
        let grid = ball(ctx);
        let done = if linear {
            grid.sample_linear(ctx, &points, &mut out)
        } else {
            grid.sample_nearest(ctx, &points, &mut out)
        };
        done.expect("samples");
        out.into_iter().flat_map(f32::to_le_bytes).collect()
    };
    let measured = level_set::measure(ctx, &ball(ctx)).expect("measure");
    let parts = level_set::components(ctx, &ball(ctx)).expect("components");
    vec![
        ("from_mesh", bytes(&bump(ctx))),
        ("to_mesh", mesh_bytes(&level_set::to_mesh(ctx, &bump(ctx), 0.0, 0.0).expect("mesh"))),
        ("to_mesh adaptive", mesh_bytes(&level_set::to_mesh(ctx, &bump(ctx), 0.0, 0.5).expect("mesh"))),
        ("union", edited(&|grid| level_set::union(ctx, grid, bump(ctx)).expect("union"))),
        ("difference", edited(&|grid| level_set::difference(ctx, grid, bump(ctx)).expect("difference"))),
        (
            "intersection",
            edited(&|grid| level_set::intersection(ctx, grid, bump(ctx)).expect("intersection")),
        ),
        ("union_copy", bytes(&level_set::union_copy(ctx, &ball(ctx), &bump(ctx)).expect("union"))),
        (
            "difference_copy",
            bytes(&level_set::difference_copy(ctx, &ball(ctx), &bump(ctx)).expect("difference")),
        ),
        (
            "intersection_copy",
            bytes(&level_set::intersection_copy(ctx, &ball(ctx), &bump(ctx)).expect("copy")),
        ),
        ("offset", edited(&|grid| level_set::offset(ctx, grid, 0.013, Scheme::Weno5).expect("offset"))),
        (
            "offset first",
            edited(&|grid| level_set::offset(ctx, grid, -0.013, Scheme::FirstOrder).expect("offset")),
        ),
        ("mean", edited(&|grid| level_set::mean_filter(ctx, grid, 1, 2, Scheme::FirstOrder).expect("mean"))),
        (
            "gaussian",
            edited(&|grid| level_set::gaussian_filter(ctx, grid, 1, 1, Scheme::Weno5).expect("gaussian")),
        ),
        (
            "renormalise",
            edited(&|grid| level_set::renormalise(ctx, grid, Scheme::Weno5, 3).expect("renormalise")),
        ),
        ("advect_outward", edited(&|grid| level_set::advect_outward(ctx, grid, &speed).expect("advect"))),
        ("prune", edited(&|grid| grid.prune(0.001).expect("prune"))),
        ("prune_level_set", edited(&|grid| grid.prune_level_set().expect("prune"))),
        ("flood_fill", edited(&|grid| grid.flood_fill().expect("flood fill"))),
        ("sample_linear", sampled(true)),
        ("sample_nearest", sampled(false)),
        ("measure", [measured.area, measured.volume].into_iter().flat_map(f64::to_le_bytes).collect()),
        ("components", parts.into_iter().flat_map(u64::to_le_bytes).collect()),
    ]
}
