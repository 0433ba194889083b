//! Values in .usda files.

/// The numbers of an attribute in a file of one frame.
#[track_caller]
pub fn numbers(text: &str, attribute: &str) -> Vec<f32> {
    let start = text.find(&format!(" {attribute}.timeSamples = {{"));
    let start = start.unwrap_or_else(|| panic!("no {attribute}"));
    let line = text[start..].lines().next().unwrap().split_once(": ").unwrap().1;
    let words = line.split(|c: char| "[](), }".contains(c)).filter(|word| !word.is_empty());
    words.map(|word| word.parse().unwrap()).collect()
}
