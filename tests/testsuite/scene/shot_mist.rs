//! The stage `mist` in shots: what it writes, that it is made again alone and resumes, and what it cannot be made from.

use std::fs;
use std::path::Path;

use super::shot_grains::folder;
use crate::common::character::output;
use crate::common::usda;
use crate::program::{fails, frazil, kill_at, works};
use frazil::geometry::DVec3;
use frazil::vdb::AnyGrid;
use frazil::vdb::file::{read, read_any, to_bytes, write};

const GRAINS: &str = "compression = 0.4";
/// The cube of the shot pushes its grains slowly.
const MIST: &str = "[mist]\nfrom_speed = 0.3";
/// The same in larger cells: a fraction of the time.
const COARSE: &str = "[mist]\nfrom_speed = 0.3\ncell = 0.05";

/// Files of an output in some folders.
pub fn files(at: &Path, out: &str, kinds: &[&str]) -> Vec<(String, Vec<u8>)> {
    let is_of = |name: &String| kinds.iter().any(|kind| name.starts_with(&format!("{kind}/")));
    output(&at.join(out)).into_iter().filter(|(name, _)| is_of(name)).collect()
}

/// When the files of some folders were written.
pub fn written(at: &Path, out: &str, kinds: &[&str]) -> Vec<std::time::SystemTime> {
    let names = files(at, out, kinds).into_iter().map(|(name, _)| name);
    names.map(|name| fs::metadata(at.join(out).join(name)).unwrap().modified().unwrap()).collect()
}

/// The grids of mist of each frame, without what their files say of their inputs.
fn grids(at: &Path, out: &str) -> Vec<Vec<u8>> {
    densities(at, out, "mist")
}

/// The densities of each frame in a folder, without what their files say of their inputs.
fn densities(at: &Path, out: &str, kind: &str) -> Vec<Vec<u8>> {
    let density = |name: String| match read_any(&at.join(out).join(name), Some("density")).unwrap() {
        AnyGrid::Floats(grid) => to_bytes(&[&grid], &Default::default()).unwrap(),
        AnyGrid::Vectors(_) => panic!("a density of vectors"),
    };
    files(at, out, &[kind]).into_iter().map(|(name, _)| density(name)).collect()
}

fn report(at: &Path, out: &str, frame: i32) -> serde_json::Value {
    let text = fs::read(at.join(out).join(format!("report/mist.{frame:04}.json"))).unwrap();
    serde_json::from_slice(&text).unwrap()
}

#[test]
fn mist_is_made_and_made_again_without_touching_base_and_grains() {
    let at = &folder(GRAINS, COARSE);
    works(at, "snow shot.toml -o out -q");
    assert_eq!(files(at, "out", &["mist"]).len(), 10);
    let last = report(at, "out", 10);
    assert!(last["mist_m3"].as_f64().unwrap() > 0.0 && last["sources"].as_f64().unwrap() > 0.0, "{last}");
    assert!(last["divergence"].as_f64().unwrap() < 1e-4, "{last}");
    let AnyGrid::Floats(density) = read_any(&at.join("out/mist/mist.0010.vdb"), Some("density")).unwrap()
    else {
        panic!("a density of vectors")
    };
    let cell = 0.05;
    assert!((density.voxel_size() - cell).abs() < 1e-12);
    assert!((density.index_to_world(DVec3::zeros()) - DVec3::repeat(0.5 * cell)).norm() < 1e-12);
    let leaves = density.leaves().unwrap();
    assert!(leaves.iter().flat_map(|leaf| leaf.values).all(|density| (0.0..=1.5).contains(density)));
    let AnyGrid::Vectors(_) = read_any(&at.join("out/mist/mist.0010.vdb"), Some("vel")).unwrap() else {
        panic!("velocities are numbers")
    };
    let [shot, samples] =
        ["shot.usda", "shot.samples.usdc"].map(|name| usda::text(&at.join("out").join(name)));
    let stage = shot + &samples;
    for words in ["def Volume \"mist\"", "rel field:density = </shot/mist/density>", "./mist/mist.0010.vdb"] {
        assert!(stage.contains(words), "no {words:?} in {stage}");
    }
    assert!(works(at, "check out").contains("all of them are as they were written"));

    let (before, first) = (written(at, "out", &["base", "removed", "grains"]), grids(at, "out"));
    let set = "--set mist.half_life=0.2";
    fails(at, &format!("snow shot.toml -o out -q {set}"), 2, &["mist.half_life"]);
    works(at, &format!("snow shot.toml -o out -q --stage mist --from 1 {set}"));
    assert_eq!(written(at, "out", &["base", "removed", "grains"]), before);
    assert!(report(at, "out", 10)["mist_m3"].as_f64() < last["mist_m3"].as_f64());
    // From a frame in the middle on, as it was before.
    works(at, "snow shot.toml -o out -q --stage mist --from 1");
    assert!(grids(at, "out") == first);
    // Grains that are made again take the mist that was made of them along.
    let again = "--set grains.compression=0.2";
    works(at, &format!("snow shot.toml -o out -q --stage grains --from 1 {again}"));
    assert_eq!(files(at, "out", &["mist"]).len(), 0);
    works(at, &format!("snow shot.toml -o out -q --stage mist {again}"));
    works(at, "check out");
    assert!(grids(at, "out") != first);
    // Those that were changed by another hand are refused.
    fs::copy(at.join("out/grains/grains.0009.vdb"), at.join("out/grains/grains.0010.vdb")).unwrap();
    fails(at, &format!("snow shot.toml -o out -q --stage mist --from 10 {again}"), 2, &["grains.0010.vdb"]);
}

