//! The frame loop with three stages, one of them made here: it keeps its state in a text file and reads the base.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use crate::common::character::output;
use crate::program::{CUBE, Folder};
use crate::turn;
use frazil::io::records::manifest::Keeps;
use frazil::scene::run::verify::verify;
use frazil::scene::run::{
    DoneFrames, FileKind, FrameFiles, Report, Run, Settings, Stage, StepTarget, Stepped, Stepping,
};
use frazil::scene::{FrameChoice, Inputs, Scene, snow};
use frazil::{Context, Error, Pool, Result};

const SCENE: &str = "[shot]\nframes = \"1-8\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
                     cell = 0.04\n[output]\nmesh = []\nobjects = [\"ply\"]\n[[object]]\nfile = \"cube.obj\"\n\
                     keys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 8, at = [0, 0.1, 0.9] }]\n";

/// Adds up the lengths of the base's files, each weighted.
struct Tally {
    weight: u64,
    /// How long a step takes at least.
    wait: Duration,
}

impl Stage for Tally {
    fn name(&self) -> &'static str {
        "tally"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: "tally", extensions: &["txt"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        true
    }

    fn state_extension(&self) -> &'static str {
        "txt"
    }

    fn settings(&self) -> Result<Settings> {
        Ok(Settings::from([("tally.weight".into(), self.weight.to_string())]))
    }

    fn first_state_settings(&self, _settings: &Settings) -> Settings {
        Settings::new()
    }

    fn upstream(&self) -> &'static [&'static str] {
        &["base"]
    }

    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::State
    }
}

impl Stepping for Tally {
    type State = u64;
    type Step = u64;
    type Writer = ();

    fn load(&self, _ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<u64> {
        let Some(frame) = after else { return Ok(0) };
        let path = done.state_file(frame)?;
        let text = fs::read_to_string(&path).map_err(|error| Error::io(&path, "read", error))?;
        text.trim().parse().map_err(|_| Error::file(path, "is not a number"))
    }

    fn step(&self, ctx: &Context, sum: &mut u64, to: &StepTarget<'_>) -> Result<Stepped<u64>> {
        ctx.check()?;
        std::thread::sleep(self.wait);
        assert!(self.weight < TOO_HEAVY, "the scales broke");
        let file = to.upstream[0].file(to.frame, "base")?;
        let bytes = fs::metadata(&file).map_err(|error| Error::io(&file, "read", error))?.len();
        *sum = sum.wrapping_mul(31).wrapping_add(self.weight * bytes);
        Ok(Stepped { step: *sum, report: Report::default() })
    }

    fn writer(&self, _ctx: &Context, _sum: &u64) -> Result<()> {
        Ok(())
    }

    fn write(&self, _writer: &mut (), sum: u64, files: Option<&mut FrameFiles>) -> Result<()> {
        let Some(files) = files else { return Ok(()) };
        files.save("tally", "txt", format!("frame {}: {sum}\n", files.frame).as_bytes())?;
        files.save_state(format!("{sum}\n").as_bytes())
    }
}

/// What a run is asked for.
#[derive(Clone, Copy)]
struct Asked<'a> {
    stages: &'a [&'a str],
    frames: &'a str,
    from: Option<i32>,
    weight: u64,
    wait: Duration,
    /// Seed of the ragged edges, on which the base depends.
    seed: u32,
    /// Whether the scene has the third stage.
    tallies: bool,
}

const ALL: Asked<'_> =
    Asked { stages: &[], frames: "1-8", from: None, weight: 1, wait: Duration::ZERO, seed: 0, tallies: true };
/// A weight that the third stage does not bear.
const TOO_HEAVY: u64 = 1000;

