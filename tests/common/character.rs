//! Characters from outside the project, and shots made of them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use frazil::geometry::DVec3;
use frazil::motion::{Character, Motion, Play};

/// What Blender says; `make skinning-numbers` makes it again.
const BLENDER: &str = include_str!("../clients/cesium_man.txt");
/// Numbers in it.
pub const VERTICES: usize = 48;
/// Key times in it.
pub const FRAMES: usize = 8;

/// A file of the outside data, if it is there: `FRAZIL_DATA`, else `../shared/data`.
pub fn data(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("FRAZIL_DATA").map(PathBuf::from);
    let root = root.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
    Some(root.join(name)).filter(|path| path.exists())
}

/// The greatest distance (m) of a vertex of CesiumMan from where Blender has it, and the character's height (m).
pub fn farthest_from_blender(path: &Path) -> (f64, f64) {
    let character = Character::open(path, Play { repeat: false, ..Play::default() }).unwrap();
    let mut pose = Vec::new();
    let (mut vertices, mut farthest, mut height) = (Vec::new(), 0.0f64, 0.0);
    for line in BLENDER.lines().filter(|line| !line.starts_with('#')) {
        let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        let positions: Vec<DVec3> = numbers[1..].chunks(3).map(|p| DVec3::new(p[0], p[1], p[2])).collect();
        character.pose(numbers[0] / 24.0, &mut pose).unwrap();
        if vertices.is_empty() {
            // Blender numbers the vertices as the file does: at the first frame each is known by its position.
            let nearest = |position: &DVec3| {
                let distance = |vertex: &usize| (pose[*vertex] - position).norm();
                (0..pose.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()
            };
            vertices = positions.iter().map(nearest).collect::<Vec<usize>>();
            let heights = pose.iter().map(|p| p.y);
            height = heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min);
        }
        let apart =
            vertices.iter().zip(&positions).map(|(&vertex, position)| (pose[vertex] - position).norm());
        farthest = apart.fold(farthest, f64::max);
    }
    assert_eq!(vertices.len(), VERTICES);
    (farthest, height)
}

/// A scene in which CesiumMan, 1.7 m tall, walks in a circle on 6 x 6 m of snow; `output` is put into its table.
pub fn walk_scene(folder: &Path, man: &Path, frames: i32, cell: f64, output: &str) -> PathBuf {
    let mut text = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.002\narea = [-3, -3, 3, 3]\ndepth = 0.3\ncell = {cell}\n\
         [output]\n{output}\n[[object]]\nfile = '{}'\nscale = 1.166\nkeys = [\n",
        man.display()
    );
    // 1.15 m/s, his own speed, on a circle of 1.83 m: once around in 240 frames.
    for key in 0..=frames / 10 {
        let angle = 2.0 * std::f64::consts::PI * f64::from(key) / 24.0;
        let (x, z) = (-1.83 * angle.cos(), 1.83 * angle.sin());
        let (frame, turn) = (1 + 10 * key, angle.to_degrees());
        let _ = writeln!(
            text,
            "{{ frame = {frame}, at = [{x:.5}, 0.12, {z:.5}], turn_deg = [0, {turn:.3}, 0] }},"
        );
    }
    text.push_str("]\n");
    let path = folder.join("walk.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// A scene with a ball of 2 n^2 triangles that breathes, one .obj file a frame.
pub fn sequence_scene(folder: &Path, frames: i32, n: i32) -> PathBuf {
    let mut faces = String::new();
    for i in 0..n {
        for j in 0..n {
            let at = |i: i32, j: i32| i * n + j % n + 1;
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            let _ = writeln!(faces, "f {a} {b} {c}\nf {a} {c} {d}");
        }
    }
    for frame in 1..=frames {
        let mut text = String::new();
        for i in 0..=n {
            for j in 0..n {
                let (polar, angle) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let (polar, angle) = (polar * std::f64::consts::PI, 2.0 * angle * std::f64::consts::PI);
                let radius = 0.4 + 0.05 * (5.0 * angle + 0.1 * f64::from(frame)).sin();
                let round = radius * polar.sin();
                let (x, y, z) = (round * angle.cos(), 0.5 + radius * polar.cos(), round * angle.sin());
                let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
            }
        }
        std::fs::write(folder.join(format!("ball.{frame:04}.obj")), text + &faces).unwrap();
    }
    let text = format!(
        "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.01\n\
         [[object]]\nfile = \"ball.%04d.obj\"\n"
    );
    let path = folder.join("sequence.toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// Parts between 0 and 1, always the same ones (a linear congruential generator).
pub fn moments(count: usize) -> Vec<f64> {
    let mut state = 20u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count).map(|_| next()).collect()
}

/// The files of an output folder by name, but for reports, which hold times, and the lock.
pub fn output(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut out = BTreeMap::new();
    for name in [
        "",
        "base",
        "removed",
        "grains",
        "mist",
        "fog",
        "snow",
        "mesh",
        "objects",
        "tally",
        "surface",
        "liquid",
        "volume",
        "terrain",
        "obstacles",
        "state",
    ] {
        let Ok(entries) = std::fs::read_dir(folder.join(name)) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
            let file = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
            if !file.ends_with(".lock") {
                out.insert(file, std::fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// Checks that a folder has the files of another run, and the same bytes in those that are compared.
#[track_caller]
pub fn are_same(whole: &BTreeMap<String, Vec<u8>>, out: &Path, is_compared: impl Fn(&str) -> bool) {
    let other = output(out);
    assert_eq!(whole.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>(), "{}", out.display());
    for (name, bytes) in whole.iter().filter(|(name, _)| is_compared(name)) {
        assert!(*bytes == other[name], "{name} of {}", out.display());
    }
}

/// The bytes of a file of grains without what two runs with other settings have by themselves: the file's identifier, and the
/// hash of what a frame of stage grains in a folder was made from.
pub fn apart_from_settings(file: &Path, out: &Path, frame: i32) -> Vec<u8> {
    let record = std::fs::read(out.join(format!("state/grains.{frame:04}.json"))).unwrap();
    let record: serde_json::Value = serde_json::from_slice(&record).unwrap();
    let hash = record["content"]["inputs"].as_str().unwrap().as_bytes().to_vec();
    let mut bytes = std::fs::read(file).unwrap();
    bytes[21..57].fill(b'-');
    let found = bytes.windows(hash.len()).position(|window| window == hash).expect("the hash of its inputs");
    bytes[found..found + hash.len()].fill(b'-');
    bytes
}
