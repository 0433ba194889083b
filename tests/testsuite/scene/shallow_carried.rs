//! Shots of a liquid that falls freely, carries scalars, and is shown at its minimum heights.

use std::fs;
use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::Value;

use super::shallow_shot::{are_same, report};
use crate::common::shapes::squares;
use crate::common::usda;
use crate::program::{Folder, command, kill_at, works};

/// A floor, and a shelf over the half of it with the lesser x, 5 cm higher.
fn shelf() -> TriMesh {
    let mut mesh = TriMesh::cuboid([-0.04, -0.005, -0.02], [0.04, 0.0, 0.02]);
    mesh.append(&TriMesh::cuboid([-0.04, 0.05, -0.02], [0.0, 0.055, 0.02]));
    mesh
}

fn write_shot(folder: &Path, lines: &str, tables: &str) {
    mesh::write(&folder.join("shelf.ply"), &shelf()).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-30\"\nfps = 60\n[shallow]\nterrain = \"shelf.ply\"\ncell = 0.002\nliquid = \"water\"\n{lines}{tables}\
         [output]\nliquid = [\"ply\", \"usd\"]\n"
    );
    fs::write(folder.join("spill.toml"), scene).unwrap();
}

const CARRIED: &str = "[[scalar]]\nname = \"milk\"\n[[scalar]]\nname = \"age\"\nlaw = \"ages\"\nrange = 60\n\
    [[scalar]]\nname = \"heat\"\nlaw = \"decays\"\nhalf_life = 0.25\nrange = 100\nstart = 20\n\
    [[source]]\nat = [-0.006, 0.06, 0]\nradius = 0.004\nrate_ml = 6\ncarries = { milk = 1, heat = 80 }\n\
    [[pour]]\nat = [0.02, 0, 0]\nradius = 0.008\nvolume_ml = 1\n\
    [[pour]]\nat = [-0.02, 0.06, 0]\nradius = 0.006\nvolume_ml = 0.5\nframe = 12\ncarries = { milk = 0.5 }\n";

const FALLS: &str = "falls = true\nborder = \"closed\"\nfill = 0.001\n";

/// Numbers of a scalar at a frame: inside, poured, sourced, falling, grown and dried, in its own measure x ml.
fn amounts(report: &Value, scalar: &str) -> [f64; 6] {
    ["inside", "poured", "sourced", "falling", "grown", "dried"]
        .map(|name| report["scalars"][scalar][format!("{name}_ml")].as_f64().unwrap())
}

#[test]
fn what_falls_and_what_it_carries_add_up_and_are_in_the_mesh() {
    let folder = &Folder::empty();
    write_shot(folder, FALLS, CARRIED);
    let said = works(folder, "check spill.toml");
    assert!(said.contains("falls     freely") && said.contains("carries   milk, age, heat"), "{said}");
    works(folder, "shallow spill.toml -o out --report run.json");
    let mut flown = 0.0_f64;
    for frame in 1..=30 {
        let report = report(folder, "out", frame);
        let ml = |name: &str| report[format!("{name}_ml")].as_f64().unwrap();
        let error = ml("poured") + ml("sourced") - ml("inside") - ml("falling") - ml("lost");
        assert!(error.abs() < 1e-9 && report["missing_units"] == 0, "{report}");
        flown = flown.max(ml("falling"));
        for scalar in ["milk", "age", "heat"] {
            let [inside, poured, sourced, falling, grown, dried] = amounts(&report, scalar);
            let error = poured + sourced + grown - inside - falling - dried;
            assert!(error.abs() < 1e-9 && report["scalars"][scalar]["missing"] == 0.0, "{report}");
        }
        let [_, poured, sourced, ..] = amounts(&report, "milk");
        let of_pour = if frame < 12 { 0.0 } else { 0.25 };
        assert!((sourced - ml("sourced")).abs() < 1e-6 && (poured - of_pour).abs() < 1e-6, "{report}");
    }
    assert!(flown > 0.05, "{flown} ml");
    let last = report(folder, "out", 30);
    assert!(last["drops"].as_u64().unwrap() > 10, "{last}");
    let run: Value = serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
    assert_eq!(run["falling_ml"], last["falling_ml"]);
    // The drops are behind the surface: they fly between the shelf and the floor, and are of milk.
    let liquid = mesh::read_detailed(&folder.join("out/liquid/liquid.0030.usdc")).unwrap();
    let [falling, milk, age, depth] =
        ["falling", "milk", "age", "depth"].map(|name| liquid.of_vertices(name).unwrap());
    let heat = liquid.of_vertices("heat").unwrap();
    let count = liquid.mesh.positions.len();
    assert_eq!(count as u64, last["vertices"].as_u64().unwrap());
    assert!(falling.is_sorted() && falling.iter().filter(|falling| **falling == 1.0).count() >= 42 * 10);
    for vertex in 0..count {
        let [x, y, _]: [f32; 3] = liquid.mesh.positions[vertex].into();
        assert!((0.0..=1.0 + 1e-5).contains(&milk[vertex]) && (-1e-5..0.5).contains(&age[vertex]));
        assert!((0.0..=80.0 + 1e-3).contains(&heat[vertex]));
        if falling[vertex] == 1.0 {
            assert!(x > -0.003 && (-0.004..0.059).contains(&y) && depth[vertex] > 0.0, "({x}, {y})");
            assert!(milk[vertex] > 0.4, "{}", milk[vertex]);
        }
    }
    // The rim takes what is around: a film of milk on the shelf is white to its edge.
    let on_shelf = (0..count).filter(|&at| falling[at] == 0.0 && liquid.mesh.positions[at].y > 0.05);
    assert!(on_shelf.clone().count() > 50 && on_shelf.clone().all(|at| milk[at] > 0.3));
    let usda = usda::text(&folder.join("out/liquid/liquid.0030.usdc"));
    for name in ["primvars:falling", "primvars:milk", "primvars:heat"] {
        assert!(usda.contains(name), "{name}");
    }
    works(folder, "preview out --frame 30 --color milk -o p.png --size 64x48");
    works(folder, "preview out --frame 30 -o p.png --size 64x48");
}

