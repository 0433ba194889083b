//! Volumes made in chunks by several processes.

use std::time::Instant;

use super::made::scenes;
use crate::process::{frazil, quiet, works};

const PROCESSES: usize = 4;
const FRAMES: usize = 48;

/// How many times faster four processes make the volumes of 48 frames than one.
pub fn speed() -> (f64, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scenes(folder.path()).join("hero.toml");
    let out = folder.path().join("out");
    let command = |stages: &str| {
        let mut command = frazil(["snow", "-q", "--stage", stages]);
        command.arg(&scene).arg("-o").arg(&out).args(["--set", "output.fog=[\"base\",\"grains\"]"]);
        command
    };
    works(command("base,grains").args(["--frames", &format!("1-{FRAMES}")]));
    let start = Instant::now();
    works(command("volumes").args(["--frames", &format!("1-{FRAMES}")]));
    let alone = start.elapsed().as_secs_f64();
    ["fog", "mesh"].iter().for_each(|kind| std::fs::remove_dir_all(out.join(kind)).expect("its volumes"));
    works(command("volumes").args(["--prepare", "--frames", &format!("1-{FRAMES}")]));
    let start = Instant::now();
    let each = FRAMES / PROCESSES;
    let chunks: Vec<_> = (0..PROCESSES)
        .map(|chunk| {
            let frames = format!("{}-{}", chunk * each + 1, (chunk + 1) * each);
            quiet(command("volumes").args(["--chunk", "--frames", &frames])).spawn().expect("frazil")
        })
        .collect();
    for mut chunk in chunks {
        assert!(chunk.wait().expect("frazil").success(), "a chunk failed");
    }
    let together = start.elapsed().as_secs_f64();
    (alone / together, format!("{alone:.1} s in one process, {together:.1} s in {PROCESSES}"))
}
