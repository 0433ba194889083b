//! The C ABI: what `include/frazil.h` declares. Thin: arguments are checked and turned into the library's types,
//! results are handed out; nothing is computed here.
//!
//! One file for each noun. Raw pointers are followed in `views.rs` and `handle.rs` only; every function runs inside
//! [`guard::guard`]. The texts of this room are the header's: cbindgen copies them.
#![allow(non_camel_case_types)]

// In the header's order.
mod guard;

pub mod library;

pub mod pool;

pub mod context;

mod views;

pub mod mesh;

#[cfg(feature = "vdb")]
pub mod grid;

#[cfg(feature = "vdb")]
pub mod grid_sample;

#[cfg(feature = "vdb")]
pub mod grid_bytes;

#[cfg(feature = "vdb")]
pub mod body;

#[cfg(feature = "vdb")]
pub mod level_set;

#[cfg(feature = "vdb")]
pub mod snow;

#[cfg(feature = "vdb")]
pub mod base;

mod handle;

pub use guard::frz_status;
pub use views::{frz_span, frz_view};
