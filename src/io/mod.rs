//! Files that are not .vdb.

pub mod atomic;
mod bgeo;
#[doc(hidden)]
pub mod caught;
#[doc(hidden)]
pub mod extras;
#[cfg(feature = "cli")]
pub mod grey;
pub mod hash;
pub mod manifest;
pub mod mesh;
mod numbers;
mod obj;
pub mod particles;
mod ply;
mod ply_header;
mod ply_write;
pub mod points_ply;
#[doc(hidden)]
pub mod sealed;
pub mod seen;
pub mod sequence;
#[doc(hidden)]
pub mod source;
mod stl;
mod stl_text;
mod text;
pub mod usd;
pub mod usd_looks;
pub mod usd_points;
pub mod usd_primvars;
mod vtk;
mod vtu;
mod vtu_data;
mod xyz;
