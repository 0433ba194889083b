//! Scene files as text, for any list of keys: no system is known here (`systems/` knows all).
//!
//! A key is declared once, as a [`declaration::Key`]: those that systems share in `shared_keys.rs`, all others in the keys of their
//! system. Reading and checking (`toml_table.rs`, `values.rs`), settings of the command line (`overrides.rs`), the starter scene and the
//! table of keys (`documentation.rs`) follow from the declarations.

pub(super) mod declaration;
pub(super) mod documentation;
pub(super) mod edited_text;
mod frames;
pub(super) mod overrides;
pub(super) mod shared_keys;
pub(super) mod toml_table;
pub(super) mod values;

pub use frames::{FrameChoice, Frames};
pub use overrides::Override;
pub use values::{Value, Values};

pub(super) use crate::scene::schema::values::file_name;
pub(super) use documentation::{keys_json_of, reference_of, rounded, template_of};
pub(super) use shared_keys::{FAR, NO_ORIGIN, ORIGIN, ORIGIN_MEANS};
pub(super) use toml_table::Table;
