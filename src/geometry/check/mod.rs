//! Properties of a mesh: its topology, faults and orientation, decided by exact predicates.

pub mod deviation;
pub mod duplicates;
pub mod edges;
pub mod faults;
pub mod intersection;
pub mod orientation;
pub mod predicates;
pub mod topology;
