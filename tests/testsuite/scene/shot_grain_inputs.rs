//! What scenes with grains hold: grounds, walls, grains of files, small objects; what cannot be is refused before the first frame.

use std::fs;
use std::path::Path;

use super::shot_grains::{folder, grains};
use crate::program::{CUBE, Folder, fails, frazil, works};
use frazil::geometry::DVec3;
use frazil::io::particles::ply;

/// Points as a .ply file: x, y, z, vx, vy, vz of each.
fn points(all: &[[&str; 6]]) -> String {
    let mut out = format!("ply\nformat ascii 1.0\nelement vertex {}\n", all.len());
    for name in ["x", "y", "z", "vx", "vy", "vz"] {
        out += &format!("property float {name}\n");
    }
    out += "end_header\n";
    all.iter().for_each(|point| out += &format!("{}\n", point.join(" ")));
    out
}

/// Positions of the grains after a frame.
fn positions(at: &Path, frame: i32) -> Vec<DVec3> {
    ply::read(&at.join(format!("out/grains/grains.{frame:04}.ply"))).unwrap().positions
}

fn report(at: &Path, frame: i32) -> serde_json::Value {
    serde_json::from_slice(&fs::read(at.join(format!("out/report/grains.{frame:04}.json"))).unwrap()).unwrap()
}

#[test]
fn a_layer_of_a_file_may_have_a_ground_on_which_grains_lie() {
    let at = &Folder::empty();
    fs::write(at.join("cube.obj"), CUBE).unwrap();
    works(at, "vdb from-mesh cube.obj --cell 0.02 -o layer.vdb -q");
    let plane = "v -2 -.05 -2\nv 2 -.05 -2\nv 2 -.05 2\nv -2 -.05 2\nf 1 4 3 2\n";
    fs::write(at.join("plane.obj"), plane).unwrap();
    fs::write(at.join("drift.ply"), points(&[["0.6", "0.1", "0", "0", "0", "0"]])).unwrap();
    let scene = "[shot]\nframes = \"1-20\"\n[snow]\ntop = \"layer.vdb\"\ncell = 0.02\n[grains]\ninitial = \"drift.ply\"\n\
                 radius = 0.006\n[output]\ngrains = [\"ply\"]\n";
    let write = |ground: &str| {
        fs::write(at.join("shot.toml"), scene.replace("cell =", &format!("{ground}\ncell ="))).unwrap();
    };
    // Without a ground it falls on and on.
    write("");
    works(at, "snow shot.toml -o out -q");
    assert!(positions(at, 20).iter().all(|position| position.y < -1.0));
    for (ground, height) in [("ground = 0.0", 0.0), ("ground = \"plane.obj\"", -0.05)] {
        write(ground);
        works(at, "check shot.toml");
        // The layer is as it is: another ground changes the grains only.
        fails(at, "snow shot.toml -o out -q", 2, &["stage grains", "snow.ground"]);
        works(at, "snow shot.toml -o out -q --stage grains --from 1");
        let positions = positions(at, 20);
        assert_eq!(positions.len(), 1);
        assert!((positions[0].y - height - 0.006).abs() < 0.001, "{positions:?}");
    }
    write("ground = 0.0\narea = [-1, -1, 1, 1]");
    fails(at, "snow shot.toml -o none -q", 2, &["shot.toml", "`area`", ".vdb"]);
}

