//! What the folders of shots hold for other programs, and what they take.

use std::path::Path;

use super::made::{DEMO, Made};
use crate::common::clients;
use crate::harness::Harness;
use crate::process::works;

/// Bytes of a folder's files.
fn bytes(folder: &Path) -> f64 {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let of = |path: std::path::PathBuf| match path.is_dir() {
        true => bytes(&path),
        false => std::fs::metadata(path).expect("a file").len() as f64,
    };
    entries.map(of).sum()
}

/// The greatest size of a folder with default settings, relative to the one with the defaults of commit e6ca079.
pub fn size(shots: &[Made], scenes: &Path, folder: &Path) -> (f64, String) {
    let ratio = |(shot, made): (&super::made::Shot, &Made)| {
        let former = folder.join(format!("{}.former", shot.name));
        let mut command = shot.command(scenes, &former);
        shot.former.iter().for_each(|setting| {
            command.args(["--set", setting]);
        });
        works(command.arg("-q"));
        (bytes(&made.folder) / bytes(&former), made.name)
    };
    let ratios: Vec<(f64, &str)> = DEMO.iter().zip(shots).map(ratio).collect();
    let note: Vec<String> = ratios.iter().map(|(ratio, name)| format!("{name} {ratio:.3}")).collect();
    (ratios.iter().map(|(ratio, _)| *ratio).fold(0.0, f64::max), note.join(", "))
}

/// Errors of validators, and parts that differ from the reports, in usd-core and in Blender.
pub fn usd(h: &mut Harness, shots: &[Made]) {
    let (errors, parts) = ("files.usd_errors", "files.usd_whole");
    match clients::validators() {
        None => [errors, parts].iter().for_each(|name| {
            if h.wants(name) {
                h.skipped(name, "not installed: make test-clients");
            }
        }),
        Some(python) if h.wants(errors) || h.wants(parts) => {
            let faults = faults(shots, |folder| clients::usd_is_whole(&python, folder));
            let is_of_frame = |fault: &&String| fault.contains(": frame ");
            let counts = [false, true].map(|of_frames| {
                let own: Vec<&String> =
                    faults.iter().filter(|fault| is_of_frame(fault) == of_frames).collect();
                (own.len() as f64, own.first().map_or(String::new(), |first| first.to_string()))
            });
            let [errors_found, parts_found] = counts;
            h.measure(errors, || errors_found);
            h.measure(parts, || parts_found);
        }
        Some(_) => {}
    }
    let blender = "files.usd_whole_blender";
    match clients::bpy_python() {
        None if h.wants(blender) => h.skipped(blender, "not installed: make test-clients"),
        Some(python) if h.wants(blender) => {
            let faults = faults(shots, |folder| clients::blender_is_whole(&python, folder));
            h.gate(blender, faults.len() as f64, faults.first().map_or("", String::as_str));
        }
        _ => {}
    }
}

/// The faults that a script finds in the folders, each with the shot's name.
fn faults(shots: &[Made], find: impl Fn(&Path) -> Result<String, String>) -> Vec<String> {
    let of = |shot: &Made| -> Vec<String> {
        let Err(error) = find(&shot.folder) else { return Vec::new() };
        let is_fault =
            |line: &&str| ["frame ", "usd-core: ", "NVIDIA: "].iter().any(|start| line.contains(start));
        let faults: Vec<String> =
            error.lines().filter(is_fault).map(|line| format!("{}: {}", shot.name, line.trim())).collect();
        // A script that fails in another way is a fault too.
        if faults.is_empty() { vec![format!("{}: {error}", shot.name)] } else { faults }
    };
    shots.iter().flat_map(of).collect()
}
