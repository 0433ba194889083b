//! Shots: the frame loop that runs any stage over its frames, and the resulting folder.
//!
//! A shot is made by stages ([`Stage`]), each in one pass over the frames (`pass.rs`); a [`Pipeline`] lists the stages of a scene. Every
//! stage has its own records, so that it is made again only if something that it depends on has changed: its settings (`settings.rs`), the
//! files that a frame reads and the frames of stages upstream of it (`chain.rs`). A frame is done when its record exists
//! ([`DoneFrames`]). `cache.rs` knows which frames were made with which settings, `own_files.rs` which files of the folder may be
//! overwritten. [`Run`] drives everything, [`verify`] compares a folder with its records, `usd.rs` describes the shot to other programs.
//! [`FrameCosts`] and [`Pace`] are for forecasts of the time that a run still takes.

mod cache;
mod chain;
mod costs;
mod done_frames;
mod going_back;
mod own_files;
mod pace;
mod pass;
mod pipeline;
mod runner;
pub(in crate::scene) mod settings;
mod stage;
mod usd;
pub mod verify;

pub use costs::FrameCosts;
pub use done_frames::DoneFrames;
pub use pace::Pace;
pub use pass::{AnyStage, FrameDone};
pub use pipeline::Pipeline;
pub use runner::{Run, ToMake};
#[cfg(test)]
pub(in crate::scene) use settings::changed;
pub use settings::{CONTENT, Settings};
pub use stage::{FileKind, FrameFiles, Reads, Report, Stage, StepTarget, Stepped, Stepping, Volume};