#[test]
fn a_shot_that_falls_and_carries_resumes_to_the_same_bytes() {
    let folder = &Folder::empty();
    let tool = "[[object]]\nshape = \"sphere\"\nradius = 0.006\n\
                keys = [{ frame = 1, at = [0.03, 0.03, 0] }, { frame = 30, at = [0.004, 0.02, 0] }]\n";
    write_shot(folder, FALLS, &format!("{CARRIED}{tool}"));
    let shot = "shallow spill.toml";
    works(folder, &format!("{shot} -o whole"));
    kill_at(folder, &format!("{shot} -o killed"), "killed/liquid/liquid.0014.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(folder, "whole", "killed");
    works(folder, &format!("{shot} -o one --threads 1"));
    are_same(folder, "whole", "one");
    let mut plain = command(folder, &format!("{shot} -o baseline"));
    assert!(plain.env("FRAZIL_CPU", "baseline").status().unwrap().success());
    are_same(folder, "whole", "baseline");
    // The scene beside the output has all of it.
    works(folder, "shallow whole/scene.toml -o again");
    let last = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0030.usdc")).unwrap();
    assert!(last("whole") == last("again"));
    // What sources bring may be another thing from a frame on; what falls, and what there is to carry, may not.
    for set in [
        "shallow.falls=false",
        "shallow.falls_most=9",
        "scalar.1.law=ages",
        "scalar.3.half_life=1",
        "scalar.2.name=old",
    ] {
        let key = set.split('=').next().unwrap();
        crate::program::fails(folder, &format!("{shot} -o whole --from 20 --set {set}"), 2, &[key]);
    }
    let before = amounts(&report(folder, "whole", 19), "milk");
    works(folder, &format!("{shot} -o whole --from 20 --set source.1.carries={{milk=0.0}}"));
    assert_eq!(amounts(&report(folder, "whole", 19), "milk"), before);
    assert_eq!(amounts(&report(folder, "whole", 30), "milk")[2], before[2]);
}

#[test]
fn bumps_of_a_mesh_do_not_show_through_films() {
    let folder = &Folder::empty();
    // Bumps between the middles of cells, on a sheet that is deeper in its middle, and may move.
    let bumpy = |high: f32| {
        let count = 81u32;
        let position = |index: u32| {
            let [x, z] = [index % count, index / count].map(|at| 0.001 * (at as f32 - 40.0));
            let bump = if (index % count + index / count).is_multiple_of(4) { high } else { 0.0 };
            Vec3::new(x, 2.0 * (x * x + z * z) + bump, z)
        };
        squares(count, position)
    };
    for frame in 1..=4 {
        mesh::write(&folder.join(format!("bumpy.{frame:04}.ply")), &bumpy(0.0004 + 0.0001 * frame as f32))
            .unwrap();
    }
    mesh::write(&folder.join("bumpy.ply"), &bumpy(0.0006)).unwrap();
    let scene = "[shot]\nframes = \"1-4\"\nfps = 60\n[shallow]\nterrain = \"bumpy.ply\"\ncell = 0.002\nborder = \"closed\"\n\
                 [[pour]]\nat = [0, 0, 0]\nradius = 0.02\nvolume_ml = 0.3\n";
    fs::write(folder.join("spill.toml"), scene).unwrap();
    // Mean height of wet vertices of the last frame.
    let height = |out: &str| {
        let liquid = mesh::read_detailed(&folder.join(out).join("liquid/liquid.0004.usdc")).unwrap();
        let depths = liquid.of_vertices("depth").unwrap();
        let wet = liquid.mesh.positions.iter().zip(&depths).filter(|(_, depth)| **depth > 1e-4);
        let heights: Vec<f32> = wet.map(|(position, _)| position.y).collect();
        assert!(heights.len() > 100, "{}", heights.len());
        heights.iter().sum::<f32>() / heights.len() as f32
    };
    for (set, out) in [("", "still"), ("--set shallow.terrain=bumpy.%04d.ply", "moving")] {
        works(folder, &format!("shallow spill.toml -o {out} {set}"));
        works(folder, &format!("shallow spill.toml -o {out}_plain {set} --set shallow.lifts=false"));
        let [lifted, plain] = [height(out), height(&format!("{out}_plain"))];
        assert!(lifted > plain + 2e-5 && lifted < plain + 1e-3, "{out}: {lifted} m, {plain} m");
        let reports =
            [out.to_string(), format!("{out}_plain")].map(|out| report(folder, &out, 4)["inside_ml"].clone());
        assert_eq!(reports[0], reports[1]);
    }
}

#[test]
fn liquid_that_thickens_and_that_walls_hold_back_runs_less_far_and_resumes() {
    let folder = &Folder::empty();
    let source = "[[source]]\nat = [-0.03, 0, 0]\nradius = 0.004\nrate_ml = 4\ncarries = { milk = 1 }\n\
                  [[pour]]\nat = [-0.03, 0, 0]\nradius = 0.006\nvolume_ml = 2\n";
    let scalars = "[[scalar]]\nname = \"age\"\nlaw = \"ages\"\nrange = 60\n\
                   [[scalar]]\nname = \"milk\"\nthickens_times = 500\nthickens_to = 0.5\n";
    write_shot(folder, "border = \"closed\"\nrest = 0\n", &format!("{scalars}{source}"));
    let wet = |out: &str| report(folder, out, 30)["wet_columns"].as_u64().unwrap();
    let shot = "shallow spill.toml";
    works(folder, &format!("{shot} -o thick"));
    works(folder, &format!("{shot} -o thin --set scalar.2.thickens_times=1"));
    works(folder, &format!("{shot} -o walls --set shallow.friction=walls"));
    assert!(wet("thick") + 20 < wet("thin"), "{} and {} columns", wet("thick"), wet("thin"));
    let last = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0030.usdc")).unwrap();
    assert!(last("walls") != last("thick"));
    kill_at(folder, &format!("{shot} -o killed"), "killed/liquid/liquid.0014.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(folder, "thick", "killed");
    // How it thickens and rests may be another from a frame on; where friction acts may not.
    crate::program::fails(
        folder,
        &format!("{shot} -o thick --from 20 --set shallow.friction=walls"),
        2,
        &["shallow.friction"],
    );
    works(
        folder,
        &format!("{shot} -o thick --from 20 --set scalar.2.thickens_times=1 --set shallow.rest=1e-6"),
    );
    assert!(last("thick") != last("killed"));
}

#[test]
fn liquid_stains_the_terrain_and_resumes_with_its_stains() {
    let folder = &Folder::empty();
    let tables = "[[scalar]]\nname = \"milk\"\nstains = true\n\
                  [[pour]]\nat = [0.01, 0, 0]\nradius = 0.006\nvolume_ml = 2\ncarries = { milk = 1 }\n";
    write_shot(folder, "border = \"closed\"\nstains = true\nlifts = false\n", tables);
    // Corners of squares of 2 mm: a floor with vertices between which liquid flows.
    let count = 41u32;
    let position = |index: u32| {
        Vec3::new(0.002 * (index % count) as f32 - 0.04, 0.0, 0.002 * (index / count) as f32 - 0.04)
    };
    let floor = squares(count, position);
    mesh::write(&folder.join("shelf.ply"), &floor).unwrap();
    let shot = "shallow spill.toml";
    works(folder, &format!("{shot} -o whole"));
    let stains = |out: &str, frame: u32| {
        let terrain =
            mesh::read_detailed(&folder.join(out).join(format!("terrain/terrain.{frame:04}.usdc"))).unwrap();
        assert_eq!(terrain.mesh.triangles, floor.triangles);
        assert_eq!(terrain.mesh.positions, floor.positions);
        terrain.of_vertices("stain").unwrap()
    };
    let (first, last) = (stains("whole", 1), stains("whole", 30));
    assert!(first.iter().all(|stain| *stain == 0.0));
    assert!(last.iter().all(|stain| (0.0..=1.0).contains(stain)));
    // Where it was poured it has stood for 29 frames: 1 - exp(-29 / 60 / 0.2) of a stain.
    let at = last[(20 * count + 25) as usize];
    assert!((at - 0.911).abs() < 0.01 && last[0] == 0.0, "{at}");
    kill_at(folder, &format!("{shot} -o killed"), "killed/liquid/liquid.0014.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(folder, "whole", "killed");
    assert_eq!(last, stains("killed", 30));
    // Clear water stains nothing; without a scalar that stains any liquid does. Both may be other ones from a frame on.
    works(folder, &format!("{shot} -o clear --set pour.1.carries={{milk=0.0}}"));
    assert!(stains("clear", 30).iter().all(|stain| *stain == 0.0));
    works(folder, &format!("{shot} -o clear --from 10 --set scalar.1.stains=false"));
    assert!(stains("clear", 9)[(20 * count + 25) as usize] == 0.0);
    assert!(stains("clear", 30)[(20 * count + 25) as usize] > 0.7);
    crate::program::fails(
        folder,
        &format!("{shot} -o whole --from 20 --set shallow.stains=false --set scalar.1.stains=false"),
        2,
        &["shallow.stains"],
    );
}
