//! The declaration of a scene's key: all that reading, writing and describing it needs.

/// The part of a stage's work that depends on a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The state before the first frame, and everything after it.
    First,
    /// Every step; for a key of an object, only if the object moves.
    Step,
    /// The files of a frame.
    Output,
    /// For a key of an object: the first state if the object is static, every step if it moves.
    Object,
}

/// What a key may hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// First and last frame: `"1-120"`.
    Frames,
    /// `true` or `false`.
    Flag,
    /// A text.
    Text,
    /// One of these texts.
    Choice(&'static [&'static str]),
    /// A list of these texts, each once.
    Choices(&'static [&'static str]),
    /// A number between these two, in a unit that may be empty.
    Number(f64, f64, &'static str),
    /// A length (m) between these numbers of cells.
    Cells(f64, f64),
    /// A whole number between these two.
    Whole(i64, i64),
    /// A fixed count of numbers, each at most this far from 0, in a unit.
    Numbers(usize, f64, &'static str),
    /// A file with one of these extensions.
    File(&'static [&'static str]),
    /// A height (m) at most this far from 0, or a file with one of these extensions.
    HeightOrFile(f64, &'static [&'static str]),
    /// A fixed count of numbers, each at most this far from 0, in a unit; or a file with one of these extensions.
    NumbersOrFile(usize, f64, &'static str, &'static [&'static str]),
    /// A table of numbers by names that the scene chooses, each at most this far from 0.
    Named(f64),
    /// Rigid poses at frames, each position at most this far from the origin (m).
    Poses(f64),
}

/// The default of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fallback {
    /// No default: the key is required.
    Required,
    /// No value.
    Nothing,
    /// A value, in TOML.
    Is(&'static str),
    /// A length (m), given as a number of cells.
    Cells(f64),
}

/// The key's line in the scene that `frazil new` prints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// Its value in TOML; `None`: the default.
    pub value: Option<&'static str>,
    /// Whether the line is active; else it is commented out.
    pub is_shown: bool,
}

/// The default of a key, and its line in a starter scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unset {
    fallback: Fallback,
    example: Example,
}

/// A default, in TOML.
pub const fn or(value: &'static str) -> Unset {
    Unset { fallback: Fallback::Is(value), example: Example { value: None, is_shown: false } }
}

/// A default in cells.
pub const fn or_cells(cells: f64) -> Unset {
    Unset { fallback: Fallback::Cells(cells), ..or("") }
}

/// No default; with an example value.
pub const fn optional(example: &'static str) -> Unset {
    Unset { fallback: Fallback::Nothing, ..or("") }.such_as(example)
}

/// Leaving the key out is an error; with an example value.
pub const fn required(example: &'static str) -> Unset {
    Unset { fallback: Fallback::Required, ..or("") }.such_as(example)
}

impl Unset {
    /// With this value in the example.
    pub const fn such_as(self, value: &'static str) -> Self {
        Self { example: Example { value: Some(value), is_shown: false }, ..self }
    }

    /// With an example that is not commented out.
    pub const fn shown(self) -> Self {
        Self { example: Example { is_shown: true, ..self.example }, ..self }
    }
}

/// The stages that depend on a key.
pub type Scopes = &'static [(&'static str, Scope)];

/// A key of a scene. Once declared in its system's list, a key is read, checked, written with its default and documented; a stage gets its
/// value from [`super::Values`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Its table, such as `snow.noise`; `object` for every `[[object]]`.
    pub table: &'static str,
    /// Its name in the table.
    pub name: &'static str,
    /// What it may hold.
    pub kind: Kind,
    /// Its default.
    pub fallback: Fallback,
    /// Presets with their defaults, in TOML: the default of the preset that the table's `preset` or `liquid` names replaces `fallback`.
    pub presets: &'static [(&'static str, &'static str)],
    /// Its line in a starter scene.
    pub example: Example,
    /// Whether it applies to characters (glTF) only.
    pub of_characters: bool,
    /// Its meaning, for the resolved scene, the starter scene and the reference.
    pub meaning: &'static str,
    /// The stages that depend on it.
    pub scopes: Scopes,
}

/// A key of a table, with the stages that depend on it.
pub const fn key(scopes: Scopes, table: &'static str, name: &'static str, kind: Kind, unset: Unset) -> Key {
    let Unset { fallback, example } = unset;
    Key { table, name, kind, fallback, presets: &[], example, of_characters: false, meaning: "", scopes }
}

impl Key {
    /// With this meaning.
    pub const fn means(self, meaning: &'static str) -> Self {
        Self { meaning, ..self }
    }

    /// With these [`Key::presets`].
    pub const fn with_presets(self, presets: &'static [(&'static str, &'static str)]) -> Self {
        Self { presets, ..self }
    }

    /// For characters (glTF) only.
    pub const fn of_characters(self) -> Self {
        Self { of_characters: true, ..self }
    }

    /// The part of a stage that depends on it.
    pub fn scope(&self, stage: &str) -> Option<Scope> {
        self.scopes.iter().find(|(name, _)| *name == stage).map(|(_, scope)| *scope)
    }
}

/// The table of objects.
pub const OBJECT: &str = "object";
/// The arrays of tables (`[[object]]`).
pub const TABLE_ARRAYS: [&str; 6] = [OBJECT, "scalar", "pour", "source", "drain", "absorber"];

/// Whether a table is an element of an array of tables.
pub fn is_table_array(table: &str) -> bool {
    TABLE_ARRAYS.contains(&table)
}

/// A table as a scene writes it: `[snow]`, `[[object]]`.
pub fn heading(table: &str) -> String {
    if is_table_array(table) { format!("[[{table}]]") } else { format!("[{table}]") }
}
