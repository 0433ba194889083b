//! USD files of one frame, as text.

use std::fs::File;
use std::path::Path;

use openusd::usda::TextWriter;
use openusd::usdc::CrateData;

/// The text of a file, which may be a binary one.
#[track_caller]
pub fn text(path: &Path) -> String {
    if path.extension().is_some_and(|extension| extension == "usda") {
        return std::fs::read_to_string(path).unwrap();
    }
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    TextWriter::write_to_string(&CrateData::open(file, true).unwrap()).unwrap()
}

/// The numbers of an attribute in the text of a file of one frame.
#[track_caller]
pub fn numbers(text: &str, attribute: &str) -> Vec<f32> {
    let start = text.find(&format!(" {attribute}.timeSamples = {{"));
    let start = start.unwrap_or_else(|| panic!("no {attribute}"));
    let value = text[start..].split_once(": ").unwrap().1;
    let value = &value[..=value.find(']').unwrap()];
    let words = value.split(|c: char| "[](), ".contains(c)).filter(|word| !word.is_empty());
    words.map(|word| word.parse().unwrap()).collect()
}

/// Names of the attributes that have values at the frame, with their types: `point3f[] points`.
pub fn sampled(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| Some(line.split_once(".timeSamples")?.0.trim())).collect()
}
