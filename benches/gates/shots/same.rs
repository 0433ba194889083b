//! Whether a shot's files depend only on its scene.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::made::{SNOW, scenes};
use crate::process::{frazil, quiet, works};

const FRAMES: &str = "1-16";
/// Frames that the earlier version made.
const EARLIER: i32 = 8;

/// The files of a folder that a shot is read from, by their paths: no reports, which hold times, and no records.
fn files(folder: &Path, out: &mut BTreeMap<PathBuf, Vec<u8>>, root: &Path) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.strip_prefix(root).expect("a path in it").to_path_buf();
        if path.is_dir() && name != Path::new("report") && name != Path::new("state") {
            files(&path, out, root);
        } else if path.is_file() && name != Path::new("scene.toml") {
            out.insert(name, std::fs::read(&path).expect("a file"));
        }
    }
}

fn files_of(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut out = BTreeMap::new();
    files(folder, &mut out, folder);
    out
}

/// Whether files of the frames that an earlier version did not make are the same, and all of these are there.
fn is_continued(whole: &BTreeMap<PathBuf, Vec<u8>>, other: &BTreeMap<PathBuf, Vec<u8>>) -> bool {
    let frame = |path: &Path| -> Option<i32> { path.file_stem()?.to_str()?.rsplit('.').next()?.parse().ok() };
    // The .vdb files of grains and mist hold a hash of the settings that the folder began with.
    let is_free =
        |path: &Path| path.starts_with("base") || path.extension().is_some_and(|name| name == "usdc");
    let later =
        |(path, _): &(&PathBuf, &Vec<u8>)| is_free(path) && frame(path).is_some_and(|frame| frame > EARLIER);
    whole.iter().filter(later).all(|(path, bytes)| other.get(path) == Some(bytes))
}

/// Whether 1 and 2 threads, a run that was killed, and the folder of an earlier version give the same files.
pub fn is_same() -> (bool, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scenes(folder.path()).join("hero.toml");
    let run = |name: &str, threads: &str, frames: &str| -> Command {
        let mut command =
            frazil(["snow", "-q", "--threads", threads, "--frames", frames, "--set", "snow.cell=0.02"]);
        command.arg(&scene).arg("-o").arg(folder.path().join(name));
        command
    };
    works(&mut run("whole", "2", FRAMES));
    let whole = files_of(&folder.path().join("whole"));
    works(&mut run("threads", "1", FRAMES));
    let threads = files_of(&folder.path().join("threads")) == whole;
    let mut killed = quiet(&mut run("killed", "2", FRAMES)).spawn().expect("frazil");
    let first = folder.path().join("killed/report/grains.0004.json");
    while !first.exists() && killed.try_wait().expect("frazil").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // SIGKILL; a run that has ended already is none of that.
    let _ = killed.kill();
    killed.wait().expect("frazil");
    works(&mut run("killed", "2", FRAMES));
    let resumed = files_of(&folder.path().join("killed")) == whole;
    let mut earlier = run("earlier", "2", &format!("1-{EARLIER}"));
    // That version had no 16-bit mist, nor a key that says so.
    SNOW.iter().filter(|setting| !setting.contains("mist_half")).for_each(|setting| {
        earlier.args(["--set", setting]);
    });
    works(&mut earlier);
    works(&mut run("earlier", "2", FRAMES));
    let continued = is_continued(&whole, &files_of(&folder.path().join("earlier")));
    (
        threads && resumed && continued,
        format!("threads {threads}, killed {resumed}, earlier folder {continued}"),
    )
}
