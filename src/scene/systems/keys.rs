//! The keys of each system.

use crate::scene::System;
use crate::scene::schema::declaration::Key;
use crate::scene::schema::declaration::OBJECT;
use crate::scene::schema::shared_keys::{OBJECTS, OUTPUT, SHOT};
use crate::scene::schema::{keys_json_of, reference_of, template_of};
use crate::scene::shallow;
use crate::scene::snow;
use crate::scene::surface;
use std::sync::LazyLock;

/// The keys of a system's scenes, in the order of a scene: the shot, the system, the objects (shared keys first), the output.
pub fn of(system: System) -> &'static [Key] {
    static SNOW: LazyLock<Vec<Key>> = LazyLock::new(|| {
        let own = [snow::KEYS, snow::GRAIN_KEYS, snow::MIST_KEYS, snow::OUTPUT_KEYS];
        ordered([SHOT, OBJECTS, &own.concat()[..], OUTPUT])
    });
    static SURFACE: LazyLock<Vec<Key>> = LazyLock::new(|| ordered([SHOT, surface::KEYS, OUTPUT]));
    static SHALLOW: LazyLock<Vec<Key>> =
        LazyLock::new(|| ordered([SHOT, shallow::KEYS, shallow::TABLE_ARRAY_KEYS, OUTPUT]));
    match system {
        System::Snow => &SNOW,
        System::Surface => &SURFACE,
        System::Shallow => &SHALLOW,
    }
}

fn ordered<const N: usize>(lists: [&[Key]; N]) -> Vec<Key> {
    let mut keys = lists.concat();
    keys.sort_by_key(|key| match key.table {
        "shot" => 0,
        OBJECT => 2,
        "output" => 3,
        _ => 1,
    });
    keys
}

/// A commented starter scene: every key of a system; optional ones are commented out.
pub fn template(system: System) -> String {
    template_of([system.title(), system.name()], of(system))
}

/// A table of a system's keys in Markdown: type, unit, range, default and meaning.
pub fn reference(system: System) -> String {
    reference_of(of(system))
}

/// A system's keys as JSON: an array of objects with the fields `table`, `is_table_array` (any number of such tables), `is_optional_table`
/// (a stage exists only with it), `name`, `kind`, `choices`, `min`, `max`, `count`, `unit`, `extensions`, `default`, `default_cells`,
/// `is_required`, `presets`, `of_characters` and `meaning`. Those that do not apply are null or empty.
pub fn keys_json(system: System) -> serde_json::Value {
    keys_json_of(of(system))
}