/// Runs the three stages; gives what was made, in the order of the files.
fn run(folder: &Path, out: &str, asked: &Asked<'_>) -> Result<Vec<(&'static str, i32)>> {
    let seed = format!("snow.noise.seed={}", asked.seed).parse().unwrap();
    let scene = Scene::read_with(&folder.join("shot.toml"), &[seed])?;
    let inputs = Inputs::load(&scene)?;
    let mut pipeline = snow::pipeline(&scene, &inputs);
    if asked.tallies {
        pipeline.stages.push(Box::new(Tally { weight: asked.weight, wait: asked.wait }));
    }
    let ctx = Context::new(Pool::new(1)?);
    let stages: Vec<String> = asked.stages.iter().map(|name| name.to_string()).collect();
    let frames: FrameChoice = asked.frames.parse().unwrap();
    let made = std::sync::Mutex::new(Vec::new());
    let run = Run::prepare(&ctx, &pipeline, &folder.join(out), &stages, &frames, asked.from)?;
    run.make(&ctx, |done| made.lock().unwrap().push((done.stage, done.frame)))?;
    Ok(made.into_inner().unwrap())
}

fn folder() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    fs::write(folder.join("shot.toml"), SCENE).unwrap();
    folder
}

fn of_stage(made: &[(&'static str, i32)], stage: &str) -> Vec<i32> {
    made.iter().filter(|(name, _)| *name == stage).map(|(_, frame)| *frame).collect()
}

/// Names of the files that are not the same in two outputs.
fn differences(folder: &Path, a: &str, b: &str) -> Vec<String> {
    let [a, b]: [BTreeMap<String, Vec<u8>>; 2] = [a, b].map(|name| output(&folder.join(name)));
    let names: BTreeSet<&String> =
        a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name)).collect();
    names.into_iter().cloned().collect()
}

const FOLDER: &str = "FRAZIL_TEST_STAGES";

/// Not a test of its own: the run that others start and kill.
#[test]
fn as_another_process() {
    let _turn = turn();
    if let Ok(folder) = std::env::var(FOLDER) {
        run(Path::new(&folder), "killed", &Asked { wait: Duration::from_millis(30), ..ALL }).unwrap();
    }
}

