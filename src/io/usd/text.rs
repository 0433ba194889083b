//! A layer as text (.usda).

use std::fmt::{Display, Write};

use super::layer::{Attribute, Layer, Prim, Property, Specifier, Value};

/// Floats from this value on are written with an exponent: USD takes long numbers without one for integers.
const EXPONENT_FROM: f64 = 1e16;

/// The text of a layer.
pub(in crate::io) fn text(layer: &Layer) -> String {
    let mut out = String::from("#usda 1.0\n");
    metadata(&mut out, "", &layer.metadata, &[]);
    out.push('\n');
    for root in &layer.prims {
        out.push('\n');
        prim(&mut out, "", root);
    }
    out
}

/// A name that USD allows, made from any text: letters, digits, underscores.
pub fn prim_name(text: &str) -> String {
    let mut name: String =
        text.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '_' }).collect();
    if !name.starts_with(|letter: char| letter.is_ascii_alphabetic() || letter == '_') {
        name.insert(0, '_');
    }
    name
}

fn prim(out: &mut String, indent: &str, prim: &Prim) {
    let word = if prim.specifier == Specifier::Def { "def" } else { "over" };
    let class = if prim.class.is_empty() { String::new() } else { format!(" {}", prim.class) };
    let _ = write!(out, "{indent}{word}{class} \"{}\"", prim.name);
    if !prim.metadata.is_empty() || !prim.schemas.is_empty() {
        out.push(' ');
        metadata(out, indent, &prim.metadata, &prim.schemas);
    }
    let _ = write!(out, "\n{indent}{{\n");
    let inner = format!("{indent}    ");
    for property in &prim.properties {
        match property {
            Property::Attribute(one) => attribute(out, &inner, one),
            Property::Relationship(name, to) => _ = writeln!(out, "{inner}rel {name} = <{to}>"),
        }
    }
    for (at, child) in prim.children.iter().enumerate() {
        if at > 0 || !prim.properties.is_empty() {
            out.push('\n');
        }
        self::prim(out, &inner, child);
    }
    let _ = writeln!(out, "{indent}}}");
}

