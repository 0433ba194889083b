//! What is around a liquid in shot.usda: the terrain with its stains, and obstacles.

use std::fs;
use std::path::Path;

use frazil::geometry::{DetailedMesh, TriMesh, Vec3};
use frazil::io::mesh;

use crate::common::clients;
use crate::common::shapes::squares;
use crate::common::skip::skipped;
use crate::program::{Folder, works};

const FRAMES: i32 = 3;

/// A floor of 20 x 20 cells of 4 mm at a height (m).
fn floor(height: f32) -> TriMesh {
    squares(21, |index| {
        let [x, z] = [index % 21, index / 21].map(|at| 0.004 * (at as f32 - 10.0));
        Vec3::new(x, height, z)
    })
}

/// A shot of a pour on a terrain with a stone, a ball that moves and a box that does not.
fn write_shot(folder: &Path, terrain: &str, lines: &str) {
    mesh::write(&folder.join("floor.ply"), &floor(0.0)).unwrap();
    for frame in 1..=FRAMES {
        mesh::write(&folder.join(format!("rising.{frame:04}.ply")), &floor(frame as f32 * 0.001)).unwrap();
    }
    mesh::write(&folder.join("stone.obj"), &TriMesh::cuboid([-0.004; 3], [0.004; 3])).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-{FRAMES}\"\nfps = 60\n[shallow]\nterrain = \"{terrain}\"\ncell = 0.002\nliquid = \"blood\"\n{lines}\
         [[pour]]\nat = [0, 0.02, 0]\nradius = 0.008\nvolume_ml = 1\n\
         [[object]]\nfile = \"stone.obj\"\nkeys = [{{ frame = 1, at = [0.02, 0.004, 0.02] }}]\n\
         [[object]]\nshape = \"sphere\"\nradius = 0.004\n\
         keys = [{{ frame = 1, at = [-0.02, 0.004, 0] }}, {{ frame = 3, at = [-0.02, 0.004, 0.01] }}]\n\
         [[object]]\nshape = \"box\"\nsize = [0.004, 0.004, 0.004]\nkeys = [{{ frame = 1, at = [0, 0.002, -0.02] }}]\n"
    );
    fs::write(folder.join("spill.toml"), scene).unwrap();
}

fn read(folder: &Path, name: &str) -> DetailedMesh {
    mesh::read_detailed(&folder.join(name)).unwrap()
}

/// The stage, as the validators of USD and NVIDIA accept it.
fn stage(folder: &Path) -> String {
    match clients::validators() {
        Some(python) => _ = clients::usd_is_whole(&python, folder).unwrap(),
        None => skipped("no usd-validation-nvidia"),
    }
    fs::read_to_string(folder.join("shot.usda")).unwrap()
}

#[test]
fn a_terrain_that_never_changes_is_in_the_shot_once() {
    let folder = &Folder::empty();
    write_shot(folder, "floor.ply", "");
    works(folder, "shallow spill.toml -o out -q");
    let out = folder.join("out");
    // The terrain, then the stone.
    let around = read(&out, "surroundings.usdc").mesh;
    let floor = floor(0.0);
    assert_eq!(around.triangles.len(), floor.triangles.len() + 12);
    assert_eq!(around.positions[..floor.positions.len()], floor.positions);
    let stone = &around.positions[floor.positions.len()..];
    let (low, high) = stone.iter().fold((stone[0], stone[0]), |(low, high), at| (low.inf(at), high.sup(at)));
    assert!(
        (low - Vec3::new(0.016, 0.0, 0.016)).norm() < 1e-6
            && (high - low - Vec3::repeat(0.008)).norm() < 1e-6
    );
    assert!(!out.join("terrain").exists());
    // The ball moves, and the box does not.
    let [first, last] = [1, 3].map(|frame| read(&out, &format!("obstacles/obstacles.{frame:04}.usdc")).mesh);
    let moved = |vertex: usize| last.positions[vertex] - first.positions[vertex];
    assert!((moved(0) - Vec3::new(0.0, 0.0, 0.01)).norm() < 1e-6);
    assert_eq!(moved(first.positions.len() - 1), Vec3::zeros());
    let text = stage(&out);
    for words in [
        "prepend references = @./surroundings.usdc@",
        "over \"terrain\"",
        "over \"mesh_1\"",
        "def Mesh \"obstacle_2\"",
        "</shot/materials/terrain>",
    ] {
        assert!(text.contains(words), "no {words} in {text}");
    }
    assert!(!text.contains("@./terrain/"), "{text}");
    works(folder, "shallow spill.toml -o bare -q --set output.terrain=[]");
    let bare = folder.join("bare");
    assert!(!bare.join("surroundings.usdc").exists() && !bare.join("obstacles").exists());
    assert!(!stage(&bare).contains("surroundings"));
}

