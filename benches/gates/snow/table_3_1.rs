//! Gates of the scenes of the thesis' table 3.1, grains only and whole frames, including writing: mean time of eight frames spread
//! over each shot, by when the reports of a pass were written.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, SystemTime};

use frazil::io::mesh;

use crate::common::character::data;
use crate::common::sleigh::sleigh;
use crate::harness::Harness;
use crate::process::{frazil, json, kilobytes};

/// The gate of the greatest memory of all stages of the walk.
const PEAK: &str = "snow.shot.peak_3_11";
/// Count of measured frames of a shot.
const COUNTED: usize = 8;

/// A scene of the table.
struct Scene {
    /// Its number there, by which its gates are called.
    number: &'static str,
    /// Name of the scene in examples/scenes.
    file: &'static str,
    /// File of its object in the test data; none: the sleigh.
    object: Option<&'static str>,
    compression: f64,
    /// Edge of a cell of the mist (m), as in the table.
    mist_cell: f64,
    /// Times (s) of a frame on the thesis' six cores: grains only, and whole.
    thesis: [f64; 2],
}

const fn scene(
    number: &'static str,
    file: &'static str,
    object: Option<&'static str>,
    [compression, mist_cell]: [f64; 2],
    thesis: [f64; 2],
) -> Scene {
    Scene { number, file, object, compression, mist_cell, thesis }
}

const BUNNY: Option<&str> = Some("mesh/stanford-bunny.obj");
const MAN: Option<&str> = Some("character/CesiumMan.glb");
const ROBOT: Option<&str> = Some("character/RobotExpressive.glb");
const SCENES: [Scene; 7] = [
    scene("3_8a", "grains_imprint", BUNNY, [0.0, 0.005], [11.6, 19.5]),
    scene("3_8b", "grains_imprint", BUNNY, [0.75, 0.005], [4.4, 11.3]),
    scene("3_9a", "grains_slide", BUNNY, [0.0, 0.005], [81.3, 92.1]),
    scene("3_9b", "grains_slide", BUNNY, [0.75, 0.005], [15.9, 23.8]),
    scene("3_10", "grains_sleigh", None, [0.0, 0.015], [33.7, 38.5]),
    scene("3_11", "grains_walk", MAN, [0.0, 0.01], [11.3, 21.1]),
    scene("3_12", "grains_roll", ROBOT, [0.0, 0.01], [39.3, 57.5]),
];

