//! Gates of air in narrow gaps: the largest speed of the air while a character walks through snow, relative to that of the character.

use std::path::Path;

use crate::harness::Harness;
use crate::process::{json, works};
use crate::scenes::{MAN, wanted_data};
use crate::snow::grains::passes::{pass, walk};

/// Frames, and the cell of the snow (m).
const FRAMES: i32 = 72;
const SNOW_CELL: f64 = 0.012;
/// Cells of the mist (m).
const CELLS: [f64; 3] = [0.02, 0.025, 0.03];
/// Frames per second.
const FPS: f64 = 24.0;

pub fn run(h: &mut Harness) {
    let all @ [largest, usual] = ["snow.mist.jets", "snow.mist.jets_p90"];
    let Some(man) = wanted_data(h, &all, MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = walk(folder.path(), &man, FRAMES, SNOW_CELL, "");
    let out = folder.path().join("out");
    let mut worst = [0.0f64; 2];
    let mut note = String::new();
    for cell in CELLS {
        let settings = ["mist.from_speed=0.5", &format!("mist.cell={cell}"), "output.objects=[\"ply\"]"];
        let mut run = pass(&scene, &out, 2);
        run.args(settings.iter().flat_map(|setting| ["--set", setting]));
        if cell != CELLS[0] {
            run.args(["--stage", "mist", "--from", "1"]);
        }
        works(&mut run);
        let character = character_speed(&out);
        let mut speeds: Vec<f64> = (2..=FRAMES).map(|frame| air_speed(&out, frame) / character).collect();
        speeds.sort_by(f64::total_cmp);
        let values = [speeds[speeds.len() - 1], speeds[speeds.len() * 9 / 10]];
        note += &format!(
            "\n#   cells of {cell} m: at most {:.1} x, in nine of ten frames {:.1} x the character's {character:.1} m/s",
            values[0], values[1]
        );
        worst = [0, 1].map(|index| worst[index].max(values[index]));
    }
    h.gate(largest, worst[0], &note);
    h.gate(usual, worst[1], "");
}

/// Largest speed (m/s) of the air at the end of a frame.
fn air_speed(out: &Path, frame: i32) -> f64 {
    let report = json(&out.join(format!("report/mist.{frame:04}.json")));
    report["fastest_m_per_s"].as_f64().expect("a speed")
}

/// Largest speed (m/s) of a vertex of the character.
fn character_speed(out: &Path) -> f64 {
    let mesh = |frame: i32| {
        frazil::io::mesh::read(&out.join(format!("objects/objects.{frame:04}.ply"))).expect("a mesh")
    };
    let mut before = mesh(1);
    let mut largest = 0.0f64;
    for frame in 2..=FRAMES {
        let now = mesh(frame);
        let paths = now.positions.iter().zip(&before.positions);
        largest = paths.map(|(now, before)| f64::from((now - before).norm())).fold(largest, f64::max);
        before = now;
    }
    largest * FPS
}
