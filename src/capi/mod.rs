//! The C ABI that `include/frazil.h` declares. A thin layer: arguments are checked and converted to the library's types, results are
//! converted back; nothing is computed here.
//!
//! One file for each kind of object. Arrays, structs and handles of a host are read and written in `ffi/`; every function runs inside
//! `ffi::guard::guard`. cbindgen copies the comments of this folder into the header; `float[3]` is not a link.
//!
//! # Safety
//! Every function has the same requirements, stated in the header's preamble: pointers are NULL or point to what their parameter states,
//! handles were not destroyed, views describe readable memory, spans writable memory.
#![allow(non_camel_case_types, clippy::missing_safety_doc, clippy::too_many_arguments)]
#![allow(rustdoc::broken_intra_doc_links)]
// Needed only by grids and the systems.
#![cfg_attr(not(feature = "vdb"), allow(dead_code, unused_imports))]

// In the order of the header.
mod ffi;

pub mod runtime;

pub mod mesh;

#[cfg(feature = "vdb")]
pub mod grid;

#[cfg(feature = "vdb")]
pub mod level_set;

#[cfg(feature = "vdb")]
pub mod geometry;

#[cfg(feature = "vdb")]
pub mod snow;

pub mod tracker;

pub mod shallow;

pub mod shallow_two_level;

pub use ffi::guard::frz_status;
pub use ffi::views::{frz_span, frz_view};
