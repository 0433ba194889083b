//! Shots: the frame loop that runs any stage over its frames, and the folder that it leaves behind.
//!
//! A shot is made by stages ([`Stage`]), one pass over the frames each. A stage has records of its own, so that it is
//! made again only when what it depends on has changed: its settings (`settings.rs`), the files that a frame reads and
//! the frames of stages upstream of it (`chain.rs`). A frame is done when its record is there ([`Stored`]); which frames
//! belong to which settings stands in `cache.rs`, which files of the folder are ours in `run/own_files.rs`. `runner.rs` drives it all;
//! [`verify`] compares a folder with its records, `usd.rs` describes the shot to other programs.

mod cache;
mod chain;
mod own_files;
mod pass;
mod runner;
mod settings;
mod stage;
mod stored;
mod usd;
pub mod verify;

pub use pass::AnyStage;
pub use runner::{Plan, Run};
#[cfg(test)]
pub(in crate::scene) use settings::changed;
pub use settings::{CONTENT, Settings};
pub use stage::{FrameFiles, Kind, Reads, Report, Stage, Stepped, Stepping, To};
pub use stored::Stored;
pub use usd::{Clip, MovingMesh, Prims, Volume};
