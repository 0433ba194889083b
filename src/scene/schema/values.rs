//! The values of a scene: read as their keys are declared, with defaults filled in.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};

use super::declaration::{Fallback, Key, Kind};
use super::toml_table::{Table, joined, with_value};
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::io::mesh::extension;
use crate::io::particles;
use crate::motion::{Space, Up, is_gltf};
use crate::scene::{Frames, KeyPose, Role};

/// The value of a scene's key. As text, it is TOML in one line.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// First and last frame.
    Frames(#[serde(serialize_with = "as_range")] Frames),
    /// `true` or `false`.
    Flag(bool),
    /// A text, or one of a fixed set.
    Text(String),
    /// Some of a fixed set of texts, in the order of the key's declaration.
    Choices(Vec<&'static str>),
    /// A number, in the key's unit.
    Number(f64),
    /// A whole number.
    Whole(i64),
    /// As many numbers as the key declares.
    Numbers(Vec<f64>),
    /// Numbers by names.
    Named(BTreeMap<String, f64>),
    /// The absolute path of a file.
    File(#[serde(serialize_with = "as_text")] PathBuf),
    /// Rigid poses, by ascending frames.
    Poses(Vec<KeyPose>),
}

/// The values of a scene's keys. A key without a value has no entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    keys: &'static [Key],
    /// By the table's index, if it is an element of an array, and the key's index in `keys`.
    values: BTreeMap<(Option<usize>, usize), Value>,
}

/// A type that a key's value can be read as.
pub trait FromValue: Sized {
    /// `None` for a value of another type.
    fn of(value: &Value) -> Option<Self>;
}

/// Implements [`FromValue`]: for each type the variant of [`Value`], and the conversion.
macro_rules! from_value {
    ($($type:ty: $value:pat => $read:expr;)*) => {
        $(impl FromValue for $type {
            fn of(value: &Value) -> Option<Self> {
                if let $value = value { $read } else { None }
            }
        })*
    };
}

from_value! {
    f64: Value::Number(number) => Some(*number);
    i64: Value::Whole(whole) => Some(*whole);
    i32: Value::Whole(whole) => Some(*whole as i32);
    u32: Value::Whole(whole) => Some(*whole as u32);
    u64: Value::Whole(whole) => Some(*whole as u64);
    usize: Value::Whole(whole) => Some(*whole as usize);
    bool: Value::Flag(flag) => Some(*flag);
    String: Value::Text(text) => Some(text.clone());
    PathBuf: Value::File(path) => Some(path.clone());
    DVec3: Value::Numbers(numbers) => numbers[..].try_into().ok().map(|xyz: [f64; 3]| xyz.into());
    Up: Value::Text(up) => Some(if up == "z" { Up::Z } else { Up::Y });
    Role: Value::Text(text) => Role::ALL.into_iter().find(|role| role.name() == text);
    Frames: Value::Frames(frames) => Some(*frames);
    Vec<KeyPose>: Value::Poses(poses) => Some(poses.clone());
}

impl<const N: usize> FromValue for [f64; N] {
    fn of(value: &Value) -> Option<Self> {
        if let Value::Numbers(numbers) = value { numbers[..].try_into().ok() } else { None }
    }
}

/// The values of a table, or of an element of an array of tables.
#[derive(Debug, Clone, Copy)]
pub struct TableValues<'v> {
    values: &'v Values,
    table: &'v str,
    index: Option<usize>,
}

impl<'v> TableValues<'v> {
    /// A value.
    pub fn value(&self, name: &str) -> Option<&'v Value> {
        self.values.find(self.index, self.table, name)
    }

    /// The value of a key that is required or has a default; if the scene leaves the table out, the declared default.
    ///
    /// # Panics
    /// A key that is not declared, has no default or has another type: a programming error, whatever the scene.
    pub fn get<T: FromValue>(&self, name: &str) -> T {
        let value = self.value(name).cloned().or_else(|| self.values.declared_default(self.table, name));
        let value = value.as_ref().and_then(T::of);
        value.unwrap_or_else(|| panic!("{}.{name} has no default of this type", self.table))
    }

    /// The value of an optional key; `None` also if it has another type.
    pub fn find<T: FromValue>(&self, name: &str) -> Option<T> {
        T::of(self.value(name)?)
    }

    /// A text.
    pub fn text(&self, name: &str) -> Option<&'v str> {
        self.value(name)?.text()
    }

    /// Whether a list contains a text.
    pub fn holds(&self, name: &str, text: &str) -> bool {
        self.value(name).is_some_and(|value| value.holds(text))
    }

    /// The unit, axis and origin of the table's files.
    pub fn space(&self) -> Space {
        Space { scale: self.get("scale"), up: self.get("up"), origin: self.get("origin") }
    }
}

