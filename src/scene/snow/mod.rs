//! Snow in scenes: its keys, and with OpenVDB the contents of its files ([`Inputs`]), the check ([`check`]), memory estimates, and its
//! stages: the base layer (`stages/base.rs`), grains (`stages/grains.rs`), mist (`stages/mist.rs`) and volumes for rendering
//! (`stages/volumes.rs`).

#[cfg(feature = "vdb")]
pub mod check;
#[cfg(feature = "vdb")]
mod estimate;
#[cfg(feature = "vdb")]
mod grain_params;
#[cfg(feature = "vdb")]
mod initial_grains;
#[cfg(feature = "vdb")]
mod inputs;
#[cfg(feature = "vdb")]
mod inspect;
mod keys;
#[cfg(feature = "vdb")]
mod moving_objects;
#[cfg(feature = "vdb")]
mod pipeline;
#[cfg(feature = "vdb")]
mod stages;
#[cfg(feature = "vdb")]
mod wind;

pub(super) use keys::grains::{GRAIN_KEYS, check_grains, has_grains};
pub(super) use keys::mist::{MIST_KEYS, check_mist, has_mist};
pub(super) use keys::output::OUTPUT_KEYS;
pub(super) use keys::snow::KEYS;
pub(super) use keys::volumes::check_volumes;
#[cfg(feature = "vdb")]
pub use {
    estimate::costs::costs,
    estimate::grains::Forecast,
    estimate::memory::{check as check_memory, estimate},
    estimate::mist::MistForecast,
    inputs::Inputs,
    inspect::foot_slip::FootSlip,
    moving_objects::MovingObjects,
    pipeline::pipeline,
    stages::grain_reader::RebuildGrains,
    stages::rebuild::Rebuild,
};
