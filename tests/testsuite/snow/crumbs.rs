//! Crumbs: an island of few voxels is taken away with all that it held, a larger one stays.

use crate::common::shapes::cuboid;
use crate::program::Folder;
use frazil::geometry::{TriMesh, Vec3};
use frazil::motion::{Keys, Rigid};
use frazil::snow::base_layer::initial::{Cover, Ground, layer};
use frazil::snow::base_layer::{BaseLayer, Params, StepReport};
use frazil::sweep::Body;
use frazil::vdb::level_set;
use frazil::{Context, Pool};

const CELL: f64 = 0.02;

/// A wall around a pillar of 0.1 x 0.1 m, through all of the snow, away from the voxels' middles.
fn wall() -> Body {
    let bar = |size: [f32; 3], x: f32, z: f32| {
        let mut mesh = cuboid(size);
        let (low, high) = mesh.bounds().unwrap();
        let shift = Vec3::new(x + 0.003, 0.2, z + 0.007) - (low + high) / 2.0;
        mesh.positions.iter_mut().for_each(|p| *p += shift);
        mesh
    };
    let mut all = TriMesh::default();
    for side in [-0.1, 0.1] {
        all.append(&bar([0.3, 1.0, 0.1], 0.0, side));
        all.append(&bar([0.1, 1.0, 0.3], side, 0.0));
    }
    Body::new(Box::new(Rigid::new(all, Keys::default())), 0.0).unwrap()
}

fn pressed(threads: usize, least: usize) -> (BaseLayer, StepReport, f64) {
    let ctx = Context::new(Pool::new(threads).unwrap());
    let ground = Ground::Plane { height: 0.0, area: [-0.5, -0.5, 0.5, 0.5] };
    let snow = layer(&ctx, &ground, &[], &Cover::Depth(0.3), CELL, 3.0).unwrap();
    let mut base = BaseLayer::new(&ctx, snow, Params { noise: None, tolerance: 0.02 }).unwrap();
    base.set_min_crumb(least);
    let before = base.volume();
    let report = base.step(&ctx, &[wall()], 0.0, 0.0, 1).unwrap();
    (base, report, before)
}

fn parts(base: &BaseLayer) -> Vec<u64> {
    level_set::components(&Context::new(Pool::new(1).unwrap()), base.surface()).unwrap()
}

#[test]
fn a_small_island_goes_and_its_snow_is_counted() {
    let (kept, first, before) = pressed(2, 0);
    let island = parts(&kept)[1] as usize;
    assert!((300..450).contains(&island) && first.crumbs == 0, "{:?}", parts(&kept));
    let (same, report, _) = pressed(2, island);
    assert_eq!((parts(&same).len(), report.crumbs), (2, 0), "as large as it must be");
    assert_eq!(same.volume(), kept.volume());
    let (gone, report, _) = pressed(2, island + 1);
    assert_eq!((parts(&gone).len(), report.crumbs), (1, 1));
    // What it held is removed: from the volume, and in the level set.
    let pillar = 0.1 * 0.1 * 0.3;
    let more = report.removed_volume - first.removed_volume;
    assert!((more / pillar - 1.0).abs() < 0.06, "{more} m3 more, not {pillar}");
    assert!((before - report.base_volume - report.removed_volume).abs() < 1e-9);
    let ctx = Context::new(Pool::new(1).unwrap());
    let volume = |base: &BaseLayer| level_set::to_mesh(&ctx, base.removed(), 0.0, 0.0).unwrap().volume();
    assert!(
        ((volume(&gone) - volume(&kept)) / pillar - 1.0).abs() < 0.1,
        "{} {}",
        volume(&gone),
        volume(&kept)
    );
    // Nothing of it is left, and far from it nothing else changed.
    for x in -25..25 {
        for y in -2..18 {
            for z in -25i32..25 {
                let (with, without) = (kept.surface().value([x, y, z]), gone.surface().value([x, y, z]));
                let near = x.abs() <= 3 && z.abs() <= 3;
                assert!(!near || f64::from(without) > 0.49 * CELL, "{without} at {x} {y} {z}");
                assert!(
                    x.abs().max(z.abs()) <= 8 || with == without,
                    "{with}, then {without} at {x} {y} {z}"
                );
                assert!(near || (with < 0.0) == (without < 0.0), "{with}, then {without} at {x} {y} {z}");
            }
        }
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_threads() {
    let bytes = |threads: usize| {
        let (base, ..) = pressed(threads, 1000);
        let grids = [base.surface(), base.compression(), base.touched(), base.removed()];
        frazil::vdb::file::to_bytes(&grids, &frazil::vdb::file::WriteOptions::default()).unwrap()
    };
    assert!(bytes(1) == bytes(4));
}

#[test]
fn a_scene_counts_its_crumbs() {
    let folder = Folder::empty();
    let mesh = {
        let mut pose = Vec::new();
        let body = wall();
        body.motion().pose(0.0, &mut pose).unwrap();
        let positions = pose.iter().map(|p| p.cast()).collect();
        TriMesh { positions, triangles: body.motion().triangles().to_vec() }
    };
    frazil::io::mesh::write(&folder.join("wall.obj"), &mesh).unwrap();
    let scene = "[shot]\nframes = \"1\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.5]\ndepth = 0.3\ncell = 0.02\n\
                 min_crumb = 1000\n[[object]]\nfile = \"wall.obj\"\nnoise = false\n";
    std::fs::write(folder.join("shot.toml"), scene).unwrap();
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_frazil"))
        .current_dir(folder.path())
        .args(["snow", "shot.toml", "-o", "out", "-q"])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let report = std::fs::read_to_string(folder.join("out/report/base.0001.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["crumbs"], 1);
    assert!(std::fs::read_to_string(folder.join("out/scene.toml")).unwrap().contains("min_crumb = 1000"));
}
