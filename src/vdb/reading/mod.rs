//! Reading .vdb files of unknown origin: another process decodes them and passes them on as a parcel.

mod child;
pub(in crate::vdb) mod decode;
pub mod guard;
mod head;
#[doc(hidden)]
pub mod layout;
mod mapping;
mod parcel;
mod parcel_points;
