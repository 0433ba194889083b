//! Numbers: vector instructions, blocks of voxels, and exact states as bytes.

pub mod blocks;
pub mod bytes;
#[doc(hidden)]
pub mod cpu;
#[doc(hidden)]
pub mod digits;
#[doc(hidden)]
pub mod lanes;
#[doc(hidden)]
pub mod lists;
pub mod packed;
