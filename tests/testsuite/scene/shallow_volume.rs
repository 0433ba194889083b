//! Liquids on a terrain with OpenVDB: a level set as the terrain, and the liquid as a volume.

use std::fs;
use std::path::Path;

use frazil::geometry::TriMesh;
use frazil::io::mesh;
use frazil::vdb::{FloatGrid, GridClass, file};

use crate::common::usda;
use crate::program::{Folder, fails, works};

/// A block of 8 x 2 x 8 cm whose top is at 0, and a scene with a pool on it, 3 mm deep, and a film.
fn write_shot(folder: &Path, lines: &str) {
    mesh::write(&folder.join("block.ply"), &TriMesh::cuboid([-0.04, -0.02, -0.04], [0.04, 0.0, 0.04]))
        .unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-3\"\nfps = 60\n[shallow]\nterrain = \"block.ply\"\ncell = 0.002\nborder = \"closed\"\n{lines}\
         [output]\nvolume = [\"vdb\"]\n"
    );
    fs::write(folder.join("spill.toml"), scene).unwrap();
}

fn density(folder: &Path, out: &str, frame: i32) -> FloatGrid {
    let grids = file::read_own(&folder.join(format!("{out}/volume/volume.{frame:04}.vdb"))).unwrap();
    assert_eq!(grids.len(), 1);
    grids.into_iter().next().unwrap()
}

/// Sum of a grid's values.
fn sum(grid: &FloatGrid) -> f64 {
    grid.leaves().unwrap().iter().flat_map(|leaf| leaf.values.iter()).map(|value| f64::from(*value)).sum()
}

#[test]
fn the_volume_holds_all_of_the_liquid() {
    let folder = &Folder::empty();
    // A film of 10 um, and liquid poured onto it.
    write_shot(folder, "fill = 0.00001\n[[pour]]\nat = [0.01, 0, 0]\nradius = 0.01\nvolume_ml = 1.5\n");
    works(folder, "shallow spill.toml -o out");
    for frame in 1..=3 {
        let grid = density(folder, "out", frame);
        assert_eq!((grid.name(), grid.class()), ("density".into(), GridClass::Fog));
        assert!((grid.voxel_size() - 0.002).abs() < 1e-12, "{}", grid.voxel_size());
        let path = folder.join(format!("out/report/liquid.{frame:04}.json"));
        let report: serde_json::Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
        let ml = sum(&grid) * 0.002f64.powi(3) * 1e6;
        let inside = report["inside_ml"].as_f64().unwrap();
        assert!((ml / inside - 1.0).abs() < 1e-5, "{ml} ml are not {inside}");
        // It lies on the block, and each voxel is filled once at most.
        let (low, high) = grid.active_bbox().unwrap();
        let [low, high] = [low, high].map(|at| grid.index_to_world(at.map(f64::from).into()));
        assert!(
            (low.x + 0.039).abs() < 1e-9 && (high.z - 0.039).abs() < 1e-9 && low.y.abs() < 0.002,
            "{low} {high}"
        );
        let most =
            grid.leaves().unwrap().iter().flat_map(|leaf| leaf.values.iter()).fold(0.0f32, |a, b| a.max(*b));
        assert!(most <= 1.000_01, "{most}");
    }
    let text = fs::read_to_string(folder.join("out/shot.usda")).unwrap();
    assert!(text.contains("OpenVDBAsset \"density\"") && text.contains("@./shot.samples.usdc@"), "{text}");
    let samples = usda::text(&folder.join("out/shot.samples.usdc"));
    assert!(samples.contains("volume/volume.0003.vdb"), "{samples}");
    works(folder, "preview out/volume/volume.0001.vdb block.ply -o fog.png --size 32x24");
    works(folder, "check out");
}

#[test]
fn a_level_set_is_a_terrain_like_its_mesh() {
    let folder = &Folder::empty();
    write_shot(folder, "fill = 0.003\n");
    works(folder, "vdb from-mesh block.ply --cell 0.001 -o block.vdb");
    works(folder, "shallow spill.toml -o mesh");
    works(
        folder,
        "shallow spill.toml -o grid --set shallow.terrain=block.vdb --set shallow.area=[-0.04,-0.04,0.04,0.04]",
    );
    let sums = ["mesh", "grid"].map(|out| sum(&density(folder, out, 3)));
    // 40 x 40 cells, of which each has one voxel and a half.
    assert!(sums.iter().all(|sum| (sum - 2400.0).abs() < 1.0), "{sums:?}");
    works(folder, "preview grid -o grid.png --size 32x24");
    fs::write(folder.join("bad.vdb"), "no grid").unwrap();
    fails(folder, "shallow spill.toml -o no --set shallow.terrain=bad.vdb", 2, &["bad.vdb"]);
    fails(
        folder,
        "shallow spill.toml -o no --set shallow.terrain=mesh/volume/volume.0001.vdb",
        2,
        &["not a level set"],
    );
    fails(
        folder,
        "shallow spill.toml -o no --set shallow.terrain=block.vdb --set shallow.scale=2",
        2,
        &["`scale`", "for meshes"],
    );
}
