//! The C ABI that `include/frazil.h` declares. Thin: arguments are checked and converted to the library's types,
//! results are handed out; nothing is computed here.
//!
//! One file for each noun. Raw pointers are followed in `views.rs` and `handle.rs` only; every function runs inside
//! `guard::guard`. The texts of this room are the header's: cbindgen copies them, and `float[3]` is not a link.
//!
//! # Safety
//! Every function has the same requirements, as stated in the header's preamble: pointers are NULL or point to what
//! their parameter says, handles were not destroyed, views describe memory that may be read, spans such that may be
//! written.
#![allow(non_camel_case_types, clippy::missing_safety_doc, clippy::too_many_arguments)]
#![allow(rustdoc::broken_intra_doc_links)]
// What only grids and the systems need.
#![cfg_attr(not(feature = "vdb"), allow(dead_code, unused_imports))]

// In the header's order.
mod guard;

pub mod library;

pub mod pool;

pub mod context;

mod views;

pub mod mesh;

pub mod repair;

#[cfg(feature = "vdb")]
pub mod grid;

#[cfg(feature = "vdb")]
pub mod grid_create;

#[cfg(feature = "vdb")]
pub mod grid_leaves;

#[cfg(feature = "vdb")]
pub mod grid_sample;

#[cfg(feature = "vdb")]
pub mod grid_bytes;
#[cfg(feature = "vdb")]
pub mod grid_guarded;

#[cfg(feature = "vdb")]
pub mod body;

#[cfg(feature = "vdb")]
pub mod level_set;

#[cfg(feature = "vdb")]
pub mod snow;

#[cfg(feature = "vdb")]
pub mod base;

#[cfg(feature = "vdb")]
pub mod grains_params;

#[cfg(feature = "vdb")]
pub mod grains;

#[cfg(feature = "vdb")]
pub mod grains_points;

#[cfg(feature = "vdb")]
pub mod mist_params;

#[cfg(feature = "vdb")]
pub mod mist;

#[cfg(feature = "vdb")]
pub mod mist_points;

pub mod tracker_params;

pub mod tracker;

pub mod tracker_eased;

pub mod tracker_edits;

pub mod tracker_rest;

pub mod tracker_sculpt;

pub mod shallow_params;

pub mod shallow;

pub mod shallow_flows;

pub mod shallow_terrain;

pub mod shallow_read;

pub mod shallow_state;

pub mod shallow_surface;

pub mod shallow_ledges;
pub mod shallow_lifts;

pub mod shallow_scalars;

pub mod shallow_drops;

pub mod shallow_loads;

pub mod shallow_stains;

pub mod shallow_snapshot;

pub mod shallow_detail;

pub mod shallow_detail_ground;

pub mod shallow_detail_scalars;

mod shallow_lists;

mod handle;
mod saved;

pub use guard::frz_status;
pub use views::{frz_span, frz_view};
