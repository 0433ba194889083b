//! What hosts read from a liquid: snapshots, probes, loads on bodies.

pub mod body_loads;
pub mod probe;
pub mod snapshot;
