//! The stage `volumes` in shots: what it writes, that it is made again alone, and what it cannot be made from.

use std::fs;
use std::path::Path;

use super::shot_grains::folder;
use super::shot_mist::{files, written};
use crate::common::usda;
use crate::program::{fails, kill_at, works};
use frazil::vdb::file::{read, to_bytes};

const ALL: &str = "fog = [\"base\", \"grains\"]\nsnow = true\nmesh = [\"ply\", \"usd\"]";
const GRAINS: &str = "compression = 0.4";

/// The grids of a kind's files, without what they say of their inputs.
fn grids(folder: &Path, out: &str, kind: &str) -> Vec<Vec<u8>> {
    let names = files(folder, out, &[kind]).into_iter().map(|(name, _)| name);
    let of_file = |name: String| {
        let grids = read(&folder.join(out).join(name)).unwrap();
        to_bytes(&grids.iter().collect::<Vec<_>>(), &Default::default()).unwrap()
    };
    names.map(of_file).collect()
}

#[test]
fn volumes_are_made_and_made_again_without_touching_base_and_grains() {
    let at = &folder(GRAINS, ALL);
    works(at, "snow shot.toml -o out -q");
    assert_eq!(files(at, "out", &["fog", "snow"]).len(), 20);
    // One more: what the clips have in common.
    assert_eq!(files(at, "out", &["mesh"]).len(), 21);
    let of_file = |name: &str| {
        let grids = read(&at.join("out").join(name)).unwrap();
        grids.iter().map(|grid| (grid.name(), grid.voxel_size())).collect::<Vec<_>>()
    };
    let radius = 0.02 * (1.0 / 3.0);
    assert_eq!(
        of_file("fog/fog.0010.vdb"),
        [("base".to_string(), 0.02), ("grains".to_string(), 0.5 * radius)]
    );
    assert_eq!(of_file("snow/snow.0010.vdb"), [("surface".to_string(), 0.02 / 5.0)]);
    let mesh = frazil::io::mesh::read(&at.join("out/mesh/mesh.0010.ply")).unwrap();
    assert!(mesh.is_closed() && mesh.triangles.len() > 1000);
    assert!(works(at, "check out").contains("all of them are as they were written"));
    // Of the grains only the states that a run resumes from are kept.
    let states = fs::read_dir(at.join("out/state")).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(states.filter(|name| name.to_string_lossy().ends_with(".grains")).count(), 2);

    let (before, snow) = (written(at, "out", &["base", "removed", "grains"]), grids(at, "out", "snow"));
    let other = "--set output.fog=[\"grains\"] --set output.mesh=[]";
    fails(at, &format!("snow shot.toml -o out -q {other}"), 2, &["output.fog"]);
    works(at, &format!("snow shot.toml -o out -q --stage volumes --from 1 {other}"));
    assert_eq!(written(at, "out", &["base", "removed", "grains"]), before);
    assert_eq!(of_file("fog/fog.0010.vdb"), [("density".to_string(), 0.5 * radius)]);
    assert!(grids(at, "out", "snow") == snow);
    assert!(files(at, "out", &["mesh"]).iter().all(|(name, _)| name.ends_with("manifest.usda")));
}

#[test]
fn caches_of_changes_give_the_same_volumes() {
    let all = "fog = [\"base\", \"grains\"]\nsnow = true\nmesh = [\"ply\"]";
    let delta = format!("base_mode = \"delta\"\ngrains_mode = \"delta\"\n{all}");
    let [whole, delta] = &[folder(GRAINS, all), folder(GRAINS, &delta)];
    works(whole, "snow shot.toml -o out -q");
    works(delta, "snow shot.toml -o out -q");
    for kind in ["fog", "snow"] {
        assert!(grids(whole, "out", kind) == grids(delta, "out", kind), "{kind}");
    }
    assert!(files(whole, "out", &["mesh"]) == files(delta, "out", &["mesh"]));
    // A single frame, and frames apart.
    works(delta, "snow shot.toml -o some -q --stage base,grains");
    works(delta, "snow shot.toml -o some -q --stage volumes --frames 1-10x4");
    let [all, some] = ["out", "some"].map(|out| grids(delta, out, "fog"));
    assert!(some == [&all[0], &all[4], &all[8]].map(Clone::clone));
}

#[test]
fn a_killed_run_resumes_to_the_same_volumes_from_any_number_of_threads() {
    let at = &folder(GRAINS, ALL);
    works(at, "snow shot.toml -o once -q --threads 2");
    kill_at(at, "snow shot.toml -o killed", "killed/state/volumes.0004.json");
    works(at, "snow shot.toml -o killed -q --threads 1");
    let kinds = ["fog", "snow", "mesh"];
    assert!(files(at, "once", &kinds) == files(at, "killed", &kinds));
}

