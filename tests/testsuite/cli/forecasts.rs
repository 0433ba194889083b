//! What `check` says before a run about its memory and disk space: of a mesh that follows a liquid, and of mist.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::liquids::{ball, write_cache};
use crate::program::{CUBE, Folder, fails, works};

fn report(folder: &Path, options: &str) -> Value {
    serde_json::from_str(&works(folder, &format!("check shot.toml --json -q {options}"))).unwrap()
}

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("no {key} in {report}"))
}

/// Bytes of all files in a folder.
fn bytes_in(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| match entry.metadata().unwrap() {
            metadata if metadata.is_dir() => bytes_in(&entry.path()),
            metadata => metadata.len(),
        })
        .sum()
}

/// The cache of a ball of a radius (spacings) that travels, its mesh of 12 n^2 triangles, and the scene.
fn liquid(folder: &Path, radius: f64, n: usize) {
    write_cache(folder, "ball", &ball(radius, n, 0.2), 3);
    let scene = "[shot]\nframes = \"1-3\"\n[surface]\nparticles = \"ball.%04d.bgeo\"\nmesh = \"ball.ply\"\nspacing = 0.01\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
}

#[test]
fn files_of_a_mesh_on_a_liquid_take_about_what_check_says() {
    let folder = &Folder::empty();
    liquid(folder, 8.0, 12);
    let all = "--set output.surface=[\"ply\",\"usd\",\"obj\"]";
    let ply = "--set output.surface=[\"ply\"]";
    for (out, options) in [("usd", ""), ("ply", ply), ("bare", "--set output.attributes=[]"), ("all", all)] {
        let said = report(folder, options);
        assert_eq!(number(&said, "disk_bytes"), 3.0 * number(&said, "frame_bytes"));
        works(folder, &format!("surface shot.toml -o {out} -q {options}"));
        let share = number(&said, "disk_bytes") / bytes_in(&folder.join(out)) as f64;
        // The indices of so small a mesh pack to less than is estimated.
        assert!((0.75..1.4).contains(&share), "{out}: {share} of what it takes");
    }
    let text = works(folder, "check shot.toml");
    assert!(
        text.contains("memory    about ") && text.contains("camera    --eye=") && text.contains(" a frame\n"),
        "{text}"
    );
}

#[test]
fn memory_of_a_mesh_on_a_liquid_is_about_what_check_says() {
    let folder = &Folder::empty();
    liquid(folder, 20.0, 40);
    let said = report(folder, "");
    let memory = number(&said, "memory_bytes");
    assert!(!said["warnings"].to_string().contains("needs about"), "{said}");
    works(folder, "surface shot.toml -o out -q --report run.json");
    let run: Value = serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
    let peak = number(&run, "peak_memory_bytes");
    assert!(peak < 1.1 * memory && memory < 4.0 * peak, "{peak} of {memory}");
    let forecast = number(&said, "memory_forecast_bytes");
    assert!(forecast < memory && forecast < 2.0 * peak && peak < 2.0 * forecast, "{peak} of {forecast}");
    // Half the cell: eight times the nodes around the same surface.
    let fine = number(&report(folder, "--set surface.cell=0.25"), "memory_bytes");
    assert!(fine > memory + 10e6, "{fine} after {memory}");
    // Without rebuilding there is no grid, and no surface is made ahead.
    let still = number(&report(folder, "--set surface.rebuild=false"), "memory_bytes");
    assert!(memory > still + 20e6, "{memory} after {still}");
    let warned = report(folder, "--max-memory 50M")["warnings"].to_string();
    for words in
        ["particles and 19200 triangles", "needs about", "the limit of 50 MB", "a run starts nevertheless"]
    {
        assert!(warned.contains(words), "no {words:?} in {warned}");
    }
}

#[test]
fn a_surface_has_no_preview() {
    let folder = Folder::empty();
    liquid(&folder, 3.0, 4);
    fails(&folder, "check shot.toml --preview 4", 2, &["--preview is for snow"]);
}

/// A cube that slides through snow by 0.4 m in 10 frames, with grains and mist.
fn snow(folder: &Path) {
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1-10\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.0]\ndepth = 0.2\ncell = 0.02\n\
                 [grains]\ncompression = 0.4\n[mist]\ncell = 0.03\nfrom_speed = 0.3\nhalf_life = 100.0\n\
                 [[object]]\nfile = \"cube.obj\"\nkeys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 10, at = [0, 0.1, 0.4] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
}