#[test]
fn a_terrain_that_moves_or_is_stained_has_a_file_for_each_frame() {
    let folder = &Folder::empty();
    write_shot(folder, "rising.%04d.ply", "");
    works(folder, "shallow spill.toml -o out -q");
    for frame in 1..=FRAMES {
        let terrain = read(folder, &format!("out/terrain/terrain.{frame:04}.usdc"));
        assert_eq!(terrain.mesh, floor(frame as f32 * 0.001));
    }
    assert_eq!(read(folder, "out/surroundings.usdc").mesh.triangles.len(), 12);
    let text = stage(&folder.join("out"));
    assert!(text.contains("@./terrain/terrain.0002.usdc@"), "{text}");

    write_shot(folder, "floor.ply", "stains = true\nstain_half_life = 0.01\n");
    works(folder, "shallow spill.toml -o stained -q --set output.terrain=[\"usd\",\"ply\"]");
    let usd = read(folder, "stained/terrain/terrain.0003.usdc");
    let ply = read(folder, "stained/terrain/terrain.0003.ply");
    assert_eq!(usd.mesh, ply.mesh);
    let [stain, red] = ["stain", "red"].map(|name| usd.of_vertices(name).unwrap());
    assert_eq!(stain, ply.of_vertices("stain").unwrap());
    let middle = 10 * 21 + 10;
    assert!(stain[middle] > 0.1 && stain[0] == 0.0, "{} {}", stain[middle], stain[0]);
    // Linear colours of the ground and of blood, and the ground's in sRGB.
    let mixed = 0.5 + (0.3 - 0.5) * stain[middle];
    assert!((red[middle] - mixed).abs() < 1e-6 && (red[0] - 0.5).abs() < 1e-6, "{}", red[middle]);
    assert_eq!(ply.of_vertices("red").unwrap()[0], 188.0);
    let text = stage(&folder.join("stained"));
    assert!(text.contains("color3f[] primvars:displayColor"), "{text}");
    assert!(text.contains("</shot/materials/stained_terrain>"), "{text}");
}

#[test]
fn an_opacity_in_ply_has_a_colour_beside_it() {
    let folder = &Folder::empty();
    write_shot(folder, "floor.ply", "");
    works(folder, "shallow spill.toml -o out -q --frames 1 --set output.liquid=[\"ply\",\"usd\"]");
    let ply = read(folder, "out/liquid/liquid.0001.ply");
    // The blood of its material, in sRGB.
    for (name, value) in [("red", 149.0), ("green", 22.0), ("blue", 18.0)] {
        let values = ply.of_vertices(name).unwrap();
        assert!(values.iter().all(|one| *one == value), "{name}: {}", values[0]);
    }
    assert_eq!(ply.of_vertices("alpha"), read(folder, "out/liquid/liquid.0001.usdc").of_vertices("alpha"));
}

#[test]
fn a_folder_with_the_files_of_former_defaults_is_resumed_and_drawn() {
    let folder = &Folder::empty();
    write_shot(folder, "floor.ply", "");
    works(folder, "shallow spill.toml -o out -q --frames 1 --set output.liquid=[\"ply\"]");
    works(folder, "shallow spill.toml -o out -q");
    let is_there = |name: &str| folder.join("out/liquid").join(name).is_file();
    assert!(is_there("liquid.0001.ply") && !is_there("liquid.0001.usdc") && is_there("liquid.0003.usdc"));
    for frame in [1, 3] {
        works(folder, &format!("preview out --frame {frame} -o p.png --size 32x24"));
    }
    works(folder, "shallow spill.toml -o fresh -q");
    let last = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0003.usdc")).unwrap();
    assert!(last("out") == last("fresh"));
}
