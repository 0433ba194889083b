//! Documentation of keys: a starter scene, and a table in Markdown.

use super::declaration::{Fallback, Key, Kind, heading, is_table_array};
use super::shared_keys::{self, tables};
use super::toml_table::with_value;
use super::values::any_of;
use std::fmt::Write;

/// A commented starter scene, for a system with this title and name.
pub fn template_of([title, name]: [&str; 2], keys: &[Key]) -> String {
    let mut out = format!(
        "# {}: `frazil check shot.toml`, then `frazil {} shot.toml -o cache/`.\n\
         # SI units, Y up, degrees where a key ends in _deg; paths are relative to this file.\n\
         # Lines that begin with # show defaults, or examples; uncomment them to change a value.\n",
        title, name,
    );
    for table in tables(keys) {
        let keys_of = || keys.iter().filter(|key| key.table == table);
        let is_shown = keys_of().any(|key| key.example.is_shown);
        let note = match table {
            _ if is_table_array(table) => "  # any number of them",
            _ if shared_keys::OPTIONAL_TABLES.contains(&table) => "  # none without this line",
            _ => "",
        };
        let _ = writeln!(out, "\n{}{}{note}", if is_shown { "" } else { "# " }, heading(table));
        keys_of().for_each(|key| out.push_str(&example(key, keys)));
    }
    out
}

/// A key's line in a starter scene.
fn example(key: &Key, keys: &[Key]) -> String {
    let mark = if key.example.is_shown { "" } else { "# " };
    let value = key.example.value.map_or_else(|| default_value(key, keys), str::to_string);
    let characters = if key.of_characters { "of a .glb: " } else { "" };
    let (first, rest) =
        value.split_once('\n').map_or((&value[..], None), |(first, rest)| (first, Some(rest)));
    let meaning = format!("{characters}{}{}", key.meaning, default_in_cells(key));
    let rest = rest.map_or(String::new(), |rest| format!("{rest}\n"));
    line(&format!("{mark}{} = {first}", key.name), &meaning) + &rest
}

/// The default, with the cell size of the starter scene.
fn default_value(key: &Key, keys: &[Key]) -> String {
    let cell = || {
        let value = keys.iter().find(|key| key.table == "snow" && key.name == "cell")?.example.value?;
        with_value("cell", value, |table| table.number("cell")).ok()?
    };
    match key.fallback {
        Fallback::Is(value) => value.to_string(),
        Fallback::Cells(cells) => cell().map_or(String::new(), |cell| format!("{:?}", rounded(cells * cell))),
        Fallback::Required | Fallback::Nothing => String::new(),
    }
}

fn default_in_cells(key: &Key) -> String {
    match key.fallback {
        Fallback::Cells(cells) => format!("; default {} cells", rounded(cells)),
        _ => String::new(),
    }
}

/// A table of keys in Markdown.
pub fn reference_of(keys: &[Key]) -> String {
    let mut out = String::new();
    for table in tables(keys) {
        let many = if is_table_array(table) { ", any number of them" } else { "" };
        let _ = write!(out, "\n`{}`{many}\n\n", heading(table));
        out.push_str("| key | holds | default | meaning |\n|---|---|---|---|\n");
        for key in keys.iter().filter(|key| key.table == table) {
            let default = match key.fallback {
                Fallback::Required => "required".to_string(),
                Fallback::Nothing => String::new(),
                Fallback::Is(value) => format!("`{value}`"),
                Fallback::Cells(cells) => format!("{} cells", rounded(cells)),
            };
            let presets = key.presets.iter().map(|(name, value)| format!("; {name} `{value}`"));
            let default = default + &presets.collect::<String>();
            let _ = writeln!(out, "| `{}` | {} | {default} | {} |", key.name, allowed(key), key.meaning);
        }
    }
    out.trim_start().to_string()
}

/// All keys with what they may hold, for programs that build an interface from them: an array of objects that all have the same fields.
pub fn keys_json_of(keys: &[Key]) -> serde_json::Value {
    let one = |key: &Key| {
        let holds = Holds::of(key.kind);
        let default = match key.fallback {
            Fallback::Is(value) => as_json(value),
            Fallback::Required | Fallback::Nothing | Fallback::Cells(_) => serde_json::Value::Null,
        };
        let cells = if let Fallback::Cells(cells) = key.fallback { Some(rounded(cells)) } else { None };
        let presets = key.presets.iter().map(|(name, value)| ((*name).to_string(), as_json(value)));
        serde_json::json!({
            "table": key.table,
            "is_table_array": is_table_array(key.table),
            "is_optional_table": shared_keys::OPTIONAL_TABLES.contains(&key.table),
            "name": key.name,
            "kind": holds.kind,
            "choices": holds.choices,
            "min": holds.range.map(|(low, _)| low),
            "max": holds.range.map(|(_, high)| high),
            "count": holds.count,
            "unit": holds.unit,
            "extensions": holds.extensions,
            "default": default,
            "default_cells": cells,
            "is_required": key.fallback == Fallback::Required,
            "presets": presets.collect::<serde_json::Map<_, _>>(),
            "of_characters": key.of_characters,
            "meaning": key.meaning,
        })
    };
    keys.iter().map(one).collect()
}

