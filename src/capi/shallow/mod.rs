//! Small amounts of liquid on a terrain.

// In the order of the header.
pub mod params;

pub mod handle;

pub mod liquid;

pub mod flow_points;

pub mod sources;

pub mod terrain;

pub mod read;

pub mod state;

pub mod surface;

pub mod scalars;

pub mod drops;

pub mod loads;

pub mod stains;

pub mod snapshot;

pub(in crate::capi) mod calls;
pub(in crate::capi) mod ground;
pub(in crate::capi) mod surroundings;
