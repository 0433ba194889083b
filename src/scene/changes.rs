//! What two scenes differ in.

use std::collections::{BTreeMap, BTreeSet};

use toml::Value;

/// Former values longer than this are not told.
const LONG: usize = 80;

/// The keys whose values differ between two resolved scenes, each with the former value; a file that is no
/// scene differs as a whole.
pub(super) fn changed_keys(before: &str, after: &str) -> Vec<String> {
    let [Some(before), Some(after)] = [before, after].map(flattened) else {
        return vec!["its scene.toml cannot be read".into()];
    };
    let keys: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let differs = |key: &&&String| before.get(**key) != after.get(**key);
    let told = |key: &String| match before.get(key) {
        Some(value) if value.len() > LONG => key.clone(),
        Some(value) => format!("{key} was {value}"),
        None => format!("{key} was not there"),
    };
    keys.iter().filter(differs).map(|key| told(key)).collect()
}

/// Values by key: `snow.noise.size`, `object[1].file`.
fn flattened(text: &str) -> Option<BTreeMap<String, String>> {
    let mut out = BTreeMap::new();
    for (key, value) in text.parse::<toml::Table>().ok()? {
        flatten(key, &value, &mut out);
    }
    Some(out)
}

fn flatten(key: String, value: &Value, out: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) => {
            table.iter().for_each(|(name, value)| flatten(format!("{key}.{name}"), value, out))
        }
        Value::Array(items) if key == "object" => {
            items
                .iter()
                .enumerate()
                .for_each(|(index, item)| flatten(format!("{key}[{}]", index + 1), item, out));
        }
        value => {
            out.insert(key, value.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named_with_the_former_value() {
        let before = "[snow]\ndepth = 0.3\ncell = 0.1\n[[object]]\nfile = \"a\"\n[[object]]\nfile = \"b\"\n";
        assert_eq!(changed_keys(before, before), Vec::<String>::new());
        let after = "# Other words.\n[snow]\ndepth = 0.2\ncell = 0.1\n[[object]]\nfile = \"a\"\n";
        assert_eq!(changed_keys(before, after), ["object[2].file was \"b\"", "snow.depth was 0.3"]);
        assert_eq!(changed_keys("[snow", after).len(), 1);
    }
}
