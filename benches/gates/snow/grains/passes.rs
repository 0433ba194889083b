//! Gates of whole passes with grains: the bytes of their files, and the same ones after a kill, from any number of threads and
//! from files of changes.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use frazil::geometry::points::Points;
use frazil::vdb::file::WriteOptions;
use frazil::vdb::points;

use crate::common::character;
use crate::harness::{Harness, timed};
use crate::process::{frazil, quiet, works};
use crate::scenes::{MAN, context, wanted_data};

/// Frames and cell (m) of the pass whose file is measured: with fewer grains the tree that every file has outweighs them.
const MEASURED: (i32, f64) = (64, 0.009);
/// Frames and cell of the pass that is made again and again: coarse, to be quick.
const REPEATED: (i32, f64) = (32, 0.012);

pub fn run(h: &mut Harness) {
    let all @ [bytes, same, delta] =
        ["snow.grains.file_bytes", "snow.grains.same_pass", "snow.grains.same_delta"];
    let Some(man) = wanted_data(h, &all, MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let made = |(frames, cell): (i32, f64), name: &str, threads: usize| {
        let scene = walk(folder.path(), &man, frames, cell, "");
        let out = folder.path().join(name);
        let (took, _) = timed(|| works(&mut pass(&scene, &out, threads)));
        (scene, out, took)
    };
    if h.wants(bytes) {
        let (_, out, _) = made(MEASURED, "measured", 2);
        let file = out.join(format!("grains/grains.{:04}.vdb", MEASURED.0));
        let grains = points::read(&file, None).expect("grains");
        parts(&grains);
        let each = std::fs::metadata(&file).expect("a file").len() as f64 / grains.count() as f64;
        h.gate(bytes, each, &format!("{} grains after {} frames", grains.count(), MEASURED.0));
    }
    if h.wants(same) {
        let (scene, once, took) = made(REPEATED, "once", 2);
        let (_, alone, _) = made(REPEATED, "alone", 1);
        let killed = folder.path().join("killed");
        let frames = || std::fs::read_dir(killed.join("grains")).map_or(0, |files| files.count());
        // Short enough that all of them do not finish the shot.
        let kills =
            kill(|threads| pass(&scene, &killed, threads), 0.25 * took, || Some(frames()).filter(|n| *n > 0));
        works(&mut pass(&scene, &killed, 2));
        let [once, alone, killed] = [once, alone, killed].map(|folder| character::output(&folder));
        let note = format!(
            "{} files of a pass of {took:.1} s, after kills at frames {kills:?}; 1 and 2 threads",
            once.len()
        );
        h.gate(same, once == alone && once == killed && kills.len() > 2, &note);
    }
    if h.wants(delta) {
        let (scene, full, _) = made(REPEATED, "full", 2);
        let changes = folder.path().join("changes");
        works(pass(&scene, &changes, 2).args(["--set", "output.grains_mode=delta"]));
        let (same, sizes) = rebuilt(&changes, &full, REPEATED.0);
        let note = format!("{} frames, {:.0} % of the bytes", REPEATED.0, 100.0 * sizes[0] / sizes[1]);
        h.gate(delta, same, &note);
    }
}

/// Whether the files that are made from a folder of changes are those of a folder of whole ones; the bytes of both folders' files.
fn rebuilt(changes: &Path, full: &Path, frames: i32) -> (bool, [f64; 2]) {
    let whole = changes.with_file_name("whole.%04d.vdb");
    let mut rebuild =
        frazil(["vdb", "rebuild", "--stage", "grains", "--frame", &format!("1-{frames}"), "-q"]);
    works(rebuild.arg(changes).arg("-o").arg(&whole));
    let file = |out: &Path, frame: i32| out.join(format!("grains/grains.{frame:04}.vdb"));
    let is_same = |frame: i32| {
        let whole = whole.with_file_name(format!("whole.{frame:04}.vdb"));
        character::apart_from_settings(&whole, changes, frame)
            == character::apart_from_settings(&file(full, frame), full, frame)
    };
    let size = |out: &Path| -> f64 {
        let bytes = |frame: i32| std::fs::metadata(file(out, frame)).expect("a file").len() as f64;
        (1..=frames).map(bytes).sum()
    };
    ((1..=frames).all(is_same), [changes, full].map(size))
}

/// Prints how many bytes a grain has without each attribute.
fn parts(grains: &Points) {
    let ctx = context(2);
    let bytes = |points: &Points| {
        let options = WriteOptions::default();
        let bytes = points::to_bytes(&ctx, "grains", points, &options).expect("bytes");
        bytes.len() as f64 / points.count() as f64
    };
    let all = bytes(grains);
    let mut bare = grains.clone();
    for attribute in &grains.attributes {
        let mut less = grains.clone();
        less.attributes.retain(|other| other.name != attribute.name);
        bare.attributes.clear();
        println!("# {}: {:.2} bytes a grain", attribute.name, all - bytes(&less));
    }
    println!("# places, the tree and the rest of the file: {:.2} bytes a grain", bytes(&bare));
}

/// Kills passes on one and two threads again and again, within a part of the time (s) that a whole one takes, and asks `seen` what
/// each had written: what it says of those that were running.
pub fn kill<T>(pass: impl Fn(usize) -> Command, within: f64, seen: impl Fn() -> Option<T>) -> Vec<T> {
    let mut kills = Vec::new();
    for (round, moment) in character::moments(10).into_iter().enumerate() {
        let start = Instant::now();
        let mut child = pass(1 + round % 2).spawn().expect("frazil");
        let limit = Duration::from_secs_f64(0.1 + within * moment);
        while start.elapsed() < limit && child.try_wait().expect("a child").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        let is_running = child.try_wait().expect("a child").is_none();
        child.kill().expect("a kill");
        child.wait().expect("a child");
        kills.extend(seen().filter(|_| is_running));
    }
    kills
}

/// A pass of a scene, quiet.
pub fn pass(scene: &Path, out: &Path, threads: usize) -> Command {
    let mut run = frazil(["snow", "-q", "--threads", &threads.to_string()]);
    // The gates read grains as points of .vdb files.
    run.arg(scene).arg("-o").arg(out).args(["--set", "output.grains=[\"vdb\"]"]);
    quiet(&mut run);
    run
}

/// A scene in which a character walks straight on through snow; `grains` is put into the table of the grains.
pub fn walk(folder: &Path, man: &Path, frames: i32, cell: f64, grains: &str) -> PathBuf {
    let text = format!(
        r#"
shot = {{ frames = "1-{frames}" }}
snow = {{ ground = 0.0, area = [-0.9, -1.6, 0.9, 3.4], depth = 0.2, cell = {cell} }}
grains = {{ {grains} }}
[[object]]
file = {:?}
scale = 1.166
keys = [{{ frame = 1, at = [0.0, 0.06, -1.15] }}, {{ frame = 96, at = [0.0, 0.06, 3.0] }}]
"#,
        man.display().to_string()
    );
    let path = folder.join("walk.toml");
    std::fs::write(&path, text).expect("a scene");
    path
}
