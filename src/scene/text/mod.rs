//! Scene files: the text of a document read key by key into a [`super::Scene`], and written back with every default.

mod file;
mod frames;
pub(super) mod keys;
mod objects;
mod overrides;
mod resolved;
mod table;
pub mod template;

pub use frames::{FrameChoice, Frames};
pub use overrides::Override;

pub(super) use file::name;
