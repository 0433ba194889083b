//! Merges and splits: finds where the mesh no longer fits its liquid, and changes it there.

pub(in crate::surface) mod change;
pub(in crate::surface) mod coverage;
mod dry_parts;
mod full_check;
pub(in crate::surface) mod lost_vertices;
pub(in crate::surface) mod matching;
mod mesh_distance;
pub(in crate::surface) mod particle_count;
pub(in crate::surface) mod uncovered_parts;
mod update;