/// A key's path in settings: `snow.noise.size`, `object[1].scale`; `index` counts from 0.
pub fn key_path(key: &Key, index: Option<usize>) -> String {
    match index {
        None => format!("{}.{}", key.table, key.name),
        Some(index) => format!("{}[{}].{}", key.table, index + 1, key.name),
    }
}

impl Values {
    /// No values yet, for these keys.
    pub(in crate::scene) fn new(keys: &'static [Key]) -> Self {
        Self { keys, values: BTreeMap::new() }
    }

    /// The declared keys.
    pub(in crate::scene) fn keys(&self) -> &'static [Key] {
        self.keys
    }

    /// Reads the keys of a table and fills in defaults, even if the table is missing; `index` is its index in an array of tables.
    ///
    /// # Errors
    /// A key that is missing, a wrong type or a value out of range, with file and line.
    pub(in crate::scene) fn read(&mut self, name: &str, index: Option<usize>, table: &Table) -> Result<()> {
        for (position, key) in self.keys.iter().enumerate().filter(|(_, key)| key.table == name) {
            let allowed = !key.of_characters || self.path_of(index, name, "file").is_some_and(is_gltf);
            if !allowed && table.has(key.name) {
                return Err(table.error(key.name, "is for .glb and .gltf files: leave it out"));
            }
            let cell = self.number("snow.cell");
            let value = match read(key, table, cell)? {
                Some(value) => Some(value),
                None if allowed => default(key, self.preset(key), table, cell)?,
                None => None,
            };
            if let Some(value) = value {
                self.values.insert((index, position), value);
            }
        }
        Ok(())
    }

    /// A key's value in the preset that its table names.
    fn preset(&self, key: &Key) -> Option<&'static str> {
        let chosen =
            ["preset", "liquid"].into_iter().find_map(|name| self.find(None, key.table, name))?.text()?;
        key.presets.iter().find(|(name, _)| *name == chosen).map(|(_, value)| *value)
    }

    /// Every value with its key and its table's index in an array of tables: single tables first, then index by index, each in the order
    /// of the keys.
    pub(in crate::scene) fn iter(&self) -> impl Iterator<Item = (&'static Key, Option<usize>, &Value)> {
        self.values.iter().map(|((index, position), value)| (&self.keys[*position], *index, value))
    }

    fn find(&self, index: Option<usize>, table: &str, name: &str) -> Option<&Value> {
        let position = self.keys.iter().position(|key| key.table == table && key.name == name)?;
        self.values.get(&(index, position))
    }

    /// A value by its key: `snow.cell`.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let (table, name) = key.rsplit_once('.')?;
        self.find(None, table, name)
    }

    /// The values of a single table.
    pub fn table<'v>(&'v self, table: &'v str) -> TableValues<'v> {
        TableValues { values: self, table, index: None }
    }

    /// The values of an element of an array of tables, counted from 0.
    pub fn element<'v>(&'v self, table: &'v str, index: usize) -> TableValues<'v> {
        TableValues { values: self, table, index: Some(index) }
    }

    /// A key's default, by its table's preset or else its declaration.
    pub(in crate::scene) fn declared_default(&self, table: &str, name: &str) -> Option<Value> {
        let key = self.keys.iter().find(|key| key.table == table && key.name == name)?;
        match self.preset(key).map_or(key.fallback, Fallback::Is) {
            Fallback::Is(text) => with_value(key.name, text, |table| read(key, table, None)).ok()?,
            _ => None,
        }
    }

    /// Number of elements of an array of tables.
    pub fn count(&self, table: &str) -> usize {
        let indices = self.iter().filter(|(key, _, _)| key.table == table).filter_map(|(_, index, _)| index);
        indices.max().map_or(0, |last| last + 1)
    }

    /// A number by its key.
    pub fn number(&self, key: &str) -> Option<f64> {
        f64::of(self.get(key)?)
    }

    fn path_of(&self, index: Option<usize>, table: &str, name: &str) -> Option<&Path> {
        self.find(index, table, name)?.path()
    }

    /// Replaces a number.
    pub(in crate::scene) fn set_number(&mut self, key: &str, number: f64) {
        let position = self.keys.iter().position(|declared| key_path(declared, None) == key);
        let value = position.and_then(|position| self.values.get_mut(&(None, position)));
        if let Some(value) = value {
            *value = Value::Number(number);
        }
    }

    /// All values by their paths in settings: `object[1].scale`.
    pub fn by_path(&self) -> BTreeMap<String, Value> {
        self.iter().map(|(key, index, value)| (key_path(key, index), value.clone())).collect()
    }

    /// The path of every file that the scene names.
    pub(in crate::scene) fn paths_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.values.values_mut().filter_map(|value| match value {
            Value::File(path) => Some(path),
            _ => None,
        })
    }
}

