//! What a snow shot writes by default, folders that were made with other defaults, and states that are kept.

use std::fs;
use std::path::Path;

use frazil::vdb::AnyGrid;
use serde_json::json;

use crate::common::character::output;
use crate::common::gltf_maker::Maker;
use crate::common::usda;
use crate::program::{CUBE, Folder, fails, works};

/// The defaults before meshes, grains and objects were in shot.usda.
const FORMER: &str = "--set output.objects=[] --set output.mesh=[] --set output.grains=[\"vdb\"]";

/// A folder with a cube that slides through snow with grains and mist.
fn folder(tables: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-12\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.0]\ndepth = 0.2\ncell = 0.04\n{tables}\n\
         [[object]]\nfile = \"cube.obj\"\nkeys = [{{ frame = 1, at = [0, 0.1, 0] }}, {{ frame = 12, at = [0, 0.1, 0.6] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

/// The files of a folder's frames from one on, by name; without states, of which only the last ones are kept.
fn of_frames(folder: &Path, from: i32) -> Vec<(String, Vec<u8>)> {
    let frame = |name: &str| -> Option<i32> { name.split('.').nth(1)?.parse().ok() };
    let is_wanted =
        |name: &str| !name.starts_with("state/") && frame(name).is_some_and(|frame| frame >= from);
    output(folder).into_iter().filter(|(name, _)| is_wanted(name)).collect()
}

#[test]
fn a_shot_shows_its_snow_its_grains_its_mist_and_its_objects() {
    let at = &folder("[grains]\n[mist]\nfrom_speed = 0.1");
    works(at, "snow shot.toml -o out -q --frames 1-3");
    let shot = usda::text(&at.join("out/shot.usda"));
    let prim = |start: &str| {
        let rest = shot.split_once(start).unwrap_or_else(|| panic!("no {start} in {shot}")).1;
        rest.split("\n    def ").next().unwrap().to_string()
    };
    assert!(prim("def Xform \"mesh\"").contains("def Mesh \"base\""));
    assert!(prim("def Points \"grains\"").contains("\"render\""));
    assert!(prim("def Xform \"objects\"").contains("def Mesh \"cube\""));
    assert!(!prim("def Volume \"mist\"").contains("\"guide\""));
    for kind in ["base", "removed"] {
        assert!(prim(&format!("def Volume \"{kind}\"")).contains("purpose = \"guide\""), "{kind}");
    }
    let mist = frazil::vdb::file::describe(&at.join("out/mist/mist.0003.vdb")).unwrap();
    assert!(!mist.is_empty());
    let [half, whole] = ["true", "false"].map(|half| {
        works(at, &format!("snow shot.toml -o {half} -q --set output.mist_half={half}"));
        fs::metadata(at.join(format!("{half}/mist/mist.0012.vdb"))).unwrap().len()
    });
    assert!(half < whole, "{half} {whole}");
}

#[test]
fn a_shot_writes_no_mesh_of_a_base_that_is_not_exact_and_no_objects_without_any() {
    let at = &folder("[output]\nhalf = true");
    works(at, "snow shot.toml -o out -q --frames 1-2");
    assert!(!at.join("out/mesh").exists() && at.join("out/objects").exists());
    assert!(!usda::text(&at.join("out/shot.usda")).contains("guide\"\n        token visibility"));
    fails(at, "snow shot.toml -o no --set output.mesh=[\"usd\"]", 2, &["half", "mesh"]);
    works(at, "snow shot.toml -o still -q --frames 1-2 --set object.1.role=static");
    assert!(!at.join("still/objects").exists());
}

#[test]
fn the_folder_of_a_shot_with_the_former_defaults_is_continued() {
    let at = &folder("[grains]\n[mist]\nfrom_speed = 0.1");
    works(at, &format!("snow shot.toml -o former -q --frames 1-6 {FORMER}"));
    let before = of_frames(&at.join("former"), 0);
    works(at, "snow shot.toml -o former -q");
    works(at, "snow shot.toml -o whole -q");
    let after = of_frames(&at.join("former"), 0);
    let is_kept = |file: &(String, Vec<u8>)| after.contains(file);
    assert!(before.iter().all(is_kept));
    // From frame 7 on all is as in a whole shot, and what reads the base is made of all frames. The .vdb files of grains and mist hold a hash
    // of the settings that the folder began with.
    let later = |folder: &str| -> Vec<_> {
        let files = of_frames(&at.join(folder), 7).into_iter();
        files.filter(|(name, _)| name.ends_with(".usdc") || name.starts_with("base/")).collect()
    };
    assert_eq!(later("whole").len(), 4 * 6);
    assert!(later("former") == later("whole"));
    let mist = |folder: &str| {
        let file = at.join(folder).join("mist/mist.0012.vdb");
        match frazil::vdb::file::read_any(&file, Some("density")).unwrap() {
            AnyGrid::Floats(grid) => frazil::vdb::file::to_bytes(&[&grid], &Default::default()).unwrap(),
            AnyGrid::Vectors(_) => panic!("a density of vectors"),
        }
    };
    assert!(mist("former") == mist("whole"));
    assert!(
        at.join("former/mesh/mesh.0001.usdc").is_file()
            && at.join("former/objects/objects.0001.usdc").is_file()
    );
}