#[test]
fn mist_and_fog_are_the_same_from_grains_in_any_files() {
    let at = &folder(GRAINS, &format!("fog = [\"grains\"]\n{COARSE}"));
    for (out, grains) in [("vdb", "[\"vdb\"]"), ("usd", "[\"usd\"]"), ("both", "[\"usd\",\"vdb\"]")] {
        works(at, &format!("snow shot.toml -o {out} -q --set output.grains={grains}"));
    }
    for kind in ["mist", "fog"] {
        let of_vdb = densities(at, "vdb", kind);
        assert!(of_vdb.len() == 10 && of_vdb == densities(at, "usd", kind), "{kind}");
        assert!(of_vdb == densities(at, "both", kind), "{kind}");
    }
    // A file of grains that is not what was written is refused, whatever it is.
    let grains = "usd/grains/grains.0009.usdc";
    fs::copy(at.join(grains), at.join("usd/grains/grains.0010.usdc")).unwrap();
    let set = "--set output.grains=[\"usd\"]";
    fails(at, &format!("snow shot.toml -o usd -q --stage mist --from 10 {set}"), 2, &["grains.0010.usdc"]);
}

#[test]
fn a_killed_run_resumes_to_the_same_mist_from_any_number_of_threads() {
    let at = &folder(GRAINS, &format!("fog = [\"mist\"]\n{COARSE}\nturbulence = 3.0\nconfinement = 0.3"));
    works(at, "snow shot.toml -o once -q --threads 2");
    for frame in [3, 6] {
        kill_at(at, "snow shot.toml -o killed", &format!("killed/state/mist.{frame:04}.json"));
    }
    works(at, "snow shot.toml -o killed -q --threads 1");
    let all = |out: &str| files(at, out, &["mist", "fog"]);
    assert!(all("once") == all("killed"));
    assert_eq!(all("once").len(), 20);
    // The fog is the mist's density, where nothing else is asked for.
    let fog = read(&at.join("once/fog/fog.0010.vdb")).unwrap();
    assert_eq!(fog.iter().map(|grid| grid.name()).collect::<Vec<_>>(), ["density"]);
    let mist = frazil::vdb::file::read_named(&at.join("once/mist/mist.0010.vdb"), Some("density")).unwrap();
    assert_eq!(fog[0].active_voxels(), mist.active_voxels());
}

#[test]
fn caches_of_changes_give_the_same_mist() {
    let delta = format!("base_mode = \"delta\"\ngrains_mode = \"delta\"\n{COARSE}");
    let [whole, delta] = &[folder(GRAINS, COARSE), folder(GRAINS, &delta)];
    works(whole, "snow shot.toml -o out -q");
    works(delta, "snow shot.toml -o out -q");
    assert!(grids(whole, "out") == grids(delta, "out"));
    // In one run, and stage by stage.
    works(delta, "snow shot.toml -o apart -q --stage base");
    works(delta, "snow shot.toml -o apart -q --stage grains");
    works(delta, "snow shot.toml -o apart -q --stage mist");
    assert!(grids(delta, "apart") == grids(delta, "out"));
}

#[test]
fn fog_takes_all_three_parts() {
    let at = &folder(GRAINS, &format!("fog = [\"base\", \"grains\", \"mist\"]\n{COARSE}"));
    works(at, "snow shot.toml -o out -q");
    let fog = read(&at.join("out/fog/fog.0010.vdb")).unwrap();
    assert_eq!(fog.iter().map(|grid| grid.name()).collect::<Vec<_>>(), ["base", "grains", "mist"]);
    let stage = fs::read_to_string(at.join("out/shot.usda")).unwrap();
    assert!(stage.contains("rel field:density = </shot/fog_mist/mist>"), "{stage}");
    assert_eq!(stage.matches("custom float frazil:density_scale = 100\n").count(), 2, "{stage}");
}

#[test]
fn without_fast_grains_the_mist_is_empty_and_the_log_says_so() {
    let at = &folder(GRAINS, "[mist]\nfrom_speed = 900.0");
    let run = frazil(at, "snow shot.toml -o out");
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(
        run.status.success() && said.contains("no mist is left") && said.contains("mist.from_speed"),
        "{said}"
    );
    assert_eq!(files(at, "out", &["mist"]).len(), 10);
    assert_eq!(read_any(&at.join("out/mist/mist.0010.vdb"), Some("density")).map(|_| ()).ok(), Some(()));
}

