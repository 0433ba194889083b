//! Gates of the scenes of the thesis' table 3.1, grains only, including writing: mean time of eight frames spread over each
//! shot. The shot is computed once, so that each of them resumes from the frame before it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;

use frazil::io::mesh;

use crate::common::character::data;
use crate::common::sleigh::sleigh;
use crate::harness::Harness;

/// Count of measured frames of a shot.
const COUNTED: usize = 8;

/// A scene of the table.
struct Scene {
    gate: &'static str,
    /// Name of the scene in examples/scenes.
    file: &'static str,
    /// File of its object in the test data; none: the sleigh.
    object: Option<&'static str>,
    compression: f64,
    /// Time (s) of a frame on the thesis' six cores.
    thesis: f64,
}

const SCENES: [Scene; 7] = {
    const fn scene(
        gate: &'static str,
        file: &'static str,
        object: Option<&'static str>,
        compression: f64,
        thesis: f64,
    ) -> Scene {
        Scene { gate, file, object, compression, thesis }
    }
    let bunny = Some("mesh/stanford-bunny.obj");
    let [man, robot] = [Some("character/CesiumMan.glb"), Some("character/RobotExpressive.glb")];
    [
        scene("snow.grains.table_3_8a", "grains_imprint", bunny, 0.0, 11.6),
        scene("snow.grains.table_3_8b", "grains_imprint", bunny, 0.75, 4.4),
        scene("snow.grains.table_3_9a", "grains_slide", bunny, 0.0, 81.3),
        scene("snow.grains.table_3_9b", "grains_slide", bunny, 0.75, 15.9),
        scene("snow.grains.table_3_10", "grains_sleigh", None, 0.0, 33.7),
        scene("snow.grains.table_3_11", "grains_walk", man, 0.0, 11.3),
        scene("snow.grains.table_3_12", "grains_roll", robot, 0.0, 39.3),
    ]
};

pub fn run(h: &mut Harness) {
    for scene in &SCENES {
        if !h.wants(scene.gate) {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        match scene.object_in(folder.path()) {
            Some(object) => scene.measure(h, &object, &folder.path().join("out")),
            None => h.skipped(scene.gate, "no data"),
        }
    }
}

impl Scene {
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

    fn measure(&self, h: &mut Harness, object: &Path, out: &Path) {
        for stage in ["base", "grains"] {
            let scene = format!("{}/examples/scenes/{}.toml", env!("CARGO_MANIFEST_DIR"), self.file);
            let mut run = Command::new(env!("CARGO_BIN_EXE_frazil"));
            run.arg("snow").arg(scene).arg("-o").arg(out).args(["-q", "--threads", "2", "--stage", stage]);
            run.args(["--set", &format!("object.1.file={}", object.display())]);
            run.args(["--set", &format!("grains.compression={}", self.compression)]);
            assert!(run.stderr(Stdio::null()).status().expect("frazil").success());
        }
        let frames = Frames::of(out);
        let counted: Vec<f64> = frames.spread().map(|frame| frames.seconds(frame)).collect();
        let mean = |seconds: &[f64]| seconds.iter().sum::<f64>() / seconds.len() as f64;
        let all: Vec<f64> = (1..frames.ends.len()).map(|frame| frames.seconds(frame)).collect();
        let [count, resting, awake] = frames.counts(out);
        let note = format!(
            "threads=2 cpu={:?} thesis={} s on 6 cores; {count} grains in the end, {resting} of them rest; {:.1} thousand grains that are \
             awake in a core-second; all frames {:.2} s, the longest {:.2}",
            frazil::base::cpu::cpu_level(),
            self.thesis,
            awake / all.iter().sum::<f64>() / 2e3,
            mean(&all),
            all.iter().copied().fold(0.0, f64::max),
        );
        h.gate(self.gate, mean(&counted), &note);
    }
}

/// Completion times of the frames of a pass.
struct Frames {
    ends: Vec<SystemTime>,
}

impl Frames {
    /// Those of a folder; the first frame, which has no grains yet, is the start.
    fn of(out: &Path) -> Self {
        let end = |frame: usize| std::fs::metadata(record(out, frame)).and_then(|file| file.modified()).ok();
        Self { ends: (1..).map_while(end).collect() }
    }

    /// Mean time (s) of a frame and the one before: files are written while the next frame is computed.
    fn seconds(&self, frame: usize) -> f64 {
        let first = frame.saturating_sub(2);
        let took = self.ends[frame].duration_since(self.ends[first]);
        took.map_or(0.0, |took| took.as_secs_f64()) / (frame - first) as f64
    }

    /// The measured frames, including the last one.
    fn spread(&self) -> impl Iterator<Item = usize> {
        let last = self.ends.len() - 1;
        (1..=COUNTED).map(move |n| n * last / COUNTED)
    }

    /// Counts of grains at the end, of those at rest, and of those awake summed over all frames.
    fn counts(&self, out: &Path) -> [f64; 3] {
        let number = |frame: usize, name: &str| {
            let text = std::fs::read(record(out, frame)).expect("a report");
            let report: serde_json::Value = serde_json::from_slice(&text).expect("a report");
            report[name].as_f64().expect("a number")
        };
        let frames = self.ends.len();
        let awake = (2..=frames).map(|frame| number(frame, "grains") - number(frame, "resting")).sum();
        [number(frames, "grains"), number(frames, "resting"), awake]
    }
}

fn record(out: &Path, frame: usize) -> PathBuf {
    out.join(format!("report/grains.{frame:04}.json"))
}
