//! Records beside a shot's files: manifests, and hashes of what was read.

#[doc(hidden)]
pub mod checksummed;
pub mod input_hashes;
pub mod manifest;