#[test]
fn a_character_has_a_prim_for_each_node_and_colour() {
    let at = &folder("");
    let mut maker = Maker::new();
    let corners = [[0., 0., 0.], [0.2, 0., 0.], [0., 0.2, 0.], [0., 0., 0.2]];
    let positions = maker.floats("VEC3", 4, corners.as_flattened());
    let side = |maker: &mut Maker, corners: [u16; 6]| {
        let bytes: Vec<u8> = corners.iter().flat_map(|corner| corner.to_le_bytes()).collect();
        maker.accessor(5123, "SCALAR", 6, &bytes)
    };
    let (lower, upper) = (side(&mut maker, [0, 2, 1, 0, 1, 3]), side(&mut maker, [0, 3, 2, 1, 2, 3]));
    let part = |indices: usize, material: usize| json!({ "attributes": { "POSITION": positions }, "indices": indices, "material": material });
    maker.push("meshes", json!({ "primitives": [part(lower, 0), part(upper, 1)] }));
    maker.push("meshes", json!({ "primitives": [part(lower, 1), part(upper, 1)] }));
    maker.json["materials"] = json!([
        { "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.0, 0.0, 1.0] } },
        { "pbrMetallicRoughness": { "baseColorFactor": [0.0, 0.5, 0.0, 1.0], "baseColorTexture": { "index": 0 } } },
    ]);
    maker.json["scenes"][0]["nodes"] = json!([0, 1]);
    maker.push("nodes", json!({ "name": "body", "mesh": 0 }));
    maker.push("nodes", json!({ "name": "left hand", "mesh": 1, "translation": [0.0, 0.3, 0.0] }));
    let path = maker.write(at.path());
    fs::rename(path, at.join("hero.glb")).unwrap();
    works(at, "snow shot.toml -o out -q --frames 1-2 --set object.1.file=hero.glb");
    let shot = usda::text(&at.join("out/shot.usda"));
    let material = |prim: &str| {
        let rest = shot
            .split_once(&format!("def Mesh \"{prim}\""))
            .unwrap_or_else(|| panic!("no {prim} in {shot}"))
            .1;
        let rest = rest.split_once("material:binding = </shot/materials/").unwrap().1;
        rest.split('>').next().unwrap().to_string()
    };
    let all: Vec<&str> =
        shot.split("def Mesh \"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    let of_hero: Vec<&&str> = all.iter().filter(|name| name.starts_with("hero")).collect();
    assert_eq!(of_hero, [&"hero_body", &"hero_body_2", &"hero_left_hand"]);
    let materials = ["hero_body", "hero_body_2", "hero_left_hand"].map(material);
    assert_eq!(materials, ["object_ffff_0000_0000", "object", "object"]);
    assert!(shot.contains("inputs:diffuseColor = (1, 0, 0)"), "{shot}");
    // Each has the vertices of its triangles: all four corners of the tetrahedron, in both halves.
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("out/report/objects.0001.json")).unwrap()).unwrap();
    let of = |prim: &str, what: &str| report["contents"]["objects"][prim][what].as_u64();
    for (prim, faces) in [("hero_body", 2), ("hero_body_2", 2), ("hero_left_hand", 4)] {
        assert_eq!((of(prim, "points"), of(prim, "faces")), (Some(4), Some(faces)), "{prim}");
    }
}

#[test]
fn from_goes_back_to_a_state_that_is_kept() {
    let at = &folder("[grains]\n[mist]");
    works(at, "snow shot.toml -o few -q");
    fails(at, "snow shot.toml -o few --from 9", 2, &["--from 9", "keep_states", "last two frames"]);
    // A folder of states that are too far away goes back no farther than asked for.
    fails(at, "snow shot.toml -o few --from 9 --set output.keep_states=4", 2, &["--from 9"]);
    works(at, "snow shot.toml -o kept -q --set output.keep_states=4");
    let states = |folder: &str, stage: &str| -> Vec<String> {
        let names =
            fs::read_dir(at.join(folder).join("state")).unwrap().map(|entry| entry.unwrap().file_name());
        let names = names.map(|name| name.into_string().unwrap());
        let mut own: Vec<String> =
            names.filter(|name| name.starts_with(stage) && !name.ends_with(".json")).collect();
        own.sort();
        own
    };
    for stage in ["grains", "mist"] {
        let kept = [1, 5, 9, 11, 12].map(|frame| format!("{stage}.{frame:04}.{stage}"));
        assert_eq!(states("kept", stage), kept);
        assert_eq!(states("few", stage), kept[3..]);
    }
    // The states do not change what is made.
    // .vdb files say, in a hash, from which frame on they were made again.
    let files = |folder: &str| -> Vec<_> {
        of_frames(&at.join(folder), 0).into_iter().filter(|(name, _)| name.ends_with(".usdc")).collect()
    };
    let whole = files("kept");
    assert!(whole == files("few"));
    let said = works(at, "snow shot.toml -o kept --from 9 --set output.keep_states=4");
    assert!(said.contains("--from 9 goes back to frame 6"), "{said}");
    assert!(files("kept") == whole);
    // A change of the grains begins at the frame that it goes back to.
    works(at, "snow shot.toml -o kept -q --from 9 --set output.keep_states=4 --set grains.friction=0.9");
    let changed: Vec<String> = (files("kept").into_iter().zip(&whole))
        .filter(|(now, before)| now != *before)
        .map(|(now, _)| now.0)
        .collect();
    let first = changed.iter().filter(|name| name.starts_with("grains/")).min();
    assert!(first.is_some_and(|name| name.as_str() >= "grains/grains.0006"), "{changed:?}");
}
