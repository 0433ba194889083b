//! Tables of a TOML file, read key by key, so that every error names the file, the line and the key.
//!
//! serde's own errors name neither the table nor the nearest key, and do not help with a key that may be a number or a text.

use super::overrides::Override;
use crate::error::{Error, Result};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text of a scene file and its name, for messages.
pub struct Document<'a> {
    pub path: &'a Path,
    pub text: &'a str,
    /// The absolute folder that relative paths start from.
    pub folder: PathBuf,
    /// Settings of the command line; each has an offset beyond the end of the text: [`Document::offset_of_override`].
    pub overrides: &'a [Override],
}

impl Document<'_> {
    /// An error at a byte offset of the text: `shot.toml:12: ...`.
    pub fn error(&self, offset: usize, what: impl std::fmt::Display) -> Error {
        if let Some(setting) = self.override_at(offset) {
            return Error::argument(format!("{}: --set {}: {what}", self.path.display(), setting));
        }
        let line = 1 + self.text.bytes().take(offset).filter(|&byte| byte == b'\n').count();
        Error::argument(format!("{}:{line}: {what}", self.path.display()))
    }

    /// The offset that stands for a setting of the command line.
    pub fn offset_of_override(&self, index: usize) -> usize {
        self.text.len() + 1 + index
    }

    fn override_at(&self, offset: usize) -> Option<&Override> {
        self.overrides.get(offset.checked_sub(self.text.len() + 1)?)
    }

    /// The absolute path of a file named at an offset: relative to the scene's folder or, if it comes from the
    /// command line, to the current one.
    fn path_at(&self, offset: usize, name: &str) -> PathBuf {
        match self.override_at(offset) {
            Some(_) => std::path::absolute(name).unwrap_or_else(|_| name.into()),
            None => self.folder.join(name),
        }
    }
}

/// One table: `[shot]`, an `[[object]]`, or the file itself.
pub struct Table<'a, 'i> {
    document: &'a Document<'a>,
    /// As written in the file: `[shot]`; empty for the file itself.
    name: String,
    /// `None` if the table is missing.
    entries: Option<&'a DeTable<'i>>,
    offset: usize,
}

