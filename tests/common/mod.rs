//! What tests, benchmarks and examples share: shapes made by code.
#![allow(dead_code)]

pub mod boot;
pub mod character;
pub mod clients;
pub mod folded;
pub mod header;
pub mod hero;
pub mod liquids;
pub mod shapes;
pub mod sleigh;
pub mod tools;
pub mod walk;
