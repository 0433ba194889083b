//! Merges and splits: where the mesh no longer fits its liquid, and how it changes there.

pub(in crate::surface) mod change;
pub(in crate::surface) mod coverage;
mod dry_parts;
mod hidden;
pub(in crate::surface) mod lost_vertices;
pub(in crate::surface) mod matching;
mod mesh_distance;
mod mismatch;
pub(in crate::surface) mod particle_count;
pub(in crate::surface) mod uncovered_parts;
