//! The base layer, and whole shots with snow.

pub mod base_layer;
pub mod bytes;
pub mod damaged_folder;
pub mod far;
pub mod grains;
pub mod grains_alone;
pub mod mist;
pub mod plates;
pub mod shot;
pub mod speed;
pub mod table_3_1;
pub mod volumes;