#[test]
fn a_wall_that_no_attraction_holds_is_refused_with_the_highest_that_stands() {
    let at = &folder("radius = 0.002\nstands = 2.0", "");
    for command in ["check shot.toml", "snow shot.toml -o out -q"] {
        fails(at, command, 2, &["shot.toml:10", "`stands`", "0.002 m", "32 degrees", "at most"]);
    }
    let said = String::from_utf8(frazil(at, "check shot.toml").stderr).unwrap();
    let highest: f64 =
        said.split("at most ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap();
    works(at, &format!("check shot.toml --set grains.stands={highest}"));
    fails(at, &format!("check shot.toml --set grains.stands={}", 1.01 * highest), 2, &["`stands`"]);
    works(at, "check shot.toml --set grains.attraction=20");
}

#[test]
fn points_that_can_be_no_grains_are_refused_before_the_base_is_made() {
    let at = &folder("initial = \"drift.ply\"", "");
    let good = ["0", "0.5", "0", "0", "0", "0"];
    for (point, words) in [
        (["nan", "0.5", "0", "0", "0", "0"], ["the position of particle 2", "is not finite"]),
        (["0", "inf", "0", "0", "0", "0"], ["the position of particle 2", "is not finite"]),
        (["0", "0.5", "1e15", "0", "0", "0"], ["point 2", "too far from the origin"]),
        (["0", "0.5", "0", "0", "nan", "0"], ["the velocity of point 2", "is not finite"]),
        (["0", "0.5", "0", "1e30", "0", "0"], ["the velocity of point 2", "10000 m/s"]),
    ] {
        fs::write(at.join("drift.ply"), points(&[good, point])).unwrap();
        for command in ["check shot.toml", "snow shot.toml -o out -q"] {
            fails(at, command, 2, &["drift.ply", words[0], words[1]]);
        }
        assert!(!at.join("out").exists());
    }
}

#[test]
fn points_in_the_snow_or_below_the_ground_are_left_out_and_counted() {
    let snow = ["0.4", "0.1", "0.9", "0", "0", "0"];
    let air = ["0.4", "0.5", "0.9", "0", "0", "0"];
    let below = ["2", "-0.3", "0", "0", "0", "0"];
    // On the snow, which is 0.2 m deep, and in it by less than a tenth of a diameter of 13.3 mm.
    let on = ["-0.4", "0.205", "0.9", "0", "0", "0"];
    let dipped = ["-0.4", "0.199", "0.7", "0", "0", "0"];
    let at = &folder("initial = \"drift.ply\"\ncompression = 1.0", "grains = [\"vdb\", \"ply\"]");
    fs::write(at.join("drift.ply"), points(&[snow, air, below, on, dipped])).unwrap();
    let said = works(at, "snow shot.toml -o out");
    let warned: Vec<&str> = said.lines().filter(|line| line.contains("left out")).collect();
    assert_eq!(warned.len(), 1, "{said}");
    assert!(warned[0].contains("drift.ply: 2 of 5 points"), "{said}");
    assert_eq!((&report(at, 1)["left_out"], &report(at, 1)["grains"]), (&2.into(), &3.into()));
    assert_eq!(positions(at, 1).len(), 3);
    assert!((1..=10).all(|frame| report(at, frame)["trapped"].as_u64().unwrap_or(0) == 0));
    // A run that resumes has the same grains.
    let files = grains(at, "out");
    fs::remove_file(at.join("out/state/grains.0010.json")).unwrap();
    works(at, "snow shot.toml -o out -q");
    assert!(files == grains(at, "out"));
}

#[test]
fn a_radius_of_a_file_that_grains_do_not_have_is_reported() {
    let at = &folder("initial = \"drift.ply\"\nradius = 0.005", "");
    let file = |radius: &str| {
        let text = points(&[["0", "0.5", "0", "0", "0", radius]]).replace("float vz", "float pscale");
        fs::write(at.join("drift.ply"), text).unwrap();
        works(at, "check shot.toml")
    };
    let said = file("0.004");
    assert!(
        said.contains("pscale (0.004 m) is not used") && said.contains("grains.radius = 0.005"),
        "{said}"
    );
    assert!(!file("0.00501").contains("pscale"));
}

#[test]
fn an_object_smaller_than_a_grain_is_reported() {
    let at = &folder("compression = 0.0\nradius = 0.005", "");
    let small = "--set object.1.scale=0.02";
    for command in ["check shot.toml", "snow shot.toml -o out --frames 1-2"] {
        let said = works(at, &format!("{command} {small}"));
        assert!(
            said.contains("object 1 (cube.obj) is 0.008 m large, smaller than a grain of 0.01 m"),
            "{said}"
        );
    }
    assert!(!works(at, "check shot.toml").contains("smaller than a grain"));
    // Nor where it takes no snow.
    assert!(
        !works(at, &format!("check shot.toml {small} --set object.1.role=grains")).contains("smaller than")
    );
}

#[test]
fn an_object_that_jumps_is_reported_with_its_speed_and_frame() {
    let at = &folder("", "");
    let scene = fs::read_to_string(at.join("shot.toml")).unwrap();
    let jump = |z: f64| {
        let jumping = scene.replace(
            "{ frame = 10, at = [0, 0.1, 0.4], turn_deg = [0, 40, 0] }",
            &format!("{{ frame = 5, at = [0, 0.1, 0] }}, {{ frame = 6, at = [0, 0.1, {z}] }}"),
        );
        assert!(jumping != scene);
        fs::write(at.join("jump.toml"), jumping).unwrap();
        works(at, "check jump.toml")
    };
    let said = jump(5.0);
    assert!(said.contains("object 1 (cube.obj) moves at 120 m/s in the step to frame 6"), "{said}");
    let run = frazil(at, "snow jump.toml -o jump --frames 1-6");
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("object 1 (cube.obj) moves at 120 m/s"), "{said}");
    assert_eq!(said.matches("is taken to jump").count(), 1, "{said}");
    assert!(!jump(4.0).contains("jump,"));
    // Outside of the shot nothing jumps.
    assert!(!works(at, "check jump.toml --set shot.frames=1-5").contains("jump,"));
}