/// What a kind of key holds, field by field.
#[derive(Default)]
struct Holds {
    kind: &'static str,
    choices: Option<&'static [&'static str]>,
    range: Option<(f64, f64)>,
    count: Option<usize>,
    unit: &'static str,
    extensions: Option<&'static [&'static str]>,
}

impl Holds {
    fn of(kind: Kind) -> Self {
        let of = |kind| Self { kind, ..Self::default() };
        let numbers = |limit: f64| Some((-limit, limit));
        match kind {
            Kind::Frames => of("frames"),
            Kind::Flag => of("flag"),
            Kind::Text => of("text"),
            Kind::Choice(choices) => Self { choices: Some(choices), ..of("choice") },
            Kind::Choices(choices) => Self { choices: Some(choices), ..of("choices") },
            Kind::Number(low, high, unit) => Self { range: Some((low, high)), unit, ..of("number") },
            Kind::Cells(low, high) => Self { range: Some((low, high)), unit: "m", ..of("cells") },
            Kind::Whole(low, high) => Self { range: Some((low as f64, high as f64)), ..of("whole") },
            Kind::Numbers(count, limit, unit) => {
                Self { count: Some(count), range: numbers(limit), unit, ..of("numbers") }
            }
            Kind::File(extensions) => Self { extensions: Some(extensions), ..of("file") },
            Kind::HeightOrFile(limit, extensions) => Self {
                range: numbers(limit),
                unit: "m",
                extensions: Some(extensions),
                ..of("height_or_file")
            },
            Kind::NumbersOrFile(count, limit, unit, extensions) => Self {
                count: Some(count),
                range: numbers(limit),
                unit,
                extensions: Some(extensions),
                ..of("numbers_or_file")
            },
            Kind::Named(limit) => Self { range: numbers(limit), ..of("named") },
            Kind::Poses(limit) => Self { range: numbers(limit), unit: "m", ..of("poses") },
        }
    }
}

/// A declared value as JSON; null if it is not valid TOML, which a test excludes.
fn as_json(value: &str) -> serde_json::Value {
    let table: Option<toml::Table> = format!("value = {value}").parse().ok();
    table.and_then(|table| serde_json::to_value(table.get("value")?).ok()).unwrap_or_default()
}

/// The values that a key may have, with range and unit.
fn allowed(key: &Key) -> String {
    let texts = |texts: &[&str], or: &str| {
        texts.iter().map(|text| format!("`\"{text}\"`")).collect::<Vec<_>>().join(or)
    };
    let of_unit = |unit: &str| if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let values = match key.kind {
        Kind::Frames => "`\"A-B\"`".to_string(),
        Kind::Flag => "`true` or `false`".to_string(),
        Kind::Text => "a text".to_string(),
        Kind::Choice(choices) => texts(choices, " or "),
        Kind::Choices(choices) => format!("list of {}", texts(choices, ", ")),
        Kind::Number(low, high, unit) => format!("{} to {}{}", short(low), short(high), of_unit(unit)),
        Kind::Cells(low, high) => format!("m, {low} to {high} cells"),
        Kind::Whole(low, high) => format!("whole, {low} to {high}"),
        Kind::Numbers(count, limit, unit) => {
            format!("{count} numbers, each -{0} to {0}{1}", short(limit), of_unit(unit))
        }
        Kind::File(extensions) => any_of(extensions),
        Kind::HeightOrFile(limit, extensions) => {
            format!("-{0} to {0} m, or {1}", short(limit), any_of(extensions))
        }
        Kind::NumbersOrFile(count, limit, unit, extensions) => {
            let numbers = format!("{count} numbers, each -{0} to {0}{1}", short(limit), of_unit(unit));
            format!("{numbers}, or {}", any_of(extensions))
        }
        Kind::Named(limit) => format!("table of numbers by names, each -{0} to {0}", short(limit)),
        Kind::Poses(_) => "list of `{ frame, at, turn_deg }`".to_string(),
    };
    if key.of_characters { format!("{values}; .glb and .gltf") } else { values }
}

/// A bound of a range, without long rows of zeros.
fn short(bound: f64) -> String {
    let size = bound.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) { format!("{bound:e}") } else { bound.to_string() }
}

/// A number rounded to five digits.
pub(in crate::scene) fn rounded(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(number)
}

/// An assignment followed by its meaning as a comment.
pub(in crate::scene) fn line(assignment: &str, meaning: &str) -> String {
    format!("{assignment:<32} # {meaning}\n")
}
