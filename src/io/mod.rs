//! Files that are not .vdb.

pub mod atomic;
pub mod mesh;
mod obj;
mod ply;
pub mod sequence;