impl Value {
    /// As numbers by names.
    pub fn named(&self) -> Option<&BTreeMap<String, f64>> {
        if let Self::Named(numbers) = self { Some(numbers) } else { None }
    }

    /// As a text.
    pub fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    /// As a file's path.
    pub fn path(&self) -> Option<&Path> {
        if let Self::File(path) = self { Some(path) } else { None }
    }

    /// Whether a list contains a text.
    pub fn holds(&self, text: &str) -> bool {
        matches!(self, Self::Choices(texts) if texts.contains(&text))
    }
}

fn as_range<S: Serializer>(frames: &Frames, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.collect_str(frames)
}

fn as_text<S: Serializer>(path: &Path, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.collect_str(&path.display())
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frames(frames) => f.write_str(&quoted(&frames.to_string())),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Text(text) => f.write_str(&quoted(text)),
            Self::Choices(texts) => write!(f, "{texts:?}"),
            // The shortest text that reads back as the same number.
            Self::Number(number) => write!(f, "{number:?}"),
            Self::Whole(number) => write!(f, "{number}"),
            Self::Numbers(numbers) => write!(f, "{numbers:?}"),
            Self::Named(numbers) if numbers.is_empty() => f.write_str("{}"),
            Self::Named(numbers) => {
                let numbers: Vec<String> =
                    numbers.iter().map(|(name, number)| format!("{} = {number:?}", toml_key(name))).collect();
                write!(f, "{{ {} }}", numbers.join(", "))
            }
            Self::File(path) => f.write_str(&quoted(&path.to_string_lossy())),
            Self::Poses(poses) => {
                let poses: Vec<String> = poses.iter().map(pose_toml).collect();
                write!(f, "[{}]", poses.join(", "))
            }
        }
    }
}

/// A pose in TOML.
pub fn pose_toml(pose: &KeyPose) -> String {
    let KeyPose { frame, at, turn_deg } = pose;
    format!("{{ frame = {frame:?}, at = {at:?}, turn_deg = {turn_deg:?} }}")
}

