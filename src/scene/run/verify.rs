//! Compares all files in an output folder with what runs wrote.

use std::collections::BTreeSet;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::done_frames::parse_record_name;
use super::own_files;
use super::own_files::OwnFiles;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::io::records::checksummed;
use crate::io::records::manifest::{Manifest, Written};

/// The record of the files that runs wrote into a folder.
const FILES: &str = "state/files.json";

/// Contents of a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Number of frames of which at least one stage is done.
    pub frames: usize,
    /// Number of files that were compared, including records.
    pub files: usize,
    /// Bytes of the frames' files.
    pub bytes: u64,
    /// Files that differ from what was written, ordered by name.
    pub damaged: Vec<Damage>,
    /// Files that are named like those of runs but are in no record: unfinished, or not written by a run.
    pub unknown: Vec<String>,
}

/// A file that differs from what was written.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Damage {
    /// Its path relative to the folder.
    pub file: String,
    /// What is wrong.
    pub what: String,
}

/// Verifies a folder.
///
/// # Errors
/// A folder that cannot be read or that no run wrote into; cancel.
pub fn verify(ctx: &Context, folder: &Path) -> Result<Verified> {
    std::fs::read_dir(folder).map_err(|error| Error::io(folder, "read", error))?;
    let (mut damaged, mut known) = (Vec::new(), BTreeSet::new());
    let (own, faults) = match OwnFiles::read(folder, std::iter::empty()) {
        Ok(own) => (own, Vec::new()),
        Err(error) => (OwnFiles::unknown(folder), vec![damage_of(FILES, error)]),
    };
    damaged.extend(faults);
    let stages = own.recorded_stages()?;
    if stages.is_empty() && damaged.is_empty() {
        return Err(Error::file(folder, "holds no frames: no run wrote into it"));
    }
    let names: BTreeSet<String> = own.names_of(&stages)?;
    let manifests: Vec<(String, Manifest)> =
        names.iter().filter_map(|name| manifest(folder, name, &mut damaged)).collect();
    for stage in &stages {
        let record = format!("state/{stage}.json");
        if !folder.join(&record).exists() {
            damaged.push(Damage { file: record.clone(), what: "is missing".into() });
        } else if let Err(error) = checksummed::read::<serde_json::Value>(&folder.join(&record)) {
            damaged.push(damage_of(&record, error));
        }
        known.insert(record);
    }
    let (own_files, faults) = own.faults();
    damaged.extend(faults.into_iter().map(|(file, what)| Damage { file, what }));
    known.extend([own_files::SCENE, own_files::SHOT_USD, FILES].map(String::from));
    known.extend(own.shot_files().map(String::from));
    let files: Vec<&Written> = manifests
        .iter()
        .flat_map(|(_, manifest)| manifest.files.iter().chain(state_of(folder, manifest)))
        .collect();
    let faults = ctx.phase("verify", || {
        let fault = |file: &&Written| -> Result<Option<Damage>> {
            ctx.check()?;
            Ok(file.fault(folder).map(|what| Damage { file: file.path.clone(), what }))
        };
        files.par_iter().map(fault).collect::<Result<Vec<_>>>()
    })?;
    damaged.extend(faults.into_iter().flatten());
    known.extend(files.iter().map(|file| file.path.clone()));
    let reports: Vec<&String> = names.iter().filter(|name| name.starts_with("report/")).collect();
    damaged.extend(reports.iter().filter_map(|name| report_fault(folder, name)));
    damaged.sort();
    let done = manifests.iter().filter(|(_, manifest)| manifest.files_are_there(folder));
    let done: BTreeSet<i32> = done.map(|(_, manifest)| manifest.frame).collect();
    known.extend(damaged.iter().map(|damage| damage.file.clone()));
    known.extend(manifests.iter().map(|(name, _)| name.clone()));
    let is_known = |name: &&String| known.contains(*name) || name.starts_with("report/");
    Ok(Verified {
        frames: done.len(),
        files: files.len() + manifests.len() + reports.len() + own_files + 1,
        bytes: files.iter().map(|file| file.bytes).sum(),
        damaged,
        unknown: names.iter().filter(|name| !is_known(name)).cloned().collect(),
    })
}

fn damage_of(file: &str, error: Error) -> Damage {
    let what = match error {
        Error::File { what, .. } => what,
        other => other.to_string(),
    };
    Damage { file: file.to_string(), what }
}

/// The record of a frame, if a file has the name of one.
fn manifest(folder: &Path, name: &str, damaged: &mut Vec<Damage>) -> Option<(String, Manifest)> {
    let (stage, frame) = parse_record_name(name.strip_prefix("state/")?)?;
    match Manifest::read(folder, stage, frame) {
        Ok(manifest) => manifest.map(|manifest| (name.to_string(), manifest)),
        Err(error) => {
            damaged.push(damage_of(name, error));
            None
        }
    }
}

/// A frame's exact state, if it is still kept.
fn state_of<'a>(folder: &Path, manifest: &'a Manifest) -> Option<&'a Written> {
    manifest.state.as_ref().filter(|state| folder.join(&state.path).exists())
}

fn report_fault(folder: &Path, name: &str) -> Option<Damage> {
    let what = match std::fs::read(folder.join(name)) {
        Ok(bytes) if checksummed::is_stamped(&bytes) => return None,
        Ok(_) => "is not the report that was written".to_string(),
        Err(error) => Error::io(folder.join(name), "read", error).to_string(),
    };
    Some(Damage { file: name.to_string(), what })
}
