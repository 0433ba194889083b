//! Reads a scene file: its tables, the values of their keys, and the typed data of its system.

use std::path::{Path, PathBuf};

use toml::de::DeTable;

use crate::error::{Error, Result};
use crate::scene::schema::declaration::{Fallback, Key, heading, is_table_array};
use crate::scene::schema::overrides::Override;
use crate::scene::schema::shared_keys;
use crate::scene::schema::shared_keys::tables;
use crate::scene::schema::toml_table::{Document, Table};
use crate::scene::schema::values::Values;
use crate::scene::{Object, Output, Scene, Shallow, Shot, Snow, Surface, System, snow};

impl Scene {
    /// Reads a scene file. Relative paths in it are taken from its own folder.
    ///
    /// # Errors
    /// An unreadable file, a TOML error, an unknown key, a wrong type or a value out of range, each with file and line.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_with(path, &[])
    }

    /// Reads a scene file with settings of the command line overriding its own; relative paths in these settings start from the current
    /// folder.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read_with(path: &Path, overrides: &[Override]) -> Result<Self> {
        Self::parse(&text_of(path)?, path, overrides)
    }

    /// Reads a scene from text; `path` is its name in messages, and its folder the start of relative paths.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, path: &Path, overrides: &[Override]) -> Result<Self> {
        Self::parse_keys(text, path, overrides, super::keys::of)
    }

    /// As [`Scene::parse`], with another list of keys.
    pub(in crate::scene) fn parse_keys(
        text: &str,
        path: &Path,
        overrides: &[Override],
        keys_of: impl Fn(System) -> &'static [Key],
    ) -> Result<Self> {
        let document = Document { path, text, folder: folder_of(path)?, overrides };
        let mut root = DeTable::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            document.error(offset, error.message().trim().replace('\n', ", "))
        })?;
        for (index, setting) in overrides.iter().enumerate() {
            setting.apply(root.get_mut(), document.offset_of_override(index), path)?;
        }
        let system = System::of(&document, root.get_ref())?;
        let keys = keys_of(system);
        let root = Table::open(&document, "", root.get_ref(), 0, &known_names(keys, ""))?;
        let mut values = Values::new(keys);
        for table in tables(keys).into_iter().filter(|table| !table.contains('.')) {
            read_table(&document, &root, table, &mut values)?;
        }
        if !root.has(system.name()) {
            return Err(root.error(system.name(), "is missing"));
        }
        Ok(Self::of(path, system, values))
    }

    /// The scene with these values.
    fn of(path: &Path, system: System, values: Values) -> Self {
        Self {
            path: path.to_path_buf(),
            system,
            shot: Shot::of(&values),
            snow: Snow::of(&values),
            surface: Surface::of(&values),
            shallow: Shallow::of(&values),
            // Objects of a shallow liquid are obstacles: see `Shallow::obstacles`.
            objects: if system == System::Shallow { Vec::new() } else { Object::all_of(&values) },
            output: Output::of(&values),
            values,
        }
    }

    /// Makes the cells `factor` times as large, for a preview; noise too fine for them becomes coarser.
    ///
    /// # Errors
    /// A layer from a .vdb file, whose cells are fixed; a cell out of range.
    pub fn coarsen(&mut self, factor: f64) -> Result<()> {
        let mut values = self.values.clone();
        self.snow()?
            .coarsen(factor, &mut values)
            .map_err(|what| Error::argument(format!("{}: {what}", self.path.display())))?;
        *self = Self::of(&self.path, self.system, values);
        Ok(())
    }
}

impl System {
    /// The system whose table a scene has; snow if it has none: the missing table is then reported.
    fn of(document: &Document, root: &DeTable) -> Result<Self> {
        let key = |system: Self| root.keys().find(|key| key.get_ref() == system.name());
        let offset = |system: Self| Some((key(system)?.span().start, system));
        let mut present: Vec<(usize, Self)> = Self::ALL.into_iter().filter_map(offset).collect();
        present.sort_by_key(|(offset, _)| *offset);
        match present[..] {
            [] => Ok(Self::Snow),
            [(_, system)] => Ok(system),
            [(_, first), (offset, second), ..] => {
                let [first, second] = [first, second].map(Self::name);
                Err(document.error(offset, format!("a scene has one system, not [{first}] and [{second}]")))
            }
        }
    }
}

/// Reads a table and the tables in it, or an array of tables. Among missing tables only `[shot]` is an error here: the caller checks for
/// the system's own table.
fn read_table<'d>(
    document: &'d Document<'d>,
    root: &Table<'d, '_>,
    name: &str,
    values: &mut Values,
) -> Result<()> {
    let keys = values.keys();
    if is_table_array(name) {
        let tables = root.tables(name, &heading(name), &known_names(keys, name))?;
        return tables.iter().enumerate().try_for_each(|(index, table)| {
            values.read(name, Some(index), table)?;
            if root.has(System::Shallow.name()) {
                Shallow::check_each(name, index, table, values)
            } else {
                Ok(())
            }
        });
    }
    let table = match root.table(name, &heading(name), &known_names(keys, name))? {
        Some(table) => table,
        None if name == "shot" => return Err(root.error(name, "is missing")),
        None if shared_keys::OPTIONAL_TABLES.contains(&name) => return Ok(()),
        None if keys.iter().any(|key| key.table == name && key.fallback == Fallback::Required) => {
            return Ok(());
        }
        None => Table::absent(document, &heading(name)),
    };
    values.read(name, None, &table)?;
    check(name, &table, values)?;
    for inner in inner_tables(keys, name) {
        let path = format!("{name}.{inner}");
        let inner = table.table(inner, &heading(&path), &known_names(keys, &path))?;
        let inner = inner.unwrap_or_else(|| Table::absent(document, &heading(&path)));
        values.read(&path, None, &inner)?;
        check(&path, &inner, values)?;
    }
    Ok(())
}

/// Checks the keys of a table in combination.
fn check(name: &str, table: &Table, values: &Values) -> Result<()> {
    match name {
        "snow" => Snow::check(table, values),
        "snow.noise" => Snow::check_noise(table, values),
        "grains" => snow::check_grains(table, values),
        "mist" => snow::check_mist(table, values),
        "shallow" => Shallow::check(table, values),
        "output" => Output::check(table, values),
        _ => Ok(()),
    }
}

/// The names of a table's keys, and of the tables in it; an empty name stands for the file itself.
fn known_names(keys: &[Key], table: &str) -> Vec<&'static str> {
    let own = keys.iter().filter(|key| key.table == table).map(|key| key.name);
    own.chain(inner_tables(keys, table)).collect()
}

/// The names of the tables in a table.
fn inner_tables(keys: &[Key], table: &str) -> Vec<&'static str> {
    let inner = |name: &'static str| match table {
        "" => Some(name),
        _ => name.strip_prefix(table)?.strip_prefix('.'),
    };
    tables(keys).into_iter().filter_map(inner).filter(|name| !name.contains('.')).collect()
}

/// The text of a scene file.
pub(super) fn text_of(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, "read", error))?;
    String::from_utf8(bytes).map_err(|_| Error::file(path, "is not a text file"))
}

/// The absolute folder that a scene's relative paths start from.
pub(super) fn folder_of(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).map_err(|error| Error::io(path, "find", error))?;
    Ok(absolute.parent().unwrap_or(Path::new("/")).to_path_buf())
}