pub fn run(h: &mut Harness) {
    for scene in &SCENES {
        let [grains, shot] = scene.gates();
        let mut names = vec![grains.as_str(), &shot];
        names.extend(scene.has_peak().then_some(PEAK));
        if !names.iter().any(|name| h.wants(name)) {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        match scene.object_in(folder.path()) {
            Some(object) => scene.measure(h, &object, &folder.path().join("out")),
            None => names.into_iter().for_each(|name| h.skipped(name, "no data")),
        }
    }
}

impl Scene {
    /// Names of the gates of grains only, and of whole frames.
    fn gates(&self) -> [String; 2] {
        ["grains", "shot"].map(|part| format!("snow.{part}.table_{}", self.number))
    }

    fn object_in(&self, folder: &Path) -> Option<PathBuf> {
        match self.object {
            Some(object) => data(object),
            None => {
                let path = folder.join("sleigh.obj");
                mesh::write(&path, &sleigh()).expect("a mesh");
                Some(path)
            }
        }
    }

    /// Whether its memory is measured.
    fn has_peak(&self) -> bool {
        self.file == "grains_walk"
    }

    fn measure(&self, h: &mut Harness, object: &Path, out: &Path) {
        let [grains, shot] = &self.gates();
        let is_whole = h.wants(shot) || self.has_peak() && h.wants(PEAK);
        let stages: &[&'static str] =
            if is_whole { &["base", "grains", "mist"] } else { &["base", "grains"] };
        let peaks: Vec<f64> = stages.iter().map(|stage| self.run(object, out, stage)).collect();
        let passes: Vec<Pass> = stages.iter().map(|stage| Pass::of(out, stage)).collect();
        let [thesis, whole] = self.thesis;
        h.measure(grains, || (passes[1].mean(), passes[1].note(out, thesis)));
        let of_stages = |numbers: &[f64]| {
            let each = stages.iter().zip(numbers).map(|(stage, number)| format!("{stage} {number:.2}"));
            each.collect::<Vec<String>>().join(", ")
        };
        h.measure(shot, || {
            let means: Vec<f64> = passes.iter().map(Pass::mean).collect();
            let cpu = frazil::numeric::cpu::cpu_level();
            let note = format!("threads=2 cpu={cpu:?} thesis={whole} s on 6 cores; {}", of_stages(&means));
            (means.iter().sum::<f64>(), note)
        });
        if self.has_peak() {
            h.measure(PEAK, || (peaks.iter().copied().fold(0.0, f64::max), of_stages(&peaks)));
        }
    }

    /// Makes a stage; its greatest memory (GB).
    fn run(&self, object: &Path, out: &Path, stage: &str) -> f64 {
        let scene = format!("{}/examples/scenes/{}.toml", env!("CARGO_MANIFEST_DIR"), self.file);
        let mut run = frazil(["snow", &scene, "-q", "--threads", "2", "--stage", stage, "-o"]);
        run.arg(out);
        run.args(["--set", &format!("object.1.file={}", object.display())]);
        run.args(["--set", &format!("grains.compression={}", self.compression)]);
        if stage == "mist" {
            run.args(["--set", "mist.falling=false", "--set", &format!("mist.cell={}", self.mist_cell)]);
        }
        let mut child = run.stderr(Stdio::null()).spawn().expect("frazil");
        let process = child.id().to_string();
        let mut peak = 0.0f64;
        loop {
            peak = peak.max(kilobytes(&process, "VmHWM:") * 1024.0 / 1e9);
            if let Some(status) = child.try_wait().expect("a child") {
                assert!(status.success(), "stage {stage}");
                return peak;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Completion times of the frames of a pass.
struct Pass {
    stage: &'static str,
    ends: Vec<SystemTime>,
}

impl Pass {
    /// Those of a folder; the first frame, before which nothing moves, is the start.
    fn of(out: &Path, stage: &'static str) -> Self {
        let end =
            |frame: usize| std::fs::metadata(record(out, stage, frame)).and_then(|file| file.modified()).ok();
        Self { stage, ends: (1..).map_while(end).collect() }
    }

    /// Mean time (s) of a frame and the one before: files are written while the next frame is computed.
    fn seconds(&self, frame: usize) -> f64 {
        let first = frame.saturating_sub(2);
        let took = self.ends[frame].duration_since(self.ends[first]);
        took.map_or(0.0, |took| took.as_secs_f64()) / (frame - first) as f64
    }

    /// The mean time (s) of the measured frames, including the last one.
    fn mean(&self) -> f64 {
        let last = self.ends.len() - 1;
        (1..=COUNTED).map(|n| self.seconds(n * last / COUNTED)).sum::<f64>() / COUNTED as f64
    }

    /// What a pass of grains did; `thesis` is its time (s) there.
    fn note(&self, out: &Path, thesis: f64) -> String {
        let number = |frame: usize, name: &str| {
            json(&record(out, self.stage, frame))[name].as_f64().expect("a number")
        };
        let last = self.ends.len();
        let awake: f64 = (2..=last).map(|frame| number(frame, "grains") - number(frame, "resting")).sum();
        let all: Vec<f64> = (1..last).map(|frame| self.seconds(frame)).collect();
        let sum = all.iter().sum::<f64>();
        format!(
            "threads=2 cpu={:?} thesis={thesis} s on 6 cores; {} grains in the end, {} of them rest; {:.1} thousand grains that are \
             awake in a core-second; all frames {:.2} s, the longest {:.2}",
            frazil::numeric::cpu::cpu_level(),
            number(last, "grains"),
            number(last, "resting"),
            awake / sum / 2e3,
            sum / all.len() as f64,
            all.iter().copied().fold(0.0, f64::max),
        )
    }
}

fn record(out: &Path, stage: &str, frame: usize) -> PathBuf {
    out.join(format!("report/{stage}.{frame:04}.json"))
}
