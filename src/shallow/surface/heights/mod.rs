//! Heights at which columns are shown.

pub mod minimum_heights;
pub(in crate::shallow) mod shown;
