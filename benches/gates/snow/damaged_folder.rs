//! Damage in a shot's folder: one flipped bit is named, and never becomes a frame.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::common::character::moments;
use crate::process::frazil;

/// Flips in all.
const FLIPS: usize = 200;
/// Frames before the shot grows, and after.
const FRAMES: [i32; 2] = [5, 7];
/// What is written: each keeps other files, and resumes from others.
const OUTPUTS: [&str; 4] = [
    "objects = [\"usd\", \"ply\"]",
    "base_mode = \"delta\"\nobjects = [\"usd\"]",
    "half = true",
    "base = []\nremoved = []\nobjects = [\"ply\"]",
];
const FOLDERS: [&str; 6] = ["", "base", "removed", "objects", "state", "report"];

/// Flips after which wrong frames were made, and those that are not named.
pub fn measure() -> [(f64, String); 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut wrong, mut unnamed) = (Vec::new(), Vec::new());
    let (mut refused, mut harmless) = (0, 0);
    for (index, output) in OUTPUTS.iter().enumerate() {
        let shot = Shot::new(&folder.path().join(index.to_string()), output);
        let count = FLIPS / OUTPUTS.len();
        let parts = moments(2 * FLIPS);
        for flip in 0..count {
            let at = 2 * (index * count + flip);
            let name = shot.flip(parts[at], parts[at + 1]);
            if !shot.is_named(&name) {
                unnamed.push(format!("{index}:{name}"));
            }
            match shot.grow(&name) {
                None => refused += 1,
                Some(true) => harmless += 1,
                Some(false) => wrong.push(format!("{index}:{name}")),
            }
        }
    }
    let of_wrong = format!("{refused} runs refused, {harmless} made the right frames; {}", wrong.join(" "));
    let of_unnamed = format!("of {FLIPS} flips in all files of 4 folders; {}", unnamed.join(" "));
    [(wrong.len() as f64, of_wrong), (unnamed.len() as f64, of_unnamed)]
}

/// A folder of a shot, as it was made, and as it is after it grew.
struct Shot {
    folder: PathBuf,
    made: BTreeMap<String, Vec<u8>>,
    grown: BTreeMap<String, Vec<u8>>,
}

impl Shot {
    fn new(folder: &Path, output: &str) -> Self {
        fs::create_dir_all(folder).expect("a folder");
        for frame in 1..=FRAMES[1] + 1 {
            fs::write(folder.join(format!("body.{frame}.obj")), body(frame)).expect("a mesh");
        }
        for frames in FRAMES {
            let text = format!(
                "[shot]\nframes = \"1-{frames}\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.8]\ndepth = 0.3\n\
                 cell = 0.04\n[output]\n{output}\n[[object]]\nfile = \"body.%d.obj\"\n"
            );
            fs::write(folder.join(format!("{frames}.toml")), text).expect("a scene");
        }
        let mut shot = Self { folder: folder.to_path_buf(), made: BTreeMap::new(), grown: BTreeMap::new() };
        assert!(shot.snow(FRAMES[0]).status.success());
        shot.made = shot.files();
        assert!(shot.snow(FRAMES[1]).status.success());
        shot.grown = shot.files();
        shot
    }

    fn out(&self) -> PathBuf {
        self.folder.join("out")
    }

    fn snow(&self, frames: i32) -> Output {
        let scene = format!("{frames}.toml");
        frazil(["snow", &scene, "-o", "out", "-q"]).current_dir(&self.folder).output().expect("frazil")
    }

    /// The files of the folder by name; empty ones cannot be damaged.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let mut out = BTreeMap::new();
        for kind in FOLDERS {
            let Ok(entries) = fs::read_dir(self.out().join(kind)) else { continue };
            for path in entries.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_file()) {
                let name = path.strip_prefix(self.out()).expect("inside").to_string_lossy().into_owned();
                let bytes = fs::read(&path).expect("a file");
                if !bytes.is_empty() {
                    out.insert(name, bytes);
                }
            }
        }
        out
    }

    /// Puts the folder back to what it was when it was made, but for one bit of one file.
    fn flip(&self, file: f64, position: f64) -> String {
        fs::remove_dir_all(self.out()).expect("removed");
        let chosen = self.made.keys().nth((file * self.made.len() as f64) as usize).expect("a file");
        for (name, bytes) in &self.made {
            let path = self.out().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            let mut bytes = bytes.clone();
            if name == chosen {
                let bit = (position * (8 * bytes.len()) as f64) as usize;
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            fs::write(path, bytes).expect("a file");
        }
        chosen.clone()
    }

    /// Whether `frazil check` names the file.
    fn is_named(&self, name: &str) -> bool {
        let said = frazil(["check"]).arg(self.out()).output().expect("frazil");
        said.status.code() == Some(1)
            && String::from_utf8_lossy(&said.stdout).contains(&format!("damaged   {name}"))
    }

    /// Whether the shot grows to the same files, but for the one that was damaged and is kept; none when it is refused.
    fn grow(&self, damaged: &str) -> Option<bool> {
        if !self.snow(FRAMES[1]).status.success() {
            return None;
        }
        let (found, newer) = (self.files(), |name: &String| !self.made.contains_key(name));
        // Reports hold times.
        let same = |name: &String| name.starts_with("report/") || self.grown.get(name) == found.get(name);
        let all = self.grown.keys().chain(found.keys());
        Some(all.into_iter().all(|name| same(name) || (name == damaged && !newer(name))))
    }
}

/// A box of 0.4 m, some way along.
fn body(frame: i32) -> String {
    let z = 0.02 * f64::from(frame * frame);
    let mut text = String::new();
    for (x, y, dz) in
        [(-1, 0, -1), (1, 0, -1), (1, 1, -1), (-1, 1, -1), (-1, 0, 1), (1, 0, 1), (1, 1, 1), (-1, 1, 1)]
    {
        let (x, y, z) = (0.2 * f64::from(x), 0.1 + 0.4 * f64::from(y), z + 0.2 * f64::from(dz));
        text += &format!("v {x} {y} {z}\n");
    }
    text + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n"
}
