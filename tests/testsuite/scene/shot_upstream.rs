//! A stage reads only frames that the scene of now would make: no grains on the base of another scene.

use std::fs;

use super::shot_grains::folder;
use crate::common::character::output;
use crate::program::{CUBE, fails, works};

/// What the base depends on, with the words that name it.
const OTHERS: [(&str, &str); 10] = [
    ("--set snow.cell=0.025", "snow.cell was 0.02"),
    ("--set snow.depth=0.15", "snow.depth was 0.2"),
    ("--set snow.ground=0.01", "snow.ground was 0.0"),
    ("--set snow.area=[-0.5,-0.5,0.5,0.9]", "snow.area was [-0.5, -0.5, 0.5, 1.0]"),
    ("--set snow.noise.seed=3", "snow.noise.seed was 0"),
    ("--set object.1.scale=0.9", "object.1.scale was 1.0"),
    ("--set object.1.role=base", "object.1.role was \"collide\""),
    ("--set object.1.file=other.obj", "object.1.file had different contents"),
    ("--set shot.fps=25", "shot.fps was 24.0"),
    ("--preview 2", "snow.cell was 0.02"),
];

#[test]
fn grains_are_not_made_on_the_base_of_another_scene() {
    let at = &folder("", "");
    fs::write(at.join("other.obj"), CUBE.replace(".4", ".3")).unwrap();
    works(at, "snow shot.toml -o cache -q --stage base");
    let refused = |from: &str| {
        let before = output(&at.join("cache"));
        for (other, words) in OTHERS {
            let words = [words, "stage grains", "stage base", "--from N", "another -o"];
            fails(at, &format!("snow shot.toml -o cache -q --stage grains {from} {other}"), 2, &words);
            assert!(before == output(&at.join("cache")), "{other}: something was written");
        }
    };
    refused("");
    assert!(!at.join("cache/grains").exists());
    works(at, "snow shot.toml -o cache -q --stage grains");
    refused("--from 1");
    refused("--from 10");
    // What only grains depend on may change; so may the length of the shot.
    works(at, "snow shot.toml -o cache -q --stage grains --from 10 --set grains.air=0.4");
    works(
        at,
        "snow shot.toml -o cache -q --stage grains --from 1 --set object.1.stick=2 --set shot.frames=1-9",
    );
    // The way out.
    let both = "snow shot.toml -o cache -q --stage base,grains --from 1 --set snow.depth=0.15";
    works(at, both);
    works(
        at,
        "snow shot.toml -o cache -q --stage grains --from 1 --set snow.depth=0.15 --set grains.air=0.4",
    );
    fails(at, "snow shot.toml -o cache -q --stage grains --from 1", 2, &["snow.depth was 0.15"]);
}

#[test]
fn grains_are_not_made_on_the_base_of_another_sequence() {
    let at = &folder("", "");
    let mesh = |frame: i32, top: &str| {
        fs::write(at.join(format!("body.{frame:04}.obj")), CUBE.replace(".4", top)).unwrap();
    };
    (1..=10).for_each(|frame| mesh(frame, ".4"));
    let run = "snow shot.toml -o cache -q --set object.1.file=body.%04d.obj --stage";
    works(at, &format!("{run} base"));
    mesh(7, ".5");
    let before = output(&at.join("cache"));
    fails(at, &format!("{run} grains"), 2, &["stage base", "frame 7", "body.0007.obj", "--from N"]);
    assert!(before == output(&at.join("cache")));
    works(at, &format!("{run} base --from 7"));
    works(at, &format!("{run} grains"));
}