impl<'a, 'i> Table<'a, 'i> {
    /// Opens a table and refuses keys that are not in `known`.
    pub fn open(
        document: &'a Document<'a>,
        name: &str,
        entries: &'a DeTable<'i>,
        offset: usize,
        known: &[&str],
    ) -> Result<Self> {
        let table = Self { document, name: name.to_string(), entries: Some(entries), offset };
        let unknown = entries.keys().filter(|key| !known.contains(&&**key.get_ref()));
        let Some(key) = unknown.min_by_key(|key| key.span().start) else { return Ok(table) };
        let hint = match nearest(key.get_ref(), known) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("the keys are {}", listed(known)),
        };
        Err(document
            .error(key.span().start, format!("unknown key `{}`{}; {hint}", key.get_ref(), table.in_name())))
    }

    /// A missing table: it has no keys.
    pub fn absent(document: &'a Document<'a>, name: &str) -> Self {
        Self { document, name: name.to_string(), entries: None, offset: 0 }
    }

    fn entry(&self, key: &str) -> Option<&'a Spanned<DeValue<'i>>> {
        self.entries?.get(key)
    }

    /// Whether the key is present.
    pub fn has(&self, key: &str) -> bool {
        self.entry(key).is_some()
    }

    /// " in [shot]"; empty for the file itself.
    fn in_name(&self) -> String {
        if self.name.is_empty() { String::new() } else { format!(" in {}", self.name) }
    }

    /// An error about a key's value, at its line; at the table's own line if the key is missing.
    pub fn error(&self, key: &str, what: impl std::fmt::Display) -> Error {
        self.document.error(self.offset_of(key), format!("`{key}`{} {what}", self.in_name()))
    }

    /// The offset of a key's value; the table's own if the key is missing.
    fn offset_of(&self, key: &str) -> usize {
        self.entry(key).map_or(self.offset, |value| value.span().start)
    }

    fn wrong_type(&self, key: &str, wanted: &str, found: &DeValue) -> Error {
        self.error(key, format!("must be {wanted}, not {}", kind_of(found)))
    }

    /// A value, read by a function that returns `None` for other types.
    fn typed<T>(
        &self,
        key: &str,
        wanted: &str,
        read: impl FnOnce(&'a DeValue<'i>) -> Option<T>,
    ) -> Result<Option<T>> {
        let Some(value) = self.entry(key).map(Spanned::get_ref) else { return Ok(None) };
        read(value).map(Some).ok_or_else(|| self.wrong_type(key, wanted, value))
    }

    /// A text.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>> {
        self.typed(key, "a text", DeValue::as_str)
    }

    /// The absolute path of a file.
    pub fn path(&self, key: &str) -> Result<Option<PathBuf>> {
        Ok(self.text(key)?.map(|name| self.document.path_at(self.offset_of(key), name)))
    }

    /// A finite number, written with or without a decimal point.
    pub fn number(&self, key: &str) -> Result<Option<f64>> {
        self.typed(key, "a finite number", number_of)
    }

    /// A number inside a range that the message names.
    pub fn number_in(
        &self,
        key: &str,
        range: std::ops::RangeInclusive<f64>,
        unit: &str,
    ) -> Result<Option<f64>> {
        let Some(number) = self.number(key)? else { return Ok(None) };
        if range.contains(&number) {
            return Ok(Some(number));
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let wanted = format!("must lie in {} to {}{unit}, not {number}", range.start(), range.end());
        Err(self.error(key, wanted))
    }

    /// A whole number inside a range that the message names.
    pub fn integer_in(&self, key: &str, range: std::ops::RangeInclusive<i64>) -> Result<Option<i64>> {
        let Some(written) = self.typed(key, "a whole number", DeValue::as_integer)? else { return Ok(None) };
        match i64::from_str_radix(written.as_str(), written.radix()) {
            Ok(number) if range.contains(&number) => Ok(Some(number)),
            _ => {
                let wanted = format!("must lie in {} to {}, not {written}", range.start(), range.end());
                Err(self.error(key, wanted))
            }
        }
    }

    /// `true` or `false`.
    pub fn flag(&self, key: &str) -> Result<Option<bool>> {
        self.typed(key, "true or false", DeValue::as_bool)
    }

    /// One of a few texts.
    pub fn choice(&self, key: &str, choices: &[&'static str]) -> Result<Option<&'static str>> {
        self.text(key)?.map(|text| self.chosen(key, text, choices)).transpose()
    }

    /// A list of texts from a fixed set.
    pub fn choices(&self, key: &str, choices: &[&'static str]) -> Result<Option<Vec<&'static str>>> {
        const WANTED: &str = "a list of texts";
        let Some(values) = self.typed(key, WANTED, DeValue::as_array)? else { return Ok(None) };
        let read = |value: &Spanned<DeValue>| match value.get_ref() {
            DeValue::String(text) => self.chosen(key, text, choices),
            other => Err(self.wrong_type(key, WANTED, other)),
        };
        values.iter().map(read).collect::<Result<Vec<_>>>().map(Some)
    }

    fn chosen(&self, key: &str, text: &str, choices: &[&'static str]) -> Result<&'static str> {
        choices.iter().find(|choice| **choice == text).copied().ok_or_else(|| {
            let hint = nearest(text, choices).map(|near| format!("; did you mean \"{near}\"?"));
            let names: Vec<String> = choices.iter().map(|name| format!("\"{name}\"")).collect();
            let (names, hint) = (names.join(" or "), hint.unwrap_or_default());
            self.error(key, format!("must be {names}, not \"{text}\"{hint}"))
        })
    }

    /// Finite numbers by names.
    pub fn named_numbers(&self, key: &str) -> Result<Option<BTreeMap<String, f64>>> {
        let Some(entries) = self.typed(key, "a table of numbers", DeValue::as_table)? else {
            return Ok(None);
        };
        let read = |(name, value): (&Spanned<Cow<'i, str>>, &Spanned<DeValue<'i>>)| {
            let (name, value) = (name.get_ref(), value.get_ref());
            number_of(value).map(|number| (name.to_string(), number)).ok_or_else(|| {
                self.error(key, format!("must hold finite numbers, not {}, `{name}`", kind_of(value)))
            })
        };
        entries.iter().map(read).collect::<Result<_>>().map(Some)
    }

    /// A list of `count` finite numbers.
    pub fn numbers(&self, key: &str, count: usize) -> Result<Option<Vec<f64>>> {
        let Some(value) = self.entry(key).map(Spanned::get_ref) else { return Ok(None) };
        let values = value.as_array();
        let numbers = values.and_then(|values| {
            values.iter().map(|value| number_of(value.get_ref())).collect::<Option<Vec<f64>>>()
        });
        numbers.filter(|numbers| numbers.len() == count).map(Some).ok_or_else(|| {
            let found = match values {
                Some(values) if values.len() != count => format!("a list of {}", values.len()),
                Some(_) => "a list with something else in it".to_string(),
                None => kind_of(value).to_string(),
            };
            self.error(key, format!("must be a list of {count} finite numbers, not {found}"))
        })
    }

    /// A table inside this one.
    pub fn table(&self, key: &str, name: &str, known: &[&str]) -> Result<Option<Table<'a, 'i>>> {
        let Some(entries) = self.typed(key, "a table", DeValue::as_table)? else { return Ok(None) };
        Table::open(self.document, name, entries, self.offset_of(key), known).map(Some)
    }

    /// A list of tables inside this one.
    pub fn tables(&self, key: &str, name: &str, known: &[&str]) -> Result<Vec<Table<'a, 'i>>> {
        const WANTED: &str = "a list of tables";
        let open = |value: &'a Spanned<DeValue<'i>>| match value.get_ref() {
            DeValue::Table(entries) => Table::open(self.document, name, entries, value.span().start, known),
            other => Err(self.wrong_type(key, WANTED, other)),
        };
        self.typed(key, WANTED, DeValue::as_array)?.into_iter().flatten().map(open).collect()
    }
}

/// Reads a value that is not in a file, such as a default; `read` gets a table with only this key.
pub fn with_value<T>(key: &str, value: &str, read: impl FnOnce(&Table) -> Result<T>) -> Result<T> {
    let text = format!("{key} = {value}");
    let document = Document { path: Path::new(key), text: &text, folder: PathBuf::new(), overrides: &[] };
    let entries = DeTable::parse(&text).map_err(|error| document.error(0, error.message()))?;
    read(&Table::open(&document, "", entries.get_ref(), 0, &[key])?)
}

fn number_of(value: &DeValue) -> Option<f64> {
    let number = match value {
        DeValue::Integer(written) => i64::from_str_radix(written.as_str(), written.radix()).ok()? as f64,
        DeValue::Float(written) => written.as_str().parse().ok()?,
        _ => return None,
    };
    number.is_finite().then_some(number)
}

fn kind_of(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// "`a`, `b` and `c`".
fn listed(names: &[&str]) -> String {
    joined(names.iter().map(|name| format!("`{name}`")).collect(), "and")
}

/// Words joined by commas, the last two by a word: "a, b or c".
pub fn joined(words: Vec<String>, last: &str) -> String {
    match words.split_last() {
        Some((end, rest)) if !rest.is_empty() => format!("{} {last} {end}", rest.join(", ")),
        _ => words.join(""),
    }
}

/// The known name closest to the typed one, if it is close enough to have been meant.
fn nearest<'n>(typed: &str, known: &[&'n str]) -> Option<&'n str> {
    let typed = typed.to_lowercase();
    let best = known.iter().map(|name| (edits(&typed, name), *name)).min()?;
    let longest = typed.chars().count().max(best.1.len());
    (2 * best.0 <= longest).then_some(best.1)
}

/// Insertions, deletions, replacements and swaps of neighbours that turn one word into the other (optimal string alignment distance).
fn edits(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![(0..=b.len()).collect::<Vec<usize>>()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut best = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            row.push(best);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_key_is_the_one_that_was_meant() {
        let keys = ["frames", "fps", "ground", "depth"];
        assert_eq!(nearest("framse", &keys), Some("frames"));
        assert_eq!(nearest("Frames", &keys), Some("frames"));
        assert_eq!(nearest("dept", &keys), Some("depth"));
        assert_eq!(nearest("wind", &keys), None);
        assert_eq!(edits("framse", "frames"), 1);
    }
}