/// A name as a TOML key.
fn toml_key(name: &str) -> String {
    let is_bare = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    if !name.is_empty() && name.bytes().all(is_bare) { name.to_string() } else { quoted(name) }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// Reads a key; `None` if it is left out. `cell` is the edge of a cell (m), which [`Kind::Cells`] needs.
fn read(key: &Key, table: &Table, cell: Option<f64>) -> Result<Option<Value>> {
    let name = key.name;
    Ok(match key.kind {
        Kind::Frames => {
            let frames = table.text(name)?.map(str::parse).transpose();
            frames.map_err(|what| table.error(name, format!("is wrong: {what}")))?.map(Value::Frames)
        }
        Kind::Flag => table.flag(name)?.map(Value::Flag),
        Kind::Text => table.text(name)?.map(|text| Value::Text(text.to_string())),
        Kind::Choice(texts) => table.choice(name, texts)?.map(|text| Value::Text(text.to_string())),
        Kind::Choices(texts) => table.choices(name, texts)?.map(|chosen| {
            Value::Choices(texts.iter().copied().filter(|text| chosen.contains(text)).collect())
        }),
        Kind::Number(low, high, unit) => table.number_in(name, low..=high, unit)?.map(Value::Number),
        Kind::Cells(low, high) => {
            let cell = cell.ok_or_else(|| Error::Internal(format!("{name} comes before the cell")))?;
            let unit = format!("m ({low} to {high} cells)");
            table.number_in(name, low * cell..=high * cell, &unit)?.map(Value::Number)
        }
        Kind::Whole(low, high) => table.integer_in(name, low..=high)?.map(Value::Whole),
        Kind::Numbers(count, limit, unit) => numbers(name, table, count, limit, unit)?,
        Kind::Named(limit) => match table.named_numbers(name)? {
            Some(named) if named.values().any(|number| number.abs() > limit) => {
                return Err(table.error(name, format!("must hold numbers within {limit} of 0")));
            }
            named => named.map(Value::Named),
        },
        Kind::File(extensions) => {
            table.path(name)?.map(|path| file(key, table, path, extensions, "")).transpose()?
        }
        Kind::HeightOrFile(limit, extensions) => match (table.path(name), table.number(name)) {
            (Ok(Some(path)), _) => Some(file(key, table, path, extensions, "a number or ")?),
            (_, Ok(None)) => None,
            (_, Ok(Some(height))) if height.abs() <= limit => Some(Value::Number(height)),
            (_, Ok(Some(_))) => return Err(table.error(name, format!("must lie in -{limit} to {limit} m"))),
            (_, Err(_)) => return Err(table.error(name, "must be a number (m) or the name of a mesh file")),
        },
        Kind::NumbersOrFile(count, limit, unit, extensions) => match table.path(name) {
            Ok(Some(path)) => Some(file(key, table, path, extensions, &format!("{count} numbers or "))?),
            _ => numbers(name, table, count, limit, unit)?,
        },
        Kind::Poses(limit) if table.has(name) => Some(Value::Poses(poses(name, table, limit)?)),
        Kind::Poses(_) => None,
    })
}

fn numbers(name: &str, table: &Table, count: usize, limit: f64, unit: &str) -> Result<Option<Value>> {
    let numbers = table.numbers(name, count)?;
    if numbers.iter().flatten().any(|number| number.abs() > limit) {
        return Err(table.error(name, format!("must lie within {limit} {unit} of 0")));
    }
    Ok(numbers.map(Value::Numbers))
}

fn file(key: &Key, table: &Table, path: PathBuf, extensions: &[&str], or: &str) -> Result<Value> {
    if extensions.contains(&extension(&path).as_str()) {
        return Ok(Value::File(path));
    }
    let name = file_name(&path);
    let advice = particles::advice(&path).filter(|_| extensions.contains(&"bgeo"));
    let advice = advice.map_or(String::new(), |advice| format!(": {advice}"));
    Err(table.error(key.name, format!("must be {or}a {} file, not \"{name}\"{advice}", any_of(extensions))))
}

/// ".glb, .gltf or .obj".
pub fn any_of(extensions: &[&str]) -> String {
    joined(extensions.iter().map(|extension| format!(".{extension}")).collect(), "or")
}

fn poses(name: &str, object: &Table, limit: f64) -> Result<Vec<KeyPose>> {
    let mut poses: Vec<KeyPose> = Vec::new();
    for table in object.tables(name, "keys of [[object]]", &["frame", "at", "turn_deg"])? {
        let frame = table.number_in("frame", -1.0e8..=1.0e8, "")?;
        let frame = frame.ok_or_else(|| table.error("frame", "is missing"))?;
        if poses.last().is_some_and(|before| before.frame >= frame) {
            return Err(table.error("frame", "must be greater than that of the key before it"));
        }
        let triple = |name: &str, limit: f64, what: &str| -> Result<[f64; 3]> {
            let numbers = table.numbers(name, 3)?.unwrap_or_else(|| vec![0.0; 3]);
            if numbers.iter().any(|number| number.abs() > limit) {
                return Err(table.error(name, what));
            }
            Ok([numbers[0], numbers[1], numbers[2]])
        };
        let at = triple("at", limit, &format!("must lie within {limit} m of the origin"))?;
        let turn_deg = triple("turn_deg", 1.0e6, "must lie in -1000000 to 1000000 degrees")?;
        poses.push(KeyPose { frame, at, turn_deg });
    }
    Ok(poses)
}

/// The default of a key that is left out.
fn default(
    key: &Key,
    preset: Option<&'static str>,
    table: &Table,
    cell: Option<f64>,
) -> Result<Option<Value>> {
    match preset.map_or(key.fallback, Fallback::Is) {
        Fallback::Required => Err(table.error(key.name, "is missing")),
        Fallback::Nothing => Ok(None),
        Fallback::Cells(cells) => Ok(cell.map(|cell| Value::Number(cells * cell))),
        Fallback::Is(text) => with_value(key.name, text, |table| read(key, table, cell)),
    }
}

/// A file's name without its folder.
pub(in crate::scene) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
