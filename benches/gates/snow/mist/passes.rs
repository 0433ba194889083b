//! Gates of whole passes with mist: the same bytes from any number of threads, at every CPU level and after kills, and other
//! stages' files as they were where only the mist is another.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use crate::common::character;
use crate::common::clients;
use crate::harness::{Harness, timed};
use crate::process::works;
use crate::scenes::{MAN, wanted_data};
use crate::snow::grains::passes::{kill, pass, walk};

/// Frames of the pass, and its cell (m).
const FRAMES: i32 = 24;
const CELL: f64 = 0.014;
/// The slow walk raises mist from this speed (m/s) on.
const FROM_SPEED: f64 = 0.5;

/// The stages, the last one first.
const STAGES: [&str; 3] = ["mist", "grains", "base"];

pub fn run(h: &mut Harness) {
    let all @ [same, apart, blender] = ["snow.mist.same_bytes", "snow.mist.apart", "snow.shot.blender_parts"];
    let Some(man) = wanted_data(h, &all, MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = walk(folder.path(), &man, FRAMES, CELL, "");
    let out = |name: &str| folder.path().join(name);
    let run = |name: &str, threads: usize| misty(&scene, &out(name), threads);
    let (took, _) = timed(|| works(&mut run("once", 2)));
    if h.wants(same) {
        works(&mut run("alone", 1));
        works(run("baseline", 2).env("FRAZIL_CPU", "baseline"));
        works(run("avx2", 2).env("FRAZIL_CPU", "avx2"));
        let killed = out("killed");
        // All folders are there from the beginning.
        let has_frames = |stage: &&str| {
            let mut files = std::fs::read_dir(killed.join(stage)).into_iter().flatten();
            files.next().is_some()
        };
        let last = || STAGES.into_iter().find(has_frames);
        // At first within the short stages, then as far apart as the frames of mist.
        let kills =
            [0.01, 0.06, 0.3].map(|part| kill(|threads| misty(&scene, &killed, threads), part * took, last));
        let kills = kills.concat();
        works(&mut run("killed", 1));
        let once = character::output(&out("once"));
        let differs = |name: &&str| character::output(&out(name)) != once;
        let others: Vec<&str> = ["alone", "baseline", "avx2", "killed"].into_iter().filter(differs).collect();
        let mist = once.keys().filter(|name| name.starts_with("mist/")).count();
        let note =
            format!("{mist} files of mist in a pass of {took:.1} s; kills in {kills:?}; others: {others:?}");
        let is_whole = mist == FRAMES as usize && STAGES.iter().all(|stage| kills.contains(stage));
        h.holds(same, others.is_empty() && is_whole, &note);
    }
    if h.wants(blender) {
        match clients::blender() {
            Some(program) => {
                works(run("parts", 2).args(["--set", "output.grains=[\"vdb\",\"ply\"]"]));
                let picture = folder.path().join("frame.png");
                let answer = clients::blender_renders(&program, &out("parts"), FRAMES, &picture);
                let is_whole = answer.as_ref().is_ok_and(|said| said.ends_with("with base, grains, mist"));
                let said = answer.unwrap_or_else(|error| error);
                h.holds(blender, is_whole, said.lines().last().unwrap_or_default());
            }
            None => h.skipped(blender, "not installed: make test-clients"),
        }
    }
    if h.wants(apart) {
        let before = written(&out("once"));
        let again = ["--stage", "mist", "--from", "1", "--set", "mist.gravity=-1.0"];
        works(run("once", 2).args(again));
        let is_mist = |file: &Path| file.to_string_lossy().contains("mist");
        let after = written(&out("once"));
        let made = after.iter().filter(|(file, time)| before.get(*file) != Some(*time));
        let made: Vec<&PathBuf> = made.map(|(file, _)| file).collect();
        let others: Vec<&&PathBuf> = made.iter().filter(|file| !is_mist(file)).collect();
        h.holds(
            apart,
            others.is_empty() && !made.is_empty(),
            &format!("{} files made again, of others {others:?}", made.len()),
        );
    }
}

/// A pass of the scene with mist.
fn misty(scene: &Path, out: &Path, threads: usize) -> Command {
    let mut run = pass(scene, out, threads);
    run.args(["--set", &format!("mist.from_speed={FROM_SPEED}")]);
    run
}

/// When the files that a pass is for were written, but for what it says of the run as a whole.
fn written(out: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let kinds = ["base", "removed", "grains", "mist", "state", "report"];
    let files = kinds.iter().flat_map(|kind| std::fs::read_dir(out.join(kind)).into_iter().flatten());
    let files = files.map(|file| file.expect("a file")).filter(|file| file.file_name() != "files.json");
    files
        .map(|file| (file.path(), file.metadata().and_then(|data| data.modified()).expect("a time")))
        .collect()
}
