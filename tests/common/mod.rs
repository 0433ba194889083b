//! What tests, benchmarks and examples share: shapes made by code.
#![allow(dead_code)]

pub mod bodies;
pub mod boot;
pub mod broken_meshes;
pub mod caches;
pub mod character;
pub mod clients;
pub mod exact_lines;
pub mod flowing;
pub mod folded;
pub mod followed;
pub mod gltf_maker;
pub mod gltf_variants;
pub mod header;
pub mod hero;
pub mod hills;
pub mod jelly;
pub mod liquids;
pub mod made_sets;
pub mod nearest;
pub mod oriented;
pub mod repaired;
pub mod rough_ground;
pub mod shallow;
pub mod shapes;
pub mod skip;
pub mod sleigh;
pub mod soups;
pub mod spot;
pub mod tools;
pub mod usda;
pub mod walk;
