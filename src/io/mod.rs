//! Files that are not .vdb.

pub mod atomic;
pub mod caught;
pub mod extras;
pub mod hash;
pub mod manifest;
pub mod mesh;
mod obj;
mod ply;
pub mod sealed;
pub mod seen;
pub mod sequence;
pub mod source;
mod stl;
pub mod usd;
