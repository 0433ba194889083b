//! Frames that `--from` makes again.

use super::made::scenes;
use crate::process::{frazil, json, works};

/// Frames before the 40th that the grains and the mist of a shot make again for `--from 40`, where every tenth state is kept.
pub fn recomputed() -> (f64, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scenes(folder.path()).join("hero.toml");
    let (out, report) = (folder.path().join("out"), folder.path().join("run.json"));
    let run = || {
        let mut command = frazil(["snow", "-q", "--stage", "base,grains,mist", "--frames", "1-48"]);
        command.arg(&scene).arg("-o").arg(&out).args([
            "--set",
            "output.keep_states=10",
            "--set",
            "snow.cell=0.02",
        ]);
        command
    };
    works(&mut run());
    works(run().args(["--from", "40", "--report"]).arg(&report));
    // Of each of the three stages.
    let made = json(&report)["frames"].as_f64().expect("a count of frames") / 3.0;
    (
        made - 9.0,
        "hero, cells of 2 cm, 48 frames, keep_states = 10: frames before the 40th, in each stage".into(),
    )
}
