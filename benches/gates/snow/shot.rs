//! Gates of characters and shots: skinned sweeps, whole passes with files, continuing.

use std::path::Path;
use std::time::{Duration, Instant};

use frazil::geometry::DVec3;
use frazil::motion::{Character, Key, Keys, Motion, Placed, Play, Space};
use frazil::scene::{Inputs, Scene};
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::{self, Body, Settings};
use frazil::vdb::file;

use crate::common::character::{self, data};
use crate::common::clients;
use crate::harness::{Harness, median, timed};
use crate::process::{frazil, json, quiet, works};
use crate::scenes::{MAN, context, wanted_data};
use crate::sweep::pose_union::Union;
use crate::sweep::walls::each_voxel;

const CELL: f64 = 0.0075;
const FPS: f64 = 24.0;
/// The thesis' time of a frame like these (Table 3.1), 3.15 s, for 240 of them.
const THESIS: &str = "thesis=756 s";

/// All of them.
pub fn run(h: &mut Harness) {
    let names = "sweep skinning edit pass memory check continued rebuilt changed clients".split(' ');
    let names: Vec<String> = names.map(|name| format!("snow.shot.{name}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let Some(man) = wanted_data(h, &names, MAN) else { return };
    sweeps(h, &man);
    skinning(h, &man);
    edit(h, &man);
    pass(h, &man);
    check(h, &man);
    continued(h, &man);
    changed(h, &man);
    clients(h, &man);
}

/// A character 1.7 m tall that walks along z.
fn walker(path: &Path, clip: &str, speed: f64) -> Box<dyn Motion> {
    let play = Play { clip: Some(clip.into()), ..Play::default() };
    let inner = Box::new(Character::open(path, play).expect("a character"));
    let mut pose = Vec::new();
    inner.pose(0.0, &mut pose).expect("a pose");
    let heights = pose.iter().map(|p| p.y);
    let height = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
    let key = |time: f64| Key { time, at: DVec3::z() * speed * time, turn: DVec3::zeros() };
    let keys = Keys::new(vec![key(0.0), key(10.0)]).expect("keys");
    Box::new(Placed::new(inner, Space { scale: 1.7 / height, ..Space::OWN }, keys))
}

/// The four fastest frames of each character against the union of 256 capped poses, on a lattice of half a cell.
fn sweeps(h: &mut Harness, man: &Path) {
    if !h.wants("snow.shot.sweep") {
        return;
    }
    let ctx = context(2);
    let robot = data("character/RobotExpressive.glb");
    let characters = [("cesium", Some(man.to_path_buf()), "Anim_0", 1.15), ("robot", robot, "Walking", 1.8)];
    for (name, path, clip, speed) in characters {
        let Some(path) = path else {
            h.skipped(&format!("snow.shot.sweep_{name}"), "no data");
            continue;
        };
        let body = Body::new(walker(&path, clip, speed), 0.0).expect("a body");
        let frames = fastest(body.motion(), 47);
        let (mut missed, mut fat) = (0, 0);
        for &(_, frame) in &frames[..4] {
            let (from, to) = (f64::from(frame - 1) / FPS, f64::from(frame) / FPS);
            let bodies = std::slice::from_ref(&body);
            let swept = sweep::chain(&ctx, bodies, from, to, &Settings::new(CELL)).expect("a sweep");
            let union = ctx.pool().install(|| Union::new(body.motion(), from, to, 256, CELL / 2.0));
            each_voxel(&swept, |p, ours| {
                missed += u64::from(ours > 0.0 && union.is_deep(p, 1));
                fat += u64::from(ours < 0.0 && union.is_far(p, 2));
            });
        }
        let note = format!("{:.0} mm in a frame", frames[0].0 * 1000.0);
        h.gate(&format!("snow.shot.sweep_{name}_missed"), missed as f64, &note);
        h.gate(&format!("snow.shot.sweep_{name}_fat"), fat as f64, &note);
    }
}

/// Frames with how far a vertex moves in them (m), the farthest first.
fn fastest(motion: &dyn Motion, last: i32) -> Vec<(f64, i32)> {
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let mut frames: Vec<(f64, i32)> = (1..=last)
        .map(|frame| {
            motion.pose(f64::from(frame - 1) / FPS, &mut before).expect("a pose");
            motion.pose(f64::from(frame) / FPS, &mut after).expect("a pose");
            let moved = before.iter().zip(&after).map(|(p, q): (&DVec3, &DVec3)| (p - q).norm());
            (moved.fold(0.0, f64::max), frame)
        })
        .collect();
    frames.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    frames
}

/// Against Blender's poses at key times.
fn skinning(h: &mut Harness, man: &Path) {
    if h.wants("snow.shot.skinning") {
        let (worst, height) = character::farthest_from_blender(man);
        let note = format!("{} vertices at {} key times", character::VERTICES, character::FRAMES);
        h.gate("snow.shot.skinning", worst / height, &note);
    }
}

/// Seconds of a step without files.
fn edit(h: &mut Harness, man: &Path) {
    if !h.wants("snow.shot.edit") {
        return;
    }
    let ctx = context(2);
    let folder = tempfile::tempdir().expect("a folder");
    let scene = character::walk_scene(folder.path(), man, 240, 0.0075, "");
    let scene = Scene::read(&scene).expect("a scene");
    let inputs = Inputs::load(&scene).expect("inputs");
    let layer = inputs.layer(&ctx).expect("a layer");
    let mut base = BaseLayer::new(&ctx, layer, Params::for_cell(CELL)).expect("a layer");
    let time = |frame: i32| f64::from(frame) / FPS;
    base.step(&ctx, &inputs.bodies, time(1), time(1), 1).expect("first pose");
    let step =
        |frame: i32| timed(|| drop(base.step(&ctx, &inputs.bodies, time(frame - 1), time(frame), frame))).0;
    let times: Vec<f64> = (2..=97).map(step).collect();
    let worst = times.iter().copied().fold(0.0, f64::max);
    let note = format!("median of 96 frames, worst {worst:.3} s; threads=2 thesis=3.15-4.59 s on 6 cores");
    h.gate("snow.shot.edit", median(times), &note);
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// The whole pass with its files, in both modes.
fn pass(h: &mut Harness, man: &Path) {
    for mode in ["full", "delta"] {
        let (pass, memory) = (format!("snow.shot.pass_{mode}"), format!("snow.shot.memory_{mode}"));
        if !h.wants(&pass) && !h.wants(&memory) {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let scene =
            character::walk_scene(folder.path(), man, 240, 0.0075, &format!("base_mode = \"{mode}\""));
        let (out, report) = (folder.path().join("out"), folder.path().join("report.json"));
        let arguments =
            ["snow", text(&scene), "-o", text(&out), "--threads", "2", "-q", "--report", text(&report)];
        let (took, noisy) = timed(|| works(&mut frazil(arguments)));
        let peak = json(&report)["peak_memory_bytes"].as_f64().expect("a peak") / f64::from(1 << 20);
        let note = format!("240 frames, 6 x 6 m, with files; threads=2 {THESIS}{noisy}");
        h.gate(&pass, took, &note);
        h.gate(&memory, peak, "");
    }
}

/// Seconds of `frazil check`.
fn check(h: &mut Harness, man: &Path) {
    let folder = tempfile::tempdir().expect("a folder");
    let seconds = |scene: &Path| {
        let run = || timed(|| works(&mut frazil(["check", text(scene)]))).0;
        median((0..5).map(|_| run()).collect())
    };
    if h.wants("snow.shot.check_walk") {
        let scene = character::walk_scene(folder.path(), man, 240, 0.0075, "");
        h.gate("snow.shot.check_walk", seconds(&scene), "");
    }
    if h.wants("snow.shot.check_sequence") {
        let scene = character::sequence_scene(folder.path(), 240, 158);
        h.gate("snow.shot.check_sequence", seconds(&scene), "50,000 triangles a frame");
    }
}

/// Killed at ten moments and continued, in both modes; and whole frames rebuilt from changes.
fn continued(h: &mut Harness, man: &Path) {
    if !h.wants("snow.shot.continued") && !h.wants("snow.shot.rebuilt") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let mut whole = Vec::new();
    for mode in ["full", "delta"] {
        let name = format!("snow.shot.continued_{mode}");
        let scene = character::walk_scene(folder.path(), man, 120, 0.015, &format!("base_mode = \"{mode}\""));
        let [once, killed] = ["once", "killed"].map(|name| folder.path().join(format!("{name}_{mode}")));
        let (took, _) = timed(|| works(&mut frazil(["snow", text(&scene), "-o", text(&once)])));
        whole.push(once.clone());
        let mut kills = 0;
        for moment in character::moments(10) {
            let start = Instant::now();
            let mut child =
                quiet(&mut frazil(["snow", text(&scene), "-o", text(&killed)])).spawn().expect("frazil");
            // Short enough that ten of them do not finish the shot.
            let limit = Duration::from_secs_f64(0.02 + 0.25 * took * moment);
            while start.elapsed() < limit && child.try_wait().expect("a child").is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            kills += usize::from(child.kill().is_ok());
            child.wait().expect("a child");
        }
        works(&mut frazil(["snow", text(&scene), "-o", text(&killed)]));
        let same = character::output(&once) == character::output(&killed);
        h.holds(&name, same, &format!("{kills} kills, a run takes {took:.1} s"));
    }
    let [full, delta] = [&whole[0], &whole[1]];
    let mut same = true;
    for moment in character::moments(5) {
        let frame = 1 + (moment * 119.0) as i32;
        let file = folder.path().join("rebuilt.vdb");
        let arguments = ["vdb", "rebuild", text(delta), "--frame", &frame.to_string(), "-o", text(&file)];
        same &= quiet(&mut frazil(arguments)).status().expect("frazil").success();
        same &= voxels(&file) == voxels(&full.join(format!("base/base.{frame:04}.vdb")));
    }
    h.holds("snow.shot.rebuilt", same, "5 frames, values and active voxels of all three grids");
}

/// Leaves of a grid: origin, bits of the values, active voxels.
type Leaves = Vec<([i32; 3], Vec<u32>, [u64; 8])>;

/// All that the grids of a file hold in their leaves.
fn voxels(path: &Path) -> Vec<(String, u64, Leaves)> {
    let of_grid = |grid: frazil::vdb::FloatGrid| {
        let leaves = grid.leaves().expect("leaves");
        let leaf =
            |leaf: &frazil::vdb::Leaf<'_>| (leaf.origin, leaf.values.map(f32::to_bits).to_vec(), *leaf.mask);
        (grid.name(), grid.active_voxels(), leaves.iter().map(leaf).collect())
    };
    file::read(path).expect("a file").into_iter().map(of_grid).collect()
}

/// Other settings are refused with their key; frames before --from keep their bytes.
fn changed(h: &mut Harness, man: &Path) {
    if !h.wants("snow.shot.changed") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = character::walk_scene(folder.path(), man, 120, 0.03, "");
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        frazil(["snow", text(&scene), "-o", text(&out), "-q"]).args(more).output().expect("frazil")
    };
    let made = run(&[]).status.success();
    let before = character::output(&out);
    let refused = run(&["--set", "snow.noise.seed=2"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    let named = refused.status.code() == Some(2) && said.contains("snow.noise.seed was 0");
    h.holds("snow.shot.changed_refused", made && named && character::output(&out) == before, said.trim());
    let again = run(&["--set", "snow.noise.seed=2", "--from", "100"]);
    let after = character::output(&out);
    let kept = |frame: i32| {
        let name = format!("base/base.{frame:04}.vdb");
        before.contains_key(&name) && before.get(&name) == after.get(&name)
    };
    let yes = again.status.success() && (1..100).all(kept) && !(100..=120).any(kept);
    h.holds("snow.shot.changed_from", yes, "frames 1-99 keep their bytes, 100-120 are new");
}

/// Other programs open the shot, where they are installed.
fn clients(h: &mut Harness, man: &Path) {
    if !h.wants("snow.shot.clients") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scene = character::walk_scene(folder.path(), man, 24, 0.02, "objects = [\"usd\"]");
    let out = folder.path().join("out");
    works(&mut frazil(["snow", text(&scene), "-o", text(&out)]));
    let blender = clients::blender().map(|blender| clients::blender_opens(&blender, &out, 1, 24));
    let usd = clients::usd_python().map(|python| clients::usd_composes(&python, &out, 1, 24));
    for (name, answer) in [("snow.shot.clients_blender", blender), ("snow.shot.clients_usd", usd)] {
        match answer {
            None => h.skipped(name, "not installed: make test-clients"),
            Some(Ok(said)) => h.holds(name, true, &said),
            Some(Err(said)) => h.holds(name, false, said.lines().last().unwrap_or_default()),
        }
    }
}
