//! frazil: a volumetric toolkit for visual effects.
//!
//! Rooms are layered; a room uses only the rooms below it (see `CONTRIBUTING.md`).

pub mod base;
pub mod capi;
pub mod context;
pub mod error;
pub mod io;
pub mod motion;
#[cfg(feature = "cli")]
pub mod render;
#[cfg(feature = "cli")]
pub mod scene;
#[cfg(feature = "vdb")]
pub mod snow;
pub mod sweep;
#[cfg(feature = "vdb")]
pub mod vdb;

pub use context::{Context, Pool};
pub use error::{Error, Result};
