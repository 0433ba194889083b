//! The text of scene files, of any keys: no system is known here (`systems/` knows all). A key is declared once (`key.rs`: how; `keys.rs`:
//! shared keys; each system's `keys.rs`: its own); reading, defaults, ranges, the resolved scene, the starter scene, the reference and the
//! settings of the stages follow from that.

pub(super) mod declaration;
pub(super) mod documentation;
mod frames;
pub(super) mod overrides;
pub(super) mod shared_keys;
pub(super) mod toml_table;
pub(super) mod values;

pub use frames::{FrameChoice, Frames};
pub use overrides::Override;
pub use values::{Value, Values};

pub(super) use crate::scene::schema::values::name;
pub(super) use documentation::{reference_of, rounded, template_of};
pub(super) use shared_keys::{FAR, NO_ORIGIN, ORIGIN, ORIGIN_MEANS};
pub(super) use toml_table::Table;