fn another(folder: &Path) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["shot_stages::as_another_process", "--exact", "--test-threads", "1"])
        .env(FOLDER, folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits until a file is there or the process has ended.
fn wait_for(path: &Path, child: &mut Child) {
    while !path.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn killed_in_any_stage_a_run_resumes_to_the_same_bytes() {
    let _turn = turn();
    let folder = folder();
    run(&folder, "once", &ALL).unwrap();
    let state = folder.join("killed/state");
    for record in ["base.0003.json", "objects.0005.json", "tally.0002.json", "tally.0006.json"] {
        let mut child = another(&folder);
        wait_for(&state.join(record), &mut child);
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(state.join("tally.0006.json").exists() && !state.join("tally.0008.json").exists());
    let made = run(&folder, "killed", &ALL).unwrap();
    assert!(of_stage(&made, "base").is_empty() && !of_stage(&made, "tally").is_empty(), "{made:?}");
    assert_eq!(differences(&folder, "once", "killed"), Vec::<String>::new());
    assert!(verify(&Context::new(Pool::new(1).unwrap()), &folder.join("killed")).unwrap().damaged.is_empty());
}

#[test]
fn a_stage_is_made_again_alone_and_takes_what_reads_it_along() {
    let _turn = turn();
    let folder = folder();
    let made = run(&folder, "once", &ALL).unwrap();
    assert_eq!(made.len(), 24);
    // One stage, from a frame on, with another setting: the others stay as they are.
    run(&folder, "out", &ALL).unwrap();
    let heavy = Asked { weight: 2, ..ALL };
    let refused = run(&folder, "out", &heavy).unwrap_err().to_string();
    assert!(refused.contains("stage tally") && refused.contains("tally.weight was 1"), "{refused}");
    // The states of frames before the last two are gone.
    let refused = run(&folder, "out", &Asked { from: Some(4), stages: &["tally"], ..heavy });
    assert!(refused.unwrap_err().to_string().contains("--from 8"));
    let made = run(&folder, "out", &Asked { from: Some(8), stages: &["tally"], ..heavy }).unwrap();
    assert_eq!(made, [("tally", 8)]);
    let changed =
        ["state/tally.0008.json", "state/tally.0008.txt", "state/tally.json", "tally/tally.0008.txt"];
    assert_eq!(differences(&folder, "once", "out"), changed);
    // The base from a frame on: what reads it goes too, what does not stays.
    let made = run(&folder, "out", &Asked { from: Some(3), stages: &["base"], ..ALL }).unwrap();
    assert_eq!(made, (3..=8).map(|frame| ("base", frame)).collect::<Vec<_>>());
    let out = folder.join("out");
    assert!(out.join("state/tally.0002.json").exists() && !out.join("state/tally.0003.json").exists());
    assert!(!out.join("tally/tally.0003.txt").exists() && out.join("objects/objects.0008.ply").exists());
    // All of them again, from the start of the one that has no state left.
    let made = run(&folder, "out", &Asked { from: Some(1), stages: &["tally"], ..ALL }).unwrap();
    assert_eq!(of_stage(&made, "tally"), (1..=8).collect::<Vec<_>>());
    // The base's records say from which frame on it was made again; what it holds is the same.
    let of_others = |name: &String| name.starts_with("tally") || name.contains("objects");
    assert_eq!(differences(&folder, "once", "out").into_iter().find(of_others), None);
}

#[test]
fn what_a_stage_reads_must_be_there_and_what_was_written() {
    let _turn = turn();
    let folder = folder();
    let alone = run(&folder, "out", &Asked { stages: &["tally"], ..ALL }).unwrap_err().to_string();
    assert!(alone.contains("frame 1 of stage tally needs that of stage base"), "{alone}");
    let unknown = run(&folder, "out", &Asked { stages: &["grains"], ..ALL }).unwrap_err().to_string();
    assert!(unknown.contains("no stage \"grains\"") && unknown.contains("base, objects, tally"), "{unknown}");
    run(&folder, "out", &Asked { stages: &["base"], ..ALL }).unwrap();
    let base = folder.join("out/base/base.0004.vdb");
    let whole = fs::read(&base).unwrap();
    let mut bytes = whole.clone();
    bytes[whole.len() / 2] ^= 1;
    fs::write(&base, &bytes).unwrap();
    let damaged = run(&folder, "out", &Asked { stages: &["tally"], ..ALL }).unwrap_err().to_string();
    assert!(damaged.contains("base.0004.vdb"), "{damaged}");
    fs::write(&base, &whole).unwrap();
    assert_eq!(of_stage(&run(&folder, "out", &ALL).unwrap(), "tally"), [4, 5, 6, 7, 8]);
}

#[test]
fn frames_whose_upstream_frames_have_changed_are_refused() {
    let _turn = turn();
    let folder = folder();
    run(&folder, "out", &ALL).unwrap();
    // A scene without the third stage knows nothing of its frames and leaves them.
    let other = Asked { seed: 2, ..ALL };
    run(&folder, "out", &Asked { from: Some(5), tallies: false, ..other }).unwrap();
    assert!(folder.join("out/state/tally.0005.json").exists());
    let refused = run(&folder, "out", &other).unwrap_err().to_string();
    assert!(
        refused.contains("the inputs of frame 5 have changed") && refused.contains("stage base"),
        "{refused}"
    );
    let made = run(&folder, "out", &Asked { from: Some(1), stages: &["tally"], ..other }).unwrap();
    assert_eq!(of_stage(&made, "tally"), (1..=8).collect::<Vec<_>>());
    assert!(run(&folder, "out", &other).unwrap().is_empty());
}

#[test]
fn frames_upstream_may_go_once_they_were_read() {
    let _turn = turn();
    let folder = folder();
    run(&folder, "once", &ALL).unwrap();
    run(&folder, "out", &Asked { frames: "1-6", ..ALL }).unwrap();
    for frame in [2, 3] {
        for file in [format!("state/base.{frame:04}.json"), format!("base/base.{frame:04}.vdb")] {
            fs::remove_file(folder.join("out").join(file)).unwrap();
        }
    }
    let tally = Asked { stages: &["tally"], ..ALL };
    let refused = run(&folder, "out", &tally).unwrap_err().to_string();
    assert!(refused.contains("frame 7 of stage tally needs that of stage base"), "{refused}");
    run(&folder, "out", &Asked { stages: &["base", "objects"], frames: "7-8", ..ALL }).unwrap();
    assert_eq!(run(&folder, "out", &tally).unwrap(), [("tally", 7), ("tally", 8)]);
    // They are made again as they were, and nothing that read them has changed.
    assert_eq!(run(&folder, "out", &ALL).unwrap(), [("base", 2), ("base", 3)]);
    assert_eq!(differences(&folder, "once", "out"), Vec::<String>::new());
}

#[test]
fn frames_on_the_way_need_theirs_upstream() {
    let _turn = turn();
    let folder = folder();
    let last = Asked { frames: "8", ..ALL };
    run(&folder, "out", &Asked { stages: &["base"], ..last }).unwrap();
    let refused = run(&folder, "out", &Asked { stages: &["tally"], ..last }).unwrap_err().to_string();
    assert!(refused.contains("frame 1 of stage tally needs that of stage base"), "{refused}");
    assert!(!folder.join("out/tally/tally.0008.txt").exists());
}

#[test]
fn a_stage_that_panics_keeps_its_words_and_stops_the_others() {
    let _turn = turn();
    let folder = folder();
    let broken = std::panic::catch_unwind(|| run(&folder, "out", &Asked { weight: TOO_HEAVY, ..ALL }));
    let words = broken.unwrap_err();
    assert_eq!(words.downcast_ref::<&str>(), Some(&"the scales broke"));
    // Whole frames are left, and the lock is not.
    let made = run(&folder, "out", &Asked { from: Some(1), stages: &["tally"], ..ALL }).unwrap();
    assert_eq!(of_stage(&made, "tally"), (1..=8).collect::<Vec<_>>());
}

#[test]
fn damage_is_named_in_every_stage() {
    let _turn = turn();
    let folder = folder();
    run(&folder, "out", &ALL).unwrap();
    let ctx = Context::new(Pool::new(1).unwrap());
    for name in [
        "state/tally.0008.txt",
        "state/tally.0003.json",
        "state/objects.0002.json",
        "state/tally.json",
        "state/files.json",
        "tally/tally.0005.txt",
        "objects/objects.0004.ply",
        "base/base.0006.vdb",
        "report/objects.0003.json",
    ] {
        let path = folder.join("out").join(name);
        let whole = fs::read(&path).unwrap();
        let mut bytes = whole.clone();
        bytes[whole.len() / 2] ^= 1;
        fs::write(&path, &bytes).unwrap();
        let damaged = verify(&ctx, &folder.join("out")).unwrap().damaged;
        assert!(damaged.iter().any(|damage| damage.file == name), "{name}: {damaged:?}");
        fs::write(&path, &whole).unwrap();
    }
    // A state of another content is refused, one that is cut is passed over: the stage starts over.
    let (state, record) = (folder.join("out/state/tally.0007.txt"), "out/state/tally.0008.json");
    let whole = fs::read_to_string(&state).unwrap();
    fs::remove_file(folder.join(record)).unwrap();
    fs::remove_file(folder.join("out/state/tally.0008.txt")).unwrap();
    fs::write(&state, whole.replace(&whole[..1], if whole.starts_with('1') { "2" } else { "1" })).unwrap();
    let refused = run(&folder, "out", &ALL).unwrap_err().to_string();
    assert!(refused.contains("tally.0007.txt") && refused.contains("not the file"), "{refused}");
    fs::write(&state, &whole[..1]).unwrap();
    assert_eq!(run(&folder, "out", &ALL).unwrap(), [("tally", 8)]);
    fs::write(&state, &whole).unwrap();
    run(&folder, "whole", &ALL).unwrap();
    assert_eq!(differences(&folder, "whole", "out"), Vec::<String>::new());
}

#[test]
fn two_runs_never_write_into_one_folder() {
    let _turn = turn();
    let folder = folder();
    let mut child = another(&folder);
    wait_for(&folder.join("killed/state/tally.0001.json"), &mut child);
    for stages in [&["base"][..], &["objects"], &["tally"], &[]] {
        let refused = run(&folder, "killed", &Asked { stages, ..ALL }).unwrap_err().to_string();
        assert!(refused.contains("another run"), "{refused}");
    }
    assert!(child.wait().unwrap().success());
    assert!(run(&folder, "killed", &ALL).unwrap().is_empty());
}
