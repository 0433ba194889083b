//! Files that are not .vdb.

pub mod atomic;
