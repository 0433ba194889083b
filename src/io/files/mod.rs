//! File handling: files are read whole or not at all, written whole or not at all, hashed and numbered.

pub mod atomic;
#[doc(hidden)]
pub mod caught;
pub mod hash;
pub(in crate::io) mod numbers;
pub mod sequence;
#[doc(hidden)]
pub mod source;
pub(in crate::io) mod text;