#[test]
fn keys_that_others_stand_in_place_of_are_reported() {
    let at = &folder("", "");
    let said = |set: &str| works(at, &format!("check shot.toml {set}"));
    let both = said("--set grains.friction=0.2 --set grains.repose_angle_deg=25");
    assert!(both.contains("grains.friction = 0.2 replaces grains.repose_angle_deg = 25"), "{both}");
    let both = said("--set grains.attraction=4 --set grains.stands=0.2");
    assert!(both.contains("grains.attraction = 4 replaces grains.stands = 0.2"), "{both}");
    for one in ["friction=0.2", "repose_angle_deg=25", "attraction=4 --set grains.preset=wet"] {
        assert!(!said(&format!("--set grains.{one}")).contains("stands in place"), "{one}");
    }
}

#[test]
fn an_estimate_that_is_little_over_max_is_a_warning() {
    let at = &folder("compression = 0.4", "");
    works(at, "snow shot.toml -o out -q");
    let count = report(at, 10)["grains"].as_u64().unwrap();
    let owed = report(at, 10)["owed"].as_f64().unwrap();
    assert!((1.0..0.1 * count as f64).contains(&owed), "{owed} of {count}");
    // Frames that are there do not depend on it.
    for max in [count, 3 * count, 1] {
        let said = works(at, &format!("snow shot.toml -o out --set grains.max={max}"));
        assert!(said.contains("frames exist, 0 are to be made"), "{said}");
    }
    let again = |max: u64| format!("snow shot.toml -o out --stage grains --from 1 --set grains.max={max}");
    let said = works(at, &again(count));
    assert!(said.contains("warn") && said.contains(&format!("more than grains.max = {count}")), "{said}");
    let said = works(at, &format!("check shot.toml -o out --set grains.max={count}"));
    assert!(said.contains("more than grains.max"), "{said}");
    // The frame that has too many ends the run.
    fails(at, &again(count - 1), 1, &["frame 10", "max"]);
    fails(at, &again(count / 2), 2, &["grains.max"]);
}

#[test]
fn a_check_of_a_preview_has_its_cells() {
    let folder = folder("", "");
    let said = works(&folder, "check shot.toml --preview 2");
    assert!(said.contains("cells of 0.04 m"), "{said}");
    fails(&folder, "check shot.toml --preview 0", 2, &["--preview"]);
    fails(&folder, "check . --preview 2", 2, &["--preview"]);
}

#[test]
fn a_replaced_base_file_and_frames_to_start_from_are_named_as_they_are() {
    let at = &folder("", "");
    works(at, "snow shot.toml -o out -q --frames 1-6 --set shot.frames=1-6");
    // Of the grains only the last two frames are kept exactly; there is no frame 7.
    let from = "snow shot.toml -o out -q --stage grains --from 4 --set shot.frames=1-6";
    fails(
        at,
        from,
        2,
        &[
            "(state/ keeps those of the last two frames; `output.keep_states` keeps more): --from 6, --from 1 or another -o",
        ],
    );
    let none = report(at, 1).get("owed").cloned();
    assert!(none.is_none());
    fs::copy(at.join("out/base/base.0004.vdb"), at.join("out/base/base.0003.vdb")).unwrap();
    let run = "snow shot.toml -o out -q --stage grains --from 1 --set shot.frames=1-6";
    fails(at, run, 2, &["base.0003.vdb", "is not the file that was made", "frame 3 of stage grains"]);
    works(at, &run.replace("grains", "base,grains"));
}

#[test]
fn what_is_owed_is_never_less_than_nothing() {
    let at = &folder("compression = 1.0", "");
    works(at, "snow shot.toml -o out -q --frames 1-2");
    let text = fs::read_to_string(at.join("out/report/grains.0002.json")).unwrap();
    assert!(text.contains("\"owed\": 0.0"), "{text}");
}

#[test]
fn numbers_of_a_scene_to_begin_with_are_short() {
    let said = works(Path::new("."), "new snow") + &works(Path::new("."), "new snow --keys");
    assert!(said.contains("radius = 0.0025 ") && said.contains("0.33333 cells"), "{said}");
}