#[test]
fn memory_of_snow_is_about_what_check_says() {
    let folder = &Folder::empty();
    snow(folder);
    for settings in ["--set snow.cell=0.008 --set grains.radius=0.004", "--set mist.cell=0.015"] {
        let said = report(folder, settings);
        works(folder, &format!("snow shot.toml -o out -q --threads 1 --report run.json {settings}"));
        let run: Value = serde_json::from_slice(&fs::read(folder.join("run.json")).unwrap()).unwrap();
        let (peak, forecast) = (number(&run, "peak_memory_bytes"), number(&said, "memory_forecast_bytes"));
        assert!(forecast < 2.0 * peak && peak < 2.0 * forecast, "{settings}: {peak} of {forecast}");
        // More than the bytes of any run: this is not only they.
        assert!(forecast > 1.3 * 64e6, "{settings}: {forecast}");
        fs::remove_dir_all(folder.join("out")).unwrap();
    }
}

#[test]
fn grains_of_a_layer_without_known_heights_are_known_with_the_base() {
    let folder = &Folder::empty();
    snow(folder);
    works(folder, "snow shot.toml -o made -q --stage base --frames 1");
    let scene = fs::read_to_string(folder.join("shot.toml")).unwrap();
    let scene = scene.replace("depth = 0.2\n", "top = \"made/base/base.0001.vdb\"\n");
    let scene = scene.replace("area = [-0.5, -0.5, 0.5, 1.0]\n", "");
    fs::write(folder.join("grid.toml"), scene).unwrap();
    let said = works(folder, "check grid.toml");
    assert!(said.contains("how many is known when the base exists"), "{said}");
    works(folder, "snow grid.toml -o out -q --stage base");
    assert!(works(folder, "check grid.toml -o out").contains("grains at once"));
}

#[test]
fn before_mist_is_made_the_boxes_of_objects_are_filled_with_it() {
    let folder = &Folder::empty();
    snow(folder);
    let said = report(folder, "-o cache");
    let mist = &said["mist"];
    assert_eq!(mist["made_to_frame"], Value::Null);
    // Tiles are 0.24 m wide. The cube of 0.4 m with one of them around it lies in 4 of them across, and along its way in 4 of them at
    // the first frame, 5 up to the seventh and 6 at the last three. Upward it is in 3 as far as it is in the snow, and at its speed of
    // 1.07 m/s it throws grains 58 mm above the snow, into a fourth.
    let tiles = |up: u64, along: u64| 4 * up * along * 512;
    assert_eq!(mist["cells"], tiles(4, 6));
    let states = 2 * 40 * tiles(4, 6);
    assert_eq!(mist["disk_bytes"], 8 * (tiles(3, 4) + tiles(4, 6 * 5 + 3 * 6)) + states);
    assert_eq!(number(mist, "memory_bytes"), number(mist, "cells") * number(mist, "memory_bytes_per_cell"));
    assert!((number(mist, "air_m3") / (16.0 * 6.0 * 0.24f64.powi(3)) - 1.0).abs() < 1e-9, "{mist}");
    let cells = |options: &str| number(&report(folder, options)["mist"], "cells");
    assert!(cells("--set mist.half_life=0.001") < tiles(4, 6) as f64, "it is gone behind the cube");
    assert!(cells("--set mist.wind=[0,0,-5]") > tiles(4, 6) as f64, "wind carries it away");
    assert_eq!(cells("--set object.1.role=base"), 0.0, "what pushes no grains raises none");
    // Fog holds the density once more, and what is not written takes no space but for states.
    let disk = |options: &str| number(&report(folder, options)["mist"], "disk_bytes") as u64 - states;
    assert_eq!(2 * disk("--set output.fog=[\"mist\"]"), 3 * disk(""));
    assert_eq!(disk("--set output.mist_half=false"), 2 * disk(""));
    let kept = |every: i32| disk(&format!("--set output.keep_states={every}")) - disk("");
    // The frames after the first hold more.
    assert!(kept(1) > 10 * kept(10) && kept(10) == 40 * tiles(3, 4), "{} {}", kept(1), kept(10));
    assert_eq!(disk("--set output.mist=[]"), 0);
    let text = works(folder, "check shot.toml --max-memory 11M");
    for words in
        ["cells of 0.030000 m", "known when it is made", "in the boxes that objects pass", ", without mist"]
    {
        assert!(text.contains(words), "no {words:?} in {text}");
    }
    let warning = "mist of 49152 cells of 0.03 m, as many as fill the boxes that objects pass, needs about";
    assert!(text.contains(warning), "{text}");
    let most = 11_000_000 / number(mist, "step_bytes_per_cell") as u64;
    assert!(text.contains(&format!("refuses a step of more than {most} cells")), "{text}");
    assert!(!report(folder, "")["warnings"].to_string().contains("mist"));
    // A scene without mist says nothing of it.
    let scene = fs::read_to_string(folder.join("shot.toml")).unwrap();
    let plain = scene.split_once("[mist]").unwrap().0.to_string() + "[[object]]\nfile = \"cube.obj\"\n";
    fs::write(folder.join("plain.toml"), plain).unwrap();
    assert!(!works(folder, "check plain.toml").contains("mist"));
}