/// Metadata in parentheses.
fn metadata(out: &mut String, indent: &str, entries: &[(&'static str, Value)], schemas: &[&str]) {
    out.push_str("(\n");
    for (key, entry) in entries {
        let _ = write!(out, "{indent}    ");
        match (*key, entry) {
            // A comment has no key.
            ("comment", Value::Text(text)) => out.push_str(&quoted(text)),
            (key, Value::Dictionary(entries)) => {
                let _ = write!(out, "{key} = ");
                dictionary(out, &format!("{indent}    "), entries);
            }
            (key, entry) => {
                let _ = write!(out, "{key} = ");
                value(out, entry);
            }
        }
        out.push('\n');
    }
    if !schemas.is_empty() {
        let names: Vec<String> = schemas.iter().map(|name| quoted(name)).collect();
        let _ = writeln!(out, "{indent}    prepend apiSchemas = [{}]", names.join(", "));
    }
    let _ = write!(out, "{indent})");
}

fn dictionary(out: &mut String, indent: &str, entries: &std::collections::BTreeMap<&'static str, Value>) {
    out.push_str("{\n");
    for (key, entry) in entries {
        let class = match entry {
            Value::Dictionary(_) => "dictionary",
            Value::Asset(_) => "asset",
            Value::Assets(_) => "asset[]",
            Value::DoublePairs(_) => "double2[]",
            Value::Double(_) => "double",
            _ => "string",
        };
        let _ = write!(out, "{indent}    {class} {key} = ");
        match entry {
            Value::Dictionary(entries) => dictionary(out, &format!("{indent}    "), entries),
            other => value(out, other),
        }
        out.push('\n');
    }
    let _ = write!(out, "{indent}}}");
}

fn attribute(out: &mut String, indent: &str, attribute: &Attribute) {
    let Attribute { class, name, is_uniform, is_custom, value: at_all_times, samples, .. } = attribute;
    let custom = if *is_custom { "custom " } else { "" };
    let uniform = if *is_uniform { "uniform " } else { "" };
    let has_declaration = at_all_times.is_some() || attribute.interpolation.is_some();
    if has_declaration || (samples.is_empty() && attribute.connection.is_none()) {
        let _ = write!(out, "{indent}{custom}{uniform}{class} {name}");
        if let Some(at_all_times) = at_all_times {
            out.push_str(" = ");
            value(out, at_all_times);
        }
        if let Some(interpolation) = attribute.interpolation {
            let _ = write!(out, " (\n{indent}    interpolation = \"{interpolation}\"\n{indent})");
        }
        out.push('\n');
    }
    match &samples[..] {
        [] => {}
        [(frame, sample)] => {
            let _ = write!(out, "{indent}{class} {name}.timeSamples = {{ {frame}: ");
            value(out, sample);
            out.push_str(" }\n");
        }
        several => {
            let _ = writeln!(out, "{indent}{class} {name}.timeSamples = {{");
            for (frame, sample) in several {
                let _ = write!(out, "{indent}    {frame}: ");
                value(out, sample);
                out.push_str(",\n");
            }
            let _ = writeln!(out, "{indent}}}");
        }
    }
    if let Some(connection) = &attribute.connection {
        let _ = writeln!(out, "{indent}{custom}{class} {name}.connect = <{connection}>");
    }
}

fn value(out: &mut String, value: &Value) {
    match value {
        Value::Float(value) => float(out, *value),
        Value::Double(value) => double(out, *value),
        Value::Token(text) | Value::Text(text) => out.push_str(&quoted(text)),
        Value::Asset(path) => out.push_str(&asset(path)),
        Value::Vector(parts) => tuple(out, *parts, float),
        // As numbers, as USD itself writes them.
        Value::Bools(values) => list(out, values, |out, value| display(out, u8::from(*value))),
        Value::Ints(values) => list(out, values, |out, value| display(out, value)),
        Value::Uints(values) => list(out, values, |out, value| display(out, value)),
        Value::Longs(values) => list(out, values, |out, value| display(out, value)),
        Value::Floats(values) => list(out, values, |out, value| float(out, *value)),
        Value::Doubles(values) => list(out, values, |out, value| double(out, *value)),
        Value::Pairs(values) => list(out, values, |out, parts| tuple(out, *parts, float)),
        Value::DoublePairs(values) => list(out, values, |out, parts| tuple(out, *parts, double)),
        Value::Vectors(values) => list(out, values, |out, parts| tuple(out, *parts, float)),
        Value::DoubleVectors(values) => list(out, values, |out, parts| tuple(out, *parts, double)),
        Value::IntVectors(values) => list(out, values, |out, parts| tuple(out, *parts, display)),
        Value::Assets(paths) => list(out, paths, |out, path| out.push_str(&asset(path))),
        Value::Dictionary(entries) => dictionary(out, "", entries),
    }
}

fn list<T>(out: &mut String, items: &[T], write: impl Fn(&mut String, &T)) {
    out.push('[');
    for (index, item) in items.iter().enumerate() {
        if index > 0 {
            out.push_str(", ");
        }
        write(out, item);
    }
    out.push(']');
}

fn tuple<T, const N: usize>(out: &mut String, parts: [T; N], write: impl Fn(&mut String, T)) {
    for (index, part) in parts.into_iter().enumerate() {
        out.push_str(if index == 0 { "(" } else { ", " });
        write(out, part);
    }
    out.push(')');
}

fn display(out: &mut String, value: impl Display) {
    let _ = write!(out, "{value}");
}

fn float(out: &mut String, value: f32) {
    let _ = match value {
        // Only in lower case.
        _ if value.is_nan() => write!(out, "nan"),
        _ if f64::from(value).abs() >= EXPONENT_FROM => write!(out, "{value:e}"),
        _ => write!(out, "{value}"),
    };
}

fn double(out: &mut String, value: f64) {
    let _ = match value {
        _ if value.is_nan() => write!(out, "nan"),
        _ if value.abs() >= EXPONENT_FROM => write!(out, "{value:e}"),
        _ => write!(out, "{value}"),
    };
}

/// A quoted and escaped string.
fn quoted(text: &str) -> String {
    let escaped: String = text
        .chars()
        .flat_map(|letter| match letter {
            '"' | '\\' => vec!['\\', letter],
            '\n' => vec!['\\', 'n'],
            _ => vec![letter],
        })
        .collect();
    format!("\"{escaped}\"")
}

/// An asset path between `@` delimiters.
fn asset(path: &str) -> String {
    // Triple @ delimiters allow an @ inside.
    if path.contains('@') { format!("@@@{path}@@@") } else { format!("@{path}@") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_what_usd_allows() {
        assert_eq!(prim_name("hero.v02"), "hero_v02");
        assert_eq!(prim_name("2nd man"), "_2nd_man");
        assert_eq!(prim_name(""), "_");
        assert_eq!(quoted("a\"b\\"), "\"a\\\"b\\\\\"");
        assert_eq!(asset("a@b.vdb"), "@@@a@b.vdb@@@");
    }

    #[test]
    fn numbers_are_those_of_usd() {
        let written = |one: Value| {
            let mut out = String::new();
            value(&mut out, &one);
            out
        };
        let floats = vec![0.1, 2e20, f32::NAN, f32::NEG_INFINITY, 1.0];
        assert_eq!(written(Value::Floats(floats)), "[0.1, 2e20, nan, -inf, 1]");
        assert_eq!(written(Value::Doubles(vec![-1e300, 0.1])), "[-1e300, 0.1]");
        assert_eq!(written(Value::Uints(vec![u32::MAX])), "[4294967295]");
        assert_eq!(written(Value::IntVectors(vec![[1, -2, 3]])), "[(1, -2, 3)]");
    }
}