#[test]
fn cells_wider_than_objects_and_objects_wider_than_the_air_work() {
    let at = &folder(GRAINS, MIST);
    works(at, "snow shot.toml -o coarse -q --set mist.cell=0.5");
    works(at, "snow shot.toml -o fine -q --frames 1-4 --set mist.cell=0.016");
    // The cube fills everything where its grains rise.
    works(
        at,
        "snow shot.toml -o full -q --preview 2 --frames 1-3 --set object.1.scale=3 --set mist.from_speed=0.05",
    );
    let AnyGrid::Floats(density) = read_any(&at.join("full/mist/mist.0003.vdb"), Some("density")).unwrap()
    else {
        panic!("a density of vectors")
    };
    assert!((density.voxel_size() - 0.04 * 4.0 / 3.0).abs() < 1e-12);
    for (out, frame) in [("coarse", 10), ("fine", 4), ("full", 3)] {
        let report = report(at, out, frame);
        assert!(report["divergence"].as_f64().unwrap() < 1e-4, "{out}: {report}");
        assert!(report["fastest_m_per_s"].as_f64().unwrap() < 50.0, "{out}: {report}");
    }
}

#[test]
fn what_mist_cannot_be_made_from_is_said_first() {
    let refuses = |output: &str, words: &[&str]| {
        let folder = folder("", output);
        fails(&folder, "snow shot.toml -o out -q", 2, words);
        fails(&folder, "check shot.toml", 2, words);
        assert!(!folder.join("out/base").exists());
    };
    refuses("grains = [\"ply\"]\n[mist]\n", &["grains", "[mist]", "vdb"]);
    refuses("mist = []\nfog = [\"mist\"]\n[mist]\n", &["mist", "fog"]);
    refuses("[mist]\ncell = 9.0", &["`cell` in [mist]", "9"]);
    refuses("[mist]\nwind = [nan, 0.0, 0.0]", &["`wind` in [mist]"]);
    refuses("[mist]\nwind = [1.0, 0.0]", &["`wind` in [mist]"]);
    refuses("[mist]\nwind = \"none.vdb\"", &["none.vdb"]);
    refuses("[mist]\nhalf_life = 0.0", &["`half_life` in [mist]"]);
    refuses("[mist]\nturbulence_size = 0.05", &["`turbulence_size` in [mist]"]);
    let at = &folder("", MIST);
    let text = fs::read_to_string(at.join("shot.toml")).unwrap().replace("[grains]", "");
    fs::write(at.join("plain.toml"), text).unwrap();
    fails(at, "snow plain.toml -o out -q", 2, &["[grains]"]);
}

#[test]
fn wind_is_read_from_a_grid() {
    let at = &folder(GRAINS, MIST);
    let ctx = frazil::Context::new(frazil::Pool::new(2).unwrap());
    let with = |name: &str, value: [f32; 3]| {
        let mut wind = frazil::vdb::VectorGrid::new(0.5, [0.0; 3]).unwrap();
        let blocks: Vec<frazil::vdb::VectorEdit> = [[-8, 0, -8], [-8, 0, 0], [0, 0, -8], [0, 0, 0]]
            .into_iter()
            .map(|origin| frazil::vdb::VectorEdit::Dense {
                origin,
                values: Box::new([value; 512]),
                mask: [u64::MAX; 8],
            })
            .collect();
        wind.set_name("gusts").unwrap();
        wind.replace_blocks(&ctx, &blocks).unwrap();
        let grids = [frazil::vdb::GridRef::Vectors(&wind)];
        fs::write(at.join(name), frazil::vdb::file::any_to_bytes(&grids, &Default::default()).unwrap())
            .unwrap();
    };
    with("gusts.vdb", [0.0, 0.0, 4.0]);
    works(at, "snow shot.toml -o still -q");
    works(at, "snow shot.toml -o blown -q --set mist.wind=\"gusts.vdb\"");
    let reach = |out: &str| {
        let path = at.join(out).join("mist/mist.0010.vdb");
        let AnyGrid::Floats(grid) = read_any(&path, Some("density")).unwrap() else { panic!("vectors") };
        grid.active_bbox().unwrap().1[2]
    };
    assert!(reach("blown") > reach("still") + 4, "{} {}", reach("blown"), reach("still"));
    // Another wind is another shot, by its name and by its contents.
    with("gusts.vdb", [0.0, 0.0, 3.0]);
    fails(at, "snow shot.toml -o blown -q --set mist.wind=\"gusts.vdb\"", 2, &["mist.wind"]);
    with("nan.vdb", [f32::NAN, 0.0, 0.0]);
    fails(at, "snow shot.toml -o nan -q --set mist.wind=\"nan.vdb\"", 2, &["nan.vdb", "finite"]);
    write(&at.join("floats.vdb"), &[&frazil::vdb::FloatGrid::new(0.1, 0.0).unwrap()], &Default::default())
        .unwrap();
    fails(at, "snow shot.toml -o floats -q --set mist.wind=\"floats.vdb\"", 2, &["floats.vdb", "vectors"]);
}