#[test]
fn shot_usda_has_volumes_with_materials() {
    let at = &folder(GRAINS, &format!("grains = [\"vdb\", \"usd\"]\nobjects = [\"usd\"]\n{ALL}"));
    works(at, "snow shot.toml -o out -q");
    let stage = fs::read_to_string(at.join("out/shot.usda")).unwrap();
    let all = format!("{stage}{}", usda::text(&at.join("out/shot.samples.usdc")));
    let assets: Vec<&str> = all.split('@').skip(1).step_by(2).collect();
    assets.iter().for_each(|asset| assert!(at.join("out").join(asset).is_file(), "{asset}"));
    for kind in ["fog", "snow", "mesh"] {
        assert!(assets.iter().any(|asset| asset.starts_with(&format!("./{kind}/"))), "{kind} in {all}");
    }
    for words in [
        "def Volume \"fog_grains\" (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )",
        "custom float frazil:density_scale = 100\n",
        "rel field:density = </shot/fog_grains/grains>",
        "rel field:density = </shot/fog_base/base>",
        "token fieldClass = \"fogVolume\"",
        "rel field:surface = </shot/snow/surface>",
        "uniform token info:id = \"UsdPreviewSurface\"",
    ] {
        assert!(stage.contains(words), "no {words:?} in {stage}");
    }
    // Every material that is bound is there, and every one that is there is bound.
    for look in ["snow", "fog", "object"] {
        assert!(stage.contains(&format!("rel material:binding = </shot/materials/{look}>")), "{look}");
        assert_eq!(stage.matches(&format!("def Material \"{look}\"")).count(), 1, "{look}");
    }
    // What was removed is no part of a picture.
    let removed = stage.split("def Volume \"removed\"").nth(1).unwrap().split("def ").next().unwrap();
    assert!(removed.contains("uniform token purpose = \"guide\""), "{removed}");
    assert!(!usda::text(&at.join("out/mesh/mesh.0003.usdc")).contains("velocities"));
}

#[test]
fn what_volumes_cannot_be_made_from_is_said_first() {
    let at = |output: &str, words: &[&str]| {
        let folder = folder("", output);
        fails(&folder, "snow shot.toml -o out -q", 2, words);
        fails(&folder, "check shot.toml", 2, words);
        assert!(!folder.join("out/base").exists());
    };
    at("fog = [\"smoke\"]", &["fog", "smoke"]);
    at("fog = true", &["fog"]);
    at("fog = [\"mist\"]", &["fog", "mist"]);
    at("fog = [\"grains\"]\ngrains = [\"ply\"]", &["grains", "fog", "vdb"]);
    at("snow = true\ngrains = [\"ply\"]", &["grains", "snow", "vdb"]);
    at("mesh = [\"obj\"]", &["mesh", "obj"]);
    // Without grains, which need the base too.
    let folder = folder("", "");
    let text = fs::read_to_string(folder.join("shot.toml")).unwrap().replace("[grains]", "");
    let text = text.replace("mesh = []\n", "");
    let plain = |output: &str, words: &[&str]| {
        fs::write(folder.join("plain.toml"), text.replace("[output]", &format!("[output]\n{output}")))
            .unwrap();
        fails(&folder, "snow plain.toml -o out -q", 2, words);
    };
    plain("fog = [\"grains\"]", &["fog", "[grains]"]);
    plain("fog = [\"base\"]\nhalf = true", &["half", "fog"]);
    plain("snow = true\nbase = []", &["base", "snow"]);
    plain("mesh = [\"ply\"]\nbase = []", &["base", "mesh"]);
    // The surface of snow without grains is the base's.
    fs::write(folder.join("plain.toml"), text.replace("[output]", "[output]\nsnow = true")).unwrap();
    works(&folder, "snow plain.toml -o plain -q --frames 1-2");
    let surface = |name: &str| {
        let grids = read(&folder.join("plain").join(name)).unwrap();
        let surface = grids.iter().find(|grid| grid.name() == "surface").unwrap();
        to_bytes(&[surface], &Default::default()).unwrap()
    };
    assert!(surface("snow/snow.0002.vdb") == surface("base/base.0002.vdb"));
}

#[test]
fn a_check_and_the_limit_of_memory_know_the_volumes() {
    let at = &folder(GRAINS, "");
    let report = |set: &str| -> serde_json::Value {
        serde_json::from_str(&works(at, &format!("check shot.toml --json {set}"))).unwrap()
    };
    let plain = report("");
    let number = |report: &serde_json::Value, key: &str| report[key].as_f64().unwrap();
    for set in ["output.fog=[\"base\"]", "output.snow=true", "output.mesh=[\"ply\"]"] {
        let with = report(&format!("--set {set}"));
        assert!(number(&with, "disk_bytes") > number(&plain, "disk_bytes"), "{set}");
    }
    let fine = report("--set output.snow=true --set grains.radius=0.001");
    assert!(number(&fine, "memory_bytes") > number(&plain, "memory_bytes"));
    let limit = (number(&plain, "memory_bytes") + number(&fine, "memory_bytes")) / 2.0;
    let run = "snow shot.toml -o out -q --set output.snow=true --set grains.radius=0.001";
    fails(at, &format!("{run} --max-memory {}", limit.round()), 2, &["needs about"]);
}
