//! Snow in scenes: its keys, and with OpenVDB what its files hold ([`Inputs`]), what a check says of it ([`check`]), what memory
//! it takes, and its stages: the base layer (`base.rs`), grains (`grains.rs`), mist (`mist.rs`) and volumes to render (`volumes.rs`).

#[cfg(feature = "vdb")]
mod base;
#[cfg(feature = "vdb")]
pub mod check;
#[cfg(feature = "vdb")]
mod disk;
#[cfg(feature = "vdb")]
mod foot_slip;
#[cfg(feature = "vdb")]
mod forecast;
#[cfg(feature = "vdb")]
mod grain_files;
mod grain_keys;
#[cfg(feature = "vdb")]
mod grains;
#[cfg(feature = "vdb")]
mod initial_grains;
#[cfg(feature = "vdb")]
mod inputs;
mod keys;
#[cfg(feature = "vdb")]
mod memory;
#[cfg(feature = "vdb")]
mod mist;
#[cfg(feature = "vdb")]
mod mist_forecast;
mod mist_keys;
#[cfg(feature = "vdb")]
mod object_path;
mod output_keys;
#[cfg(feature = "vdb")]
mod plan;
#[cfg(feature = "vdb")]
mod rebuild;
#[cfg(feature = "vdb")]
mod relief;
#[cfg(feature = "vdb")]
mod settings;
mod volume_keys;
#[cfg(feature = "vdb")]
mod volumes;
#[cfg(feature = "vdb")]
mod warnings;

pub use foot_slip::Walk;
#[cfg(feature = "vdb")]
pub use forecast::Forecast;
pub use grain_files::{RebuildGrains, changes_since, partial};
pub(super) use grain_keys::{GRAIN_KEYS, check_grains, has_grains};
pub use inputs::Inputs;
pub(super) use keys::KEYS;
pub use memory::{check as check_memory, estimate};
pub use mist_forecast::MistForecast;
pub(super) use mist_keys::{MIST_KEYS, check_mist, has_mist};
pub(super) use output_keys::OUTPUT_KEYS;
pub use plan::plan;
pub use rebuild::Rebuild;
pub(super) use volume_keys::check_volumes;
