//! The shots of the demo, made by the command, with what it forecast of them.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::process::{frazil, json, works};

/// A shot of the demo.
pub struct Shot {
    /// Name of its scene.
    pub name: &'static str,
    system: &'static str,
    /// The frames that are made; none: all.
    frames: Option<&'static str>,
    /// The settings that were its defaults when only .ply and .vdb files were written (commit e6ca079).
    pub former: &'static [&'static str],
}

pub const SNOW: &[&str] =
    &["output.objects=[]", "output.mesh=[]", "output.grains=[\"vdb\"]", "output.mist_half=false"];
const SURFACE: &[&str] = &["output.surface=[\"ply\"]"];
const SHALLOW: &[&str] = &["output.liquid=[\"ply\"]", "output.terrain=[]"];
/// A terrain was written only where the liquid stains it.
const STAINING: &[&str] = &["output.liquid=[\"ply\"]", "output.terrain=[\"ply\"]"];

/// The shots of the demo and of the examples: all systems, all stages, terrains with and without stains.
pub const DEMO: [Shot; 7] = [
    Shot { name: "hero", system: "snow", frames: None, former: SNOW },
    Shot { name: "walker", system: "snow", frames: None, former: SNOW },
    Shot { name: "plough", system: "snow", frames: None, former: SNOW },
    Shot { name: "liquid", system: "surface", frames: None, former: SURFACE },
    Shot { name: "drip", system: "surface", frames: None, former: SURFACE },
    Shot { name: "spill_layers", system: "shallow", frames: Some("1-361x12"), former: SHALLOW },
    Shot { name: "spill_bone", system: "shallow", frames: Some("1-481x60"), former: STAINING },
];

/// A folder with the scenes of the demo, made in another.
pub fn scenes(folder: &Path) -> PathBuf {
    let scenes = folder.join("scenes");
    let make = ["run", "--release", "-q", "-p", "make_scenes", "--"];
    let mut cargo = Command::new(env!("CARGO"));
    works(cargo.args(make).arg(&scenes).current_dir(env!("CARGO_MANIFEST_DIR")));
    scenes
}

/// What a run said of its progress.
pub struct Progress {
    /// Time since its start (s).
    pub at: f64,
    /// The time that it said was left (s).
    pub left: f64,
}

/// A shot that was made.
pub struct Made {
    pub name: &'static str,
    pub folder: PathBuf,
    pub progress: Vec<Progress>,
    /// Time that the run took (s).
    pub seconds: f64,
    /// The memory that it took at most, and that `frazil check` forecast (bytes).
    pub memory: [f64; 2],
}

impl Shot {
    /// The scene in the folder of the demo's; an example is put there, beside the meshes that it names in target/demo.
    fn scene(&self, scenes: &Path) -> PathBuf {
        let name = format!("{}.toml", self.name);
        let of_demo = scenes.join(&name);
        if !of_demo.exists() {
            let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes").join(name);
            let text = std::fs::read_to_string(example).expect("an example");
            std::fs::write(&of_demo, text.replace("../../target/demo/", "")).expect("a scene");
        }
        of_demo
    }

    /// The command that makes it in a folder.
    pub fn command(&self, scenes: &Path, folder: &Path) -> Command {
        let mut command = frazil([self.system]);
        command.arg(self.scene(scenes)).arg("-o").arg(folder);
        if let Some(frames) = self.frames {
            command.args(["--frames", frames]);
        }
        command
    }
}

impl Made {
    /// Makes a shot with default settings in a folder.
    pub fn with_defaults(shot: &Shot, scenes: &Path, folder: &Path) -> Self {
        let (out, record) = (folder.join(shot.name), folder.join(format!("{}.json", shot.name)));
        let mut command = shot.command(scenes, &out);
        command.args(["--progress", "json", "--report"]).arg(&record).stderr(Stdio::piped());
        let start = Instant::now();
        let mut run = command.spawn().expect("frazil");
        let lines = BufReader::new(run.stderr.take().expect("its messages")).lines();
        let progress = lines.map_while(Result::ok).filter_map(|line| {
            let line: serde_json::Value = serde_json::from_str(&line).ok()?;
            Some(Progress { at: start.elapsed().as_secs_f64(), left: line.get("seconds_left")?.as_f64()? })
        });
        let progress: Vec<Progress> = progress.collect();
        assert!(run.wait().expect("frazil").success(), "{command:?}");
        let seconds = start.elapsed().as_secs_f64();
        let peak = json(&record)["peak_memory_bytes"].as_f64().expect("a peak of memory");
        let checked =
            frazil(["check", "--json"]).arg(shot.scene(scenes)).arg("-o").arg(folder.join("none")).output();
        let checked: serde_json::Value =
            serde_json::from_slice(&checked.expect("frazil").stdout).expect("JSON");
        let forecast = checked["memory_forecast_bytes"].as_f64().expect("a forecast of memory");
        Self { name: shot.name, folder: out, progress, seconds, memory: [peak, forecast] }
    }
}
