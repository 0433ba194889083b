//! How fast an object is said to be: along its way, however often it comes round.

use std::fs;
use std::path::Path;

use crate::program::{CUBE, Folder, works};

/// What `check` says of a cube with these keys, frames 1 to 3 at 24 frames per second: the speed (m/s) and the frame of it, and all.
fn check_of(folder: &Path, keys: &str) -> (f64, i64, String) {
    let scene = format!(
        "[shot]\nframes = \"1-3\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.05\n\
         [[object]]\nfile = \"cube.obj\"\nkeys = [{keys}]\n"
    );
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    fs::write(folder.join("shot.toml"), scene).unwrap();
    let report: serde_json::Value =
        serde_json::from_str(&works(folder, "check shot.toml --json -q")).unwrap();
    let object = &report["objects"][0];
    let said = works(folder, "check shot.toml");
    (object["fastest_m_per_s"].as_f64().unwrap(), object["fastest_frame"].as_i64().unwrap(), said)
}

#[test]
fn a_wheel_that_comes_round_in_a_frame_is_fast() {
    let folder = Folder::empty();
    // The cube's corners lie 0.2 * sqrt(2) m from the axis.
    let radius = 0.2 * 2f64.sqrt();
    for degrees in [90.0, 360.0, 719.0, 1440.0, -1440.0] {
        let keys = format!("{{ frame = 2 }}, {{ frame = 3, turn_deg = [0, {degrees}, 0] }}");
        let (speed, frame, said) = check_of(&folder, &keys);
        let way = f64::abs(degrees).to_radians() * radius * 24.0;
        assert!((speed / way - 1.0).abs() < 0.02 && frame == 3, "{degrees}: {speed} of {way} at {frame}");
        assert!(!said.contains("0.00 m/s") && !said.contains("cannot be made"), "{said}");
    }
    // There and back within a frame.
    let keys = "{ frame = 2 }, { frame = 2.5, at = [0.5, 0, 0] }, { frame = 3 }";
    let (speed, frame, _) = check_of(&folder, keys);
    assert!((speed - 24.0).abs() < 1e-9 && frame == 3, "{speed} at {frame}");
}

#[test]
fn a_turn_that_no_step_can_make_is_reported() {
    let folder = Folder::empty();
    let (.., said) = check_of(&folder, "{ frame = 2 }, { frame = 3, turn_deg = [0, 30000, 0] }");
    let words =
        "frame 3 cannot be made: object 1 (cube.obj) turns by 30000 degrees in a step, more than 23040";
    assert!(said.contains(words), "{said}");
}
