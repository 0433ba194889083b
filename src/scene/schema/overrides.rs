//! Settings from the command line (`--set snow.noise.seed=2`) that override those of a scene file.

use std::path::Path;

use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

use crate::error::{Error, Result};

/// One setting: a dotted key and its value, `object.1.scale=0.01` for the first object.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    /// The parts of the key, at least one; none is empty.
    pub(super) key: Vec<String>,
    /// The value as it was typed.
    pub(super) value: String,
    text: String,
}

/// As it was typed.
impl std::fmt::Display for Override {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(&self.text)
    }
}

impl std::str::FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || format!("\"{text}\" is not a setting such as snow.noise.seed=2");
        let (key, value) = text.split_once('=').ok_or_else(wrong)?;
        let key: Vec<String> = key.split('.').map(|part| part.trim().to_string()).collect();
        if key.iter().any(String::is_empty) {
            return Err(wrong());
        }
        Ok(Self { key, value: value.trim().to_string(), text: text.to_string() })
    }
}

impl Override {
    /// Puts the value into a document; `offset` stands for the setting in errors.
    pub(in crate::scene) fn apply<'i>(
        &'i self,
        root: &mut DeTable<'i>,
        offset: usize,
        path: &Path,
    ) -> Result<()> {
        // A value that is not TOML is a text: names of files and choices need no quotes.
        let value = match DeValue::parse(&self.value) {
            Ok(value) => with_offset(value.into_inner(), offset),
            Err(_) => Spanned::new(offset..offset, DeValue::String(self.value.as_str().into())),
        };
        let refused =
            |what: String| Error::argument(format!("{}: --set {}: {what}", path.display(), self.text));
        let (last, parents) = self.key.split_last().expect("a setting has a key");
        let mut table = root;
        let mut parts = parents.iter();
        while let Some(part) = parts.next() {
            let name: std::borrow::Cow<'i, str> = part.as_str().into();
            let empty = || Spanned::new(offset..offset, DeValue::Table(DeTable::new()));
            let entry = table.entry(Spanned::new(offset..offset, name)).or_insert_with(empty);
            table = match entry.get_mut() {
                DeValue::Table(inner) => inner,
                DeValue::Array(items) => {
                    let number = parts.next().and_then(|number| number.parse::<usize>().ok());
                    let count = items.len();
                    let item = number.and_then(|number| items.get_mut(number.checked_sub(1)?));
                    match item.map(Spanned::get_mut) {
                        Some(DeValue::Table(inner)) => inner,
                        _ => return Err(refused(format!("`{part}` needs a number from 1 to {count}"))),
                    }
                }
                _ => return Err(refused(format!("`{part}` is not a table"))),
            };
        }
        table.insert(Spanned::new(offset..offset, last.as_str().into()), value);
        Ok(())
    }
}

/// A value, with this offset for all of its parts.
fn with_offset(value: DeValue<'_>, offset: usize) -> Spanned<DeValue<'_>> {
    let value = match value {
        DeValue::Table(table) => {
            let mut out = DeTable::new();
            for (key, value) in table {
                out.insert(
                    Spanned::new(offset..offset, key.into_inner()),
                    with_offset(value.into_inner(), offset),
                );
            }
            DeValue::Table(out)
        }
        DeValue::Array(items) => {
            let mut out = DeArray::new();
            items.into_iter().for_each(|item| out.push(with_offset(item.into_inner(), offset)));
            DeValue::Array(out)
        }
        other => other,
    };
    Spanned::new(offset..offset, value)
}
