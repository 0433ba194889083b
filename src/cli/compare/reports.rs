//! The numbers in which the reports of two folders differ.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use frazil::scene::run::DoneFrames;
use frazil::{Error, Result};
use serde_json::{Number, Value};

/// Keys of a report that are no results: its checksum, its frame, and how long it took.
const NOT_RESULTS: [&str; 3] = ["check", "frame", "phases"];

/// A number that two reports do not share.
#[derive(Debug, PartialEq)]
pub struct Difference {
    /// Its stage and its path in the report: `base.removed_m3`.
    pub key: String,
    /// Its value in each report; none if that report lacks it.
    pub values: [Option<Number>; 2],
}

/// The numbers in which the reports of a frame differ, by their keys.
///
/// # Errors
/// A folder or a report that cannot be read; a report that differs from what was written.
pub fn differences(folders: [&Path; 2], frame: i32) -> Result<Vec<Difference>> {
    let [a, b] = folders;
    let [a, b] = [numbers(a, frame)?, numbers(b, frame)?];
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let value = |key: &String| [&a, &b].map(|numbers| numbers.get(key).cloned());
    let all = keys.into_iter().map(|key| Difference { key: key.clone(), values: value(key) });
    Ok(all.filter(|number| number.values[0] != number.values[1]).collect())
}

/// All results of a frame that are numbers.
fn numbers(folder: &Path, frame: i32) -> Result<BTreeMap<String, Number>> {
    let mut out = BTreeMap::new();
    for stage in reported_stages(folder, frame)? {
        if let Some(Value::Object(mut report)) = DoneFrames::read(folder, &stage)?.report(frame)? {
            NOT_RESULTS.iter().for_each(|key| _ = report.remove(*key));
            collect(&stage, &Value::Object(report), &mut out);
        }
    }
    Ok(out)
}

/// The stages that have a report of a frame.
fn reported_stages(folder: &Path, frame: i32) -> Result<BTreeSet<String>> {
    let reports = folder.join("report");
    let failed = |error| Error::io(&reports, "read", error);
    let entries = match std::fs::read_dir(&reports) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        other => other.map_err(failed)?,
    };
    let mut out = BTreeSet::new();
    for entry in entries {
        let name = entry.map_err(failed)?.file_name();
        let parts = name.to_str().and_then(|name| name.strip_suffix(".json")?.split_once('.'));
        let stage = parts.filter(|(_, number)| number.parse() == Ok(frame)).map(|(stage, _)| stage);
        out.extend(stage.map(String::from));
    }
    Ok(out)
}

/// Adds the numbers in a value, by their paths.
fn collect(path: &str, value: &Value, out: &mut BTreeMap<String, Number>) {
    match value {
        Value::Number(number) => _ = out.insert(path.to_string(), number.clone()),
        Value::Object(entries) => {
            entries.iter().for_each(|(key, value)| collect(&format!("{path}.{key}"), value, out));
        }
        Value::Array(items) => {
            items.iter().zip(1..).for_each(|(item, n)| collect(&format!("{path}[{n}]"), item, out));
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_their_paths() {
        let value =
            serde_json::json!({ "ml": 1.5, "name": "a", "contents": { "points": [3, 4] }, "on": true });
        let mut out = BTreeMap::new();
        collect("liquid", &value, &mut out);
        let out: Vec<String> = out.iter().map(|(key, number)| format!("{key} {number}")).collect();
        assert_eq!(out, ["liquid.contents.points[1] 3", "liquid.contents.points[2] 4", "liquid.ml 1.5"]);
    }
}