#[test]
fn a_long_shot_fills_the_same_boxes() {
    let folder = &Folder::empty();
    snow(folder);
    let cells = || number(&report(folder, "")["mist"], "cells");
    let short = cells();
    let scene = fs::read_to_string(folder.join("shot.toml")).unwrap();
    let scene = scene.replace("1-10", "1-1100").replace("frame = 10,", "frame = 1100,");
    fs::write(folder.join("shot.toml"), scene).unwrap();
    // So slow a cube throws no grain into the fourth tile above the ground.
    assert_eq!(4.0 * cells(), 3.0 * short);
}

#[test]
fn few_digits_of_a_cell_are_told() {
    let folder = &Folder::empty();
    snow(folder);
    let text = works(folder, "check shot.toml --set mist.cell=0.026666666666666668 --max-memory 2M");
    assert!(text.contains(" cells of 0.0267 m, as many as"), "{text}");
}

#[test]
fn mist_that_was_not_raised_takes_nothing() {
    let folder = &Folder::empty();
    snow(folder);
    // No grain is as fast.
    let calm = "--set mist.from_speed=900";
    works(folder, &format!("snow shot.toml -o cache -q --frames 1-8 {calm}"));
    let said = report(folder, &format!("-o cache {calm}"));
    assert_eq!(said["mist"]["made_to_frame"], Value::Null, "it might be raised in the last two");
    works(folder, &format!("snow shot.toml -o cache -q {calm}"));
    let said = report(folder, &format!("-o cache {calm}"));
    assert_eq!(said["mist"]["made_to_frame"], 10, "{said}");
    assert_eq!(said["mist"]["cells"], 0, "{said}");
    let text = works(folder, &format!("check shot.toml -o cache {calm}"));
    assert!(text.contains("none was raised up to frame 10: 0 cells"), "{text}");
    assert!(!text.contains("known when it is made"), "{text}");
}

#[test]
fn mist_that_was_made_says_how_far_it_spreads() {
    let folder = &Folder::empty();
    snow(folder);
    works(folder, "snow shot.toml -o cache -q --frames 1-8");
    let of_frame = |frame: i32| -> f64 {
        let path = folder.join(format!("cache/report/mist.{frame:04}.json"));
        number(&serde_json::from_slice(&fs::read(path).unwrap()).unwrap(), "cells")
    };
    let most = (1..=8).map(of_frame).fold(0.0, f64::max);
    assert!(most > 0.0, "grains raise mist");
    let said = report(folder, "-o cache");
    assert_eq!(said["mist"]["made_to_frame"], 8);
    assert!((number(&said["mist"], "cells") - most).abs() <= 1.0, "{said} {most}");
    // The same air in cells of half the edge.
    let fine = report(folder, "-o cache --set mist.cell=0.015");
    assert!((number(&fine["mist"], "cells") / (8.0 * most) - 1.0).abs() < 1e-3, "{fine} {most}");
    assert!(works(folder, "check shot.toml -o cache").contains("as made up to frame 8: "));
    // Its files take no more than that.
    let file = |frame: i32| folder.join(format!("cache/mist/mist.{frame:04}.vdb"));
    let files: u64 = (1..=8).map(|frame| fs::metadata(file(frame)).unwrap().len()).sum();
    assert!((files as f64) < number(&said["mist"], "disk_bytes") + 8.0 * 50e3, "{files} of {said}");
}
