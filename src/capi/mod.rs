//! The C ABI that `include/frazil.h` declares. Thin: arguments are checked and converted to the library's types,
//! results are handed out; nothing is computed here.
//!
//! One file for each noun. Raw pointers are followed in `ffi/views.rs` and `ffi/handle.rs` only; every function runs inside
//! `ffi::guard::guard`. The texts of this room are the header's: cbindgen copies them, and `float[3]` is not a link.
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
mod ffi;

pub mod runtime;

pub mod mesh;

#[cfg(feature = "vdb")]
pub mod grid;

#[cfg(feature = "vdb")]
pub mod level_set;

#[cfg(feature = "vdb")]
pub mod snow;

pub mod tracker;

pub mod shallow;

pub mod shallow_two_level;

pub use ffi::guard::frz_status;
pub use ffi::views::{frz_span, frz_view};
