//! Files that are not .vdb.

pub mod atomic;
#[doc(hidden)]
pub mod caught;
#[doc(hidden)]
pub mod extras;
pub mod hash;
pub mod manifest;
pub mod mesh;
mod obj;
mod ply;
pub mod points_ply;
#[doc(hidden)]
pub mod sealed;
pub mod seen;
pub mod sequence;
#[doc(hidden)]
pub mod source;
mod stl;
pub mod usd;
pub mod usd_looks;
pub mod usd_points;
