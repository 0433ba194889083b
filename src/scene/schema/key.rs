//! How a key of a scene is declared: all that reading, writing and describing it needs.

/// Which part of a stage's work depends on a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The state before the first frame, and all that follows.
    First,
    /// Every step; for a key of an object, only if it moves.
    Step,
    /// What is written of a frame.
    Output,
    /// As its object's role has it: the first state for a static one, every step for one that moves.
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
    /// A number from the first to the second, in a unit that may be empty.
    Number(f64, f64, &'static str),
    /// A length (m) from the first to the second number of cells.
    Cells(f64, f64),
    /// A whole number from the first to the second.
    Whole(i64, i64),
    /// So many numbers, each at most so far from 0, in a unit.
    Numbers(usize, f64, &'static str),
    /// A file with one of these extensions.
    File(&'static [&'static str]),
    /// A height (m) at most so far from 0, or a file with one of these extensions.
    HeightOrFile(f64, &'static [&'static str]),
    /// So many numbers, each at most so far from 0, in a unit; or a file with one of these extensions.
    NumbersOrFile(usize, f64, &'static str, &'static [&'static str]),
    /// A table of numbers by names of the scene's own, each at most so far from 0.
    Named(f64),
    /// Rigid poses at frames, each position at most so far from the origin (m).
    Poses(f64),
}

/// What is taken where a key is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fallback {
    /// It may not be left out.
    Required,
    /// Nothing.
    Nothing,
    /// A value, as a scene writes it.
    Is(&'static str),
    /// So many cells (m).
    Cells(f64),
}

/// A line of the scene that `frazil new` prints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Example {
    /// The default, behind a `#`.
    Default,
    /// A value, behind a `#`.
    Other(&'static str),
    /// A value that a scene needs.
    Needed(&'static str),
}

/// A key of a scene. A new one is declared in its system's list and is then read, checked, written with its default and
/// described; a stage takes its value from [`super::Values`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Its table, as in `snow.noise`; `object` for all objects.
    pub table: &'static str,
    /// Its name in the table.
    pub name: &'static str,
    /// What it may hold.
    pub kind: Kind,
    /// What is taken where it is left out.
    pub fallback: Fallback,
    /// What is taken instead where the table's `preset`, or `liquid`, has one of these names, as a scene writes it.
    pub presets: &'static [(&'static str, &'static str)],
    /// Its line in a scene to begin with.
    pub example: Example,
    /// Whether it is for characters only.
    pub of_characters: bool,
    /// What it means, in the resolved scene, in a scene to begin with and in the reference.
    pub meaning: &'static str,
    /// The stages that depend on it.
    pub scopes: &'static [(&'static str, Scope)],
}

impl Key {
    /// A key that may not be left out.
    pub const fn new(table: &'static str, name: &'static str, kind: Kind, meaning: &'static str) -> Self {
        Self {
            table,
            name,
            kind,
            fallback: Fallback::Required,
            presets: &[],
            example: Example::Default,
            of_characters: false,
            meaning,
            scopes: &[],
        }
    }

    /// What is taken where it is left out: a value as a scene writes it.
    pub const fn or(self, value: &'static str) -> Self {
        Self { fallback: Fallback::Is(value), ..self }
    }

    /// What is taken where it is left out: so many cells.
    pub const fn or_cells(self, cells: f64) -> Self {
        Self { fallback: Fallback::Cells(cells), ..self }
    }

    /// What is taken instead where the table's `preset`, or `liquid`, has one of these names.
    pub const fn with_presets(self, presets: &'static [(&'static str, &'static str)]) -> Self {
        Self { presets, ..self }
    }

    /// It may be left out, and then has no value.
    pub const fn or_nothing(self) -> Self {
        Self { fallback: Fallback::Nothing, ..self }
    }

    /// Its value in a scene to begin with, behind a `#`.
    pub const fn such_as(self, value: &'static str) -> Self {
        Self { example: Example::Other(value), ..self }
    }

    /// Its value in a scene to begin with.
    pub const fn begins_with(self, value: &'static str) -> Self {
        Self { example: Example::Needed(value), ..self }
    }

    /// It is for characters only.
    pub const fn of_characters(self) -> Self {
        Self { of_characters: true, ..self }
    }

    /// The stages that depend on it.
    pub const fn concerns(self, scopes: &'static [(&'static str, Scope)]) -> Self {
        Self { scopes, ..self }
    }

    /// What of a stage depends on it.
    pub fn scope(&self, stage: &str) -> Option<Scope> {
        self.scopes.iter().find(|(name, _)| *name == stage).map(|(_, scope)| *scope)
    }
}

/// The table of objects, of which a scene may have many.
pub const OBJECT: &str = "object";
/// All tables of which a scene may have many.
pub const MANY: [&str; 6] = [OBJECT, "scalar", "pour", "source", "drain", "absorber"];

/// Whether a scene may have many of a table.
pub fn is_many(table: &str) -> bool {
    MANY.contains(&table)
}

/// A table as a scene writes it: `[snow]`, `[[object]]`.
pub fn heading(table: &str) -> String {
    if is_many(table) { format!("[[{table}]]") } else { format!("[{table}]") }
}
